"""Random scenarios: `python benchmarks/random_scenarios.py -n 500 [--only 17] [--rows FILE]`.

Draws scenarios (1 to 12 UGVs, in every other scenario with plants, 0 to 12 obstacles of all shapes that stand, move,
appear or disappear, all methods, compositions, periods, triggers, thresholds, routes and policies), simulates the valid
ones, and judges each run by its claims, by the oracles of the tests and by the independent checker, which gets a report
folder of the run. The simulator must not stop, no claim may be an `error`, no oracle may find a fault, the checker must
agree with every verdict about the run, and claims must hold that theorems promise for the run. Prints each scenario
that breaks this, by its number, which draws it again, and how much was exercised. Exit code 1 if there is such a
scenario.

Claims about the model are left out: they take longer than all the rest. `--reports` also writes each whole report and
has `airground check` make it again. `--coq` also has Coq prove the distances of runs without obstacles that appear or
disappear: it must accept those that SAFE-TRACE finds kept, and refuse the others.
"""

import argparse
import json
import multiprocessing
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, ScenarioError
from airground_drake.base.registry import METHODS, ROUTES
from airground_drake.check.command import LIMIT_S
from airground_drake.check.line import AGREES, RECORDED
from airground_drake.check.report import check_report
from airground_drake.model.trigger.bayes import optimal_threshold
from airground_drake.report import document
from airground_drake.scenario.load import from_data, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim import trace
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import Verdict, judge
from airground_drake.verify.proofs.runs import prove, workshop
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from oracles import faults_of

ALWAYS = ("ZENO-TRACE", "THR-TRIG")
"""Claims that must hold in every run (ZENO-TRACE: with a dwell)."""
NEVER_REFUTED = ("GATE-PLAN", "LIVE-HYP")
"""Claims that may be undecided without a proposal, but not refuted."""

