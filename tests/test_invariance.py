"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST: certificates re-done here, the running kernels, and every mutant."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.rounding import unit
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance import disturbed_runs as attacks
from airground_drake.verify.model.avoidance import safe_dist as disturbance
from airground_drake.verify.model.avoidance import safe_inv as invariance
from airground_drake.verify.model.avoidance.conformance import Relation, conformance, loss_of_inequality, relation
from airground_drake.verify.model.avoidance.constants import kinds
from airground_drake.verify.model.avoidance.hostile_inputs import postcondition, safe_states
from airground_drake.verify.model.avoidance.lemma import V, X, ldl
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.avoidance.safe_inv import SafeInv
from airground_drake.verify.model.avoidance.safe_lemma import SafeLemma

CLAIMS: tuple[ModelClaim, ...] = (SafeLemma(), SafeInv(), SafeGate(), SafeDist())
MUTANTS = {**invariance.MUTANTS, **disturbance.DISTURBED}
NUMBERS = st.fractions(min_value=-20, max_value=20, max_denominator=100)
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@pytest.fixture(scope="module")
def inputs() -> dict[str, Any]:
    """Inputs that contain those of every claim here."""
    scenario = load("case_a")[0]
    return SafeDist().inputs(scenario) | SafeGate().inputs(scenario)


@pytest.fixture(scope="module")
def found(inputs: dict[str, Any]) -> dict[str, Finding]:
    return {claim.id: claim.judge(inputs) for claim in CLAIMS}


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.id)
def test_proved(claim: ModelClaim, found: dict[str, Finding]) -> None:
    finding = found[claim.id]
    assert finding.status == "proved", finding.evidence
    assert json.loads(json.dumps(asdict(finding), allow_nan=False)) == asdict(finding)
    assert finding.margin is None or finding.margin >= -1e-9


@pytest.mark.parametrize("name", ["case_a_table1", "case_b", "soft_gate"])
def test_every_shipped_scenario(name: str) -> None:
    scenario = load(name)[0]
    for claim in CLAIMS[1:]:
        given_ = claim.inputs(scenario)
        assert json.loads(json.dumps(given_, allow_nan=False)) == given_
        assert claim.judge(given_).status == "proved"


def test_findings_depend_on_nothing_but_the_inputs(inputs: dict[str, Any], found: dict[str, Finding]) -> None:
    again = SafeGate().judge(json.loads(json.dumps(inputs)))
    assert asdict(again) == asdict(found["SAFE-GATE"])


def test_one_ugv_and_no_obstacle(case_a: Scenario) -> None:
    case_a.obstacles = {}
    case_a.ugvs = {"ugv1": case_a.ugvs["ugv1"]}
    given_ = SafeDist().inputs(case_a) | SafeGate().inputs(case_a)
    assert [kind.name for kind in kinds(given_)] == ["uav_ugv"]
    assert [claim.judge(given_).status for claim in CLAIMS] == ["proved"] * 4


# -------------------------------------------------------------------------------- certificates, without sympy


def evaluate(text: str, point: dict[str, Fraction]) -> Fraction:
    """A polynomial at a point; numbers become fractions, so that '1/20' is exact."""
    return Fraction(eval(re.sub(r"(?<![\w.*])(\d+)(?![\w.])", r"Fraction(\1)", text), {"Fraction": Fraction, **point}))


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


def test_gram_matrix(found: dict[str, Finding]) -> None:
    gram = json.loads(found["SAFE-LEMMA"].certificates["gram.json"])
    matrix, lower = ([[Fraction(e) for e in row] for row in gram[name]] for name in ("gram", "lower"))
    diagonal = [Fraction(e) for e in gram["diagonal"]]
    assert min(diagonal) >= 0
    assert sum(d > 0 for d in diagonal) == 3
    for i in range(9):
        assert lower[i][i] == 1
        assert not any(lower[i][i + 1 :])
        for j in range(9):
            assert matrix[i][j] == sum(lower[i][k] * diagonal[k] * lower[j][k] for k in range(9))
    rng = random.Random(2)
    for _ in range(20):
        point = {name: Fraction(rng.randrange(-1000, 1000), 7) for name in (*X, *V)}
        z = [evaluate(monomial, point) for monomial in gram["monomials"]]
        form = sum(matrix[a][b] * z[a] * z[b] for a in range(9) for b in range(9))
        assert form == evaluate(gram["polynomial"], point)


def test_ldl_refuses_an_indefinite_matrix() -> None:
    for matrix in ([[1, 2], [2, 1]], [[0, 1], [1, 0]], [[-1]]):
        with pytest.raises(ValueError, match="positive semidefinite"):
            ldl([[Fraction(e) for e in row] for row in matrix])


# -------------------------------------------------------------------------------- independent oracles of the statements


