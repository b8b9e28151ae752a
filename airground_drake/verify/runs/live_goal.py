"""LIVE-GOAL, COMM and GATE-TIME: what a run achieved, and what it spent on messages and computation."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, Finding, TraceClaim
from airground_drake.verify.engines.segments import interpolate

AT_REST_S = 1.0
"""A stalled UGV must have stood still for this long at the end of the run, s."""
AT_REST_M = 1e-3
"""Standing still: no farther than this from the final position, m (the paper's figures resolve about 0.1 m)."""
GATED_METHODS = ("c", "d")
"""Methods with an optimising gatekeeper."""


class LiveGoal(TraceClaim):
    """LIVE-GOAL."""

    id = "LIVE-GOAL"
    statement = "Every robot ended the run at its target, or standing where the scenario declares that it stalls."
    formula = (
        "||p_i(end) - target_i|| <= arrival tolerance; for a declared stall ||p_i(end) - s_i|| <= stall tolerance, "
        "farther than the arrival tolerance from the target, and within 1e-3 m of p_i(end) during the last second; "
        "the UAV then within the arrival tolerance of the UGVs' centroid raised by its altitude"
    )
    method = "The last row of the trace, and for stalls the rows of the last second (straight motion in between)."
    equations = "(6), (9)-(10)"
    assumptions = ("The scenario's duration is long enough to judge: the run is not continued.",)
    does_not_establish = (
        "Arrival from other starts, without bound on time, or that a stalled UGV would stay for ever; nor that robots "
        "tracked their preset on the way. Without potential or navigation function no convergence proof exists."
    )

    def check(self, trace: Trace) -> Finding:
        """Compare each robot's end with what its scenario declares; the least margin is reported."""
        scenario = trace.scenario
        stalls: dict[str, Any] = scenario["runs"][trace.run]["stalls_m"]
        if unknown := set(stalls) - set(trace.ugvs):
            raise TraceError(f"stalls_m names {sorted(unknown)}, which are not UGVs of the trace")
        final = {robot: trace.position(robot)[-1] for robot in trace.robots}
        conditions: list[dict[str, Any]] = []

        def within(robot: str, what: str, point: Array, tolerance: float) -> float:
            distance = float(np.linalg.norm(final[robot] - point))
            entry = {"robot": robot, "condition": what, "point_m": point.tolist(), "final_m": final[robot].tolist()}
            conditions.append({**entry, "distance_m": distance, "margin_m": tolerance - distance})
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
            where={"robot": worst["robot"], "condition": worst["condition"]},
            counterexample=None if live else worst,
            evidence={"conditions": conditions},
        )


def _moved_at_the_end(trace: Trace, robot: str) -> float:
    """Largest distance from the final position during the last `AT_REST_S`, m; convex between rows."""
    t, position = trace.t, trace.position(robot)
    begin = max(t[-1] - AT_REST_S, t[0])
    path = np.vstack([interpolate(t, position, begin), position[t >= begin]])
    return float(np.linalg.norm(path - position[-1], axis=1).max())


class Comm(TraceClaim):
    """COMM."""

    id = "COMM"
    statement = (
        "Messages and gatekeeper solves were spent only while a UGV was being intervened on, and no more of them than "
        "an always-on scheme would have spent."
    )
    formula = (
        "every proposal and decision in [trigger, release + intervention period + gatekeeper period]; "
        "proposals <= n floor(duration / intervention period), decisions <= n floor(duration / gatekeeper period)"
    )
    method = (
        "Counts of proposal events and of decisions (each one solve and one answer), each looked up in the intervals "
        "in which the mode column says 'intervening'. After a release the UAV withdraws its proposal at its next "
        "planning instant and the gatekeeper notices at its next sample: hence the allowance of one period each."
    )
    equations = "(20), (26)"
    assumptions = (
        "Always-on means a proposal per planning period and a decision per gatekeeper period, for every UGV.",
        "Every proposal sent and every decision made is recorded.",
    )
    does_not_establish = (
        "Bytes on a channel, or the cost of supervising: the UAV observes all UGVs all the time, which is not counted. "
        "The saving is that of this run; one with more trouble triggers more. Whether triggers were right is THR-TRIG."
    )

    def applies(self, trace: Trace) -> bool:
        """Method (a) sends nothing by construction."""
        return trace.meta.get("method") != "a"

    def check(self, trace: Trace) -> Finding:
        """Count, look for strays, compare with always-on; the margin is the fraction saved of what saves least."""
        scenario = trace.scenario
        planning, gating = scenario["intervention"]["period_s"], scenario["gatekeeper"]["period_s"]
        gated = trace.meta["method"] in GATED_METHODS
        named = {e["robot"] for e in trace.events if e["kind"] == "proposal"} | set(trace.decisions["robot"])
        if strangers := named - set(trace.ugvs):
            raise TraceError(f"proposals or decisions for {sorted(strangers)}, which are not UGVs of the trace")
        strays: list[dict[str, Any]] = []
        per_ugv: dict[str, dict[str, Any]] = {}
        for ugv in trace.ugvs:
            intervals = _intervening(trace, ugv)
            sent = {
                "proposal": np.array(
                    [float(e["t_s"]) for e in trace.events if (e["kind"], e["robot"]) == ("proposal", ugv)]
                ),
                "decision": _decisions(trace, ugv, "t_s"),
            }
            if np.setdiff1d(_decisions(trace, ugv, "issued_s"), sent["proposal"]).size:
                raise TraceError(f"{ugv}: a decision is about a proposal that is not among the events")
            for kind, times in sent.items():
                late = _outside(times, intervals, planning + gating)
                strays += [{"robot": ugv, "kind": kind, "t_s": float(time)} for time in times[late]]
                if not times.size and (kind == "proposal" or gated) and talk_is_due(trace, ugv):
                    reason = f"{ugv} was in mode 'intervening', but the trace has no {kind}"
                    return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
            per_ugv[ugv] = {kind: len(times) for kind, times in sent.items()} | {"intervals_s": intervals.tolist()}
        n, duration = len(trace.ugvs), scenario["duration_s"] + TIME_TOLERANCE_S
        most = {"proposal": n * int(duration / planning), "decision": n * int(duration / gating) if gated else 0}
        spent = {kind: sum(int(entry[kind]) for entry in per_ugv.values()) for kind in most}
        saved = {kind: 1.0 - spent[kind] / most[kind] for kind in most if most[kind]}
        over = None if all(spent[kind] <= most[kind] for kind in most) else {"spent": spent, "always_on": most}
        return Finding(
            "refuted" if strays or over else "holds",
            margin=None if strays else min(saved.values(), default=None),
            unit="fraction saved",
            counterexample=min(strays, key=lambda stray: float(stray["t_s"])) if strays else over,
            evidence={
                "spent": spent,
                "always_on": most,
                "saved": saved,
                "ugvs": per_ugv,
                "outside_interventions": strays,
            },
        )


