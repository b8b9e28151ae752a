"""Claims that are theorems: proved where Coq has checked them and the scenario meets their hypotheses, else open."""

import json
from typing import Any

import pytest

from airground_drake.base.registry import MODEL_CLAIMS
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.claims import safe_inv
from airground_drake.verify.claims.thr_trig import TriggerLevels, isolation
from airground_drake.verify.model import theorem
from airground_drake.verify.model.theorem import TheoremClaim
from airground_drake.verify.proofs import THEOREMS, Standing

CLAIMS: dict[str, TheoremClaim] = {
    name: claim for name in MODEL_CLAIMS
    if isinstance(claim := MODEL_CLAIMS.make(name, of=ModelClaim), TheoremClaim) and claim.applies(load("case_a"))
}  # fmt: skip
INPUTS = {name: claim.inputs(load("case_a")) for name, claim in CLAIMS.items()}
LAYER = ("SAFE-INV", "SAFE-GATE")


def test_claims_that_are_theorems() -> None:
    assert len(CLAIMS) == 8


@pytest.mark.parametrize("scenario", shipped())
def test_shipped_scenarios_meet_all_hypotheses(scenario: str) -> None:
    loaded = load(scenario)
    for claim in CLAIMS.values():
        inputs = claim.inputs(loaded)
        assert json.loads(json.dumps(inputs, allow_nan=False)) == inputs
        finding = claim.judge(inputs)
        assert finding.status == "proved", (claim.id, finding)
        assert finding.exercised == len(finding.evidence["hypotheses"]) > 0
        assert all(each.holds for each in finding.evidence["hypotheses"])
        assert finding.evidence["theorems"] == {each: THEOREMS[each].statement for each in claim.theorems}
        assert "reason" not in finding.to_json()["evidence"]


@pytest.mark.parametrize("name", CLAIMS)
def test_a_theory_that_coq_has_not_checked_proves_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    unchecked = Standing(False, "not checked: Safety.v differs from its record", {})
    monkeypatch.setattr(theorem, "standing", lambda *_: unchecked)
    finding = CLAIMS[name].judge(INPUTS[name])
    assert finding.status == "inconclusive"
    assert "differs from its record" in finding.to_json()["evidence"]["reason"]


def pair(kind: str, safe_m: float, closing_m_s: float) -> list[dict[str, Any]]:
    return [{"kind": kind, "distance_m": safe_m, "closing_m_s": closing_m_s}]


GAINED = (*LAYER, "SAFE-DIST")


@pytest.mark.parametrize(
    ("names", "change", "status"),
    [
        (["SAFE-INV", "SAFE-GATE"], {"pairs": pair("obstacle", 0.0, 1.0)}, "inconclusive"),
        (GAINED, {"avoidance_gain_1_s": 20.1}, "inconclusive"),
        (GAINED, {"avoidance_gain_1_s": 20.0}, "proved"),
        (GAINED, {"avoidance_gain_1_s": -0.1}, "inconclusive"),
        (LAYER, {"sensing_range_m": 2.25, "pairs": pair("obstacle", 2.0, 5.1)}, "inconclusive"),
        (LAYER, {"sensing_range_m": 2.255, "pairs": pair("obstacle", 2.0, 5.1)}, "proved"),  # 2 + 5.1 * 0.05, decimal
        (["SAFE-INV"], {"avoidance_gain_1_s": 0.0}, "proved"),
        (["SAFE-GATE"], {"intervention_on_top": True}, "inconclusive"),
        (["SAFE-DIST"], {"avoidance_gain_1_s": 0.0}, "inconclusive"),
        (["SAFE-DIST"], {"disturbance_m_s": 3.0}, "inconclusive"),
        (["SAFE-DIST"], {"sensing_range_m": 2.04, "pairs": pair("obstacle", 2.0, 5.1)}, "inconclusive"),
        (["SAFE-DIST"], {"sensing_range_m": 2.0425, "pairs": pair("obstacle", 2.0, 5.1)}, "proved"),  # 1.75 + 5.85 h
        (["LIVE-GATE", "LIVE-WAIT"], {"longest_s": 0.0}, "inconclusive"),
        (["LIVE-GATE", "LIVE-WAIT"], {"period_s": 0.0}, "inconclusive"),
        (["ZENO-PROOF"], {"released_below_m": 3.0}, "proved"),
    ],
)
def test_a_hypothesis_that_fails_leaves_the_claim_open(names: list[str], change: dict[str, Any], status: str) -> None:
    for name in names:
        finding = CLAIMS[name].judge(INPUTS[name] | change)
        assert finding.status == status, finding
        if status == "inconclusive":
            assert finding.evidence["reason"].startswith("a hypothesis fails: ")
            assert finding.margin is not None
            assert finding.margin <= 0.0


@pytest.mark.parametrize(
    ("noise_period_s", "zeta_m", "failing"),
    [(0.15, 3.0, None), (0.06, 3.0, "a whole number"), (0.025, 3.0, "a whole number"), (0.05, 0.0, "above 0")],
)  # 0.15 is 3 * 0.05 in decimals only
def test_isolation_applies_where_noise_changes_at_control_samples(
    noise_period_s: float, zeta_m: float, failing: str | None
) -> None:
    found = isolation(noise_period_s, 0.05, TriggerLevels(zeta_m, 1.0, 0.5))
    assert all(each.holds for each in found["hypotheses"]) == (failing is None)
    assert (failing or "checked by Coq") in found["isolation"]


def test_isolation_of_a_theory_that_coq_has_not_checked_is_doubted(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    unchecked = Standing(False, "not checked", {})
    monkeypatch.setattr(theorem, "standing", lambda *names: asked.extend(names) or unchecked)
    assert isolation(0.05, 0.05, TriggerLevels(3.0, 2.0, 0.5))["isolation"] == "the theorems are not checked"
    assert asked == [name for name in THEOREMS if name.startswith("Isolation.")]


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


def test_numbers_that_follow() -> None:
    found = {name: claim.judge(INPUTS[name]).evidence for name, claim in CLAIMS.items()}
    assert found["ZENO-PROOF"]["most_triggers"] == 61
    assert found["LIVE-WAIT"]["bound_s"] == 5 * (30.0 + 0.05)
    assert found["SAFE-DIST"]["least_distances_m"] == {"obstacle": 1.75, "uav_ugv": 0.5, "ugv_ugv": 1.5}
    scenario = load("case_a", ["uav.radius_m=0.25", "obstacles.obstacle_1.radius_m=0.1"])
    safe = {(each["kind"], each["distance_m"]) for each in CLAIMS["SAFE-INV"].inputs(scenario)["pairs"]}
    assert {("obstacle", 2.35), ("obstacle", 2.0), ("uav_ugv", 1.25)} <= safe  # both radii: the farthest, the nearest


def test_a_disturbance_costs_twice_as_much_between_ugvs_that_may_stand() -> None:
    claim = CLAIMS["SAFE-DIST"]
    known, lossy = (claim.inputs(load("crossing", [f"channel.ugvs.loss={loss}"])) for loss in (0.0, 0.1))
    usual, halved = (claim.judge(inputs | {"disturbance_m_s": 0.1}).evidence for inputs in (known, lossy))
    assert halved["least_distances_m"] == {
        **usual["least_distances_m"],
        "ugv_ugv": pytest.approx(1.0 - 4.0 * 0.1 / 3.0),
    }