FASTEST_M_S = 2.0
"""Speed of the fastest obstacles, m/s."""
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
        shaped, moving, appearing: how many of the obstacles are no balls, move, and appear under way.
        trigger, route: as in the scenario.
        triggers, releases, decisions, accepted: how many.
        margin_m: of SAFE-TRACE.
        coq: what Coq said of the distances, if it was asked.
        statuses: of the claims.
    """

    number: int
    method: str = ""
    invalid: str = ""
    wrong: list[str] = field(default_factory=list)
    seconds: float = 0.0
    ugvs: int = 0
    obstacles: int = 0
    shaped: int = 0
    moving: int = 0
    appearing: int = 0
    trigger: str = ""
    route: str = ""
    triggers: int = 0
    releases: int = 0
    decisions: int = 0
    accepted: int = 0
    margin_m: float | None = None
    coq: str = ""
    statuses: dict[str, str] = field(default_factory=dict)


def draw(number: int, most_ugvs: int = 12) -> dict[str, Any]:
    """Draw a scenario; many are valid."""
    rng = np.random.default_rng([20261126, number])
    n, m = int(rng.integers(1, most_ugvs + 1)), int(rng.integers(0, 13))
    h = float(rng.choice([0.01, 0.025, 0.05, 0.1, 0.3]))
    speed = float(rng.choice([0.5, 1.0, 3.0]))
    d, between, beside = (float(rng.choice([0.5, 1.0, 2.0])) for _ in range(3))
    radii, size = _radii(number, n + m + 1), float(rng.choice([0.0, 0.5, 2.0]))
    plants, room_m = _plants(number, n, h, speed)
    both, own = sum(sorted(radii)[-2:]) + room_m, float(rng.choice([0.0, 0.3, 3.0]))
    apart = max(d, between, own) + both
    extent = 4.0 + 1.5 * (n + m) ** 0.5 * (apart + size)
    starts = _apart(rng, n, extent, apart)
    method = str(rng.choice(list(METHODS)))
    decision = _decision(rng, h)
    duration = float(rng.choice([10, 30])) * (1.0 if h >= 0.05 else 0.25)
    ugvs = {}
    for i in range(n):
        way = [starts[i], *rng.uniform(-extent, extent, (int(rng.integers(1, 4)), 2)).tolist()]
        ugvs[f"u{i}"] = {
            "start_m": [*starts[i], 0.0],
            "target_m": [*(np.array([i * 3.0 * (between + both), 3.0 * extent])).tolist(), 0.0],
            "preset": {"waypoints_m": [[*p, 0.0] for p in way], "speed_m_s": speed * float(rng.choice([0.3, 1.0]))},
            "max_speed_m_s": speed,
            "radius_m": radii[i],
            "plant": plants[i],
        }
    parameters: dict[str, dict[str, float]] = {
        "detour": {"speed_m_s": speed}, "stale_map": {"speed_m_s": speed}, "hostile": {"speed_m_s": speed},
        "noisy": {"speed_m_s": speed, "noise_m": 0.5}, "towards": {"speed_m_s": speed, "x_m": 0.0, "y_m": 0.0},
        "coordinate": {"speed_m_s": speed},
    }  # fmt: skip
    chosen = rng.choice(list(parameters), size=int(rng.integers(1, 3)), replace=False).tolist()
    air_ground = float(rng.choice([0.4, 1.0]))
    stages, stage = int(rng.choice([2, 6, 20])), h * int(rng.choice([1, 2]))
    low = bool(rng.random() < 0.5)  # over the middle of the team, so that it comes near the UGVs
    height = (1.5 * air_ground if low else 3.0) + both
    start = [0.0, 0.0, height] if low else [-3.0 * extent, 0.0, height]
    reach = max(d, between, beside, own, air_ground) + both + (4.0 * speed + FASTEST_M_S) * h
    obstacles = {
        f"o{k}": _obstacle(rng, starts, extent, radii[n + k], size, own, apart, height, duration) for k in range(m)
    }
    room = max(d, air_ground) + both + 0.01
    east = max(3.0 * extent, (n - 1) * 3.0 * (between + both)) + room
    arena = [[-3.0 * extent - room, -1.2 * extent - room], [east, 3.0 * extent + room]]
    return {
        "name": f"random_{number}",
        "seed": number,
        "duration_s": duration,
        "ugvs": ugvs,
        "uav": {
            "start_m": start, "target_m": [0.0, 3.0 * extent, 3.0 + both], "altitude_m": height,
            "max_speed_m_s": 2.0 * speed, "radius_m": radii[-1], "plant": plants[-1],
        },
        "obstacles": obstacles,
        "arena_m": arena if rng.random() < 0.25 else [],
        "safe_distance": {
            "obstacle_m": d, "ugv_m": between, "air_ground_m": air_ground,
            "moving_m": beside * float(rng.choice([0.0, 1.0])),
        },
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


def _obstacle(
    rng: np.random.Generator, starts: Sequence[Sequence[float]], extent: float, radius: float, size: float, own: float,
    apart: float, height: float, duration: float,
) -> dict[str, Any]:  # fmt: skip
    """An obstacle: of any shape within `size`, m, of its place; some move, might move, appear or disappear."""
    found: dict[str, Any] = {
        "radius_m": radius,
        "known_to_uav": bool(rng.random() < 0.7),
        "distance_m": own * (rng.random() < 0.5),
    }
    found |= _shape(rng, size, height)
    ball = not (found.keys() & {"polygon_m", "segment_m", "size_m", "height_m"})
    if rng.random() < 0.25:
        found["appears_s"] = round(float(rng.uniform(0.0, 0.8)) * duration, 3)
    if rng.random() < 0.2:
        found["disappears_s"] = round(float(rng.uniform(0.8, 1.1)) * duration, 3)
    if rng.random() < 0.35:
        speed = float(rng.choice([0.3, 1.2, FASTEST_M_S]))
        corners = rng.uniform(-extent, extent, (int(rng.integers(2, 5)), 2)).round(3).tolist()
        z = float(rng.choice([0.0, height])) if ball else 0.0
        found["moves"] = {
            "waypoints_m": [[*corner, z] for corner in corners], "speed_m_s": speed,
            "start_s": float(rng.choice([0.0, 2.0])), "at_end": str(rng.choice(["stop", "reverse", "loop"])),
        }  # fmt: skip
        found["max_speed_m_s"] = speed * float(rng.choice([0.0, 0.4, 0.999, 1.0]))  # 0: what is true
        found["known_motion"] = bool(rng.random() < 0.5)
        return found
    if rng.random() < 0.1:
        found["max_speed_m_s"] = float(rng.choice([0.2, 1.0]))
    while True:  # those that are there from the beginning keep their distance from every start
        place = rng.uniform(-extent, extent, 2)
        near = min(float(np.linalg.norm(place - np.array(start))) for start in starts)
        if "appears_s" in found or near > 1.01 * (apart + size):
            break
    on_the_ground = float(rng.choice([0.0, 0.0, height])) if ball else 0.0
    return found | {"position_m": [*place.tolist(), on_the_ground]}


def _shape(rng: np.random.Generator, size: float, height: float) -> dict[str, Any]:
    """Draw a shape: its keys in a scenario, {} for a ball."""
    kind = str(rng.choice(["ball", "post", "box", "wall", "polygon"])) if size else "ball"
    if kind == "ball":
        return {}
    top = {"height_m": float(rng.choice([0.0, 0.7 * height, 50.0]))}
    if kind == "post":
        return {"height_m": top["height_m"] or 1.0}
    top["heading_rad"] = float(rng.choice([0.0, 0.5, 0.5 * np.pi, -2.0]))
    if kind == "box":
        return top | {"size_m": (np.sqrt(2.0) * size * rng.choice([1.0, 0.7, 0.1], 2)).tolist()}
    corners = int(rng.integers(3, 8))
    rays = size * rng.choice([1.0, 0.3, 0.6], corners)
    angles = 2.0 * np.pi * np.arange(corners) / corners
    around = (rays[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])).round(6).tolist()
    if kind == "wall":
        return top | {"segment_m": around[: int(rng.integers(2, corners + 1))]}
    return top | {"polygon_m": around[:: int(rng.choice([1, -1]))]}


def _radii(number: int, count: int) -> list[float]:
    """Radii of UGVs, obstacles and the UAV, m: points in every other scenario."""
    rng = np.random.default_rng([20261123, number])
    largest = rng.choice([0.0, 0.0, 0.3, 3.0])
    return [round(float(r), 3) for r in largest * rng.random(count) * (rng.random(count) < 0.7)]


def _plants(number: int, count: int, h: float, speed: float) -> tuple[list[list[dict[str, Any]]], float]:
    """Plants of UGVs and of the UAV, in half of the scenarios; and what two of them take at most, m."""
    rng, cars = (np.random.default_rng([seed, number]) for seed in (20261127, 20261128))
    some, lag, late = bool(rng.random() < 0.5), float(rng.choice([0.05, 0.3])), h * float(rng.integers(1, 4))
    hand = 0.5 * speed * h * float(rng.choice([1.01, 3.0])) + float(rng.choice([0.0, 0.1]))
    kinds: list[list[dict[str, Any]]] = [
        [{"kind": "first_order"}],
        [{"kind": "lag", "time_constant_s": lag}],
        [{"kind": "delay", "delay_s": late}],
        [{"kind": "delay", "delay_s": late}, {"kind": "lag", "time_constant_s": lag}],
    ]
    limits = {"max_turn_rad_s": float(rng.choice([0.0, 1.0, 5.0]))}
    if rng.random() < 0.5:
        limits |= {"wheel_base_m": 0.3, "max_wheel_speed_m_s": 1.2 * speed}
    found = []
    for _ in range(count):
        turned = {"hand_point_m": hand, "heading_rad": float(rng.uniform(-4.0, 4.0))}
        drive = {"kind": "unicycle", **turned, **limits}
        if cars.random() < 0.3:
            steers = {"wheelbase_m": 0.2, "max_steering_rad": float(cars.uniform(0.2, 1.4))}
            drive = {"kind": "ackermann", **turned, **steers}
        elif cars.random() < 0.3:
            drive["backwards"] = False
        found.append([*kinds, [drive], [drive]][rng.integers(6)] if some else kinds[0])
    found.append(kinds[rng.integers(4)] if some else kinds[0])
    return found, some * 2.0 * max(1.2 * hand, 2.0 * speed * (lag + late))


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
    """Mostly the proved method; the recursions have no guarantee."""
    if method == "d" or rng.random() < 0.8:
        return "augmented"
    return str(rng.choice(["recursion_nearest", "recursion_listed"]))


def _apart(rng: np.random.Generator, count: int, extent: float, least: float) -> list[list[float]]:
    """Places in the plane, (count, 2), m, with at least that distance between them."""
    while True:
        places = rng.uniform(-extent, extent, (count, 2))
        if all(np.linalg.norm(a - b) >= 1.01 * least for a, b in combinations(places, 2)):
            return [place.tolist() for place in places]


def judged(number: int, *, reports: bool = False, by_coq: bool = False) -> Row:
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
    given = scenario.obstacles.values()
    row.shaped = sum(convex_parts(each) is not None for each in given)
    row.moving, row.appearing = (
        sum(each.moves is not None for each in given),
        sum(each.appears_s > 0.0 for each in given),
    )
    row.trigger, row.route = scenario.decision.trigger, scenario.gatekeeper.route
    try:
        of_run, verdicts, row.wrong = tried(scenario)
        row.wrong += made_again(scenario) if reports else []
        row.coq, found = proved(of_run, verdicts) if by_coq else ("", [])
        row.wrong += found
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
    found = [f"oracle of {name}: {faults[0]}"[:300] for name, faults in faults_of(of_run).items()]
    return of_run, verdicts, [*_claims(of_run, verdicts), *found, *_checker(scenario, of_run, verdicts)]


def _claims(of_run: Trace, verdicts: Sequence[Verdict]) -> list[str]:
    """Verdicts that are an error, and those that must hold and do not."""
    wrong = []
    must = _must_hold(of_run, {verdict.claim.id: verdict for verdict in verdicts})
    for verdict in verdicts:
        status, name = verdict.status, verdict.claim.id
        wrongly = status == "refuted" and name in NEVER_REFUTED
        if status == "error" or wrongly or (name in must and status != "holds"):
            wrong.append(f"{name} {status}: {verdict.counterexample or verdict.evidence}"[:300])
    return wrong


def _must_hold(of_run: Trace, found: Mapping[str, Verdict]) -> set[str]:
    """Claims that theorems promise for a run.

    Beside an obstacle that may move no distance is promised, only that robots do not bring themselves too near. Where
    an obstacle moves faster than declared, the hypotheses are broken. Where one appears on a robot, inequalities may
    contradict each other from then on.
    """
    scenario, given = of_run.scenario, of_run.scenario.runs[of_run.run]
    must = set(ALWAYS)
    if scenario.decision.trigger != "automaton" or scenario.decision.min_inter_event_s == 0.0:
        must.discard("ZENO-TRACE")
    worst = Counter[str]()  # margins, 0 by default
    for entry in found["SAFE-HYP"].evidence["worst"]:
        worst[entry["hypothesis"]] = min(worst[entry["hypothesis"]], entry["margin"])
    if given.method in "ad" and given.composition == "augmented" and worst["safe start"] >= -DISTANCE_TOLERANCE_M:
        must |= {"SAFE-OWN"} & found.keys()
        if all(each.expected_speed_m_s == 0.0 for each in scenario.barriers.values()):
            must |= {"SAFE-TRACE"}
        if worst["declared speed"] >= -DISTANCE_TOLERANCE_M:
            must |= {"SAFE-HYP"}
    return must


def _checker(scenario: Scenario, of_run: Trace, verdicts: Sequence[Verdict]) -> list[str]:
    """Disagreements of the independent checker, from files alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace.save(of_run, folder / "trace" / of_run.run)
        report = document.build(scenario, {of_run.run: of_run}, verdicts, {"seed": scenario.seed})
        files.write_json(folder / "report.json", report)
        lines = [line for line in check_report(folder, LIMIT_S) if line.run]
    return [f"checker on {line.claim}: {line.outcome}: {line.text}"[:300] for line in lines if line.outcome != AGREES]


