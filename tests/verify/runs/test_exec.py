"""EXEC: every mutant of the running code and of a trace is refuted; honest runs hold, whatever is exercised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.edits import moved, with_signals
from builders.runs import run_of
from verify.judging import judge

from airground_drake.base.arrays import Array
from airground_drake.intervention import database
from airground_drake.intervention.messages import accepted_proposals
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc import law
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Obstacle, Policy, Scenario
from airground_drake.systems import components, controllers, diagram
from airground_drake.world.world import Kind, Neighbours, World

Patch = Callable[[pytest.MonkeyPatch], None]


def short(name: str = "case_b", **control: float) -> Scenario:
    """A shipped scenario."""
    scenario = load(name)[0]
    for key, value in control.items():
        setattr(scenario.control, key, value)
    return scenario


def refuted(trace: Trace) -> dict[str, Any]:
    finding = judge("EXEC", trace)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    return finding.counterexample


# ------------------------------------------------------------------------------------- mutants of the running code


def gain(name: str, factor: float) -> Patch:
    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        made = components.make_law

        def wrong(*arguments: Any) -> law.UgvLaw:
            honest = made(*arguments)
            return replace(honest, **{name: factor * getattr(honest, name)})

        monkeypatch.setattr(components, "make_law", wrong)

    return patch


def half_the_formation_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    made = diagram.UavController
    monkeypatch.setattr(diagram, "UavController", lambda *a, gain, **k: made(*a, gain=0.5 * gain, **k))


def no_feed_forward(monkeypatch: pytest.MonkeyPatch) -> None:
    made = controllers.FormationTask
    monkeypatch.setattr(diagram, "UAV_TASKS", _Tasks(lambda p, v, z, g: made(p, 0.0 * v, z, g)))


class _Tasks:
    def __init__(self, task: Any) -> None:
        self.task = task

    def load(self, name: str, of: type) -> Any:
        return self.task


def executed_whatever_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer is recorded as it was given."""
    honest = controllers.UgvController.velocity

    def velocity(
        self: Any, t: float, positions: Array, reference: Array, rate: Array, accepted: Any, *law: Any
    ) -> Array:
        return honest(self, t, positions, reference, rate, WAITING[:] or accepted, *law)

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        WAITING[:] = proposals
        return accepted_proposals(proposals, answers)

    monkeypatch.setattr(controllers.UgvController, "velocity", velocity)
    monkeypatch.setattr(controllers, "accepted_proposals", accepted)


WAITING: list[Proposal | None] = []


def executed_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """By one sample, and by one after it is over."""
    before: list[list[Proposal | None]] = [[None, None]]

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        before.append(accepted_proposals(proposals, answers))
        return before.pop(0)

    monkeypatch.setattr(controllers, "accepted_proposals", accepted)


def executed_after_it_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last one that was accepted, for ever."""
    last: list[Proposal | None] = [None, None]

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        last[:] = [new or old for new, old in zip(accepted_proposals(proposals, answers), last, strict=True)]
        return list(last)

    monkeypatch.setattr(controllers, "accepted_proposals", accepted)


def no_avoidance_of_one_ugv(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Neighbours, *rest: Any) -> Array:
        distance = near.distance.copy()
        distance[1] = -1e6
        return honest(self, positions, near._replace(distance=distance), *rest)

    monkeypatch.setattr(law.UgvLaw, "velocity", velocity)


def no_limit_of(monkeypatch: pytest.MonkeyPatch, kind: Kind) -> None:
    honest = World.around

    def around(self: World, rows: slice) -> Neighbours:
        near = honest(self, rows)
        return near._replace(max_speed=near.max_speed * (1e9 if rows == self.select(kind) else 1.0))

    monkeypatch.setattr(World, "around", around)


def no_speed_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    no_limit_of(monkeypatch, "ugv")


def no_speed_limit_of_the_uav(monkeypatch: pytest.MonkeyPatch) -> None:
    no_limit_of(monkeypatch, "uav")


def one_direction_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not a mutant: proposals concern one direction."""
    along = np.array([[1.0, 0.0, 0.0]])
    monkeypatch.setattr(database, "Proposal", lambda *given, **more: Proposal(*given, selection=along, **more))


