"""Mutants of the running code: the claim about it refutes the run that it makes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import MISBUILT, Patch, distances, neighbours
from verify.judging import CLAIMS

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper import outcome, problem
from airground_drake.gatekeeper.patience import Commitment, Patience
from airground_drake.gatekeeper.rollout import ACCEPTED, REFUSED, ClosedLoop, closed_loop
from airground_drake.intervention import database
from airground_drake.intervention.messages import accepted_proposals
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc import law
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.run import simulation
from airground_drake.scenarios.load import load
from airground_drake.systems import components, controllers, diagram
from airground_drake.systems.diagram import Model
from airground_drake.verify import judge
from airground_drake.verify.finding import Finding
from airground_drake.world.world import Kind, Neighbours, World

PATIENCE = ["gatekeeper.tries=1", "gatekeeper.longest_s=1.0", "gatekeeper.rest_s=3.0", "intervention.retry_s=0.5"]
"""A UGV goes along once, for 1 s, and then not before it has been on its own for 3 s."""


def judged(claim: str, run: str = "d", scenario: str = "case_b", given: Sequence[str] = ()) -> Finding:
    """The finding about a new run."""
    return CLAIMS[claim].judge(simulation.simulate(load(scenario, list(given)), run))


# ---------------------------------------------------------------------------------------------------- EXEC


def gain(name: str, factor: float) -> Patch:
    made = components.make_law

    def wrong(*arguments: Any) -> law.UgvLaw:
        honest = made(*arguments)
        return replace(honest, **{name: factor * getattr(honest, name)})

    return lambda patch: patch.setattr(components, "make_law", wrong)


def formation_gain(patch: pytest.MonkeyPatch) -> None:
    made = diagram.UavController
    patch.setattr(diagram, "UavController", lambda *a, gain, **k: made(*a, gain=0.5 * gain, **k))


def no_feed_forward(patch: pytest.MonkeyPatch) -> None:
    made = controllers.FormationTask

    class Tasks:
        def load(self, name: str, of: type) -> Any:
            return lambda p, v, z, g: made(p, 0.0 * v, z, g)

    patch.setattr(diagram, "UAV_TASKS", Tasks())


def executed_whatever_the_answer(patch: pytest.MonkeyPatch) -> None:
    """The answer is recorded as it was given."""
    honest, waiting = controllers.UgvController.velocity, list[Proposal | None]()

    def velocity(self: Any, t: float, places: Array, reference: Array, rate: Array, accepted: Any, *law: Any) -> Array:
        return honest(self, t, places, reference, rate, waiting[:] or accepted, *law)

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        waiting[:] = proposals
        return accepted_proposals(proposals, answers)

    patch.setattr(controllers.UgvController, "velocity", velocity)
    patch.setattr(controllers, "accepted_proposals", accepted)


def executed(choose: Callable[[list[Any], list[Any]], list[Any]]) -> Patch:
    """What is executed, from what was accepted at the sample before and what is accepted now."""
    before: list[list[Any]] = [[None, None], [None, None]]

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        now = accepted_proposals(proposals, answers)
        before[:] = [now, choose(before, now)]
        return before[1]

    return lambda patch: patch.setattr(controllers, "accepted_proposals", accepted)


def ugv2_avoids_nothing(patch: pytest.MonkeyPatch) -> None:
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Neighbours, *rest: Any) -> Array:
        distance = near.distance.copy()
        distance[1] = -1e6
        return honest(self, positions, near._replace(distance=distance), *rest)

    patch.setattr(law.UgvLaw, "velocity", velocity)


def no_limit_of(kind: Kind) -> Patch:
    honest = World.around

    def around(self: World, rows: slice) -> Neighbours:
        near = honest(self, rows)
        return near._replace(max_speed=near.max_speed * (1e9 if rows == self.select(kind) else 1.0))

    return lambda patch: patch.setattr(World, "around", around)


def one_direction(patch: pytest.MonkeyPatch) -> None:
    """Not a mutant: proposals concern one direction."""
    along = np.array([[1.0, 0.0, 0.0]])
    patch.setattr(database, "Proposal", lambda *given, **more: Proposal(*given, selection=along, **more))


def selection_ignored(patch: pytest.MonkeyPatch) -> None:
    one_direction(patch)
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Any, target: Array, rate: Array, asked: Any, *rest: Any) -> Array:
        everywhere = [None if one is None else one._replace(chosen=np.eye(3)) for one in asked]
        return honest(self, positions, near, target, rate, everywhere, *rest)

    patch.setattr(law.UgvLaw, "velocity", velocity)


FAR_UAV = "uav.start_m=[20.0, -30.0, 2.0]"
"""Far away, so that its limit matters."""
COMMANDS: dict[str, tuple[Patch, str, list[str], str]] = {
    "executed whatever the answer": (executed_whatever_the_answer, "d", [], "ugv"),
    "executed late": (executed(lambda before, now: before[0]), "d", [], "ugv"),
    "executed for ever": (executed(lambda before, now: [a or b for a, b in zip(now, before[1], strict=True)]), "d", [],
                          "ugv"),
    "intervention gain": (gain("intervention_gain", 1.2), "d", [], "ugv"),
    "intervention gain, on top": (gain("intervention_gain", 1.2), "c", [], "ugv"),
    "intervention gain, no gatekeeper": (gain("intervention_gain", 1.2), "b", [], "ugv"),
    "motion gain": (gain("motion_gain", 0.98), "d", [], "ugv"),
    "formation gain": (formation_gain, "d", [], "uav"),
    "UGVs' velocity not fed forward": (no_feed_forward, "d", [FAR_UAV], "uav"),
    "ugv2 avoids nothing": (ugv2_avoids_nothing, "d", [], "ugv2"),
    "selection ignored": (selection_ignored, "d", [], "ugv"),
    "no speed limit": (no_limit_of("ugv"), "d", ["ugvs.ugv1.max_speed_m_s=2.0"], "ugv1"),
    "no speed limit of the UAV": (no_limit_of("uav"), "d", [FAR_UAV], "uav"),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_other_commands_are_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, run, given, robot = COMMANDS[name]
    patch(monkeypatch)
    found = judged("EXEC", run, "case_a" if patch is selection_ignored else "case_b", given)
    assert found.status == "refuted", found
    assert robot in str(found.counterexample)
    if patch is executed_whatever_the_answer:
        assert "'accepted_by_the_messages': False, 'accepted_by_the_signals': False" in str(found.counterexample)


@pytest.mark.parametrize("run", "bcd")
def test_proposals_that_concern_one_direction_hold(run: str, monkeypatch: pytest.MonkeyPatch) -> None:
    one_direction(monkeypatch)
    found = judged("EXEC", run, "case_a")
    assert found.status == "holds", found
    assert found.evidence["robots"]["ugv1"]["executing"] > 5


# ---------------------------------------------------------------------------------------------------- GATE-MODEL


def with_law(name: str, value: Callable[[Any], Any]) -> Callable[[ClosedLoop], ClosedLoop]:
    return lambda loop: loop._replace(law=loop.law._replace(**{name: value(getattr(loop.law, name))}))


PREDICTIONS: dict[str, Callable[[ClosedLoop], ClosedLoop]] = {
    "motion gain": with_law("motion_gain", lambda v: 1.1 * v),
    "intervention gain": with_law("intervention_gain", lambda v: 1.1 * v),
    "priorities": with_law("intervention_on_top", lambda v: not v),
    "speed limit": lambda loop: loop._replace(max_speed=0.5 * loop.max_speed),
    "no obstacles": lambda loop: loop._replace(shares=0.0 * loop.shares, distances=0.0 * loop.distances),
    "late": lambda loop: loop._replace(wanted=np.concatenate([loop.wanted[:1], loop.wanted[:-1]])),
}


@pytest.mark.parametrize(
    ("run", "name"), [*(("c", name) for name in PREDICTIONS), *(("d", n) for n in list(PREDICTIONS)[2:])]
)
def test_wrong_predictions_are_refuted(run: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until shortly after the first acceptance. What case B's outcomes under (d) rest on is not the gains."""
    for module in (problem, outcome):
        monkeypatch.setattr(module, "closed_loop", lambda *given: PREDICTIONS[name](closed_loop(*given)))
    assert judged("GATE-MODEL", run, given=["duration_s=14.0", "reproduction=[]"]).status == "refuted"


