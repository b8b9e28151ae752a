"""SAFE-LEMMA as obligations, and Lagrange's identity as a rational Gram matrix.

`gram.json`: {"polynomial": text, "monomials": [9 texts z_a], "gram": G, "lower": L, "diagonal": [9 numbers]}, all
numbers rational as texts. To check: z.G z expands to the polynomial; G = L diag(diagonal) L^T; L is lower triangular
with 1 on its diagonal; no entry of `diagonal` is negative. So G is positive semidefinite and the polynomial >= 0.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction

import sympy

from airground_drake.verify.engines.obligation import Obligation, Term
from airground_drake.verify.engines.rewriting import terms

X, V = ("x1", "x2", "x3"), ("v1", "v2", "v3")
MINORS = ("x1*v2 - x2*v1", "x1*v3 - x3*v1", "x2*v3 - x3*v2")


def dot(a: Sequence[str], b: Sequence[str]) -> str:
    """a.b as a text."""
    return "(" + " + ".join(f"({p})*({q})" for p, q in zip(a, b, strict=True)) + ")"


def lemma() -> list[Obligation]:
    """||x + s v|| >= ||x|| + s (x.v)/||x||, with r = (x.v)/D and Q = v.v in its last two steps."""
    end = tuple(f"{x} + s*{v}" for x, v in zip(X, V, strict=True))
    difference = f"{dot(X, X)}*{dot(V, V)} - {dot(X, V)}**2"
    square = "E**2 - D**2 - 2*s*D*r - s**2*Q"
    numbers = ("D", "E", "r", "Q", "s")
    given = {"s": "s", "distance": "E"}
    return [
        Obligation(
            "lagrange", "x.x v.v - (x.v)^2 is a sum of squares (Lagrange); in the plane: x3 = v3 = 0",
            (*X, *V), difference, certificate=tuple(Term(square=minor) for minor in MINORS),
        ),
        Obligation(
            "expansion", "||x + s v||^2 = x.x + 2 s x.v + s^2 v.v: the difference is the polynomial 0",
            (*X, *V, "s"), f"{dot(end, end)} - {dot(X, X)} - 2*s*{dot(X, V)} - s**2*{dot(V, V)}",
        ),
        Obligation(
            "forward", "where D + s r > 0: E >= D + s r, because (E + D + s r) D^2 (E - D - s r) = s^2 D^2 (Q - r^2)",
            numbers, "E - D - s*r", hypotheses={**given, "lagrange": "D**2*Q - D**2*r**2"},
            strict={"D": "D", "level": "D + s*r"}, equations={"square": square},
            certificate=(Term("1", ("lagrange",), "s"),), multiplier=terms("D D distance", "D D level"),
            equation_multipliers={"square": "D**2"},
        ),
        Obligation(
            "backward", "where D + s r <= 0: E >= 0 >= D + s r", numbers, "E - D - s*r",
            hypotheses={**given, "level": "-D - s*r"}, strict={"D": "D"}, equations={"square": square},
            certificate=terms("distance", "level"),
        ),
    ]  # fmt: skip


def ldl(matrix: Sequence[Sequence[Fraction]]) -> tuple[list[list[Fraction]], list[Fraction]]:
    """L (unit lower triangular) and the diagonal of matrix = L diag L^T, exactly.

    Raises:
        ValueError: if the symmetric matrix is not positive semidefinite.
    """
    count, rest = len(matrix), [list(row) for row in matrix]
    lower = [[Fraction(i == j) for j in range(count)] for i in range(count)]
    diagonal: list[Fraction] = []
    for k in range(count):
        pivot = rest[k][k]
        below = [rest[i][k] for i in range(k + 1, count)]
        if pivot < 0 or (pivot == 0 and any(below)):
            raise ValueError("the matrix is not positive semidefinite")
        diagonal.append(pivot)
        for i in range(k + 1, count) if pivot else ():
            lower[i][k] = rest[i][k] / pivot
            for j in range(k + 1, count):
                rest[i][j] -= lower[i][k] * rest[k][j]
    return lower, diagonal


def gram_certificate() -> str:
    """`gram.json`: Lagrange's difference as a quadratic form in the monomials x_i v_j, with its exact LDL.

    Raises:
        ValueError: if the form is not the polynomial, or not positive semidefinite.
    """
    names = [f"{x}*{v}" for x in X for v in V]
    gram = [[Fraction(0)] * 9 for _ in range(9)]
    for minor in MINORS:
        plus, minus = (names.index(term) for term in minor.split(" - "))
        for a, b, sign in ((plus, plus, 1), (minus, minus, 1), (plus, minus, -1), (minus, plus, -1)):
            gram[a][b] += sign
    polynomial = lemma()[0].goal
    form = " + ".join(f"({gram[a][b]})*{names[a]}*{names[b]}" for a in range(9) for b in range(9))
    if sympy.expand(sympy.sympify(f"{polynomial} - ({form})")) != 0:
        raise ValueError("the quadratic form is not the polynomial")
    lower, diagonal = ldl(gram)
    described = {
        "polynomial": polynomial,
        "monomials": names,
        "gram": [[str(entry) for entry in row] for row in gram],
        "lower": [[str(entry) for entry in row] for row in lower],
        "diagonal": [str(entry) for entry in diagonal],
    }
    return json.dumps(described, indent=1) + "\n"
