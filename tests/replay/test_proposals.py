"""What became of proposals, and when."""

from __future__ import annotations

from replay.conftest import with_proposals

from airground_drake.replay.proposals import LINGER_S, Span, sent
from airground_drake.run.trace import Trace


def test_refused_and_accepted(trace: Trace) -> None:
    first, second = sent(trace)
    assert first.spans == (Span(12.0, 12.1, "asked"), Span(12.1, 12.1 + LINGER_S, "refused"))
    assert second.spans == (Span(14.5, 14.6, "asked"), Span(14.6, 16.9, "accepted"))
    assert first.path.shape == (4, 3)


def test_a_decision_that_is_reversed(trace: Trace) -> None:
    changed = with_proposals(trace, [2.0], [(2.1, 2.0, "accept"), (3.0, 2.0, "refuse"), (3.1, 2.0, "refuse")])
    (proposal,) = sent(changed)
    assert [span.outcome for span in proposal.spans] == ["asked", "accepted", "refused"]
    assert proposal.spans[1] == Span(2.1, 3.0, "accepted")


def test_the_next_one_takes_its_place(trace: Trace) -> None:
    changed = with_proposals(trace, [2.0, 2.5], [(2.1, 2.0, "refuse"), (2.6, 2.5, "refuse")])
    assert sent(changed)[0].spans[-1] == Span(2.1, 2.5, "refused")


def test_without_a_gatekeeper_it_stands_while_it_is_carried_out(trace: Trace) -> None:
    (proposal,) = sent(with_proposals(trace, [14.5], []))
    asked, accepted = proposal.spans
    assert (asked.outcome, accepted.outcome) == ("asked", "accepted")
    assert 14.5 < accepted.start_s <= 14.6 + 1e-9
    assert 16.9 - 1e-9 <= accepted.end_s <= 17.0


def test_one_that_nobody_answers(trace: Trace) -> None:
    (proposal,) = sent(with_proposals(trace, [20.0], []))
    assert proposal.spans == (Span(20.0, 20.0 + LINGER_S, "asked"),)


def test_none(trace: Trace) -> None:
    assert sent(with_proposals(trace, [], [])) == ()
