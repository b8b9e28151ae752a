"""THR-ROOT and THR-OPT: the threshold as the root of (19) and as the minimiser of (16), in 100 decimal digits.

With u = 2 zeta drift / noise^2, k = noise^2 / drift^2 and r = c2 / c1, (19) with its right-hand side the right way up
is f(u) = k (sinh u + u) - r = 0. f' = k (cosh u + 1) > 0: f has one root, in every interval at whose ends it has
different signs. With q = exp u the Bayes risk is

    B(u) = c1 k/2 u (q - 1)/(q + 1) + c2/(q + 1),    dB/du = c1 q/(q + 1)^2 f(u):

it falls up to the root and rises beyond it, so that the root of the printed equation, with 1/r, has a larger risk.
The statements of a certificate are those of `statements.py`, each about what the certificate encloses.
"""

from __future__ import annotations

import ast
import hashlib
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, Decimal, localcontext
from fractions import Fraction
from typing import Any

from .files import Files, Json, content_of, parse_json
from .polynomials import bounded, number, rational
from .rules import SMALL, Disagreement, Found, NotEstablished, close, holds, same
from .statements import (
    LEVEL,
    Ends,
    are_the_claims,
    of_a_deviation,
    of_no_drift,
    of_the_minimum,
    of_the_printed_root,
    of_the_root,
    of_the_turn,
    of_two_drifts,
)

DIGITS = 100
NARROW = Fraction(1, 10**12)
"""Enclosures are at most this wide, and the code's threshold at most this far outside, relative."""
SLOPE_NARROW = Fraction(1, 10**8)
"""Bounds of a slope are at most this far apart, relative."""
BESIDE = Fraction(1e-12)
"""At most so far from the code's threshold, relative, is where dB/dzeta changes its sign."""
HIGHEST = 12
"""Power in an expression."""


