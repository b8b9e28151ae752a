"""How often a claim was put to the test: counted by every claim, 0 where nothing tested it, demanded by scenarios."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builders.runs import run_of
from verify.judging import CLAIMS

from airground_drake.base.statuses import admits_either, meets, outcome
from airground_drake.check import verdicts
from airground_drake.registry import MODEL_CLAIMS, RUN_CLAIMS
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load
from airground_drake.verify import Finding, verify
from airground_drake.verify.__main__ import main
from airground_drake.verify.claim import Claim, TraceClaim, Verdict

Runs = Callable[[str, str], Trace]

IDLE = [
    "duration_s=0.5",
    "obstacles={}",
    "ugvs.ugv1.target_m=[0, 0, 0]",
    "ugvs.ugv1.preset={waypoints_m: [[0, 0, 0], [0.01, 0, 0]], speed_m_s: 0.01}",
    "uav.target_m=[0, 0, 2]",
    "runs={c: {method: c}, d: {method: d}}",
]
"""Nothing to avoid, nothing to trigger, nowhere to go."""


@pytest.fixture(scope="module")
def idle() -> dict[str, Verdict]:
    scenario = load("dwell", IDLE)[0]
    return {verdict.claim.id: verdict for name in scenario.runs for verdict in verify(simulate(scenario, name))}


SAID = ("statement", "formula", "method", "equations", "does_not_establish", "exercised_by")


def test_every_claim_says_what_it_is_and_what_it_counts() -> None:
    for registry in (RUN_CLAIMS, MODEL_CLAIMS):
        for name in registry.own:
            claim = registry.load(name, of=Claim)
            assert all((*(getattr(claim, word).strip() for word in SAID), claim.assumptions, *claim.assumptions)), name


@pytest.mark.parametrize("claim", CLAIMS)
def test_a_run_without_anything_to_check_exercises_no_claim(claim: str, idle: dict[str, Verdict]) -> None:
    """A claim that always says that it was exercised does not pass here."""
    finding = idle[claim].finding
    assert (finding.status, finding.exercised) == ("holds", 0), finding
    assert outcome(finding.status, finding.exercised) == "not_exercised"
    assert idle[claim].as_expected
    assert not replace(idle[claim], expected="exercised").as_expected


@pytest.mark.parametrize("claim", CLAIMS)
def test_a_run_with_several_triggers_and_proposals_exercises_every_claim(claim: str, run: Runs) -> None:
    of = {"GATE-OPT": ("case_b", "c"), "LIVE-PROG": ("contact", "d")}
    (verdict,) = verify(run(*of.get(claim, ("dwell", "d"))), [claim])
    count = verdict.finding.exercised
    assert count
    assert verdict.as_expected
    known = {"ZENO-TRACE": 2, "THR-TRIG": 7, "LIVE-GOAL": 2}
    assert known.get(claim, count) == count


class Counting(TraceClaim):
    """A claim with any finding."""

    id, statement, formula, method, equations = "COUNTING", "s", "f", "m", "e"
    assumptions, does_not_establish = (), "n"

    def __init__(self, finding: Finding, exercised_by: str = "things") -> None:
        self.finding, self.exercised_by = finding, exercised_by

    def check(self, trace: Trace) -> Finding:
        return self.finding


@pytest.mark.parametrize(
    ("finding", "counted", "status"),
    [
        (Finding("holds", exercised=3), "things", "holds"),
        (Finding("holds", exercised=0), "things", "holds"),
        (Finding("holds"), "things", "error"),
        (Finding("not_run"), "things", "not_run"),
        (Finding("holds"), "", "holds"),  # a claim of somebody's own that counts nothing
        (Finding("holds", exercised=-1), "things", "error"),
        (Finding("holds", exercised=True), "things", "error"),
        (Finding("holds", exercised=2.0), "things", "error"),  # type: ignore[arg-type]
    ],
)
def test_a_claim_that_says_what_exercises_it_must_count_it(finding: Finding, counted: str, status: str) -> None:
    assert Counting(finding, counted).judge(run_of("d")).status == status


@pytest.mark.parametrize(
    ("expected", "status", "count", "met"),
    [
        ("exercised", "holds", 1, True),
        ("exercised", "proved", 9, True),
        ("exercised", "holds", 0, False),
        ("exercised", "holds", None, False),
        ("exercised", "refuted", 5, False),
        ("exercised", "inconclusive", 5, False),
        ("exercised or refuted", "refuted", 5, True),
        ("exercised or refuted", "holds", 0, False),
        ("holds", "holds", 0, True),
        ("holds or refuted", "holds", None, True),
    ],
)
def test_exercised_is_established_on_something(expected: str, status: Any, count: int | None, met: bool) -> None:
    assert meets(expected, status, count) is met
    assert Verdict(CLAIMS["COMM"], "d", Finding(status, exercised=count), expected).as_expected is met


def test_an_expectation_that_admits_either_verdict_is_known() -> None:
    either = ("holds or refuted", "exercised or refuted", "refuted or supported or error")
    assert all(map(admits_either, either))
    assert not any(map(admits_either, ("holds", "refuted", "holds or supported", "refuted or error")))
    assert all(verdicts.admits_either(expected) is admits_either(expected) for expected in (*either, "holds"))


def test_the_command_line_says_when_there_was_nothing_to_check(
    report: Callable[[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = report("case_b") / "trace" / "d"
    capsys.readouterr()  # what making the report has printed
    assert main([str(folder), "ZENO-TRACE", "THR-TRIG"]) == 0
    zeno, trigger = capsys.readouterr().out.splitlines()
    assert zeno == "ZENO-TRACE d: holds, nothing to check [0 gaps between consecutive triggers of one UGV]"
    assert trigger.endswith("[2 transitions of the automaton that were due]")


def test_a_report_counts_what_was_not_exercised_apart(report: Callable[[str], Path]) -> None:
    document = json.loads((report("case_b") / "report.json").read_text(encoding="utf-8"))
    overall = document["overall"]
    assert overall["not_exercised"] == [
        *({"id": "ZENO-TRACE", "run": run} for run in ("b", "c", "c_literal", "d")),
        {"id": "THR-CHOICE", "run": ""},  # its threshold is declared
    ]
    assert overall["counts"]["not_exercised"] == 5
    assert overall["counts"]["holds"] == sum(c["status"] == "holds" for c in document["claims"]) - 5
    assert all(claim["exercised"] is not None and claim["exercised_by"] for claim in document["claims"])
