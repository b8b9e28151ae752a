"""SAFE-LEMMA, SAFE-INV and SAFE-GATE: why no sampled step of set-based avoidance leaves the safe set.

Symbols, in proofs and in their texts: a robot at x relative to what it avoids, at distance D = ||x||, with unit
vector n = x/D and velocity v, has the radial speed r = n.v; E = ||x + s v|| is the distance after s, 0 <= s <= h; d is
the safe distance, A the gain, h the control period, q the share of an inequality (1 obstacle, 1/2 robot of a pair), b
its bound. SAFE-LEMMA is E >= D + s r; everything else is about the numbers D, r, s.

Certificate files: `obligations.json` and `<obligation>.smt2` as `obligation.py` describes them, and from SAFE-LEMMA
`gram.json`: {"polynomial": text, "monomials": [9 texts z_a], "gram": G, "lower": L, "diagonal": [9 numbers]}, all
numbers rational as texts. To check: z.G z expands to the polynomial; G = L diag(diagonal) L^T; L is lower triangular
with 1 on its diagonal; no entry of `diagonal` is negative. So G is positive semidefinite and the polynomial >= 0.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy as np
import sympy

from airground_drake.diagram import build_model, make_team
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc import kernels
from airground_drake.nsbc.avoidance import Avoidance, Composition, HalfSpaces, Surroundings
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.task import Array
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import UgvController
from airground_drake.verify.obligation import Obligation, Term, rational
from airground_drake.verify.prover import discharge, finding
from airground_drake.verify.verdict import Finding, ModelClaim

Inputs = dict[str, Any]

ROUNDOFF = 2.0**-53
"""Unit roundoff u of binary64: every operation returns its exact result times 1 + e, |e| <= u."""
STEPS_PER_PERIOD = 64
"""Integration steps into which events may cut a control period, for the bound on rounding; 13 have been seen, where
a witness function was isolated."""
SEED = 20211209
LIMIT_S = 10.0
"""For one solver call, s; they take milliseconds."""


# ------------------------------------------------------------------------------------------------ constants


def constants(scenario: Scenario) -> Inputs:
    """Constants of the running team and avoidance layer, strict JSON: what all claims of this module are about."""
    team, control = make_team(scenario), scenario.control
    points = [p for ugv in scenario.ugvs.values() for p in (ugv.start_m, ugv.target_m, *ugv.preset.waypoints_m)]
    points += [scenario.uav.start_m, *(obstacle.position_m for obstacle in scenario.obstacles.values())]
    travelled = float(team.max_speed.max()) * scenario.duration_s
    return {
        "gain_1_s": control.avoidance_gain_1_s,
        "period_s": control.period_s,
        "sensing_range_m": control.sensing_range_m,
        "motion_gain_1_s": control.motion_gain_1_s,
        "intervention_gain_1_s": control.intervention_gain_1_s,
        "duration_s": scenario.duration_s,
        "extent_m": max(abs(c) for point in points for c in point) + travelled,
        "team": {
            "ugvs": list(team.ugvs),
            "uav": team.uav,
            "obstacles": team.obstacles.tolist(),
            "obstacle_distance": team.obstacle_distance,
            "ugv_distance": team.ugv_distance,
            "air_ground_distance": team.air_ground_distance,
            "max_speed": team.max_speed.tolist(),
        },
    }


@dataclass(frozen=True)
class Kind:
    """A kind of pair: safe distance m, largest closing speed m/s, share of the inequality that each robot takes."""

    name: str
    safe: float
    closing: float
    share: float


def kinds(inputs: Inputs) -> list[Kind]:
    """The kinds of pairs in a team, each with its fastest members; shares are those of the running code."""
    team = running_team(inputs)
    ugvs = sorted(team.max_speed[:-1].tolist(), reverse=True)
    share = team.neighbourhood(slice(None)).share[0]
    uav, m = float(team.max_speed[-1]), len(team.obstacles)
    found = [Kind("uav_ugv", team.air_ground_distance, uav + ugvs[0], float(share[m]))]
    if m:
        found.insert(0, Kind("obstacle", team.obstacle_distance, max(uav, ugvs[0]), float(share[0])))
    if len(ugvs) > 1:
        found.append(Kind("ugv_ugv", team.ugv_distance, ugvs[0] + ugvs[1], float(share[m])))
    return found


def running_team(inputs: Inputs, ugvs: int | None = None) -> Team:
    """The team of the inputs, or its first so many UGVs and the UAV."""
    given = inputs["team"]
    count = len(given["ugvs"]) if ugvs is None else min(ugvs, len(given["ugvs"]))
    speed = np.array([*given["max_speed"][:count], given["max_speed"][-1]])
    obstacles = np.array(given["obstacles"], dtype=np.float64).reshape(-1, 3)
    changed = {"ugvs": tuple(given["ugvs"][:count]), "obstacles": obstacles, "max_speed": speed}
    return Team(**(given | changed))


def running_avoidance(inputs: Inputs, composition: Composition = "augmented") -> Avoidance:
    """The avoidance layer with the constants of the inputs."""
    return Avoidance(inputs["gain_1_s"], inputs["period_s"], inputs["sensing_range_m"], composition)


# ------------------------------------------------------------------------------------------------ obligations

X, V = ("x1", "x2", "x3"), ("v1", "v2", "v3")
MINORS = ("x1*v2 - x2*v1", "x1*v3 - x3*v1", "x2*v3 - x3*v2")
S, REST, EXCESS, DEFICIT = {"s": "s"}, {"rest": "h - s"}, {"excess": "D - d"}, {"deficit": "d - D"}


def dot(a: Sequence[str], b: Sequence[str]) -> str:
    """a.b as a text."""
    return "(" + " + ".join(f"({p})*({q})" for p, q in zip(a, b, strict=True)) + ")"


def lemma() -> list[Obligation]:
    """||x + s v|| >= ||x|| + s (x.v)/||x||, with r = (x.v)/D and Q = v.v in its last two steps."""
    end = tuple(f"{x} + s*{v}" for x, v in zip(X, V, strict=True))
    difference = f"{dot(X, X)}*{dot(V, V)} - {dot(X, V)}**2"
    square = "E**2 - D**2 - 2*s*D*r - s**2*Q"
    numbers = ("D", "E", "r", "Q", "s")
    given = {**S, "distance": "E"}
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
            certificate=(Term("1", ("lagrange",), "s"),),
            multiplier=(Term("1", ("D", "D", "distance")), Term("1", ("D", "D", "level"))),
            equation_multipliers={"square": "D**2"},
        ),
        Obligation(
            "backward", "where D + s r <= 0: E >= 0 >= D + s r", numbers, "E - D - s*r",
            hypotheses={**given, "level": "-D - s*r"}, strict={"D": "D"}, equations={"square": square},
            certificate=(Term("1", ("distance",)), Term("1", ("level",))),
        ),
    ]  # fmt: skip


def step() -> list[Obligation]:
    """One control period, symbolic in A, h and d: obstacle, pair, planar robot, recovery, what is not seen."""
    of, h, gain = ("D", "r", "s", "d", "h"), {"h": "h"}, {"A": "A"}
    pair = ("D", "ri", "rj", "s", "d", "h")
    recovers = {**gain, **DEFICIT, "rule": "r - A*(d - D)"}
    return [
        Obligation(
            "outside", "obstacle, D >= d and r >= -(D - d)/h: D + s r >= d", of, "D + s*r - d",
            hypotheses={**S, **REST, **EXCESS, "rule": "h*r + (D - d)"}, strict=h, multiplier=(Term("1", ("h",)),),
            certificate=(Term("1", ("s", "rule")), Term("1", ("rest", "excess"))),
        ),
        Obligation(
            "inside", "obstacle, D <= d and r >= A (d - D): D + s r >= D, never worse (and >= d where D = d)",
            ("D", "r", "s", "d", "A"), "s*r", hypotheses={**S, **recovers},
            certificate=(Term("1", ("s", "rule")), Term("1", ("s", "A", "deficit"))),
        ),
        Obligation(
            "restores", "D <= d and r >= A (d - D): the deficit after the period is at most (1 - A h)(d - D)",
            (*of, "A"), "(1 - A*h)*(d - D) - (d - D - h*r)", hypotheses=recovers, strict=h,
            certificate=(Term("1", ("h", "rule")),),
        ),
        Obligation(
            "no_overshoot", "A h <= 1 and r = A (d - D), D <= d: the recovery does not lead beyond d",
            ("D", "r", "d", "h", "A"), "d - D - h*r", hypotheses={**DEFICIT, "stable": "1 - A*h"}, strict=h,
            equations={"rule": "r - A*(d - D)"}, certificate=(Term("1", ("stable", "deficit")),),
            equation_multipliers={"rule": "-h"},
        ),
        Obligation(
            "pair_outside", "two robots, D >= d, each radial speed >= -(D - d)/(2h): D + s (ri + rj) >= d",
            pair, "D + s*(ri + rj) - d", strict=h, multiplier=(Term("2", ("h",)),),
            hypotheses={**S, **REST, **EXCESS, "rule_i": "2*h*ri + (D - d)", "rule_j": "2*h*rj + (D - d)"},
            certificate=(Term("1", ("s", "rule_i")), Term("1", ("s", "rule_j")), Term("2", ("rest", "excess"))),
        ),
        Obligation(
            "pair_inside", "two robots, D <= d, each radial speed >= A (d - D)/2: never closer",
            ("D", "ri", "rj", "s", "d", "A"), "s*(ri + rj)",
            hypotheses={**S, **gain, **DEFICIT, "rule_i": "2*ri - A*(d - D)", "rule_j": "2*rj - A*(d - D)"},
            certificate=(
                Term("1/2", ("s", "rule_i")), Term("1/2", ("s", "rule_j")), Term("1", ("s", "A", "deficit"))
            ),
        ),
        Obligation(
            "planar", "v3 = 0: an inequality with the z of n dropped says the same of n.v", ("n1", "n2", "n3", *V, "b"),
            f"{dot(('n1', 'n2', 'n3'), V)} - b", hypotheses={"rule": "n1*v1 + n2*v2 - b"}, equations={"plane": "v3"},
            certificate=(Term("1", ("rule",)),), equation_multipliers={"plane": "n3"},
        ),
        Obligation(
            "unseen", "beyond the range R >= d + c h at the sample, closing at c at most: not within d before the next",
            (*of, "R", "c"), "D + s*r - d",
            hypotheses={**S, **REST, "far": "D - R", "covers": "R - d - c*h", "fastest": "r + c", "c": "c"},
            certificate=(
                Term("1", ("far",)), Term("1", ("covers",)), Term("1", ("s", "fastest")), Term("1", ("c", "rest"))
            ),
        ),
    ]  # fmt: skip


def scaling() -> list[Obligation]:
    """A velocity scaled by sigma <= min b/r over what it violates meets every inequality with b <= 0."""
    sigma = {"sigma": "sigma", "at_most_1": "1 - sigma", "feasible": "-b"}
    return [
        Obligation(
            "scaling_keeps", "b <= 0 and r >= b: sigma r >= b for sigma in [0, 1]", ("r", "b", "sigma"), "sigma*r - b",
            hypotheses={**sigma, "held": "r - b"},
            certificate=(Term("1", ("sigma", "held")), Term("1", ("at_most_1", "feasible"))),
        ),
        Obligation(
            "scaling_mends", "r < b <= 0 and sigma <= ratio = b/r: sigma r >= b", ("r", "b", "sigma", "ratio"),
            "sigma*r - b", hypotheses={**sigma, "least": "ratio - sigma"}, strict={"violated": "b - r"},
            equations={"ratio": "ratio*r - b"}, equation_multipliers={"ratio": "1"},
            certificate=(Term("1", ("least", "violated")), Term("1", ("least", "feasible"))),
        ),
    ]  # fmt: skip


def gate() -> list[Obligation]:
    """What makes the layer's output safe whatever its input: v = 0 is feasible, scaling ends there, no speeding up."""
    share, h = {"q": "q"}, {"h": "h"}
    return [
        Obligation(
            "zero_outside", "D >= d: the bound b = -q (D - d)/h is <= 0, so v = 0 meets it", ("D", "d", "h", "q", "b"),
            "-b", hypotheses={**share, **EXCESS}, strict=h, equations={"bound": "h*b + q*(D - d)"},
            multiplier=(Term("1", ("h",)),), certificate=(Term("1", ("q", "excess")),),
            equation_multipliers={"bound": "-1"},
        ),
        Obligation(
            "zero_at_distance", "D = d: the bound b = q A (d - D) is 0, so v = 0 meets it", ("D", "d", "A", "q", "b"),
            "-b", equations={"bound": "b - q*A*(d - D)", "at": "D - d"},
            equation_multipliers={"bound": "-1", "at": "q*A"},
        ),
        *scaling(),
        Obligation(
            "no_faster", "p closest to u among feasible v has (u - p).(0 - p) <= 0, as 0 is feasible: |p| <= |u|; with "
            "U = u.u, P = p.p, C = u.p and (u - p).(u - p) = U - 2 C + P >= 0", ("U", "P", "C"), "U - P",
            hypotheses={"square": "U - 2*C + P", "closest": "C - P"},
            certificate=(Term("1", ("square",)), Term("2", ("closest",))),
        ),
    ]  # fmt: skip


