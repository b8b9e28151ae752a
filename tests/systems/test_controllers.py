"""The UAV's controller and the task below its avoidance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, ZeroOrderHold

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError
from airground_drake.nsbc.tasks import FormationTask
from airground_drake.scenarios.load import load
from airground_drake.scenarios.world import make_world
from airground_drake.systems.components import make_avoidance
from airground_drake.systems.controllers import UavController
from airground_drake.systems.diagram import build_diagram


def test_a_task_cannot_change_where_the_controller_thinks_that_ugvs_are() -> None:
    """Positions and velocities are given to read: the avoidance above the task looks at them, too."""

    class Moves(FormationTask):
        def __init__(self, positions: Array, velocities: Array, altitude: float, gain: float) -> None:
            for given in (positions, velocities):
                with pytest.raises(ValueError, match="read-only"):
                    given += 1e6
            super().__init__(positions, velocities, altitude, gain)

    case_a = load("case_a")[0]
    world, avoidance = make_world(case_a), make_avoidance(case_a)
    controllers = (
        UavController(world, avoidance, gain=1.0, altitude=2.0, task=each) for each in (Moves, FormationTask)
    )
    positions = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.0, 1.1]])
    own, plain = (controller.velocity(positions, np.zeros((2, 3))) for controller in controllers)
    assert own.tolist() == plain.tolist()
    assert positions[0].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "asked", [np.full((1, 3), np.nan), [[0.0, np.inf, 0.0]], np.zeros((2, 3)), [0.0] * 3, "up", None]
)
def test_a_task_that_asks_for_no_velocity_is_named(asked: Any) -> None:
    class Odd(FormationTask):
        def velocity(self, position: Array) -> Any:
            return asked

    case_a = load("case_a")[0]
    controller = UavController(make_world(case_a), make_avoidance(case_a), gain=1.0, altitude=2.0, task=Odd)
    with pytest.raises(
        PluginError, match=r"^the UAV's task Odd asks for .* as velocity; wanted: \(1, 3\) finite numbers"
    ):
        controller.velocity(np.zeros((3, 3)), np.zeros((2, 3)))


def test_a_task_cannot_move_the_uav_that_its_avoidance_sees() -> None:
    class Writes(FormationTask):
        def velocity(self, position: Array) -> Array:
            position += 100.0
            return super().velocity(position)

    case_a = load("case_a")[0]
    controller = UavController(make_world(case_a), make_avoidance(case_a), gain=1.0, altitude=2.0, task=Writes)
    with pytest.raises(ValueError, match="read-only"):
        controller.velocity(np.zeros((3, 3)), np.zeros((2, 3)))


def test_a_robot_that_is_nowhere_ends_the_run() -> None:
    """Nobody could keep away from it."""

    def lost(robot: str, start: Array) -> Diagram:
        builder = DiagramBuilder()
        place = np.full(3, np.nan) if robot == "ugv2" else start
        source = builder.AddSystem(ConstantVectorSource(place))
        builder.ExportOutput(source.get_output_port())
        sink = builder.AddSystem(ZeroOrderHold(0.1, 3))
        builder.ExportInput(sink.get_input_port())
        return builder.Build()

    simulator = Simulator(build_diagram(load("case_a")[0], "d", plants=lost))
    with pytest.raises(PluginError, match="positions are not finite"):
        simulator.AdvanceTo(1.0)
