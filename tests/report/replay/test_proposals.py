"""The outcomes of proposals over time."""

from __future__ import annotations

import pytest
from report.replay.conftest import with_proposals

from airground_drake.report.replay.proposals import LINGER_S, Span, sent
from airground_drake.sim.trace import Trace

CASES = {
    "refused, and accepted": (
        [12.0, 14.5], [(12.1, 12.0, "refuse"), (14.6, 14.5, "accept"), (16.9, 14.5, "accept")],
        [[(12.0, 12.1, "asked"), (12.1, 12.1 + LINGER_S, "refused")],
         [(14.5, 14.6, "asked"), (14.6, 16.9, "accepted")]],
    ),
    "reversed": (
        [2.0], [(2.1, 2.0, "accept"), (3.0, 2.0, "refuse"), (3.1, 2.0, "refuse")],
        [[(2.0, 2.1, "asked"), (2.1, 3.0, "accepted"), (3.0, 3.0 + LINGER_S, "refused")]],
    ),
    "replaced": (
        [2.0, 2.5], [(2.1, 2.0, "refuse"), (2.6, 2.5, "refuse")],
        [[(2.0, 2.1, "asked"), (2.1, 2.5, "refused")], [(2.5, 2.6, "asked"), (2.6, 2.6 + LINGER_S, "refused")]],
    ),
    "not answered": ([20.0], [], [[(20.0, 20.0 + LINGER_S, "asked")]]),
    "none": ([], [], []),
}  # fmt: skip
"""Times of proposals, decisions on them, and the outcomes that follow."""


@pytest.mark.parametrize("name", CASES)
def test_outcomes_follow_from_decisions(trace: Trace, name: str) -> None:
    issued, decisions, outcomes = CASES[name]
    found = sent(with_proposals(trace, issued, decisions))
    assert [each.spans for each in found] == [tuple(Span(*span) for span in spans) for spans in outcomes]


def test_without_a_gatekeeper_a_proposal_is_accepted_while_it_is_executed(trace: Trace) -> None:
    (proposal,) = sent(with_proposals(trace, [14.5], []))
    asked, accepted = proposal.spans
    assert (asked.outcome, accepted.outcome) == ("asked", "accepted")
    assert 14.5 < accepted.start_s <= 14.6 + 1e-9
    assert 16.9 - 1e-9 <= accepted.end_s <= 17.0
