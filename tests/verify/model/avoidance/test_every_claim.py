"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST: proved, and their certificates re-done here without sympy."""

from __future__ import annotations

import json
import random
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import pytest
from verify.judging import Judged
from verify.model.avoidance.cases import CLAIMS, evaluate

from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.constants import kinds
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.id)
def test_proved(claim: ModelClaim, found: dict[str, Finding]) -> None:
    finding = found[claim.id]
    assert finding.status == "proved", finding.evidence
    assert json.loads(json.dumps(asdict(finding), allow_nan=False)) == asdict(finding)
    assert finding.margin is None or finding.margin >= -1e-9


@pytest.mark.parametrize("name", ["case_a_table1", "case_b", "soft_gate"])
def test_every_shipped_scenario(name: str, judged: Judged) -> None:
    scenario = load(name)[0]
    for claim in CLAIMS[1:]:
        given_ = claim.inputs(scenario)
        assert json.loads(json.dumps(given_, allow_nan=False)) == given_
        assert judged(claim, given_).status == "proved"


def test_one_ugv_and_no_obstacle(case_a: Scenario) -> None:
    case_a.obstacles = {}
    case_a.ugvs = {"ugv1": case_a.ugvs["ugv1"]}
    case_a.reproduction = case_a.choices = []
    given_ = SafeDist().inputs(case_a) | SafeGate().inputs(case_a)
    assert [kind.name for kind in kinds(given_)] == ["uav_ugv"]
    assert [claim.judge(given_).status for claim in CLAIMS] == ["proved"] * 4


def identity_holds(obligation: dict[str, Any], point: dict[str, Fraction]) -> bool:
    given_ = {**obligation["hypotheses"], **obligation["strict"]}

    def total(terms: list[dict[str, Any]]) -> Fraction:
        value = Fraction(0)
        for term in terms:
            product = Fraction(term["coefficient"]) * evaluate(term["square"], point) ** 2
            for factor in term["factors"]:
                product *= evaluate(given_[factor], point)
            value += product
        return value

    left = total(obligation["multiplier"]) if obligation["multiplier"] else Fraction(1)
    right = total(obligation["certificate"])
    for name, multiplier in obligation["equation_multipliers"].items():
        right += evaluate(multiplier, point) * evaluate(obligation["equations"][name], point)
    return left * evaluate(obligation["goal"], point) == right


@pytest.mark.parametrize("name", [claim.id for claim in CLAIMS])
def test_certificates_hold_at_random_points(name: str, found: dict[str, Finding]) -> None:
    """Degree at most 6 and 20 points from a set of 10^6 each: a false identity passes with probability < 1e-100."""
    rng = random.Random(1)
    certificates = found[name].certificates
    obligations = json.loads(certificates["obligations.json"])
    assert len({o["name"] for o in obligations}) == len(obligations)
    for obligation in obligations:
        assert f"{obligation['name']}.smt2" in certificates
        for _ in range(20):
            point = {v: Fraction(rng.randrange(-(10**6), 10**6), 997) for v in obligation["variables"]}
            assert identity_holds(obligation, point), obligation["name"]
