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
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from airground_drake.nsbc.avoidance import HalfSpaces, limit_speed
from airground_drake.nsbc.task import Array
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.invariance import (
    DEFICIT,
    EXCESS,
    REST,
    SEED,
    Inputs,
    S,
    broken,
    conformance,
    constant,
    constants,
    dropped,
    flipped,
    kinds,
    nearest,
    rates,
    resolved,
    running_avoidance,
    running_team,
    unit,
    with_numbers,
    without,
)
from airground_drake.verify.obligation import Obligation, Term, rational
from airground_drake.verify.prover import discharge, finding
from airground_drake.verify.verdict import Finding, ModelClaim

LIMIT_S = 10.0
TOLERANCE = 1e-9
"""For distances, m, and inequalities, m/s, of the disturbed runs: thousands of rounded steps err by 1e-12."""
STEPS = 250
"""Control periods of each disturbed run."""
ATTACKS = ("pinned", "idle", "switching", "random")


# ------------------------------------------------------------------------------------------------ obligations


def disturbed() -> list[Obligation]:
    """One disturbed control period, symbolic in A, h, d and W; goals about d - W/A are multiplied by A."""
    h, free = {"h": "h"}, {"A": "A", "W": "W", "stable": "1 - A*h"}
    inside = {**S, **REST, **free, **DEFICIT, "bounded": "A*(D - d) + W"}
    of, pair = ("D", "r", "s", "d", "h", "A", "W"), ("D", "ri", "rj", "s", "d", "h", "A", "W")
    goal, pair_goal = "A*(D + s*r - s*W - d) + W", "A*(D + s*(ri + rj) - s*W - d) + W"
    outside = {**S, **REST, **EXCESS}
    kept = (Term("1", ("stable", "bounded")), Term("1", ("A", "rest", "bounded")))
    return [
        Obligation(
            "push", "||q|| <= K = s W: n.q >= -K, with P = n.q and Q = q.q (Lagrange, ||n|| = 1: P^2 <= Q)",
            ("P", "Q", "K"), "P + K", hypotheses={"lagrange": "Q - P**2", "small": "K**2 - Q"}, strict={"K": "K"},
            multiplier=(Term("2", ("K",)),),
            certificate=(Term(square="P + K"), Term("1", ("small",)), Term("1", ("lagrange",))),
        ),
        Obligation(
            "outside_loss", "D >= d and r >= -(D - d)/h: D + s (r - W) >= d - h W", ("D", "r", "s", "d", "h", "W"),
            "D + s*r - s*W - d + h*W", hypotheses={**outside, "W": "W", "rule": "h*r + (D - d)"}, strict=h,
            multiplier=(Term("1", ("h",)),),
            certificate=(Term("1", ("s", "rule")), Term("1", ("rest", "excess")), Term("1", ("h", "W", "rest"))),
        ),
        Obligation(
            "outside_bound", "the same with A h <= 1: D + s (r - W) >= d - W/A", of, goal,
            hypotheses={**outside, **free, "rule": "h*r + (D - d)"}, strict=h, multiplier=(Term("1", ("h",)),),
            certificate=(
                Term("1", ("A", "s", "rule")), Term("1", ("A", "rest", "excess")), Term("1", ("A", "h", "W", "rest")),
                Term("1", ("h", "W", "stable")),
            ),
        ),
        Obligation(
            "inside_bound", "d - W/A <= D <= d and r >= A (d - D): D + s (r - W) >= d - W/A", of, goal,
            hypotheses={**inside, "rule": "r - A*(d - D)"}, certificate=(*kept, Term("1", ("A", "s", "rule"))),
        ),
        Obligation(
            "deficit", "D <= d and r >= A (d - D): the deficit after the period is at most (1 - A h)(d - D) + h W", of,
            "(1 - A*h)*(d - D) + h*W - (d - D - h*(r - W))", hypotheses={**DEFICIT, "rule": "r - A*(d - D)"}, strict=h,
            certificate=(Term("1", ("h", "rule")),),
        ),
        Obligation(
            "approach", "deficit c <= (1 - g) W/A, g = k^N, k = 1 - A h: after one more period <= (1 - k g) W/A",
            ("c", "g", "k", "A", "W"), "W*(1 - k*g) - (k*A*c + (1 - k)*W)",
            hypotheses={"k": "k", "bounded": "W*(1 - g) - A*c"}, certificate=(Term("1", ("k", "bounded")),),
        ),
        Obligation(
            "pair_outside_bound", "two robots, D >= d, each speed >= -(D - d)/(2h), A h <= 1: never below d - W/A",
            pair, pair_goal, strict=h, multiplier=(Term("2", ("h",)),),
            hypotheses={**outside, **free, "rule_i": "2*h*ri + (D - d)", "rule_j": "2*h*rj + (D - d)"},
            certificate=(
                Term("1", ("A", "s", "rule_i")), Term("1", ("A", "s", "rule_j")), Term("2", ("A", "rest", "excess")),
                Term("2", ("A", "h", "W", "rest")), Term("2", ("h", "W", "stable")),
            ),
        ),
        Obligation(
            "pair_inside_bound", "two robots, d - W/A <= D <= d, each >= A (d - D)/2: never below d - W/A", pair,
            pair_goal, hypotheses={**inside, "rule_i": "2*ri - A*(d - D)", "rule_j": "2*rj - A*(d - D)"},
            certificate=(*kept, Term("1/2", ("A", "s", "rule_i")), Term("1/2", ("A", "s", "rule_j"))),
        ),
        Obligation(
            "overhead_bound", "UAV straight over a UGV, which cannot move along n: only the UAV is disturbed along n, "
            "by w = W/2, and its half restores: never below d - W/A", of, "A*(D + s*r - s*W/2 - d) + W",
            hypotheses={**inside, "rule": "2*r - A*(d - D)"},
            certificate=(
                Term("1/2", ("bounded",)), *(replace(term, coefficient="1/2") for term in kept),
                Term("1/2", ("A", "s", "rule")),
            ),
        ),
        Obligation(
            "unseen_bound", "beyond the range R >= d + c h at the sample, closing at c at most: never below d - W/A",
            (*of, "R", "c"), goal,
            hypotheses={
                **S, **REST, **free, "far": "D - R", "covers": "R - d - c*h", "fastest": "r + c", "c": "c",
            },
            certificate=(
                Term("1", ("A", "far")), Term("1", ("A", "covers")), Term("1", ("A", "s", "fastest")),
                Term("1", ("A", "c", "rest")), Term("1", ("W", "stable")), Term("1", ("A", "W", "rest")),
            ),
        ),
        Obligation(
            "feasible_near", "n.g >= m > 0, deficit c <= W/A: v = (W/m) g has n.v >= A c", ("ng", "m", "c", "A", "W"),
            "W*ng - m*A*c", hypotheses={"W": "W", "direction": "ng - m", "bounded": "W - A*c"}, strict={"m": "m"},
            certificate=(Term("1", ("W", "direction")), Term("1", ("m", "bounded"))),
        ),
        Obligation(
            "feasible_far", "D - d >= h W/m: v = (W/m) g, ||g|| = 1, has n.v >= -(D - d)/h",
            ("ng", "m", "D", "d", "h", "W"), "h*W*ng + m*(D - d)",
            hypotheses={"W": "W", "h": "h", "unit": "ng + 1", "room": "m*(D - d) - h*W"},
            certificate=(Term("1", ("room",)), Term("1", ("h", "W", "unit"))),
        ),
    ]  # fmt: skip


