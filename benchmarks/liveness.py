"""Who arrives on random courses: `python benchmarks/liveness.py --ugvs 4 --maps 200 --jobs 2 -o four.jsonl`.

Draws random courses (`maps.py`), keeps those that a separate planner can finish (`feasible.py`), and simulates methods
(a) to (d) and ORCA on each, with the same speed limits. Every run becomes a line of JSON in the output file. At the end
there is a table, and a list of all courses that (d) did not finish, with the last answers of the gatekeeper. A course
is repeated by its seed:

    python benchmarks/liveness.py --only 17 --ugvs 4 --method d --write courses
    python -m airground_drake.report courses/liveness_u4_density100_seed17.yaml

Courses without a plan are counted, not run, except with `--only`. With `--walls --density 3` and more there are many.
"""

import argparse
import itertools
import json
import multiprocessing
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import maps
import numpy as np
import yaml
from feasible import joint_plan, shortest_length
from maps import Array, Course

from airground_drake.base.errors import AirgroundError
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.outlines import closest
from airground_drake.verify.runs.pairs import CENTRE

METHODS = ("a", "b", "c", "d", "orca")

CLEARANCE_M = 0.1
"""Margin of a plan for one robot beyond the safe distance, m: narrower ways do not count."""

ARRIVED_M = 0.1
TOUCHING_M = 0.05
"""Obstacles and robots within this margin of the safe distance stopped a robot, m."""

RUNS_PER_PROCESS = 25
"""Runs after which a process is replaced, to free its memory."""

SEPARATED, NO_PLAN, FEASIBLE = "separated", "no plan found", "feasible"


def bounds(course: Course) -> tuple[list[float], str]:
    """For each robot a lower bound of its time to the target, s, and whether the course can be finished.

    The bound is the larger of two times: that of the shortest path round the obstacles at the speed limit, as if it
    were alone, and that of its preset trajectory, which it follows.
    """
    times, lengths = [], []
    for start, target in zip(course.starts, course.targets, strict=True):
        length = shortest_length(start, target, course.obstacles, maps.SAFE_M + CLEARANCE_M)
        preset = float(np.linalg.norm(target - start)) / maps.PRESET_M_S
        lengths.append(length)
        times.append(max(length / maps.MAX_M_S, preset))
    if not np.isfinite(lengths).all():
        return times, SEPARATED
    if course.ugvs == 1:
        soon = lengths[0] / maps.PRESET_M_S <= course.duration_s
        return times, FEASIBLE if soon else NO_PLAN
    plan = joint_plan(
        course.starts, course.targets, course.obstacles, obstacle_m=maps.SAFE_M, ugv_m=maps.SAFE_M,
        speed_m_s=maps.PRESET_M_S, duration_s=course.duration_s, seed=course.seed,
    )  # fmt: skip
    return times, NO_PLAN if plan is None else FEASIBLE


POLICIES = [{"name": "coordinate", "parameters": {}}]


def one_run(task: dict[str, Any]) -> dict[str, Any]:
    """A line of the output: one course, one method."""
    course = maps.draw(task["seed"], task["ugvs"], task["density"], task["walls"])
    started = time.perf_counter()
    found = dict(task)
    lower, status = bounds(course)
    found |= {"obstacles": len(course.obstacles), "plan": status, "lower_bound_s": lower}
    try:
        if task["method"] == "orca":
            found |= _orca(course)
        else:
            scenario = from_data(maps.scenario_of(course, POLICIES), course.name)
            found |= _of_trace(scenario, simulate(scenario, task["method"]))
    except AirgroundError as error:
        found["error"] = f"{type(error).__name__}: {error}"
    found["wall_s"] = round(time.perf_counter() - started, 2)
    return found


def _orca(course: Course) -> dict[str, Any]:
    import orca  # needs PyRVO, an extra

    times, positions = orca.run(course)
    targets = np.column_stack([course.targets, np.zeros(course.ugvs)])
    obstacles = np.column_stack([course.obstacles, np.zeros(len(course.obstacles))])
    return _geometry(times, list(positions), targets, obstacles)


