"""Statements about elementary functions at rational points, which exact arithmetic checks.

Certificate `statements.json`: `constants` (rational, by name), `enclosures` (pairs of rationals), `argument` (how
the claim follows) and `statements`, each true or false by itself. Expressions contain + - * / ** (integer powers),
integers, names and exp. Two kinds:

- `sign`: `expression` at the rational `values` is `sign` ('<' or '>') 0. To check it, evaluate in interval
  arithmetic with a Taylor series of exp; interval endpoints are rational numbers.
- `derivative`: along `rates` (d name/du; absent: 0) the rational function `function` has the derivative
  `derivative`. q stands for exp(u), whose rate is q. To check it, compare both at all points of a grid with more
  values per name than `degree`, its degree there once denominators are cleared; dual numbers differentiate.
"""

from __future__ import annotations

import ast
import json
import operator
import threading
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any, Literal

import flint
import sympy

from airground_drake.statuses import Status
from airground_drake.verify.finding import Finding

PRECISION_BITS = 256
RELATIVE_WIDTH = Fraction(1, 10**12)
"""Enclosures are at most this wide, relative to their lower end."""

_BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_flint = threading.Lock()  # flint's precision is one for all threads

Relation = Literal["<", ">"]
Values = Mapping[str, Fraction]


@dataclass(frozen=True)
class Sign:
    """The expression at these values is `sign` 0."""

    name: str
    says: str
    expression: str
    values: Values
    sign: Relation

    def holds(self) -> bool | None:
        """None: the ball contains 0."""
        ball = evaluate(self.expression, self.values)
        return None if not (ball < 0 or ball > 0) else bool(ball < 0) == (self.sign == "<")

    def witness(self) -> dict[str, str]:
        """What the expression is instead."""
        return {"expression": evaluate(self.expression, self.values).str(15)}

    def to_json(self) -> dict[str, Any]:
        """Strict JSON with rationals as text."""
        return {"kind": "sign", **asdict(self), "values": {name: str(v) for name, v in self.values.items()}}


@dataclass(frozen=True)
class Derivative:
    """The rational function has this derivative along `rates`; `degree` bounds that of the cleared difference."""

    name: str
    says: str
    function: str
    rates: Mapping[str, str]
    derivative: str
    degree: Mapping[str, int]

    def holds(self) -> bool:
        """By symbolic differentiation."""
        return bool(self._error() == 0)

    def to_json(self) -> dict[str, Any]:
        """Strict JSON."""
        return {"kind": "derivative", **asdict(self)}

    def witness(self) -> dict[str, str]:
        """A point and by how much the derivative is wrong there, exactly."""
        point = dict(zip(self.degree, ("2", "3", "5", "7", "11", "13"), strict=False))
        return {**point, "error": str(self._error().subs({sympy.Symbol(name): int(x) for name, x in point.items()}))}

    def _error(self) -> Any:
        function, claimed = sympy.sympify(self.function), sympy.sympify(self.derivative)
        found = sum(sympy.sympify(rate) * sympy.diff(function, name) for name, rate in self.rates.items())
        return sympy.cancel(sympy.together(found - claimed))


Statement = Sign | Derivative


def evaluate(expression: str, values: Values) -> Any:
    """An expression as a flint.arb ball that contains its value.

    Raises:
        ValueError: for anything but + - * / **, integers, names with a value, and exp.
    """

    def walk(node: ast.AST) -> Any:
        match node:
            case ast.BinOp(left, op, ast.Constant(int(power))) if isinstance(op, ast.Pow):
                return walk(left) ** power
            case ast.BinOp(left, op, right) if type(op) in _BINARY:
                return _BINARY[type(op)](walk(left), walk(right))
            case ast.UnaryOp(ast.USub(), operand):
                return -walk(operand)
            case ast.Call(ast.Name("exp"), [argument]):
                return walk(argument).exp()
            case ast.Constant(int(number)):
                return flint.arb(number)
            case ast.Name(name) if name in values:
                return flint.arb(flint.fmpq(*values[name].as_integer_ratio()))
        raise ValueError(f"{expression!r}: {ast.dump(node)} is not allowed")

    with _flint, flint.ctx.workprec(PRECISION_BITS):
        return walk(ast.parse(expression, mode="eval").body)