def with_scenario(inputs: Inputs, names: dict[str, Obligation]) -> list[Obligation]:
    """The invariance of d - W/A again, for each kind of pair, with the scenario's numbers."""
    gain, period, found = inputs["gain_1_s"], inputs["period_s"], []
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


# ------------------------------------------------------------------------------------------------ disturbed runs


@dataclass(frozen=True)
class Scene:
    """A safe start of a team of the running code; `positions` (n + 1, 3), m."""

    name: str
    team: Team
    positions: Array


def scenes(inputs: Inputs) -> list[Scene]:
    """Safe starts, from one obstacle to a field of them.

    In `squeezed` a UGV has no room between another and an obstacle: there the inequalities contradict each other.
    """
    team, far = running_team(inputs, ugvs=2), np.array([0.0, 0.0, 1e3])
    d, dd, low = team.obstacle_distance, team.ugv_distance, team.air_ground_distance
    first = replace(team, ugvs=team.ugvs[:1], max_speed=team.max_speed[[0, -1]])
    turn = np.deg2rad([90.0, 210.0, 330.0])
    triangle = d * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(3)])
    rng = np.random.default_rng(SEED)
    field = np.column_stack([rng.uniform(-3.0 * d, 3.0 * d, (10, 2)), np.zeros(10)])
    field = field[np.linalg.norm(field, axis=1) >= 1.2 * d]

    def alone(name: str, obstacles: list[list[float]] | Array, ugv: list[float], uav: Array = far) -> Scene:
        around = np.array(obstacles, dtype=np.float64).reshape(-1, 3)
        return Scene(name, replace(first, obstacles=around), np.array([ugv, uav]))

    found = [
        alone("obstacle", [[0.0, 0.0, 0.0]], [1.01 * d, 0.0, 0.0]),
        alone("notch", [[-0.8 * d, 0.0, 0.0], [0.8 * d, 0.0, 0.0]], [0.0, 0.7 * d, 0.0]),
        alone("gap", [[-d, 0.0, 0.0], [d, 0.0, 0.0]], [0.0, 0.0, 0.0]),
        alone("triangle", triangle, [0.0, 0.0, 0.0]),
        alone("uav_low", [], [0.0, 0.0, 0.0], np.array([0.1 * low, 0.0, 1.01 * low])),
    ]
    if len(team.ugvs) == 2:
        two = np.array([[0.0, 0.0, 0.0], [1.1 * dd, 0.0, 0.0], far])
        found.append(Scene("ugv_pair", replace(team, obstacles=np.zeros((0, 3))), two))
        between = np.array([[d, 0.0, 0.0], [d + dd, 0.0, 0.0], far])
        found.append(Scene("squeezed", replace(team, obstacles=np.zeros((1, 3))), between))
    return [*found, alone("field", field, [0.0, 0.0, 0.0], np.array([0.0, 0.0, max(d, low)]))]


