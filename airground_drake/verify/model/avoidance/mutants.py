"""Broken variants of what the claims about avoidance are about, each replayed on the running layer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airground_drake.arrays import Array
from airground_drake.nsbc import kernels
from airground_drake.nsbc.avoidance import Avoidance, Composition, HalfSpaces, Surroundings
from airground_drake.verify.claim import ModelClaim, Mutant
from airground_drake.verify.engines.obligation import Obligation
from airground_drake.verify.engines.prover import discharge, finding
from airground_drake.verify.engines.rewriting import with_hypotheses, with_numbers, without
from airground_drake.verify.engines.rounding import nearest, rates
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.constants import Inputs, kinds, running_avoidance
from airground_drake.verify.model.avoidance.disturbed_obligations import disturbed, pushed
from airground_drake.verify.model.avoidance.disturbed_runs import SafeStart, attack, scenes
from airground_drake.verify.model.avoidance.hostile_inputs import postcondition
from airground_drake.verify.model.avoidance.lemma import lemma
from airground_drake.verify.model.avoidance.obligations import (
    LIMIT_S,
    scaling,
    step,
    with_scenario,
)
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.avoidance.safe_inv import SafeInv


def broken(obligation: Obligation, replay: Inputs) -> Finding:
    """The finding on a broken obligation, with what the running code makes of the same break."""
    found = finding(discharge([obligation], LIMIT_S))
    return replace(found, counterexample={**(found.counterexample or {}), "replay": replay})


def drive(
    inputs: Inputs,
    safe: float,
    start: Sequence[Sequence[float]],
    lower: Sequence[Sequence[float]],
    *,
    points: Sequence[Sequence[float]] = (),
    share: float = 1.0,
    edit: Callable[[HalfSpaces], HalfSpaces] = lambda spaces: spaces,
    composition: Composition = "augmented",
) -> Inputs:
    """Hold velocities `lower` for a control period below the running layer, whose inequalities are edited.

    Args:
        inputs: constants of the layer.
        safe: safe distance of everything, m.
        start: one robot, or two that avoid each other.
        lower: hostile velocity of each, m/s.
        points: obstacles of every robot.
        share: of every inequality.
        edit: the mutation.
        composition: of the layer.

    Returns:
        The start, and the least distance over continuous time of each avoided point, m, with the safe one.
    """
    avoidance = running_avoidance(inputs, composition)
    position, wanted, fixed = (np.array(rows, dtype=np.float64).reshape(-1, 3) for rows in (start, lower, points))
    n = len(position)
    centre = np.repeat(fixed[None], n, axis=0)
    if n == 2:
        centre = np.concatenate([centre, position[::-1, None]], axis=1)
    around = Surroundings(centre, np.full(centre.shape[:2], safe), np.full(centre.shape[:2], share))
    velocity = avoidance.apply(wanted, edit(avoidance.half_spaces(position, np.ones((n, 3)), around)))
    others = np.zeros(centre.shape)
    if n == 2:
        others[:, -1] = velocity[::-1]
    reached = nearest(position[:, None] - centre, velocity[:, None] - others, avoidance.period)
    return {
        "start_m": position.tolist(),
        "avoided_m": fixed.tolist() or "each other",
        "lower_m_s": wanted.tolist(),
        "control_periods": 1,
        "safe_distance_m": safe,
        "least_distances_m": reached.min(axis=0).tolist(),
        "end_m": (position + avoidance.period * velocity).tolist(),
    }


def dropped(where: Sequence[Any]) -> Callable[[HalfSpaces], HalfSpaces]:
    """Drop the inequalities that are marked; the marks (n, K) broadcast."""
    return lambda spaces: HalfSpaces(spaces.normal, np.where(where, -np.inf, spaces.bound))


def flipped(spaces: HalfSpaces) -> HalfSpaces:
    """n.v <= b instead of n.v >= b, of what is in range."""
    return HalfSpaces(-spaces.normal, np.where(np.isfinite(spaces.bound), -spaces.bound, -np.inf))


def unscaled(avoidance: Avoidance, lower: Array, spaces: HalfSpaces) -> Array:
    """A broken layer: the projection without the scaling step."""
    found = lower.copy()
    for i in np.flatnonzero((rates(spaces.normal, lower) < spaces.bound).any(axis=1)):
        found[i] = kernels._closest_feasible(lower[i], spaces.normal[i], spaces.bound[i])
    return found


def named(inputs: Inputs, name: str, **hypotheses: str) -> tuple[Obligation, float, float]:
    """An obligation of `step` with the numbers of a kind of pair that it is about; its d, m; a high speed, m/s.

    `hypotheses` take the place of those of the same names.
    """
    kind = next((k for k in kinds(inputs) if (k.share < 1.0) == name.startswith("pair_")), kinds(inputs)[0])
    numbers = {"d": kind.safe, "h": inputs["period_s"], "A": inputs["avoidance_gain_1_s"]}
    symbolic = with_hypotheses(next(each for each in step() if each.name == name), **hypotheses)
    return with_numbers(symbolic, kind.name, numbers), kind.safe, kind.safe / inputs["period_s"]


def _lemma_reversed(inputs: Inputs) -> Finding:
    forward = next(each for each in lemma() if each.name == "forward")
    x, v = np.array([4.0, 0.0, 0.0]), np.array([0.0, 3.0, 0.0])
    ends = {"left": float(np.linalg.norm(x + v)), "right": float(np.linalg.norm(x) + x @ v / np.linalg.norm(x))}
    mutant = replace(forward, name="forward_reversed", goal="D + s*r - E", says="E <= D + s r")
    return broken(mutant, {"x": x.tolist(), "v": v.tolist(), "s": 1.0, **ends})


def _flipped(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "outside", rule="-(h*r + (D - d))")
    mutant = replace(given, says="r <= -(D - d)/h: D + s r >= d")
    start, lower = [[1.2 * safe, 0.0, 0.0]], [[-0.3 * fast, 0.0, 0.0]]
    return broken(mutant, drive(inputs, safe, start, lower, points=[[0, 0, 0]], edit=flipped))


def _dropped(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "outside")
    mutant = without(given, "rule", "without the inequality for this obstacle: D + s r >= d")
    points = [[-2.0 * safe, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]]
    lower = [[0.2 * fast, 0.0, 0.0]]
    edit = dropped([False, True])
    return broken(mutant, drive(inputs, safe, [[0, 0, 0]], lower, points=points, edit=edit))


def _full_shares(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "pair_outside", rule_i="h*ri + (D - d)", rule_j="h*rj + (D - d)")
    mutant = replace(given, says="each robot takes the full -(D - d)/h")
    start = [[0.0, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]]
    return broken(mutant, drive(inputs, safe, start, [[fast, 0, 0], [-fast, 0, 0]]))


def _no_share(inputs: Inputs) -> Finding:
    given, safe, fast = named(inputs, "pair_outside")
    mutant = without(given, "rule_j", "only one robot of the pair takes its half: the pair keeps d")
    start = [[0.0, 0.0, 0.0], [1.1 * safe, 0.0, 0.0]]
    lower = [[0.0, 0.0, 0.0], [-fast, 0.0, 0.0]]
    edit = dropped([[False], [True]])
    return broken(mutant, drive(inputs, safe, start, lower, share=0.5, edit=edit))


def _large_gain(inputs: Inputs) -> Finding:
    changed = {**inputs, "avoidance_gain_1_s": 1.8 / inputs["period_s"]}
    given, safe, _ = named(changed, "no_overshoot")
    mutant = without(given, "stable", "A h = 1.8: the recovery does not lead beyond d")
    return broken(mutant, drive(changed, safe, [[0.75 * safe, 0, 0]], [[0, 0, 0]], points=[[0, 0, 0]]))


def _equality_tasks(inputs: Inputs) -> Finding:
    """(5) with both obstacles at D = d: v = (I - n1 n1^T) w, w = (I - n2 n2^T) u, n1 = (1, 0), n2 = (-3/5, 4/5)."""
    n2u = "(4/5*u2 - 3/5*u1)"
    mutant = Obligation(
        "equality_tasks", "prioritised equality tasks, two obstacles at D = d, both active: D2 does not decrease",
        ("u1", "u2"), f"4/5*(u2 - 4/5*{n2u})",
        hypotheses={"active_2": f"-{n2u}", "active_1": f"-(u1 + 3/5*{n2u})"},
    )  # fmt: skip
    _, safe, fast = named(inputs, "outside")
    points = [[-safe, 0.0, 0.0], [0.6 * safe, -0.8 * safe, 0.0]]
    lower = [[-0.1 * fast, -0.1 * fast, 0.0]]
    return broken(mutant, drive(inputs, safe, [[0, 0, 0]], lower, points=points, composition="recursion_listed"))


def _short_range(inputs: Inputs) -> Finding:
    kind = kinds(inputs)[0]
    blind = {**inputs, "sensing_range_m": kind.safe}
    mutant = next(o for o in with_scenario(blind) if o.name == f"unseen_{kind.name}")
    start, v = [[kind.safe * (1.0 + 1e-9), 0.0, 0.0]], [[-kind.closing, 0.0, 0.0]]
    return broken(mutant, drive(blind, kind.safe, start, v, points=[[0, 0, 0]]))


def _unscaled(inputs: Inputs) -> Finding:
    mutant = without(replace(scaling()[1], name="unscaled"), "least", "any sigma in [0, 1] will do")
    return broken(mutant, postcondition(inputs, 2400, layer=unscaled))


def _built(inputs: Inputs, **changed: Any) -> Finding:
    """SAFE-GATE for a diagram of method (d) that was built differently."""
    return SafeGate().check(inputs | {"method_d": inputs["method_d"] | changed})


def _other_diagram(claim: ModelClaim, inputs: Inputs, group: str, **factors: float) -> Finding:
    """A claim whose diagram is built from a scenario in which numbers of one group are others."""
    scenario = inputs["scenario"]
    changed = {name: factor * scenario[group][name] for name, factor in factors.items()}
    return claim.check(inputs | {"scenario": scenario | {group: scenario[group] | changed}})


def _disturbed_bound(inputs: Inputs, name: str, goal: str | None = None, **hypotheses: str) -> Obligation:
    """An obligation of `disturbed` with the numbers of a kind of pair that it is about, changed as `named` does."""
    kind = next(k for k in (*kinds(inputs), kinds(inputs)[0]) if (k.share < 1.0) == name.startswith("pair_"))
    numbers = {
        "d": kind.safe,
        "h": inputs["period_s"],
        "A": inputs["avoidance_gain_1_s"],
        "W": pushed(inputs, kind.share),
    }
    symbolic = with_hypotheses(next(each for each in disturbed() if each.name == name), **hypotheses)
    return with_numbers(replace(symbolic, goal=goal or symbolic.goal), kind.name, numbers)


def _disturbed_scene(inputs: Inputs, name: str) -> SafeStart:
    return next(scene for scene in scenes(inputs) if scene.name == name)


def _disturbed_flipped(inputs: Inputs) -> Finding:
    given = _disturbed_bound(inputs, "inside_bound", rule="-(r - A*(d - D))")
    mutant = replace(given, says="r <= A (d - D): never below d - W/A")
    return broken(mutant, attack(inputs, _disturbed_scene(inputs, "obstacle"), "pinned", edit=flipped))


def _disturbed_large_gain(inputs: Inputs) -> Finding:
    changed = {**inputs, "avoidance_gain_1_s": 4.0 / inputs["period_s"]}
    mutant = without(_disturbed_bound(changed, "outside_bound"), "stable", "A h = 4: never below d - W/A")
    return broken(mutant, attack(changed, _disturbed_scene(inputs, "obstacle"), "pinned"))


def _disturbed_dropped(inputs: Inputs) -> Finding:
    mutant = without(_disturbed_bound(inputs, "inside_bound"), "rule", "without the inequality for this obstacle")
    return broken(
        mutant, attack(inputs, _disturbed_scene(inputs, "notch"), "pinned", edit=dropped([True, False, False]))
    )


def _disturbed_one_of_two(inputs: Inputs) -> Finding:
    goal = "A*(D + s*(ri + rj) - s*W - d) + W - W/2"
    given = _disturbed_bound(inputs, "pair_inside_bound", goal, bounded="A*(D - d) + W - W/2")
    mutant = replace(given, certificate=(), says="two disturbed robots: never below d - w/A")
    return broken(mutant, attack(inputs, _disturbed_scene(inputs, "uav_low"), "pinned", pairs=1.0))


def _disturbed_stronger(inputs: Inputs) -> Finding:
    given = _disturbed_bound(inputs, "inside_bound", "A*(D + s*r - s*W - d) + W - A*s*W")
    mutant = replace(given, certificate=(), says="a disturbance of 2 w: never below d - w/A")
    return broken(mutant, attack(inputs, _disturbed_scene(inputs, "obstacle"), "pinned", force=2.0))


MUTANTS: tuple[Mutant, ...] = (
    Mutant("SAFE-LEMMA", "inequality reversed", _lemma_reversed),
    Mutant("SAFE-INV", "sign of the inequality flipped", _flipped),
    Mutant("SAFE-INV", "one inequality dropped", _dropped),
    Mutant("SAFE-INV", "each robot of a pair takes the full share", _full_shares),
    Mutant("SAFE-INV", "one robot of a pair takes no share", _no_share),
    Mutant("SAFE-INV", "gain too large, A h = 1.8", _large_gain),
    Mutant("SAFE-INV", "prioritised equality tasks, two active obstacles", _equality_tasks),
    Mutant("SAFE-INV", "sensing range too short", _short_range),
    Mutant(
        "SAFE-INV", "diagram built with 0.9 of the distance between UAV and UGVs",
        lambda inputs: _other_diagram(SafeInv(), inputs, "safe_distance", air_ground_m=0.9),
    ),
    Mutant(
        "SAFE-INV", "diagram built with half the gain",
        lambda inputs: _other_diagram(SafeInv(), inputs, "control", avoidance_gain_1_s=0.5),
    ),
    Mutant("SAFE-GATE", "scaling omitted", _unscaled),
    Mutant(
        "SAFE-GATE", "diagram built with 0.9 of the distance to obstacles",
        lambda inputs: _other_diagram(SafeGate(), inputs, "safe_distance", obstacle_m=0.9),
    ),
    Mutant("SAFE-GATE", "intervention on top", lambda inputs: _built(inputs, intervention_on_top=True)),
    Mutant("SAFE-GATE", "recursion (5) as printed", lambda inputs: _built(inputs, compositions=["recursion_nearest"])),
    Mutant("SAFE-DIST", "sign of the inequality flipped", _disturbed_flipped),
    Mutant("SAFE-DIST", "gain too large, A h = 4", _disturbed_large_gain),
    Mutant("SAFE-DIST", "one inequality dropped", _disturbed_dropped),
    Mutant("SAFE-DIST", "only one robot of a pair counted as disturbed", _disturbed_one_of_two),
    Mutant("SAFE-DIST", "disturbance twice the bound", _disturbed_stronger),
)  # fmt: skip
"""Broken variants, in the order of the report."""
