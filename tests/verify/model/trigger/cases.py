"""What the tests about the trigger share."""

from __future__ import annotations

import numpy as np
from builders.worlds import world
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput, ZeroOrderHold

from airground_drake.systems.decision import DecisionVariable, EventTrigger
from airground_drake.systems.signals import FIELDS

NOISE = {"noise_m_sqrt_s": 0.004, "leak_1_s": 0.0, "noise_period_s": 0.05, "duration_s": 30.0}

REFINE = {"zeta_m": 3.0, "released_below_m": 2.0, "dwell_s": 0.5, **NOISE}


def simulate(system: EventTrigger, noise: LeafSystem, until: float, step: float, error_m: float = 0.0) -> np.ndarray:
    """Status (4n, rows) of a trigger whose UGVs' task errors stand still and whose noise is a source's."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("noise", noise)
    builder.AddNamedSystem("event_trigger", system)
    variable = builder.AddNamedSystem("decision_variable", DecisionVariable(world(noise.get_output_port().size())))
    for port in ("decision_variable", "decision_range"):
        builder.Connect(variable.GetOutputPort(port), system.GetInputPort(port))
    count = noise.get_output_port().size()
    reference = np.concatenate([[error_m, 0.0, 0.0] * count, np.zeros(3 * count)])
    for name, value in (("bodies", np.zeros(3 * count + 3)), ("reference", reference)):
        constant = builder.AddNamedSystem(name, ConstantVectorSource(value))
        builder.Connect(constant.get_output_port(), variable.GetInputPort(name))
    builder.Connect(noise.get_output_port(), variable.GetInputPort("noise"))
    # steps end at the multiples of `step`, as they do at the noise samples in the diagram; they need a continuous state
    clock = builder.AddNamedSystem("clock", Integrator(1))
    sampled = builder.AddNamedSystem("sampled", ZeroOrderHold(step, 1))
    rate = builder.AddNamedSystem("rate", ConstantVectorSource([1.0]))
    builder.Connect(rate.get_output_port(), clock.get_input_port())
    builder.Connect(clock.get_output_port(), sampled.get_input_port())
    log = LogVectorOutput(system.get_output_port(), builder)
    log.set_name("log")
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    context.SetAccuracy(1e-6)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=step, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    found: np.ndarray = log.FindLog(context).data()
    return found


def trigger_times(status: np.ndarray, j: int) -> list[float]:
    """Times of the triggers of UGV j by a log of the trigger's status."""
    return sorted({float(t) for t in status[FIELDS * j + 2] if t >= 0.0})
