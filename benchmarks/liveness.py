"""Who arrives on random courses: `python benchmarks/liveness.py --ugvs 4 --maps 200 --jobs 2 -o four.jsonl`.

Draws random courses (`maps.py`), keeps those for which a planner of the benchmark's own has a plan (`feasible.py`),
and simulates methods (a) to (d) and ORCA on each, with the same speed limits. Every run becomes a line of JSON in the
output file, so that a benchmark that was stopped goes on with `--resume`. At the end there is a table, and a list of
all courses that (d) did not finish, each with what its gatekeeper said last and the command that replays it:

    python benchmarks/liveness.py --only 17 --ugvs 4 --method d --write courses
    python -m airground_drake.report courses/liveness_u4_density100_seed17.yaml

Courses without a plan are counted, not run, except with `--only`. With `--walls --density 3` and more there are many.
"""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import shlex
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import maps
import numpy as np
import yaml
from feasible import joint_plan, shortest_length
from maps import Array, Course

from airground_drake.base.errors import AirgroundError
from airground_drake.registry import POLICIES
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import from_data
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import verify
from airground_drake.verify.engines.geometry import closest_approach

METHODS = ("a", "b", "c", "d", "orca")

CLEARANCE_M = 0.1
"""What a plan for one robot keeps beyond the safe distance, m: courses with narrower ways only count as having none."""

ARRIVED_M = 0.1
TOUCHING_M = 0.05
"""A robot that did not arrive was stopped by what is no farther beyond the safe distance than this, m."""

RUNS_PER_PROCESS = 25
"""Then a process is replaced, whatever it has kept of what it ran."""

SEPARATED, NO_PLAN, FEASIBLE = "separated", "no plan found", "feasible"


def bounds(course: Course, clearance: float) -> tuple[list[float], str]:
    """For each robot a lower bound of its time to the target, s, and whether the course can be finished.

    The bound is the larger of two times: that of the shortest path round the obstacles at the speed limit, as if it
    were alone, and that of its preset trajectory, which it follows.
    """
    times, lengths = [], []
    for start, target in zip(course.starts, course.targets, strict=True):
        length = shortest_length(start, target, course.obstacles, maps.SAFE_M + clearance)
        preset = float(np.linalg.norm(target - start)) / maps.PRESET_M_S
        lengths.append(length)
        times.append(max(length / maps.MAX_M_S, preset))
    if not np.isfinite(lengths).all():
        return times, SEPARATED
    if course.ugvs == 1:
        soon = lengths[0] / maps.PRESET_M_S <= course.duration_s
        return times, FEASIBLE if soon else NO_PLAN
    plan = joint_plan(
        course.starts,
        course.targets,
        course.obstacles,
        obstacle_m=maps.SAFE_M,
        ugv_m=maps.SAFE_M,
        speed_m_s=maps.PRESET_M_S,
        duration_s=course.duration_s,
        seed=course.seed,
    )
    return times, NO_PLAN if plan is None else FEASIBLE


def policies_of(names: Iterable[str]) -> list[dict[str, Any]]:
    """Entry `intervention.policies` of the scenarios; a detour gets its speed."""
    return [{"name": name, "parameters": {"speed_m_s": maps.DETOUR_M_S} if name == "detour" else {}} for name in names]


def usual_policies() -> list[str]:
    """`coordinate` where there is one, else `detour`."""
    return ["coordinate"] if "coordinate" in POLICIES else ["detour"]


def one_run(task: dict[str, Any]) -> dict[str, Any]:
    """A line of the output: one course, one method."""
    course = maps.draw(task["seed"], task["ugvs"], task["density"], task["walls"])
    started = time.perf_counter()
    found = dict(task)
    lower, status = bounds(course, task["clearance"])
    found |= {"obstacles": len(course.obstacles), "plan": status, "lower_bound_s": lower}
    try:
        if task["method"] == "orca":
            found |= _orca(course)
        else:
            scenario = from_data(maps.scenario_of(course, policies_of(task["policies"])), course.name)
            found |= _of_trace(scenario, simulate(scenario, task["method"]), task["claims"])
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