def selection_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    one_direction_only(monkeypatch)
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Any, target: Array, rate: Array, asked: Any, *rest: Any) -> Array:
        everywhere = [None if one is None else one._replace(chosen=np.eye(3)) for one in asked]
        return honest(self, positions, near, target, rate, everywhere, *rest)

    monkeypatch.setattr(law.UgvLaw, "velocity", velocity)


def avoidance_gain_of_the_controller(monkeypatch: pytest.MonkeyPatch) -> None:
    made = components.make_avoidance
    monkeypatch.setattr(components, "make_avoidance", lambda *a: replace(made(*a), gain=0.0, period=2.0 * 0.05))


MUTANTS: dict[str, tuple[Patch, str]] = {
    "executed whatever the answer": (executed_whatever_the_answer, "d"),
    "executed late": (executed_late, "d"),
    "executed after it is over": (executed_after_it_is_over, "d"),
    "intervention gain times 1.2": (gain("intervention_gain", 1.2), "d"),
    "intervention gain times 1.2, on top": (gain("intervention_gain", 1.2), "c"),
    "intervention gain times 1.2, no gatekeeper": (gain("intervention_gain", 1.2), "b"),
    "motion gain times 0.98": (gain("motion_gain", 0.98), "d"),
    "formation gain times 0.5": (half_the_formation_gain, "d"),
    "UGVs' velocity not fed forward": (no_feed_forward, "d"),
    "avoidance not applied to one UGV": (no_avoidance_of_one_ugv, "d"),
    "selection ignored": (selection_ignored, "d"),
    "no speed limit": (no_speed_limit, "d"),
    "no speed limit of the UAV": (no_speed_limit_of_the_uav, "d"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_of_the_running_code_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, run_name = MUTANTS[name]
    scenario = short("case_a" if name == "selection ignored" else "case_b")
    scenario.ugvs["ugv1"].max_speed_m_s = 2.0 if name == "no speed limit" else 6.0
    if "UAV" in name or "fed forward" in name:
        scenario.uav.start_m = [20.0, -30.0, 2.0]  # far away, so that its limit matters
    patch(monkeypatch)
    found = refuted(simulate(scenario, run_name))
    if name == "executed whatever the answer":
        assert found["accepted_by_the_messages"] is found["accepted_by_the_signals"] is False
    assert (found["robot"] == "uav") == ("formation" in name or "UAV" in name or "fed" in name)


# ------------------------------------------------------------------------------------- honest runs


@pytest.mark.parametrize("run_name", ["b", "c", "d"])
def test_proposals_that_concern_one_direction_hold(run_name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    one_direction_only(monkeypatch)
    finding = judge("EXEC", simulate(short("case_a"), run_name))
    assert finding.status == "holds", finding
    assert finding.evidence["robots"]["ugv1"]["executing"] > 5


@pytest.mark.parametrize(
    ("name", "run_name"),
    [("case_a", "a"), ("case_a", "b"), ("case_a", "d"), ("case_a", "a_recursion_nearest"),
     ("case_a", "a_recursion_listed"), ("case_b", "b"), ("case_b", "c"), ("case_b", "d"), ("soft_gate", "c")],
)  # fmt: skip
def test_shipped_runs_hold(run: Callable[[str, str], Trace], name: str, run_name: str) -> None:
    finding = judge("EXEC", run(name, run_name))
    assert finding.status == "holds", finding
    assert finding.margin == pytest.approx(1e-6, rel=1e-4)
    assert finding.evidence["robots"]["ugv1"]["binding"] > 100  # also where inequalities bind


def test_the_uavs_avoidance_and_contradicting_inequalities_are_judged() -> None:
    """A pole in the UAV's way; a proposal that leads UGV1 between two obstacles, inside both safe distances."""
    scenario = short("case_a")
    scenario.obstacles["pole"] = Obstacle([0.8, 3.6, 2.3])
    scenario.intervention.policies = [Policy("towards", {"x_m": 2.85, "y_m": 5.5, "speed_m_s": 2.0})]
    scenario.decision.threshold.zeta_m = 1.0
    scenario.decision.release_m = 0.9
    trace = simulate(scenario, "b")
    finding = judge("EXEC", trace)
    assert finding.status == "holds", finding
    inside = [np.linalg.norm(trace.position("ugv1") - o, axis=1) < 1.95 for o in ([1.7, 4, 0], [4.0, 7.0, 0.0])]
    assert (inside[0] & inside[1]).any()
    assert finding.evidence["robots"]["uav"]["binding"] > 5


def test_a_uav_with_another_task_is_not_judged() -> None:
    scenario = short("case_a")
    scenario.duration_s, scenario.uav.task = 1.0, "airground_drake.nsbc.tasks:FormationTask"
    finding = judge("EXEC", simulate(scenario, "a"))
    assert finding.status == "holds"
    assert finding.evidence["not_judged"] == ["uav: task airground_drake.nsbc.tasks:FormationTask"]


# ------------------------------------------------------------------------------------- mutants of the trace


@pytest.mark.parametrize("robot", ["ugv1", "ugv2", "uav"])
def test_a_command_that_is_not_the_laws_is_refuted(run: Callable[[str, str], Trace], robot: str) -> None:
    trace = run("case_b", "d")
    found = refuted(moved(trace, robot, 100, [1e-5, 0.0, 0.0]))
    assert (found["robot"], found["t_s"]) == (robot, pytest.approx(trace.t[99]))


@pytest.mark.parametrize("robot", ["ugv1", "ugv2"])
@pytest.mark.parametrize("between", [False, True], ids=["at a sample", "between samples"])
def test_an_acceptance_that_nothing_says_is_refuted(
    run: Callable[[str, str], Trace], robot: str, between: bool
) -> None:
    trace = run("case_b", "d")
    off = np.abs(trace.t / 0.05 - np.round(trace.t / 0.05))
    row = int(np.flatnonzero(off > 0.1)[0]) if between else 100  # the trigger is isolated between samples

    def edit(signals: Any) -> None:
        signals.loc[row, f"{robot}.accepted"] = 1.0

    found = refuted(with_signals(trace, edit))
    assert found["accepted_by_the_signals"]
    assert not found["accepted_by_the_messages"]


def test_an_acceptance_that_is_hidden_is_refuted(run: Callable[[str, str], Trace]) -> None:
    trace = run("case_b", "d")
    found = refuted(replace(trace, signals=trace.signals.assign(**{"ugv1.accepted": 0.0})))
    assert found["accepted_by_the_messages"]
    assert not found["accepted_by_the_signals"]


@pytest.mark.parametrize("column", ["times_s", "positions_m", "selection"])
def test_another_proposal_than_was_executed_is_refuted(run: Callable[[str, str], Trace], column: str) -> None:
    trace = run("case_b", "d")
    changed = {"times_s": lambda v: v + 1e-3, "positions_m": lambda v: v + 1e-4, "selection": lambda v: v[:3]}[column]
    refuted(replace(trace, proposals=trace.proposals.assign(
        **{column: [changed(np.asarray(value)) for value in trace.proposals[column]]}
    )))  # fmt: skip


@pytest.mark.parametrize(
    "edit",
    [
        lambda table: table.iloc[:0],
        lambda table: table.drop(columns="times_s"),
        lambda table: table.assign(robot="ugv9"),
        lambda table: table.assign(cause="ugv9"),
        lambda table: table.assign(cause="ugv2"),
        lambda table: table.assign(positions_m=[value[:-1] for value in table["positions_m"]]),
        lambda table: table.assign(times_s=[np.asarray(value)[::-1] for value in table["times_s"]]),
        lambda table: table.assign(positions_m=[np.nan * np.asarray(value) for value in table["positions_m"]]),
    ],
    ids=["none", "column missing", "stranger", "cause unknown", "cause another", "cut", "backwards", "nan"],
)
def test_proposals_that_are_none_are_an_error(run: Callable[[str, str], Trace], edit: Any) -> None:
    trace = run("case_b", "d")
    assert judge("EXEC", replace(trace, proposals=edit(trace.proposals))).status == "error"


def test_scripted_motions_are_refuted() -> None:
    """The numpy simulation of the other tests has laws of its own."""
    assert judge("EXEC", run_of("a")).status == "refuted"
