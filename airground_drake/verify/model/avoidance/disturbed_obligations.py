"""The obligations of one disturbed control period, symbolic and with a scenario's numbers."""

from __future__ import annotations

from fractions import Fraction

from airground_drake.verify.engines.obligation import Obligation, Term, rational
from airground_drake.verify.engines.rewriting import constant, resolved, terms, with_numbers
from airground_drake.verify.model.avoidance.constants import Inputs, kinds
from airground_drake.verify.model.avoidance.obligations import DEFICIT, EXCESS, REST, S


def disturbed() -> list[Obligation]:
    """One disturbed control period, symbolic in A, h, d and W; goals about d - W/A are multiplied by A."""
    h, free = {"h": "h"}, {"A": "A", "W": "W", "stable": "1 - A*h"}
    inside = {**S, **REST, **free, **DEFICIT, "bounded": "A*(D - d) + W"}
    of = ("D", "r", "s", "d", "h", "A", "W")
    pair = ("D", "ri", "rj", "s", "d", "h", "A", "W")
    goal, pair_goal = "A*(D + s*r - s*W - d) + W", "A*(D + s*(ri + rj) - s*W - d) + W"
    outside = {**S, **REST, **EXCESS}
    kept = terms("stable bounded", "A rest bounded")
    return [
        Obligation(
            "push", "||q|| <= K = s W: n.q >= -K, with P = n.q and Q = q.q (Lagrange, ||n|| = 1: P^2 <= Q)",
            ("P", "Q", "K"), "P + K", hypotheses={"lagrange": "Q - P**2", "small": "K**2 - Q"}, strict={"K": "K"},
            multiplier=terms("2 K"), certificate=(Term(square="P + K"), *terms("small", "lagrange")),
        ),
        Obligation(
            "outside_loss", "D >= d and r >= -(D - d)/h: D + s (r - W) >= d - h W", ("D", "r", "s", "d", "h", "W"),
            "D + s*r - s*W - d + h*W", hypotheses={**outside, "W": "W", "rule": "h*r + (D - d)"}, strict=h,
            multiplier=terms("h"), certificate=terms("s rule", "rest excess", "h W rest"),
        ),
        Obligation(
            "outside_bound", "the same with A h <= 1: D + s (r - W) >= d - W/A", of, goal,
            hypotheses={**outside, **free, "rule": "h*r + (D - d)"}, strict=h, multiplier=terms("h"),
            certificate=terms("A s rule", "A rest excess", "A h W rest", "h W stable"),
        ),
        Obligation(
            "inside_bound", "d - W/A <= D <= d and r >= A (d - D): D + s (r - W) >= d - W/A", of, goal,
            hypotheses={**inside, "rule": "r - A*(d - D)"}, certificate=(*kept, *terms("A s rule")),
        ),
        Obligation(
            "deficit", "D <= d and r >= A (d - D): the deficit after the period is at most (1 - A h)(d - D) + h W", of,
            "(1 - A*h)*(d - D) + h*W - (d - D - h*(r - W))", hypotheses={**DEFICIT, "rule": "r - A*(d - D)"}, strict=h,
            certificate=terms("h rule"),
        ),
        Obligation(
            "approach", "deficit c <= (1 - g) W/A, g = k^N, k = 1 - A h: after one more period <= (1 - k g) W/A",
            ("c", "g", "k", "A", "W"), "W*(1 - k*g) - (k*A*c + (1 - k)*W)",
            hypotheses={"k": "k", "bounded": "W*(1 - g) - A*c"}, certificate=terms("k bounded"),
        ),
        Obligation(
            "pair_outside_bound", "two robots, D >= d, each speed >= -(D - d)/(2h), A h <= 1: never below d - W/A",
            pair, pair_goal, strict=h, multiplier=terms("2 h"),
            hypotheses={**outside, **free, "rule_i": "2*h*ri + (D - d)", "rule_j": "2*h*rj + (D - d)"},
            certificate=terms("A s rule_i", "A s rule_j", "2 A rest excess", "2 A h W rest", "2 h W stable"),
        ),
        Obligation(
            "pair_inside_bound", "two robots, d - W/A <= D <= d, each >= A (d - D)/2: never below d - W/A", pair,
            pair_goal, hypotheses={**inside, "rule_i": "2*ri - A*(d - D)", "rule_j": "2*rj - A*(d - D)"},
            certificate=(*kept, *terms("1/2 A s rule_i", "1/2 A s rule_j")),
        ),
        Obligation(
            "overhead_bound", "UAV straight over a UGV, which cannot move along n: only the UAV is disturbed along n, "
            "by w = W/2, and its half restores: never below d - W/A", of, "A*(D + s*r - s*W/2 - d) + W",
            hypotheses={**inside, "rule": "2*r - A*(d - D)"},
            certificate=terms("1/2 bounded", "1/2 stable bounded", "1/2 A rest bounded", "1/2 A s rule"),
        ),
        Obligation(
            "unseen_bound", "beyond the range R >= d + c h at the sample, closing at c at most: never below d - W/A",
            (*of, "R", "c"), goal,
            hypotheses={**S, **REST, **free, "far": "D - R", "covers": "R - d - c*h", "fastest": "r + c", "c": "c"},
            certificate=terms("A far", "A covers", "A s fastest", "A c rest", "W stable", "A W rest"),
        ),
        Obligation(
            "feasible_near", "n.g >= m > 0, deficit c <= W/A: v = (W/m) g has n.v >= A c", ("ng", "m", "c", "A", "W"),
            "W*ng - m*A*c", hypotheses={"W": "W", "direction": "ng - m", "bounded": "W - A*c"}, strict={"m": "m"},
            certificate=terms("W direction", "m bounded"),
        ),
        Obligation(
            "feasible_far", "D - d >= h W/m: v = (W/m) g, ||g|| = 1, has n.v >= -(D - d)/h",
            ("ng", "m", "D", "d", "h", "W"), "h*W*ng + m*(D - d)",
            hypotheses={"W": "W", "h": "h", "unit": "ng + 1", "room": "m*(D - d) - h*W"},
            certificate=terms("room", "h W unit"),
        ),
    ]  # fmt: skip


def disturbed_with_scenario(inputs: Inputs) -> list[Obligation]:
    """The invariance of d - W/A again, for each kind of pair, with the scenario's numbers."""
    gain = inputs["avoidance_gain_1_s"]
    period = inputs["period_s"]
    found = []
    names = {each.name: each for each in disturbed()}
    for kind in kinds(inputs):
        push = pushed(inputs, kind.share)
        numbers = {"d": kind.safe, "h": period, "A": gain, "W": push}
        prefix = "" if kind.share == 1.0 else "pair_"
        found += [
            resolved(with_numbers(names[f"{prefix}{name}_bound"], kind.name, numbers), "stable")
            for name in ("outside", "inside")
        ]
        seen = {**numbers, "R": inputs["sensing_range_m"], "c": kind.closing}
        found.append(resolved(resolved(with_numbers(names["unseen_bound"], kind.name, seen), "stable"), "covers"))
        left = Fraction(rational(gain)) * Fraction(rational(kind.safe)) - Fraction(rational(push))
        found.append(constant(f"positive_{kind.name}", "A d >= W: robots stay apart, so that n is defined", left))
    return found


def pushed(inputs: Inputs, share: float) -> float:
    """W, m/s: one disturbance beside an obstacle, two between robots."""
    return float(inputs["disturbance_m_s"]) / share
