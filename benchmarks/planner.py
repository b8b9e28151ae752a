"""Joint plans for teams that block each other: who gets a way, when robots arrive, what it costs, is it safe.

    python benchmarks/planner.py                      # dead ends, alcoves, packed rooms, circles, fields, rooms, maps
    python benchmarks/planner.py --only deadend4 sealed
    python benchmarks/planner.py --random 120 --moving 1
    python benchmarks/planner.py --runs 60 --only deadend5 rooms27-0

Robots have targets only: their presets are over. The planner is called once, from the starts; with `--runs` whole
scenarios are simulated under (d), with presets straight to the targets. Distances are measured by
this script. CPU times depend on the machine; compare those of one run. To measure another version of the package, put
its folder first on the path: `PYTHONPATH=DIR python benchmarks/planner.py`.
"""

import argparse
import math
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import combinations, pairwise

import numpy as np
import numpy.typing as npt

from airground_drake.model.geometry import outline
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.uav.coordination.joint import plan
from airground_drake.uav.coordination.roadmap import RobotTask, Space
from airground_drake.uav.coordination.single import OtherRobot

Array = npt.NDArray[np.float64]
Point = Sequence[float]
Team = tuple[Space, list[RobotTask], list[float]]

SPEED_M_S = 2.4
"""0.8 of 3 m/s."""
APART_M, SPACING_M, CLEARANCE_M = 0.8, 0.2, 0.1
PITCH_M = 1.2
"""Gap between robots one behind the other, and between places in a packed room."""


def team(ways: Iterable[tuple[Point, Point]], discs: Iterable[Point], keep: float = 0.5) -> Team:
    """Robots without bodies from starts to targets, among discs from whose centres they keep a distance, m."""
    rows = outline.balls([[*disc[:2], 0.0] for disc in discs])
    space = Space(rows, np.full(len(rows), keep), CLEARANCE_M, APART_M, SPACING_M)
    tasks = [RobotTask(np.array(a, dtype=float), np.array([[0.0, *map(float, b)]])) for a, b in ways]
    return space, tasks, [SPEED_M_S] * len(tasks)


def wall(a: Point, b: Point, step: float = 0.5) -> list[tuple[float, float]]:
    """Discs along a line, `step`, m, apart."""
    count = round(math.dist(a, b) / step)
    return [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(count + 1)]


def corridor(length: float, *, left: bool = True, right: bool = False) -> list[tuple[float, float]]:
    """A corridor in which robots cannot pass each other, closed on one side or both."""
    found = wall((0, 0.7), (length, 0.7)) + wall((0, -0.7), (length, -0.7))
    for is_closed, x in ((left, 0.0), (right, length)):
        found += wall((x, -0.7), (x, 0.7)) if is_closed else []
    return found


def dead_end(count: int) -> Team:
    """Robots one behind the other that are to stand in the opposite order."""
    xs = [1.0 + PITCH_M * k for k in range(count)]
    length = 6.0 if count <= 4 else PITCH_M * (count + 1)
    return team([((x, 0), (y, 0)) for x, y in zip(xs, xs[::-1], strict=True)], corridor(length))


def dead_end_2() -> Team:
    """One is to leave a dead end, and one who stands in its way is to go to the end of it."""
    return team([((1, 0), (10, 1.5)), ((2.2, 0), (1, 0))], corridor(6.0))


def sealed() -> Team:
    """No plan exists: two in a closed corridor are to change places."""
    return team([((1, 0), (4, 0)), ((4, 0), (1, 0))], corridor(6.0, right=True))


def alcove(each_side: int = 1) -> Team:
    """Robots meet in a corridor with one alcove that holds one of them."""
    discs = [p for p in wall((0, 0.7), (10, 0.7)) if not 4.2 <= p[0] <= 5.8] + wall((0, -0.7), (10, -0.7))
    discs += wall((4.1, 0.7), (4.1, 2.3)) + wall((5.9, 0.7), (5.9, 2.3)) + wall((4.1, 2.3), (5.9, 2.3))
    if each_side == 2:
        for a, b, end in ((-2.0, -0.5, -2.0), (10.5, 12.0, 12.0)):
            discs += wall((a, 0.7), (b, 0.7)) + wall((a, -0.7), (b, -0.7)) + wall((end, -0.7), (end, 0.7))
    xs = [1.0 + PITCH_M * k for k in range(each_side)]
    return team([((x, 0), (10 - x, 0)) for x in [*xs, *(10 - x for x in xs[::-1])]], discs)


