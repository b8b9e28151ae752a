"""The outcomes of proposals over time."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from airground_drake.report.replay.scene import LINGER_S, sent
from airground_drake.sim.trace import Trace


def test_outcomes_follow_from_what_became_of_a_proposal(run: Callable[..., Trace]) -> None:
    found = sent(run("case_b", "c_literal"))[-1].spans
    assert [(span.outcome, span.start_s, span.end_s) for span in found] == [
        (outcome, pytest.approx(start_s, abs=0.1), pytest.approx(end_s, abs=0.1))
        for outcome, start_s, end_s in (
            ("asked", 13.1, 13.15), ("accepted", 13.15, 14.1), ("refused", 14.1, 14.1 + LINGER_S),
        )
    ]  # fmt: skip


def test_a_proposal_without_an_answer_is_shown_for_a_while(run: Callable[..., Trace]) -> None:
    trace = run("case_a", "d")
    alone = replace(trace, decisions=trace.decisions.iloc[:0], samples=trace.samples.assign(**{"ugv1.executing": -1}))
    (proposal,) = sent(alone)
    assert [(span.outcome, span.end_s <= span.start_s + LINGER_S) for span in proposal.spans] == [("asked", True)]
