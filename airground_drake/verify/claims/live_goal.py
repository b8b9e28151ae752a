"""LIVE-GOAL: where the robots of a run ended. For a robot that collides, the run ends there."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.collisions import first_collisions
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.finding import Finding

AT_REST_S = 1.0  # a stalled UGV must have stood still for this long at the end of the run, s

# Standing still: no farther than this from the final position, m (the paper's figures resolve about 0.1 m).
AT_REST_M = 1e-3


class LiveGoal(TraceClaim):
    id = "LIVE-GOAL"
    subject = "arrival"
    summary = "Every robot ended at its target, or at the point where the scenario expects it to stall."
    statement = (
        "Every robot ended the run at its target, or standing at the point where the scenario expects it to stall. For"
        " a robot that collided, only its motion before the first collision counts."
    )
    latex = (
        r"\lVert p_i(T) - \text{target}_i \rVert \le \varepsilon_{\text{arrival}}",
        r"\text{declared stall: } \lVert p_i(T) - s_i \rVert \le \varepsilon_{\text{stall}}, \quad \lVert "
        r"p_i(T) - \text{target}_i \rVert > \varepsilon_{\text{arrival}}",
        r"\text{and } \lVert p_i(t) - p_i(T) \rVert \le 10^{-3} \text{ m for } t \ge T - 1 \text{ s}",
    )
    method = (
        "The last row of the trace, or the last one before the robot's first collision; for stalls the rows of the "
        "last second before it (straight motion in between)."
    )
    equations = "(6), (9)-(10)"
    assumptions = ("The scenario's duration is long enough to judge: the run is not continued.",)
    does_not_establish = (
        "Arrival from other starts or in unlimited time, that a stalled UGV would stay for ever, or that robots "
        "tracked their preset. Without a potential or navigation function there is no convergence proof."
    )

    exercised_by = "robots that did not start where they must end"

    def check(self, trace: Trace) -> Finding:
        stalls = trace.scenario.runs[trace.run].stalls_m
        if unknown := set(stalls) - set(trace.ugvs):
            raise TraceError(f"stalls_m names {sorted(unknown)}, which are not UGVs of the trace")
        counting = {robot: trace.counting_rows(robot) for robot in trace.robots}
        ways = {robot: Way(trace.t[:rows], trace.position(robot)[:rows]) for robot, rows in counting.items()}
        last = np.array([trace.position(ugv)[-1] for ugv in trace.ugvs])
        judged = list(conditions(trace.scenario, stalls, ways, last))
        entries = [condition.entry for condition in judged]
        had_a_way = [condition.entry["robot"] for condition in judged if condition.had_a_way]
        hits = first_collisions(trace.events)
        for entry in entries:
            if entry["robot"] in hits:
                entry["collided_s"] = hits[entry["robot"]]["t_s"]
        worst = min(entries, key=lambda at: (at["margin_m"] >= 0.0, "collided_s" not in at, at["margin_m"]))
        live = worst["margin_m"] >= 0.0
        return Finding(
            "holds" if live else "refuted",
            margin=worst["margin_m"],
            unit="m",
            quantity="tolerance left about where a robot must end",
            where={key: worst[key] for key in ("robot", "condition", "collided_s") if key in worst},
            counterexample=None if live else worst,
            evidence={"conditions": entries, "had_a_way_to_go": had_a_way} | ({"kind": "stuck"} if stalls else {}),
            exercised=len(had_a_way),
        )


class Condition(NamedTuple):
    """A condition on a robot's end, as evidence, and whether the robot began elsewhere."""

    entry: dict[str, Any]
    had_a_way: bool = False


class Way(NamedTuple):
    """A robot's motion up to its first collision."""

    t: Array  # (T,), s
    position: Array  # (T, 3), m


def conditions(
    scenario: Scenario, stalls: Mapping[str, Sequence[float]], ways: Mapping[str, Way], last: Array
) -> Iterator[Condition]:
    """The scenario's conditions on each robot's end, with margins, m; `stalls` has the stall points of UGVs, m."""
    # last: where the n UGVs are at the end of the run, (n, 3), m
    arrival = float(scenario.arrival_tolerance_m)
    for ugv, given in scenario.ugvs.items():
        if ugv not in stalls:
            yield _within(ways, ugv, "at its target", given.target_m, arrival)
            continue
        yield _within(ways, ugv, "at its stall point", stalls[ugv], scenario.stall_tolerance_m)
        moved = moved_at_the_end(ways[ugv])
        yield Condition({"robot": ugv, "condition": "stands", "moved_m": moved, "margin_m": AT_REST_M - moved})
        away = float(np.linalg.norm(ways[ugv].position[-1] - given.target_m))
        yield Condition({"robot": ugv, "condition": "short of its target", "margin_m": away - arrival})
    for name, uav in scenario.aerial.items():
        if stalls:
            own = [ugv in scenario.in_charge(name) for ugv in scenario.ugvs]
            over = last[own].mean(axis=0) + np.array([0.0, 0.0, uav.altitude_m])
            whose = "the UGVs" if all(own) else "its UGVs"
            yield _within(ways, name, f"over the centroid of {whose}", over, arrival)
        else:
            yield _within(ways, name, "at its target", uav.target_m, arrival)


def _within(
    ways: Mapping[str, Way], robot: str, condition: str, point: Array | Sequence[float], tolerance_m: float
) -> Condition:
    """The condition that a robot ends within a tolerance of a point, (3,), m."""
    there = np.asarray(point, dtype=np.float64)
    begin, end = ways[robot].position[[0, -1]]
    before, after = (float(np.linalg.norm(place - there)) for place in (begin, end))
    at = {"robot": robot, "condition": condition, "point_m": there.tolist(), "final_m": end.tolist()}
    return Condition({**at, "distance_m": after, "margin_m": tolerance_m - after}, before > tolerance_m)


def moved_at_the_end(way: Way) -> float:
    """Largest distance from its last place during the last `AT_REST_S`, m; convex between rows."""
    t, position = way
    begin = max(t[-1] - AT_REST_S, t[0])
    path = np.vstack([interpolate(t, position, begin), position[t >= begin]])
    return float(np.linalg.norm(path - position[-1], axis=1).max())
