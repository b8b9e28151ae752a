"""Rooms with walls, doors and boxes, and four robots that change sides; beside them ORCA (`pip install '.[bench]'`).

    python benchmarks/rooms.py -n 60
    python benchmarks/rooms.py -n 60 --robots burgers

Robots have the size and the speed of a TurtleBot3 Burger. They drive in any direction at once or, as `burgers`, they
are differential drives with the Burger's limits, steered by a hand point 0.1 m ahead of the axle. Then ORCA steers such
points, too, as discs that contain the body at every heading; it knows no turning limit. Walls with a door each divide
the hall into three rooms. Presets lead straight to the targets, so through walls, and ORCA plans no way round.
"""

import argparse
from functools import partial
from statistics import median
from typing import Any, NamedTuple

import maps
import numpy as np
import orca

from airground_drake.base.arrays import Array
from airground_drake.base.parallel import run_parallel
from airground_drake.report.metrics import outcome
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate

WAYS = ("orca", "a", "b", "d")
HALF_M, THICK_M, SAFE_M, DURATION_S = (4.2, 3.2), 0.1, 0.1, 120.0
"""Half of the sides of the hall, thickness of walls, distance to keep, m; length of a run, s."""
BURGER = {"kind": "unicycle", "hand_point_m": 0.1, "max_turn_rad_s": 2.84, "wheel_base_m": 0.16,
          "max_wheel_speed_m_s": 0.22}  # fmt: skip
RADIUS_M, MOST_M_S, PRESET_M_S, CLEAR_M = 0.105, 0.22, 0.15, 0.45
"""Of a robot: radius, speed limit, speed of its preset; room about its start and target, m."""


class Run(NamedTuple):
    """When robots arrived, s, and whether all kept their distances."""

    arrived_s: tuple[float, ...]
    kept: bool


def boxes(rng: np.random.Generator) -> list[Array]:
    """Walls with doors and three boxes: lower and upper corners, (2, 2), m."""
    found = []
    for x in (-1.4, 1.4):
        left, door, width = x + rng.uniform(-0.3, 0.3), rng.uniform(-2.2, 2.2), rng.uniform(1.0, 1.6)
        found.append(np.array([[left, -HALF_M[1]], [left + THICK_M, door - 0.5 * width]]))
        found.append(np.array([[left, door + 0.5 * width], [left + THICK_M, HALF_M[1]]]))
    for x in (-2.9, 0.0, 2.9):
        corner = np.array([x, 0.0]) + rng.uniform((-0.4, -2.4), (0.0, 1.8))
        found.append(np.array([corner, corner + rng.uniform(0.3, 0.7, 2)]))
    return found


def drawn(seed: int, robots: str) -> Scenario:
    """Rooms, and two robots on each side that are to change it."""
    rng = np.random.default_rng(seed)
    around = boxes(rng)
    data: dict[str, Any] = {
        "name": f"rooms{seed}", "seed": seed, "duration_s": DURATION_S, "arrival_tolerance_m": 0.1, "ugvs": {},
        "uav": {"start_m": [0.0, 0.0, 2.5], "altitude_m": 2.5, "max_speed_m_s": 2.0},
        "arena_m": [[-side for side in HALF_M], [*HALF_M]],
        "obstacles": {
            f"box{k}": {"position_m": each.mean(axis=0).tolist(), "size_m": (each[1] - each[0]).tolist()}
            for k, each in enumerate(around)
        },
        "safe_distance": {"obstacle_m": SAFE_M, "ugv_m": SAFE_M, "air_ground_m": 0.8},
        "control": {"period_s": orca.STEP_S, "avoidance_gain_1_s": 3.0, "sensing_range_m": 2.0},
        "decision": {"threshold": {"zeta_m": 0.6}, "release_m": 0.4, "noise_m_sqrt_s": 0.0},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "runs": {method: {"method": method} for method in ("a", "b", "d")},
    }  # fmt: skip
    ends: dict[int, list[Array]] = {-1: [], 1: []}
    for side, places in ends.items():
        while len(places) < 4:  # two starts, two targets
            place = np.array([side * rng.uniform(2.0, 3.6), rng.uniform(-2.6, 2.6)])
            off = [np.linalg.norm(place - np.clip(place, *box)) for box in around]
            if min(off) > CLEAR_M and all(np.linalg.norm(place - other) > 2.0 * CLEAR_M for other in places):
                places.append(place.round(3))
    for k in range(4):
        side = -1 if k < 2 else 1
        start, target = ends[side][k % 2], ends[-side][2 + k % 2]
        robot = maps.straight(start, target, PRESET_M_S, max_speed_m_s=MOST_M_S, radius_m=RADIUS_M)
        data["ugvs"][f"robot{k}"] = robot
        if robots == "burgers":
            robot["plant"] = BURGER | {"heading_rad": 0.0 if side < 0 else np.pi}
    return from_data(data, f"rooms of seed {seed}")


