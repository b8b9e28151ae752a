"""THR-ROOT, THR-OPT and THR-DDM: verdicts, mutants, certificates checked with fractions only, independent oracles."""

from __future__ import annotations

import ast
import json
import math
import operator
import sys
from dataclasses import replace
from fractions import Fraction
from functools import reduce
from itertools import product
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from airground_drake.decision.bayes import bayes_risk, decision_time, error_rate, optimal_threshold
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.engines.ball_arithmetic import Sign, conclude, enclose, evaluate
from airground_drake.verify.engines.smt import Result
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold import first_passages as passages
from airground_drake.verify.model.threshold import thr_ddm as ddm
from airground_drake.verify.model.threshold import thr_root as threshold
from airground_drake.verify.model.threshold.constants import Constants
from airground_drake.verify.model.threshold.first_passages import Experiment
from airground_drake.verify.model.threshold.thr_ddm import ThrDdm
from airground_drake.verify.model.threshold.thr_opt import ThrOpt
from airground_drake.verify.model.threshold.thr_root import ThrRoot

TABLE_1: dict[str, Any] = ThrRoot().inputs(load("case_a")[0])
_KEYS = ("rule", "drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2", "zeta_m")
OTHERS: dict[str, dict[str, Any]] = {
    "audit": dict(zip(_KEYS, ("bayes", 1.0, 1.0, 0.5, 1.0, optimal_threshold(1.0, 1.0, 0.5, 1.0)), strict=True)),
    "slow and noisy": dict(zip(_KEYS, ("fixed", 0.2, 5.0, 0.7, 0.3, 2.0), strict=True)),
    "fast and quiet": dict(zip(_KEYS, ("fixed", 5.0, 0.2, 0.5, 9.0, 0.3), strict=True)),
    "equal costs": dict(zip(_KEYS, ("fixed", 1.5, 0.7, 2.0, 2.0, 1.0), strict=True)),
}
INPUTS = {"table 1": TABLE_1, **OTHERS}


# --- a checker of `statements.json` that needs fractions only ---------------------------------------------------------


def exp_bounds(x: Fraction) -> tuple[Fraction, Fraction]:
    """Rational bounds of exp(x): Taylor's series at x/n, |x/n| <= 1/2, with its remainder, to the power n."""
    n = max(1, math.ceil(2 * abs(x)))
    total = sum(((x / n) ** j / math.factorial(j) for j in range(25)), Fraction(0))
    rest = 2 * abs(x / n) ** 25 / math.factorial(25)  # exp(1/2) < 2 times the first term left out
    return (total - rest) ** n, (total + rest) ** n


def value(node: Any, names: dict[str, Any], ops: dict[Any, Any]) -> Any:
    match node:
        case ast.BinOp(base, ast.Pow(), ast.Constant(power)):
            return reduce(ops[ast.Mult], [value(base, names, ops)] * power)
        case ast.BinOp(left, op, right):
            return ops[type(op)](value(left, names, ops), value(right, names, ops))
        case ast.UnaryOp(ast.USub(), operand):
            return ops[ast.Sub](ops[int](0), value(operand, names, ops))
        case ast.Call(ast.Name("exp"), [argument]):
            return ops[exp_bounds](value(argument, names, ops))
    return names[node.id] if isinstance(node, ast.Name) else ops[int](node.value)


def ends(op: Any) -> Any:
    return lambda a, b: (min(values := [op(x, y) for x in a for y in b]), max(values))


INTERVALS = {
    ast.Add: ends(operator.add),
    ast.Sub: ends(operator.sub),
    ast.Mult: ends(operator.mul),
    ast.Div: lambda a, b: ends(operator.truediv)(a, b) if b[0] * b[1] > 0 else (-math.inf, math.inf),
    int: lambda n: (Fraction(n), Fraction(n)),
    exp_bounds: lambda a: (exp_bounds(a[0])[0], exp_bounds(a[1])[1]),
}
DUALS = {  # a number and its derivative
    ast.Add: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    ast.Sub: lambda a, b: (a[0] - b[0], a[1] - b[1]),
    ast.Mult: lambda a, b: (a[0] * b[0], a[0] * b[1] + a[1] * b[0]),
    ast.Div: lambda a, b: (a[0] / b[0], (a[1] * b[0] - a[0] * b[1]) / b[0] ** 2),
    int: lambda n: (Fraction(n), Fraction(0)),
}


