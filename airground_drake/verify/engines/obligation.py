"""Proof obligations over the reals with certificates that exact arithmetic checks, and as SMT-LIB for solvers.

An obligation says: wherever all hypotheses are >= 0 (strict ones > 0) and all equations are 0, the goal is >= 0.
Its certificate is an identity between polynomials with rational coefficients,

    multiplier * goal = sum_j c_j * (product of hypotheses) * square_j^2 + sum_i q_i * equation_i,

with rational c_j >= 0 and a multiplier that is such a sum itself and positive because one of its terms is a
positive number times strict hypotheses only. Whoever expands both sides has re-done the proof; no solver is
involved. The negated goal in SMT-LIB 2 (`smt2`) is a second, independent way: it must be unsatisfiable.

Polynomials are texts such as "D + s*r - d" or "1/20*h**2"; numbers are rational, written as such. In files they are
multiplied out, so that a checker need not parse anything but sums of products.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from functools import cache
from typing import Any

import sympy


@dataclass(frozen=True)
class Term:
    """coefficient * product of hypotheses `factors` (by name, repeats allowed) * square^2."""

    coefficient: str = "1"
    factors: tuple[str, ...] = ()
    square: str = "1"


@dataclass(frozen=True)
class Obligation:
    """One implication between polynomial inequalities.

    Attributes:
        name: unique within its claim; letters, digits and underscores.
        says: the implication in words.
        variables: names of the real variables.
        hypotheses: by name, polynomials that are >= 0.
        strict: by name, polynomials that are > 0.
        equations: by name, polynomials that are 0.
        goal: polynomial to be shown >= 0.
        certificate: terms of the right-hand side.
        multiplier: terms of the left-hand side's multiplier; none: 1.
        equation_multipliers: q_i by name of the equation.
    """

    name: str
    says: str
    variables: tuple[str, ...]
    goal: str
    hypotheses: Mapping[str, str] = field(default_factory=dict)
    strict: Mapping[str, str] = field(default_factory=dict)
    equations: Mapping[str, str] = field(default_factory=dict)
    certificate: tuple[Term, ...] = ()
    multiplier: tuple[Term, ...] = ()
    equation_multipliers: Mapping[str, str] = field(default_factory=dict)

    def certified(self) -> bool:
        """Whether the certificate proves the goal, by exact expansion.

        Raises:
            ValueError: if a text is no polynomial in the variables, or a factor names no hypothesis.
        """
        given = {**self.hypotheses, **self.strict}
        for term in (*self.certificate, *self.multiplier):
            if Fraction(term.coefficient) < 0:
                return False
            if unknown := set(term.factors) - set(given):
                raise ValueError(f"{self.name}: {sorted(unknown)} are not among the hypotheses")
        positive = any(
            Fraction(t.coefficient) > 0 and t.square == "1" and set(t.factors) <= set(self.strict)
            for t in self.multiplier
        )
        if self.multiplier and not positive:
            return False
        left = self._sum(self.multiplier) if self.multiplier else self._polynomial("1")
        difference = left * self._polynomial(self.goal) - self._sum(self.certificate)
        for name, multiplier in self.equation_multipliers.items():
            difference -= self._polynomial(multiplier) * self._polynomial(self.equations[name])
        return bool(difference.is_zero)

    def smt2(self, *, goal: bool = True) -> str:
        """The negation in SMT-LIB 2 (QF_NRA): unsatisfiable exactly if the implication holds.

        Without the goal: satisfiable exactly if its premises can be met.
        """
        lines = [f"; {self.name}: {self.says}", "(set-logic QF_NRA)"]
        lines += [f"(declare-const {name} Real)" for name in self.variables]
        for relation, group in ((">=", self.hypotheses), (">", self.strict), ("=", self.equations)):
            lines += [
                f"(assert (! ({relation} {self._prefix(text)} 0.0) :named given_{name}))"
                for name, text in group.items()
            ]
        if goal:
            lines.append(f"(assert (! (< {self._prefix(self.goal)} 0.0) :named negated_goal))")
        lines.append("(check-sat)")
        return "\n".join(lines) + "\n"

    def to_json(self) -> dict[str, Any]:
        """Strict JSON that a checker reads: polynomials multiplied out, sums of products such as "2*h*r - 1/2*d"."""
        polynomials = ("hypotheses", "strict", "equations", "equation_multipliers")
        groups = {
            name: {key: self._sum_text(text) for key, text in getattr(self, name).items()} for name in polynomials
        }
        terms = {
            name: [asdict(term) | {"square": self._sum_text(term.square)} for term in getattr(self, name)]
            for name in ("certificate", "multiplier")
        }
        return {**asdict(self), "goal": self._sum_text(self.goal), **groups, **terms}

    def holds_at(self, point: Mapping[str, Fraction]) -> bool:
        """Whether the implication is true at a point: false for a genuine counterexample. Exact."""

        def at(text: str) -> Any:
            values = {sympy.Symbol(name): sympy.Rational(*value.as_integer_ratio()) for name, value in point.items()}
            return self._polynomial(text).as_expr().subs(values)

        premises = (
            all(at(text) >= 0 for text in self.hypotheses.values())
            and all(at(text) > 0 for text in self.strict.values())
            and all(at(text) == 0 for text in self.equations.values())
        )
        return not premises or bool(at(self.goal) >= 0)

    def _sum(self, terms: tuple[Term, ...]) -> Any:
        given = {**self.hypotheses, **self.strict}
        total = self._polynomial("0")
        for term in terms:
            product = self._polynomial(term.coefficient) * self._polynomial(term.square) ** 2
            for factor in term.factors:
                product *= self._polynomial(given[factor])
            total += product
        return total

    def _polynomial(self, text: str) -> Any:
        try:
            return polynomial(text, self.variables)
        except ValueError as error:
            raise ValueError(f"{self.name}: {error}") from error

    def _sum_text(self, text: str) -> str:
        """A polynomial as a sum of products of numbers and names, without powers and brackets."""
        total = ""
        for powers, coefficient in self._polynomial(text).terms():
            size = Fraction(int(coefficient.p), int(coefficient.q))
            names = [name for name, power in zip(self.variables, powers, strict=True) for _ in range(power)]
            factors = names if abs(size) == 1 and names else [str(abs(size)), *names]
            sign = (" - " if size < 0 else " + ") if total else "-" if size < 0 else ""
            total += sign + "*".join(factors)
        return total

    def _prefix(self, text: str) -> str:
        """A polynomial as an SMT-LIB term."""
        terms = []
        for powers, coefficient in self._polynomial(text).terms():
            factors = [name for name, power in zip(self.variables, powers, strict=True) for _ in range(power)]
            parts = [_number(coefficient), *factors]
            terms.append(parts[0] if len(parts) == 1 else f"(* {' '.join(parts)})")
        return terms[0] if len(terms) == 1 else f"(+ {' '.join(terms)})"


_NUMBERS = {"Integer": sympy.Integer, "Float": sympy.Float, "Rational": sympy.Rational, "Symbol": sympy.Symbol}
_RATIONAL = (*sympy.parsing.sympy_parser.standard_transformations, sympy.parsing.sympy_parser.rationalize)


@cache
def polynomial(text: str, variables: tuple[str, ...]) -> Any:
    """A text as a sympy polynomial with rational coefficients; parsed once, as it is needed in several forms.

    Raises:
        ValueError: if it is none, or in other variables.
    """
    symbols = {name: sympy.Symbol(name) for name in variables or ("unused",)}
    expression = sympy.parse_expr(text, local_dict=symbols, global_dict=_NUMBERS, transformations=_RATIONAL)
    if strangers := expression.free_symbols - set(symbols.values()):
        raise ValueError(f"{text!r} contains {strangers}, which are not among the variables")
    return sympy.Poly(expression, *symbols.values(), domain="QQ")


def rational(number: float) -> str:
    """The decimal that a float prints as, as an exact fraction: '0.05' means 1/20, not the nearest binary."""
    return str(Fraction(repr(float(number))))


def _number(value: Any) -> str:
    numerator, denominator = int(value.p), int(value.q)
    size = f"{abs(numerator)}.0" if denominator == 1 else f"(/ {abs(numerator)}.0 {denominator}.0)"
    return f"(- {size})" if numerator < 0 else size
