"""The Drake systems of plants, by the kind of the plant, and of disturbances."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    System,
)
from pydrake.systems.primitives import LinearSystem, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.base.arrays import Array
from airground_drake.systems.lifetime import weakly
from airground_drake.world.motion import SAME_S
from airground_drake.world.plant import Delay, FirstOrder, Lag, Plant, Scripted, Unicycle
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


class SteeredBody(LeafSystem):
    """The body of a robot that is not where the law steers it: see `world.plant`.

    Ports (world frame):
        in  `velocity` (3) m/s, held for a control period; `base` (3) m, a first-order robot under that velocity.
        out `signals` (k), those of the plant; of a unicycle also `heading` (1) rad.
    State: the time of the last control sample, s, and the plant's memory there.
    Rate: one update per control period, from t = 0. In between all is in closed form, so that no integrator errs.
    """

    def __init__(self, plant: Plant, period_s: float) -> None:
        """Declare ports, state and the periodic update."""
        super().__init__()
        self._plant, self._period_s = plant, period_s
        self._velocity = self.DeclareVectorInputPort("velocity", 3)
        self._base = self.DeclareVectorInputPort("base", 3)
        self.DeclareDiscreteState(np.append(0.0, plant.memory()))
        needs = {self._velocity.ticket(), self._base.ticket(), self.xd_ticket(), self.time_ticket()}
        names = plant.signals
        self.DeclareVectorOutputPort("signals", len(names), weakly(self._calc), prerequisites_of_calc=needs)
        if isinstance(plant, Unicycle):
            self.DeclareVectorOutputPort("heading", 1, weakly(self._calc_heading), prerequisites_of_calc=needs)
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, 0.0, weakly(self._update))

    def _since(self, context: Context) -> tuple[float, Array]:
        """Time since the last control sample, s, and the memory there."""
        held = context.get_discrete_state(0).value()
        elapsed = context.get_time() - held[0]
        return self._period_s if abs(elapsed - self._period_s) <= SAME_S else float(elapsed), held[1:]

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        elapsed, memory = self._since(context)
        memory = self._plant.remembered(memory, self._velocity.Eval(context), elapsed)
        discrete.set_value(0, np.append(context.get_time(), memory))

    def _calc(self, context: Context, output: BasicVector) -> None:
        elapsed, memory = self._since(context)
        output.SetFromVector(self._plant.at(memory, self._base.Eval(context), self._velocity.Eval(context), elapsed))

    def _calc_heading(self, context: Context, output: BasicVector) -> None:
        elapsed, memory = self._since(context)
        output.SetFromVector(self._plant.remembered(memory, self._velocity.Eval(context), elapsed))


def steered_plant(body: Body, period_s: float) -> Diagram:
    """A robot whose body is not where the law steers it: the base, a `first_order_plant`, and a `SteeredBody`.

    Its input is `velocity` (3), m/s; its outputs are `position` (3), m, that of the base, and those of the body.
    """
    assert body.plant is not None
    builder = DiagramBuilder()
    base = builder.AddNamedSystem("base", first_order_plant(body.name, body.start_m))
    moved = builder.AddNamedSystem("body", SteeredBody(body.plant, period_s))
    builder.ExportInput(base.get_input_port(), "velocity")
    builder.ConnectInput("velocity", moved.GetInputPort("velocity"))
    builder.Connect(base.get_output_port(), moved.GetInputPort("base"))
    builder.ExportOutput(base.get_output_port(), "position")
    for port in (moved.get_output_port(i) for i in range(moved.num_output_ports())):
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


PLANTS: dict[str, Callable[[Body, float], System]] = {
    FirstOrder.kind: lambda body, period_s: first_order_plant(body.name, body.start_m),
    Unicycle.kind: steered_plant,
    Lag.kind: steered_plant,
    Delay.kind: steered_plant,
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
