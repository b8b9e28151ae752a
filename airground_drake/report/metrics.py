"""Metrics of one run: distances, events, decisions, times; strict JSON."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.registry import method_of
from airground_drake.report.interventions import avoidance, farthest_from_prediction, interventions, messages
from airground_drake.report.model import Approach
from airground_drake.report.stalls import stalls
from airground_drake.scenario.schema import MAP
from airground_drake.sim.collisions import first_collisions
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.live_goal import AT_REST_M, AT_REST_S, Way, moved_at_the_end
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.pair_kinds import MOVING, kind_of
from airground_drake.verify.runs.gate_record import reasons_of, without_decisions
from airground_drake.verify.runs.pairs import (
    DISTANCE_TOLERANCE_M,
    Gap,
    Pair,
    apart_of,
    at_appearance,
    gap_over_time,
    least_gap,
    least_of,
    numbers_of,
    pair_of,
    pairs_of,
    place_on_map,
    to_barrier,
)
from airground_drake.verify.runs.passive import passive_pairs
from airground_drake.verify.runs.proposals import lost_at_the_end, reasons, without_proposals

MOST_OBSTACLES = 20  # maximum number of obstacles listed per robot
NEAR_OBSTACLES, NEAR_ROBOTS = 3, 1  # numbers of obstacles and robots that count as close by
NO_GAP = 1e-9  # a relative optimality gap up to this is a rounding error


def of_run(trace: Trace) -> dict[str, Any]:
    method = method_of(trace.meta["method"])
    wall_s = trace.timings.get("wall_s")
    duration_s = float(trace.t[-1] - trace.t[0])
    counts = {robot: Counter(e["kind"] for e in trace.events if e["robot"] == robot) for robot in trace.robots}
    return {
        "min_distance_m": {
            robot: _listed(_least(trace, robot, _obstacles(trace), MOST_OBSTACLES)) for robot in trace.robots
        },
        "min_robot_distance_m": {
            robot: _listed(_least(trace, robot, _others(trace, robot), NEAR_ROBOTS)) for robot in trace.robots
        },
        "came_near": came_near(trace),
        "final_position_m": {robot: trace.position(robot)[-1].tolist() for robot in trace.robots},
        "duration_s": duration_s,
        "wall_s": wall_s,
        "realtime_factor": duration_s / wall_s if wall_s else None,
        "event_counts": {robot: dict(sorted(count.items())) for robot, count in counts.items()},
        "gatekeeper": gatekeeper(trace),
        "on_the_way": on_the_way(trace),
        "stalls": stalls(trace),
        "above_at_start": [
            ugv for ugv in trace.ugvs if trace.column(f"{ugv}.decision_variable_m")[0] >= trace.meta["zeta_m"]
        ],
        "interventions": interventions(trace),
        "messages": messages(trace),
        "avoidance": avoidance(trace),
        "without_proposals": without_proposals(trace) if method.intervenes else [],
        "lost_at_the_end": lost_at_the_end(trace) if method.intervenes else [],
        "no_way_reasons": reasons(trace) if method.intervenes else {},
        "without_decisions": without_decisions(trace) if method.gated else [],
    }


def came_near(trace: Trace) -> list[dict[str, Any]]:
    """The pair of least margin among those that came nearer than when both first existed."""
    # Two entries at most: of all pairs; and of those of an obstacle that may move, if that is another pair.
    pairs = pairs_of(trace)
    bounds = apart_of(trace) - [pair.safe_m for pair in pairs]
    order = np.argsort(bounds, kind="stable").tolist()
    moving = [k for k in order if kind_of(trace.scenario, pairs[k].first, pairs[k].second) == MOVING]
    nearest = dict[Pair, dict[str, Any]]()
    for among in (order, moving):
        least: Gap | None = None
        for k in among:
            if least is not None and bounds[k] >= least.margin_m:
                break
            approach = _approach(trace, pairs[k])
            if approach is not None and (least is None or approach.margin_m < least.margin_m):
                least = approach
        if least is not None:
            nearest.setdefault(least.pair, _told(_nearest(trace, least.pair.first, least.pair.second, least)))
    return [*nearest.values()]


APPROACH_M = 1e-3  # a pair comes nearer if its gap shrinks by more than this, m


def _approach(trace: Trace, pair: Pair) -> Gap | None:
    """The nearest approach of a pair after it had been farther apart; None if it never came nearer."""
    # Where the gap is smallest when both are first there, a later approach is taken at the rows.
    least, gaps = least_gap(trace, pair), gap_over_time(trace, pair)[pair.rows]
    if least.t_s > trace.t[pair.row] and least.gap_m < gaps[0] - APPROACH_M:
        return least
    nearer = np.flatnonzero(gaps < np.maximum.accumulate(gaps) - APPROACH_M)
    if not len(nearer):
        return None
    row = int(nearer[np.argmin(gaps[nearer])])
    gap_m = float(gaps[row])
    return Gap(pair, gap_m, gap_m - pair.required_m, float(trace.t[pair.row + row]), pair.row + row)


# A UGV that goes slower than this share of its preset's speed at the end creeps: how long it takes is not told.
CREEPING = 0.1


def on_the_way(trace: Trace) -> dict[str, dict[str, Any]]:
    """UGVs that neither arrived nor collided, with their progress at the end of the run."""
    done = {event["robot"] for event in trace.events if event["kind"] == "arrival"} | {*first_collisions(trace.events)}
    return {ugv: _on_the_way(trace, ugv) for ugv in trace.ugvs if ugv not in done}


def _on_the_way(trace: Trace, ugv: str) -> dict[str, Any]:
    begin_s, end_s = max(trace.t[-1] - AT_REST_S, trace.t[0]), trace.t[-1]
    before_m, left_m = (_way_left_m(trace, ugv, time_s) for time_s in (begin_s, end_s))
    moved_m = moved_at_the_end(Way(trace.t, trace.position(ugv)))
    stands = moved_m <= AT_REST_M
    speed_m_s = (before_m - left_m) / (end_s - begin_s)
    creeps = not stands and moved_m < CREEPING * trace.scenario.ugvs[ugv].preset.speed_m_s * (end_s - begin_s)
    return {
        "stands": stands,
        "creeps": creeps,
        "left_m": left_m,
        "left_s": left_m / speed_m_s if speed_m_s > 0.0 and not (stands or creeps) else None,
        **({"kept_away": body} if stands and (body := _kept_away(trace, ugv)) else {}),
        **(place_on_map(trace, ugv, end_s) if stands and _is_at_map(trace, ugv) else {}),
    }


def _is_at_map(trace: Trace, ugv: str) -> bool:
    """Whether a UGV is so near to the map at the end that one control period would have brought it too near."""
    if MAP not in _obstacles(trace):
        return False
    pair = pair_of(trace, ugv, MAP)
    return float(gap_over_time(trace, pair)[-1]) - pair.required_m < pair.reach_m


def _kept_away(trace: Trace, ugv: str) -> dict[str, Any]:
    """The moving obstacle that keeps a UGV away from its target at the end; {} without one."""
    own = trace.scenario.ugvs[ugv]
    for pair in passive_pairs(trace):
        if pair.first == ugv and pair.last == len(trace.t) - 1:
            apart = to_barrier(trace, pair, np.array(own.target_m))
            if apart < pair.safe_m:
                place = trace.position(ugv)
                moving = np.flatnonzero(np.linalg.norm(place - place[-1], axis=1) > AT_REST_M)
                return {
                    "by": pair.second,
                    "on": apart <= pair.radii_m,
                    "since_s": float(trace.t[moving[-1] + 1 if len(moving) else 0]),
                    "off_m": float(np.linalg.norm(place[-1] - own.target_m)),
                }
    return {}


def _way_left_m(trace: Trace, ugv: str, time_s: float) -> float:
    """Remaining way of a UGV, m: to the nearest point of its past preset, and along the preset."""
    own = trace.scenario.ugvs[ugv]
    corners = np.array(own.preset.waypoints_m)
    place = interpolate(trace.t, trace.position(ugv), time_s)
    legs = np.diff(corners, axis=0)
    lengths = np.maximum(np.linalg.norm(legs, axis=1), 1e-12)  # corners may coincide
    begins = np.cumsum(lengths) - lengths
    travelled = own.preset.speed_m_s * time_s - begins
    past = np.clip(travelled, 0.0, lengths)
    along = np.clip(((place - corners[:-1]) * legs).sum(axis=1) / lengths, 0.0, past)
    aside = np.linalg.norm(corners[:-1] + (along / lengths)[:, None] * legs - place, axis=1)
    aside[travelled < 0.0] = np.inf
    aside, rest = min(zip(aside.tolist(), (lengths.sum() - begins - along).tolist(), strict=True))
    return float(aside + rest + np.linalg.norm(corners[-1] - own.target_m))


def outcome(trace: Trace) -> dict[str, Any]:
    pairs = pairs_of(trace)
    bounds = apart_of(trace) - [pair.safe_m for pair in pairs]
    (k,) = least_of(bounds, 1, lambda k: least_gap(trace, pairs[k]).margin_m)
    least = least_gap(trace, pairs[k])
    return {
        "run": trace.run,
        "seed": int(trace.meta["seed"]),
        "kept": least.margin_m >= -DISTANCE_TOLERANCE_M,
        "home": {*trace.robots} == {event["robot"] for event in trace.events if event["kind"] == "arrival"},
        "first": least.pair.first,
        "second": least.pair.second,
        "min_distance_m": least.gap_m,
        "safe_distance_m": least.pair.required_m,
        "t_s": least.t_s,
    }


def gatekeeper(trace: Trace) -> dict[str, Any] | None:
    """Summary of the gatekeeper's decisions, None if it made none."""
    table = trace.decisions
    if not len(table):
        return None
    gaps = table["gap"].to_numpy(dtype=np.float64)
    known = gaps[gaps >= 0.0]
    times = np.asarray(trace.timings.get("decision_times_s", []), dtype=np.float64)
    times = times[times > 0.0]  # without answers that were only kept
    period = float(trace.scenario.gatekeeper.period_s)
    levels = {"p50": 0.5, "p99": 0.99, "max": 1.0}
    time_s = {name: float(np.quantile(times, at, method="higher")) for name, at in levels.items() if times.size}
    return {
        "calls": len(table),
        "decisions": {str(name): int(count) for name, count in table["decision"].value_counts().sort_index().items()},
        "solver_failures": int((table["status"] == "solver_failed").sum()),
        "refusals": _refusals(trace),
        "reasons": reasons_of(trace),
        "farthest_from_prediction": farthest_from_prediction(trace),
        "budget_spent": int((table["status"] == "budget_spent").sum()),
        "max_gap": float(known.max()) if len(known) else None,
        "gaps": {
            "zero": int(((gaps <= NO_GAP) & (gaps != -1.0)).sum()),  # -1 is unknown
            "up_to_1_percent": int(((gaps > NO_GAP) & (gaps <= 0.01)).sum()),
            "more": int((gaps > 0.01).sum()),
        },
        "period_s": period,
        "time_s": time_s or None,
        "late": int((times >= period).sum()) if times.size else None,
        "closest_call": _closest_call(trace),
    }


