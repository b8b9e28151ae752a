"""ZENO-PROOF."""

from __future__ import annotations

import json

from verify.judging import Judged
from verify.model.trigger.cases import ZENO

from airground_drake.decision.trigger import Trigger
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.engines.smt import solve
from airground_drake.verify.model.trigger import induction
from airground_drake.verify.model.trigger.zeno_proof import ZenoProof


def test_the_shipped_trigger_is_proved(judged: Judged, case_a: Scenario) -> None:
    claim = ZenoProof()
    inputs = claim.inputs(case_a)
    finding = judged(claim)
    assert finding.status == "proved", finding.evidence
    assert inputs["dwell_s"] == inputs["min_inter_event_s"] == case_a.decision.min_inter_event_s
    assert finding.margin is not None
    assert 0.99e-9 < finding.margin < 1e-9
    evidence = finding.evidence
    assert evidence["spacer"] == "an invariant exists"
    assert set(map(tuple, evidence["invariant"].values())) == {("unsat", "unsat")}
    assert {each["status"] for each in evidence["obligations"]} == {"proved"}
    assert json.loads(finding.certificates["relation.json"])["bound_s"] == "1/2"


def test_a_bare_trigger_is_refuted(case_a: Scenario) -> None:
    case_a.decision.trigger = "bare"
    finding = ZenoProof().judge(ZenoProof().inputs(case_a))
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["gap_s"] <= case_a.decision.min_inter_event_s / 2.0
    case_a.decision.min_inter_event_s = 0.0  # no bound to compare with: any is broken
    assert ZenoProof().judge(ZenoProof().inputs(case_a)).status == "refuted"


def test_a_dwell_that_is_too_short_is_refuted() -> None:
    finding = ZenoProof().judge(ZENO | {"min_inter_event_s": 0.4})
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert 0.3 <= finding.counterexample["gap_s"] < 0.4
    broken = [each for each in induction.remarks(Trigger(3.0, 2.0, 0.3), 0.4) if not each.certified()]
    assert [each.name for each in broken] == ["dwell_is_the_bound"]


def test_certificates_are_answered_alike_from_their_text(judged: Judged) -> None:
    files = judged(ZenoProof(), ZENO).certificates
    assert [result.answer for result in solve([files["zeno_horn.smt2"]])] == ["sat"]
    for name in ("initiation", "consecution", "safety"):
        assert solve([files[f"inv_{name}.smt2"]], "cvc5")[0].answer == "unsat"
    weaker = files["inv_consecution.smt2"].replace("(= a l)", "true")  # not inductive without the memory
    assert solve([weaker])[0].answer == "sat"