def with_numbers(obligation: Obligation, suffix: str, numbers: Mapping[str, float]) -> Obligation:
    """The same obligation with rational numbers in place of some variables."""
    pattern = re.compile(r"\b(" + "|".join(numbers) + r")\b")

    def put(text: str) -> str:
        return pattern.sub(lambda found: f"({rational(numbers[found[0]])})", text)

    def put_all(texts: Mapping[str, str]) -> dict[str, str]:
        return {name: put(text) for name, text in texts.items()}

    return replace(
        obligation,
        name=f"{obligation.name}_{suffix}",
        says=f"{obligation.says}; numbers of {suffix}: " + ", ".join(f"{k} = {v:.9g}" for k, v in numbers.items()),
        variables=tuple(name for name in obligation.variables if name not in numbers),
        goal=put(obligation.goal),
        hypotheses=put_all(obligation.hypotheses),
        strict=put_all(obligation.strict),
        equations=put_all(obligation.equations),
        certificate=tuple(replace(term, square=put(term.square)) for term in obligation.certificate),
        equation_multipliers=put_all(obligation.equation_multipliers),
    )


def constant(name: str, says: str, value: Fraction) -> Obligation:
    """A number of the scenario is >= 0; where it is not, that is a counterexample and no missing premise."""
    return Obligation(name, says, ("h",), str(value), certificate=(Term(str(value)),))


