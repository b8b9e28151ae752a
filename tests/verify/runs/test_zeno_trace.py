"""ZENO-TRACE."""

from __future__ import annotations

import pytest
from builders.edits import with_scenario
from builders.runs import chattering, refractory, run_of
from verify.judging import counterexample, judge


def test_zeno_refutes_a_bare_trigger_that_chatters() -> None:
    evidence = judge("ZENO-TRACE", chattering()).evidence
    assert evidence["triggers"]["ugv1"]["count"] > evidence["most_triggers_possible"]
    assert 0.0 < counterexample("ZENO-TRACE", chattering())["gap_s"] < 0.5
    assert judge("THR-TRIG", chattering()).status == "holds"


def test_zeno_says_what_is_left_of_the_gap() -> None:
    assert judge("ZENO-TRACE", refractory()).margin == pytest.approx(0.0, abs=1e-12)


def test_zeno_without_a_gap_says_so() -> None:
    finding = judge("ZENO-TRACE", run_of("d"))
    assert (finding.status, finding.margin) == ("holds", None)
    assert finding.evidence["triggers"]["ugv1"]["count"] == 1
    assert finding.evidence["reason"]
    assert judge("ZENO-TRACE", with_scenario(run_of("d"), decision__min_inter_event_s=0.0)).status == "not_run"