def _of_trace(scenario: Scenario, trace: Trace, claims: bool) -> dict[str, Any]:
    """What a run of the package leaves behind."""
    targets = np.array([ugv.target_m for ugv in scenario.ugvs.values()])
    obstacles = np.array([each.position_m for each in scenario.obstacles.values()]).reshape(-1, 3)
    paths = [trace.position(ugv) for ugv in trace.ugvs]
    found = _geometry(trace.t, paths, targets, obstacles)
    uav = trace.position(trace.robots[-1])
    found["least_air_ground_m"] = min(closest_approach(trace.t, path, uav).distance_m for path in paths)
    kinds = Counter(event["kind"] for event in trace.events)
    found["triggers"] = kinds["trigger"]
    found["messages"] = kinds["proposal"] + kinds["accept"] + kinds["refuse"]
    found["decisions"] = len(trace.decisions)
    found["faults"] = [fault["what"] for fault in trace.meta["faults"]][:3]
    for ugv, state in zip(trace.ugvs, found["robots"], strict=True):
        mine = trace.decisions[trace.decisions["robot"] == ugv]
        state["reasons"] = dict(Counter(mine["reason"]))
        state["last_reason"] = str(mine["reason"].iloc[-1]) if len(mine) else ""
        state["triggers"] = sum(event["kind"] == "trigger" and event["robot"] == ugv for event in trace.events)
    if claims:
        found["claims"] = {verdict.claim.id: verdict.finding.status for verdict in verify(trace)}
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
        "least_ugv_m": min((closest_approach(t, one, other).distance_m for one, other in pairs), default=None),
        "least_obstacle_m": min((closest_approach(t, path, o).distance_m for path, o in to_obstacles), default=None),
    }


def _touched(robot: int, ends: list[Array], obstacles: Array) -> list[str]:
    """What a robot is at the safe distance of at the end."""
    limit = maps.SAFE_M + TOUCHING_M
    near = [f"obstacle_{k + 1}" for k, o in enumerate(obstacles) if np.linalg.norm(ends[robot] - o) <= limit]
    others = [f"ugv{j + 1}" for j, p in enumerate(ends) if j != robot and np.linalg.norm(ends[robot] - p) <= limit]
    return near + others


def chosen(options: argparse.Namespace) -> Iterator[tuple[int, str]]:
    """Seeds and what the planner says of them, until there are enough feasible ones."""
    if options.only is not None:
        for seed in options.only:
            course = maps.draw(seed, options.ugvs, options.density, options.walls)
            yield seed, bounds(course, options.clearance)[1]
        return
    enough = 0
    for seed in range(options.first, options.first + options.most):
        course = maps.draw(seed, options.ugvs, options.density, options.walls)
        status = bounds(course, options.clearance)[1]
        enough += status == FEASIBLE
        yield seed, status
        if enough == options.maps:
            return


def key_of(row: dict[str, Any]) -> tuple[Any, ...]:
    """What tells one line from another."""
    return tuple(row[name] for name in ("ugvs", "density", "walls", "seed", "method")) + tuple(row["policies"])


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
    """Every course that a method did not finish, or on which it came below d: why, and how to replay it."""
    for row in rows:
        if row["method"] != method:
            continue
        replay = _replay(row)
        if "error" in row:
            yield f"seed {row['seed']}, {row['ugvs']} UGVs: {row['error']}\n    {replay}"
            continue
        if _below(row):
            least = row["least_ugv_m"], row["least_obstacle_m"]
            yield f"seed {row['seed']}, {row['ugvs']} UGVs: below d: {least} m to UGVs, obstacles\n    {replay}"
        lost = [(i, robot) for i, robot in enumerate(row["robots"], start=1) if robot["arrival_s"] is None]
        if lost:
            yield f"seed {row['seed']}, {row['ugvs']} UGVs, density {row['density']:g} ({row['plan']}):"
            for i, robot in lost:
                yield "    " + _why(i, robot)
            yield f"    {replay}"


def _why(number: int, robot: dict[str, Any]) -> str:
    """Where a robot is and what its gatekeeper said."""
    stopped = f" touching {', '.join(robot['touches'])}" if robot["touches"] else ""
    where = f"ugv{number} at ({robot['end_m'][0]:.2f}, {robot['end_m'][1]:.2f}), {robot['short_m']:.2f} m short,"
    if not robot.get("triggers"):
        return f"{where}{stopped} never triggered"
    if not robot.get("reasons"):
        return f"{where}{stopped} triggered {robot['triggers']} times, no decision"
    counts = ", ".join(f"{name} {count}" for name, count in sorted(robot["reasons"].items()))
    return f"{where}{stopped} last {robot['last_reason']}; {robot['triggers']} triggers; {counts}"


