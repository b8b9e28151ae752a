"""Claims that are theorems of Coq: their hypotheses, from the scenario, and what is recorded of them.

That Coq has checked the theorems is taken as recorded: `airground prove` checks them again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import NamedTuple

from .files import Json
from .rules import SMALL, Found, agrees, close, holds, same
from .scenario import disturbance_m_s, kinds_of, levels_of, rational, threshold_m
from .triggers import refuted_zeno_proof

DIGITS = 100
SHORTEST_S = 1e-3
"""Bound that ZENO-PROOF tries where the scenario has none."""
NARROW = Fraction(1, 10**12)
"""Enclosures are at most this wide, and the program's threshold at most this far outside, relative."""
LAYERS = ("SAFE-INV", "SAFE-GATE")


class Margin(NamedTuple):
    """How far a hypothesis is from failing. `strict`: whether 0 fails. `own`: whether it is the claim's margin."""

    value: Fraction
    strict: bool = False
    own: bool = False

    @property
    def holds(self) -> bool:
        """Whether the scenario meets the hypothesis."""
        return self.value > 0 if self.strict else self.value >= 0


def theorem(claim: Json, scenario: Json) -> Found:
    """The hypotheses have the recorded margins, and the verdict follows from them."""
    evidence = claim["evidence"]
    margins = HYPOTHESES[claim["id"]](claim, scenario)
    recorded = evidence["hypotheses"]
    same("number of hypotheses", len(recorded), len(margins))
    for each, margin in zip(recorded, margins, strict=True):
        agrees("margin of a hypothesis", each["margin"], float(margin.value), within=SMALL, about=each["says"])
        same("whether a hypothesis holds", each["holds"], margin.holds, about=each["says"])
    keys = [f"evidence.hypotheses.*.{key}" for key in ("hypothesis", "says", "margin", "unit", "holds")]
    if all(margin.holds for margin in margins):
        found = Found.with_margin("proved", min(float(margin.value) for margin in margins if margin.own))
    else:
        broken = next(float(margin.value) for margin in margins if not margin.holds)
        found = Found.with_margin("inconclusive", broken)
        if claim["id"] == "ZENO-PROOF" and claim["status"] == "refuted":
            bound = float(scenario["decision"]["min_inter_event_s"] or SHORTEST_S)
            found = refuted_zeno_proof(claim, levels_of(scenario), bound, broken)
    return _with_numbers(found.counted(len(margins)).having_judged(*keys), claim, scenario)


