"""The UAV's controller and the task below its avoidance."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError
from airground_drake.model.law.tasks import FormationTask
from airground_drake.scenario.load import load
from airground_drake.scenario.world import make_world
from airground_drake.sim.blocks.controllers import UavController
from airground_drake.sim.components import make_avoidance
from airground_drake.sim.diagram import build_diagram


def moves_ugvs(given: dict[str, Array]) -> Any:
    given["ugvs"] += 1e6


def moves_uav(given: dict[str, Array]) -> Any:
    given["own"] += 100.0


@pytest.mark.parametrize(
    ("does", "said"),
    [
        (moves_ugvs, r"raised .*read-only"),
        (moves_uav, r"raised .*read-only"),
        *(
            (lambda _, asked=asked: asked, r"asks for .*; wanted: \(1, 3\)")
            for asked in (np.full((1, 3), np.nan), [[0.0, np.inf, 0.0]], np.zeros((2, 3)), "up", None)
        ),
    ],
)
def test_a_task_that_asks_for_no_velocity_or_moves_robots_is_stopped(
    does: Callable[[dict[str, Array]], Any], said: str
) -> None:
    """The avoidance above the task looks at the same positions."""

    class Odd(FormationTask):
        def __init__(self, positions: Array, *others: Any) -> None:
            super().__init__(positions, *others)
            self.given = {"ugvs": positions}

        def velocity(self, position: Array) -> Any:
            return does({**self.given, "own": position})

    case_a = load("case_a")
    controller = UavController(make_world(case_a), make_avoidance(case_a), gain=1.0, altitude=2.0, task=Odd)
    with pytest.raises(PluginError, match=rf"^the UAV's task Odd {said}"):
        controller.velocity(0.0, np.zeros((3, 3)), np.zeros((2, 3)))


@pytest.mark.parametrize("problem", [RuntimeError("task broke"), SystemExit(0)])
def test_a_task_whose_constructor_fails_is_named(problem: BaseException) -> None:
    class Broken(FormationTask):
        def __init__(self, *_: Any) -> None:
            raise problem

    case_a = load("case_a")
    controller = UavController(make_world(case_a), make_avoidance(case_a), gain=1.0, altitude=2.0, task=Broken)
    with pytest.raises(PluginError, match=rf"task Broken raised test_controllers.py:\d+ {type(problem).__name__}"):
        controller.velocity(0.0, np.zeros((3, 3)), np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("robot", "told"),
    [("uav", "positions are not finite"), ("ugv2", r"decision_range is not a number, .* or a disturbance")],
)
def test_a_robot_that_is_nowhere_ends_the_run(robot: str, told: str) -> None:
    builder = DiagramBuilder()
    team = builder.AddSystem(build_diagram(load("case_a"), "d"))
    nowhere = builder.AddSystem(ConstantVectorSource(np.full(3, np.nan)))
    builder.Connect(nowhere.get_output_port(), team.GetInputPort(f"disturbance_{robot}"))
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetAccuracy(1e-6)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=0.025, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    with pytest.raises(PluginError, match=told):
        simulator.AdvanceTo(1.0)
