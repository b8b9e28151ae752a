"""Claims as assertions: what passes, what fails, and what is said then."""

from dataclasses import replace

import pytest
from builders.scenarios import changed

from airground_drake.base.errors import ScenarioError, UnknownNameError
from airground_drake.scenario.load import load
from airground_drake.sim.trace import Trace
from airground_drake.study.testing import ClaimError, NotExercisedWarning, assert_holds, assert_proved
from airground_drake.study.testing.plugin import Simulations
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding


class Found(TraceClaim):
    id = "FOUND"
    statement = "All is well."

    def __init__(self, finding: Finding, exercised_by: str = "chances") -> None:
        self.finding, self.exercised_by = finding, exercised_by

    def check(self, trace: Trace) -> Finding:
        if self.finding.status == "error":
            raise ZeroDivisionError("no robots")
        return self.finding


@pytest.fixture
def stuck(airground_trace: Simulations) -> Trace:
    return airground_trace("minimal", "a")


def said(trace: Trace, *claims: str | TraceClaim, exercised: bool = False) -> str:
    with pytest.raises(ClaimError) as caught:
        assert_holds(trace, *claims, exercised=exercised)
    return str(caught.value)


def test_claims_that_hold_pass(stuck: Trace) -> None:
    assert_holds(stuck, "SAFE-TRACE", "SAFE-HYP", exercised=True)
    assert_holds(stuck, Found(Finding("holds", exercised=1)))


def test_a_refutation_says_who_when_and_what_was_needed(stuck: Trace) -> None:
    wider = replace(stuck, meta=changed(stuck.meta, {"scenario.safe_distance.obstacle_m": 3.0}))
    told = said(wider, "SAFE-TRACE", "LIVE-GOAL")
    assert "LIVE-GOAL is refuted, on run a of minimal (method a, seed 0)\n  claim: Every robot ended" in told
    assert "  value: tolerance left about where a robot must end: \N{MINUS SIGN}6.9 m; at least 0 is needed\n" in told
    assert "  found: ugv1 and rock at 2.000 m, 3 m required, 3.000 s\n" in told
    assert "safe distance 3 m; min distance 2 m; " in told


@pytest.mark.parametrize("status", ["inconclusive", "error", "not_run"])
def test_an_undecided_claim_is_no_pass(stuck: Trace, status: str) -> None:
    with pytest.raises(ClaimError, match=r"FOUND (is inconclusive|could not be decided|was not decided)") as caught:
        assert_holds(stuck, Found(Finding(status, evidence={"reason": "no robots"})))  # type: ignore[arg-type]
    assert [verdict.status for verdict in caught.value.verdicts] == [status]
    assert "no robots" in str(caught.value)


def test_a_claim_that_nothing_tested_is_a_warning_or_fails(stuck: Trace) -> None:
    with pytest.warns(NotExercisedWarning, match=r"ZENO-TRACE holds, but nothing tested it \(0 gaps"):
        assert_holds(stuck, "ZENO-TRACE")
    assert "nothing tested it" in said(stuck, "ZENO-TRACE", exercised=True)
    uncounted = Found(Finding("holds"), exercised_by="")
    assert_holds(stuck, uncounted)
    assert "does not count what tests it" in said(stuck, uncounted, exercised=True)


def test_without_claims_all_about_the_run_are_meant(stuck: Trace) -> None:
    with pytest.warns(NotExercisedWarning), pytest.raises(ClaimError) as caught:
        assert_holds(stuck)
    assert [verdict.claim.id for verdict in caught.value.verdicts] == ["LIVE-GOAL"]


def test_a_claim_that_says_nothing_about_the_run_is_no_pass(stuck: Trace) -> None:
    assert said(stuck, "GATE-PLAN") == "GATE-PLAN: nothing is claimed about run a of minimal (method a, seed 0)"
    with pytest.raises(UnknownNameError, match="unknown claim 'SAFE'"):
        assert_holds(stuck, "SAFE")


def test_claims_about_the_model() -> None:
    assert_proved(load("minimal"), "SAFE-INV", set={"duration_s": 5})
    with pytest.raises(ClaimError, match=r"ZENO-PROOF is refuted, for minimal\n  claim: Triggers i < j"):
        assert_proved("minimal", "ZENO-PROOF", set={"decision.min_inter_event_s": 0.0})
    with pytest.raises(ScenarioError, match="from 1e-09"):
        assert_proved(load("minimal"), "SAFE-INV", set={"control.period_s": 0.0})
