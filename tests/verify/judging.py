"""Claims about a run, by their identifiers, on one trace."""

from __future__ import annotations

from typing import Any, Protocol

from airground_drake.run.trace import Trace
from airground_drake.verify import TRACE_CLAIMS, Finding, TraceClaim
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.runs import gate_feas, gate_opt
from airground_drake.verify.runs.convex_bounds import enclose
from airground_drake.verify.runs.gate_feas import GateFeas
from airground_drake.verify.runs.gate_opt import GateOpt
from airground_drake.verify.runs.gate_record import Off, rows_of
from airground_drake.verify.runs.sum_up_rounding import compare_rounding, is_rounded


class Judged(Protocol):
    """The type of the fixture `judged` of conftest.py."""

    def __call__(self, claim: ModelClaim, inputs: dict[str, Any] | None = None) -> Finding:
        """The finding for these inputs; default: those of case A."""


CLAIMS = {claim.id: claim for claim in TRACE_CLAIMS}

GATE = {"GATE-OPT", "GATE-FEAS", "GATE-MODEL"}
"""Claims about recorded problems, which the synthetic runs do not have: see runs/test_gate_claims.py."""

UNRECORDED = {
    "c": dict.fromkeys(GATE, "not_run"),
    "d": dict.fromkeys(("GATE-FEAS", "GATE-MODEL", "LIVE-PROG"), "error"),
}
"""By method, what claims say where problems, or proposals and outcomes, are not in the trace, as in synthetic runs."""

LAW = {"EXEC"}
"""Claims about the control law, which the synthetic runs do not follow to the letter: see runs/test_exec.py."""


def judge(claim: str, trace: Trace) -> Finding:
    """One claim on one trace."""
    return CLAIMS[claim].judge(trace)


def counterexample(claim: str, trace: Trace) -> dict[str, Any]:
    """That of a claim which must be refuted; where there is a margin, it is negative."""
    finding = judge(claim, trace)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.margin is None or finding.margin < 0.0
    return finding.counterexample


FEAS, OPT = GateFeas(), GateOpt()


def comparisons(claim: TraceClaim, trace: Trace) -> list[Off]:
    rows = rows_of(trace)
    if claim is OPT:
        pairs = zip(rows, enclose(rows), strict=True)
        return [one for row in rows for one in gate_opt.compare_with_constant_plans(row)] + [
            one for row, found in pairs for one in gate_opt.compare_bounds(row, found, 0)
        ]
    described = [
        one for row in rows for one in (*gate_feas.compare_situation(trace, row), *gate_feas.compare_plan(trace, row))
    ]
    rounded = [one for row in rows if is_rounded(row) for one in compare_rounding(row)]
    return [*described, *rounded, *gate_feas.compare_answers(trace, rows)]


def assert_decision_refuted(claim: TraceClaim, trace: Trace, what: str) -> None:
    """That a claim refutes a record of which the third decision was edited, and for the right reason."""
    finding = claim.judge(trace)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample["robot"] == "ugv1"
    assert finding.counterexample["t_s"] <= 0.2 + 1e-9  # the edited row, or the one that has to follow from it
    found = {one.what for one in comparisons(claim, trace) if one.wrong}
    assert any(what in text for text in found), found
