"""Contexts as a run has them, and simulators of them."""

from pydrake.common import RandomGenerator
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram

from airground_drake.sim.blocks.decision import ACCURACY


def begun(diagram: Diagram, seed: int) -> Context:
    context = diagram.CreateDefaultContext()
    diagram.SetRandomContext(context, RandomGenerator(seed))
    context.SetAccuracy(ACCURACY)
    return context


def advanced(diagram: Diagram, context: Context, until: float) -> Simulator:
    simulator = Simulator(diagram, context)
    euler = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=0.05, use_error_control=False)
    euler.start_time = context.get_time()  # else the Context is set to 0 s
    ApplySimulatorConfig(euler, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return simulator
