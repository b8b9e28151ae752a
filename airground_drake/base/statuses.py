"""What can come of a claim, what may be expected of it, and whether the one is the other."""

from __future__ import annotations

from typing import Literal, get_args

Status = Literal["proved", "holds", "supported", "refuted", "inconclusive", "error", "not_run"]
"""What can come of a claim."""
STATUSES: tuple[Status, ...] = get_args(Status)
PASSING: tuple[Status, ...] = ("proved", "holds", "supported")
"""Statuses in which the claim was established, each in its way."""
UNDECIDED: tuple[Status, ...] = ("inconclusive", "error", "not_run")
"""Statuses that say nothing about the claim."""

EXERCISED = "exercised"
"""What a scenario may expect besides a status: one of `PASSING`, on at least one thing that could have refuted it."""
NOT_EXERCISED = "not_exercised"
"""How a claim counts that was established because nothing put it to the test."""
EXPECTATIONS: tuple[str, ...] = (*STATUSES, EXERCISED)
"""What an alternative of an expectation may be."""


def alternatives(expected: str) -> tuple[str, ...]:
    """What an expectation admits: "holds"; "exercised"; "exercised or refuted" where there is no guarantee."""
    return tuple(expected.split(" or "))


def admits_either(expected: str) -> bool:
    """Whether an expectation admits a claim that was established and one that was refuted: nothing decided differs."""
    admitted = alternatives(expected)
    return "refuted" in admitted and any(each in (*PASSING, EXERCISED) for each in admitted)


def outcome(status: str, exercised: float | None) -> str:
    """How a verdict counts: by its status, or as `NOT_EXERCISED` if nothing was there to refute it.

    Args:
        status: the verdict.
        exercised: how often the claim was put to the test; None: it was not counted.
    """
    return NOT_EXERCISED if status in PASSING and exercised == 0 else status


def meets(expected: str, status: str, exercised: int | None) -> bool:
    """Whether a verdict is one that an expectation admits; a status admits it however often it was exercised."""
    put_to_the_test = status in PASSING and bool(exercised)
    return any(status == each or (each == EXERCISED and put_to_the_test) for each in alternatives(expected))