def test_exchanged_predictions_are_refuted(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, other in (("ACCEPTED", REFUSED), ("REFUSED", ACCEPTED)):
        monkeypatch.setattr(problem, name, other)
    assert judged("GATE-MODEL", "c", given=["duration_s=14.0", "reproduction=[]"]).status == "refuted"


# ---------------------------------------------------------------------------------------------------- LIVE-PROG


class NoRest(Patience):
    """The tries count anew at once."""

    def rested(self, now: Commitment, t: float) -> Commitment:
        return now if now.executing else replace(now, tries=0)


class LateByASample(Patience):
    """A try is over one sample too late."""

    def over(self, now: Commitment, t: float) -> bool:
        return t >= now.until + 0.05


@pytest.mark.parametrize("kind", [NoRest, LateByASample])
def test_a_patience_that_is_wired_wrongly_is_refuted(kind: type[Patience], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(components, "Patience", kind)
    assert judged("LIVE-PROG", given=PATIENCE).status == "refuted"


# ---------------------------------------------------------------------------------------------------- SAFE-HYP


def recursive(patch: pytest.MonkeyPatch) -> None:
    right, layer = components.make_law, Avoidance(3.0, 0.05, 4.0, "recursion_nearest")
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), avoidance=layer))


def altered_later(patch: pytest.MonkeyPatch) -> None:
    """After the diagram was built."""
    right = simulation.build_model

    def wrong(*args: Any, **more: Any) -> Model:
        model = right(*args, **more)
        controller = model.diagram.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
        controller._near = controller._near._replace(max_speed=2.0 * controller._near.max_speed)
        return model

    patch.setattr(simulation, "build_model", wrong)