def _of_trace(scenario: Scenario, trace: Trace) -> dict[str, Any]:
    """Results of a run of the package."""
    targets = np.array([ugv.target_m for ugv in scenario.ugvs.values()])
    obstacles = np.array([each.position_m for each in scenario.obstacles.values()]).reshape(-1, 3)
    paths = [trace.position(ugv) for ugv in trace.ugvs]
    found = _geometry(trace.t, paths, targets, obstacles)
    uav = trace.position(trace.robots[-1])
    found["least_air_ground_m"] = min(closest(CENTRE, path - uav, planar=False).distance for path in paths)
    kinds = Counter(event["kind"] for event in trace.events)
    found["triggers"] = kinds["trigger"]
    found["messages"] = kinds["proposal"] + kinds["accept"] + kinds["refuse"]
    found["decisions"] = len(trace.decisions)
    found["faults"] = [fault["what"] for fault in trace.meta["faults"]][:3]
    for ugv, state in zip(trace.ugvs, found["robots"], strict=True):
        mine = trace.decisions[trace.decisions["robot"] == ugv]
        state["reasons"] = dict(Counter(mine["reason"]))
        state["triggers"] = sum(event["kind"] == "trigger" and event["robot"] == ugv for event in trace.events)
    return found


def _geometry(t: Array, paths: list[Array], targets: Array, obstacles: Array) -> dict[str, Any]:
    """Arrivals, least distances over continuous time, and where each robot ends."""
    robots = []
    for i, (path, target) in enumerate(zip(paths, targets, strict=True)):
        away = np.flatnonzero(np.linalg.norm(path - target, axis=1) > ARRIVED_M)
        first = int(away[-1]) + 1 if len(away) else 0
        robots.append(
            {
                "arrival_s": float(t[first]) if first < len(t) else None,
                "end_m": path[-1, :2].round(3).tolist(),
                "short_m": round(float(np.linalg.norm(path[-1] - target)), 3),
                "touches": _touched(i, [other[-1] for other in paths], obstacles),
            }
        )
    pairs = itertools.combinations(paths, 2)
    to_obstacles = itertools.product(paths, obstacles)
    return {
        "robots": robots,
        "least_ugv_m": min((closest(CENTRE, one - other, planar=False).distance for one, other in pairs), default=None),
        "least_obstacle_m": min(
            (closest(CENTRE, path - o, planar=False).distance for path, o in to_obstacles), default=None
        ),
    }


def _touched(robot: int, ends: list[Array], obstacles: Array) -> list[str]:
    """Names of the obstacles and robots at the safe distance from a robot at the end."""
    limit = maps.SAFE_M + TOUCHING_M
    near = [f"obstacle_{k + 1}" for k, o in enumerate(obstacles) if np.linalg.norm(ends[robot] - o) <= limit]
    others = [f"ugv{j + 1}" for j, p in enumerate(ends) if j != robot and np.linalg.norm(ends[robot] - p) <= limit]
    return near + others


def chosen(options: argparse.Namespace) -> Iterator[tuple[Course, str]]:
    """Courses, and whether each can be finished, until there are enough feasible ones."""
    enough = 0
    for seed in itertools.count() if options.only is None else options.only:
        course = maps.draw(seed, options.ugvs, options.density, options.walls)
        status = bounds(course)[1]
        enough += status == FEASIBLE
        yield course, status
        if options.only is None and enough == options.maps:
            return


def table(rows: list[dict[str, Any]]) -> list[str]:
    """One line per number of UGVs, density and method."""
    heads = (
        "UGVs", "density", "method", "maps", "maps finished", "robots arrived", "least to UGV m", "least to obstacle m",
        "runs below d", "time / bound: median", "p95", "triggers", "messages", "decisions",
    )  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|" + " --- |" * len(heads)]

    def group(row: dict[str, Any]) -> tuple[Any, ...]:
        return row["ugvs"], row["walls"], row["density"], METHODS.index(row["method"])

    for (ugvs, walls, density, method), found in itertools.groupby(sorted(rows, key=group), group):
        whole = list(found)
        mine = [row for row in whole if "error" not in row]
        robots = [robot for row in mine for robot in row["robots"]]
        arrived = sum(robot["arrival_s"] is not None for robot in robots)
        finished = sum(all(robot["arrival_s"] is not None for robot in row["robots"]) for row in mine)
        ratios = [
            robot["arrival_s"] / bound
            for row in mine
            for robot, bound in zip(row["robots"], row["lower_bound_s"], strict=True)
            if robot["arrival_s"] is not None
        ]
        below = sum(_below(row) for row in mine)
        cells = [
            str(ugvs), f"{density:g}{' walls' if walls else ''}", METHODS[method], str(len(whole)), str(finished),
            f"{arrived} of {len(whole) * ugvs}", _least(mine, "least_ugv_m"), _least(mine, "least_obstacle_m"),
            str(below), _quantile(ratios, 0.5), _quantile(ratios, 0.95),
            *(_mean(mine, name) for name in ("triggers", "messages", "decisions")),
        ]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _below(row: dict[str, Any]) -> bool:
    """Whether a distance fell below d - 1e-9 m."""
    found = [row[name] for name in ("least_ugv_m", "least_obstacle_m") if row[name] is not None]
    return min(found, default=np.inf) < maps.SAFE_M - 1e-9


