"""The JUnit file."""

import xml.etree.ElementTree as ET

from report.cases import FINE, built, verdict

from airground_drake.report import junit
from airground_drake.report.model import of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace


def test_junit_counts(scenario: Scenario, traces: dict[str, Trace]) -> None:
    bad = verdict("a", "refuted", margin=-1.0, unit="m", counterexample={"bad": "\x00\x1b"})
    idle = [verdict("a", exercised=0), verdict("a", "holds", "exercised", exercised=0)]
    undecided = [verdict("a", status) for status in ("error", "not_run", "inconclusive")]
    root = ET.fromstring(junit.render(of(built(scenario, traces, [FINE[0], FINE[2], bad, *idle, *undecided]))))
    counts = {
        suite.get("name"): [suite.get(key) for key in ("tests", "failures", "errors", "skipped")] for suite in root
    }
    assert counts == {
        "case_a.a": ["7", "3", "1", "2"], "case_a.a_printed": ["1", "0", "0", "0"], "case_a.c": ["1", "0", "1", "0"],
    }  # fmt: skip
    assert [root.get(key) for key in ("tests", "failures", "errors", "skipped")] == ["9", "3", "2", "2"]
    failed = [str(element.get("message")) for element in root.iterfind("*/*/failure")]
    assert failed[0] == "refuted, expected holds, margin -1 m: Every robot keeps its distance"
    assert failed[1].startswith("holds, not tested (0 pairs), expected exercised: ")
