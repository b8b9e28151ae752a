"""Claims as assertions: what passes, what does not, and what is said then."""

from __future__ import annotations

from dataclasses import replace

import pytest
from builders.scenarios import changed

from airground_drake.base.errors import ScenarioError, UnknownNameError
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load
from airground_drake.testing import ClaimError, NotExercisedWarning, assert_holds, assert_proved
from airground_drake.testing.plugin import Simulations
from airground_drake.verify.claim import Claim, TraceClaim, Verdict
from airground_drake.verify.finding import Finding


class Found(TraceClaim):
    """FOUND: whatever finding it is made with."""

    id = "FOUND"
    statement = "All is well."
    exercised_by = "chances"

    def __init__(self, finding: Finding) -> None:
        self.finding = finding

    def check(self, trace: Trace) -> Finding:
        return self.finding


@pytest.fixture
def stuck(airground_trace: Simulations) -> Trace:
    return airground_trace("minimal", "a")


def said(trace: Trace, *claims: str | TraceClaim, exercised: bool = False) -> str:
    with pytest.raises(ClaimError) as caught:
        assert_holds(trace, *claims, exercised=exercised)
    return str(caught.value)


def test_what_holds_passes(stuck: Trace) -> None:
    assert_holds(stuck, "SAFE-TRACE", "SAFE-HYP", "EXEC", exercised=True)
    assert_holds(stuck, Found(Finding("holds", exercised=1)))


def test_a_refutation_is_told_in_words(stuck: Trace) -> None:
    assert said(stuck, "SAFE-TRACE", "LIVE-GOAL").splitlines() == [
        "LIVE-GOAL is refuted, on run a of minimal (method a, seed 0)",
        "  claim: Every robot ended the run at its target, or standing where the scenario declares that it stalls.",
        "  who: ugv1",
        "  value: tolerance left about where a robot must end: -6.9 m; at least 0 is needed",
        "  seen: condition at its target; point (10, 0, 0) m; final (3, 0, 0) m; distance 7 m",
    ]


def test_who_and_when(stuck: Trace) -> None:
    """The rock must be kept away from by 3 m, it is said afterwards."""
    told = said(replace(stuck, meta=changed(stuck.meta, {"scenario.safe_distance.obstacle_m": 3.0})), "SAFE-TRACE")
    assert "  who: ugv1, rock\n  when: t = 3 s\n" in told
    assert "  value: least distance of a pair less its safe distance: -1 m; at least 0 is needed\n" in told
    assert "safe distance 3 m; min distance 2 m; positions rock (5, 0, 0) m, ugv1 (3, 0, 0) m" in told


@pytest.mark.parametrize(
    ("finding", "told"),
    [
        (Finding("inconclusive", evidence={"gap_m": 0.5}), "is inconclusive: neither established nor refuted"),
        (Finding("error", evidence={"error": "no column"}), "could not be decided"),
        (Finding("not_run", evidence={"reason": "no decision"}), "was not decided"),
    ],
)
def test_what_could_not_be_decided_is_no_pass(stuck: Trace, finding: Finding, told: str) -> None:
    with pytest.raises(ClaimError, match=told) as caught:
        assert_holds(stuck, Found(finding))
    assert [verdict.finding.status for verdict in caught.value.verdicts] == [finding.status]
    assert "  why: " in str(caught.value)


def test_an_exception_in_a_claim_is_no_refutation(stuck: Trace) -> None:
    class Broken(Found):
        def check(self, trace: Trace) -> Finding:
            raise ZeroDivisionError("no robots")

    assert "FOUND could not be decided" in (told := said(stuck, Broken(Finding("holds"))))
    assert "no robots" in told


def test_what_nothing_put_to_the_test(stuck: Trace) -> None:
    with pytest.warns(NotExercisedWarning, match=r"ZENO-TRACE holds, but nothing put it to the test \(0 gaps"):
        assert_holds(stuck, "ZENO-TRACE")
    assert "nothing put it to the test" in said(stuck, "ZENO-TRACE", exercised=True)
    uncounted = Found(Finding("holds"))
    uncounted.exercised_by = ""
    assert_holds(stuck, uncounted)
    assert "does not count what puts it to the test" in said(stuck, uncounted, exercised=True)


def test_without_claims_all_that_say_anything_are_meant(stuck: Trace) -> None:
    with pytest.warns(NotExercisedWarning), pytest.raises(ClaimError) as caught:
        assert_holds(stuck)
    assert [verdict.claim.id for verdict in caught.value.verdicts] == ["LIVE-GOAL"]


def test_a_claim_that_says_nothing_about_the_run_is_no_pass(stuck: Trace) -> None:
    assert said(stuck, "GATE-OPT") == "GATE-OPT: nothing is claimed about run a of minimal (method a, seed 0)"
    with pytest.raises(UnknownNameError, match="unknown claim 'SAFE'"):
        assert_holds(stuck, "SAFE")
    with pytest.raises(TypeError):
        assert_holds(stuck, Found)  # type: ignore[arg-type]  # a class is no claim


def test_proofs() -> None:
    assert_proved("minimal", "SAFE-LEMMA", set={"duration_s": 5})
    assert_proved(load("minimal")[0], "SAFE-LEMMA", set={"duration_s": 5})
    with pytest.raises(ClaimError, match=r"ZENO-PROOF is refuted, for minimal\n  claim: Triggers i < j"):
        assert_proved("minimal", "ZENO-PROOF", set={"decision.min_inter_event_s": 0.0})
    with pytest.raises(ScenarioError, match="from 1e-09"):
        assert_proved(load("minimal")[0], "SAFE-LEMMA", set={"control.period_s": 0.0})


def test_a_verdict_has_one_meaning_for_every_claim() -> None:
    """`told` needs of a claim what every claim has."""
    assert {"id", "statement", "exercised_by"} <= set(Claim.__annotations__)
    assert "claim" in Verdict.__annotations__
