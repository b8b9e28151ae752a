"""SAFE-DIST: what is left of the safe distance when velocities are disturbed.

Symbols are those of `invariance.py`; besides, every robot moves with v + e(t), ||e(t)|| <= w, instead of v, and W is
what the disturbances of a pair add up to: w beside an obstacle, 2 w between robots. In a period the disturbance
displaces by q, ||q|| <= s W, so that D(s) >= D + s r + n.q >= D + s (r - W). From this, with A h <= 1:

    outside, D >= d:            D(s) >= d - h W,
    inside, deficit c = d - D:  c after the period <= (1 - A h) c + h W, and c <= W/A stays so during the period.

Hence c <= (1 - (1 - A h)^N) W/A after N periods inside in a row: h W after one, W/A in the limit, never more. The
certificates are `obligations.json` and `<obligation>.smt2`, as `obligation.py` describes them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import Finding, ModelClaim
from airground_drake.verify.engines.obligation import Obligation, Term, rational
from airground_drake.verify.engines.prover import discharge, finding
from airground_drake.verify.engines.rewriting import constant, resolved, terms, with_numbers, without
from airground_drake.verify.model.avoidance.conformance import conformance
from airground_drake.verify.model.avoidance.constants import Inputs, constants, kinds
from airground_drake.verify.model.avoidance.disturbed_runs import Scene, attack, campaign, scenes
from airground_drake.verify.model.avoidance.mutants import broken, dropped, flipped
from airground_drake.verify.model.avoidance.obligations import DEFICIT, EXCESS, LIMIT_S, REST, S


def disturbed() -> list[Obligation]:
    """One disturbed control period, symbolic in A, h, d and W; goals about d - W/A are multiplied by A."""
    h, free = {"h": "h"}, {"A": "A", "W": "W", "stable": "1 - A*h"}
    inside = {**S, **REST, **free, **DEFICIT, "bounded": "A*(D - d) + W"}
    of, pair = ("D", "r", "s", "d", "h", "A", "W"), ("D", "ri", "rj", "s", "d", "h", "A", "W")
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


def with_scenario(inputs: Inputs) -> list[Obligation]:
    """The invariance of d - W/A again, for each kind of pair, with the scenario's numbers."""
    gain, period, found = inputs["avoidance_gain_1_s"], inputs["period_s"], []
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


