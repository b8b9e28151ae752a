"""Claims about a run, by their identifiers, on one trace."""

from collections.abc import Iterable
from typing import Any, Protocol

import pytest

from airground_drake.sim.batch.run import Batch, Going
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.work import happened, happened_in
from airground_drake.verify import TRACE_CLAIMS, Finding, Verdict
from airground_drake.verify.array_judges import SAME, ArrayJudges
from airground_drake.verify.claim import ModelClaim


class Judged(Protocol):
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
    return CLAIMS[claim].judge(trace)


def findings_agreed(loop: Batch, made: Going, trace: Trace, verdicts: Iterable[Verdict]) -> set[str]:
    """The claims about a run that array judges decide, all of them as these verdicts; and the same has happened."""
    findings = ArrayJudges(loop).findings(made.log)
    for verdict in verdicts:
        if (finding := findings.get(verdict.claim.id)) is not None:
            assert (finding.status, finding.unit) == (verdict.status, verdict.unit), verdict
            assert finding.exercised == verdict.exercised, verdict
            assert finding.margin == pytest.approx(verdict.margin, abs=SAME), verdict
    if findings:
        assert happened(loop, made) == pytest.approx(happened_in(trace), nan_ok=True)
    return {*findings}
