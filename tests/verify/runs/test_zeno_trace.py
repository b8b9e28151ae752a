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


@pytest.mark.parametrize(("bound", "status"), [(4.0, "holds"), (4.0 + 5e-10, "holds"), (4.0 + 2e-9, "refuted")])
def test_zeno_compares_with_the_bound(bound: float, status: str) -> None:
    finding = judge("ZENO-TRACE", with_scenario(refractory(), decision__min_inter_event_s=bound))
    assert finding.status == status
    assert finding.margin == pytest.approx(4.0 - bound, abs=1e-12)


def test_zeno_without_a_gap_says_so() -> None:
    finding = judge("ZENO-TRACE", run_of("d"))
    assert (finding.status, finding.margin) == ("holds", None)
    assert finding.evidence["triggers"]["ugv1"]["count"] == 1
    assert finding.evidence["reason"]
    assert judge("ZENO-TRACE", with_scenario(run_of("d"), decision__min_inter_event_s=0.0)).status == "not_run"
