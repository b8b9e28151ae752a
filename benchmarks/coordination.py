"""How long joint plans take: `python benchmarks/coordination.py [-n 30] [--teams 2 4 8 16] [--hopeless]`.

Draws teams and discs in a square (d = 2 m; starts, and targets, at least 2.3 m apart) and plans for all at 1 m/s.
Prints for each size of the team how many plans were complete, CPU times, orders and searched intervals, and the least
distances of the motions, which must be at least d - 1e-6 m: exit code 1 if they are not. The effort is bounded in
counts, no clock ends it. With `--hopeless` two of the robots are to exchange places in a tube without an exit, so that
all orders fail and only the others get a way: that is what a plan costs at most.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import combinations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.intervention.coordinate import warm_up
from airground_drake.intervention.coordination.joint import plan
from airground_drake.intervention.coordination.roadmap import RobotTask, Space
from airground_drake.intervention.coordination.timed import at_rest, distance

D = 2.0
"""Safe distance to obstacles and between robots, m."""
APART = 2.3
"""Between starts, between targets, and from both to obstacles, at least, m."""
TOLERANCE_M = 1e-6


def draw(seed: int, count: int, *, hopeless: bool) -> tuple[Space, list[RobotTask]]:
    """Robots, and half as many obstacles and four, in a square that grows with their number; two of them in a tube."""
    rng = np.random.default_rng([20261122, seed, count])
    obstacles = 4 + count // 2
    side = 4.5 * np.sqrt(2.0 * count + obstacles) + 4.0
    while True:
        discs = _apart(rng, obstacles, side, [])
        starts, targets = (_apart(rng, count, side, discs) for _ in range(2))
        if (len(discs), len(starts), len(targets)) == (obstacles, count, count):
            break
    tasks = [RobotTask(start, np.array([[0.0, *target]])) for start, target in zip(starts, targets, strict=True)]
    if hopeless:
        walls = [np.array([x, y]) for x in np.arange(-2.0, 9.1, 1.5) for y in (-8.2, -3.8)]
        discs += [*walls, np.array([-3.0, -6.0]), np.array([10.0, -6.0])]
        left, right = np.array([1.0, -6.0]), np.array([6.0, -6.0])
        exchange = [RobotTask(left, np.array([[0.0, *right]])), RobotTask(right, np.array([[0.0, *left]]))]
        tasks = [*exchange, *tasks[2:]]
    return Space(np.array(discs), np.full(len(discs), D), 0.1, D, 0.2), tasks


def _apart(rng: np.random.Generator, count: int, side: float, others: list[Array]) -> list[Array]:
    """So many places that keep APART from each other and from others, (2,) each, m; fewer if the draws run out."""
    found: list[Array] = []
    for _ in range(2000):
        point = rng.uniform(0.0, side, 2)
        if len(found) < count and all(np.hypot(*(point - other)) >= APART for other in [*others, *found]):
            found.append(point)
    return found


def main() -> int:
    """Draw, plan, measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", "--number", type=int, default=30, help="teams of each size (default: %(default)s)")
    parser.add_argument("--teams", type=int, nargs="+", default=[2, 4, 8, 16], help="sizes (default: %(default)s)")
    parser.add_argument("--hopeless", action="store_true", help="no complete plan exists")
    options = parser.parse_args()
    warm_up()
    failed = False
    print("robots  complete  moved  CPU p50 s  p90 s   max s  orders max  intervals max  pair m  obstacle m")
    for count in options.teams:
        times, complete, moved, orders, intervals, apart, clear = [], 0, 0, 0, 0, np.inf, np.inf
        for seed in range(options.number):
            space, tasks = draw(seed, count, hopeless=options.hopeless)
            begin = time.process_time()
            found = plan(space, tasks, [1.0] * count)
            times.append(time.process_time() - begin)
            complete += found.complete
            moved += sum(way is not None for way in found.ways)
            orders, intervals = max(orders, found.orders), max(intervals, found.expansions)
            motions = [at_rest(e.start) if w is None else w.motion for w, e in zip(found.ways, tasks, strict=True)]
            apart = min(apart, *(distance(one, other) for one, other in combinations(motions, 2)))
            clear = min(clear, *(distance(motion, at_rest(point)) for motion in motions for point in space.centres))
        failed |= min(apart, clear) < D - TOLERANCE_M
        p50, p90 = np.quantile(times, [0.5, 0.9], method="higher")
        share = f"{moved}/{count * options.number}"
        print(
            f"{count:6d}  {complete:3d}/{options.number:<4d}  {share:>7s}  {p50:7.3f}  {p90:6.3f}  {max(times):6.3f}"
            f"  {orders:10d}  {intervals:13d}  {apart:6.3f}  {clear:10.3f}",
            flush=True,
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