def _intervening(trace: Trace, ugv: str) -> Array:
    """Intervals of mode 1, (K, 2), s; the mode of a row is in force since the row before."""
    inside = np.concatenate([[False], trace.column(f"{ugv}.mode")[1:] == 1.0, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
    return trace.t[edges].reshape(-1, 2)


def _decisions(trace: Trace, ugv: str, column: str) -> Array:
    table = trace.decisions
    values = table.loc[table["robot"] == ugv, column].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        raise TraceError(f"decisions of {ugv}: column {column!r} has values that are not finite")
    return values


def _outside(times: Array, intervals: Array, allowance: float) -> npt.NDArray[np.bool_]:
    """Which of the times (M,) are in none of the intervals (K, 2) extended by the allowance: (M,) bool."""
    begins, ends = intervals[:, 0] - TIME_TOLERANCE_S, intervals[:, 1] + allowance + TIME_TOLERANCE_S
    inside = (times[:, None] >= begins) & (times[:, None] <= ends)
    return np.asarray(~inside.any(axis=1))


class GateTime(TraceClaim):
    """GATE-TIME."""

    id = "GATE-TIME"
    statement = "The gatekeeper decided within its sampling period in at least 99 % of its decisions."
    formula = "p99 of the CPU time per decision < gatekeeper period"
    method = "Order statistics (no interpolation, rounded up) of the times measured around every decision of the run."
    equations = "(26)-(29)"
    assumptions = (
        "One CPU time was measured per decision, on the machine that the report names; the solver runs in one thread.",
        "Decisions for several UGVs at one sample run on separate computers: times are per UGV, not summed.",
    )
    does_not_establish = (
        "A worst-case execution time, waiting behind other processes, or the times of other hardware: a measured "
        "maximum is no bound, and with fewer "
        "than 100 decisions p99 is the maximum. Simulated time waits for the solver, so late decisions had no effect."
    )

    def applies(self, trace: Trace) -> bool:
        """Methods (a) and (b) have no gatekeeper to be timed."""
        return trace.meta.get("method") in GATED_METHODS

    def check(self, trace: Trace) -> Finding:
        """Compare p99 with the period; without measurements there is no verdict."""
        times = np.asarray(trace.timings.get("decision_times_s", []), dtype=np.float64)
        period, decisions = float(trace.scenario["gatekeeper"]["period_s"]), len(trace.decisions)
        if not decisions and not any(talk_is_due(trace, ugv) for ugv in trace.ugvs):
            return Finding("holds", evidence={"count": 0, "reason": "no UGV was intervened on: nothing to decide"})
        if not decisions or not times.size:
            return Finding("not_run", evidence={"reason": "no decision, or none timed", "decisions": decisions})
        if len(times) < decisions or not (times >= 0.0).all():
            raise TraceError(f"{len(times)} times for {decisions} decisions, or times that are not numbers >= 0")
        p50, p99 = (float(np.quantile(times, level, method="higher")) for level in (0.5, 0.99))
        evidence = {
            "p50_s": p50,
            "p99_s": p99,
            "max_s": float(times.max()),
            "period_s": period,
            "count": len(times),
            "over_period": int((times >= period).sum()),
        }
        in_time = p99 < period
        counterexample = None if in_time else {"decision": int(times.argmax()), "time_s": float(times.max())}
        return Finding("holds" if in_time else "refuted", period - p99, "s", {}, counterexample, evidence)


def talk_is_due(trace: Trace, ugv: str) -> bool:
    """Whether a UGV is intervened on for longer than a proposal and a decision on it take."""
    periods = trace.scenario["intervention"]["period_s"] + trace.scenario["gatekeeper"]["period_s"]
    return bool((np.diff(_intervening(trace, ugv)) > periods).any())
