"""Polynomials with rational coefficients, exactly."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

from .rules import Disagreement

Monomial = tuple[str, ...]
"""Names of its factors in order, each as often as its power; () is the monomial 1."""

NUMBER = r"\d+(?:/[1-9]\d*)?"
NAME = r"[A-Za-z_]\w*"
PRODUCT = re.compile(rf"([+-]?)(?:{NUMBER}|{NAME})(?:\*(?:{NUMBER}|{NAME}))*")
LARGEST = 100_000
"""Most products of terms in a multiplication, and most characters of a polynomial: more would take for ever."""
MOST_DIGITS = 2_000
"""Digits of a numerator or denominator; those of a proof have less than 150."""
MOST_BITS = 4 * MOST_DIGITS
HIGHEST = 100
"""Degree of a monomial."""


def bounded(value: Fraction) -> Fraction:
    """The same.

    Raises:
        Disagreement: if its numerator or denominator is so long that arithmetic on it would take for ever.
    """
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > MOST_BITS:
        raise Disagreement("a number is short", "a longer one", f"{MOST_DIGITS} digits at most")
    return value


class Polynomial(dict[Monomial, Fraction]):
    """Coefficient by monomial; none is 0. Equal polynomials are equal dictionaries."""

    @classmethod
    def of(cls, terms: Mapping[Monomial, Fraction]) -> Polynomial:
        """From terms, some of which may be 0."""
        if any(len(monomial) > HIGHEST for monomial in terms):
            raise Disagreement("a degree is low", max(map(len, terms)), f"{HIGHEST} at most")
        return cls({monomial: size for monomial, size in terms.items() if size})

    def __add__(self, other: Polynomial) -> Polynomial:
        total = dict(self)
        for monomial, size in other.items():
            total[monomial] = bounded(total.get(monomial, Fraction()) + size)
        return Polynomial.of(total)

    def __neg__(self) -> Polynomial:
        return Polynomial({monomial: -size for monomial, size in self.items()})

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + -other

    def __mul__(self, other: Polynomial) -> Polynomial:
        if len(self) * len(other) > LARGEST:
            raise Disagreement("a polynomial is small enough", len(self) * len(other), f"{LARGEST} products at most")
        total: dict[Monomial, Fraction] = {}
        for left, size in self.items():
            for right, factor in other.items():
                monomial = tuple(sorted(left + right))
                total[monomial] = bounded(total.get(monomial, Fraction()) + size * factor)
        return Polynomial.of(total)

    def at(self, numbers: Mapping[str, Fraction]) -> Polynomial:
        """The same with numbers in place of some names."""
        total: dict[Monomial, Fraction] = {}
        for monomial, size in self.items():
            left = tuple(name for name in monomial if name not in numbers)
            value = math.prod([numbers[name] for name in monomial if name in numbers], start=size)
            total[left] = total.get(left, Fraction()) + value
        return Polynomial.of(total)

    def constant(self) -> Fraction | None:
        """Its value if it is a number, else None."""
        return None if {*self} - {()} else self.get((), Fraction())


def number(text: str) -> Fraction:
    """A rational number such as "3" or "1/20", with a sign or without.

    Raises:
        Disagreement: if the text is none.
    """
    if not isinstance(text, str) or len(text) > 2 * MOST_DIGITS or not re.fullmatch(rf"-?{NUMBER}", text):
        raise Disagreement("a number is an integer or a fraction", text, "such as 3 or 1/20")
    return bounded(Fraction(text))


def rational(value: float) -> Fraction:
    """The decimal that a number prints as."""
    return Fraction(repr(float(value)))


@lru_cache(maxsize=4096)
def parse(text: str) -> Polynomial:
    """A sum of products of numbers and names, such as "2*h*r - 1/2*d"; no powers, no brackets.

    Raises:
        Disagreement: if the text is none.
    """
    words = text.replace(" - ", " -").replace(" + ", " +").split(" ") if isinstance(text, str) else []
    if not words or len(text) > LARGEST or not all(PRODUCT.fullmatch(word) for word in words):
        raise Disagreement("a polynomial is a sum of products", text, "such as 2*h*r - 1/2*d")
    total: dict[Monomial, Fraction] = {}
    for word in words:
        factors = word.lstrip("+-").split("*")
        names = tuple(sorted(factor for factor in factors if re.fullmatch(NAME, factor)))
        size = Fraction(-1 if word.startswith("-") else 1)
        for factor in factors:
            if not re.fullmatch(NAME, factor):
                size = bounded(size * number(factor))
        total[names] = bounded(total.get(names, Fraction()) + size)
    return Polynomial.of(total)