def enclose(
    expression: str, values: Values, low: Fraction, high: Fraction | None = None, rising: bool = True
) -> tuple[Fraction, Fraction]:
    """Rational ends, RELATIVE_WIDTH apart or less, around a sign change of the expression in u, by bisection.

    Args:
        expression: monotone in u between `low` and `high`.
        values: of its other names.
        low: below the sign change.
        high: above it; None: found by doubling.
        rising: from negative to positive; else the reverse.

    Raises:
        ArithmeticError: if a sign cannot be decided, or none changes below u = 10^6.
    """

    def beyond(u: Fraction) -> bool:
        ball = evaluate(expression, {**values, "u": u})
        if not (ball < 0 or ball > 0):
            raise ArithmeticError(f"the sign of {expression} at u = {u} is open")
        return bool(ball > 0) == rising

    if high is None:
        high = max(2 * low, Fraction(1))
        while not beyond(high):
            low, high = high, 2 * high
            if high > 10**6:
                raise ArithmeticError(f"{expression} changes no sign below u = 10^6")
    while high - low > RELATIVE_WIDTH * low:
        middle = (low + high) / 2
        low, high = (low, middle) if beyond(middle) else (middle, high)
    return low, high


def bracket(
    name: str, says: str, expression: str, values: Values, ends: Sequence[Fraction], rising: bool = True
) -> list[Statement]:
    """The two statements that the expression changes its sign between the ends."""
    signs: tuple[Relation, ...] = ("<", ">") if rising else (">", "<")
    only = {key: value for key, value in values.items() if key in _names(expression)}
    return [
        Sign(f"{name}_{side}", says, expression, {**only, "u": u}, sign)
        for side, u, sign in zip(("below", "above"), ends, signs, strict=True)
    ]


def sign(name: str, says: str, expression: str, values: Values, relation: Relation) -> Sign:
    """A sign statement with the values that its expression names."""
    return Sign(name, says, expression, {key: values[key] for key in _names(expression)}, relation)


def _names(expression: str) -> list[str]:
    found = {node.id for node in ast.walk(ast.parse(expression)) if isinstance(node, ast.Name)}
    return sorted(found - {"exp"})


def conclude(
    statements: Sequence[Statement],
    constants: Values,
    enclosures: Mapping[str, Sequence[Fraction]],
    argument: Sequence[str],
    scripts: Mapping[str, str] | None = None,
    **fields: Any,
) -> Finding:
    """'refuted' by a false statement, 'inconclusive' by an open one, else 'proved' with its certificate."""
    held = [(statement, statement.holds()) for statement in statements]
    false = next((statement for statement, h in held if h is False), None)
    status: Status = "proved" if all(h for _, h in held) else "inconclusive" if false is None else "refuted"
    certificate = {
        "constants": {name: str(value) for name, value in constants.items()},
        "enclosures": {name: [str(end) for end in ends] for name, ends in enclosures.items()},
        "argument": list(argument),
        "statements": [statement.to_json() for statement in statements],
    }
    evidence = {
        "statements": {statement.name: {True: "true", False: "false", None: "open"}[h] for statement, h in held},
        "enclosures": {name: [float(end) for end in ends] for name, ends in enclosures.items()},
    }
    if false is not None:
        fields |= {"margin": None, "unit": ""}  # how far the claim would have held otherwise
    return Finding(
        status,
        counterexample=None if false is None else {"false_statement": false.to_json(), "value": false.witness()},
        evidence=evidence | fields.pop("evidence", {}),
        certificates={"statements.json": json.dumps(certificate, indent=1) + "\n", **(scripts or {})},
        exercised=len(statements),
        **fields,
    )