NO_LINES = {"claim": "report", "by": "check", "outcome": "nothing"}


def made_again(scenario: Scenario) -> list[str]:
    """What `airground check` does not agree with in the whole report of a scenario."""
    with tempfile.TemporaryDirectory() as name:
        file, report = Path(name) / "drawn.yaml", Path(name) / "report"
        file.write_text(yaml.safe_dump(resolved(scenario), sort_keys=False), encoding="utf-8")
        done = _command("report", file, "-o", report, "-q")
        if not (report / "report.json").exists():
            return [f"no report: {done.stderr[-250:]}"]
        done = _command("check", report, "--json", "-q")
        lines = json.loads(done.stdout)["checks"] if done.stdout else [NO_LINES | {"text": done.stderr[-250:]}]
    wrong = [line for line in lines if line["outcome"] not in (AGREES, RECORDED)]
    return [f"{line['by']} on {line['claim']}: {line['text']}"[:300] for line in wrong]


def _command(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """A command of the package."""
    command = [sys.executable, "-m", "airground_drake", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def proved(of_run: Trace, verdicts: Sequence[Verdict]) -> tuple[str, list[str]]:
    """What Coq says of the distances of a run, and whether that is wrong."""
    if any(each.appears_s or each.disappears_s for each in of_run.scenario.barriers.values()):
        return "not asked", []
    with workshop() as place:
        distances, _, _ = prove(place, of_run)
    margin = next(verdict.margin for verdict in verdicts if verdict.claim.id == "SAFE-TRACE") or 0.0
    said = "proved" if distances.proved else "refused"
    wrongly = distances.proved != (margin >= 0.0) and abs(margin) > DISTANCE_TOLERANCE_M
    return said, [f"Coq: {said}, though the least margin is {margin} m: {distances.why}"[:300]] if wrongly else []


def main() -> int:
    """Draw, run, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", "--number", type=int, default=100, help="valid scenarios (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first scenario (default: %(default)s)")
    parser.add_argument("--only", type=int, help="this one")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each processor)")
    parser.add_argument("--reports", action="store_true", help="make each whole report, and have it made again")
    parser.add_argument("--coq", action="store_true", help="have Coq prove the distances")
    parser.add_argument("--keep", type=Path, help="folder for the scenario files of those that fail")
    parser.add_argument("--rows", type=Path, help="file for a line of JSON per scenario, appended")
    options = parser.parse_args()
    rows: list[Row] = []
    one = partial(judged, reports=options.reports, by_coq=options.coq)

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
        take(one(options.only))
    else:
        _many(one, options.first, options.number, options.jobs, take)
    print(summary(rows))
    return int(any(row.wrong for row in rows))


def _many(one: Callable[[int], Row], first: int, wanted: int, jobs: int | None, take: Callable[[Row], None]) -> None:
    """Judge scenarios from a number on, until `wanted` were valid."""
    valid, number = 0, first
    fresh = multiprocessing.get_context("spawn")
    # multiprocessing's own pool: that of concurrent.futures hangs where processes are replaced (Python 3.11)
    with fresh.Pool(jobs, maxtasksperchild=RUNS_PER_PROCESS) as pool:
        while valid < wanted:
            batch = range(number, number + max(8, (wanted - valid) // 4))
            number = batch.stop
            for row in pool.imap_unordered(one, batch):
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
    for name in ("method", "ugvs", "obstacles", "trigger", "route", "coq"):
        found = Counter(getattr(row, name) for row in valid)
        lines += [f"{name}: {dict(sorted(found.items()))}"]
    for name in ("shaped", "moving", "appearing", "triggers", "releases", "decisions", "accepted"):
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