@dataclass(frozen=True)
class Rule:
    """The numbers of the threshold rule, as the decimals that they print as."""

    drift: Fraction
    noise: Fraction
    c1: Fraction
    c2: Fraction

    @classmethod
    def of(cls, scenario: Json) -> Rule:
        """Of a scenario."""
        given = scenario["decision"]["threshold"]
        return cls(*(rational(given[name]) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")))

    @property
    def constants(self) -> dict[str, Fraction]:
        """By the names that the certificates use."""
        k = self.noise**2 / self.drift**2
        return {"k": k, "r": self.c2 / self.c1, "c1": self.c1, "c2": self.c2, "drift": self.drift}

    def zeta_m(self, u: Fraction) -> Fraction:
        """Threshold at u."""
        return u * self.noise**2 / (2 * self.drift)

    def u(self, zeta_m: Fraction) -> Fraction:
        """The u of a threshold."""
        return 2 * zeta_m * self.drift / self.noise**2

    def residual(self, u: Fraction, ratio: Fraction) -> Decimal:
        """f(u) for r = ratio."""
        x = decimal(u)
        return decimal(self.constants["k"]) * ((x.exp() - (-x).exp()) / 2 + x) - decimal(ratio)

    def risk(self, u: Fraction) -> Decimal:
        """B(u)."""
        x, q = decimal(u), decimal(u).exp()
        c1, c2, k = (decimal(self.constants[name]) for name in ("c1", "c2", "k"))
        return c1 * k / 2 * x * (q - 1) / (q + 1) + c2 / (q + 1)


def decimal(value: Fraction) -> Decimal:
    """A fraction in the digits of the context."""
    return Decimal(value.numerator) / value.denominator


def root(claim: Json, files: Files, scenario: Json) -> Found:
    """THR-ROOT and THR-OPT."""
    if claim["status"] == "refuted":
        raise NotEstablished("a refutation is established again", "no way is known here")
    saved, rule = parse_json(content_of(files, "statements.json"), "statements.json"), Rule.of(scenario)
    same("what statements.json consists of", sorted(saved), ["argument", "constants", "enclosures", "statements"])
    with localcontext(prec=DIGITS, Emax=MAX_EMAX, Emin=MIN_EMIN):
        same("constants", saved["constants"], {name: str(value) for name, value in rule.constants.items()})
        ends = _enclosure(rule, saved["enclosures"], "u", "zeta_m", rule.c2 / rule.c1)
        if claim["id"] == "THR-ROOT":
            wanted, names = of_the_root(rule.constants, ends), ["u", "zeta_m"]
            found = _the_code_returns_the_root(claim, rule, ends)
        else:
            wanted, names = _about_the_minimum(claim, rule, saved, ends)
            found = _the_root_is_the_minimum(claim, rule, saved["enclosures"], ends)
        same("what is enclosed", sorted(saved["enclosures"]), sorted(names))
        are_the_claims(saved["statements"], wanted)
        _statements_are_true(wanted)
        true = {one["name"]: "true" for one in wanted}
        same("statements in the evidence", claim["evidence"]["statements"], true)
        floats = {name: [float(number(end)) for end in both] for name, both in saved["enclosures"].items()}
        return found.also(statements=true, enclosures=floats).counted(len(wanted))


def _about_the_minimum(claim: Json, rule: Rule, saved: Json, root: Ends) -> tuple[list[Json], list[str]]:
    """The statements of THR-OPT, about what is enclosed; and the names of the latter.

    Whatever the statements are about is narrow: that it is enclosed is what they say.
    """
    enclosures, constants = saved["enclosures"], rule.constants
    running = rule.u(Fraction(float(claim["evidence"]["threshold_judged_m"])))
    wanted = of_the_minimum(constants, root, (running * (1 - BESIDE), running * (1 + BESIDE)))
    names = ["u", "zeta_m"]
    if rule.c1 != rule.c2:
        printed = _enclosure(rule, enclosures, "printed_u", "printed_zeta_m", rule.c1 / rule.c2)
        wanted += of_the_printed_root(constants, root[rule.c1 > rule.c2], printed)
        names += ["printed_u", "printed_zeta_m"]
    for name, w in (("ahead", root[0] / 2), ("behind", -root[0] / 2)):
        key = f"{name}_slope_1_m"
        slope = _narrow(enclosures, key, SLOPE_NARROW)
        wanted += of_a_deviation(constants, name, root, w, slope)
        names.append(key)
    turn = _narrow_above_0({"turn": _ends_of_the_turn(saved["statements"])}, "turn")
    wanted += of_the_turn(turn)
    zeta = rational(claim["inputs"]["zeta_m"])
    for name, ratio in (("drift", rule.c2 / rule.c1), ("printed_drift", rule.c1 / rule.c2)):
        m = ratio * rule.noise**2 / (4 * zeta**2)
        if evaluate(LEVEL, {"m": decimal(m), "u": decimal(turn[0])}, Decimal) > 0:
            wanted += of_no_drift(name, m, turn)
            continue
        keys = [f"{name}_{side}_m_s" for side in ("low", "high")]
        low, high = (_u_of_drifts(rule, zeta, _narrow_above_0(enclosures, key)) for key in keys)
        wanted += of_two_drifts(name, m, low, high)
        names += keys
    return wanted, names


def _ends_of_the_turn(recorded: list[Json]) -> list[str]:
    """Where (sinh u + u)/u^2 is least is enclosed in the statements only."""
    values = {one["name"]: one.get("values", {}).get("u", "nothing") for one in recorded}
    return [values.get(name, "nothing") for name in ("turn_below", "turn_above")]


def _u_of_drifts(rule: Rule, zeta_m: Fraction, drifts_m_s: Ends) -> Ends:
    """The u of a threshold with other drifts, of which it is a multiple."""
    low, high = (2 * zeta_m * drift / rule.noise**2 for drift in drifts_m_s)
    return low, high


def _narrow_above_0(saved: Json, name: str) -> Ends:
    """Two ends above 0, a relative 1e-12 apart."""
    ends = _narrow(saved, name, NARROW)
    holds("the enclosure is above 0", ends[0] > 0, saved[name], "above 0", about=name)
    return ends


def _narrow(saved: Json, name: str, width: Fraction) -> Ends:
    """Two ends of one sign, at most so far apart, relative to the smaller one."""
    holds("the root is enclosed", name in saved, "nothing", "two ends", about=name)
    low, high = (number(end) for end in saved[name])
    near = min(abs(low), abs(high)) if low * high > 0 else Fraction()
    holds("the enclosure is narrow", 0 < high - low <= near * width, saved[name], f"{float(width)} apart", about=name)
    return low, high


def _enclosure(rule: Rule, saved: Json, name: str, zeta: str, ratio: Fraction) -> Ends:
    """Two ends, a relative 1e-12 apart, between which f changes its sign; and the thresholds that belong to them."""
    low, high = _narrow_above_0(saved, name)
    below, above = rule.residual(low, ratio), rule.residual(high, ratio)
    signs = f"{below:.3e}, {above:.3e}"
    holds("f changes its sign in the enclosure", below < 0 < above, signs, "below 0, above 0", about=name)
    same("thresholds of the enclosure", saved[zeta], [str(rule.zeta_m(end)) for end in (low, high)], about=zeta)
    return low, high


def _the_code_returns_the_root(claim: Json, rule: Rule, ends: Ends) -> Found:
    """The running threshold, and the one in force if it is the Bayes-optimal one, are in the enclosure."""
    low, high = (rule.zeta_m(end) for end in ends)
    running = Fraction(float(claim["evidence"]["running_threshold_m"]))
    values = [running]
    if claim["inputs"]["rule"] == "bayes":
        values.append(Fraction(float(claim["inputs"]["zeta_m"])))
    outside = max(max(low - value, value - high) for value in values)
    for value in values:
        inside = low - NARROW * high <= value <= high + NARROW * high
        between = f"between {float(low)!r} and {float(high)!r}"
        holds("the code's threshold is the root", inside, float(value), between)
    found = Found.with_margin("proved", float(NARROW * high - outside), within=1e-24)
    return found.having_judged("evidence.running_threshold_m")


def _the_root_is_the_minimum(claim: Json, rule: Rule, saved: Json, ends: Ends) -> Found:
    """The root of the printed equation has a larger risk; by at least the margin. With c1 = c2 it is the same root."""
    _risks_are_those_of_their_thresholds(claim, rule, ends)
    facts = {"threshold_in_force_m": claim["inputs"]["zeta_m"]}
    if rule.c1 == rule.c2:
        return Found("proved", facts=facts).having_judged(*RISKS)
    printed = _enclosure(rule, saved, "printed_u", "printed_zeta_m", rule.c1 / rule.c2)
    too_low = rule.c1 < rule.c2
    near, other = (ends[0], printed[1]) if too_low else (ends[1], printed[0])
    apart = other < near if too_low else near < other
    holds("the enclosures are apart", apart, f"{float(other)!r}", f"{'below' if too_low else 'above'} {float(near)!r}")
    return Found.with_margin("proved", float(rule.risk(other) - rule.risk(near)), **facts).having_judged(*RISKS)


RISKS = (
    "evidence.risk_at_the_root", "evidence.threshold_judged_m", "evidence.risk_at_the_threshold_judged",
    "evidence.risk_at_the_threshold_in_force", "evidence.risk_difference_to_the_running_code",
)  # fmt: skip


def _risks_are_those_of_their_thresholds(claim: Json, rule: Rule, ends: Ends) -> None:
    """The threshold judged is the root; the running code's risks there, and at the one in force, are the formula's."""
    evidence, root_m = claim["evidence"], float(rule.zeta_m(ends[0]))
    close("threshold judged", evidence["threshold_judged_m"], root_m, within=SMALL * root_m)
    for place, zeta_m in (
        ("root", root_m), ("threshold_judged", root_m), ("threshold_in_force", claim["inputs"]["zeta_m"]),
    ):  # fmt: skip
        risk = float(rule.risk(rule.u(rational(zeta_m))))
        close("risk", evidence[f"risk_at_the_{place}"], risk, within=SMALL * abs(risk), about=place)
    off = evidence["risk_difference_to_the_running_code"]
    holds("the running risk is the certified one", 0.0 <= off <= SMALL, off, "0 to 1e-9")


def _statements_are_true(wanted: list[Json]) -> None:
    """Signs by evaluation, derivatives by dual numbers at points that follow from the statement's text."""
    for one in wanted:
        if one["kind"] == "sign":
            values = {name: decimal(number(text)) for name, text in one["values"].items()}
            value = evaluate(one["expression"], values, Decimal)
            true = value < 0 if one["sign"] == "<" else value > 0
            sure = abs(value) > Decimal("1e-60")
            holds("a sign is right", true and sure, f"{value:.3e}", f"{one['sign']} 0", about=one["name"])
        else:
            _derivative_is_right(one)


def _derivative_is_right(one: Json) -> None:
    """d function / du = derivative at three points with random coordinates of 64 bits.

    Two rational functions that differ agree at such a point with a probability below 1e-16 (Schwartz and Zippel: the
    degree of the difference over the number of coordinates). The points follow from the texts, so that a run of this
    program can be repeated.
    """
    source = random.Random(hashlib.sha256(repr(sorted(one.items())).encode()).digest())
    for _ in range(3):
        names = sorted({node.id for text in (one["function"], one["derivative"]) for node in _names(text)})
        point = {name: Fraction(source.getrandbits(64) + 2) for name in names}
        rates = {name: evaluate(text, point, Fraction) for name, text in one["rates"].items()}
        dual = {name: Dual(value, rates.get(name, Fraction())) for name, value in point.items()}
        found = evaluate(one["function"], dual, lambda text: Dual(Fraction(text), Fraction())).slope
        claimed = evaluate(one["derivative"], point, Fraction)
        if found != claimed:
            about = f"{one['name']}: {one['function']}"
            raise Disagreement("a derivative is right", one["derivative"], f"another at {point}", about)


def _names(text: str) -> list[ast.Name]:
    return [node for node in ast.walk(_parsed(text)) if isinstance(node, ast.Name)]


def _parsed(text: str) -> ast.AST:
    """The tree of an expression, one of `statements.py`."""
    return ast.parse(text, mode="eval").body


@dataclass(frozen=True)
class Dual:
    """A value and its derivative: a + b e with e^2 = 0."""

    value: Fraction
    slope: Fraction

    def __post_init__(self) -> None:
        """Neither is so long that arithmetic on it would take for ever."""
        bounded(self.value)
        bounded(self.slope)

    def __add__(self, other: Dual) -> Dual:
        return Dual(self.value + other.value, self.slope + other.slope)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Dual) -> Dual:
        return self + -other

    def __mul__(self, other: Dual) -> Dual:
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Dual) -> Dual:
        slope = (self.slope * other.value - self.value * other.slope) / other.value**2
        return Dual(self.value / other.value, slope)


