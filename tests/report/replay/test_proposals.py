"""The outcomes of proposals over time."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from airground_drake.report.replay.scene import LINGER_S, sent
from airground_drake.sim.trace import Trace


@pytest.mark.parametrize(
    ("scenario", "name", "spans"),
    [
        ("case_a", "b", [("asked", 14.5, 14.5), ("accepted", 14.5, 16.65)]),  # while it is executed: there is no answer
        ("case_b", "c", [("asked", 10.6, 10.65), ("refused", 10.65, 10.65 + LINGER_S)]),
        (
            "case_b",
            "c_literal",
            [("asked", 13.1, 13.15), ("accepted", 13.15, 14.1), ("refused", 14.1, 14.1 + LINGER_S)],
        ),
    ],
)
def test_outcomes_follow_from_what_became_of_a_proposal(
    run: Callable[..., Trace], scenario: str, name: str, spans: list[tuple[str, float, float]]
) -> None:
    found = sent(run(scenario, name))[-1 if name == "c_literal" else 0].spans
    assert [(span.outcome, span.start_s, span.end_s) for span in found] == [
        (outcome, pytest.approx(start_s, abs=0.1), pytest.approx(end_s, abs=0.1)) for outcome, start_s, end_s in spans
    ]


def test_a_proposal_without_an_answer_is_shown_for_a_while(run: Callable[..., Trace]) -> None:
    trace = run("case_a", "d")
    alone = replace(trace, decisions=trace.decisions.iloc[:0], samples=trace.samples.assign(**{"ugv1.executing": -1}))
    (proposal,) = sent(alone)
    assert [(span.outcome, span.end_s <= span.start_s + LINGER_S) for span in proposal.spans] == [("asked", True)]