def with_scenario(inputs: Inputs, names: Mapping[str, Obligation]) -> list[Obligation]:
    """Those of `step` again, for each kind of pair, with the scenario's numbers."""
    gain, period, reach = inputs["gain_1_s"], inputs["period_s"], inputs["sensing_range_m"]
    stable = 1 - Fraction(rational(gain)) * Fraction(rational(period))
    found = [constant("stable", "A h <= 1", stable)]
    for kind in kinds(inputs):
        numbers = {"d": kind.safe, "h": period, "A": gain}
        prefix = "" if kind.share == 1.0 else "pair_"
        found += [with_numbers(names[f"{prefix}{name}"], kind.name, numbers) for name in ("outside", "inside")]
        seen = with_numbers(names["unseen"], kind.name, {"d": kind.safe, "h": period, "R": reach, "c": kind.closing})
        found.append(resolved(seen, "covers"))
    return found


def resolved(obligation: Obligation, name: str) -> Obligation:
    """The obligation with a hypothesis that is a number moved into the coefficients of its certificate.

    So a number that is negative refutes the goal, instead of making the hypotheses contradictory.
    """
    value = Fraction(str(sympy.sympify(obligation.hypotheses[name])))
    terms = tuple(
        replace(t, coefficient=str(Fraction(t.coefficient) * value), factors=tuple(f for f in t.factors if f != name))
        if name in t.factors else t
        for t in obligation.certificate
    )  # fmt: skip
    kept = {other: text for other, text in obligation.hypotheses.items() if other != name}
    return replace(obligation, hypotheses=kept, certificate=terms)


def range_spare(inputs: Inputs, kind: Kind) -> Fraction:
    """R - d - c h, m."""
    reach, closing = rational(inputs["sensing_range_m"]), rational(kind.closing)
    return Fraction(reach) - Fraction(rational(kind.safe)) - Fraction(closing) * Fraction(rational(inputs["period_s"]))


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


# ------------------------------------------------------------------------------------------------ running kernels

Relation = Callable[[Fraction, Fraction, Fraction, Fraction, Fraction], Fraction]


def relation(D: Fraction, d: Fraction, share: Fraction, gain: Fraction, period: Fraction) -> Fraction:
    """The bound on n.v, m/s, as the obligations encode it."""
    return share * gain * (d - D) if d >= D else -share * (D - d) / period


def conformance(inputs: Inputs, encoded: Relation = relation, count: int = 600) -> dict[str, Any]:
    """Compare the encoded relation, in exact arithmetic, with what `fill_half_spaces` computes.

    With e = D - d, rounding changes D by 3.5u, e by 3.5u D + u e, the bound by 2u more; a normal by 5.5u. So bounds
    may differ by 8u share max(A, 1/h) max(D, d) (the maximum, as rounding may take the other branch at D = d) and
    components of normals by 6u times themselves.

    Args:
        inputs: constants of the running code.
        encoded: the relation to compare with.
        count: number of points, from inside the safe distance to beyond the sensing range, many at D = d.

    Returns:
        Evidence; `agrees` is the verdict, and ratios are differences over what rounding may do.
    """
    rng = np.random.default_rng(SEED)
    avoidance, kind = running_avoidance(inputs), [(k.safe, k.share) for k in kinds(inputs)]
    safe, share = np.array(kind)[rng.integers(len(kind), size=count)].T
    factor = rng.choice([0.0, 1e-15, 1e-9, 1.0], count) * rng.uniform(-1.0, 1.0, count)
    reach = np.where(rng.random(count) < 0.1, 2.0 * avoidance.sensing_range, safe * (1.0 + 0.9 * factor))
    position = rng.uniform(-20.0, 20.0, 3)
    around = Surroundings((position - reach[:, None] * unit(rng, count))[None], safe[None], share[None])
    mobility = np.array([1.0, 1.0, 0.0])
    spaces = avoidance.half_spaces(position[None], mobility[None], around)
    h, gain = Fraction(rational(avoidance.period)), Fraction(rational(avoidance.gain))
    u, steep, unseen = Fraction(ROUNDOFF), max(gain, 1 / h), 0
    worst = {"bound": 0.0, "normal": 0.0}
    first: dict[str, Any] | None = None
    for k in range(count):
        x = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(position, around.centre[0, k], strict=True)]
        D, d, part = root(sum((c * c for c in x), Fraction(0))), Fraction(float(safe[k])), Fraction(float(share[k]))
        bound, normal = float(spaces.bound[0, k]), spaces.normal[0, k]
        off = [abs(Fraction(float(normal[a])) * D / x[a] - int(mobility[a])) for a in range(3)]
        worst["normal"] = max(worst["normal"], float(max(off) / (6 * u)))
        hidden = Fraction(avoidance.sensing_range) < D
        unseen += hidden
        if hidden or bound == -np.inf:
            ratio = 0.0 if hidden and bound == -np.inf else 1e300
        else:
            ratio = float(abs(Fraction(bound) - encoded(D, d, part, gain, h)) / (8 * u * part * steep * max(D, d)))
        worst["bound"] = max(worst["bound"], ratio)
        if ratio > 1.0 and first is None:
            first = {"D_m": float(D), "d_m": float(d), "share": float(part), "bound_of_kernel_m_s": str(bound)}
    agrees = all(ratio <= 1.0 for ratio in worst.values())
    return {"agrees": agrees, "points": count, "unseen": unseen, "worst_ratio": worst, "first_difference": first}