@given(POINTS, POINTS, st.fractions(min_value=0, max_value=5, max_denominator=50))
def test_lemma_exactly(x: tuple[Fraction, ...], v: tuple[Fraction, ...], s: Fraction) -> None:
    """Without roots: E >= D + s r exactly if D^2 + s x.v <= 0 or its square is at most D^2 E^2."""
    square = sum(c * c for c in x)
    level = square + s * sum(a * b for a, b in zip(x, v, strict=True))
    end = sum((a + s * b) ** 2 for a, b in zip(x, v, strict=True))
    assert level <= 0 or level**2 <= square * end


@settings(max_examples=60)
@given(st.integers(0, 2**31), st.integers(1, 12), st.sampled_from([0.01, 0.05, 0.2]))
def test_one_step_keeps_the_distance_in_exact_arithmetic(seed: int, count: int, h: float) -> None:
    """Running layer, then exact motion: the least distance falls short of d by no more than the rounding bound."""
    rng = np.random.default_rng(seed)
    away = unit(rng, count)
    reach = 2.0 + rng.choice([0.0, 1e-9, 1.0], count) * rng.random(count)
    position, avoidance = rng.uniform(-20, 20, 3), Avoidance(3.0, h)
    around = Surroundings((position - reach[:, None] * away)[None], np.full((1, count), 2.0), np.ones((1, count)))
    spaces = avoidance.half_spaces(position[None], np.ones((1, 3)), around)
    lower = -away[rng.integers(count)] * 10.0 ** rng.uniform(0, 4)
    v = avoidance.apply(lower[None], spaces)[0]
    velocity = [Fraction(float(c)) for c in v]
    for k in range(count):
        if spaces.bound[0, k] > 0.0:  # inside by rounding
            continue
        x = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(position, around.centre[0, k], strict=True)]
        vv, xv = sum(c * c for c in velocity), sum(a * b for a, b in zip(x, velocity, strict=True))
        s = min(max(-xv / vv, Fraction(0)), Fraction(h)) if vv else Fraction(0)
        least = sum((a + s * b) ** 2 for a, b in zip(x, velocity, strict=True))
        loss = loss_of_inequality(float(reach[k]), float(np.linalg.norm(v)), h)
        assert least >= (2 - Fraction(float(loss)) - Fraction(2, 10**16)) ** 2


def test_the_disturbed_bound_is_tight(inputs: dict[str, Any]) -> None:
    """Pinned to an obstacle by the disturbance alone, the robot approaches d - w/A and no further bound would hold."""
    run = attacks.attack(inputs, attacks.scenes(inputs)[0], "idle")
    assert 0.0 <= run["worst_margin_m"] < 1e-6
    assert run["unmet"] == run["broken"] == 0


def test_disturbed_deficit_follows_the_recursion(inputs: dict[str, Any]) -> None:
    """(1 - (1 - A h)^N) w/A after N periods, as the statement says, on the running layer."""
    gain, h, w, d = inputs["avoidance_gain_1_s"], inputs["period_s"], inputs["disturbance_m_s"], 2.0
    avoidance, x = Avoidance(gain, h), np.array([[d, 0.0, 0.0]])
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), d), np.ones((1, 1)))
    for n in range(1, 40):
        v = avoidance.apply(np.array([[-5.0, 0.0, 0.0]]), avoidance.half_spaces(x, np.ones((1, 3)), around))
        x = x + h * (v - [[w, 0.0, 0.0]])
        assert d - x[0, 0] == pytest.approx((1 - (1 - gain * h) ** n) * w / gain, abs=1e-11)


def test_contradictory_inequalities_are_counted_and_not_covered(found: dict[str, Finding]) -> None:
    """A robot squeezed between another and an obstacle cannot meet both: the claim says nothing there, and says so."""
    rows = {row["scene"]: row for row in found["SAFE-DIST"].evidence["runs"]}
    assert rows["squeezed"]["unmet"] > 0
    assert rows["obstacle"]["unmet"] == rows["ugv_pair"]["unmet"] == 0
    assert all(row["broken"] == 0 for row in rows.values())
    assert found["SAFE-DIST"].where["scene"] != "squeezed"


# -------------------------------------------------------------------------------- running code


def test_conformance(inputs: dict[str, Any]) -> None:
    compared = conformance(inputs)
    assert compared["agrees"]
    assert 0 < compared["unseen"] < compared["points"] / 2
    assert 0.01 < compared["worst_ratio"]["bound"] <= 1.0  # the bound on rounding is not idle either


@pytest.mark.parametrize(
    "mutant",
    [
        lambda D, d, q, A, h: relation(D, d, q, A * (1 + Fraction(1, 10**9)), h),
        lambda D, d, q, A, h: -relation(D, d, q, A, h),
        lambda D, d, q, A, h: relation(D, d, Fraction(1), A, h),
        lambda D, d, q, A, h: relation(D, d, q, A, h * 2),
        lambda D, d, q, A, h: q * A * (d - D),
        lambda D, d, q, A, h: -q * (D - d) / h,
    ],
    ids=["gain", "sign", "share", "period", "always_inside", "always_outside"],
)
def test_conformance_refutes(mutant: Relation, inputs: dict[str, Any]) -> None:
    compared = conformance(inputs, mutant)
    assert not compared["agrees"]
    assert compared["first_difference"] is not None


