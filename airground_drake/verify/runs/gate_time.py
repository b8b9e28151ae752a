"""GATE-TIME: what the gatekeeper's decisions of a run took."""

from __future__ import annotations

import numpy as np

from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.interventions import GATED_METHODS, talk_is_due


class GateTime(TraceClaim):
    """GATE-TIME."""

    id = "GATE-TIME"
    summary = "The gatekeeper was fast enough: it decided within its sampling period."
    statement = "The gatekeeper decided within its sampling period in at least 99 % of its decisions."
    formula = "p99 of the CPU time per decision < gatekeeper period"
    latex = (r"t_{99} < h_{\text{gate}}, \quad t_{99} \text{ the 99th percentile of the time per decision}",)
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

    exercised_by = "decisions that were timed"

    def applies(self, trace: Trace) -> bool:
        """Methods (a) and (b) have no gatekeeper to be timed."""
        return trace.meta.get("method") in GATED_METHODS

    def check(self, trace: Trace) -> Finding:
        """Compare p99 with the period; without measurements there is no verdict."""
        times = np.asarray(trace.timings.get("decision_times_s", []), dtype=np.float64)
        period = float(trace.scenario["gatekeeper"]["period_s"])
        decisions = len(trace.decisions)
        if not decisions and not any(talk_is_due(trace, ugv) for ugv in trace.ugvs):
            reason = "no UGV was intervened on: nothing to decide"
            return Finding("holds", evidence={"count": 0, "reason": reason}, exercised=0)
        if not decisions or not times.size:
            return Finding("not_run", evidence={"reason": "no decision, or none timed", "decisions": decisions})
        if len(times) != decisions or not (times >= 0.0).all():
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
        quantity = "sampling period less the 99th percentile of decision times"
        return Finding(
            "holds" if in_time else "refuted",
            margin=period - p99,
            unit="s",
            quantity=quantity,
            counterexample=counterexample,
            evidence=evidence,
            exercised=len(times),
        )