def root(square: Fraction) -> Fraction:
    """Square root, rounded down, of relative error below 1e-40 (for squares above 1e-40)."""
    scale = 10**60
    return Fraction(isqrt(square.numerator * square.denominator * scale * scale), square.denominator * scale)


def unit(rng: np.random.Generator, count: int) -> Array:
    """Random unit vectors, (count, 3)."""
    found = rng.normal(size=(count, 3))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return found


@dataclass(frozen=True)
class States:
    """n robots, each with K points around it (unused ones out of range), none inside its safe distance.

    Attributes:
        position: (n, 3), m.
        mobility: (n, 3).
        around: K points each.
        lower: hostile velocities of the lower priorities, (n, 3), m/s.
    """

    position: Array
    mobility: Array
    around: Surroundings
    lower: Array


def safe_states(inputs: Inputs, count: int, most: int = 12) -> States:
    """Deterministic states with 1 to `most` points, many at exactly the safe distance; velocities up to 1e6 m/s."""
    rng = np.random.default_rng(SEED)
    avoidance, kind = running_avoidance(inputs), np.array([(k.safe, k.share) for k in kinds(inputs)])
    safe, share = np.moveaxis(kind[rng.integers(len(kind), size=(count, most))], -1, 0)
    position = rng.uniform(-20.0, 20.0, (count, 3))
    mobility = np.where(rng.random((count, 1)) < 0.5, [1.0, 1.0, 0.0], 1.0)
    away = unit(rng, count * most).reshape(count, most, 3)
    excess = rng.choice([0.0, 0.0, 1e-12, 1.0], (count, most)) * 10.0 ** rng.uniform(-6.0, 0.5, (count, most))
    used = np.arange(most) < rng.integers(1, most + 1, (count, 1))
    reach = np.where(used, safe + excess, 10.0 * avoidance.sensing_range + safe)
    around = Surroundings(position[:, None] - reach[..., None] * away, safe, share)
    grow = 4.0 * ROUNDOFF
    while (inside := avoidance.half_spaces(position, mobility, around).bound > 0.0).any():  # by rounding
        reach, grow = np.where(inside, reach * (1.0 + grow), reach), 2.0 * grow
        around = replace(around, centre=position[:, None] - reach[..., None] * away)
    towards = -np.take_along_axis(away, rng.integers(1, most + 1, (count, 1, 1)) % used.sum(1)[:, None, None], 1)[:, 0]
    between = -(away * used[..., None]).sum(axis=1)
    how = rng.integers(3, size=(count, 1))
    lower = np.where(how == 0, towards, np.where(how == 1, between, unit(rng, count)))
    return States(position, mobility, around, lower * mobility * 10.0 ** rng.uniform(-3.0, 6.0, (count, 1)))


Layer = Callable[[Avoidance, Array, HalfSpaces], Array]


def through(avoidance: Avoidance, lower: Array, spaces: HalfSpaces) -> Array:
    """The running layer."""
    return avoidance.apply(lower, spaces)


def unscaled(avoidance: Avoidance, lower: Array, spaces: HalfSpaces) -> Array:
    """A broken layer: the projection without the scaling step."""
    found = lower.copy()
    for i in np.flatnonzero((rates(spaces.normal, lower) < spaces.bound).any(axis=1)):
        found[i] = kernels._closest_feasible(lower[i], spaces.normal[i], spaces.bound[i])
    return found


def rates(normal: Array, velocity: Array) -> Array:
    """n.v in the kernels' order of operations, (n, K), m/s: comparisons with bounds are then exact."""
    v = velocity[:, None]
    found: Array = normal[..., 0] * v[..., 0] + normal[..., 1] * v[..., 1] + normal[..., 2] * v[..., 2]
    return found


def nearest(x: Array, velocity: Array, period: float) -> Array:
    """Least distance from x + s v to the origin over s in [0, period], exact but for rounding; (...,), m."""
    step = period * velocity
    squared = (step**2).sum(axis=-1)
    along = -(x * step).sum(axis=-1)
    s = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > 0.0), 0.0, 1.0)
    found: Array = np.linalg.norm(x + s[..., None] * step, axis=-1)
    return found


def postcondition(inputs: Inputs, count: int, composition: Composition = "augmented", layer: Layer = through) -> Inputs:
    """Whether the layer's output meets every inequality, compared as floats, from a sample of safe states.

    Returns:
        Evidence: `met`, the worst slack, m/s, the worst loss of distance to points at rest over what rounding may
        cost (at most 1), the largest gain in speed, and the first state where an inequality was missed.
    """
    states, avoidance = safe_states(inputs, count), running_avoidance(inputs, composition)
    spaces = avoidance.half_spaces(states.position, states.mobility, states.around)
    velocity = layer(avoidance, states.lower, spaces)
    rate = rates(spaces.normal, velocity)
    missed = ~(rate >= spaces.bound)
    h, seen = avoidance.period, np.isfinite(spaces.bound)
    x = states.position[:, None] - states.around.centre
    speed = np.linalg.norm(velocity, axis=1)[:, None]
    lost = states.around.distance - nearest(x, velocity[:, None], h)
    reach = np.linalg.norm(x, axis=-1)
    allowed = loss_of_inequality(reach, speed, h) + 8.0 * ROUNDOFF * (reach + speed * h)  # the latter: of `nearest`
    alone = seen & (states.around.share == 1.0)
    faster = np.linalg.norm(velocity, axis=1) / np.linalg.norm(states.lower, axis=1).clip(1e-300)
    off_plane = float(np.abs(velocity * (1.0 - states.mobility)).max())
    first = None
    if missed.any():
        i = int(np.argmax(np.where(missed, spaces.bound - rate, 0.0).max(axis=1)))
        k = int(np.argmax(np.where(missed[i], spaces.bound[i] - rate[i], 0.0)))
        first = {
            "position_m": states.position[i].tolist(),
            "points_m": states.around.centre[i][seen[i]].tolist(),
            "safe_distances_m": states.around.distance[i][seen[i]].tolist(),
            "shares": states.around.share[i][seen[i]].tolist(),
            "lower_m_s": states.lower[i].tolist(),
            "velocity_m_s": velocity[i].tolist(),
            "missed_by_m_s": float(spaces.bound[i, k] - rate[i, k]),
            "distance_before_m": float(reach[i, k]),
            "safe_distance_m": float(states.around.distance[i, k]),
            "least_distance_in_the_next_period_m": float(nearest(x[i, k], velocity[i], h)),
        }
    return {
        "met": not missed.any() and off_plane == 0.0,
        "composition": composition,
        "states": count,
        "inequalities": int(seen.sum()),
        "missed": int(missed.sum()),
        "worst_slack_m_s": float((rate - spaces.bound)[seen].min()),
        "worst_loss_over_rounding": float((lost / allowed)[alone].max(initial=0.0)),
        "largest_gain_in_speed": float(faster.max()),
        "first_missed": first,
    }