class SafeDist(ModelClaim):
    """SAFE-DIST."""

    id = "SAFE-DIST"
    statement = (
        "If velocities are disturbed by at most w and A h <= 1, no distance falls below d - w/A (obstacle) or "
        "d - 2 w/A (two disturbed robots), as long as its own inequality is met at every sample. Starting at D >= d it "
        "is d - h W after one period and d - (1 - (1 - A h)^N) W/A after N periods inside in a row, W = w or 2 w. "
        "With several points, each with D >= d - W/A, all inequalities can be met at once if there is a unit vector g "
        "with n.g >= m > 0 for every point with D < d + h W/m; then all these bounds are kept together."
    )
    formula = "A h <= 1, ||e|| <= w, D(0) >= d - W/A, inequality met at each sample => D(t) >= d - W/A for all t"
    method = (
        "Polynomial certificates in D, r, s, A, h, d, W, and again with the scenario's numbers; z3 and cvc5 on the "
        "negations. Besides, disturbed runs of the running layer from safe starts in several geometries, pinned, "
        "switching and random: a distance below the bound with all its inequalities met refutes the claim."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "SAFE-LEMMA; the disturbance may change at any time, but is bounded by w in every direction (for a UGV: in its "
        "plane).",
        "Inside a safe distance v = 0 is not feasible, and the inequalities of several points can contradict each "
        "other; the layer then takes the least violation. So: one violated inequality at a time, or a common direction "
        "g as in the statement. The evidence counts where a run did not meet this (`unmet`); a UGV straight under the "
        "UAV never can, but there its disturbance does not count either, and the UAV's half does (`overhead_bound`).",
        "w is 10 % of the largest speed limit, but at most A/4 times the smallest safe distance, so that at least half "
        "of it is left. It is a choice, not a property of a robot.",
        "Positions are measured exactly and without delay.",
        "While two of them are out of sensing range, robots ask for no more than their speed limits, to which w comes "
        "on top. The layer itself may ask for more within a safe distance of something else.",
    )
    does_not_establish = (
        "That the disturbance of a real robot stays below w; nor anything where inequalities contradict each other: a "
        "disturbed robot can press another, whose half of the pair's inequality has no room, into an obstacle (scene "
        "`squeezed` of the evidence, as far as contact). It does not bound how long a robot stays inside the safe "
        "distance, nor how fast it recovers: the layer's velocities there are not limited."
    )

    def inputs(self, scenario: Scenario) -> Inputs:
        """The constants of SAFE-INV, and the bound on the disturbance, m/s."""
        given = constants(scenario)
        least = min(kind.safe for kind in kinds(given))
        tenth = 0.1 * max(given["team"]["max_speed"])
        return given | {"disturbance_m_s": min(tenth, given["avoidance_gain_1_s"] * least / 4.0)}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, run the attacks; margin: the worst of runs whose inequalities were all met, m."""
        if not inputs["disturbance_m_s"] > 0.0:
            return Finding("inconclusive", evidence={"reason": "without a gain A > 0 nothing restores a distance"})
        compared, rows = conformance(inputs), campaign(inputs)
        bounds = {
            kind.name: kind.safe - pushed(inputs, kind.share) / inputs["avoidance_gain_1_s"] for kind in kinds(inputs)
        }
        found = finding(
            discharge([*disturbed(), *with_scenario(inputs)], LIMIT_S),
            disturbance_m_s=inputs["disturbance_m_s"], least_distances_m=bounds, runs=rows, conformance=compared,
        )  # fmt: skip
        covered = [row for row in rows if not row["unmet"]]
        if not covered:
            reason = "no disturbed run met the inequalities, so that none says anything"
            return replace(found, status="inconclusive", evidence={**found.evidence, "reason": reason})
        worst = min(covered, key=lambda row: float(row["worst_margin_m"]))
        where: dict[str, Any] = {name: worst["where"][name] for name in ("scene", "attack", "robot", "t_s")}
        found = replace(found, margin=worst["worst_margin_m"], unit="m", where=where)
        if found.status == "proved" and any(row["broken"] for row in rows):
            return replace(found, status="refuted", counterexample=next(row for row in rows if row["broken"]))
        if found.status == "proved" and worst["worst_margin_m"] < -1e-9:
            return replace(found, status="refuted", counterexample=worst)
        if found.status == "proved" and not compared["agrees"]:
            return replace(found, status="refuted", counterexample=compared["first_difference"] or compared)
        return found


def _bound(inputs: Inputs, name: str) -> Obligation:
    """An obligation of `disturbed` with the numbers of a kind of pair that it is about."""
    kind = next(k for k in (*kinds(inputs), kinds(inputs)[0]) if (k.share < 1.0) == name.startswith("pair_"))
    numbers = {
        "d": kind.safe,
        "h": inputs["period_s"],
        "A": inputs["avoidance_gain_1_s"],
        "W": pushed(inputs, kind.share),
    }
    return with_numbers(next(each for each in disturbed() if each.name == name), kind.name, numbers)


def _scene(inputs: Inputs, name: str) -> Scene:
    return next(scene for scene in scenes(inputs) if scene.name == name)


def _flipped(inputs: Inputs) -> Finding:
    given = _bound(inputs, "inside_bound")
    rule = {"rule": f"-({given.hypotheses['rule']})"}
    mutant = replace(given, hypotheses={**given.hypotheses, **rule}, says="r <= A (d - D): never below d - W/A")
    return broken(mutant, attack(inputs, _scene(inputs, "obstacle"), "pinned", edit=flipped))


def _large_gain(inputs: Inputs) -> Finding:
    changed = {**inputs, "avoidance_gain_1_s": 4.0 / inputs["period_s"]}
    mutant = without(_bound(changed, "outside_bound"), "stable", "A h = 4: never below d - W/A")
    return broken(mutant, attack(changed, _scene(inputs, "obstacle"), "pinned"))


def _dropped(inputs: Inputs) -> Finding:
    mutant = without(_bound(inputs, "inside_bound"), "rule", "without the inequality for this obstacle")
    return broken(mutant, attack(inputs, _scene(inputs, "notch"), "pinned", edit=dropped([True, False, False])))


def _one_of_two(inputs: Inputs) -> Finding:
    given = _bound(inputs, "pair_inside_bound")
    W = rational(2.0 * inputs["disturbance_m_s"])
    mutant = replace(
        given, goal=f"{given.goal} - ({W})/2", certificate=(), says="two disturbed robots: never below d - w/A",
        hypotheses={**given.hypotheses, "bounded": f"{given.hypotheses['bounded']} - ({W})/2"},
    )  # fmt: skip
    return broken(mutant, attack(inputs, _scene(inputs, "uav_low"), "pinned", pairs=1.0))


def _stronger(inputs: Inputs) -> Finding:
    given = _bound(inputs, "inside_bound")
    W = rational(inputs["disturbance_m_s"])
    goal = f"{given.goal} - {rational(inputs['avoidance_gain_1_s'])}*s*({W})"
    mutant = replace(given, goal=goal, certificate=(), says="a disturbance of 2 w: never below d - w/A")
    return broken(mutant, attack(inputs, _scene(inputs, "obstacle"), "pinned", force=2.0))


MUTANTS: dict[str, Callable[[Inputs], Finding]] = {
    "SAFE-DIST: sign of the inequality flipped": _flipped,
    "SAFE-DIST: gain too large, A h = 4": _large_gain,
    "SAFE-DIST: one inequality dropped": _dropped,
    "SAFE-DIST: only one robot of a pair counted as disturbed": _one_of_two,
    "SAFE-DIST: disturbance twice the bound": _stronger,
}
"""Broken variants; each takes the inputs of SAFE-DIST and is refuted."""
