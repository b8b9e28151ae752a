"""Random courses: robots on both sides of a field of discs, each with a target on the other side.

A course is drawn from its seed, the number of UGVs and the density alone, so that every method gets the same one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Place = Sequence[float] | Array

COURSE_M = 20.0
"""Distance between the two strips in which UGVs start and end, m."""

STRIP_M = 1.0
"""Half the depth of a strip, m; without effect for a single UGV, which crosses from (0, 0) to (20, 0)."""

SAFE_M = 2.0
"""Safe distance d, m, of every pair of UGVs, and of UGVs and obstacles."""

ROOM_M = 0.3
"""Margin of starts and targets beyond the safe distance, m."""

PRESET_M_S, MAX_M_S, DETOUR_M_S = 1.0, 3.0, 2.5
"""Speeds of the preset trajectory, of the robot, and of the UAV's detours, m/s."""

WALL_SPACING_M = 3.0
"""Distance between the discs of a wall, m: less than 2 d, so that nothing passes between them."""

WIDTH_M = {1: 10.0, 2: 10.0, 4: 16.0, 8: 26.0}
DURATION_S = {1: 60.0, 2: 60.0, 4: 60.0, 8: 90.0}
"""Width of the field, m, and length of a run, s, by the number of UGVs."""


@dataclass(frozen=True)
class Course:
    """Starts and targets of the UGVs, (n, 2), and centres of the obstacles, (m, 2); m."""

    seed: int
    density: float
    walls: bool
    starts: Array
    targets: Array
    obstacles: Array

    @property
    def ugvs(self) -> int:
        """Number of UGVs."""
        return len(self.starts)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        percent = round(100.0 * self.density)
        walls = "_walls" if self.walls else ""
        return f"liveness_u{self.ugvs}_density{percent}{walls}_seed{self.seed}"

    @property
    def duration_s(self) -> float:
        """Length of a run, s."""
        return DURATION_S[self.ugvs]


def draw(seed: int, ugvs: int, density: float = 1.0, walls: bool = False) -> Course:
    """The course of a seed.

    For one UGV and density 1 there are 4 to 9 obstacles on a field 20 m long and 10 m wide; teams have as many per
    area. Obstacles may overlap and may shut the UGVs in: `feasible` finds out whether there is a way.

    Args:
        seed: of the course.
        ugvs: 1, 2, 4 or 8.
        density: factor on the number of obstacles.
        walls: discs all around the field and the strips, so that there is no way round.

    Raises:
        ValueError: for another number of UGVs.
    """
    if ugvs not in WIDTH_M:
        raise ValueError(f"{ugvs} UGVs: one of {', '.join(map(str, WIDTH_M))} is wanted")
    rng = np.random.default_rng([20261122, ugvs, round(1000 * density), seed])
    width = WIDTH_M[ugvs]
    if ugvs == 1:
        starts, targets = np.array([[0.0, 0.0]]), np.array([[COURSE_M, 0.0]])
    else:
        eastward = rng.permutation(np.arange(ugvs) % 2 == 0)
        starts = _apart(rng, np.where(eastward, 0.0, COURSE_M), width)
        targets = _apart(rng, np.where(eastward, COURSE_M, 0.0), width)
    usual = rng.integers(4, 10)
    count = round(density * float(usual) * width / WIDTH_M[1])
    obstacles = np.empty((count, 2))
    kept = 0
    while kept < count:
        place = rng.uniform([0.0, -width / 2.0], [COURSE_M, width / 2.0])
        ends = np.concatenate([starts, targets])
        if np.linalg.norm(ends - place, axis=1).min() >= SAFE_M + ROOM_M:
            obstacles[kept] = place
            kept += 1
    if walls:
        obstacles = np.concatenate([obstacles, _walls(width)])
    return Course(seed, density, walls, starts, targets, obstacles)


def _walls(width: float) -> Array:
    """Centres of discs on a rectangle around the field and the strips, (k, 2), m."""
    low = np.array([-SAFE_M - STRIP_M - ROOM_M, -width / 2.0 - SAFE_M - ROOM_M])
    high = np.array([COURSE_M - low[0], -low[1]])
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    sides = []
    for corner, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = int(np.ceil(np.linalg.norm(following - corner) / WALL_SPACING_M))
        sides.append(corner + np.arange(count)[:, None] / count * (following - corner))
    return np.concatenate(sides)


def _apart(rng: np.random.Generator, strip: Array, width: float) -> Array:
    """A place in its strip for each UGV, (n, 2), m, with room between all of them."""
    while True:
        places = np.column_stack([strip + rng.uniform(-STRIP_M, STRIP_M, len(strip)), np.zeros(len(strip))])
        places[:, 1] = rng.uniform(-width / 2.0, width / 2.0, len(strip))
        between = np.linalg.norm(places[:, None] - places[None], axis=2)
        between[np.diag_indices(len(places))] = np.inf
        if between.min() >= SAFE_M + 2.0 * ROOM_M:
            return places


def straight(start: Place, target: Place, speed_m_s: float, **more: Any) -> dict[str, Any]:
    """A UGV of a scenario, on the ground, whose preset leads straight to its target."""
    ends = [[float(x), float(y), 0.0] for x, y, *_ in (start, target)]
    return {"start_m": ends[0], "target_m": ends[1], "preset": {"waypoints_m": ends, "speed_m_s": speed_m_s}, **more}


def scenario_of(course: Course, policies: list[dict[str, Any]]) -> dict[str, Any]:
    """The scenario of a course, as in a file, with a run for each method.

    Args:
        course: which.
        policies: entry `intervention.policies`.
    """
    ways, height = zip(map(_on_ground, course.starts), map(_on_ground, course.targets), strict=True), 3.0
    return {
        "name": course.name,
        "title": f"Random course {course.seed}: {course.ugvs} UGVs, {len(course.obstacles)} obstacles",
        "seed": course.seed,
        "duration_s": course.duration_s,
        "ugvs": {f"ugv{i}": straight(*way, PRESET_M_S, max_speed_m_s=MAX_M_S) for i, way in enumerate(ways, start=1)},
        "uav": {
            "start_m": [*course.starts.mean(axis=0).tolist(), height],
            "target_m": [*course.targets.mean(axis=0).tolist(), height],
            "altitude_m": height,
        },
        "obstacles": {
            f"obstacle_{k + 1}": {"position_m": _on_ground(place)} for k, place in enumerate(course.obstacles)
        },
        "safe_distance": {"obstacle_m": SAFE_M, "ugv_m": SAFE_M, "air_ground_m": 1.0},
        "control": {"period_s": 0.05},
        "decision": {
            "threshold": {"rule": "fixed", "zeta_m": 3.0},
            "release_m": 2.0,
            "noise_m_sqrt_s": 0.004,
            "noise_period_s": 0.05,
        },
        "intervention": {"period_s": 0.05, "policies": policies},
        "runs": {method: {"method": method} for method in "abcd"},
    }


def _on_ground(place: Place) -> list[float]:
    """A place in the plane as a point of a scenario, m; to a micrometre, so that files are readable."""
    return [round(float(place[0]), 6), round(float(place[1]), 6), 0.0]