def test_a_kernel_that_differs_refutes_safe_inv(monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]) -> None:
    right = Avoidance.half_spaces

    def wrong(self: Avoidance, *args: Any) -> Any:
        return right(replace(self, gain=self.gain * 1.001), *args)

    monkeypatch.setattr(Avoidance, "half_spaces", wrong)
    finding = SafeInv().judge(inputs)
    assert finding.status == "refuted"
    assert finding.counterexample is not None


def test_sample_is_what_it_says(inputs: dict[str, Any]) -> None:
    states = safe_states(inputs, 2400)
    reach = np.linalg.norm(states.position[:, None] - states.around.centre, axis=-1)
    seen = reach <= inputs["sensing_range_m"]
    excess = (reach - states.around.distance)[seen]
    assert excess.min() >= 0.0
    assert (excess <= 1e-14).mean() > 0.2
    assert set(seen.sum(axis=1).tolist()) >= set(range(1, 13))
    speed = np.linalg.norm(states.lower, axis=1)
    assert speed.max() > 1e5
    assert speed.min() < 1e-2


def test_layer_meets_every_inequality_as_floats(inputs: dict[str, Any]) -> None:
    sampled = postcondition(inputs, 2400)
    assert sampled["met"]
    assert sampled["missed"] == 0
    assert sampled["worst_loss_over_rounding"] <= 1.0
    assert sampled["largest_gain_in_speed"] <= 1.0 + 1e-9


def test_what_is_not_finite_asks_for_nothing(found: dict[str, Finding]) -> None:
    answers = found["SAFE-GATE"].evidence["non_finite"]
    assert answers == dict.fromkeys(("nan", "infinity", "1e300"), "finite, inequality met")


def test_method_d_is_read_from_the_running_diagram(inputs: dict[str, Any]) -> None:
    assert inputs["method_d"] == {"intervention_on_top": False, "compositions": ["augmented"]}


# -------------------------------------------------------------------------------- mutants


@pytest.mark.parametrize("name", MUTANTS)
def test_mutant_is_refuted(name: str, inputs: dict[str, Any]) -> None:
    finding = MUTANTS[name](inputs)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample.get("exactly_checked", True)
    json.dumps(asdict(finding), allow_nan=False)


@pytest.mark.parametrize(
    "name",
    [n for n in invariance.MUTANTS if n.startswith("SAFE-INV") and "gain" not in n]
    + ["SAFE-GATE: intervention on top"],
)
def test_mutant_comes_too_close_on_the_running_code(name: str, inputs: dict[str, Any]) -> None:
    counterexample = MUTANTS[name](inputs).counterexample
    assert counterexample is not None
    replay = counterexample["replay"]
    least = replay.get("least_distances_m", [replay.get("least_distance_m")])
    assert min(least) < replay["safe_distance_m"] - 0.05


def test_overshoot_on_the_running_code(inputs: dict[str, Any]) -> None:
    counterexample = MUTANTS["SAFE-INV: gain too large, A h = 1.8"](inputs).counterexample
    assert counterexample is not None
    assert counterexample["replay"]["end_m"][0][0] > counterexample["replay"]["safe_distance_m"] + 0.1


@pytest.mark.parametrize("name", disturbance.DISTURBED)
def test_disturbed_mutant_breaks_the_bound_on_the_running_code(name: str, inputs: dict[str, Any]) -> None:
    counterexample = MUTANTS[name](inputs).counterexample
    assert counterexample is not None
    replay = counterexample["replay"]
    assert replay["worst_margin_m"] < -0.01
    assert replay["broken"] > 0


@pytest.mark.parametrize(
    ("claim", "change"),
    [
        (SafeInv(), lambda i: i | {"sensing_range_m": 2.1}),
        (SafeInv(), lambda i: i | {"avoidance_gain_1_s": 30.0}),
        (SafeDist(), lambda i: i | {"avoidance_gain_1_s": 30.0}),
        (SafeDist(), lambda i: i | {"disturbance_m_s": 4.0}),
        (SafeGate(), lambda i: i | {"method_d": {"intervention_on_top": False, "compositions": ["recursion_listed"]}}),
    ],
    ids=["range", "gain", "gain_disturbed", "disturbance", "recursion"],
)
def test_broken_constants_are_refuted(
    claim: ModelClaim, change: Callable[[dict[str, Any]], dict[str, Any]], inputs: dict[str, Any]
) -> None:
    finding = claim.judge(change(inputs))
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None


def test_without_gain_nothing_is_restored(case_a: Scenario) -> None:
    case_a.control.avoidance_gain_1_s = 0.0
    assert SafeDist().judge(SafeDist().inputs(case_a)).status == "inconclusive"
    assert SafeInv().judge(SafeInv().inputs(case_a)).status == "proved"