def loss_of_inequality(distance: Array | float, speed: Array | float, period: float) -> Array:
    """What rounding in kernels may cost in one period, m: u (7 D + 9 V h) for an inequality that floats meet.

    The bound is computed from D (1 + 3.5u) and errs by (4 D + 3 |D - d|) u / h, |D - d| <= D as D >= d; each term of
    n.v errs by (5.5 + 3)u of itself.
    """
    return ROUNDOFF * (7.0 * np.asarray(distance) + 9.0 * np.asarray(speed) * period)


def rounding(inputs: Inputs) -> Inputs:
    """What rounding can take from the safe distance, m, by kind of pair.

    One step loses what the kernels lose (`loss_of_inequality`, both robots), u (P + h V) per coordinate, integration
    step and robot in the positions (P: largest coordinate), and u T V per integration step because multiples of h
    are rounded (T: duration). A deficit calls in the lower branch, which leaves (1 - A h) of it per period; so
    alone it never exceeds (loss of a step) / (A h). Several deficits whose inequalities contradict each other are
    not restored: then only (loss of a step) * (number of steps) would be certain while v = 0 is kept.
    """
    found = {}
    h, extent, duration = inputs["period_s"], inputs["extent_m"], inputs["duration_s"]
    for kind in kinds(inputs):
        kernel = float(loss_of_inequality(max(inputs["sensing_range_m"], kind.safe), kind.closing, h))
        moves = 2.0 * np.sqrt(3.0) * STEPS_PER_PERIOD * (extent + kind.closing * h) * ROUNDOFF
        clock = (STEPS_PER_PERIOD + 2.0) * duration * kind.closing * ROUNDOFF
        one = float(1.01 * (kernel + moves + clock))
        restored = inputs["gain_1_s"] * h
        found[kind.name] = {"margin_of_a_step_m": one, "margin_with_restoring_m": one / restored if restored else None}
    return found


# ------------------------------------------------------------------------------------------------ running controller


def hostile_team(inputs: Inputs, count: int, composition: Composition, on_top: bool) -> Inputs:
    """Let the running UGV controller execute hostile accepted interventions from random safe states of the team.

    Every UGV (three at most) has accepted a motion to far beyond the obstacle or robot that it is nearest to.

    Returns:
        Evidence: number of missed inequalities (compared as floats), and for the worst a replay.
    """
    rng = np.random.default_rng(SEED)
    team = running_team(inputs, ugvs=3)
    if not len(team.obstacles):
        team = replace(team, obstacles=np.zeros((1, 3)))
    n, avoidance = len(team.ugvs), running_avoidance(inputs, composition)
    neighbourhood, mobility = team.neighbourhood(slice(0, n)), team.mobility[:n]
    controller = UgvController(
        team, avoidance, motion_gain=inputs["motion_gain_1_s"], intervention_gain=inputs["intervention_gain_1_s"],
        intervention_on_top=on_top,
    )  # fmt: skip

    def command(positions: Array, wanted: Array) -> tuple[Array, HalfSpaces]:
        accepted: list[Proposal | None] = [
            Proposal("hostile", 0.0, Motion(np.array([0.0, 1.0]), np.array([here, there])))
            for here, there in zip(positions[:n], wanted, strict=True)
        ]
        spaces = avoidance.half_spaces(positions[:n], mobility, neighbourhood.around(positions))
        return controller.velocity(1.0, positions, wanted, np.zeros((n, 3)), accepted), spaces

    missed, worst, state = 0, 0.0, None
    for _ in range(count):
        positions = _safe_team(team, rng)
        around = neighbourhood.around(positions)
        x = positions[:n, None] - around.centre
        k = np.argmin(np.linalg.norm(x, axis=-1) - around.distance, axis=1)
        wanted = positions[:n] - 100.0 * x[np.arange(n), k] * mobility
        velocity, spaces = command(positions, wanted)
        short = spaces.bound - rates(spaces.normal, velocity)
        missed += int((short > 0.0).sum()) + int((velocity[:, 2] != 0.0).sum())
        if short.max() > worst:
            worst, state = float(short.max()), (positions, wanted, np.unravel_index(np.argmax(short), short.shape))
    found: Inputs = {"states": count, "ugvs": n, "missed": missed, "worst_missed_by_m_s": worst}
    if state is None:
        return found
    positions, wanted, (i, k) = state[0].copy(), state[1], (int(state[2][0]), int(state[2][1]))
    least, steps = np.inf, 0
    around = neighbourhood.around(positions)
    centre, safe = around.centre[i, k], float(around.distance[i, k])
    begin = float(np.linalg.norm(positions[i] - centre))
    described = {"positions_m": positions.tolist(), "robot": team.ugvs[i], "avoided_m": centre.tolist()}
    while least >= safe - 0.1 and steps < 200:
        velocity = command(positions, wanted)[0][i]
        least = min(least, float(nearest(positions[i] - centre, velocity, avoidance.period)))
        positions[i] += avoidance.period * velocity
        steps += 1
    replay = {"distance_before_m": begin, "safe_distance_m": safe, "steps": steps, "least_distance_m": least}
    return found | {"first_missed": described | {"intervention_towards_m": wanted[i].tolist()}, "replay": replay}


