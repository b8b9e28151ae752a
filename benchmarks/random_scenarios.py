"""Random scenarios: `python benchmarks/random_scenarios.py -n 500 [--only 17] [--rows FILE]`.

Draws scenarios (1 to 6 UGVs, 0 to 12 obstacles, all methods, compositions, periods, triggers, thresholds, routes and
policies), simulates the valid ones, and judges each run by its claims, by the oracles of the tests and by the
independent checker, which gets a report folder of the run. The simulator must not stop, no claim may be an `error`, no
oracle may find a fault, the checker must agree with every verdict about the run, and claims that hold for every
scenario of a method must hold. Prints each scenario that breaks
this, by its number, which draws it again, and how much was exercised. Exit code 1 if there is such a scenario.

Claims about the model are left out: they take longer than all the rest.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, ScenarioError
from airground_drake.check.command import LIMIT_S
from airground_drake.check.line import AGREES
from airground_drake.check.report import check_report
from airground_drake.decision.bayes import optimal_threshold
from airground_drake.registry import METHODS, ROUTES
from airground_drake.report import document
from airground_drake.run import trace
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import from_data, resolved
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Verdict, judge

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from oracles import faults_of

ALWAYS = ("ZENO-TRACE", "THR-TRIG")
CERTIFIED = ("SAFE-TRACE", "SAFE-HYP")
"""Claims that must hold in every run (ZENO-TRACE: with a dwell), and in every run of method (d)."""
NEVER_REFUTED = ("GATE-PLAN", "LIVE-HYP")
"""Claims that may be undecided without a proposal, but not refuted."""

RUNS_PER_PROCESS = 20
"""Runs after which a process is replaced, to free its memory."""


@dataclass
class Row:
    """The result of one scenario.

    Attributes:
        number: draws it again.
        method: of its run; '' if the scenario is not valid.
        invalid: key that validation refused.
        wrong: faults, in words.
        seconds: wall-clock time.
        ugvs, obstacles: how many.
        trigger, route: as in the scenario.
        triggers, releases, decisions, accepted: how many.
        margin_m: of SAFE-TRACE.
        statuses: of the claims.
    """

    number: int
    method: str = ""
    invalid: str = ""
    wrong: list[str] = field(default_factory=list)
    seconds: float = 0.0
    ugvs: int = 0
    obstacles: int = 0
    trigger: str = ""
    route: str = ""
    triggers: int = 0
    releases: int = 0
    decisions: int = 0
    accepted: int = 0
    margin_m: float | None = None
    statuses: dict[str, str] = field(default_factory=dict)


def draw(number: int, most_ugvs: int = 6) -> dict[str, Any]:
    """Draw a scenario; many are valid."""
    rng = np.random.default_rng([20261121, number])
    n, m = int(rng.integers(1, most_ugvs + 1)), int(rng.integers(0, 13))
    h = float(rng.choice([0.01, 0.025, 0.05, 0.1, 0.3]))
    speed = float(rng.choice([0.5, 1.0, 3.0]))
    d, between = float(rng.choice([0.5, 1.0, 2.0])), float(rng.choice([0.5, 1.0, 2.0]))
    radii = _radii(number, n + m + 1)
    both = sum(sorted(radii)[-2:])
    apart = max(d, between) + both
    extent = 4.0 + 2.0 * (n + m) ** 0.5 * apart
    points = _apart(rng, n + m, extent, apart)
    method = str(rng.choice(list(METHODS)))
    decision = _decision(rng, h)
    ugvs = {}
    for i in range(n):
        way = [points[i], *rng.uniform(-extent, extent, (int(rng.integers(1, 4)), 2)).tolist()]
        ugvs[f"u{i}"] = {
            "start_m": [*points[i], 0.0],
            "target_m": [*(np.array([i * 3.0 * (between + both), 3.0 * extent])).tolist(), 0.0],
            "preset": {"waypoints_m": [[*p, 0.0] for p in way], "speed_m_s": speed * float(rng.choice([0.3, 1.0]))},
            "max_speed_m_s": speed,
            "radius_m": radii[i],
        }
    kinds = ["detour", "towards", "hostile", "noisy", "stale_map"]
    parameters: dict[str, dict[str, float]] = {
        "detour": {"speed_m_s": speed}, "stale_map": {"speed_m_s": speed}, "hostile": {"speed_m_s": speed},
        "noisy": {"speed_m_s": speed, "noise_m": 0.5}, "towards": {"speed_m_s": speed, "x_m": 0.0, "y_m": 0.0},
    }  # fmt: skip
    chosen = rng.choice(kinds, size=int(rng.integers(1, 3)), replace=False).tolist()
    air_ground = float(rng.choice([0.4, 1.0]))
    stages, stage = int(rng.choice([2, 6, 20])), h * int(rng.choice([1, 2]))
    low = bool(rng.random() < 0.5)  # over the middle of the team, so that it comes near the UGVs
    height = (1.5 * air_ground if low else 3.0) + both
    start = [0.0, 0.0, height] if low else [-3.0 * extent, 0.0, height]
    reach = max(d, between, air_ground) + both + 4.0 * speed * h
    return {
        "name": f"random_{number}",
        "seed": number,
        "duration_s": float(rng.choice([20, 60])) * (1.0 if h >= 0.05 else 0.25),
        "ugvs": ugvs,
        "uav": {
            "start_m": start, "target_m": [0.0, 3.0 * extent, 3.0 + both], "altitude_m": height,
            "max_speed_m_s": 2.0 * speed, "radius_m": radii[-1],
        },
        "obstacles": {
            f"o{k}": {
                "position_m": [*points[n + k], 0.0], "known_to_uav": bool(rng.random() < 0.7), "radius_m": radii[n + k],
            }
            for k in range(m)
        },
        "safe_distance": {"obstacle_m": d, "ugv_m": between, "air_ground_m": air_ground},
        "control": {
            "period_s": h, "avoidance_gain_1_s": float(rng.choice([0.5, 0.9])) / h * float(rng.choice([0.1, 1.0])),
            "motion_gain_1_s": min(2.0, 0.9 / h), "formation_gain_1_s": min(5.0, 0.9 / h),
            "intervention_gain_1_s": min(1.5, 0.9 / h), "sensing_range_m": reach * float(rng.choice([1.0, 2.0])),
        },
        "decision": decision,
        "intervention": {
            "period_s": h * int(rng.choice([1, 2, 5])), "retry_s": float(rng.choice([0.0, 1.0])),
            "ranking": str(rng.choice(["listed", "predicted"])),
            "policies": [{"name": name, "parameters": parameters[name]} for name in chosen],
        },
        "gatekeeper": {
            "route": str(rng.choice(ROUTES.own)), "period_s": h * int(rng.choice([1, 2, 3])),
            "horizon_s": stages * stage, "stages": stages, "error_weight_1_m2_s": float(rng.choice([1.0, 100.0])),
            "min_dwell_s": float(rng.choice([0.0, 0.2])),
        },
        "runs": {
            method: {
                "method": method, "composition": _composition(rng, method),
                "expected": {"LIVE-GOAL": "nothing"},  # presets lead anywhere
            },
        },
    }  # fmt: skip


def _radii(number: int, count: int) -> list[float]:
    """Radii of UGVs, obstacles and the UAV, m: points in every other scenario."""
    rng = np.random.default_rng([20261123, number])
    largest = rng.choice([0.0, 0.0, 0.3, 3.0])
    return [round(float(r), 3) for r in largest * rng.random(count) * (rng.random(count) < 0.7)]


def _decision(rng: np.random.Generator, h: float) -> dict[str, Any]:
    """Trigger, threshold, release level, dwell and noise; the noise has a period of its own."""
    threshold: dict[str, Any] = {"rule": "fixed", "zeta_m": float(rng.choice([0.05, 0.3, 1.0, 3.0]))}
    zeta = threshold["zeta_m"]
    if rng.random() < 0.15:
        rule = {"c1_1_s": 0.5, "c2": 1.0, "drift_m_s": float(rng.choice([0.5, 6.05])), "noise_m_sqrt_s": 1.0}
        zeta, threshold = optimal_threshold(*(rule[k] for k in _BAYES)), {"rule": "bayes", **rule}
    return {
        "threshold": threshold,
        "trigger": "bare" if rng.random() < 0.15 else "automaton",
        "release_m": zeta * float(rng.choice([0.1, 0.5, 0.98])),
        "min_inter_event_s": float(rng.choice([0.0, 0.05, 0.5, 3.0])),
        "noise_m_sqrt_s": float(rng.choice([0.0, 0.01, 0.3])),
        "leak_1_s": float(rng.choice([0.0, 0.5])),
        "noise_period_s": h * float(rng.choice([0.2, 0.5, 1.0, 2.0, 3.0])),
    }


_BAYES = ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")


def _composition(rng: np.random.Generator, method: str) -> str:
    """Mostly the one that is proved; the recursions have no guarantee."""
    if method == "d" or rng.random() < 0.8:
        return "augmented"
    return str(rng.choice(["recursion_nearest", "recursion_listed"]))


def _apart(rng: np.random.Generator, count: int, extent: float, least: float) -> list[list[float]]:
    """Places in the plane, (count, 2), m, with at least that distance between them."""
    while True:
        places = rng.uniform(-extent, extent, (count, 2))
        if all(np.linalg.norm(a - b) >= 1.01 * least for a, b in combinations(places, 2)):
            return [place.tolist() for place in places]


def judged(number: int) -> Row:
    """Draw, simulate, judge; faults are in the row."""
    started = time.perf_counter()
    row = Row(number)
    try:
        scenario = from_data(draw(number), f"random {number}")
    except ScenarioError as error:
        row.invalid = error.key
        return row
    (row.method,) = scenario.runs
    row.ugvs, row.obstacles = len(scenario.ugvs), len(scenario.obstacles)
    row.trigger, row.route = scenario.decision.trigger, scenario.gatekeeper.route
    try:
        of_run, verdicts, row.wrong = tried(scenario)
    except AirgroundError as error:
        row.wrong = [str(error)]
        return row
    finally:
        row.seconds = time.perf_counter() - started
    row.triggers, row.releases = (sum(e["kind"] == kind for e in of_run.events) for kind in ("trigger", "release"))
    row.decisions, row.accepted = len(of_run.decisions), int((of_run.decisions["decision"] == "accept").sum())
    row.statuses = {verdict.claim.id: verdict.status for verdict in verdicts}
    row.margin_m = next(verdict.margin for verdict in verdicts if verdict.claim.id == "SAFE-TRACE")
    return row


def tried(scenario: Scenario) -> tuple[Trace, list[Verdict], list[str]]:
    """The run of a scenario, its verdicts, and its faults."""
    (name,) = scenario.runs
    of_run = simulate(scenario, name)
    verdicts = judge(of_run)
    method = scenario.runs[name].method
    found = [f"oracle of {name}: {faults[0]}"[:300] for name, faults in faults_of(of_run).items()]
    return of_run, verdicts, [*_claims(scenario, method, verdicts), *found, *_checker(scenario, of_run, verdicts)]


def _claims(scenario: Scenario, method: str, verdicts: Sequence[Verdict]) -> list[str]:
    """Verdicts that are an error, and those that must hold and do not."""
    wrong = []
    dwells = scenario.decision.trigger == "automaton" and scenario.decision.min_inter_event_s > 0.0
    for verdict in verdicts:
        status, name = verdict.status, verdict.claim.id
        must = name in ALWAYS or (name in CERTIFIED and method == "d")
        must = must and not (name == "ZENO-TRACE" and not dwells)
        wrongly = status == "refuted" and name in NEVER_REFUTED
        if status == "error" or wrongly or (must and status != "holds"):
            wrong.append(f"{name} {status}: {verdict.counterexample or verdict.evidence}"[:300])
    return wrong


def _checker(scenario: Scenario, of_run: Trace, verdicts: Sequence[Verdict]) -> list[str]:
    """Disagreements of the independent checker, from files alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace.save(of_run, folder / "trace" / of_run.run)
        report = document.build(scenario, {of_run.run: of_run}, verdicts, {"seed": scenario.seed})
        files.write_json(folder / "report.json", report)
        lines = [line for line in check_report(folder, LIMIT_S) if line.run]
    return [f"checker on {line.claim}: {line.outcome}: {line.text}"[:300] for line in lines if line.outcome != AGREES]


