"""A user's plant: a differential drive on its wheels, with contact, friction and motors, in a MultibodyPlant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, MeshcatVisualizer, StartMeshcat
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem

STEP_S, WHEEL_M, HALF_BASE_M = 0.005, 0.033, 0.08
MOTOR_NM_S = 0.05
"""Torque of a motor per rad/s that its wheel is too slow."""


class TurtleBot(Diagram):
    """The law steers a point ahead of the axle; with `meshcat` = 1 a browser shows the robot with its wheels."""

    def __init__(self, start: NDArray[np.float64], *, hand_m: float = 0.1, meshcat: float = 0.0) -> None:
        """Build it with its axle at `start`, heading along x."""
        super().__init__()
        builder = DiagramBuilder()
        plant, scene = AddMultibodyPlantSceneGraph(builder, STEP_S)
        (robot,) = Parser(plant).AddModels(str(Path(__file__).with_name("turtlebot.urdf")))
        ground, below, rubber = Box(40.0, 40.0, 1.0), RigidTransform([0.0, 0.0, -0.5]), CoulombFriction(0.9, 0.9)
        plant.RegisterCollisionGeometry(plant.world_body(), below, ground, "ground", rubber)
        for motor in ("left_motor", "right_motor"):
            plant.GetJointActuatorByName(motor).set_controller_gains(PdControllerGains(p=0.0, d=MOTOR_NM_S))
        plant.Finalize()
        pose = RigidTransform(start + [0.0, 0.0, WHEEL_M])
        plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("base"), pose)
        drive = builder.AddSystem(Drive(plant, hand_m))
        builder.Connect(plant.get_body_poses_output_port(), drive.GetInputPort("poses"))
        builder.Connect(drive.GetOutputPort("wheels"), plant.get_desired_state_input_port(robot))
        builder.ExportInput(drive.GetInputPort("velocity"), "velocity")
        for port in ("position", "body", "heading"):
            builder.ExportOutput(drive.GetOutputPort(port), port)
        if meshcat:
            MeshcatVisualizer.AddToBuilder(builder, scene, StartMeshcat())
        builder.BuildInto(self)


class Drive(LeafSystem):
    """The speeds of the wheels that move the hand point as the law wants it; where hand point and axle are."""

    def __init__(self, plant: Any, hand_m: float) -> None:
        """Declare the ports of the drive of a robot in a MultibodyPlant."""
        super().__init__()
        self._base, self._hand_m = plant.GetBodyByName("base").index(), hand_m
        self._velocity = self.DeclareVectorInputPort("velocity", 3)
        self._poses = self.DeclareAbstractInputPort("poses", plant.get_body_poses_output_port().Allocate())
        self.DeclareVectorOutputPort("wheels", 4, self._wheels)
        self.DeclareVectorOutputPort("position", 3, lambda context, output: self._place(context, output, hand_m))
        self.DeclareVectorOutputPort("body", 3, lambda context, output: self._place(context, output, 0.0))
        self.DeclareVectorOutputPort("heading", 1, self._heading)

    def _seen(self, context: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The axle, m, and the unit vector ahead, on the ground."""
        pose = self._poses.Eval(context)[self._base].GetAsMatrix4()
        return pose[:3, 3] * [1.0, 1.0, 0.0], pose[:3, 0] * [1.0, 1.0, 0.0]

    def _place(self, context: Any, output: Any, ahead_m: float) -> None:
        axle, ahead = self._seen(context)
        output.SetFromVector(axle + ahead_m * ahead)

    def _heading(self, context: Any, output: Any) -> None:
        x, y, _ = self._seen(context)[1]
        output.SetFromVector([np.arctan2(y, x)])

    def _wheels(self, context: Any, output: Any) -> None:
        (x, y, _), (ux, uy, _) = self._seen(context)[1], self._velocity.Eval(context)
        v, omega = ux * x + uy * y, (uy * x - ux * y) / self._hand_m
        output.SetFromVector([0.0, 0.0, (v - omega * HALF_BASE_M) / WHEEL_M, (v + omega * HALF_BASE_M) / WHEEL_M])