def _safe_team(team: Team, rng: np.random.Generator) -> Array:
    """A random safe state of a team, (n + 1, 3), m: UGVs close to obstacles, the UAV above one of them."""
    n, pairs, spread = len(team.ugvs), team.pair_distance(), 3.0
    placed: list[Array] = []
    while len(placed) <= n:
        i, spread = len(placed), spread * 1.001  # so that there will be room
        if i < n:
            centre = team.obstacles[rng.integers(len(team.obstacles))]
            reach = team.obstacle_distance * (1.0 + rng.choice([1e-9, 0.1, spread]) * rng.random())
            angle = rng.uniform(0.0, 2.0 * np.pi)
            trial = np.array([centre[0] + reach * np.cos(angle), centre[1] + reach * np.sin(angle), 0.0])
        else:
            trial = placed[0] + np.array([*rng.uniform(-1.0, 1.0, 2), team.air_ground_distance + rng.random()])
            trial[2] += rng.choice([0.0, spread / 3.0]) * team.obstacle_distance
        clear = [np.linalg.norm(trial - o) >= team.obstacle_distance for o in team.obstacles]
        clear += [np.linalg.norm(trial - other) >= pairs[i, j] for j, other in enumerate(placed)]
        if all(clear):
            placed.append(trial)
        elif i == n and rng.random() < 0.05:
            placed.clear()
    return np.array(placed)


# ------------------------------------------------------------------------------------------------ claims


class SafeLemma(ModelClaim):
    """SAFE-LEMMA."""

    id = "SAFE-LEMMA"
    statement = (
        "On a straight line the distance from a point is at least its value at the start plus the time times its rate "
        "of change at the start: ||x + s v|| >= ||x|| + s (x.v)/||x|| for x other than 0 and s >= 0, in space and in "
        "the plane."
    )
    formula = "||x + s v|| >= ||x|| + s (x.v)/||x||, x != 0, s >= 0"
    method = (
        "Lagrange's identity ||x||^2 ||v||^2 - (x.v)^2 = sum over i < j of (x_i v_j - x_j v_i)^2, expanded exactly, "
        "and as a rational Gram matrix with exact LDL; the step from squares to norms by polynomial certificates for "
        "both signs of the right-hand side. z3 and cvc5 on the negations."
    )
    equations = "none of the paper's; it turns (7)-(8), (11) into statements about one number, the distance"
    assumptions = ("Real arithmetic; x is not 0 (a robot is not at the point that it avoids).",)
    does_not_establish = "Anything about velocities that change within the period, or about rounding (see SAFE-INV)."

    def inputs(self, scenario: Scenario) -> Inputs:
        """None: it is about no constants."""
        return {}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and build the Gram matrix."""
        gram = gram_certificate()
        found = finding(discharge(lemma(), LIMIT_S), gram_matrix="expands exactly, positive semidefinite by exact LDL")
        return replace(found, certificates=found.certificates | {"gram.json": gram})


class SafeInv(ModelClaim):
    """SAFE-INV."""

    id = "SAFE-INV"
    statement = (
        "One control period under the avoidance inequalities keeps the distance: if D >= d at a sample and the "
        "velocities held until the next meet their inequality, the distance is >= d all the time in between; if D <= d "
        "it never decreases, and the deficit shrinks by the factor 1 - A h per period at least. It holds for an "
        "obstacle, for two robots that take half the inequality each, for a UGV under a UAV (z of n dropped, v_z = 0), "
        "and for what is beyond the sensing range. With several obstacles and robots each pair has its own inequality "
        "and its own conclusion; all hold together where all inequalities do, and from a safe state v = 0 meets them "
        "all. Scaling a velocity towards 0 breaks no inequality that v = 0 meets."
    )
    formula = (
        "D >= d, n.v >= -q (D - d)/h (sum over the pair: q = 1) => ||x + s v|| >= d for all s in [0, h]; "
        "D <= d, n.v >= q A (d - D) => ||x + s v|| >= D and d - ||x + h v|| <= (1 - A h)(d - D); "
        "D > R, R >= d + c h => ||x + s v|| >= d"
    )
    method = (
        "In D, r = n.v and s through SAFE-LEMMA: polynomial certificates, symbolic in A, h, d and again with the "
        "scenario's numbers; z3 and cvc5 on the negations. The encoded relation is compared in exact arithmetic with "
        "what the running kernel computes, and the running composition is sampled with up to 12 points."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "SAFE-LEMMA; integrator plant with zero-order hold, both robots of a pair sampled at the same instants.",
        "Obstacles stand still; robots are points and obey their speed limits (what is out of range counts on that).",
        "A UGV's velocity has no z component.",
        "Rounding: binary64, a period cut into at most 64 integration steps, coordinates <= start + speed * duration.",
    )
    does_not_establish = (
        "That the inequalities hold in a run (SAFE-HYP), nor under disturbance (SAFE-DIST). In floating point the "
        "distance is kept up to the margins in the evidence: what one step loses is restored while D < d by the lower "
        "branch, one deficit at a time; contradictory deficits of several points are not restored, and then losses may "
        "add up over the steps. Inside two safe distances at once there may be no velocity that meets both."
    )

    def inputs(self, scenario: Scenario) -> Inputs:
        """Gain, period, sensing range and the team."""
        return constants(scenario)

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, compare with the kernels; margin: spare of the sensing range."""
        compared, sampled = conformance(inputs), postcondition(inputs, 500)
        symbolic = step()
        numeric = with_scenario(inputs, {each.name: each for each in symbolic})
        found = finding(
            discharge([*symbolic, *scaling(), *numeric], LIMIT_S),
            conformance=compared, composition=sampled, rounding=rounding(inputs),
        )  # fmt: skip
        spare = {kind.name: float(range_spare(inputs, kind)) for kind in kinds(inputs)}
        kind = min(spare, key=lambda name: spare[name])
        where = {"quantity": "sensing range - d - c h", "pair": kind}
        found = replace(found, margin=spare[kind], unit="m", where=where)
        if found.status == "proved" and not compared["agrees"]:
            return replace(found, status="refuted", counterexample=compared["first_difference"] or compared)
        lost = sampled["worst_loss_over_rounding"] > 1.0
        if found.status == "proved" and (lost or not sampled["met"]):
            return replace(found, status="refuted", counterexample=sampled["first_missed"] or sampled)
        return found


