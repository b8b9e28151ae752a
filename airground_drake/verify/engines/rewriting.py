"""Obligations written shortly, and made from others: with numbers, with a number resolved, with a hypothesis less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import sympy

from airground_drake.verify.engines.obligation import Obligation, Term, polynomial, rational


def terms(*products: str) -> tuple[Term, ...]:
    """A certificate from texts such as "1/2 s rule": a coefficient, unless it is 1, and names of hypotheses."""
    parts = [product.split() if product[0].isdigit() else ["1", *product.split()] for product in products]
    return tuple(Term(coefficient, tuple(factors)) for coefficient, *factors in parts)


def with_numbers(obligation: Obligation, suffix: str, numbers: Mapping[str, float]) -> Obligation:
    """The same obligation with rational numbers in place of some variables."""
    values = {sympy.Symbol(name): sympy.Rational(rational(number)) for name, number in numbers.items()}

    def put(text: str) -> str:
        return str(polynomial(text, obligation.variables).as_expr().subs(values))

    def put_all(texts: Mapping[str, str]) -> dict[str, str]:
        return {name: put(text) for name, text in texts.items()}

    return replace(
        obligation,
        name=f"{obligation.name}_{suffix}",
        says=f"{obligation.says}; numbers of {suffix}: " + ", ".join(f"{k} = {v:.9g}" for k, v in numbers.items()),
        variables=tuple(name for name in obligation.variables if name not in numbers),
        goal=put(obligation.goal),
        hypotheses=put_all(obligation.hypotheses),
        strict=put_all(obligation.strict),
        equations=put_all(obligation.equations),
        certificate=tuple(replace(term, square=put(term.square)) for term in obligation.certificate),
        equation_multipliers=put_all(obligation.equation_multipliers),
    )


def with_hypotheses(obligation: Obligation, **texts: str) -> Obligation:
    """The obligation with other hypotheses under names that it has.

    Raises:
        KeyError: if it has none of a name.
    """
    if strangers := sorted(set(texts) - set(obligation.hypotheses)):
        raise KeyError(f"{obligation.name} has no hypotheses {strangers}; it has {sorted(obligation.hypotheses)}")
    return replace(obligation, hypotheses={**obligation.hypotheses, **texts})


def resolved(obligation: Obligation, name: str) -> Obligation:
    """The obligation with a hypothesis that is a number moved into the coefficients of its certificate.

    So a number that is negative refutes the goal, instead of making the hypotheses contradictory.
    """
    value = Fraction(str(sympy.sympify(obligation.hypotheses[name])))
    terms = tuple(
        replace(t, coefficient=str(Fraction(t.coefficient) * value), factors=tuple(f for f in t.factors if f != name))
        if name in t.factors else t
        for t in obligation.certificate
    )  # fmt: skip
    kept = {other: text for other, text in obligation.hypotheses.items() if other != name}
    return replace(obligation, hypotheses=kept, certificate=terms)


def constant(name: str, says: str, value: Fraction) -> Obligation:
    """A number of the scenario is >= 0; where it is not, that is a counterexample and no missing premise."""
    return Obligation(name, says, ("h",), str(value), certificate=(Term(str(value)),) if value else ())


def without(obligation: Obligation, hypothesis: str, says: str) -> Obligation:
    """The obligation without one of its hypotheses, nor the terms of its certificate that need it."""
    kept = {name: text for name, text in obligation.hypotheses.items() if name != hypothesis}
    terms = tuple(term for term in obligation.certificate if hypothesis not in term.factors)
    return replace(obligation, hypotheses=kept, certificate=terms, says=says)