def _refusals(trace: Trace) -> dict[str, dict[str, int]]:
    first = trace.decisions.drop_duplicates("number")
    refused = first[first["decision"] == "refuse"]
    return {
        str(robot): {str(reason): int(count) for reason, count in rows["reason"].value_counts().items()}
        for robot, rows in refused.groupby("robot")
    }


def _closest_call(trace: Trace) -> dict[str, Any] | None:
    """The decision at which accepting and refusing throughout differ least in cost."""
    costs = ["accept_throughout", "refuse_throughout"]
    both = trace.decisions[(trace.decisions[costs] >= 0.0).all(axis=1)]
    if not len(both):
        return None
    smaller = both[costs].min(axis=1).clip(lower=1e-12)
    margin = ((both[costs[0]] - both[costs[1]]).abs() / smaller).to_numpy()
    k = int(np.argmin(margin))
    row = both.iloc[k]
    return {
        "relative_cost_margin": float(margin[k]),
        **{name: str(row[name]) for name in ("robot", "policy", "decision", "reason")},
        **{name: float(row[name]) for name in ("t_s", "objective", *costs)},
    }


def closest_obstacle(trace: Trace, robot: str) -> Approach | None:
    """Smallest distance of a robot to any obstacle over continuous time, exact; None without obstacles."""
    near = _least(trace, robot, _obstacles(trace), MOST_OBSTACLES)
    return min(near, key=lambda near: (near.value, near.t_s), default=None)


