"""Scenarios that nobody tuned: `python benchmarks/random_scenarios.py -n 500 [--only 17] [--keep DIR]`.

Draws valid scenarios (1 to 6 UGVs, 0 to 12 obstacles, all methods, periods, triggers, routes and policies), simulates
each and judges its run: nothing may stop the simulator, no claim may be an `error`, method (d) keeps every safe
distance to 1e-9 m, no two triggers are closer than the dwell, and every event is where THR-TRIG has it. Prints each
scenario that breaks one of these, by its number, which draws it again. Exit code 1 if there is one.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from airground_drake.errors import AirgroundError, ScenarioError
from airground_drake.registry import METHODS, ROUTES
from airground_drake.scenarios.load import from_data, resolved
from airground_drake.simulation import simulate
from airground_drake.verify import verify

ALWAYS = ("ZENO-TRACE", "THR-TRIG")
CERTIFIED = ("SAFE-TRACE", "SAFE-HYP")
"""Claims that must hold in every run (a bare trigger has no dwell to keep), and in those of method (d)."""


def draw(number: int) -> dict[str, Any]:
    """A scenario, valid with a fair chance."""
    rng = np.random.default_rng([20261121, number])
    n, m = int(rng.integers(1, 7)), int(rng.integers(0, 13))
    h = float(rng.choice([0.01, 0.025, 0.05, 0.1, 0.3]))
    speed = float(rng.choice([0.5, 1.0, 3.0]))
    d, between = float(rng.choice([0.5, 1.0, 2.0])), float(rng.choice([0.5, 1.0, 2.0]))
    extent = 4.0 + 2.0 * (n + m) ** 0.5 * max(d, between)
    points = _apart(rng, n + m, extent, max(d, between))
    method = str(rng.choice(list(METHODS)))
    zeta, bare = float(rng.choice([0.05, 0.3, 1.0, 3.0])), bool(rng.random() < 0.15)
    stages = int(rng.choice([2, 6, 20]))
    noise_ratio = float(rng.choice([0.2, 0.5, 1.0, 2.0]))
    reach = d + between + 4.0 * speed * h + 2.0 + 20.0 * h
    ugvs = {}
    for i in range(n):
        way = [points[i], *rng.uniform(-extent, extent, (int(rng.integers(1, 4)), 2)).tolist()]
        ugvs[f"u{i}"] = {
            "start_m": [*points[i], 0.0],
            "target_m": [*(np.array([i * 3.0 * between, 3.0 * extent])).tolist(), 0.0],
            "preset": {"waypoints_m": [[*p, 0.0] for p in way], "speed_m_s": speed * float(rng.choice([0.3, 1.0]))},
            "max_speed_m_s": speed,
        }
    kinds = ["detour", "towards", "hostile", "noisy", "stale_map"]
    parameters: dict[str, dict[str, float]] = {
        "detour": {"speed_m_s": speed}, "stale_map": {"speed_m_s": speed}, "hostile": {"speed_m_s": speed},
        "noisy": {"speed_m_s": speed, "noise_m": 0.5}, "towards": {"speed_m_s": speed, "x_m": 0.0, "y_m": 0.0},
    }  # fmt: skip
    chosen = rng.choice(kinds, size=int(rng.integers(1, 3)), replace=False).tolist()
    return {
        "name": f"random_{number}",
        "seed": number,
        "duration_s": float(rng.choice([20, 60])) * (1.0 if h >= 0.05 else 0.25),
        "ugvs": ugvs,
        "uav": {
            "start_m": [-3.0 * extent, 0.0, 3.0], "target_m": [0.0, 3.0 * extent, 3.0], "altitude_m": 3.0,
            "max_speed_m_s": 2.0 * speed,
        },
        "obstacles": {
            f"o{k}": {"position_m": [*points[n + k], 0.0], "known_to_uav": bool(rng.random() < 0.7)} for k in range(m)
        },
        "safe_distance": {"obstacle_m": d, "ugv_m": between, "air_ground_m": 0.4},
        "control": {
            "period_s": h, "avoidance_gain_1_s": float(rng.choice([0.5, 0.9])) / h * float(rng.choice([0.1, 1.0])),
            "motion_gain_1_s": min(2.0, 0.9 / h), "formation_gain_1_s": min(5.0, 0.9 / h),
            "intervention_gain_1_s": min(1.5, 0.9 / h), "sensing_range_m": reach,
        },
        "decision": {
            "threshold": {"rule": "fixed", "zeta_m": zeta},
            "trigger": "bare" if bare else "automaton",
            "release_m": zeta * float(rng.choice([0.0, 0.5, 0.98])),
            "min_inter_event_s": float(rng.choice([0.05, 0.5, 3.0])),
            "noise_m_sqrt_s": float(rng.choice([0.0, 0.01, 0.3])),
            "leak_1_s": float(rng.choice([0.0, 0.5])),
            "noise_period_s": h * noise_ratio,
        },
        "intervention": {
            "period_s": h, "retry_s": float(rng.choice([0.0, 1.0])),
            "ranking": str(rng.choice(["listed", "predicted"])),
            "policies": [{"name": name, "parameters": parameters[name]} for name in chosen],
        },
        "gatekeeper": {
            "route": str(rng.choice(ROUTES.own)), "period_s": h, "horizon_s": stages * h, "stages": stages,
            "error_weight_1_m2_s": float(rng.choice([1.0, 100.0])),
        },
        "runs": {method: {"method": method}},
    }  # fmt: skip


def _apart(rng: np.random.Generator, count: int, extent: float, least: float) -> list[list[float]]:
    """Places in the plane, (count, 2), m, with at least that distance between them."""
    while True:
        places = rng.uniform(-extent, extent, (count, 2))
        if all(np.linalg.norm(a - b) >= 1.01 * least for a, b in combinations(places, 2)):
            return [place.tolist() for place in places]


def judged(number: int) -> tuple[int, str, list[str]]:
    """(number, method or 'invalid', what is wrong)."""
    try:
        scenario = from_data(draw(number), f"random {number}")
    except ScenarioError as error:
        return number, f"invalid: {error.key.split(chr(46))[0]}", []
    (method,) = scenario.runs
    try:
        verdicts = verify(simulate(scenario, method))
    except AirgroundError as error:
        return number, method, [str(error)]
    wrong = []
    for verdict in verdicts:
        status, name = verdict.finding.status, verdict.claim.id
        must = name in ALWAYS or (name in CERTIFIED and method == "d")
        must = must and not (name == "ZENO-TRACE" and scenario.decision.trigger == "bare")
        if status == "error" or (must and status != "holds"):
            wrong.append(f"{name} {status}: {verdict.finding.counterexample or verdict.finding.evidence}"[:300])
    return number, method, wrong


def main() -> int:
    """Draw, run, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", "--number", type=int, default=100, help="scenarios 0 to N - 1 (default: %(default)s)")
    parser.add_argument("--only", type=int, help="this one")
    parser.add_argument("--keep", type=Path, help="folder for the scenario files of those that fail")
    options = parser.parse_args()
    numbers = range(options.number) if options.only is None else [options.only]
    seen, failed = Counter[str](), 0
    with ProcessPoolExecutor() as pool:
        for number, method, wrong in pool.map(judged, numbers):
            seen[method] += 1
            failed += bool(wrong)
            for line in wrong:
                print(f"scenario {number}, method ({method}): {line}", flush=True)
            if wrong and options.keep:
                options.keep.mkdir(parents=True, exist_ok=True)
                text = yaml.safe_dump(resolved(from_data(draw(number), "")), sort_keys=False)
                (options.keep / f"random_{number}.yaml").write_text(text, encoding="utf-8")
    print(f"{sum(seen.values())} drawn ({dict(seen)}), {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
