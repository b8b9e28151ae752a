"""What obstacles cost: the UGVs' law and a control period, among more and more rectangles; a wall as one or 60 bodies.

    python benchmarks/obstacles.py --quick
    python benchmarks/obstacles.py

Times are the least of some repetitions; the ratios are of this machine and this call.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from airground_drake.model.geometry import convex, outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Obstacle, Preset, Run, Scenario, Ugv
from airground_drake.scenario.world import make_world
from airground_drake.sim.simulation import Recorder

APART_M = 3.0


def crowd(ugvs: int, boxes: int) -> Scenario:
    """UGVs side by side on their way, boxes beyond; all is free of conflicts."""
    base = load("minimal")
    base.ugvs = {
        f"ugv{i}": Ugv(
            [APART_M * i, 0.0, 0.0], [APART_M * i, 8.0, 0.0], Preset([[APART_M * i, y, 0.0] for y in (0, 8)])
        )
        for i in range(ugvs)
    }
    side = int(np.ceil(np.sqrt(boxes)))
    base.obstacles = {
        f"box{k}": Obstacle([-5.0 - 1.5 * (k % side), 1.5 * (k // side), 0.0], size_m=[0.8, 0.4], heading_rad=0.1 * k)
        for k in range(boxes)
    }
    safe = replace(base.safe_distance, obstacle_m=0.3, ugv_m=0.5)
    runs = {"a": Run("a", expected={"LIVE-GOAL": "nothing"})}
    changed = replace(base, safe_distance=safe, runs=runs, duration_s=8.0, reproduction=[], choices=[], expected={})
    changed.uav.start_m, changed.uav.target_m = [0.0, 0.0, 4.0], []
    changed.uav.altitude_m = 4.0
    return changed


def fastest(work: Callable[[], object], times: int) -> float:
    """Least CPU time of a call, s."""
    found = []
    for _ in range(times):
        started = time.process_time()
        work()
        found.append(time.process_time() - started)
    return min(found)


def law_s(scenario: Scenario) -> float:
    """Of one command of all UGVs, s."""
    world, control = make_world(scenario), scenario.control
    near, count = world.around(world.select("ugv")), len(scenario.ugvs)
    law = UgvLaw(Avoidance(control.avoidance_gain_1_s, control.period_s, control.sensing_range_m), 2.0, 1.5, False)
    target, rate, nobody = np.zeros((count, 3)), np.zeros((count, 3)), [None] * count
    law.velocity(world.starts, near, target, rate, nobody)
    return fastest(lambda: [law.velocity(world.starts, near, target, rate, nobody) for _ in range(20)], 5) / 20.0


def wall(parts: int) -> Scenario:
    """A UGV whose preset leads through a wall of 10 m: one polygon, or this many discs."""
    scenario = crowd(1, 0)
    scenario.ugvs["ugv0"] = Ugv([0.0, -4.0, 0.0], [9.0, 4.0, 0.0], Preset([[0.0, -4.0, 0.0], [9.0, 4.0, 0.0]]))
    if parts == 1:
        scenario.obstacles = {"wall": Obstacle(segment_m=[[-5.0, 0.0], [5.0, 0.0]])}
    else:
        places = np.linspace(-5.0, 5.0, parts)
        scenario.obstacles = {f"disc{k}": Obstacle([float(x), 0.0, 0.0]) for k, x in enumerate(places)}
    return scenario


def main() -> None:
    """Print a line per setting."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer settings")
    quick = parser.parse_args().quick
    print("UGVs  boxes  validation s  law us  period us")
    for ugvs in (1, 10) if quick else (1, 10, 100):
        for boxes in (0, 60, 1000) if quick else (0, 60, 1000, 10000):
            given = crowd(ugvs, boxes)
            checked = fastest(lambda given=given: validated(given), 1)
            recorder = Recorder(given, "a")
            steps = given.duration_s / given.control.period_s
            period = fastest(recorder.simulate, 2) / steps
            print(f"{ugvs:4} {boxes:6} {checked:13.2f} {1e6 * law_s(given):7.1f} {1e6 * period:10.0f}", flush=True)
    for parts in (1, 60, 200):
        recorder = Recorder(wall(parts), "a")
        trace, cost = recorder.simulate(), fastest(recorder.simulate, 3)
        line, way = outline.prism([[-5.0, 0.0], [5.0, 0.0]])[None], trace.position("ugv0")
        least = min(float(convex.distances(line, place, True)[0]) for place in way)
        print(f"a wall of {parts:3} bodies: {1e3 * cost:6.1f} ms a run, {least:.6f} m from its line, 0.3 m required")


if __name__ == "__main__":
    main()