def run(seed: int, robots: str, way: str) -> Run:
    """One run."""
    scenario = drawn(seed, robots)
    if way == "orca":
        reach = RADIUS_M + (BURGER["hand_point_m"] if robots == "burgers" else 0.0)
        return by_orca(scenario, reach, boxes(np.random.default_rng(seed)))
    trace = simulate(scenario, way)
    arrived = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in scenario.ugvs]
    return Run(tuple(arrived), bool(outcome(trace)["kept"]))


def by_orca(scenario: Scenario, radius: float, around: list[Array]) -> Run:
    """The same by ORCA, for discs of this radius."""
    ugvs, half = list(scenario.ugvs.values()), 0.5 * SAFE_M
    hall = orca.box(half - np.array(HALF_M), np.array(HALF_M) - half)[::-1]
    starts, targets = (np.array([getattr(ugv, name)[:2] for ugv in ugvs]) for name in ("start_m", "target_m"))
    traffic = orca.Traffic(
        starts, radius + half, MOST_M_S, orca.presets_of(scenario),
        [hall, *(orca.box(low - half, high + half) for low, high in around)],
        np.empty((0, 1, 2)), 0.0, scenario.seed,
    )  # fmt: skip
    t, places = orca.driven(traffic, DURATION_S)
    there = np.linalg.norm(places[..., :2] - targets[:, None], axis=2) <= scenario.arrival_tolerance_m
    arrived = [float(t[row.argmax()]) for row in there if row.any()]
    pairs = [np.linalg.norm(places[i] - places[j], axis=1).min() for i in range(4) for j in range(i)]
    off = min(np.linalg.norm(places[..., :2] - np.clip(places[..., :2], *box), axis=2).min() for box in around)
    return Run(tuple(arrived), min(pairs) >= 2.0 * radius + SAFE_M - 1e-3 and off >= radius + SAFE_M - 1e-3)


def main() -> None:
    """Print a line per way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=20, help="rooms (default: 20)")
    parser.add_argument("--seed", type=int, default=1, help="of the first (default: 1)")
    parser.add_argument("--robots", choices=("first-order", "burgers"), default="first-order")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS), help="default: all")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each processor)")
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.n)
    print("| way | robots | arrived | in rooms where all arrive | last arrival, median, s | rooms: too near |")
    print("| --- | --- | --- | --- | --- | --- |")
    for way in given.ways:
        work = [partial(run, seed, given.robots, way) for seed in seeds]
        found = run_parallel(work, names=[f"seed {seed}" for seed in seeds], jobs=given.jobs)
        arrived = sum(len(each.arrived_s) for each in found)
        whole = [max(each.arrived_s) for each in found if len(each.arrived_s) == 4]
        last = f"{median(whole):.1f}" if whole else "-"
        short = sum(not each.kept for each in found)
        print(f"| {way} | {4 * given.n} | {arrived} | {len(whole)} | {last} | {short} |", flush=True)


if __name__ == "__main__":
    main()
