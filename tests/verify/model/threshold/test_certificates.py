"""`statements.json` checked with fractions only."""

from __future__ import annotations

import ast
import json
import math
import operator
from fractions import Fraction
from functools import reduce
from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from verify.model.threshold.cases import INPUTS, TABLE_1

from airground_drake.verify.engines.ball_arithmetic import evaluate
from airground_drake.verify.finding import Finding


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
