"""Errors of measured positions at their bound: does the law keep what it promises, and is the price needed?

    python benchmarks/sensing.py -n 10000 --jobs 2
    python benchmarks/sensing.py -n 500 --law plain            # without the enlargement
    python benchmarks/sensing.py -n 500 --law error-0.9        # a mutant of a term
    python benchmarks/sensing.py -n 30 --full                  # whole runs in Drake, judged

Each draw has four UGVs that cross a circle among five discs, a bound e of the errors, distances, a gain and speeds of
its own. The law commands them without a UAV's help, and errors are at their bound: the nearest thing looks farther
(away), elsewhere (sideways), or both by turns (adversarial). Distances are computed here, exactly between samples, from
places alone. Printed per law: draws that break a distance, the least distance less the promise, and how much of the
enlargement was used at most (tightness). Laws: `enlarged` is the package's, `plain` has no enlargement; mutants are
`error-0.9` (a law for 0.9 e), `no-standing` (least violation where inequalities contradict), `one-error` (robots count
one error of the two) and `whole-gain` (a gain at which A h bears the errors, but A h / 2 does not, times --gain). With
`own-views` each robot measures the others (smaller errors and speeds); its mutant `one-view` does not pay for that.
"""

import argparse
import json
import math
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import maps
import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.parallel import run_parallel
from airground_drake.base.registry import method_of
from airground_drake.model.plants.budget import Bounds, law_distance, least_gain
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario, Sensing
from airground_drake.scenario.sensing import Errors
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge

ROBOTS, DISCS, CIRCLE_M, LASTS_S, PERIOD_S = 4, 5, 5.0, 12.0, 0.05
LAWS = ("enlarged", "plain", "error-0.9", "no-standing", "one-error", "whole-gain", "own-views", "one-view")
OWN_VIEWS = ("own-views", "one-view")
ADVERSARIES = ("away", "sideways", "adversarial")
TOLERANCE_M = 1e-9


class Draw(NamedTuple):
    """A scenario, and what its geometry is: starts (n, 2), discs (m, 3) with radii, and the distance promised, m."""

    scenario: Scenario
    discs: Array
    promised_m: float
    error_m: float


def drawn(seed: int, gain_share: float = 1.0, *, own_views: bool = False) -> Draw:
    """A draw; with `gain_share` below 1 its gain is so much of the least one."""
    rng = np.random.default_rng(seed)
    error, distance, speed = rng.uniform(0.02, 0.1), rng.uniform(0.5, 0.8), rng.uniform(1.0, 6.0)
    if own_views:
        error, speed = 0.4 * error, 0.3 * speed
    robot = Bounds(error_m=error, speed_m_s=speed, own_views=own_views)
    least = least_gain(distance, robot, robot) * (1.0 + 1e-9)
    share = rng.uniform(least, 1.0) if gain_share == 1.0 else gain_share * least
    room_m = max(distance + 0.25, float(law_distance(distance, robot, robot, gain=max(share, least) / PERIOD_S)) + 1e-3)
    while True:
        angles = np.sort(rng.uniform(0.0, math.tau, ROBOTS))
        start = CIRCLE_M * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        goal = -start + rng.normal(0.0, 0.5, (ROBOTS, 2))
        discs = np.concatenate([rng.uniform(-3.0, 3.0, (DISCS, 2)), rng.uniform(0.0, 0.4, (DISCS, 1))], axis=1)
        if all(_is_free(places, discs, room_m) for places in (start, goal)):
            break

    discs[:, :2] = discs[:, :2].round(4)
    ugvs = {
        f"ugv{i}": maps.straight(start[i].round(4), goal[i].round(4), 0.6 * speed, max_speed_m_s=speed)
        for i in range(ROBOTS)
    }
    data = {
        "name": f"drawn_{seed}", "duration_s": LASTS_S, "arrival_tolerance_m": 0.3, "ugvs": ugvs,
        "uav": {"start_m": [0.0, 0.0, 4.0], "altitude_m": 4.0},
        "obstacles": {f"disc{k}": {"position_m": [x, y], "radius_m": r} for k, (x, y, r) in enumerate(discs.tolist())},
        "safe_distance": {"obstacle_m": distance, "ugv_m": distance, "air_ground_m": 1.0},
        "control": {
            "period_s": PERIOD_S, "avoidance_gain_1_s": max(share, least) / PERIOD_S, "formation_gain_1_s": 5.0,
            "motion_gain_1_s": 2.0, "sensing_range_m": 4.0,
        },
        "decision": {"threshold": {"zeta_m": 1.2}, "release_m": 0.8, "noise_period_s": PERIOD_S},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "sensing": {"position_error_m": error, "errors": ADVERSARIES[seed % 3], "seed": seed, "shared": not own_views},
        "runs": {"d": {"method": "d"}},
    }  # fmt: skip
    scenario = from_data(data, f"draw {seed}")
    scenario.control.avoidance_gain_1_s = share / PERIOD_S
    return Draw(scenario, discs, distance, error)