Edit = Callable[[HalfSpaces], HalfSpaces]


def attack(
    inputs: Inputs,
    scene: Scene,
    how: str,
    *,
    edit: Edit = lambda spaces: spaces,
    force: float = 1.0,
    pairs: float = 2.0,
) -> Inputs:
    """One disturbed run of the running layer, every robot of the team driven and disturbed; exact motion.

    Args:
        inputs: constants, with the disturbance's bound.
        scene: the start.
        how: 'pinned': velocities below the layer and disturbances both towards what has the least excess; 'idle': the
            disturbance alone; 'switching': both towards a point that changes every 20 periods; 'random'.
        edit: a mutation of the inequalities.
        force: a mutation: size of the disturbance over its bound.
        pairs: disturbances that the bound counts between robots.

    Returns:
        `worst_margin_m` (least distance minus d - W/A), where; `unmet`, the inequalities that the layer's velocity
        missed by more than 1e-9 m/s; `uncovered`, robots and points that went below the bound after such a miss;
        `broken`, those that did so although all their own inequalities had been met.
    """
    rng = np.random.default_rng([SEED, ATTACKS.index(how)])
    team, positions, avoidance = scene.team, scene.positions.copy(), running_avoidance(inputs)
    neighbourhood, mobility, n = team.neighbourhood(slice(None)), team.mobility, len(team.robots)
    m, w, h, rows = len(team.obstacles), inputs["disturbance_m_s"], avoidance.period, np.arange(n)
    added = np.where(neighbourhood.share < 1.0, pairs, 1.0) * w
    bound = neighbourhood.distance - added / avoidance.gain
    met = np.ones(bound.shape, dtype=bool)  # all inequalities of this pair so far
    worst, unmet, shortfall, broke, uncovered = np.inf, 0, 0.0, 0, 0
    where: dict[str, Any] = {}
    target = rng.integers(bound.shape[1], size=n)
    for k in range(STEPS):
        around = neighbourhood.around(positions)
        x = positions[:, None] - around.centre
        reach = np.linalg.norm(x, axis=-1)
        if how != "switching":
            target = np.argmin(reach - around.distance, axis=1)
        elif k % 20 == 0:
            target = rng.integers(bound.shape[1], size=n)
        inward = -x[rows, target] / reach[rows, target][:, None]
        wanted, push = (unit(rng, n), unit(rng, n)) if how == "random" else (inward, inward)
        wanted = wanted * mobility * (0.0 if how == "idle" else 100.0)
        spaces = edit(avoidance.half_spaces(positions, mobility, around))
        velocity = avoidance.apply(limit_speed(wanted, team.max_speed), spaces)
        short = np.where(np.isfinite(spaces.bound), spaces.bound - rates(spaces.normal, velocity), -np.inf)
        unmet, shortfall = unmet + int((short > TOLERANCE).sum()), max(shortfall, float(short.max()))
        met &= short <= TOLERANCE
        moved = velocity + force * w * push * mobility
        others = np.zeros(x.shape)
        others[:, m:] = moved[neighbourhood.others]
        least = nearest(x, moved[:, None] - others, h)
        both = met.copy()
        for i in range(n):  # a pair needs both robots' halves
            for j, other in enumerate(neighbourhood.others[i]):
                both[i, m + j] &= met[other, m + int(np.flatnonzero(neighbourhood.others[other] == i)[0])]
        below = least < bound - TOLERANCE
        broke, uncovered = broke + int((below & both).sum()), uncovered + int((below & ~both).sum())
        i, j = divmod(int(np.argmin(least - bound)), bound.shape[1])
        if least[i, j] - bound[i, j] < worst:
            worst = float(least[i, j] - bound[i, j])
            where = {
                "scene": scene.name, "attack": how, "robot": team.robots[i], "t_s": k * h,
                "distance_m": float(least[i, j]), "bound_m": float(bound[i, j]),
                "safe_distance_m": float(around.distance[i, j]),
                "positions_m": positions.tolist(), "avoided_m": around.centre[i, j].tolist(),
                "velocity_with_disturbance_m_s": moved[i].tolist(),
            }  # fmt: skip
        positions = positions + h * moved
    return {
        "worst_margin_m": worst, "where": where, "unmet": unmet, "worst_shortfall_m_s": shortfall,
        "broken": broke, "uncovered": uncovered,
    }  # fmt: skip


