"""A plant of one's own: motors that lag. The theorems are about robots that move as they are told, and do not apply.

python examples/own_plant.py
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.primitives import LinearSystem

from airground_drake import load, simulate

LAG_S = 0.2


def lagging(robot: str, start: NDArray[np.float64]) -> LinearSystem:
    """p_dot = u, u_dot = (v - u) / lag: input v (3,), m/s; output p (3,), m; at `start`, at rest."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    a, b = np.block([[zero, eye], [zero, -eye / LAG_S]]), np.vstack([zero, eye / LAG_S])
    plant = LinearSystem(A=a, B=b, C=np.hstack([eye, zero]), D=zero)
    plant.configure_default_state(np.concatenate([start, np.zeros(3)]))
    return plant


def nearest_to_the_rock(wished_m: float) -> float:
    """Least distance of the UGV from the rock at the rows of a run, m, if it is told to keep a distance."""
    scenario = load("minimal", {"safe_distance.obstacle_m": wished_m, "duration_s": 8.0})
    trace = simulate(scenario, "d", plants=lagging)
    away = trace.position("ugv1") - scenario.obstacles["rock"].position_m
    return float(np.linalg.norm(away, axis=1).min())


if __name__ == "__main__":
    for wished in (2.0, 2.25):
        print(f"told to keep {wished:g} m, it keeps {nearest_to_the_rock(wished):.3f} m")
