"""COMM: what a run spent on messages and gatekeeper solves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.interventions import GATED_METHODS, intervening, talk_is_due
from airground_drake.verify.runs.standing import map_conflicts, standing_conflicts


class Comm(TraceClaim):
    """COMM."""

    id = "COMM"
    summary = "The UAV talked only while it was needed, and less than if it always talked."
    statement = (
        "Messages and gatekeeper solves were spent only while the UGV concerned, or the one that it was asked to make "
        "way for, was being intervened on, and no more of them than an always-on scheme would have spent. "
        "No proposal was decided on once it was taken back, or replaced while it was in force but by or in a joint "
        "plan, or while another UGV was intervened on, too; what it said of obstacles was what the UAV knew: its own "
        "map, and what UGVs sensed when they refused."
    )
    formula = (
        "every proposal and decision in [trigger, release + intervention period + gatekeeper period]; "
        "proposals <= n ceil(duration / intervention period), decisions <= n ceil(duration / gatekeeper period); "
        "no decision on a proposal that is withdrawn, none in force replaced but by or in a joint plan or while "
        "another UGV is intervened on; "
        "map of a proposal = known and phantom obstacles, then all sensed by UGVs at refusals that the UAV has noticed"
    )
    latex = (
        r"t_{\text{message}} \in [t_{\text{trigger}}, t_{\text{release}} + h_{\text{UAV}} + h_{\text{gate}}]",
        r"\text{proposals} \le n \lceil T / h_{\text{UAV}} \rceil, \quad \text{decisions} \le n \lceil T / "
        r"h_{\text{gate}} \rceil",
    )
    method = (
        "Counts of proposal events and of decisions (each one solve and one answer), each looked up in the intervals "
        "in which the mode column of the UGV, or of the one whose trigger is the proposal's cause, says "
        "'intervening'. After a release the UAV withdraws its proposal at its next "
        "planning instant and the gatekeeper notices at its next sample: hence the allowance of one period each. What "
        "UGVs sensed at refusals follows from their positions; the UAV notices a refusal at the next planning instant, "
        "if the proposal is in force until then. When a proposal is withdrawn follows as for EXEC."
    )
    equations = "(20), (26)"
    assumptions = (
        "Always-on means a proposal per planning period and a decision per gatekeeper period, for every UGV.",
        "Every proposal sent and every decision made is recorded.",
        "Policies of others may send another map than the UAV's.",
    )
    does_not_establish = (
        "Bytes on a channel, or the cost of supervising: the UAV observes all UGVs all the time, which is not counted. "
        "The saving is that of this run; one with more trouble triggers more. Whether triggers were right is THR-TRIG."
    )

    def applies(self, trace: Trace) -> bool:
        """Method (a) sends nothing by construction."""
        return trace.meta.get("method") != "a"

    exercised_by = "proposals sent"

    def check(self, trace: Trace) -> Finding:
        """Count, look for strays, compare with always-on; the margin is the fraction saved of what saves least."""
        scenario = trace.scenario
        planning = scenario["intervention"]["period_s"]
        gating = scenario["gatekeeper"]["period_s"]
        gated = trace.meta["method"] in GATED_METHODS
        named = {e["robot"] for e in trace.events if e["kind"] == "proposal"} | set(trace.decisions["robot"])
        if strangers := named - set(trace.ugvs):
            raise TraceError(f"proposals or decisions for {sorted(strangers)}, which are not UGVs of the trace")
        rows = trace.proposals.to_dict("records")
        by_time = {(row["robot"], row["issued_s"]): str(row["cause"]) for row in rows}
        by_number = {row["number"]: str(row["cause"]) for row in rows}
        strays: list[dict[str, Any]] = []
        per_ugv: dict[str, dict[str, Any]] = {}
        silent: dict[str, list[str]] = {"proposal": [], "decision": []}
        for ugv in trace.ugvs:
            intervals = intervening(trace, ugv)
            sent = {
                "proposal": np.array(
                    [float(e["t_s"]) for e in trace.events if (e["kind"], e["robot"]) == ("proposal", ugv)]
                ),
                "decision": _decisions(trace, ugv, "t_s"),
            }
            numbers = _decisions(trace, ugv, "number").tolist()
            if np.setdiff1d(_decisions(trace, ugv, "issued_s"), sent["proposal"]).size:
                raise TraceError(f"{ugv}: a decision is about a proposal that is not among the events")
            causes = {
                "proposal": [by_time.get((ugv, t), ugv) for t in sent["proposal"].tolist()],
                "decision": [by_number.get(number, ugv) for number in numbers],
            }
            for kind, times in sent.items():
                late = _outside(times, intervals, planning + gating)
                for other in {*causes[kind]} - {ugv}:
                    asked = np.array([cause == other for cause in causes[kind]], bool)
                    late &= ~asked | _outside(times, intervening(trace, other), planning + gating)
                strays += [{"robot": ugv, "kind": kind, "t_s": float(time)} for time in times[late]]
                if not times.size and (kind == "proposal" or gated) and talk_is_due(trace, ugv):
                    silent[kind].append(ugv)
            per_ugv[ugv] = {kind: len(times) for kind, times in sent.items()} | {"intervals_s": intervals.tolist()}
        n, before = len(trace.ugvs), scenario["duration_s"] - TIME_TOLERANCE_S  # the first instant is at 0
        most = {
            "proposal": n * math.ceil(before / planning),
            "decision": n * math.ceil(before / gating) if gated else 0,
        }
        spent = {kind: sum(int(entry[kind]) for entry in per_ugv.values()) for kind in most}
        for kind, ugvs in silent.items():
            if ugvs and not spent[kind]:
                reason = f"{', '.join(ugvs)} were in mode 'intervening', but the trace has no {kind}"
                return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
        saved = {kind: 1.0 - spent[kind] / most[kind] for kind in most if most[kind]}
        misused = list[dict[str, Any]]()
        if not strays and len(trace.proposals):
            misused = [*map_conflicts(trace), *standing_conflicts(trace)]
        over = None if all(spent[kind] <= most[kind] for kind in most) else {"spent": spent, "always_on": most}
        return Finding(
            "refuted" if strays or over or misused else "holds",
            margin=None if strays or misused else min(saved.values(), default=None),
            unit="fraction saved",
            quantity="messages or decisions saved against always-on",
            counterexample=min(strays + misused, key=lambda stray: float(stray["t_s"]), default=over),
            evidence={
                "spent": spent,
                "always_on": most,
                "saved": saved,
                "ugvs": per_ugv,
                "outside_interventions": strays,
                **{f"without_{kind}s": ugvs for kind, ugvs in silent.items()},
            },
            exercised=spent["proposal"],
        )


def _decisions(trace: Trace, ugv: str, column: str) -> Array:
    table = trace.decisions
    values = table.loc[table["robot"] == ugv, column].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        raise TraceError(f"decisions of {ugv}: column {column!r} has values that are not finite")
    return values


def _outside(times: Array, intervals: Array, allowance: float) -> npt.NDArray[np.bool_]:
    """Which of the times (M,) are in none of the intervals (K, 2) extended by the allowance: (M,) bool."""
    begins = intervals[:, 0] - TIME_TOLERANCE_S
    ends = intervals[:, 1] + allowance + TIME_TOLERANCE_S
    inside = (times[:, None] >= begins) & (times[:, None] <= ends)
    return np.asarray(~inside.any(axis=1))
