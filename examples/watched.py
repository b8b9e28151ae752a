from pydrake.systems.analysis import Simulator

from airground_drake import build_diagram, load
from airground_drake.sim.diagram import make_monitor

wanted, built = load("case_a"), load("case_a")
built.control.motion_gain_1_s *= 0.9  # a mistake
monitor = make_monitor(wanted, "d", terminate=True)
simulator = Simulator(build_diagram(built, "d", monitor=monitor))
simulator.get_mutable_context().SetAccuracy(1e-6)
status = simulator.AdvanceTo(2.0)
assert "breaks LAW" in status.message()
