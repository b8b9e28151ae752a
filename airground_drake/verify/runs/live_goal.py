"""LIVE-GOAL: where the robots of a run ended."""

from __future__ import annotations

from typing import Any

import numpy as np

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.engines.segments import interpolate
from airground_drake.verify.finding import Finding

AT_REST_S = 1.0
"""A stalled UGV must have stood still for this long at the end of the run, s."""

AT_REST_M = 1e-3
"""Standing still: no farther than this from the final position, m (the paper's figures resolve about 0.1 m)."""


class LiveGoal(TraceClaim):
    """LIVE-GOAL."""

    id = "LIVE-GOAL"
    summary = "Every robot ended where it must: at its target, or where the scenario says that it stalls."
    statement = "Every robot ended the run at its target, or standing where the scenario declares that it stalls."
    formula = (
        "||p_i(end) - target_i|| <= arrival tolerance; for a declared stall ||p_i(end) - s_i|| <= stall tolerance, "
        "farther than the arrival tolerance from the target, and within 1e-3 m of p_i(end) during the last second; "
        "the UAV then within the arrival tolerance of the UGVs' centroid raised by its altitude"
    )
    latex = (
        r"\lVert p_i(T) - \text{target}_i \rVert \le \varepsilon_{\text{arrival}}",
        r"\text{declared stall: } \lVert p_i(T) - s_i \rVert \le \varepsilon_{\text{stall}}, \quad \lVert "
        r"p_i(T) - \text{target}_i \rVert > \varepsilon_{\text{arrival}}",
        r"\text{and } \lVert p_i(t) - p_i(T) \rVert \le 10^{-3} \text{ m for } t \ge T - 1 \text{ s}",
    )
    method = "The last row of the trace, and for stalls the rows of the last second (straight motion in between)."
    equations = "(6), (9)-(10)"
    assumptions = ("The scenario's duration is long enough to judge: the run is not continued.",)
    does_not_establish = (
        "Arrival from other starts, without bound on time, or that a stalled UGV would stay for ever; nor that robots "
        "tracked their preset on the way. Without potential or navigation function no convergence proof exists."
    )

    exercised_by = "robots that had a way to go to where they must end"

    def check(self, trace: Trace) -> Finding:
        """Compare each robot's end with what its scenario declares; the least margin is reported."""
        scenario = trace.scenario
        stalls: dict[str, Any] = scenario["runs"][trace.run]["stalls_m"]
        if unknown := set(stalls) - set(trace.ugvs):
            raise TraceError(f"stalls_m names {sorted(unknown)}, which are not UGVs of the trace")
        final = {robot: trace.position(robot)[-1] for robot in trace.robots}
        conditions: list[dict[str, Any]] = []
        away_from_there: list[str] = []

        def within(robot: str, what: str, point: Array, tolerance: float) -> float:
            distance = float(np.linalg.norm(final[robot] - point))
            entry = {"robot": robot, "condition": what, "point_m": point.tolist(), "final_m": final[robot].tolist()}
            conditions.append({**entry, "distance_m": distance, "margin_m": tolerance - distance})
            if float(np.linalg.norm(trace.position(robot)[0] - point)) > tolerance:
                away_from_there.append(robot)
            return distance

        arrival = float(scenario["arrival_tolerance_m"])
        for ugv in trace.ugvs:
            target = np.asarray(scenario["ugvs"][ugv]["target_m"], dtype=np.float64)
            if ugv not in stalls:
                within(ugv, "at its target", target, arrival)
                continue
            within(ugv, "at its stall point", np.asarray(stalls[ugv], dtype=np.float64), scenario["stall_tolerance_m"])
            moved = _moved_at_the_end(trace, ugv)
            conditions.append({"robot": ugv, "condition": "stands", "moved_m": moved, "margin_m": AT_REST_M - moved})
            away = float(np.linalg.norm(final[ugv] - target))
            conditions.append({"robot": ugv, "condition": "short of its target", "margin_m": away - arrival})
        uav = scenario["uav"]
        if stalls:
            centroid = np.mean([final[ugv] for ugv in trace.ugvs], axis=0) + np.array([0.0, 0.0, uav["altitude_m"]])
            within(uav["name"], "over the centroid of the UGVs", centroid, arrival)
        else:
            within(uav["name"], "at its target", np.asarray(uav["target_m"], dtype=np.float64), arrival)
        worst = min(conditions, key=lambda entry: float(entry["margin_m"]))
        live = all(entry["margin_m"] >= 0.0 for entry in conditions)
        return Finding(
            "holds" if live else "refuted",
            margin=worst["margin_m"],
            unit="m",
            quantity="tolerance left about where a robot must end",
            where={"robot": worst["robot"], "condition": worst["condition"]},
            counterexample=None if live else worst,
            evidence={"conditions": conditions, "had_a_way_to_go": away_from_there}
            | ({"kind": "stuck"} if stalls else {}),
            exercised=len(away_from_there),
        )


def _moved_at_the_end(trace: Trace, robot: str) -> float:
    """Largest distance from the final position during the last `AT_REST_S`, m; convex between rows."""
    t, position = trace.t, trace.position(robot)
    begin = max(t[-1] - AT_REST_S, t[0])
    path = np.vstack([interpolate(t, position, begin), position[t >= begin]])
    return float(np.linalg.norm(path - position[-1], axis=1).max())
