"""The obligations of one control period under the avoidance inequalities, symbolic and with a scenario's numbers."""

from __future__ import annotations

from fractions import Fraction

from airground_drake.verify.engines.obligation import Obligation, rational
from airground_drake.verify.engines.rewriting import constant, resolved, terms, with_numbers
from airground_drake.verify.model.avoidance.constants import Inputs, kinds
from airground_drake.verify.model.avoidance.lemma import V, dot

LIMIT_S = 10.0
"""For one solver call, s; they take milliseconds."""
S = {"s": "s"}
REST = {"rest": "h - s"}
EXCESS = {"excess": "D - d"}
DEFICIT = {"deficit": "d - D"}


def step() -> list[Obligation]:
    """One control period, symbolic in A, h and d: obstacle, pair, planar robot, recovery, what is not seen."""
    of = ("D", "r", "s", "d", "h")
    h = {"h": "h"}
    gain = {"A": "A"}
    pair = ("D", "ri", "rj", "s", "d", "h")
    recovers = {**gain, **DEFICIT, "rule": "r - A*(d - D)"}
    return [
        Obligation(
            "outside", "obstacle, D >= d and r >= -(D - d)/h: D + s r >= d", of, "D + s*r - d",
            hypotheses={**S, **REST, **EXCESS, "rule": "h*r + (D - d)"}, strict=h, multiplier=terms("h"),
            certificate=terms("s rule", "rest excess"),
        ),
        Obligation(
            "inside", "obstacle, D <= d and r >= A (d - D): D + s r >= D, never worse (and >= d where D = d)",
            ("D", "r", "s", "d", "A"), "s*r", hypotheses={**S, **recovers}, certificate=terms("s rule", "s A deficit"),
        ),
        Obligation(
            "restores", "D <= d and r >= A (d - D): the deficit after the period is at most (1 - A h)(d - D)",
            (*of, "A"), "(1 - A*h)*(d - D) - (d - D - h*r)", hypotheses=recovers, strict=h, certificate=terms("h rule"),
        ),
        Obligation(
            "no_overshoot", "A h <= 1 and r = A (d - D), D <= d: the recovery does not lead beyond d",
            ("D", "r", "d", "h", "A"), "d - D - h*r", hypotheses={**DEFICIT, "stable": "1 - A*h"}, strict=h,
            equations={"rule": "r - A*(d - D)"}, certificate=terms("stable deficit"),
            equation_multipliers={"rule": "-h"},
        ),
        Obligation(
            "pair_outside", "two robots, D >= d, each radial speed >= -(D - d)/(2h): D + s (ri + rj) >= d",
            pair, "D + s*(ri + rj) - d", strict=h, multiplier=terms("2 h"),
            hypotheses={**S, **REST, **EXCESS, "rule_i": "2*h*ri + (D - d)", "rule_j": "2*h*rj + (D - d)"},
            certificate=terms("s rule_i", "s rule_j", "2 rest excess"),
        ),
        Obligation(
            "pair_inside", "two robots, D <= d, each radial speed >= A (d - D)/2: never closer",
            ("D", "ri", "rj", "s", "d", "A"), "s*(ri + rj)",
            hypotheses={**S, **gain, **DEFICIT, "rule_i": "2*ri - A*(d - D)", "rule_j": "2*rj - A*(d - D)"},
            certificate=terms("1/2 s rule_i", "1/2 s rule_j", "s A deficit"),
        ),
        Obligation(
            "pair_restores", "two robots, each radial speed >= A (d - D)/2: the deficit shrinks by 1 - A h as for one",
            (*pair, "A"), "(1 - A*h)*(d - D) - (d - D - h*(ri + rj))", strict=h,
            hypotheses={**gain, **DEFICIT, "rule_i": "2*ri - A*(d - D)", "rule_j": "2*rj - A*(d - D)"},
            certificate=terms("1/2 h rule_i", "1/2 h rule_j"),
        ),
        Obligation(
            "planar", "v3 = 0: an inequality with the z of n dropped says the same of n.v", ("n1", "n2", "n3", *V, "b"),
            f"{dot(('n1', 'n2', 'n3'), V)} - b", hypotheses={"rule": "n1*v1 + n2*v2 - b"}, equations={"plane": "v3"},
            certificate=terms("rule"), equation_multipliers={"plane": "n3"},
        ),
        Obligation(
            "unseen", "beyond the range R >= d + c h at the sample, closing at c at most: not within d before the next",
            (*of, "R", "c"), "D + s*r - d",
            hypotheses={**S, **REST, "far": "D - R", "covers": "R - d - c*h", "fastest": "r + c", "c": "c"},
            certificate=terms("far", "covers", "s fastest", "c rest"),
        ),
    ]  # fmt: skip


