"""SAFE-LEMMA."""

from __future__ import annotations

import json
import random
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from verify.model.avoidance.cases import evaluate

from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.lemma import V, X, ldl

NUMBERS = st.fractions(min_value=-20, max_value=20, max_denominator=100)

POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


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


@given(POINTS, POINTS, st.fractions(min_value=0, max_value=5, max_denominator=50))
def test_lemma_exactly(x: tuple[Fraction, ...], v: tuple[Fraction, ...], s: Fraction) -> None:
    """Without roots: E >= D + s r exactly if D^2 + s x.v <= 0 or its square is at most D^2 E^2."""
    square = sum(c * c for c in x)
    level = square + s * sum(a * b for a, b in zip(x, v, strict=True))
    end = sum((a + s * b) ** 2 for a, b in zip(x, v, strict=True))
    assert level <= 0 or level**2 <= square * end
