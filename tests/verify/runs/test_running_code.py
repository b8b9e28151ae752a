"""Mutants of the running code: the claim about it refutes the run that it makes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import MISBUILT, Patch, distances, neighbours
from verify.judging import decided

from airground_drake.model.geometry.outline import moved
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.scenario.load import load
from airground_drake.sim import components, simulation
from airground_drake.sim.diagram import Model
from airground_drake.verify import judge


def recursive(patch: pytest.MonkeyPatch) -> None:
    right, layer = components.make_law, Avoidance(3.0, 0.05, 4.0, "recursion_nearest")
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), avoidance=layer))


def altered_later(patch: pytest.MonkeyPatch) -> None:
    right = simulation.build_model

    def wrong(*args: Any, **more: Any) -> Model:
        model = right(*args, **more)
        controller = model.diagram.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
        controller._near = controller._near._replace(max_speed=2.0 * controller._near.max_speed)
        return model

    patch.setattr(simulation, "build_model", wrong)


PARAMETERS: dict[str, tuple[Patch, str]] = MISBUILT | {
    "obstacles that are not there": (
        neighbours(lambda g: g._replace(still=moved(g.still, np.full(3, 0.1)))),
        "outlines",
    ),
    "others in another order": (neighbours(lambda g: g._replace(others=g.others[:, ::-1].copy())), "others"),
    "composition": (recursive, "composition"),
    "altered later": (altered_later, "max_speed_m_s"),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_controller_that_was_built_otherwise_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, parameter = PARAMETERS[name]
    patch(monkeypatch)
    found = decided("SAFE-HYP", simulation.simulate(load("case_a", ["duration_s=1.0"]), "d"))
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
