"""Claims that are theorems: proved where Coq has checked them and the scenario meets their hypotheses, else open."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import pytest

from airground_drake.proofs import THEOREMS, Standing
from airground_drake.registry import MODEL_CLAIMS
from airground_drake.scenarios.load import load, shipped
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.model import safe_inv, theorem
from airground_drake.verify.model.theorem import TheoremClaim

CLAIMS: dict[str, TheoremClaim] = {
    name: claim for name in MODEL_CLAIMS if isinstance(claim := MODEL_CLAIMS.make(name, of=ModelClaim), TheoremClaim)
}
CASE_A = load("case_a")[0]
INPUTS = {name: claim.inputs(CASE_A) for name, claim in CLAIMS.items()}
LAYER = ("SAFE-INV", "SAFE-GATE")


def test_these_claims_are_theorems() -> None:
    assert {
        "SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "LIVE-GATE", "LIVE-WAIT", "THR-ISO",
        "THR-ROOT", "THR-OPT",
    } <= set(CLAIMS)  # fmt: skip


@pytest.mark.parametrize("name", CLAIMS)
def test_theorems_and_claims_name_each_other(name: str) -> None:
    named = CLAIMS[name].theorems
    assert named
    assert set(named) <= set(THEOREMS)
    assert any(name in THEOREMS[each].checked_where for each in named)


@pytest.mark.parametrize("scenario", shipped())
def test_shipped_scenarios_meet_all_hypotheses(scenario: str) -> None:
    given = load(scenario)[0]
    for claim in CLAIMS.values():
        inputs = claim.inputs(given)
        assert json.loads(json.dumps(inputs, allow_nan=False)) == inputs
        finding = claim.judge(inputs)
        assert finding.status == "proved", (claim.id, finding)
        assert finding.exercised == len(finding.evidence["hypotheses"]) > 0
        assert all(each["holds"] for each in finding.evidence["hypotheses"])
        assert finding.evidence["theorems"] == {each: THEOREMS[each].statement for each in claim.theorems}
        assert json.loads(json.dumps(asdict(finding), allow_nan=False)) == asdict(finding)


@pytest.mark.parametrize("name", CLAIMS)
def test_a_theory_that_coq_has_not_checked_proves_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    unchecked = Standing(False, "not checked: Safety.v differs from its record", {})
    monkeypatch.setattr(theorem, "standing", lambda *_: unchecked)
    finding = CLAIMS[name].judge(INPUTS[name])
    assert finding.status == "inconclusive"
    assert "differs from its record" in finding.evidence["reason"]


def pair(kind: str, safe_m: float, closing_m_s: float) -> list[dict[str, Any]]:
    return [{"kind": kind, "safe_m": safe_m, "closing_m_s": closing_m_s}]


BROKEN: list[tuple[str, dict[str, Any]]] = [
    ("SAFE-LEMMA", {"pairs": pair("obstacle", 0.0, 1.0)}),
    *((name, {"avoidance_gain_1_s": 20.1}) for name in (*LAYER, "SAFE-DIST")),
    *((name, {"avoidance_gain_1_s": -0.1}) for name in (*LAYER, "SAFE-DIST")),
    *((name, {"sensing_range_m": 2.25, "pairs": pair("obstacle", 2.0, 5.1)}) for name in LAYER),
    ("SAFE-GATE", {"intervention_on_top": True}),
    ("SAFE-DIST", {"avoidance_gain_1_s": 0.0}),
    ("SAFE-DIST", {"disturbance_m_s": 3.0}),
    ("LIVE-GATE", {"longest_s": 0.0}),
    ("LIVE-WAIT", {"longest_s": 0.0}),
    ("LIVE-WAIT", {"period_s": 0.0}),
    ("THR-ISO", {"noise_period_s": 0.06}),
    ("THR-ISO", {"noise_period_s": 0.0}),
]


@pytest.mark.parametrize(("name", "change"), BROKEN, ids=[f"{name}-{next(iter(change))}" for name, change in BROKEN])
def test_a_hypothesis_that_fails_leaves_the_claim_open(name: str, change: dict[str, Any]) -> None:
    finding = CLAIMS[name].judge(INPUTS[name] | change)
    assert finding.status == "inconclusive", finding
    assert finding.evidence["reason"].startswith("a hypothesis fails: ")
    assert finding.margin is not None
    assert finding.margin <= 0.0


@pytest.mark.parametrize(
    ("name", "change"),
    [
        *((name, {"avoidance_gain_1_s": 20.0}) for name in (*LAYER, "SAFE-DIST")),
        *((name, {"sensing_range_m": 2.255, "pairs": pair("obstacle", 2.0, 5.1)}) for name in LAYER),
        ("SAFE-INV", {"avoidance_gain_1_s": 0.0}),
        ("ZENO-PROOF", {"released_below_m": 3.0}),
        ("THR-ISO", {"noise_period_s": 0.15}),
    ],
)
def test_hypotheses_hold_up_to_their_limits(name: str, change: dict[str, Any]) -> None:
    """In decimals: 3 * 0.05 is 0.15, and 2 + 5.1 * 0.05 is 2.255."""
    assert CLAIMS[name].judge(INPUTS[name] | change).status == "proved"


def test_shares_that_do_not_add_up_leave_the_claim_open(monkeypatch: pytest.MonkeyPatch) -> None:
    half = safe_inv.SHARES["ugv_ugv"]
    monkeypatch.setitem(safe_inv.SHARES, "ugv_ugv", (half[0] * 9 / 10, half[1]))
    assert CLAIMS["SAFE-INV"].judge(INPUTS["SAFE-INV"]).status == "inconclusive"


@pytest.mark.parametrize("change", [{"dwell_s": 0.0, "released_below_m": 3.0}, {"dwell_s": 0.0}, {"dwell_s": 0.4}])
def test_a_trigger_without_the_dwell_is_refuted_by_two_triggers(change: dict[str, Any]) -> None:
    finding = CLAIMS["ZENO-PROOF"].judge(INPUTS["ZENO-PROOF"] | change)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    times = [row["t_s"] for row in finding.counterexample["run"] if row["trigger"]]
    assert times[1] - times[0] == pytest.approx(finding.counterexample["gap_s"])
    assert finding.counterexample["gap_s"] < 0.5
    assert finding.margin is not None
    assert finding.margin < 0.0


def test_bodies_have_the_distances_of_their_radii() -> None:
    scenario = load("case_a", ["uav.radius_m=0.25", "obstacles.obstacle_1.radius_m=0.1"])[0]
    pairs = CLAIMS["SAFE-INV"].inputs(scenario)["pairs"]
    assert max(each["safe_m"] for each in pairs if each["kind"] == "obstacle") == 2.35
    assert max(each["safe_m"] for each in pairs if each["kind"] == "uav_ugv") == 1.25


def test_numbers_that_follow() -> None:
    found = {name: claim.judge(INPUTS[name]).evidence for name, claim in CLAIMS.items()}
    assert found["ZENO-PROOF"]["most_triggers"] == 61
    assert found["LIVE-WAIT"]["bound_s"] == 5 * (30.0 + 0.05)
    assert found["SAFE-DIST"]["least_distances_m"] == {"obstacle": 1.75, "uav_ugv": 0.5, "ugv_ugv": 1.5}
