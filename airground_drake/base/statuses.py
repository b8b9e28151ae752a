"""Verdicts of claims, expectations, and whether a verdict meets an expectation."""

from typing import Literal, get_args

Status = Literal["proved", "holds", "supported", "refuted", "inconclusive", "error", "not_run"]  # verdict of a claim
STATUSES: tuple[Status, ...] = get_args(Status)
PASSING: tuple[Status, ...] = ("proved", "holds", "supported")  # statuses in which the claim is established
UNDECIDED: tuple[Status, ...] = ("inconclusive", "error", "not_run")  # statuses without a decision

# A further expectation: a status of `PASSING`, and something in the run could have refuted the claim.
EXERCISED = "exercised"
NOT_EXERCISED = "not_exercised"  # outcome of a claim that passed because nothing could have refuted it
EXPECTATIONS: tuple[str, ...] = (*STATUSES, EXERCISED)  # allowed alternatives of an expectation
# Numbers that a scenario may expect of a run besides verdicts: a run without events tests nothing.
COUNTS = {
    "interventions": "At least so many proposals that UGVs began to execute.",
    "messages": "At least so many proposals and answers that were delivered.",
}
# The expectation of a claim about which the method promises nothing: any verdict is accepted, but the claim must be
# judged.
NOTHING = "nothing"


def alternatives(expected: str) -> tuple[str, ...]:
    """The alternatives of an expectation such as "holds", "exercised" or "holds or supported"."""
    return tuple(expected.split(" or "))


def declared(expected: str) -> str:
    """The effective expectation: one that admits both established and refuted claims expects nothing."""
    admitted = alternatives(expected)
    either = "refuted" in admitted and any(status in (*PASSING, EXERCISED) for status in admitted)
    return NOTHING if either else expected


def outcome(status: str, exercised: float | None) -> str:
    """The status of a verdict, or `NOT_EXERCISED` if it passes and nothing could have refuted it."""
    # exercised: how often the claim was tested; None: it was not counted.
    return NOT_EXERCISED if status in PASSING and exercised == 0 else status


def meets(expected: str, status: str, exercised: int | None) -> bool | None:
    """Whether an expectation admits a verdict; None if nothing is expected and the claim was judged."""
    # An expected status ignores how often the claim was tested.
    if expected == NOTHING:
        return False if status in ("error", "not_run") else None
    admitted = alternatives(expected)
    return status in admitted or (EXERCISED in admitted and status in PASSING and bool(exercised))
