"""One block in your own diagram: the event trigger, driven by a sine, without a scenario.

python examples/own_diagram.py
"""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, Sine

from airground_drake.decision.trigger import Trigger
from airground_drake.systems import EventTrigger


def first_trigger_s(zeta_m: float) -> float:
    """When x = (4 m) sin(t / 1 s) first reaches the threshold, s, as the trigger isolates it."""
    builder = DiagramBuilder()
    x = builder.AddSystem(Sine(amplitude=4.0, frequency=1.0, phase=0.0, size=1)).get_output_port(0)
    span = builder.AddSystem(Multiplexer([1, 1]))  # least and largest x since the step began: here x itself
    trigger = builder.AddSystem(EventTrigger(1, Trigger(zeta=zeta_m, release=2.0, dwell=0.5)))
    for port in (span.get_input_port(0), span.get_input_port(1), trigger.GetInputPort("decision_variable")):
        builder.Connect(x, port)
    builder.Connect(span.get_output_port(0), trigger.GetInputPort("decision_range"))
    log = LogVectorOutput(trigger.GetOutputPort("status"), builder, 0.01)  # which bounds the steps
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(3.0)
    return float(log.FindLog(simulator.get_context()).data()[2].max())  # time of the last trigger


if __name__ == "__main__":
    print(f"triggered at {first_trigger_s(3.0):.6f} s; the sine is at 3 m at {np.arcsin(3.0 / 4.0):.6f} s")
