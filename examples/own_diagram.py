"""Two blocks in your own diagram: a decision variable of your own, and the event trigger. There is no scenario.

python examples/own_diagram.py
"""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, DiscreteValues, EventStatus, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from airground_drake.model.trigger.automaton import Trigger
from airground_drake.sim.blocks import EventTrigger


class SineVariable(LeafSystem):
    """x = (4 m) sin(t / 1 s), and the range of x since the simulator's step began.

    With the range the trigger misses nothing, however long the steps are. So this block keeps when the step began.
    """

    def __init__(self) -> None:
        """Declare ports, state and events."""
        super().__init__()
        self.DeclareDiscreteState([0.0])  # time at which the step began, s
        self.DeclareInitializationDiscreteUpdateEvent(self._begin_step)
        self.DeclarePerStepDiscreteUpdateEvent(self._begin_step)
        self.DeclareVectorOutputPort("decision_variable", 1, self._calc_variable, {self.time_ticket()})
        self.DeclareVectorOutputPort("decision_range", 2, self._calc_range, {self.time_ticket(), self.xd_ticket()})

    def _begin_step(self, context: Context, discrete: DiscreteValues) -> EventStatus:
        discrete.set_value(0, [context.get_time()])
        return EventStatus.Succeeded()

    def _calc_variable(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([4.0 * np.sin(context.get_time())])

    def _calc_range(self, context: Context, output: BasicVector) -> None:
        begin, now = context.get_discrete_state(0).value()[0], context.get_time()
        peaks = np.pi * (0.5 + np.arange(np.ceil(begin / np.pi - 0.5), np.floor(now / np.pi - 0.5) + 1.0))
        x = 4.0 * np.sin([begin, *peaks, now])
        output.SetFromVector([x.min(), x.max()])


def triggers_s(zeta_m: float, until_s: float) -> list[float]:
    """When x reaches the threshold from below, s, as the trigger isolates it."""
    builder = DiagramBuilder()
    x = builder.AddNamedSystem("sine", SineVariable())
    trigger = builder.AddNamedSystem("trigger", EventTrigger(1, Trigger(zeta_m, release=2.0, dwell=0.5), period=1.0))
    for port in ("decision_variable", "decision_range"):
        builder.Connect(x.GetOutputPort(port), trigger.GetInputPort(port))
    log = LogVectorOutput(trigger.GetOutputPort("status"), builder)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetAccuracy(1e-6)  # events are isolated to this
    simulator.AdvanceTo(until_s)
    times = np.unique(log.FindLog(simulator.get_context()).data()[2])
    return [float(t) for t in times if t >= 0.0]


if __name__ == "__main__":
    found, due = triggers_s(3.0, 20.0), np.arcsin(3.0 / 4.0) + 2.0 * np.pi * np.arange(4)
    print("triggered at", ", ".join(f"{t:.5f}" for t in found), "s")
    print("the sine is at 3 m at", ", ".join(f"{t:.5f}" for t in due), "s")