def _is_free(places: Array, discs: Array, room_m: float) -> bool:
    """Whether places (n, 2) are so far from each other and from all discs."""
    between = np.linalg.norm(places[:, None] - places, axis=2) + 9.0 * np.eye(len(places))
    beside = np.linalg.norm(places[:, None] - discs[:, :2], axis=2) - discs[:, 2]
    return bool(between.min() > room_m and beside.min() > room_m)


def least_apart(apart: Array) -> float:
    """The least distance of two points that are apart by (T, 2), m, and go straight between the instants."""
    start, change = apart[:-1], np.diff(apart, axis=0)
    squared = np.einsum("ij,ij->i", change, change)
    along = -np.einsum("ij,ij->i", start, change)
    share = np.clip(np.divide(along, squared, out=np.zeros_like(squared), where=squared > 0.0), 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * change, axis=1).min())


def shortest(ways: Array, discs: Array) -> tuple[float, float]:
    """The least distances between UGVs, and from the edges of discs, m; ways (T, n, 2)."""
    count = ways.shape[1]
    pairs = min(least_apart(ways[:, i] - ways[:, j]) for i in range(count) for j in range(i))
    beside = min(least_apart(ways[:, i] - disc[:2]) - disc[2] for i in range(count) for disc in discs)
    return pairs, beside


def driven(draw: Draw, law_of: str) -> Array:
    """Ways of the UGVs under a law, (T, n, 2), m."""
    scenario = draw.scenario
    sensing = scenario.sensing
    assert isinstance(sensing, Sensing)
    world = make_world(scenario)
    errors = Errors(sensing, world)
    built = replace(scenario, sensing=_sensing_of(law_of, sensing))
    near = make_world(built).around(world.select("ugv"))
    if law_of == "one-error":  # beside another robot
        pair = law_distance(draw.promised_m, Bounds(error_m=draw.error_m), gain=1.0)
        near = near._replace(distance=np.where(near.share < 1.0, np.minimum(near.distance, pair), near.distance))
    law = components.make_law(built, method_of("a"), "augmented")
    if law_of == "no-standing":
        law = replace(law, avoidance=replace(law.avoidance, stands=False))
    presets = components.make_presets(scenario)
    places, ways = world.starts.copy(), []
    for k in range(round(LASTS_S / PERIOD_S)):
        t = k * PERIOD_S
        ways.append(places[:ROBOTS, :2].copy())
        wanted = [preset.at(t) for preset in presets]
        target, rate = (np.array([one[part] for one in wanted]) for part in (0, 1))
        if law_of in OWN_VIEWS:
            views = [errors.view_of(f"ugv{i}", t, places) for i in range(ROBOTS)]
            velocity = [law.velocity(view, near, target, rate, [None] * ROBOTS)[i] for i, view in enumerate(views)]
        else:
            velocity = law.velocity(errors.published(t, places), near, target, rate, [None] * ROBOTS)
        places[:ROBOTS] += PERIOD_S * np.asarray(velocity)
    return np.array([*ways, places[:ROBOTS, :2]])