class SafeGate(ModelClaim):
    """SAFE-GATE."""

    id = "SAFE-GATE"
    statement = (
        "Under method (d) no intervention, accepted or not, leaves the safe set: the avoidance layer is applied last, "
        "to whatever finite velocity comes from below, and from a safe state its output meets every inequality "
        "whatever its input was; SAFE-INV does the rest. Neither the optimiser nor its horizon, the UAV or the "
        "intervention is trusted."
    )
    formula = "D_k >= d_k for all k => for every finite u: v = avoid(u) has n_k.v >= b_k for all k (in floating point)"
    method = (
        "v = 0 meets all inequalities from a safe state, and the last step of the layer shortens the velocity until "
        "none that v = 0 meets is broken; its loop ends only when a comparison of floats finds none, which is the "
        "postcondition itself (polynomial certificates show that one pass suffices but for rounding; every further one "
        "shortens v). The running layer is evaluated on hostile inputs from a deterministic sample of safe states, the "
        "running UGV controller with hostile accepted interventions; its order of priorities is read from the built "
        "diagram of method (d)."
    )
    equations = "(20) against the priorities of method (d); (5), (7)-(8), (14)"
    assumptions = (
        "SAFE-INV and its assumptions; the state is safe at the start.",
        "Velocities from below are finite: the layer does not catch NaN or infinity (see the evidence). Motions of "
        "interventions are checked to be finite, and speeds are limited below the layer.",
        "An intervention acts in the plane: its J_int does not mix z with x and y (the planner's never does).",
    )
    does_not_establish = (
        "That an intervention is useful, or that the robots get anywhere. Nothing is said of methods (b) and (c), "
        "which put interventions on top. The sample supports the reading of the code; the proof is about its equations."
    )

    def inputs(self, scenario: Scenario) -> Inputs:
        """Those of SAFE-INV, and what the diagram of method (d) was built with."""
        controller = build_model(scenario, "d").diagram.GetSubsystemByName("ugv_controller")
        compositions = sorted({run.composition for run in scenario.runs.values() if run.method == "d"})
        built = {"intervention_on_top": bool(controller.intervention_on_top), "compositions": compositions or ["augmented"]}
        return constants(scenario) | {"method_d": built}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and attack the running code; margin: the worst slack of the sample, m/s."""
        built = inputs["method_d"]
        layers = [postcondition(inputs, 2400, composition) for composition in built["compositions"]]
        teams = [hostile_team(inputs, 150, each, built["intervention_on_top"]) for each in built["compositions"]]
        found = finding(
            discharge(gate(), LIMIT_S), layer=layers, controller=teams, method_d=built, non_finite=non_finite(inputs)
        )
        worst = min(layers, key=lambda layer: float(layer["worst_slack_m_s"]))
        found = replace(found, margin=worst["worst_slack_m_s"], unit="m/s", where={"composition": worst["composition"]})
        attacks = [(-team["worst_missed_by_m_s"], team) for team in teams if team["missed"]]
        attacks += [(layer["worst_slack_m_s"], layer) for layer in layers if not layer["met"]]
        if found.status == "proved" and attacks:
            slack, attack = min(attacks, key=lambda each: float(each[0]))
            return replace(found, status="refuted", margin=slack, counterexample=attack)
        return found


def non_finite(inputs: Inputs) -> dict[str, str]:
    """What the layer makes of a velocity that is not finite, beside an active inequality: for the record."""
    avoidance, kind = running_avoidance(inputs), kinds(inputs)[0]
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), kind.safe), np.ones((1, 1)))
    spaces = avoidance.half_spaces(np.array([[kind.safe, 0.0, 0.0]]), np.ones((1, 3)), around)
    answers = {}
    for name, value in (("nan", np.nan), ("infinity", -np.inf), ("1e300", -1e300)):
        velocity = avoidance.apply(np.array([[value, 0.0, 0.0]]), spaces)
        finite = bool(np.isfinite(velocity).all())
        met = finite and bool((rates(spaces.normal, velocity) >= spaces.bound).all())
        answers[name] = "finite, inequality met" if met else "finite, inequality missed" if finite else "passed through"
    return answers


# ------------------------------------------------------------------------------------------------ mutants


def drive(
    avoidance: Avoidance,
    safe: float,
    start: Sequence[Sequence[float]],
    lower: Sequence[Sequence[float]],
    *,
    points: Sequence[Sequence[float]] = (),
    share: float = 1.0,
    edit: Callable[[HalfSpaces], HalfSpaces] = lambda spaces: spaces,
    steps: int = 1,
) -> Inputs:
    """Hold velocities `lower` below the running layer, whose inequalities are edited.

    Args:
        avoidance: the layer.
        safe: safe distance of everything, m.
        start: one robot, or two that avoid each other.
        lower: hostile velocity of each, m/s.
        points: obstacles of every robot.
        share: of every inequality.
        edit: the mutation.
        steps: control periods.

    Returns:
        The start, and the least distance over continuous time of each avoided point, m, with the safe one.
    """
    position, wanted = np.array(start, dtype=np.float64), np.array(lower, dtype=np.float64)
    n = len(position)
    fixed = np.broadcast_to(np.array(points, dtype=np.float64).reshape(-1, 3), (n, len(points), 3))
    least = np.full(len(points) + n - 1, np.inf)
    for _ in range(steps):
        centre = np.concatenate([fixed, position[::-1, None]], axis=1) if n == 2 else fixed
        size = centre.shape[:2]
        around = Surroundings(np.ascontiguousarray(centre), np.full(size, safe), np.full(size, share))
        velocity = avoidance.apply(wanted, edit(avoidance.half_spaces(position, np.ones((n, 3)), around)))
        others = np.zeros(centre.shape)
        if n == 2:
            others[:, -1] = velocity[::-1]
        reached = nearest(position[:, None] - centre, velocity[:, None] - others, avoidance.period)
        least = np.minimum(least, reached.min(axis=0))
        position = position + avoidance.period * velocity
    return {
        "start_m": [list(map(float, row)) for row in start],
        "avoided_m": [list(map(float, row)) for row in points] or "each other",
        "lower_m_s": [list(map(float, row)) for row in lower],
        "control_periods": steps,
        "safe_distance_m": safe,
        "least_distances_m": least.tolist(),
        "end_m": position.tolist(),
    }


def broken(obligation: Obligation, replay: Inputs) -> Finding:
    """The finding on a broken obligation, with what the running code makes of the same break."""
    found = finding(discharge([obligation], LIMIT_S))
    return replace(found, counterexample={**(found.counterexample or {}), "replay": replay})


def named(inputs: Inputs, name: str) -> tuple[Obligation, float, float]:
    """An obligation of `step` with the numbers of a kind of pair that it is about; its d, m; a high speed, m/s."""
    kind = next((k for k in kinds(inputs) if (k.share < 1.0) == name.startswith("pair_")), kinds(inputs)[0])
    numbers = {"d": kind.safe, "h": inputs["period_s"], "A": inputs["gain_1_s"]}
    found = with_numbers(next(each for each in step() if each.name == name), kind.name, numbers)
    return found, kind.safe, kind.safe / inputs["period_s"]


def without(obligation: Obligation, hypothesis: str, says: str) -> Obligation:
    """The obligation without one of its hypotheses, nor the terms of its certificate that need it."""
    kept = {name: text for name, text in obligation.hypotheses.items() if name != hypothesis}
    terms = tuple(term for term in obligation.certificate if hypothesis not in term.factors)
    return replace(obligation, hypotheses=kept, certificate=terms, says=says)


def dropped(where: Sequence[Any]) -> Callable[[HalfSpaces], HalfSpaces]:
    """Drop the inequalities that are marked; the marks (n, K) broadcast."""
    return lambda spaces: HalfSpaces(spaces.normal, np.where(where, -np.inf, spaces.bound))


def flipped(spaces: HalfSpaces) -> HalfSpaces:
    """n.v <= b instead of n.v >= b, of what is in range."""
    return HalfSpaces(-spaces.normal, np.where(np.isfinite(spaces.bound), -spaces.bound, -np.inf))


def _lemma_reversed(inputs: Inputs) -> Finding:
    forward = next(each for each in lemma() if each.name == "forward")
    x, v = np.array([4.0, 0.0, 0.0]), np.array([0.0, 3.0, 0.0])
    ends = {"left": float(np.linalg.norm(x + v)), "right": float(np.linalg.norm(x) + x @ v / np.linalg.norm(x))}
    mutant = replace(forward, name="forward_reversed", goal="D + s*r - E", says="E <= D + s r")
    return broken(mutant, {"x": x.tolist(), "v": v.tolist(), "s": 1.0, **ends})


def _flipped(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "outside")
    rule = {"rule": f"-({given.hypotheses['rule']})"}
    mutant = replace(given, hypotheses={**given.hypotheses, **rule}, says="r <= -(D - d)/h: D + s r >= d")
    start, lower = [[1.2 * safe, 0.0, 0.0]], [[-0.3 * fast, 0.0, 0.0]]
    return broken(mutant, drive(running_avoidance(inputs), safe, start, lower, points=[[0, 0, 0]], edit=flipped))


def _dropped(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "outside")
    mutant = without(given, "rule", "without the inequality for this obstacle: D + s r >= d")
    points, lower = [[-2.0 * safe, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]], [[0.2 * fast, 0.0, 0.0]]
    edit = dropped([False, True])
    return broken(mutant, drive(running_avoidance(inputs), safe, [[0, 0, 0]], lower, points=points, edit=edit))


def _full_shares(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "pair_outside")
    rules = {f"rule_{i}": given.hypotheses[f"rule_{i}"].replace("2*", "", 1) for i in "ij"}
    mutant = replace(given, hypotheses={**given.hypotheses, **rules}, says="each robot takes the full -(D - d)/h")
    start = [[0.0, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]]
    return broken(mutant, drive(running_avoidance(inputs), safe, start, [[fast, 0, 0], [-fast, 0, 0]]))


def _no_share(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "pair_outside")
    mutant = without(given, "rule_j", "only one robot of the pair takes its half: the pair keeps d")
    start, lower = [[0.0, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]], [[0.0, 0.0, 0.0], [-fast, 0.0, 0.0]]
    edit = dropped([[False], [True]])
    return broken(mutant, drive(running_avoidance(inputs), safe, start, lower, share=0.5, edit=edit))


def _large_gain(inputs: Inputs) -> Finding:
    changed = {**inputs, "gain_1_s": 1.8 / inputs["period_s"]}
    given, safe, _ = named(changed, "no_overshoot")
    mutant = without(given, "stable", "A h = 1.8: the recovery does not lead beyond d")
    return broken(
        mutant, drive(running_avoidance(changed), safe, [[0.75 * safe, 0, 0]], [[0, 0, 0]], points=[[0, 0, 0]])
    )


def _equality_tasks(inputs: Inputs) -> Finding:
    """(5) with both obstacles at D = d: v = (I - n1 n1^T) w, w = (I - n2 n2^T) u, n1 = (1, 0), n2 = (-3/5, 4/5)."""
    n2u = "(4/5*u2 - 3/5*u1)"
    mutant = Obligation(
        "equality_tasks", "prioritised equality tasks, two obstacles at D = d, both active: D2 does not decrease",
        ("u1", "u2"), f"4/5*(u2 - 4/5*{n2u})",
        hypotheses={"active_2": f"-{n2u}", "active_1": f"-(u1 + 3/5*{n2u})"},
    )  # fmt: skip
    _, safe, fast = named(inputs, "outside")
    points, lower = [[-safe, 0.0, 0.0], [0.6 * safe, -0.8 * safe, 0.0]], [[-0.1 * fast, -0.1 * fast, 0.0]]
    avoidance = running_avoidance(inputs, "recursion_listed")
    return broken(mutant, drive(avoidance, safe, [[0.0, 0.0, 0.0]], lower, points=points))


def _short_range(inputs: Inputs) -> Finding:
    kind = kinds(inputs)[0]
    blind = {**inputs, "sensing_range_m": kind.safe}
    mutant = next(o for o in with_scenario(blind, {o.name: o for o in step()}) if o.name == f"unseen_{kind.name}")
    start, v = [[kind.safe * (1.0 + 1e-9), 0.0, 0.0]], [[-kind.closing, 0.0, 0.0]]
    return broken(mutant, drive(running_avoidance(blind), kind.safe, start, v, points=[[0, 0, 0]]))


def _unscaled(inputs: Inputs) -> Finding:
    mutant = without(replace(scaling()[1], name="unscaled"), "least", "any sigma in [0, 1] will do")
    return broken(mutant, postcondition(inputs, 2400, layer=unscaled))


def _on_top(inputs: Inputs) -> Finding:
    return SafeGate().check(inputs | {"method_d": inputs["method_d"] | {"intervention_on_top": True}})


def _recursion(inputs: Inputs) -> Finding:
    return SafeGate().check(inputs | {"method_d": inputs["method_d"] | {"compositions": ["recursion_nearest"]}})


MUTANTS: dict[str, Callable[[Inputs], Finding]] = {
    "SAFE-LEMMA: inequality reversed": _lemma_reversed,
    "SAFE-INV: sign of the inequality flipped": _flipped,
    "SAFE-INV: one inequality dropped": _dropped,
    "SAFE-INV: each robot of a pair takes the full share": _full_shares,
    "SAFE-INV: one robot of a pair takes no share": _no_share,
    "SAFE-INV: gain too large, A h = 1.8": _large_gain,
    "SAFE-INV: prioritised equality tasks, two active obstacles": _equality_tasks,
    "SAFE-INV: sensing range too short": _short_range,
    "SAFE-GATE: scaling omitted": _unscaled,
    "SAFE-GATE: intervention on top": _on_top,
    "SAFE-GATE: recursion (5) as printed": _recursion,
}
"""Broken variants; each takes the inputs of SAFE-GATE, which contain those of the other claims, and is refuted."""
