"""The JUnit file."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from report.cases import FINE, built, verdict

from airground_drake.report import junit
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario


def test_junit_counts(scenario: Scenario, traces: dict[str, Trace]) -> None:
    verdicts = [
        FINE[0],
        verdict("a", "refuted", margin=-1.0, unit="m", counterexample={"bad": "\x00\x1b"}),
        verdict("a", "error"),
        verdict("a", "not_run"),
        verdict("a", "inconclusive"),
        verdict("a", exercised=0),
        verdict("a", exercised=2),
        FINE[2],
    ]
    root = ET.fromstring(junit.render(built(scenario, traces, verdicts)))
    assert root.tag == "testsuites"
    assert {key: root.get(key) for key in ("tests", "failures", "errors", "skipped")} == {
        "tests": "9", "failures": "2", "errors": "2", "skipped": "2",
    }  # fmt: skip
    suites = {suite.get("name"): suite for suite in root}
    assert set(suites) == {"case_a.a", "case_a.c", "case_a.a_printed"}
    assert suites["case_a.a"].get("tests") == "7"
    assert [case.get("name") for case in suites["case_a.c"]] == ["run"]
    failure = suites["case_a.a"].find("testcase/failure")
    assert failure is not None
    assert "refuted, expected holds, margin -1 m: Every robot keeps its distance" in str(failure.get("message"))
    assert not suites["case_a.a_printed"].findall("testcase/*")
    skipped = [element.get("message") for element in suites["case_a.a"].findall("testcase/skipped")]
    assert "holds, nothing to check: 0 pairs; Every robot keeps its distance" in skipped


def test_what_had_nothing_to_check_fails_where_something_is_expected(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    root = ET.fromstring(junit.render(built(scenario, traces, [verdict("a", "holds", "exercised", exercised=0)])))
    failure = root.find("testsuite/testcase/failure")
    assert failure is not None
    assert str(failure.get("message")).startswith("holds, nothing to check (0 pairs), expected exercised: Every robot")
