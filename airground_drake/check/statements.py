"""What THR-ROOT and THR-OPT consist of: every statement by name, with the values that it is about.

A statement says that an expression is above or below 0 at given values, or what the derivative of a function is along
the rates of its names; q stands for exp u, whose rate is q. Symbols are those of `enclosures.py`:

- f = k (sinh u + u) - r has one root (`increasing`), here (`root_*`); THR-ROOT is no more than this.
- dB/du = c1 q/(q + 1)^2 f (`factorisation`): B falls up to the root and rises beyond it, also around the code's
  threshold (`running_*`). f is not 0 where it is 0 with 1/r for r, and B is larger there (`printed_*`).
- With an initial deviation, w = 2 deviation drift / noise^2, b = 1 - exp(-w), B has the further terms b (c1 k u - c2) /
  (2 sinh u) and one without u; where f = 0, dB/du is b c1 k coth(u/2) / 2 (`biased`), so that dB/dzeta is
  (c1/drift) (1 - exp(-w)) coth(u/2). Its size falls with u: at the ends of the enclosure it is bounded (`ahead_*`,
  `behind_*`).
- zeta solves f = 0 for the drifts u noise^2 / (2 zeta) with (sinh u + u)/u^2 = m = r noise^2 / (4 zeta^2). That falls
  and rises again (`turning`), with its least value here (`turn_*`): one drift on each side, or none (`drift_*`, and
  with 1/r for r `printed_drift_*`).
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from .files import Json
from .rules import same

Ends = tuple[Fraction, Fraction]
Values = Mapping[str, Fraction]

SINH = "((exp(u)-exp(-u))/2)"
F = f"k*({SINH}+u)-r"
RISK = "c1*k/2*{0}*(exp({0})-1)/(exp({0})+1)+c2/(exp({0})+1)"
WORSE = f"({RISK.format('v')})-({RISK.format('u')})"
SLOPE = "c1/drift*(1-exp(-w))*(exp(u)+1)/(exp(u)-1)-bound"
LEVEL = f"({SINH}+u)/u**2-m"
LEAST = f"({SINH}+u)/v**2-m"
TURN = f"u*(exp(u)+exp(-u))/2-u-2*{SINH}"

_RISK_IN_Q = "c1*k/2*u*(q-1)/(q+1)+c2/(q+1)"
_FACTORS = "q/(q+1)**2*(c1*k*((q-1/q)/2+u)-c2)"
_BIASED_SLOPE = f"{_FACTORS}-(c1*k*((q-1/q)/2+u)-c2)*b*(q+1/q)/(q-1/q)**2+b*c1*k*(q+1)/(2*(q-1))"

NOT_JUDGED = ("says", "degree")
"""Of a statement: a text, and a hint for those who compare derivatives on a grid."""


def are_the_claims(recorded: list[Json], wanted: list[Json]) -> None:
    """The recorded statements are those wanted and no others, each about the same values.

    Raises:
        Disagreement: if they are not.
    """
    same("statements of the claim", [one["name"] for one in recorded], [one["name"] for one in wanted])
    for theirs, ours in zip(recorded, wanted, strict=True):
        judged = {key: value for key, value in theirs.items() if key not in NOT_JUDGED}
        same("the statement is the claim's", judged, ours, about=ours["name"])


def of_the_root(constants: Values, root: Ends) -> list[Json]:
    """THR-ROOT."""
    return [INCREASING, *_changes_its_sign("root", F, _of(constants, "k", "r"), root)]


def of_the_minimum(constants: Values, root: Ends, running: Ends) -> list[Json]:
    """B is least at the root; `running`: u just below and just above the code's threshold."""
    increasing, *at_the_root = of_the_root(constants, root)
    at_the_threshold = _changes_its_sign("running", F, _of(constants, "k", "r"), running)
    return [increasing, FACTORISATION, BIASED, TURNING, *at_the_root, *at_the_threshold]


def of_the_printed_root(constants: Values, near: Fraction, printed: Ends) -> list[Json]:
    """The printed equation has its root elsewhere, where B is larger; `near`: the end of the other enclosure next."""
    too_low = printed[1] < near
    v, relation = (printed[1], "<") if too_low else (printed[0], ">")
    swapped = {"k": constants["k"], "r": 1 / constants["r"]}
    return [
        *_changes_its_sign("printed", F, swapped, printed),
        _sign("printed_slope", F, relation, {**_of(constants, "k", "r"), "u": v}),
        _sign("printed_risk", WORSE, ">", {**_of(constants, "c1", "c2", "k"), "u": near, "v": v}),
    ]


def of_a_deviation(constants: Values, name: str, root: Ends, w: Fraction, slope: Ends) -> list[Json]:
    """dB/dzeta at the root is between two bounds, 1/m: all over the enclosure, as its size falls with u."""
    least, most = (root[1], root[0]) if w > 0 else root
    known = {**_of(constants, "c1", "drift"), "w": w}
    return [
        _sign(f"{name}_from", SLOPE, ">", {**known, "bound": slope[0], "u": least}),
        _sign(f"{name}_to", SLOPE, "<", {**known, "bound": slope[1], "u": most}),
    ]


def of_the_turn(turn: Ends) -> list[Json]:
    """(sinh u + u)/u^2 is least between the ends."""
    return _changes_its_sign("turn", TURN, {}, turn)


def of_no_drift(name: str, m: Fraction, turn: Ends) -> list[Json]:
    """(sinh u + u)/u^2 is above m even where it is least."""
    return [_sign(f"{name}_none", LEAST, ">", {"m": m, "u": turn[0], "v": turn[1]})]


def of_two_drifts(name: str, m: Fraction, low: Ends, high: Ends) -> list[Json]:
    """(sinh u + u)/u^2 falls through m between the low ends, and rises through it between the high ones."""
    falling = _changes_its_sign(f"{name}_low", LEVEL, {"m": m}, low, rising=False)
    return [*falling, *_changes_its_sign(f"{name}_high", LEVEL, {"m": m}, high)]


def _of(constants: Values, *names: str) -> dict[str, Fraction]:
    return {name: constants[name] for name in names}


def _changes_its_sign(name: str, expression: str, values: Values, ends: Ends, *, rising: bool = True) -> list[Json]:
    sides = zip(("below", "above"), ends, "<>" if rising else "><", strict=True)
    return [_sign(f"{name}_{side}", expression, relation, {**values, "u": u}) for side, u, relation in sides]


def _sign(name: str, expression: str, relation: str, values: Values) -> Json:
    texts = {key: str(value) for key, value in values.items()}
    return {"kind": "sign", "name": name, "expression": expression, "values": texts, "sign": relation}


def _derivative(name: str, function: str, derivative: str) -> Json:
    rates = {"u": "1", "q": "q"}
    return {"kind": "derivative", "name": name, "function": function, "rates": rates, "derivative": derivative}


INCREASING = _derivative("increasing", "k*((q-1/q)/2+u)-r", "k*(q+1)**2/(2*q)")
FACTORISATION = _derivative("factorisation", _RISK_IN_Q, _FACTORS)
BIASED = _derivative("biased", f"{_RISK_IN_Q}+b*(c1*k*u-c2)/(q-1/q)", _BIASED_SLOPE)
TURNING = _derivative("turning", "((q-1/q)/2+u)/u**2", "(u*(q+1/q)/2-u-(q-1/q))/u**3")
