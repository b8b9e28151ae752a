"""The Drake systems of plants, by the kind of the plant, and of disturbances."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem, System
from pydrake.systems.primitives import LinearSystem, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.base.arrays import Array
from airground_drake.systems.lifetime import weakly
from airground_drake.world.plant import FirstOrder, Scripted
from airground_drake.world.world import Body


def first_order_plant(robot: str, start: Array) -> LinearSystem:
    """p_dot = v for one robot: input v (3,), m/s; output p (3,), m, world frame; default state `start` (3,), m."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    plant = LinearSystem(A=zero, B=eye, C=eye, D=zero)
    plant.configure_default_state(start)
    return plant


def scripted_plant(body: Body) -> TrajectorySource:
    """The position of a body with a script, (3,), m, world frame; it has no input."""
    assert isinstance(body.plant, Scripted)
    times, places = body.plant.script.times, body.plant.script.positions
    if len(times) == 1:
        times, places = np.append(times, times[0] + 1.0), np.repeat(places, 2, axis=0)
    return TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, places.T))


PLANTS: dict[str, Callable[[Body, float], System]] = {
    FirstOrder.kind: lambda body, period_s: first_order_plant(body.name, body.start_m),
    Scripted.kind: lambda body, period_s: scripted_plant(body),
}
"""Makes the Drake system of a body, by the kind of its plant; the number is the control period, s."""


class VelocityDisturbance(LeafSystem):
    """Adds a disturbance w to the command v of each robot, p_dot = v + w, as in SAFE-DIST.

    Ports (r robots, world frame):
        in  `command` (3r) m/s; `disturbance_<robot>` (3) m/s for every robot, 0 where not connected.
        out `velocity` (3r) m/s.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        """Declare the ports for robots with these names, in the order of the world."""
        super().__init__()
        self._command = self.DeclareVectorInputPort("command", 3 * len(robots))
        self._disturbances = [self.DeclareVectorInputPort(f"disturbance_{robot}", 3) for robot in robots]
        inputs = (self._command, *self._disturbances)
        self.DeclareVectorOutputPort(
            "velocity", 3 * len(robots), weakly(self._calc), prerequisites_of_calc={port.ticket() for port in inputs}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        velocity = self._command.Eval(context).copy()
        for i, port in enumerate(self._disturbances):
            if port.HasValue(context):
                velocity[3 * i : 3 * i + 3] += port.Eval(context)
        output.SetFromVector(velocity)
