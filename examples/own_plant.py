"""A plant of one's own in a Drake diagram of one's own: motors that lag, and wind.

The claims are about robots that move as they are told. These reach a commanded velocity only after a while, so that
their distances fall short; how much room that takes is found here by simulation, which proves nothing.

    python examples/own_plant.py
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LinearSystem, LogVectorOutput

from airground_drake import Scenario, build_diagram, load

LAG_S = 0.2
WIND_M_S = (0.05, 0.02, 0.0)
NEEDED_M = 2.0


def lagging(robot: str, start: NDArray[np.float64]) -> LinearSystem:
    """p_dot = u, u_dot = (v - u) / lag: input v (3,), m/s; output p (3,), m; at `start`, at rest."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    plant = LinearSystem(
        A=np.block([[zero, eye], [zero, -eye / LAG_S]]),
        B=np.vstack([zero, eye / LAG_S]),
        C=np.hstack([eye, zero]),
        D=zero,
    )
    plant.configure_default_state(np.concatenate([start, np.zeros(3)]))
    return plant


def nearest_to_the_rock(scenario: Scenario) -> float:
    """Least distance of the UGV from the rock, m, with the lagging motors and the wind."""
    builder = DiagramBuilder()
    team = builder.AddNamedSystem("team", build_diagram(scenario, "d", plants=lagging))
    wind = builder.AddNamedSystem("wind", ConstantVectorSource(np.array(WIND_M_S)))
    builder.Connect(wind.get_output_port(), team.GetInputPort("disturbance_ugv1"))
    log = LogVectorOutput(team.GetOutputPort("bodies"), builder)
    diagram = builder.Build()

    simulator = Simulator(diagram)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(scenario.duration_s)
    positions = log.FindLog(simulator.get_context()).data()[:3].T
    return float(np.linalg.norm(positions - scenario.obstacles["rock"].position_m, axis=1).min())


if __name__ == "__main__":
    for wished in (2.0, 2.25):
        nearest = nearest_to_the_rock(load("minimal", {"safe_distance.obstacle_m": wished}))
        kept = "kept" if nearest >= NEEDED_M else "broken"
        print(f"told to keep {wished:g} m, it keeps {nearest:.3f} m: {NEEDED_M:g} m are {kept}")
