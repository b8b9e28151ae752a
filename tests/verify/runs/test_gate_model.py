"""GATE-MODEL: a wrong prediction model is refuted, whatever the plans that follow from it; runs of all routes hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.edits import with_decision, with_scenario
from verify.judging import judge

from airground_drake.gatekeeper import outcome, outcome_gatekeeper, problem
from airground_drake.gatekeeper.rollout import ClosedLoop
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import from_data, load, resolved
from airground_drake.scenarios.schema import Policy
from airground_drake.verify.runs import beginnings
from airground_drake.verify.runs.proposals import proposals_of

Run = Callable[[str, str], Trace]
Patch = Callable[[pytest.MonkeyPatch], None]


@pytest.mark.parametrize("name", ["case_b", "case_a", "soft_gate"])
def test_shipped_runs_hold(run: Run, name: str) -> None:
    finding = judge("GATE-MODEL", run(name, "c"))
    assert finding.status == "holds", finding
    assert finding.margin == pytest.approx(1e-6, rel=0.02)
    assert finding.evidence["farthest_from_predicted"]["away_m"] > 0.0


def test_stages_of_several_control_periods_hold() -> None:
    scenario = load("case_a")[0]
    scenario.gatekeeper.stages, scenario.duration_s = 20, 16.0
    finding = judge("GATE-MODEL", simulate(scenario, "c"))
    assert finding.status == "holds", finding
    assert finding.evidence["decisions"] > 5


@pytest.mark.slow
@pytest.mark.parametrize("claim", ["EXEC", "GATE-MODEL"])
def test_a_queue_along_an_axis_is_squeezed_and_holds(queue: Trace, claim: str) -> None:
    """Each between two others and in contact with both: predicted to be pushed by both, it may leap for kilometres."""
    finding = judge(claim, queue)
    assert finding.status == "holds", finding
    assert queue.decisions["refuse_left_m"].max() > 1e3


@pytest.fixture(scope="module")
def queue() -> Trace:
    """Seven UGVs behind each other but for 1e-9 m, before a gap between two obstacles that is as wide as a point."""
    data = resolved(load("minimal")[0])
    ends = [([-6.0 - 3.0 * i, 1e-9 * (-1) ** i, 0.0], [14.0 - 3.0 * i, 0.0, 0.0]) for i in range(7)]
    data["ugvs"] = {
        f"u{i}": {
            "start_m": start, "target_m": end, "max_speed_m_s": 3.0, "preset": {"waypoints_m": [start, end]},
        }
        for i, (start, end) in enumerate(ends)
    }  # fmt: skip
    data["obstacles"] = {f"o{i}": {"position_m": [0.0, y, 0.0]} for i, y in enumerate((2.0, -2.0))}
    data["uav"] = {"start_m": [-15.0, 0.0, 2.0], "target_m": [5.0, 0.0, 2.0]}
    data["control"] |= {"period_s": 0.05, "sensing_range_m": 6.0}
    data["gatekeeper"] |= {"period_s": 0.1, "stages": 30}
    data["intervention"]["period_s"] = 0.1
    data["decision"] |= {"noise_period_s": 0.05, "threshold": {"zeta_m": 2.0}}
    return simulate(from_data(data | {"duration_s": 9.5}, "queue"), "d")


def test_of_a_map_without_end_the_nearest_obstacles_count() -> None:
    assert outcome_gatekeeper.MOST_CLAIMED == beginnings.MOST_CLAIMED == 64
    scenario = load("case_a", ["duration_s=15.5"])[0]
    scenario.runs, scenario.reproduction, scenario.choices = {"d": scenario.runs["d"]}, [], []
    scenario.intervention.policies = [Policy("towards", {"x_m": 6.0, "y_m": 5.0, "speed_m_s": 2.0})]
    scenario.uav.phantoms_m = [[float(x), float(y), 0.0] for x in range(10, 20) for y in range(0, 20, 2)]
    trace = simulate(scenario, "d")
    finding = judge("GATE-MODEL", trace)
    assert finding.status == "holds", finding
    assert finding.exercised
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(beginnings, "MOST_CLAIMED", 0)
        sent = proposals_of(trace)[0]
        assert len(beginnings.known_discs(trace, "ugv1", sent.issued_s, sent)[0]) <= len(scenario.obstacles)
    assert len(beginnings.known_discs(trace, "ugv1", sent.issued_s, sent)[0]) >= 64


# ------------------------------------------------------------------------------------- mutants of the running code


def gain(name: str) -> Patch:
    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        made = problem.closed_loop

        def wrong(*arguments: Any) -> ClosedLoop:
            loop = made(*arguments)
            if name in loop._fields:
                return loop._replace(**{name: 1.1 * getattr(loop, name)})
            return loop._replace(law=loop.law._replace(**{name: 1.1 * getattr(loop.law, name)}))

        monkeypatch.setattr(problem, "closed_loop", wrong)

    return patch


def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """The prediction knows no obstacles."""
    made = problem.closed_loop
    monkeypatch.setattr(
        problem,
        "closed_loop",
        lambda *a: (loop := made(*a))._replace(distances=0.0 * loop.distances, shares=0.0 * loop.shares),
    )


def other_priorities(loop: ClosedLoop) -> ClosedLoop:
    return loop._replace(law=loop.law._replace(intervention_on_top=not loop.law.intervention_on_top))


def on_top(monkeypatch: pytest.MonkeyPatch) -> None:
    """The prediction has the other method's priorities."""
    made = problem.closed_loop
    monkeypatch.setattr(
        problem,
        "closed_loop",
        lambda *a: other_priorities(made(*a)),
    )


