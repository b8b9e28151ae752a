from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from airground_drake import build_diagram, load

builder = DiagramBuilder()
team = builder.AddNamedSystem("team", build_diagram(load("minimal"), "d"))
wind = builder.AddNamedSystem("wind", ConstantVectorSource([0.1, 0.0, 0.0]))
builder.Connect(wind.get_output_port(), team.GetInputPort("disturbance_ugv1"))
simulator = Simulator(builder.Build())
simulator.get_mutable_context().SetAccuracy(1e-6)
simulator.AdvanceTo(8.0)
controller = team.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
command = controller.GetOutputPort("command").Eval(controller.GetMyContextFromRoot(simulator.get_context()))
assert command.shape == (3,)