def _sensing_of(law_of: str, sensing: Sensing) -> Sensing | None:
    """The errors that a law is built for."""
    if law_of == "plain":
        return None
    if law_of == "one-view":
        return replace(sensing, shared=True)
    return replace(sensing, position_error_m=0.9 * sensing.position_error_m) if law_of == "error-0.9" else sensing


def one(law_of: str, full: bool, gain_share: float, seed: int) -> dict[str, Any]:
    """The row of a draw."""
    own_views = law_of in OWN_VIEWS
    draw = drawn(seed, gain_share if law_of == "whole-gain" else 1.0, own_views=own_views)
    speed = draw.scenario.ugvs["ugv0"].max_speed_m_s
    bound, gain = Bounds(error_m=draw.error_m, speed_m_s=speed, own_views=own_views), draw.scenario.control
    enlarged = [
        float(law_distance(draw.promised_m, bound, *other, gain=gain.avoidance_gain_1_s)) for other in ((bound,), ())
    ]
    row: dict[str, Any] = {"seed": seed, "law": law_of, "errors": ADVERSARIES[seed % 3], "error_m": draw.error_m}
    if full:
        trace = simulate(draw.scenario, "d")
        row |= {verdict.claim.id: verdict.status for verdict in judge(trace, ["SAFE-TRACE", "SAFE-HYP"])}
        row["arrived"] = sum(event["kind"] == "arrival" and event["robot"] in trace.ugvs for event in trace.events)
        ways = np.stack([trace.position(ugv)[:, :2] for ugv in trace.ugvs], axis=1)
    else:
        ways = driven(draw, law_of)
    for name, least, more in zip(("pairs", "discs"), shortest(ways, draw.discs), enlarged, strict=True):
        margin = least - draw.promised_m
        row |= {f"{name}_m": margin, f"{name}_used": 1.0 - margin / (more - draw.promised_m)}
    return row


def main() -> int:
    """Print what came of the draws; exit code 1 if the enlarged law broke a distance."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=100, help="number of draws (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--law", choices=LAWS, default="enlarged")
    parser.add_argument("--gain", type=float, default=0.6, help="of whole-gain: share of the least gain")
    parser.add_argument("--full", action="store_true", help="whole runs under (d) in Drake, judged")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", help="file for a line of JSON per draw")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.n)
    rows = run_parallel([partial(one, given.law, given.full, given.gain, seed) for seed in seeds], jobs=given.jobs)
    if given.output:
        with open(given.output, "w", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
    broken = [row for row in rows if min(row["pairs_m"], row["discs_m"]) < -TOLERANCE_M]
    print(f"{given.law}: {len(broken)} of {len(rows)} draws break a distance")
    for name in ("pairs", "discs"):
        least = min(rows, key=lambda row: float(row[f"{name}_m"]))
        used = max(rows, key=lambda row: float(row[f"{name}_used"]))
        print(f"  {name}: least distance less the promise {least[f'{name}_m']:+.5f} m (draw {least['seed']}), "
              f"at most {used[f'{name}_used']:.4f} of the enlargement used (draw {used['seed']})")  # fmt: skip
    if given.full:
        for claim in ("SAFE-TRACE", "SAFE-HYP"):
            print(f"  {claim}: holds in {sum(row[claim] == 'holds' for row in rows)} of {len(rows)}")
        print(f"  arrived: {sum(row['arrived'] for row in rows)} of {ROBOTS * len(rows)}")
    return int(given.law in ("enlarged", "own-views") and bool(broken))


if __name__ == "__main__":
    raise SystemExit(main())