def late(monkeypatch: pytest.MonkeyPatch) -> None:
    """The proposed motion is predicted a period late."""
    made = problem.closed_loop

    def wrong(*arguments: Any) -> ClosedLoop:
        loop = made(*arguments)
        return loop._replace(wanted=np.concatenate([loop.wanted[:1], loop.wanted[:-1]]))

    monkeypatch.setattr(problem, "closed_loop", wrong)


def swapped(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = ClosedLoop.constant_plans
    monkeypatch.setattr(ClosedLoop, "constant_plans", lambda self: honest(self)[::-1])


MUTANTS: dict[str, Patch] = {
    "motion gain": gain("motion_gain"),
    "intervention gain": gain("intervention_gain"),
    "speed limit": gain("max_speed"),
    "no obstacles": blind,
    "priorities": on_top,
    "late": late,
    "modes swapped": swapped,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_a_wrong_prediction_model_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load("case_b")[0]
    if name == "speed limit":
        scenario.ugvs["ugv1"].max_speed_m_s = 2.0
    MUTANTS[name](monkeypatch)
    finding = judge("GATE-MODEL", simulate(scenario, "c"))
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample["what"].startswith("velocity of mode")


WRONG: dict[str, Callable[[ClosedLoop], ClosedLoop]] = {
    "speed limit": lambda loop: loop._replace(max_speed=0.5 * loop.max_speed),
    "priorities": other_priorities,
    "no obstacles": lambda loop: loop._replace(shares=0.0 * loop.shares, distances=0.0 * loop.distances),
    "late": lambda loop: loop._replace(wanted=np.concatenate([loop.wanted[:1], loop.wanted[:-1]])),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_outcomes_are_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Method (d), until shortly after its first acceptance."""
    made = outcome.loop_among
    monkeypatch.setattr(outcome, "loop_among", lambda *arguments: WRONG[name](made(*arguments)))
    scenario = load("case_b", ["duration_s=14.0", "reproduction=[]"])[0]
    finding = judge("GATE-MODEL", simulate(scenario, "d"))
    assert finding.status == "refuted", finding


# ------------------------------------------------------------------------------------- mutants of the trace


def faster(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["accept_m_s"][-3] += 1e-5


def slower(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["refuse_m_s"][4] -= 1e-5


@pytest.mark.parametrize("edit", [faster, slower])
def test_a_decision_on_other_data_is_refuted(run: Run, edit: Any) -> None:
    assert judge("GATE-MODEL", with_decision(run("case_b", "c"), edit)).status == "refuted"


def test_another_law_than_the_scenarios_is_refuted(run: Run) -> None:
    trace = with_scenario(run("case_b", "c"), control__intervention_gain_1_s=1.6)
    assert judge("GATE-MODEL", trace).status == "refuted"


def test_a_decision_on_a_proposal_that_was_not_sent_is_an_error(run: Run) -> None:
    def other(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["issued_s"] += 0.01

    assert judge("GATE-MODEL", with_decision(run("case_b", "c"), other)).status == "error"