PARAMETERS: dict[str, tuple[Patch, str]] = MISBUILT | {
    "obstacles that are not there": (neighbours(lambda g: g._replace(still=g.still + 0.1)), "obstacles_m"),
    "others in another order": (neighbours(lambda g: g._replace(others=g.others[:, ::-1].copy())), "others"),
    "composition": (recursive, "composition"),
    "altered later": (altered_later, "max_speed_m_s"),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_controller_that_was_built_otherwise_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, parameter = PARAMETERS[name]
    patch(monkeypatch)
    found = judged("SAFE-HYP", scenario="case_a", given=["duration_s=1.0"])
    assert found.status == "refuted", found
    assert found.counterexample is not None
    different = next(one for one in found.evidence["different_parameters"] if one["parameter"] == parameter)
    assert different["built"] != different["scenario"]


def test_a_shorter_distance_between_robots_is_refuted_though_no_robots_come_near(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """This once passed every claim."""
    distances(0.9, "ugv")(monkeypatch)
    scenario = load("case_b", ["duration_s=1.0"])
    for run in scenario.runs:
        trace, built = judge(simulation.simulate(scenario, run), ["SAFE-TRACE", "SAFE-HYP"])
        assert (trace.status, built.status) == ("holds", "refuted")
        assert built.evidence["different_parameters"] == [{
            "controller": "ugv_controller", "parameter": "safe_m", "robot": "ugv1", "other": "ugv2", "built": 1.8,
            "scenario": 2.0,
        }]  # fmt: skip
