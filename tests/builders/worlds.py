"""Worlds of robots and obstacles, made without a scenario."""

from collections.abc import Sequence

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import Body, Neighbours, World
from airground_drake.model.geometry import outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.plants.plant import Plant

PERIOD_S = 0.05


def world(
    ugvs: Sequence[str] | int,
    obstacles: Array | Sequence[Sequence[float]] = (),
    obstacle_m: float = 2.0,
    ugv_m: float = 2.0,
    air_ground_m: float = 1.0,
    *,
    max_speed: float | Sequence[float] = 3.0,
    radius: Array | float = 0.0,
    obstacle_radius: Array | float = 0.0,
) -> World:
    """UGVs and one UAV at the origin, and obstacles at places (m, 3), m; safe distances between surfaces, m.

    Speed limits and radii are those of all robots (UGVs, then the UAV) and of all obstacles, or one for all.
    """
    names = [f"ugv{i}" for i in range(ugvs)] if isinstance(ugvs, int) else list(ugvs)
    places = np.array(obstacles, dtype=np.float64).reshape(-1, 3)
    limits, own = (np.broadcast_to(np.asarray(each, dtype=np.float64), len(names) + 1) for each in (max_speed, radius))
    fixed = np.broadcast_to(obstacle_radius, len(places))
    robots = [
        Body(
            name,
            "uav" if name == "uav" else "ugv",
            np.zeros(3),
            outline.balls(np.zeros(3), size),
            FirstOrder(),
            float(limit),
        )
        for name, size, limit in zip([*names, "uav"], own, limits, strict=True)
    ]
    stones = [
        Body(f"obstacle_{k}", "obstacle", place, outline.balls(np.zeros(3), size, obstacle_m))
        for k, (place, size) in enumerate(zip(places, fixed, strict=True))
    ]
    return World((*robots, *stones), {frozenset(("ugv",)): ugv_m, frozenset(("ugv", "uav")): air_ground_m})


def beside_a_wall(seed: int, plant: Plant, near: bool) -> tuple[Array, Array, float, float]:
    """Command, wish, heading, and room left, m, of a robot beside a wall along y, whatever its task asks for."""
    rng, rows = np.random.default_rng(seed), outline.stacked([outline.prism([[0.0, -9.0], [0.0, 9.0]], gap=0.5)])
    robot = Body("robot", "ugv", np.zeros(3), plant=plant, max_speed_m_s=1.0)
    around = World((robot, Body("wall", "obstacle", np.zeros(3), rows)), {}, 3.0).around(slice(0, 1))
    left_m = float(rng.uniform(0.0, 0.1 if near else 9.0))
    place = np.array([[around.distance[0, 0] + left_m, 0.0, 0.0]])
    heading, wish = rng.uniform(-np.pi, np.pi, 1), np.append(rng.uniform(-2.0, 2.0, 2), 0.0)
    law = UgvLaw(Avoidance(3.0, PERIOD_S), 1.0, 1.0, False)
    command = law.velocity(place, around, place, wish[None], [None], (heading, plant.steering[None]))[0]
    return command, wish, float(heading[0]), left_m


def among_points(robots: Array, points: Array, safe: Array, share: Array, mobility: Array) -> tuple[Array, Neighbours]:
    """Robots at places (k, 3), m, each beside points of its own, (k, K, 3), m; `safe`, m, and `share` are (k, K)."""
    count, each = safe.shape
    positions = np.concatenate([robots, points.reshape(-1, 3)])
    bodies, others = np.arange(len(positions)), count + np.arange(count * each).reshape(count, each)
    parts, nothing = outline.balls(np.zeros((len(positions), 3))), outline.stacked([])
    limits = np.full(count, np.inf)
    return positions, Neighbours(bodies[:count], bodies, others, nothing, parts, safe, share, mobility, limits)
