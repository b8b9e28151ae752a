"""Claims about runs, checked on their traces.

`verify(trace)` gives a verdict on every claim that applies to the run. The checkers read traces only: they share
no code with the controllers, the simulator or the optimiser whose work they judge.
"""

from __future__ import annotations

from airground_drake.trace import Trace
from airground_drake.verify.outcome import Comm, GateTime, LiveGoal
from airground_drake.verify.safety import SafeHyp, SafeTrace
from airground_drake.verify.triggering import ThrTrig, ZenoTrace
from airground_drake.verify.verdict import PASSING, STATUSES, Finding, Status, TraceClaim, Verdict

__all__ = ["PASSING", "STATUSES", "TRACE_CLAIMS", "Finding", "Status", "TraceClaim", "Verdict", "verify"]

TRACE_CLAIMS: tuple[TraceClaim, ...] = (
    SafeTrace(),
    SafeHyp(),
    ZenoTrace(),
    ThrTrig(),
    GateTime(),
    LiveGoal(),
    Comm(),
)
"""The claims that are decided from one trace, in the order of the report."""


def verify(trace: Trace) -> list[Verdict]:
    """Judge every claim that applies to the run's method.

    Args:
        trace: one run.

    Returns:
        One verdict per applicable claim, with the status that the scenario expects of this run ('holds' unless
        it says otherwise). Anything that keeps a claim from being decided is the status 'error'.
    """
    runs = trace.meta.get("scenario", {}).get("runs", {})
    run = str(trace.meta.get("run"))
    expected = runs.get(run, {}).get("expected", {})
    return [
        Verdict(claim, run, claim.judge(trace), expected.get(claim.id, "holds"))
        for claim in TRACE_CLAIMS
        if claim.applies(trace)
    ]
