"""The bidirectional channel: proposals from the UAV, answers from the UGVs.

An answer is two numbers per UGV: ACCEPT, REFUSE or SILENT, and the number of the proposal that it
answers. An answer to another proposal than the one in force means nothing. With it comes a report: the obstacles
that the UGV sensed when it decided, and why it answers so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from airground_drake.arrays import Array
from airground_drake.intervention.policy import Proposal

ACCEPT, SILENT, REFUSE = 1.0, 0.0, -1.0

Point = tuple[float, float, float]
"""A place, m, world frame."""

Disc = tuple[float, float, float, float]
"""An obstacle: its centre, world frame, and its radius, m."""


class Report(NamedTuple):
    """What comes with an answer.

    Attributes:
        sensed: obstacles that the UGV sensed when it decided.
        reason: of the answer, see `gatekeeper.answer.Reason`; empty if it has not decided.
        words: the same as a sentence.
    """

    sensed: tuple[Disc, ...] = ()
    reason: str = ""
    words: str = ""


Reports = tuple[Report, ...]
"""One entry per UGV."""

Proposals = tuple[Proposal | None, ...]
"""One entry per UGV."""


def answer_to(proposal: Proposal | None, answers: Sequence[float] | Array, robot: int) -> float:
    """The UGV's answer to this very proposal: ACCEPT, REFUSE or SILENT; answers (2n,) flattened."""
    if proposal is None or answers[2 * robot + 1] != proposal.number:
        return SILENT
    return float(answers[2 * robot])


def accepted_proposals(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
    """Per UGV, the proposal in force if the UGV has accepted it, else None."""
    return [p if answer_to(p, answers, i) == ACCEPT else None for i, p in enumerate(proposals)]
