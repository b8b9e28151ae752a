"""ZENO-TRACE: the times between the triggers of a run."""

from itertools import pairwise

from airground_drake.base.errors import TraceError
from airground_drake.base.exact import decimal
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.triggers import column_conflict, recorded_events


class ZenoTrace(TraceClaim):
    id = "ZENO-TRACE"
    subject = "gaps between triggers"
    summary = "No UGV was triggered twice within the minimum inter-event time."
    statement = "In this run no UGV was triggered twice within the minimum inter-event time."
    latex = (r"t_{k+1} - t_k \ge \tau_{\min} - 10^{-9} \text{ s} \quad \text{for consecutive triggers of each UGV}",)
    method = (
        "Differences of the recorded trigger times; the events must agree with the columns triggers, triggered_at_s "
        "and released_at_s at every row, otherwise the verdict is `error`. A bare trigger is held to the same bound."
    )
    equations = "(20)"
    assumptions = ("The trace records every trigger (THR-TRIG recomputes them independently).",)
    does_not_establish = (
        "Absence of Zeno behaviour in other runs: a finite run has finitely many events whatever the trigger is. "
        "ZENO-PROOF is the statement for all runs, and ZENO-REFINE is about refined noise. If no UGV has two triggers,"
        " there is no gap, and the claim holds without a margin."
    )

    theorems = ("Trigger",)
    exercised_by = "gaps between consecutive triggers of one UGV"

    def check(self, trace: Trace) -> Finding:
        bound = float(trace.scenario.decision.min_inter_event_s)
        if bound <= 0.0:
            return Finding("not_run", evidence={"reason": "min_inter_event_s is 0: no bound to compare with"})
        triggers: dict[str, list[float]] = {}
        for ugv in trace.ugvs:
            events = recorded_events(trace, ugv)
            if conflict := column_conflict(trace, ugv, events):
                raise TraceError(f"events and columns disagree: {conflict}")
            triggers[ugv] = [time for time, kind in events if kind == "trigger"]
        evidence = {
            "triggers": {ugv: {"count": len(times), "t_s": times} for ugv, times in triggers.items()},
            "bound_s": bound,
            "most_triggers_possible": int(decimal(trace.scenario.duration_s) // decimal(bound)) + 1,
        }
        gaps = [(t_s - before, ugv, before, t_s) for ugv, times in triggers.items() for before, t_s in pairwise(times)]
        if not gaps:
            return Finding("holds", evidence=evidence | {"reason": "no UGV was triggered twice"}, exercised=0)
        smallest = dict(zip(("gap_s", "robot", "previous_t_s", "t_s"), min(gaps), strict=True))
        margin = min(gaps)[0] - bound
        held = margin >= -TIME_TOLERANCE_S
        return Finding(
            "holds" if held else "refuted",
            margin=margin,
            unit="s",
            quantity="smallest gap between two triggers less the bound",
            where={key: smallest[key] for key in ("robot", "t_s")},
            counterexample=None if held else smallest,
            evidence=evidence | {"smallest_gap": smallest},
            exercised=len(gaps),
        )
