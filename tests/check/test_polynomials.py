"""Exact polynomials, and expressions of elementary functions."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.check.enclosures import Dual, evaluate
from airground_drake.check.polynomials import Polynomial, parse
from airground_drake.check.rules import Disagreement
from airground_drake.verify.engines.obligation import Obligation

NAMES = st.lists(st.sampled_from(["x", "y", "z"]), max_size=4)
PRODUCTS = st.lists(
    st.tuples(st.fractions(min_value=-4, max_value=4, max_denominator=8), NAMES), min_size=1, max_size=5
)


def value(polynomial: Polynomial, at: dict[str, Fraction]) -> Fraction:
    return sum((k * math.prod(at[name] for name in names) for names, k in polynomial.items()), Fraction())


@examples(100, fuzz=2000)
@given(
    one=PRODUCTS, other=PRODUCTS, at=st.fixed_dictionaries(dict.fromkeys("xyz", st.fractions(-3, 3, max_denominator=4)))
)
def test_polynomials_are_evaluated_like_numbers(one: Any, other: Any, at: dict[str, Fraction]) -> None:
    def text(products: Any) -> str:
        return " ".join(f"{'-' if size < 0 else '+'} {'*'.join([str(abs(size)), *names])}" for size, names in products)

    expected = [sum(size * math.prod(at[n] for n in names) for size, names in products) for products in (one, other)]
    a, b = (parse(text(products).removeprefix("+ ").replace("- ", "-", 1) if text(products).startswith("-")
                  else text(products).removeprefix("+ ")) for products in (one, other))  # fmt: skip
    assert [value(a, at), value(b, at)] == expected
    assert value(a * b * b + a - b, at) == expected[0] * expected[1] ** 2 + expected[0] - expected[1]
    assert (a * b).at(at).constant() == expected[0] * expected[1]
    assert value(a.at({"x": at["x"]}), at) == expected[0]


@pytest.mark.parametrize("polynomial", ["(1 - A*h)*(d - D)**2", "-x", "0", "3 - 2*h*h + h", "x*y - y*x"])
def test_polynomials_in_files_are_those_of_the_proofs(polynomial: str) -> None:
    names = ("A", "h", "d", "D", "x", "y")
    text = Obligation("o", "", names, polynomial).to_json()["goal"]
    at = {name: Fraction(3 * i + 1, i + 2) for i, name in enumerate(names)}
    assert value(parse(text), at) == eval(polynomial, {}, at)
    assert Obligation("o", "", names, "(h - 2*d)/20").to_json()["goal"] == "1/20*h - 1/10*d"


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "x**2",
        "f(x)",
        "x.y",
        "[x]",
        "'x'",
        "1/0",
        "1e9",
        "(x)",
        "x/y",
        "x *y",
        "x - - y",
        "1_0",
        "x\n",
        None,
        3,
    ],
)
def test_what_is_no_sum_of_products_is_refused(text: Any) -> None:
    with pytest.raises(Disagreement):
        parse(text)


@given(x=st.fractions(1, 9, max_denominator=9))
def test_dual_numbers_differentiate(x: Fraction) -> None:
    found = evaluate("(3*x - 1/x)**2/(x + 2) - x", {"x": Dual(x, Fraction(1))}, lambda n: Dual(Fraction(n), Fraction()))
    root, slope = 3 * x - 1 / x, 3 + 1 / x**2
    assert found.value == root**2 / (x + 2) - x
    assert found.slope == (2 * root * slope * (x + 2) - root**2) / (x + 2) ** 2 - 1


def test_expressions_are_evaluated_in_decimals() -> None:
    assert evaluate("exp(u) - 1", {"u": Decimal(0)}, Decimal) == 0


@pytest.mark.parametrize("text", ["x", "2**u", "2**99", "u.real", "abs(u)", "exp(u, u)", "u if u else u", "'u'", "1.5"])
def test_what_is_no_expression_is_refused(text: str) -> None:
    with pytest.raises(Disagreement):
        evaluate(text, {"u": Decimal(1)}, Decimal)