def scaling() -> list[Obligation]:
    """A velocity scaled by sigma <= min b/r over what it violates meets every inequality with b <= 0."""
    sigma = {"sigma": "sigma", "at_most_1": "1 - sigma", "feasible": "-b"}
    return [
        Obligation(
            "scaling_keeps", "b <= 0 and r >= b: sigma r >= b for sigma in [0, 1]", ("r", "b", "sigma"), "sigma*r - b",
            hypotheses={**sigma, "held": "r - b"}, certificate=terms("sigma held", "at_most_1 feasible"),
        ),
        Obligation(
            "scaling_mends", "r < b <= 0 and sigma <= ratio = b/r: sigma r >= b", ("r", "b", "sigma", "ratio"),
            "sigma*r - b", hypotheses={**sigma, "least": "ratio - sigma"}, strict={"violated": "b - r"},
            equations={"ratio": "ratio*r - b"}, equation_multipliers={"ratio": "1"},
            certificate=terms("least violated", "least feasible"),
        ),
    ]  # fmt: skip


def rest() -> list[Obligation]:
    """From a safe state v = 0 meets every inequality, whatever the share."""
    share, h = {"q": "q"}, {"h": "h"}
    return [
        Obligation(
            "zero_outside", "D >= d: the bound b = -q (D - d)/h is <= 0, so v = 0 meets it", ("D", "d", "h", "q", "b"),
            "-b", hypotheses={**share, **EXCESS}, strict=h, equations={"bound": "h*b + q*(D - d)"},
            multiplier=terms("h"), certificate=terms("q excess"), equation_multipliers={"bound": "-1"},
        ),
        Obligation(
            "zero_at_distance", "D = d: the bound b = q A (d - D) is 0, so v = 0 meets it", ("D", "d", "A", "q", "b"),
            "-b", equations={"bound": "b - q*A*(d - D)", "at": "D - d"},
            equation_multipliers={"bound": "-1", "at": "q*A"},
        ),
    ]  # fmt: skip


def gate() -> list[Obligation]:
    """What makes the layer's output safe whatever its input: v = 0 is feasible, scaling ends there, no speeding up."""
    return [
        *rest(),
        *scaling(),
        Obligation(
            "no_faster", "p closest to u among feasible v has (u - p).(0 - p) <= 0, as 0 is feasible: |p| <= |u|; with "
            "U = u.u, P = p.p, C = u.p and (u - p).(u - p) = U - 2 C + P >= 0", ("U", "P", "C"), "U - P",
            hypotheses={"square": "U - 2*C + P", "closest": "C - P"}, certificate=terms("square", "2 closest"),
        ),
    ]  # fmt: skip


def with_scenario(inputs: Inputs) -> list[Obligation]:
    """Those of `step` again, for each kind of pair, with the scenario's numbers."""
    names = {each.name: each for each in step()}
    gain = inputs["avoidance_gain_1_s"]
    period = inputs["period_s"]
    reach = inputs["sensing_range_m"]
    found = [constant("stable", "A h <= 1", 1 - Fraction(rational(gain)) * Fraction(rational(period)))]
    for kind in kinds(inputs):
        numbers = {"d": kind.safe, "h": period, "A": gain}
        prefix = "" if kind.share == 1.0 else "pair_"
        found += [with_numbers(names[f"{prefix}{name}"], kind.name, numbers) for name in ("outside", "inside")]
        seen = with_numbers(names["unseen"], kind.name, {"d": kind.safe, "h": period, "R": reach, "c": kind.closing})
        found.append(resolved(seen, "covers"))
    return found