def main() -> int:
    """Draw, run, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", "--number", type=int, default=100, help="valid scenarios (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first scenario (default: %(default)s)")
    parser.add_argument("--only", type=int, help="this one")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each processor)")
    parser.add_argument("--keep", type=Path, help="folder for the scenario files of those that fail")
    parser.add_argument("--rows", type=Path, help="file for a line of JSON per scenario, appended")
    options = parser.parse_args()
    rows: list[Row] = []

    def take(row: Row) -> None:
        rows.append(row)
        for line in row.wrong:
            print(f"scenario {row.number}, method ({row.method}): {line}", flush=True)
        if row.wrong and options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
            text = yaml.safe_dump(resolved(from_data(draw(row.number), "")), sort_keys=False)
            (options.keep / f"random_{row.number}.yaml").write_text(text, encoding="utf-8")
        if options.rows:
            with options.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")

    if options.only is not None:
        take(judged(options.only))
    else:
        _many(options.first, options.number, options.jobs, take)
    print(summary(rows))
    return int(any(row.wrong for row in rows))


def _many(first: int, wanted: int, jobs: int | None, take: Callable[[Row], None]) -> None:
    """Judge scenarios from a number on, until `wanted` were valid."""
    valid, number = 0, first
    fresh = multiprocessing.get_context("spawn")
    # multiprocessing's own pool: that of concurrent.futures hangs where processes are replaced (Python 3.11)
    with fresh.Pool(jobs, maxtasksperchild=RUNS_PER_PROCESS) as pool:
        while valid < wanted:
            batch = range(number, number + max(8, (wanted - valid) // 4))
            number = batch.stop
            for row in pool.imap_unordered(judged, batch):
                if valid < wanted:
                    take(row)
                    valid += not row.invalid


def summary(rows: Sequence[Row]) -> str:
    """Counts of scenarios, of their kinds and of their events."""
    valid = [row for row in rows if not row.invalid]
    margins = [row.margin_m for row in valid if row.method == "d" and row.margin_m is not None]
    lines = [
        f"{len(rows)} drawn, {len(valid)} valid, {sum(bool(row.wrong) for row in valid)} failed",
        f"refused by validation: {dict(Counter(row.invalid.split(chr(46))[0] for row in rows if row.invalid))}",
    ]
    for name in ("method", "ugvs", "obstacles", "trigger", "route"):
        found = Counter(getattr(row, name) for row in valid)
        lines += [f"{name}: {dict(sorted(found.items()))}"]
    for name in ("triggers", "releases", "decisions", "accepted"):
        counts = [getattr(row, name) for row in valid]
        lines += [f"{name}: {sum(counts)} in {sum(count > 0 for count in counts)} runs"]
    if margins:
        near = sum(margin <= 1e-6 for margin in margins)
        lines += [f"(d): at least d {min(margins):+.3g} m; {near} of {len(margins)} runs came to within 1e-6 m of d"]
    for claim in sorted({name for row in valid for name in row.statuses}):
        found = Counter(row.statuses[claim] for row in valid if claim in row.statuses)
        lines += [f"{claim}: {dict(found)}"]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