def tee() -> Team:
    """Three at the ends of a T-shaped corridor, each to the next end."""
    discs = wall((0, 0.7), (4.3, 0.7)) + wall((5.7, 0.7), (10, 0.7)) + wall((0, -0.7), (10, -0.7))
    discs += wall((4.3, 0.7), (4.3, 5)) + wall((5.7, 0.7), (5.7, 5))
    return team([((1, 0), (9, 0)), ((9, 0), (5, 4)), ((5, 4), (1, 0))], discs)


def ring(count: int, by: int, radius: float) -> Team:
    """Robots in a circular corridor, each to the place of the robot `by` places ahead."""
    turns = 2.0 * math.pi * np.arange(count) / count
    places = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    discs: list[Point] = []
    for edge, least in ((radius + 0.75, 56), (radius - 0.75, 34)):
        around = np.linspace(0.0, 2.0 * math.pi, max(least, int(2.0 * math.pi * edge / 0.45)), endpoint=False)
        discs += [(edge * math.cos(a), edge * math.sin(a)) for a in around]
    return team([(places[k], places[(k + by) % count]) for k in range(count)], discs)


def circle(count: int, radius: float | None = None) -> Team:
    """Robots on a circle, each to the opposite place, with a disc in the middle."""
    radius = radius or {13: 8.0}.get(count, count / 2.0)
    turns = 0.2 + 2.0 * math.pi * np.arange(count) / count
    places = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    return team([(place, -place) for place in places], [(0.0, 0.0)], keep=0.8)


def packed(count: int) -> Team:
    """A closed room with 4 x 4 places: nearly a sliding puzzle."""
    rng = np.random.default_rng(0)
    places = [(PITCH_M * i, PITCH_M * j) for i in range(4) for j in range(4)]
    starts, targets = (rng.permutation(16)[:count] for _ in range(2))
    low, high = -0.75, 3 * PITCH_M + 0.75
    corners = [(low, low), (high, low), (high, high), (low, high), (low, low)]
    discs = [p for a, b in pairwise(corners) for p in wall(a, b, 0.4)]
    return team([(places[a], places[b]) for a, b in zip(starts, targets, strict=True)], discs)


def field(count: int, seed: int) -> Team:
    """Robots and 60 discs at random in a square of 16 m."""
    rng = np.random.default_rng(seed)

    def spread(number: int, least: float) -> list[Array]:
        found: list[Array] = []
        while len(found) < number:
            place = rng.uniform(0.0, 16.0, 2)
            if all(math.dist(place, other) > least for other in found):
                found.append(place)
        return found

    starts, targets = spread(count, 1.3), spread(count, 1.3)
    discs = [p for p in spread(60, 1.2) if min(math.dist(p, other) for other in starts + targets) > 0.7]
    return team(zip(starts, targets, strict=True), discs)


