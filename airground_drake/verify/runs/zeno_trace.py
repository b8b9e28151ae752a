"""ZENO-TRACE: the times between the triggers of a run."""

from __future__ import annotations

from itertools import pairwise

from airground_drake.base.errors import TraceError
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.triggers import column_conflict, recorded_events


class ZenoTrace(TraceClaim):
    """ZENO-TRACE."""

    id = "ZENO-TRACE"
    summary = "No UGV was triggered twice within the minimum inter-event time."
    statement = "In this run no UGV was triggered twice within the minimum inter-event time."
    formula = "t_(k+1) - t_k >= min_inter_event_s for consecutive triggers of each UGV, tolerance 1e-9 s"
    latex = (r"t_{k+1} - t_k \ge \tau_{\min} - 10^{-9} \text{ s} \quad \text{for consecutive triggers of each UGV}",)
    method = (
        "Differences of the recorded trigger times; the events must agree with the columns triggers, triggered_at_s "
        "and released_at_s at every row, otherwise the verdict is `error`. A bare trigger is held to the same bound."
    )
    equations = "(20)"
    assumptions = ("The trace records every trigger (THR-TRIG recomputes them independently).",)
    does_not_establish = (
        "Absence of Zeno behaviour in other runs: a finite run has finitely many events whatever the trigger is. The "
        "statement for all runs is ZENO-PROOF, that about refined noise ZENO-REFINE. With fewer than two triggers the "
        "claim holds for lack of a gap (the margin is then empty)."
    )

    exercised_by = "gaps between consecutive triggers of one UGV"

    def check(self, trace: Trace) -> Finding:
        """Compare the smallest gap of each UGV with the bound."""
        bound = float(trace.scenario.decision.min_inter_event_s)
        if bound <= 0.0:
            return Finding("not_run", evidence={"reason": "min_inter_event_s is 0: no bound to compare with"})
        triggers: dict[str, list[float]] = {}
        for ugv in trace.ugvs:
            events = recorded_events(trace, ugv)
            if conflict := column_conflict(trace, ugv, events):
                raise TraceError(f"events and columns disagree: {conflict}")
            triggers[ugv] = [time for time, kind in events if kind == "trigger"]
        gaps = [
            (after - before, ugv, before, after) for ugv, times in triggers.items() for before, after in pairwise(times)
        ]
        evidence = {
            "triggers": {ugv: {"count": len(times), "t_s": times} for ugv, times in triggers.items()},
            "bound_s": bound,
            "most_triggers_possible": int(trace.scenario.duration_s / bound) + 1,
        }
        if not gaps:
            return Finding("holds", evidence=evidence | {"reason": "no UGV was triggered twice"}, exercised=0)
        gap, ugv, before, after = min(gaps)
        smallest = {"robot": ugv, "previous_t_s": before, "t_s": after, "gap_s": gap}
        held = gap >= bound - TIME_TOLERANCE_S
        return Finding(
            "holds" if held else "refuted",
            margin=gap - bound,
            unit="s",
            quantity="smallest gap between two triggers less the bound",
            where={"robot": ugv, "t_s": after},
            counterexample=None if held else smallest,
            evidence=evidence | {"smallest_gap": smallest},
            exercised=len(gaps),
        )