def close_by(trace: Trace, robot: str) -> list[Approach]:
    """Smallest distances of a robot to its nearest obstacles and robots, exact, those of least margin first."""
    near = _least(trace, robot, _obstacles(trace), NEAR_OBSTACLES)
    near += _least(trace, robot, _others(trace, robot), NEAR_ROBOTS)
    return sorted(near, key=lambda near: near.margin_m)


def gap_m(trace: Trace, robot: str, other: str) -> Array:
    """Distance of the surfaces of a robot and an obstacle or another robot at the rows, (T,), m."""
    # NaN before an obstacle appears.
    return gap_over_time(trace, pair_of(trace, robot, other))


def _obstacles(trace: Trace) -> list[str]:
    return [name for name in trace.scenario.barriers if trace.there_from(name) < len(trace.t)]


def _others(trace: Trace, robot: str) -> list[str]:
    return [other for other in trace.robots if other != robot]


def events_of(trace: Trace, robot: str, *kinds: str) -> list[dict[str, Any]]:
    return [event for event in trace.events if event["robot"] == robot and event["kind"] in kinds]


def _least(trace: Trace, robot: str, among: Sequence[str], most: int) -> list[Approach]:
    """Smallest gaps of a robot to at most `most` of some obstacles or robots, those of least margin."""
    numbers = [numbers_of(trace)[frozenset((robot, other))] for other in among]
    pairs = [pairs_of(trace)[k] for k in numbers]
    bounds = apart_of(trace)[numbers] - np.array([pair.safe_m for pair in pairs])
    near = least_of(bounds, most, lambda k: least_gap(trace, pairs[k]).margin_m)
    return [_nearest(trace, robot, among[k], least_gap(trace, pairs[k])) for k in near]


def _nearest(trace: Trace, robot: str, other: str, least: Gap) -> Approach:
    return Approach(
        first=robot, second=other, value=least.gap_m, t_s=least.t_s, safe_distance_m=least.pair.required_m,
        appeared=at_appearance(trace, least), moves=kind_of(trace.scenario, least.pair.first, other) == MOVING,
        **(place_on_map(trace, least.pair.first, least.t_s) if other == MAP else {}),
    )  # fmt: skip


def _told(near: Approach, *but: str) -> dict[str, Any]:
    return near.model_dump(exclude_defaults=True, exclude={*but})


def _listed(near: Sequence[Approach]) -> dict[str, dict[str, Any]]:
    return {at.second: _told(at, "first", "second") for at in near}