def rooms(seed: int, count: int) -> Team:
    """Robots in 3 x 3 rooms of 5 m with doors of 2.2 m, one to three to a room, each to a place in some room."""
    rng, size, door, step = np.random.default_rng(seed), 5.0, 2.2, 0.5
    places = [(i, j) for i in range(3) for j in range(3)]
    walls = [((i, j), (i + 1, j)) for i in range(2) for j in range(3)]
    walls += [((i, j), (i, j + 1)) for i in range(3) for j in range(2)]
    joined = {place: {place} for place in places}
    opened = set[int]()
    for k in rng.permutation(len(walls)).tolist():
        a, b = walls[k]
        if joined[a] is not joined[b]:
            together = joined[a] | joined[b]
            joined.update(dict.fromkeys(together, together))
            opened.add(k)
        elif rng.random() < 0.3:
            opened.add(k)
    discs = set[tuple[float, float]]()

    def line(a: Point, b: Point, gap: float | None = None) -> None:
        length = math.dist(a, b)
        for along in step * np.arange(round(length / step) + 1):
            if gap is None or abs(along - gap) >= door / 2 + 0.25:
                discs.add(
                    (round(a[0] + (b[0] - a[0]) * along / length, 3), round(a[1] + (b[1] - a[1]) * along / length, 3))
                )

    far = 3.0 * size
    for a, b in (((0, 0), (far, 0)), ((0, far), (far, far)), ((0, 0), (0, far)), ((far, 0), (far, far))):
        line(a, b)
    for k, ((i, j), (m, n)) in enumerate(walls):
        gap = float(rng.uniform(1.6, size - 1.6)) if k in opened else None
        end = (m * size, j * size + size) if i != m else (i * size + size, n * size)
        line((m * size, n * size), end, gap)
    orders = rng.permutation(len(places)), rng.permutation(len(places))
    offsets = [(-0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)] if count > len(places) else [(0.0, 0.0)]

    def place(order: npt.NDArray[np.int64], k: int) -> tuple[float, float]:
        (i, j), (x, y) = places[order[k % len(places)]], offsets[k // len(places)]
        return (
            i * size + size / 2 + x + rng.uniform(-0.3, 0.3),
            j * size + size / 2 + y + rng.uniform(-0.3, 0.3),
        )

    starts, targets = ([place(order, k) for k in range(count)] for order in orders)
    return team(zip(starts, targets, strict=True), sorted(discs))


def cells(kind: str, count: int, size: int = 32) -> Team:
    """Square cells of 1 m as in the grids of the MAPF benchmarks; a blocked cell is a disc to keep 0.6 m from."""
    rng = np.random.default_rng([1, {"empty": 0, "random": 1, "room": 2}[kind]])
    blocked = np.zeros((size, size), dtype=bool)
    if kind == "random":
        blocked = rng.random((size, size)) < 0.2
    if kind == "room":  # rooms of 4 x 4 cells, with doors of one cell
        blocked[::5, :] = blocked[:, ::5] = True
        for i in range(0, size, 5):
            for j in range(0, size, 5):
                if i + 5 < size:
                    blocked[i + 5, min(j + 1 + rng.integers(4), size - 1)] &= rng.random() < 0.15
                if j + 5 < size:
                    blocked[min(i + 1 + rng.integers(4), size - 1), j + 5] &= rng.random() < 0.15
    free = np.array(_largest_part(~blocked), dtype=float)
    starts, targets = (free[rng.permutation(len(free))[:count]] for _ in range(2))
    edge = [(x, y) for x in range(-1, size + 1) for y in range(-1, size + 1) if min(x, y) < 0 or max(x, y) >= size]
    return team(zip(starts, targets, strict=True), [*np.argwhere(blocked).tolist(), *edge], keep=0.6)


def _largest_part(free: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """The free cells of the largest connected part, sorted."""
    left, best = {(int(i), int(j)) for i, j in np.argwhere(free)}, set[tuple[int, int]]()
    while left:
        part, stack = set[tuple[int, int]](), [left.pop()]
        while stack:
            i, j = stack.pop()
            part.add((i, j))
            for near in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if near in left:
                    left.remove(near)
                    stack.append(near)
        best = max(best, part, key=len)
    return sorted(best)


INSTANCES: dict[str, Callable[[], Team]] = {
    **{f"deadend{n}": partial(dead_end, n) for n in (3, 4, 5, 6, 8)},
    "deadend2": dead_end_2, "alcove": alcove, "alcove4": partial(alcove, 2), "tee": tee, "sealed": sealed,
    **{f"packed{n}": partial(packed, n) for n in (10, 12, 14)},
    "ring8": partial(ring, 8, 2, 3.2), "ring16": partial(ring, 16, 3, 5.0),
    **{f"circle{n}": partial(circle, n) for n in (13, 24, 25, 30, 36, 40)}, "circle40tight": partial(circle, 40, 10.0),
    **{f"field30-{seed}": partial(field, 30, 3 + seed) for seed in range(3)},
    **{f"rooms9-{seed}": partial(rooms, seed, 9) for seed in range(3)},
    **{f"rooms{n}-{seed}": partial(rooms, seed, n) for seed in range(2) for n in (18, 27)},
    **{f"{kind}32-{n}": partial(cells, kind, n) for kind in ("empty", "random", "room") for n in (20, 40, 64, 100)},
}  # fmt: skip
DEFAULT = [name for name in INSTANCES if not name.endswith("-100")]
"""Those that run without `--only`."""


def random_team(seed: int, moving: int) -> tuple[Space, list[RobotTask], list[float], list[OtherRobot]]:
    """A dense team of 4 to 16 robots with bodies and speeds of their own, and robots with known motions that cross."""
    count, extent = [(4, 5.0), (8, 6.0), (12, 7.0), (16, 9.0)][seed % 4]
    bodies = [(0.0,), (0.0, 0.3), (0.1, 0.0, 0.4)][seed % 3]
    rng = np.random.default_rng([seed, count])
    discs = rng.uniform(0.0, extent, (([0, 6, 10, 15][seed // 3 % 4]), 2))
    own = [bodies[k % len(bodies)] for k in range(count)]

    def spread() -> list[Array]:
        found: list[Array] = []
        for _ in range(20_000):
            place, body = rng.uniform(0.0, extent, 2), own[min(len(found), count - 1)]
            clear = all(math.dist(place, disc) >= 0.67 + body for disc in discs)
            beside = (math.dist(place, other) >= 0.82 + body + own[k] for k, other in enumerate(found))
            if len(found) < count and clear and all(beside):
                found.append(place)
        return found

    starts, targets = spread(), spread()
    space, tasks, _ = team(zip(starts, targets, strict=False), discs)
    tasks = [RobotTask(task.start, task.preset, body) for task, body in zip(tasks, own, strict=False)]
    speeds = rng.uniform(1.0, 2.5, len(tasks)).tolist()
    lanes = [extent * (k + 1) / (moving + 1) for k in range(moving)]
    fixed = [OtherRobot(np.array([[0.0, -3.0, y], [2.0 + extent, extent + 3.0, y]]), 0.2) for y in lanes]
    return space, tasks, speeds, fixed


def shortfall(space: Space, tasks: Sequence[RobotTask], motions: Sequence[Array], fixed: Sequence[OtherRobot]) -> float:
    """By how much a distance between robots falls short, m, at samples and at all rows of both motions.

    Less than the safe distance counts as kept where robots begin or end nearer.
    """
    worst = -math.inf
    bodies = [(task.body, motion) for task, motion in zip(tasks, motions, strict=True)]
    pairs = [*combinations(bodies, 2), *((own, (each.radius, each.motion)) for own in bodies for each in fixed)]
    for (a, one), (b, other) in pairs:
        end = max(one[-1, 0], other[-1, 0])
        t = np.unique(np.concatenate([one[:, 0], other[:, 0], np.linspace(0.0, end, 2000)]))
        p, q = (np.column_stack([np.interp(t, w[:, 0], axis) for axis in w[:, 1:].T]) for w in (one, other))
        apart = np.hypot(*(p - q).T)
        worst = max(worst, min(space.apart + a + b, apart[0], apart[-1]) - float(apart.min()))
    return worst


def measured(
    space: Space, tasks: list[RobotTask], speeds: list[float], fixed: Sequence[OtherRobot] = ()
) -> tuple[int, float, float, float, float, str]:
    """Robots with a way, sum and last of their times, s, CPU time, s, worst shortfall, m, and the outcome."""
    begin = time.process_time()
    found = plan(space, tasks, speeds, fixed)
    cpu = time.process_time() - begin
    motions = [
        np.array([[0.0, *task.start]]) if way is None else way.motion
        for task, way in zip(tasks, found.ways, strict=True)
    ]
    times = [way.joined for way in found.ways if way is not None]
    worst = shortfall(space, tasks, motions, fixed) if found.complete else -math.inf
    return len(times), sum(times), max(times, default=0.0), cpu, worst, str(getattr(found, "outcome", found.complete))


def scenario_of(name: str, of: Team, duration_s: float) -> Scenario:
    """A team in a scenario under (d) with `coordinate`; presets lead straight to the targets."""
    space, tasks, _ = of
    ugvs, middle = {}, [*np.mean([task.start for task in tasks], axis=0).tolist(), 3.0]
    for k, task in enumerate(tasks):
        start, target = ([*map(float, place), 0.0] for place in (task.start, task.preset[-1, 1:]))
        end = target if math.dist(start, target) > 1e-3 else [target[0] + 1e-3, *target[1:]]
        preset = {"waypoints_m": [start, end], "speed_m_s": 1.0}
        ugvs[f"ugv{k + 1}"] = {"start_m": start, "target_m": target, "preset": preset, "max_speed_m_s": SPEED_M_S / 0.8}
    places = space.rows[:, outline.MIDDLE : outline.EXTENT].tolist()
    data = {
        "name": name.replace("-", "_"), "duration_s": duration_s, "ugvs": ugvs, "runs": {"d": {"method": "d"}},
        "uav": {"start_m": middle, "target_m": middle, "altitude_m": middle[2]},
        "obstacles": {f"o{k}": {"position_m": [*place, 0.0]} for k, place in enumerate(places)},
        "safe_distance": {"obstacle_m": float(space.keep[0]), "ugv_m": APART_M, "air_ground_m": 0.8},
        "decision": {"threshold": {"zeta_m": 1.0}, "release_m": 0.5},
        "intervention": {"policies": [{"name": "coordinate"}]},
    }  # fmt: skip
    return from_data(data, name)


def simulated(name: str, of: Team, duration_s: float) -> tuple[list[float], float]:
    """Times of arrival, s, in a whole run, and its CPU time, s."""
    scenario, begin = scenario_of(name, of, duration_s), time.process_time()
    trace = simulate(scenario, "d")
    cpu = time.process_time() - begin
    arrivals = (event for event in trace.events if event["kind"] == "arrival")
    return [event["t_s"] for event in arrivals if event["robot"] in scenario.ugvs], cpu


def main() -> None:
    """Print a table of instances, or the sums over random teams and every team that lost a robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=INSTANCES, default=DEFAULT, metavar="NAME")
    parser.add_argument("--random", type=int, default=0, metavar="N", help="number of random teams")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first of them")
    parser.add_argument("--moving", type=int, default=0, help="robots with known motions that cross")
    parser.add_argument("--runs", type=float, default=0.0, metavar="SECONDS", help="simulate whole runs of that length")
    given = parser.parse_args()
    measured(*dead_end(3))  # compiles
    if given.random:
        sums = np.zeros(4)
        for seed in range(given.first, given.first + given.random):
            space, tasks, speeds, fixed = random_team(seed, given.moving)
            ways, total, _, cpu, worst, outcome = measured(space, tasks, speeds, fixed)
            sums += len(tasks), ways, total, cpu
            if ways < len(tasks) or worst > 2e-9:
                print(f"seed {seed}: {ways} of {len(tasks)}, {outcome}, shortfall {worst:.1e} m", flush=True)
        print("{:.0f} robots, {:.0f} with a way, sum of times {:.1f} s, CPU {:.1f} s".format(*sums))
        return
    if given.runs:
        print("| instance | robots | arrive | last, s | CPU, s |\n| --- | --- | --- | --- | --- |")
        for name in given.only:
            instance = INSTANCES[name]()
            times, cpu = simulated(name, instance, given.runs)
            print(
                f"| {name} | {len(instance[1])} | {len(times)} | {max(times, default=0.0):.1f} | {cpu:.1f} |",
                flush=True,
            )
        return
    print("| instance | robots | with a way | sum, s | last, s | CPU, s | outcome | shortfall, m |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in given.only:
        instance = INSTANCES[name]()
        ways, total, last, cpu, worst, outcome = measured(*instance)
        row = f"{ways} | {total:.2f} | {last:.2f} | {cpu:.2f} | {outcome} | {worst:.1e}"
        print(f"| {name} | {len(instance[1])} | {row} |", flush=True)


if __name__ == "__main__":
    main()
