"""Controllers that were not built with what the scenario says: SAFE-HYP refutes the run, and says what differs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import MISBUILT, Patch, distances, neighbours

from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.run import simulation
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load
from airground_drake.systems import components
from airground_drake.systems.diagram import Model
from airground_drake.verify import verify
from airground_drake.world.world import Neighbours


def recursive(patch: pytest.MonkeyPatch) -> None:
    right, layer = components.make_law, Avoidance(3.0, 0.05, 4.0, "recursion_nearest")
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), avoidance=layer))


MUTANTS: dict[str, tuple[Patch, str]] = MISBUILT | {
    "obstacles that are not there": (neighbours(lambda g: g._replace(still=g.still + 0.1)), "obstacles_m"),
    "others in another order": (neighbours(lambda g: g._replace(others=g.others[:, ::-1].copy())), "others"),
    "composition": (recursive, "composition"),
}


def judged(patch: pytest.MonkeyPatch, mutate: Patch, scenario: str) -> dict[str, Any]:
    """What SAFE-HYP finds different in a run of the scenario."""
    mutate(patch)
    trace = simulation.simulate(load(scenario, ["duration_s=1.0"])[0], "d")
    (verdict,) = verify(trace, ["SAFE-HYP"])
    assert verdict.finding.status == "refuted", verdict.finding
    assert verdict.finding.counterexample is not None
    return {each["parameter"]: each for each in verdict.finding.evidence["different_parameters"]}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_controller_that_was_built_otherwise_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mutate, parameter = MUTANTS[name]
    found = judged(monkeypatch, mutate, "case_a")
    assert parameter in found
    assert found[parameter]["built"] != found[parameter]["scenario"]


def test_the_robot_and_what_it_avoids_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(given: Neighbours) -> Neighbours:
        distance = given.distance.copy()
        if given.members[0] == 0:
            distance[0, len(given.still) + np.flatnonzero(given.others[0] == 1)] *= 0.9
        return given._replace(distance=distance)

    found = judged(monkeypatch, neighbours(wrong), "case_b")
    assert found == {
        "safe_m": {
            "controller": "ugv_controller", "parameter": "safe_m", "robot": "ugv1", "other": "ugv2", "built": 1.8,
            "scenario": 2.0,
        }
    }  # fmt: skip


def test_shorter_distances_between_robots_are_refuted_in_every_run_of_case_b(monkeypatch: pytest.MonkeyPatch) -> None:
    """In these runs no robots come near each other, so that no distance betrays it."""
    distances(0.9, "ugv")(monkeypatch)
    distances(0.9, "ugv", "uav")(monkeypatch)
    scenario = load("case_b")[0]
    for run in scenario.runs:
        verdict = {
            each.claim.id: each for each in verify(simulation.simulate(scenario, run), ["SAFE-TRACE", "SAFE-HYP"])
        }
        assert verdict["SAFE-HYP"].finding.status == "refuted"
        assert verdict["SAFE-HYP"].finding.evidence["different_parameters"]
        assert verdict["SAFE-TRACE"].as_expected


def test_a_trace_without_the_parameters_is_no_pass() -> None:
    trace = simulation.simulate(load("case_a", ["duration_s=1.0"])[0], "d")
    without = Trace({k: v for k, v in trace.meta.items() if k != "controllers"}, trace.signals, trace.decisions)
    assert verify(without, ["SAFE-HYP"])[0].finding.status == "error"


def test_they_are_read_from_the_controllers_in_the_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever changes the system after it was built is found out, too."""
    right = simulation.build_model

    def wrong(*args: Any, **more: Any) -> Model:
        model = right(*args, **more)
        controller = model.diagram.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
        controller._near = controller._near._replace(max_speed=2.0 * controller._near.max_speed)
        return model

    monkeypatch.setattr(simulation, "build_model", wrong)
    assert list(judged(monkeypatch, lambda _: None, "case_a")) == ["max_speed_m_s"]