def _with_numbers(found: Found, claim: Json, scenario: Json) -> Found:
    """What follows from the theorems with the scenario's numbers."""
    match claim["id"]:
        case "SAFE-DIST" if scenario["control"]["avoidance_gain_1_s"] > 0.0:
            least: dict[str, float] = {}
            for kind in kinds_of(scenario):
                left = float(_left_m(scenario, kind.safe_m, kind.share))
                least[_kind(kind.name)] = min(left, least.get(_kind(kind.name), left))
            return found.also(least_distances_m=least)
        case "ZENO-PROOF":
            dwell = rational(levels_of(scenario).dwell_s)
            most = int(rational(scenario["duration_s"]) // dwell) + 1 if dwell > 0 else None
            bound = float(scenario["decision"]["min_inter_event_s"] or SHORTEST_S)
            return found.also(bound_s=bound, most_triggers=most)
        case "LIVE-GATE":
            gain, lag = scenario["control"]["intervention_gain_1_s"], scenario["gatekeeper"]["lag_m"]
            return found.also(disturbance_m_s=float(rational(gain) * rational(lag)))
        case "LIVE-WAIT":
            gate = scenario["gatekeeper"]
            bound = float(gate["tries"] * (rational(gate["longest_s"]) + rational(gate["period_s"])))
            return found.also(bound_s=bound, given_back_after_s=float(gate["behind_s"] + gate["period_s"]))
    return found


def _kind(name: str) -> str:
    """The name of a kind of pairs without its number."""
    return name.rstrip("0123456789").rstrip("_")


def _left_m(scenario: Json, safe_m: float, share: float) -> Fraction:
    """d - W/A."""
    pushed = rational(disturbance_m_s(scenario)) / rational(share)
    return rational(safe_m) - pushed / rational(scenario["control"]["avoidance_gain_1_s"])


def _stable(scenario: Json) -> list[Margin]:
    gain, period = (rational(scenario["control"][name]) for name in ("avoidance_gain_1_s", "period_s"))
    return [Margin(1 - gain * period), Margin(gain), Margin(period, strict=True)]


def _lemma(claim: Json, scenario: Json) -> list[Margin]:
    return [Margin(rational(kind.safe_m), strict=True, own=True) for kind in kinds_of(scenario)]


def _layer(claim: Json, scenario: Json) -> list[Margin]:
    """A h is at most 1, shares add up, the sensing range is long enough; method (d) has avoidance above all else."""
    period, reach = (rational(scenario["control"][name]) for name in ("period_s", "sensing_range_m"))
    kinds = kinds_of(scenario)
    names = {_kind(kind.name) for kind in kinds}
    spare = [Margin(reach - rational(kind.safe_m) - rational(kind.closing_m_s) * period, own=True) for kind in kinds]
    order = [Margin(Fraction(0))] * (claim["id"] == "SAFE-GATE")
    return [*_stable(scenario), *[Margin(Fraction(0))] * len(names), *spare, *order]


def _disturbed(claim: Json, scenario: Json) -> list[Margin]:
    gain = rational(scenario["control"]["avoidance_gain_1_s"])
    kinds = kinds_of(scenario) if gain > 0 else []
    left = [Margin(_left_m(scenario, kind.safe_m, kind.share), strict=True, own=True) for kind in kinds]
    return [*_stable(scenario), Margin(gain, strict=True), *left]


def _zeno(claim: Json, scenario: Json) -> list[Margin]:
    levels = levels_of(scenario)
    dwell = rational(levels.dwell_s)
    bound = rational(scenario["decision"]["min_inter_event_s"])
    spare = rational(levels.zeta_m) - rational(levels.release_m)
    return [Margin(dwell - bound), Margin(dwell, strict=True, own=True), Margin(spare)]


def _isolated(claim: Json, scenario: Json) -> list[Margin]:
    steps = rational(scenario["decision"]["noise_period_s"]) / rational(scenario["control"]["period_s"])
    return [Margin(rational(threshold_m(scenario)), strict=True, own=True), Margin(-(steps % 1)), Margin(steps - 1)]


def _patient(claim: Json, scenario: Json) -> list[Margin]:
    longest, period, behind = (rational(scenario["gatekeeper"][name]) for name in ("longest_s", "period_s", "behind_s"))
    return [Margin(longest, strict=True, own=True), Margin(period, strict=True), Margin(behind)]


def _followed(claim: Json, scenario: Json) -> list[Margin]:
    gain, period = (rational(scenario["control"][name]) for name in ("intervention_gain_1_s", "period_s"))
    lag, behind = (rational(scenario["gatekeeper"][name]) for name in ("lag_m", "behind_s"))
    positive = [Margin(value, strict=True) for value in (period, lag, behind)]
    return [Margin(1 - gain * period, own=True), Margin(gain), *positive]


def _root(claim: Json, scenario: Json) -> list[Margin]:
    """The constants are positive; the recorded enclosures have the root of (19) between them, and the threshold."""
    rule = scenario["decision"]["threshold"]
    drift, noise, c1, c2 = (rational(rule[name]) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    low_m, high_m = _enclosed(claim, "", drift, noise, c2 / c1)
    computed = [Fraction(float(claim["evidence"]["computed_threshold_m"]))] if claim["id"] == "THR-ROOT" else []
    computed += [Fraction(float(claim["inputs"]["zeta_m"]))] if rule["rule"] == "bayes" else []
    for zeta in computed:
        slack = 4 * NARROW * high_m
        inside = low_m - slack <= zeta <= high_m + slack
        holds("the program's threshold is the root", inside, float(zeta), f"{float(low_m)!r} to {float(high_m)!r}")
    recorded = [Fraction(each["margin"]) for each in claim["evidence"]["hypotheses"]]
    found = [Margin(number, strict=True) for number in (drift, noise, c1, c2)]
    found += [Margin(Fraction(1), strict=True)] * 2
    if claim["id"] == "THR-ROOT":
        return [*found, Margin(recorded[6], own=True)]
    found.append(Margin(recorded[6]))
    if c1 == c2:
        return [*found, Margin(Fraction(0), own=True)]
    _enclosed(claim, "printed_", drift, noise, c1 / c2)
    return [*found, *[Margin(Fraction(1), strict=True)] * 2, Margin(recorded[-1], strict=True, own=True)]


def _enclosed(claim: Json, prefix: str, drift: Fraction, noise: Fraction, ratio: Fraction) -> tuple[Fraction, Fraction]:
    """The recorded ends, widened by their rounding, have a sign change of noise^2/drift^2 (sinh u + u) - ratio."""
    ends = claim["evidence"]["enclosures"]
    low, high = (Fraction(float(end)) for end in ends[f"{prefix}u"])
    low, high = low * (1 - Fraction(1, 2**50)), high * (1 + Fraction(1, 2**50))
    holds("the enclosure is narrow", 0 < high - low <= 2 * NARROW * low, str(ends), "1e-12 apart", about=prefix)
    with localcontext(prec=DIGITS):
        signs = []
        for u in (low, high):
            x = Decimal(u.numerator) / u.denominator
            k, r = (Decimal(value.numerator) / value.denominator for value in (noise**2 / drift**2, ratio))
            signs.append(k * ((x.exp() - (-x).exp()) / 2 + x) - r)
    holds(
        "(19) changes its sign in the enclosure", signs[0] < 0 < signs[1], str([*map(float, signs)]), "below, above 0"
    )
    zeta = low * noise**2 / (2 * drift), high * noise**2 / (2 * drift)
    close(
        "thresholds of the enclosure", ends[f"{prefix}zeta_m"], [*map(float, zeta)], within=SMALL * float(zeta[1]),
        about=prefix,
    )  # fmt: skip
    return zeta


HYPOTHESES: Mapping[str, Callable[[Json, Json], list[Margin]]] = {
    "SAFE-LEMMA": _lemma,
    **dict.fromkeys(LAYERS, _layer),
    "SAFE-DIST": _disturbed,
    "ZENO-PROOF": _zeno,
    "THR-ISO": _isolated,
    "LIVE-WAIT": _patient,
    "LIVE-GATE": _followed,
    "THR-ROOT": _root,
    "THR-OPT": _root,
}