def campaign(inputs: Inputs) -> list[Inputs]:
    """Every scene under every attack: one row for each scene."""
    rows = []
    for scene in scenes(inputs):
        runs = [attack(inputs, scene, how) for how in ATTACKS]
        worst = min(runs, key=lambda run: float(run["worst_margin_m"]))
        total = {name: sum(run[name] for run in runs) for name in ("unmet", "broken", "uncovered")}
        shortfall = max(run["worst_shortfall_m_s"] for run in runs)
        row = {"scene": scene.name, "steps": STEPS * len(runs), **worst, **total}
        rows.append({**row, "worst_shortfall_m_s": shortfall})
    return rows


# ------------------------------------------------------------------------------------------------ claim


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
        return given | {"disturbance_m_s": min(tenth, given["gain_1_s"] * least / 4.0)}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, run the attacks; margin: the worst of runs whose inequalities were all met, m."""
        if not inputs["disturbance_m_s"] > 0.0:
            return Finding("inconclusive", evidence={"reason": "without a gain A > 0 nothing restores a distance"})
        symbolic, compared, rows = disturbed(), conformance(inputs), campaign(inputs)
        bounds = {kind.name: kind.safe - pushed(inputs, kind.share) / inputs["gain_1_s"] for kind in kinds(inputs)}
        found = finding(
            discharge([*symbolic, *with_scenario(inputs, {each.name: each for each in symbolic})], LIMIT_S),
            disturbance_m_s=inputs["disturbance_m_s"], least_distances_m=bounds, runs=rows, conformance=compared,
        )  # fmt: skip
        covered = [row for row in rows if not row["unmet"]] or rows
        worst = min(covered, key=lambda row: float(row["worst_margin_m"]))
        where: dict[str, Any] = {name: worst["where"][name] for name in ("scene", "attack", "robot", "t_s")}
        found = replace(found, margin=worst["worst_margin_m"], unit="m", where=where)
        if found.status == "proved" and any(row["broken"] for row in rows):
            return replace(found, status="refuted", counterexample=next(row for row in rows if row["broken"]))
        if found.status == "proved" and not compared["agrees"]:
            return replace(found, status="refuted", counterexample=compared["first_difference"] or compared)
        return found


# ------------------------------------------------------------------------------------------------ mutants


def _bound(inputs: Inputs, name: str) -> Obligation:
    """An obligation of `disturbed` with the numbers of a kind of pair that it is about."""
    kind = next(k for k in (*kinds(inputs), kinds(inputs)[0]) if (k.share < 1.0) == name.startswith("pair_"))
    numbers = {"d": kind.safe, "h": inputs["period_s"], "A": inputs["gain_1_s"], "W": pushed(inputs, kind.share)}
    return with_numbers(next(each for each in disturbed() if each.name == name), kind.name, numbers)


def _scene(inputs: Inputs, name: str) -> Scene:
    return next(scene for scene in scenes(inputs) if scene.name == name)


def _flipped(inputs: Inputs) -> Finding:
    given = _bound(inputs, "inside_bound")
    rule = {"rule": f"-({given.hypotheses['rule']})"}
    mutant = replace(given, hypotheses={**given.hypotheses, **rule}, says="r <= A (d - D): never below d - W/A")
    return broken(mutant, attack(inputs, _scene(inputs, "obstacle"), "pinned", edit=flipped))


def _large_gain(inputs: Inputs) -> Finding:
    changed = {**inputs, "gain_1_s": 4.0 / inputs["period_s"]}
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
    goal = f"{given.goal} - {rational(inputs['gain_1_s'])}*s*({W})"
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
