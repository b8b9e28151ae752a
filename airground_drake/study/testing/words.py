"""A verdict in words, for the output of a failed test."""

from airground_drake.base.files import strict
from airground_drake.base.statuses import PASSING
from airground_drake.report.model import Claim
from airground_drake.report.phrases import in_words, place_of
from airground_drake.report.quantities import told as value_of
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding

_FOUND = {
    "refuted": "is refuted",
    "inconclusive": "is inconclusive: neither established nor refuted",
    "error": "could not be decided",
    "not_run": "was not decided",
}


def told(verdict: Verdict, place: str) -> str:
    """A verdict in several lines: what was claimed, what was found, by whom and when, and what was seen there."""
    of = verdict.claim
    claim = Claim.model_construct(exercised_by=of.exercised_by, **strict(Finding.to_json(verdict)))
    lines = [f"{of.id} {_found(verdict)}, {place}", f"  claim: {of.statement}", f"  found: {in_words(claim)}"]
    if claim.margin is not None and claim.status not in PASSING:
        margin = value_of(claim.margin, claim.unit)
        lines.append(f"  value: {claim.quantity or 'margin'}: {margin}; at least 0 is needed")
    if seen := place_of(claim):
        lines.append(f"  seen: {value_of(seen, digits=6)}")
    return "\n".join(lines)


def _found(verdict: Verdict) -> str:
    if verdict.status not in PASSING:
        return _FOUND[verdict.status]
    if verdict.exercised is None:
        return f"{verdict.status}, but does not count what tests it"
    what = verdict.claim.exercised_by or "things"
    return f"{verdict.status}, but nothing tested it ({verdict.exercised} {what})"
