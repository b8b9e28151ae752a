"""Worlds of robots and obstacles, made without a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.world.plant import FirstOrder
from airground_drake.world.shape import Ball
from airground_drake.world.world import Body, World


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
        Body(name, "uav" if name == "uav" else "ugv", np.zeros(3), Ball(float(size)), FirstOrder(), float(limit))
        for name, size, limit in zip([*names, "uav"], own, limits, strict=True)
    ]
    stones = [
        Body(f"obstacle_{k}", "obstacle", place, Ball(float(size)))
        for k, (place, size) in enumerate(zip(places, fixed, strict=True))
    ]
    return World(
        (*robots, *stones),
        {
            frozenset(("ugv",)): ugv_m,
            frozenset(("ugv", "uav")): air_ground_m,
            frozenset(("ugv", "obstacle")): obstacle_m,
            frozenset(("uav", "obstacle")): obstacle_m,
        },
    )
