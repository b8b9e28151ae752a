"""Claims about a run, by their identifiers, on one trace."""

from typing import Any, Protocol

from airground_drake.sim.trace import Trace
from airground_drake.verify import TRACE_CLAIMS, Finding
from airground_drake.verify.claim import ModelClaim


class Judged(Protocol):
    """The type of the fixture `judged` of conftest.py."""

    def __call__(self, claim: ModelClaim, inputs: dict[str, Any] | None = None) -> Finding:
        """The finding for these inputs; default: those of case A."""


CLAIMS = {claim.id: claim for claim in TRACE_CLAIMS}

GATE = {"GATE-PLAN"}
"""Claims about recorded problems, which the synthetic runs do not have: see runs/test_breakages.py."""

UNRECORDED = {
    "c": dict.fromkeys(GATE, "not_run"),
    "d": {"LIVE-HYP": "error"},
}
"""By method, what claims say where problems, or proposals and outcomes, are not in the trace, as in synthetic runs."""


def decided(claim: str, trace: Trace) -> Finding:
    """One claim on one trace."""
    return CLAIMS[claim].judge(trace)