def _replay(row: dict[str, Any]) -> str:
    """The command that runs a line again and writes its scenario."""
    words = ["python", "benchmarks/liveness.py", "--only", str(row["seed"]), "--ugvs", str(row["ugvs"])]
    if row["density"] != 1.0:
        words += ["--density", f"{row['density']:g}"]
    if row["walls"]:
        words.append("--walls")
    words += ["--method", row["method"], "--policies", ",".join(row["policies"]), "--write", "courses"]
    return shlex.join(words)


def main() -> int:
    """Draw, plan, run, print."""
    options = _parser().parse_args()
    methods = options.method or list(METHODS)
    if "orca" in methods and not _has_orca():
        print("ORCA is left out: PyRVO is not installed (pip install '.[bench]')")
        methods.remove("orca")
    policies = options.policies.split(",") if options.policies else usual_policies()
    counts: Counter[str] = Counter()
    tasks = []
    for seed, status in chosen(options):
        counts[status] += 1
        course = maps.draw(seed, options.ugvs, options.density, options.walls)
        if options.write:
            scenario = maps.scenario_of(course, policies_of(policies))
            options.write.mkdir(parents=True, exist_ok=True)
            path = options.write / f"{course.name}.yaml"
            path.write_text(yaml.safe_dump(scenario, sort_keys=False), encoding="utf-8")
            print(path)
        if status != FEASIBLE and options.only is None:
            continue
        shared = {"seed": seed, "ugvs": options.ugvs, "density": options.density, "walls": options.walls}
        shared |= {"policies": policies, "claims": options.claims, "clearance": options.clearance}
        tasks += [{**shared, "method": method} for method in methods]
    print(f"courses drawn: {dict(counts)}", flush=True)
    if options.plans:
        return 0
    rows: list[dict[str, Any]] = []
    if options.output and options.resume and options.output.exists():
        rows = [json.loads(line) for line in options.output.read_text(encoding="utf-8").splitlines()]
    elif options.output:
        options.output.write_text("", encoding="utf-8")
    done = {key_of(row) for row in rows}
    wanted = {key_of(task) for task in tasks}
    for row in _results([task for task in tasks if key_of(task) not in done], options.jobs):
        rows.append(row)
        if options.output:
            with options.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    rows = sorted((row for row in rows if key_of(row) in wanted), key=lambda row: row["seed"])
    print("\n".join(table(rows)))
    for method in methods:
        if method == "d" or options.only is not None:
            lost = list(explanations(rows, method))
            print(f"\nNot finished by ({method}):" if lost else f"\n({method}) finished every course.")
            print("\n".join(lost))
    return 0


def _results(tasks: list[dict[str, Any]], jobs: int) -> Iterator[dict[str, Any]]:
    """Lines in the order in which they come."""
    if jobs < 2:
        yield from map(one_run, tasks)
        return
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=RUNS_PER_PROCESS) as pool:
        for future in as_completed([pool.submit(one_run, task) for task in tasks]):
            yield future.result()


def _has_orca() -> bool:
    try:
        import pyrvo  # noqa: F401
    except ImportError:
        return False
    return True


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ugvs", type=int, default=1, choices=list(maps.WIDTH_M))
    parser.add_argument("--maps", type=int, default=60, help="feasible courses to run (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="seed of the first course drawn (default: %(default)s)")
    parser.add_argument("--most", type=int, default=100_000, help="courses drawn at most (default: %(default)s)")
    parser.add_argument("--density", type=float, default=1.0, help="factor on the number of obstacles")
    parser.add_argument("--walls", action="store_true", help="close the field by discs all around")
    parser.add_argument("--clearance", type=float, default=CLEARANCE_M, help="m, of a plan for one robot")
    parser.add_argument("--method", action="append", choices=METHODS, help="default: all of them")
    parser.add_argument("--policies", help="of the UAV, with commas (default: coordinate, or detour without it)")
    parser.add_argument(
        "--only", type=int, action="append", metavar="SEED", help="this course, whatever the planner says"
    )
    parser.add_argument("--write", type=Path, metavar="DIR", help="write the scenarios of the courses there")
    parser.add_argument("--plans", action="store_true", help="draw and plan only, run nothing")
    parser.add_argument("--claims", action="store_true", help="judge every claim about each run, too (slow)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: %(default)s)")
    parser.add_argument("-o", "--output", type=Path, help="file of JSON lines")
    parser.add_argument("--resume", action="store_true", help="go on with what the output file has")
    return parser


if __name__ == "__main__":
    sys.exit(main())