def _least(rows: list[dict[str, Any]], name: str) -> str:
    found = [row[name] for row in rows if row[name] is not None]
    return f"{min(found):.4f}" if found else "-"


def _quantile(values: list[float], share: float) -> str:
    return f"{np.quantile(values, share):.2f}" if values else "-"


def _mean(rows: list[dict[str, Any]], name: str) -> str:
    found = [row[name] for row in rows if name in row]
    return f"{np.mean(found):.1f}" if found else "-"


def explanations(rows: list[dict[str, Any]], method: str) -> Iterator[str]:
    """A line for each course that a method did not finish, or on which a distance fell below the safe one."""
    for row in rows:
        if row["method"] == method:
            course = f"seed {row['seed']}, {row['ugvs']} UGVs"
            if "error" in row:
                yield f"{course}: {row['error']}"
                continue
            if _below(row):
                yield f"{course}: below d: {row['least_ugv_m']} m to UGVs, {row['least_obstacle_m']} m to obstacles"
            for i, robot in enumerate(row["robots"], start=1):
                if robot["arrival_s"] is None:
                    yield f"{course}: ugv{i} {_why(robot)}"


def _why(robot: dict[str, Any]) -> str:
    """The place of a robot and the answers of its gatekeeper."""
    touching = f", touching {', '.join(robot['touches'])}" if robot["touches"] else ""
    counts = ", ".join(f"{name} {count}" for name, count in sorted(robot.get("reasons", {}).items()))
    said = f"; {robot.get('triggers', 0)} triggers, decisions: {counts or 'none'}"
    return f"at ({robot['end_m'][0]:.2f}, {robot['end_m'][1]:.2f}), {robot['short_m']:.2f} m short{touching}{said}"


def main() -> None:
    """Draw, plan, run, print."""
    options = _parser().parse_args()
    methods = options.method or list(METHODS)
    if "orca" in methods and find_spec("pyrvo") is None:
        print("ORCA is left out: PyRVO is not installed (pip install '.[bench]')")
        methods.remove("orca")
    counts: Counter[str] = Counter()
    tasks = []
    for course, status in chosen(options):
        counts[status] += 1
        if options.write:
            options.write.mkdir(parents=True, exist_ok=True)
            path = options.write / f"{course.name}.yaml"
            path.write_text(yaml.safe_dump(maps.scenario_of(course, POLICIES), sort_keys=False), encoding="utf-8")
            print(path)
        if status == FEASIBLE or options.only is not None:
            shared = {"seed": course.seed, "ugvs": course.ugvs, "density": options.density, "walls": options.walls}
            tasks += [{**shared, "method": method} for method in methods]
    print(f"courses drawn: {dict(counts)}", flush=True)
    rows: list[dict[str, Any]] = []
    with options.output.open("w", encoding="utf-8") if options.output else nullcontext() as file:
        for row in _results(tasks, options.jobs):
            rows.append(row)
            if file is not None:
                print(json.dumps(row), file=file, flush=True)
    rows.sort(key=lambda row: row["seed"])
    print("\n".join(table(rows)))
    for method in methods:
        if method == "d" or options.only is not None:
            lost = list(explanations(rows, method))
            print("\n".join([f"\nNot finished by ({method}):", *lost] if lost else [f"\n({method}) finished all."]))


def _results(tasks: list[dict[str, Any]], jobs: int) -> Iterator[dict[str, Any]]:
    """Lines in the order in which they come."""
    if jobs < 2:
        yield from map(one_run, tasks)
        return
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=RUNS_PER_PROCESS) as pool:
        for future in as_completed([pool.submit(one_run, task) for task in tasks]):
            yield future.result()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ugvs", type=int, default=1, choices=list(maps.WIDTH_M))
    parser.add_argument("--maps", type=int, default=60, help="feasible courses to run (default: %(default)s)")
    parser.add_argument("--density", type=float, default=1.0, help="factor on the number of obstacles")
    parser.add_argument("--walls", action="store_true", help="close the field by discs all around")
    parser.add_argument("--method", action="append", choices=METHODS, help="default: all of them")
    parser.add_argument(
        "--only", type=int, action="append", metavar="SEED", help="this course, whatever the planner says"
    )
    parser.add_argument("--write", type=Path, metavar="DIR", help="write the scenarios of the courses there")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: %(default)s)")
    parser.add_argument("-o", "--output", type=Path, help="file of JSON lines")
    return parser


if __name__ == "__main__":
    main()