def evaluate(text: str, values: Mapping[str, Any], constant: Callable[[str], Any]) -> Any:
    """An expression in + - * / **, integers, names and exp.

    Args:
        text: the expression.
        values: of its names.
        constant: makes a value of an integer's text.

    Raises:
        Disagreement: if the text is anything else.
    """

    def short(value: Any) -> Any:
        return bounded(value) if isinstance(value, Fraction) else value

    def walk(node: ast.AST) -> Any:
        match node:
            case ast.Constant(int(value)):
                return constant(str(value))
            case ast.Name(name) if name in values:
                return values[name]
            case ast.UnaryOp(ast.USub(), operand):
                return -walk(operand)
            case ast.BinOp(base, ast.Pow(), ast.Constant(int(power))) if 0 < power <= HIGHEST:
                product = factor = walk(base)
                for _ in range(power - 1):
                    product = short(product * factor)
                return product
            case ast.BinOp(left, ast.Add(), right):
                return short(walk(left) + walk(right))
            case ast.BinOp(left, ast.Sub(), right):
                return short(walk(left) - walk(right))
            case ast.BinOp(left, ast.Mult(), right):
                return short(walk(left) * walk(right))
            case ast.BinOp(left, ast.Div(), right):
                return short(walk(left) / walk(right))
            case ast.Call(ast.Name("exp"), [argument], []):
                return walk(argument).exp()
        raise Disagreement("an expression has + - * / **, integers, names and exp", text, "nothing else")

    return walk(_parsed(text))
