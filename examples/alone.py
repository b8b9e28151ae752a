import numpy as np
from pydrake.systems.analysis import Simulator

from airground_drake import Motion, Proposal
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.geometry.outline import balls
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.sim.blocks import Gatekeeper, UgvController
from airground_drake.ugv.outcome import Outlook
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.patience import Patience

robot = Body("robot", "ugv", np.zeros(3), plant=FirstOrder(), max_speed_m_s=2.0)
rock = Body("rock", "obstacle", np.array([5.0, 0.0, 0.0]), balls(np.zeros(3), gap=2.0))  # keep 2 m
world = World((robot, rock), {})
law = UgvLaw(Avoidance(5.0, 0.05, sensing_range=4.0), motion_gain=1.0, intervention_gain=1.5, intervention_on_top=False)

controller = UgvController(world, law)
context = controller.CreateDefaultContext()
controller.GetInputPort("bodies").FixValue(context, [2.99, 0.0, 0.0])
controller.GetInputPort("reference").FixValue(context, [10.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # position, velocity
controller.GetInputPort("proposals").FixValue(context, (None,))
controller.GetInputPort("answers").FixValue(context, [0.0, -1.0])
context.SetDiscreteState(controller.EvalUniquePeriodicDiscreteUpdate(context))
command = controller.GetOutputPort("command").Eval(context)
assert np.allclose(command, [0.2, 0.0, 0.0])  # 0.01 m in 0.05 s, up to 2 m from the rock

preset = Motion.at_speed(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), 1.0)
judge = OutcomeGatekeepers(world, law, [preset], Outlook(longest=30.0), Patience(most=3, rest=2.0, longest=30.0))
gatekeeper = Gatekeeper(judge, world, period=0.05, control=0.05)
round_it = np.array([[2.9, 0.0, 0.0], [3.0, 2.5, 0.0], [7.0, 2.5, 0.0], [10.0, 0.0, 0.0]])
context = gatekeeper.CreateDefaultContext()
gatekeeper.GetInputPort("bodies").FixValue(context, [2.9, 0.0, 0.0])
gatekeeper.GetInputPort("team_command").FixValue(context, [0.0, 0.0, 0.0])
gatekeeper.GetInputPort("gains").FixValue(context, [5.0, 1.0, 1.5])
proposal = Proposal("mine", 0.0, Motion.at_speed(round_it, 2.0), number=0)
gatekeeper.GetInputPort("proposals").FixValue(context, (proposal,))
simulator = Simulator(gatekeeper, context)
simulator.AdvanceTo(0.01)
report = gatekeeper.GetOutputPort("reports").Eval(simulator.get_context())[0]
assert report.reason == "cheaper"