def true(statement: dict[str, Any]) -> bool:
    keys = ("expression",) if statement["kind"] == "sign" else ("function", "derivative")
    trees = [ast.parse(statement[key], mode="eval").body for key in keys]
    if statement["kind"] == "sign":
        low, high = value(trees[0], {k: (Fraction(x),) * 2 for k, x in statement["values"].items()}, INTERVALS)
        return bool(high < 0 if statement["sign"] == "<" else low > 0)
    assert statement["rates"] == {"u": "1", "q": "q"}
    for point in product(*(range(2, 3 + degree) for degree in statement["degree"].values())):
        at = dict(zip(statement["degree"], map(Fraction, point), strict=True))
        dual = {name: (x, {"u": Fraction(1), "q": x}.get(name, Fraction(0))) for name, x in at.items()}
        if value(trees[0], dual, DUALS)[1] != value(trees[1], dual, DUALS)[0]:
            return False
    return True


def accepts(certificate: dict[str, Any], inputs: dict[str, Any]) -> bool:
    """Whether the certificate proves THR-ROOT for these inputs."""
    drift, noise, c1, c2 = (Fraction(repr(inputs[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    statements = {statement["name"]: statement for statement in certificate["statements"]}
    (low, high), zeta = ([Fraction(x) for x in certificate["enclosures"][name]] for name in ("u", "zeta_m"))
    for name, end, sign in (("root_below", low, "<"), ("root_above", high, ">")):
        has = statements[name]
        if has["expression"] != "k*(((exp(u)-exp(-u))/2)+u)-r" or has["sign"] != sign or not true(has):
            return False
        wanted = {"k": noise**2 / drift**2, "r": c2 / c1, "u": end}
        if {key: Fraction(x) for key, x in has["values"].items()} != wanted:
            return False
    narrow = 0 < low < high <= low * (1 + Fraction(1, 10**12))
    return narrow and zeta == [u * noise**2 / (2 * drift) for u in (low, high)] and true(statements["increasing"])


# --- THR-ROOT and THR-OPT ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found() -> dict[str, tuple[Finding, Finding]]:
    return {name: (ThrRoot().check(inputs), ThrOpt().check(inputs)) for name, inputs in INPUTS.items()}


@pytest.mark.parametrize("name", INPUTS)
def test_root_and_optimum_are_proved(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    root, optimum = found[name]
    assert root.status == "proved", root
    assert root.evidence["cvc5_on_two_roots"] == "unsat"
    assert root.margin is not None
    assert root.margin > 0.0
    assert optimum.status == "proved", optimum
    assert (optimum.margin is None) == (name == "equal costs")
    assert optimum.margin is None or optimum.margin > 0.0


@pytest.mark.parametrize("scenario", ["case_a", "case_a_table1", "case_b", "soft_gate"])
def test_shipped_scenarios(scenario: str) -> None:
    for claim in (ThrRoot(), ThrOpt()):
        assert claim.judge(claim.inputs(load(scenario)[0])).status == "proved"


def test_inputs_name_the_threshold_in_force(case_a: Scenario) -> None:
    assert ThrRoot().inputs(case_a)["zeta_m"] == 3.0
    case_a.decision.threshold.rule = "bayes"
    inputs = ThrOpt().inputs(case_a)
    assert inputs["zeta_m"] == optimal_threshold(6.05, 10.0, 0.5, 1.0)
    assert ThrRoot().check(inputs).status == "proved"


def test_a_threshold_in_force_that_is_not_the_root_is_refuted() -> None:
    wrong = {**OTHERS["audit"], "zeta_m": OTHERS["audit"]["zeta_m"] * (1.0 + 1e-9)}
    finding = ThrRoot().check({**wrong, "rule": "fixed"})
    assert finding.status == "proved"  # a fixed threshold need not be the root
    assert ThrRoot().check(wrong).status == "refuted"


@pytest.mark.parametrize("name", INPUTS)
def test_enclosures_contain_roots_found_by_mpmath(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    inputs = INPUTS[name]
    certificate = json.loads(found[name][1].certificates["statements.json"])
    with mpmath.workdps(40):
        a, s, c1, c2 = (mpmath.mpf(repr(inputs[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
        for key, ratio in (("zeta_m", c2 / c1), ("printed_zeta_m", c1 / c2)):
            if key not in certificate["enclosures"]:
                assert name == "equal costs"
                continue
            low, high = (Fraction(x) for x in certificate["enclosures"][key])
            root = mpmath.findroot(
                lambda z, ratio=ratio: s**2 / a**2 * mpmath.sinh(2 * z * a / s**2) + 2 * z / a - ratio,
                (mpmath.mpf(float(low)), mpmath.mpf(float(high) * 1.001)),
            )
            assert mpmath.mpf(low.numerator) / low.denominator < root < mpmath.mpf(high.numerator) / high.denominator


@settings(max_examples=40)
@given(*[st.floats(0.05, 20.0)] * 4)
def test_enclosure_agrees_with_the_running_code(drift: float, noise: float, c1: float, c2: float) -> None:
    constants = Constants.of({"drift_m_s": drift, "noise_m_sqrt_s": noise, "c1_1_s": c1, "c2": c2})
    low, high = enclose(threshold.RESIDUAL, constants.values, Fraction(0))
    assert high - low <= low / 10**12
    zeta = optimal_threshold(drift, noise, c1, c2)
    assert float(constants.zeta(low)) * (1 - 1e-12) <= zeta <= float(constants.zeta(high)) * (1 + 1e-12)


@pytest.mark.parametrize("name", INPUTS)
def test_no_threshold_on_a_grid_is_better(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    constants = [INPUTS[name][key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")]
    zeta = found[name][0].evidence["running_threshold_m"]
    best = bayes_risk(zeta, *constants)
    assert all(bayes_risk(z, *constants) > best for z in zeta * np.geomspace(1e-3, 20.0, 200))


def test_table_1_is_optimal_for_two_drifts(found: dict[str, tuple[Finding, Finding]]) -> None:
    """About 6.07 m/s, and one beyond any robot here; as printed, for two others."""
    drifts = found["table 1"][1].evidence["enclosures"]
    assert drifts["drift_low_m_s"][0] == pytest.approx(6.0667, abs=1e-4)
    assert drifts["drift_high_m_s"][0] == pytest.approx(99.015, abs=1e-3)
    for name in ("drift_low_m_s", "drift_high_m_s"):
        assert optimal_threshold(drifts[name][0], 10.0, 0.5, 1.0) == pytest.approx(3.0, rel=1e-9)
        assert optimal_threshold(drifts[f"printed_{name}"][0], 10.0, 1.0, 0.5) == pytest.approx(3.0, rel=1e-9)


def test_a_threshold_that_is_optimal_for_no_drift() -> None:
    finding = ThrOpt().check(TABLE_1 | {"zeta_m": 30.0})
    assert finding.status == "proved"
    assert finding.evidence["statements"]["drift_none"] == "true"
    assert all(optimal_threshold(drift, 10.0, 0.5, 1.0) < 30.0 for drift in np.geomspace(1e-3, 1e3, 100))


@pytest.mark.parametrize("name", ["table 1", "audit"])
def test_slope_with_a_deviation_is_that_of_the_running_code(
    found: dict[str, tuple[Finding, Finding]], name: str
) -> None:
    evidence = found[name][1].evidence
    low, high = evidence["enclosures"]["ahead_slope_1_m"]
    assert evidence["difference_quotient_with_deviation_ahead_1_m"] == pytest.approx(low, rel=1e-6)
    assert 0.0 < low < high < low * (1.0 + 1e-8)
    assert evidence["enclosures"]["behind_slope_1_m"][1] < 0.0


@pytest.mark.parametrize("name", threshold.MUTANTS)
def test_mutants_of_the_threshold_are_refuted(name: str) -> None:
    finding = threshold.MUTANTS[name](TABLE_1)
    assert finding.status == "refuted"
    assert finding.counterexample
    assert finding.margin is None or finding.margin < 0.0
    json.dumps(finding.counterexample, allow_nan=False)


@pytest.mark.parametrize(
    ("answer", "status", "says"),
    [("unknown", "proved", "undecided"), ("timeout", "proved", "undecided"), ("sat", "error", "contradicts")],
)
def test_cvc5_neither_passes_nor_is_overruled(
    monkeypatch: pytest.MonkeyPatch, answer: Any, status: str, says: str
) -> None:
    monkeypatch.setattr(threshold, "solve", lambda *_: [Result(answer)])
    finding = ThrRoot().check(TABLE_1)
    assert finding.status == status
    assert finding.evidence["cvc5_says"] == says


def test_cvc5_finds_two_roots_where_there_are_some() -> None:
    """The script can fail: without the order of u and v it has a model, and says no more than 'unknown' or 'sat'."""
    weaker = threshold.UNIQUE_SMT2.replace("(assert (< u v))\n", "(assert (= u v))\n")
    assert weaker != threshold.UNIQUE_SMT2
    assert threshold.solve([weaker], "cvc5", 2.0)[0].answer != "unsat"


def test_an_open_sign_is_inconclusive() -> None:
    finding = conclude([Sign("zero", "u - u is positive", "u-u", {"u": Fraction(1)}, ">")], {}, {}, ())
    assert finding.status == "inconclusive"
    with pytest.raises(ArithmeticError, match="open"):
        enclose("u-u", {}, Fraction(0))
    with pytest.raises(ArithmeticError, match="no sign"):
        enclose("0-u-1", {}, Fraction(0))


@pytest.mark.parametrize("expression", ["sin(u)", "v", "u**u", "1.5", "u if u else u", "__import__('os')"])
def test_expressions_are_limited(expression: str) -> None:
    with pytest.raises(ValueError, match="not allowed"):
        evaluate(expression, {"u": Fraction(1)})


@given(st.fractions(-40, 40, max_denominator=1000))
def test_fractions_and_balls_agree_on_exp(x: Fraction) -> None:
    low, high = exp_bounds(x)
    ball = evaluate("exp(u)", {"u": x})
    assert low <= high <= low * (1 + Fraction(1, 10**20))
    assert evaluate("exp(u)-v", {"u": x, "v": low}) > -1e-60 * ball
    assert evaluate("exp(u)-v", {"u": x, "v": high}) < 1e-60 * ball


@pytest.mark.parametrize("name", INPUTS)
def test_certificates_are_accepted_by_fractions(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    root, optimum = (json.loads(finding.certificates["statements.json"]) for finding in found[name])
    assert accepts(root, INPUTS[name])
    assert accepts(optimum, INPUTS[name])
    assert [statement["name"] for statement in optimum["statements"] if not true(statement)] == []


def tampered() -> dict[str, Any]:
    def shift(c: dict[str, Any]) -> None:
        u = Fraction(c["statements"][1]["values"]["u"]) * Fraction(1000000000002, 1000000000000)
        c["statements"][1]["values"]["u"] = c["enclosures"]["u"][0] = str(u)

    return {
        "end moved": shift,
        "sign": lambda c: c["statements"][2].update(sign="<"),
        "function": lambda c: c["statements"][2].update(expression="k*(((exp(u)-exp(-u))/2)+u)"),
        "constant": lambda c: c["statements"][1]["values"].update(r="1/2"),
        "wide": lambda c: c["enclosures"].update(u=["1/10", "1"]),
        "zeta": lambda c: c["enclosures"].update(zeta_m=["3", "4"]),
        "derivative": lambda c: c["statements"][0].update(derivative="k*(q+1)**2/q"),
    }


@pytest.mark.parametrize("how", tampered())
def test_tampered_certificates_are_rejected(found: dict[str, tuple[Finding, Finding]], how: str) -> None:
    certificate = json.loads(found["table 1"][0].certificates["statements.json"])
    tampered()[how](certificate)
    assert not accepts(certificate, TABLE_1)


def test_a_certificate_of_other_constants_is_rejected(found: dict[str, tuple[Finding, Finding]]) -> None:
    assert not accepts(json.loads(found["audit"][0].certificates["statements.json"]), TABLE_1)


# --- THR-DDM ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def simulated() -> Finding:
    return ThrDdm().judge(ThrDdm().inputs(load("case_a")[0]))


def test_formulas_are_supported(simulated: Finding) -> None:
    assert simulated.status == "supported"
    assert simulated.evidence["paths"] >= 20000
    assert len(simulated.evidence["comparisons"]) == 12
    assert simulated.margin is not None
    assert 0.0 < simulated.margin <= 1.0


def test_intervals_can_be_redone_by_hand(simulated: Finding) -> None:
    """Binomial tails and the normal quantile with `math` only, from the certificate's counts."""
    certificate = json.loads(simulated.certificates["paths.json"])
    tail, quantile = certificate["tail"], certificate["normal_quantile"]
    assert tail == pytest.approx(0.01 / 12 / 2)
    assert 0.5 * math.erfc(quantile / math.sqrt(2.0)) == pytest.approx(tail, rel=1e-9)

    def below(k: int, n: int, p: float) -> float:
        logs = math.log(p), math.log1p(-p)
        return math.fsum(
            math.exp(math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * logs[0] + (n - i) * logs[1])
            for i in range(k + 1)
        )

    for row in certificate["comparisons"]:
        n, wrong, constants = row["constants"]["paths"], row["wrong_decisions"], row["constants"]
        low, high = row["interval"]
        if row["quantity"] == "error rate":
            assert below(wrong, n, high - ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
            assert 1.0 - below(wrong - 1, n, low + ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
        else:
            mean = row["periods_sum"] / n
            spread = math.sqrt((row["periods_sum_of_squares"] / n - mean**2) / (n - 1))
            half = (quantile * spread + ddm.TIME_ALLOWANCE) * constants["noise_period_s"]
            assert (high - low) / 2 == pytest.approx(half, rel=1e-9)
            assert (high + low) / 2 == pytest.approx((mean - 0.25) * constants["noise_period_s"], rel=1e-9)
        assert low < row["formula"] < high


@pytest.mark.parametrize("name", ddm.SIMULATED)
def test_mutants_of_the_formulas_are_refuted(simulated: Finding, name: str) -> None:
    finding = ddm.SIMULATED[name](ThrDdm().inputs(load("case_a")[0]))
    assert finding.status == "refuted"
    assert finding.counterexample
    assert abs(finding.counterexample["z_score"]) > 5.0


def test_the_printed_threshold_is_not_refuted_where_it_is_the_same() -> None:
    inputs = {"drift_m_s": 1.0, "noise_m_sqrt_s": 1.0, "c1_1_s": 1.0, "c2": 1.0}
    assert ddm.SIMULATED["THR-DDM: the threshold with c1/c2 minimises the risk"](inputs).status == "inconclusive"


def sampled(each: Experiment, nodes: int = 160) -> tuple[float, float]:
    """Mean number of periods and error rate of the sampled walk between the barriers, by Gauss-Legendre quadrature."""
    x, weight = (each.barrier * values for values in np.polynomial.legendre.leggauss(nodes))
    step, mean = each.noise * math.sqrt(each.period), each.drift * each.period

    def kernel(start: Any) -> Any:
        return np.exp(-(((x - start - mean) / step) ** 2) / 2.0) / (step * math.sqrt(2.0 * math.pi)) * weight

    matrix = np.eye(nodes) - np.array([kernel(start) for start in x])
    beyond = ndtr((-each.barrier - x - mean) / step)
    periods, wrong = np.linalg.solve(matrix, np.ones(nodes)), np.linalg.solve(matrix, beyond)
    first = kernel(each.deviation)
    at_once = float(ndtr((-each.barrier - each.deviation - mean) / step))
    return 1.0 + float(first @ periods), at_once + float(first @ wrong)


@pytest.mark.parametrize("deviation", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("drift", [0.01, 0.1815, 0.5, 1.0, 2.0, 4.0, 10.0])
def test_what_the_barrier_correction_leaves_is_within_the_allowances(drift: float, deviation: float) -> None:
    each = Experiment("", drift, 1.0, 1.0, deviation, 1, 0)
    periods, wrong = sampled(each)
    time, rate = passages.running(each)
    assert abs(periods - 0.25 - time / each.period) < ddm.TIME_ALLOWANCE
    assert abs(wrong - rate) < ddm.ERROR_ALLOWANCE


def test_the_experiments_are_within_the_range_of_that_test() -> None:
    for inputs in INPUTS.values():
        for each in passages.experiments(inputs):
            assert 0.0 < each.zeta * each.drift / each.noise**2 <= 10.0
            assert abs(each.deviation) <= 0.4 * each.zeta * (1.0 + 1e-12)


@pytest.mark.parametrize("zeta", [1.0, 1e-3])  # noise periods of 4 ms and 4 ns
def test_increments_are_those_of_the_process(zeta: float) -> None:
    each = Experiment("", 2.0, 3.0, zeta, 0.0, 1, 5)
    steps = np.array(passages.increments(each, 1000))
    assert steps.shape == (1000 * passages.CHANNELS,)
    deviation = each.noise * math.sqrt(each.period)
    assert abs(steps.mean() - each.drift * each.period) < 4.0 * deviation / math.sqrt(len(steps))
    assert steps.std() == pytest.approx(deviation, rel=4.0 / math.sqrt(2.0 * len(steps)))
    assert abs(np.corrcoef(steps[:-1], steps[1:])[0, 1]) < 4.0 / math.sqrt(len(steps))
    assert passages.increments(each, 20) == passages.increments(each, 20)
    assert passages.increments(each, 20) != passages.increments(replace(each, seed=6), 20)


def test_passages() -> None:
    assert passages.passage(iter([0.5, -0.2, 0.9]), 0.0, 1.0) == (3, pytest.approx(1.2))
    assert passages.passage(iter([-2.0, 5.0]), 0.5, 1.0) == (1, -1.5)
    with pytest.raises(ArithmeticError, match="within a path"):
        passages.passage(iter([0.1]), 0.0, 1.0)


@given(st.floats(0.2, 5.0), st.floats(0.5, 5.0), st.floats(0.2, 3.0), st.floats(-0.9, 0.9))
def test_the_printed_formulas_are_ours_with_the_deviation_in_seconds(
    drift: float, noise: float, zeta: float, share: float
) -> None:
    assume(0.01 < zeta * drift / noise**2 < 20.0)
    each = Experiment("", drift, noise, zeta, share * zeta, 1, 0)
    time, rate = ddm.printed(each, each.deviation / drift)
    assert time == pytest.approx(decision_time(zeta, drift, noise, share * zeta), rel=1e-6, abs=1e-9)
    assert rate == pytest.approx(error_rate(zeta, drift, noise, share * zeta), rel=1e-6, abs=1e-9)


def test_pyddm_agrees(simulated: Finding) -> None:
    pytest.importorskip("pyddm")
    for row in simulated.evidence["comparisons"]:
        key = "error_rate" if row["quantity"] == "error rate" else "decision_time_s"
        assert simulated.evidence["pyddm"][row["experiment"]][key] == pytest.approx(row["formula"], rel=1e-4)


def test_without_pyddm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyddm", None)
    assert ddm._pyddm(Experiment("", 1.0, 1.0, 1.0, 0.0, 1, 0)) == "not installed"
