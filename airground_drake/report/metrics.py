"""Numbers of one run that every reader asks for: distances, events, decisions, times; strict JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.world import make_world
from airground_drake.verify.engines.geometry import Approach, closest_approach
from airground_drake.verify.runs.pairs import apart_of, least_of, pairs_of
from airground_drake.world.world import World

MOST_OBSTACLES = 20
"""Maximum number of obstacles listed per robot."""
NEAR_OBSTACLES, NEAR_ROBOTS = 3, 1
"""Numbers of obstacles and robots that count as close by."""
NO_GAP = 1e-9
"""A relative optimality gap up to this is a rounding error."""


class Nearby(NamedTuple):
    """Smallest distance of surfaces over continuous time, m; when, s; to what; and the distance required, m."""

    value: float
    t_s: float
    other: str
    required_m: float


def of_run(trace: Trace) -> dict[str, Any]:
    """Metrics of one run.

    Returns:
        `min_distance_m` (robot -> obstacle -> value, t_s, safe_distance_m; exact in continuous time; at most
        `MOST_OBSTACLES`, those of least margin), `min_robot_distance_m` (the same for the other robot of least
        margin), `final_position_m`, `duration_s`, `wall_s` and `realtime_factor` (None if not measured),
        `event_counts` (robot -> kind -> count), `gatekeeper` (see `gatekeeper`).
    """
    wall_s = trace.timings.get("wall_s")
    duration_s = float(trace.t[-1] - trace.t[0])
    counts = {robot: Counter(e["kind"] for e in trace.events if e["robot"] == robot) for robot in trace.robots}
    return {
        "min_distance_m": {robot: _to_obstacles(trace, robot) for robot in trace.robots},
        "min_robot_distance_m": {
            robot: _distances(trace, robot, _others(trace, robot), NEAR_ROBOTS) for robot in trace.robots
        },
        "final_position_m": {robot: trace.position(robot)[-1].tolist() for robot in trace.robots},
        "duration_s": duration_s,
        "wall_s": wall_s,
        "realtime_factor": duration_s / wall_s if wall_s else None,
        "event_counts": {robot: dict(sorted(count.items())) for robot, count in counts.items()},
        "gatekeeper": gatekeeper(trace),
    }


def gatekeeper(trace: Trace) -> dict[str, Any] | None:
    """Summary of the gatekeeper's decisions, None if it made none.

    Returns:
        `calls`, `decisions` (decision -> count), `solver_failures` (decisions that rest on the best plan known because
        the solver failed), `budget_spent` (the same because the budget was spent), `refusals` (robot -> reason ->
        proposals refused at the first answer), `max_gap` (largest optimality gap), `gaps` (decisions with no gap, up
        to 1 %, and more), `period_s` of the gatekeeper, `time_s` (CPU times: p50, p99, max, as order statistics),
        `late` (decisions that took a period or longer; simulated time waits for them) and `closest_call` (the
        decision at which the costs of accepting and refusing were closest, relative to the smaller one). None where
        not recorded.
    """
    table = trace.decisions
    if not len(table):
        return None
    gaps = table["gap"].to_numpy(dtype=np.float64)
    known = gaps[gaps >= 0.0]
    times = np.asarray(trace.timings.get("decision_times_s", []), dtype=np.float64)
    period = float(trace.scenario.gatekeeper.period_s)
    levels = {"p50": 0.5, "p99": 0.99, "max": 1.0}
    time_s = {name: float(np.quantile(times, at, method="higher")) for name, at in levels.items() if times.size}
    return {
        "calls": len(table),
        "decisions": {str(name): int(count) for name, count in table["decision"].value_counts().sort_index().items()},
        "solver_failures": int((table["status"] == "solver_failed").sum()),
        "refusals": _refusals(trace),
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
    """How many proposals each robot refused at its first answer, by reason."""
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


def closest_obstacle(trace: Trace, robot: str) -> Nearby | None:
    """Smallest distance of a robot to any obstacle over continuous time, exact; None without obstacles."""
    return min(_surfaces(trace, robot, _to_obstacles(trace, robot)), default=None)


def close_by(trace: Trace, robot: str) -> list[Nearby]:
    """Smallest distances of a robot to its nearest obstacles and robots, exact, those of least margin first."""
    found = _distances(trace, robot, _obstacles(trace), NEAR_OBSTACLES)
    found |= _distances(trace, robot, _others(trace, robot), NEAR_ROBOTS)
    return sorted(_surfaces(trace, robot, found), key=lambda at: at.value - at.required_m)


def _surfaces(trace: Trace, robot: str, found: dict[str, dict[str, float]]) -> Iterator[Nearby]:
    """The same distances, of surfaces."""
    for other, at in found.items():
        radii = radius_m(trace, robot) + radius_m(trace, other)
        yield Nearby(at["value"] - radii, at["t_s"], other, at["safe_distance_m"] - radii)


def gap_m(trace: Trace, robot: str, other: str) -> Array:
    """Distance of the surfaces of a robot and an obstacle or another robot at the rows, (T,), m.

    NaN before an obstacle appears.
    """
    apart: Array = np.linalg.norm(trace.position(robot) - place(trace, other), axis=1)
    apart[: trace.there_from(other)] = np.nan
    return apart - (radius_m(trace, robot) + radius_m(trace, other))


def place(trace: Trace, name: str) -> Array:
    """Position of an obstacle, (3,), or of a robot, (T, 3), m."""
    if name in trace.scenario.obstacles:
        return np.asarray(trace.scenario.obstacles[name].position_m, dtype=np.float64)
    return trace.position(name)


def safe_distance_m(trace: Trace, robot: str, other: str) -> float:
    """The safe distance of centres that the scenario sets for a robot and an obstacle or another robot, m."""
    world: World = trace.derived("world", lambda: make_world(trace.scenario))
    return world.pair(robot, other).distance_m


def radius_m(trace: Trace, name: str) -> float:
    """Radius of a robot or an obstacle, m."""
    return trace.scenario.bodies[name].radius_m


def _to_obstacles(trace: Trace, robot: str) -> dict[str, dict[str, float]]:
    return _distances(trace, robot, _obstacles(trace), MOST_OBSTACLES)


def _obstacles(trace: Trace) -> list[str]:
    """The obstacles that are there before the end."""
    return [name for name in trace.scenario.obstacles if trace.there_from(name) < len(trace.t)]


def _others(trace: Trace, robot: str) -> list[str]:
    return [other for other in trace.robots if other != robot]


def events_of(trace: Trace, robot: str, *kinds: str) -> list[dict[str, Any]]:
    """Events of a robot, by time, of the given kinds."""
    return [event for event in trace.events if event["robot"] == robot and event["kind"] in kinds]


def _distances(trace: Trace, robot: str, among: Sequence[str], most: int) -> dict[str, dict[str, float]]:
    """Smallest distances of a robot to at most `most` of some obstacles or robots, those of least margin."""
    bound = trace.derived("bounds", lambda: _bounds(trace))
    required = {other: safe_distance_m(trace, robot, other) for other in among}

    @cache
    def closest(k: int) -> Approach:
        other, row = place(trace, among[k]), trace.there_from(among[k])
        return closest_approach(trace.t[row:], trace.position(robot)[row:], other if other.ndim == 1 else other[row:])

    least = np.array([bound[frozenset((robot, other))] - required[other] for other in among])
    near = least_of(least, most, lambda k: closest(k).distance_m - required[among[k]])
    appears = {k: trace.t[row] for k in near if (row := trace.there_from(among[k]))}
    return {
        among[k]: {
            "value": closest(k).distance_m, "t_s": closest(k).t_s, "safe_distance_m": required[among[k]],
            **({"appeared": True} if closest(k).t_s == appears.get(k) else {}),
        }
        for k in near
    }  # fmt: skip


def _bounds(trace: Trace) -> dict[frozenset[str], float]:
    """A lower bound of the distance of each pair over the run, m."""
    apart = zip(pairs_of(trace), apart_of(trace).tolist(), strict=True)
    return {frozenset((pair.first, pair.second)): least for pair, least in apart}
