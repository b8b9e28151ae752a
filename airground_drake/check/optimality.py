"""GATE-OPT: how good the plan of every decision is."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from .decisions import Decision, decisions_of, silent_ugvs
from .files import Json
from .rules import SMALL, Array, Flags, Found, NotEstablished, at_most, close, holds, same
from .run import Run

LARGEST_GAP = 0.05
"""Gap that a decision may have."""
OVERSTATED = 1e-5
"""A recorded lower bound may be above the optimum by this, relative: a solver's cost errs by 1e-6 or less."""
UNDERSTATED = 1e-3
"""It may be below it by this, relative."""
GAP = 1e-6
"""Recorded and recomputed gaps may differ by this."""
COST = 1e-9
"""Recorded and recomputed costs may differ by this, relative."""
BLOCKS = 10
"""Blocks of stages, for each of which some routes choose one mode."""
HALF_PLANE_ROUTES = ("relaxed", "branch_and_bound")
"""Routes whose lower bound is about distances along recorded normals."""
BLOCK_ROUTES = ("enumeration", "branch_and_bound")
"""Routes that choose one mode for each block."""
MOST_LISTED = 5
"""Gaps that the evidence lists at most."""
NARROW = 1e-5
"""Width of an enclosure, relative, from which on better shares are looked for at ties."""
TIED_M = 1e-5
"""Points that lack the same to within this are tied."""
EDGE = 1e-6
"""omega closer to 0 or 1 than this is there."""
NEWTON_STEPS = 40
"""Most steps to the minimiser of a smooth convex function: a handful, unless many slacks begin or end on the way."""
PROBE = 1e-3
"""Change of omega by which curvature is found."""


def _label(decision: Decision) -> str:
    return f"decision of {decision.ugv} at t = {decision.t_s} s"


def _where(recorded: Json, least: Numbers, most: Numbers, slop: float) -> None:
    """The margin is attained at a decision of which no other is sure to have less: margins between least and most."""
    key = (recorded["robot"], recorded["t_s"])
    holds("where the margin is attained", key in least, str(key), "a decision")
    least_of_all = min(most.values())
    holds("where the margin is attained", least[key] <= least_of_all + slop, least[key], least_of_all, about=str(key))


def _at(decision: Decision) -> Json:
    return {"about": f"decision of {decision.ugv}", "t_s": decision.t_s}


Numbers = dict[tuple[str, float], float]
"""By robot and time of a decision."""


class Enclosure(NamedTuple):
    """Bounds of the least cost of the plans that a route chooses from."""

    lower: float
    upper: float


def gate_opt(run: Run, claim: Json) -> Found:
    """GATE-OPT: no plan costs more than 5 % of the cheaper constant plan's cost above the optimum of its problem.

    A gap is negative where the plan, by exact distances, costs less than the optimum along half-planes.
    """
    if silent_ugvs(run):
        return Found("not_run")
    decisions, route = decisions_of(run), run.scenario["gatekeeper"]["route"]
    planned = [decision for decision in decisions if decision.planned]
    for decision in planned:
        _no_dearer_than_constant_plans(decision)
    if route not in (*HALF_PLANE_ROUTES, *BLOCK_ROUTES):
        return Found("inconclusive" if decisions else "holds", facts={"decisions": len(decisions)}).counted(
            len(planned)
        )
    if not decisions:
        return Found("holds", facts={"decisions": 0}).counted(0)
    halfplanes = route in HALF_PLANE_ROUTES
    if not planned or any(halfplanes and decision.normals is None for decision in planned):
        return Found("inconclusive").counted(len(planned))
    gaps = []
    for decision in planned:
        normals = decision.half_planes if halfplanes else None
        optimum = _cheapest_of_blocks(decision, normals) if route in BLOCK_ROUTES else enclose(decision)
        _bound_and_gap_are_not_overstated(decision, optimum, normals)
        own = float(decision.cost(decision.positions_m))
        gaps.append([(own - optimum.upper) / decision.scale, (own - optimum.lower) / decision.scale])
    least, most = np.max(gaps, axis=0)
    if most <= LARGEST_GAP:
        facts = {
            "decisions": len(decisions),
            "bounded": len(planned),
            "without_a_plan": [_label(each) for each in decisions if not each.planned],
            "without_a_bound": [],
            "gap_too_wide_to_decide": [],
        }
        found = Found("holds", LARGEST_GAP - float(most), LARGEST_GAP - float(least), facts).counted(len(planned))
        of_gaps = partial(_evidence_on_gaps, claim, planned, np.array(gaps))
        return found.judging(
            of_gaps, "where.robot", "where.t_s", "evidence.largest_gap", "evidence.median_gap",
            "evidence.widest_enclosure", *(f"evidence.largest_gaps.*.{key}" for key in ("robot", "t_s", "gap")),
        )  # fmt: skip
    if least <= LARGEST_GAP:
        raise NotEstablished("the largest gap", f"it is between {least:.9g} and {most:.9g}, allowed {LARGEST_GAP}")
    for decision, (_lowest, highest) in zip(planned, gaps, strict=True):
        if highest > LARGEST_GAP:
            _no_plan_of_blocks_is_much_cheaper(decision, decision.half_planes if halfplanes else None)
    return Found("inconclusive").counted(len(planned))


def _evidence_on_gaps(claim: Json, planned: list[Decision], gaps: Array) -> None:
    """Largest and median gap are possible ones; those listed are of decisions with such gaps, the largest first."""
    evidence, slop = claim["evidence"], GAP
    keys = [(each.ugv, each.t_s) for each in planned]
    least, most = (dict(zip(keys, column, strict=True)) for column in gaps.T.tolist())
    low, high = np.median(gaps, axis=0)
    median = evidence["median_gap"]
    holds("median gap", low - slop <= median <= high + slop, median, f"{low:.9g} to {high:.9g}")
    width = evidence["widest_enclosure"]
    holds("widest enclosure", 0.0 <= width <= NARROW, width, f"0 to {NARROW}")
    listed = evidence["largest_gaps"]
    same("number of gaps that are listed", len(listed), min(MOST_LISTED, len(planned)))
    for entry in listed:
        key = (entry["robot"], entry["t_s"])
        holds("a gap is of a decision", key in least, str(key), "a decision with a plan")
        there = least[key] - slop <= entry["gap"] <= most[key] + slop
        holds("a gap that is listed", there, entry["gap"], f"{least[key]:.9g} to {most[key]:.9g}", about=str(key))
    by_size = sorted((entry["gap"] for entry in listed), reverse=True)
    same("gaps are listed by size", [entry["gap"] for entry in listed], by_size)
    left_out = [least[key] for key in least if key not in [(entry["robot"], entry["t_s"]) for entry in listed]]
    at_most("gap that is not listed", max(left_out, default=-np.inf), by_size[-1], within=slop)
    same("largest gap", evidence["largest_gap"], by_size[0])
    same("where the margin is attained", claim["where"], {key: listed[0][key] for key in ("robot", "t_s")})


def _no_dearer_than_constant_plans(decision: Decision) -> None:
    for choice, constant in zip(("refuse", "accept"), decision.constant_cost, strict=True):
        slop = COST * max(float(constant), 1e-6)
        for name in ("objective", f"objective_{choice}"):
            at_most(f"{name} against {choice} throughout", decision.row[name], constant, within=slop, **_at(decision))


def _bound_and_gap_are_not_overstated(decision: Decision, found: Enclosure, normals: Array | None) -> None:
    """Normals are unit vectors; the recorded lower bound is one; the gap is between its cost and what is best known."""
    row, scale, at = decision.row, decision.scale, _at(decision)
    bound, own = row["route_bound"], float(decision.cost(decision.positions_m, normals))
    if decision.normals is not None and normals is not None:
        lengths = np.linalg.norm(decision.normals, axis=2)
        close("normals are unit vectors", lengths, np.ones_like(lengths), within=SMALL, **at)
    at_most("lower bound against the plan's cost", bound, own, within=OVERSTATED * scale, **at)
    at_most("lower bound against the optimum", bound, found.upper, within=OVERSTATED * scale, **at)
    if row["status"] == "optimal" and row["route"] != "branch_and_bound":
        allowed = (UNDERSTATED + OVERSTATED) * scale
        at_most("optimum against the lower bound", found.lower, bound, within=allowed, **at)
    known = [*decision.constant_m, *([decision.positions_of(decision.rounded)] if len(decision.rounded) else [])]
    loser = max(row["objective_accept"], row["objective_refuse"])  # along normals it costs that or more
    best = min(own, loser, *(float(decision.cost(positions, normals)) for positions in known))
    least, most = _gap(best, bound), _gap(own, bound)
    holds("recorded gap", least - GAP <= row["gap"] <= most + GAP, row["gap"], f"{least} to {most}", **at)


def _gap(cost: float, bound: float) -> float:
    """As the routes record it."""
    return (cost - bound) / max(cost, 1e-12)


def _cheapest_of_blocks(decision: Decision, normals: Array | None) -> Enclosure:
    """The least cost of all plans that are constant on each of ten blocks, by evaluating each."""
    blocks = min(BLOCKS, decision.stages)
    modes = (np.arange(2**blocks)[:, None] >> np.arange(blocks)) % 2
    omega = modes[:, np.arange(decision.stages) * blocks // decision.stages].astype(np.float64)
    least = float(decision.cost(decision.positions_of(omega), normals).min())
    return Enclosure(least, least)


def _no_plan_of_blocks_is_much_cheaper(decision: Decision, normals: Array | None) -> None:
    own = float(decision.cost(decision.positions_m))
    shown = (own - _cheapest_of_blocks(decision, normals).lower) / decision.scale
    at_most("gap to a plan of blocks", shown, LARGEST_GAP, **_at(decision))


def enclose(decision: Decision) -> Enclosure:
    """Bounds of the least cost of a relaxed plan, omega in [0, 1]^N, with distances along the half-planes.

    That cost J is convex. Above: its value at any plan, such as the recorded relaxation omega*. Below: slack u_k, the
    most that a point lacks at stage k, is at least w_k = sum_j l_kj (what point j lacks) for any shares l_kj >= 0 with
    sum 1. With max(0, w_k) in place of u_k, J has become a smooth convex function that is below it; it is nowhere below
    its tangent at any omega', which is least at a corner of the box:

        J(omega) >= value + sum_k min(-s_k omega'_k, s_k (1 - omega'_k)),    s: slopes.

    Good shares leave nothing to be gained at omega*: all on the point that lacks most, or, where several lack the
    same, as `_shares_at_ties` finds them. Where costs are tiny, omega* is a solver's, no minimiser to so many digits:
    the tangent is then taken at the minimiser of the smooth function.
    """
    normals, omega = decision.half_planes, decision.relaxed
    if normals is None or not len(omega):
        raise NotEstablished("the optimum is bounded", "no relaxation is recorded", f"decision at {decision.t_s} s")
    positions = decision.positions_of(omega)
    upper = float(decision.cost(positions, normals))
    lacking = np.where((normals != 0.0).any(axis=-1), -decision.gaps_m(positions, normals), -np.inf)
    shares = np.eye(lacking.shape[1])[lacking.argmax(axis=1)] if lacking.shape[1] else lacking
    lower = _lower_bound(decision, omega, shares)
    if lacking.shape[1] and upper - lower > NARROW * decision.scale:
        at_ties = _shares_at_ties(decision, positions, lacking, normals)
        if (better := _lower_bound(decision, omega, at_ties)) > lower:
            lower, shares = better, at_ties
    if upper - lower > NARROW * decision.scale:
        omega = _minimiser(decision, omega, shares)
        lower = max(lower, _lower_bound(decision, omega, shares))
        upper = min(upper, float(decision.cost(decision.positions_of(omega), normals)))
    return Enclosure(lower, upper)


def _slopes(decision: Decision, forces: Array) -> Array:
    """Slopes by omega, (N,), of a function of the positions with derivatives `forces`, (N, 3).

    omega_k moves all positions from stage k on by dt (a_k - b_k).
    """
    moved = decision.dt_s * (decision.accept_m_s - decision.refuse_m_s)
    return np.asarray((moved * np.cumsum(forces[::-1], axis=0)[::-1]).sum(axis=1))


def _smooth(decision: Decision, omega: Array, shares: Array) -> tuple[float, Array]:
    """The smooth function of `enclose` for shares (N, m) of the points in what is lacking, and its slopes (N,)."""
    dt, positions, normals = decision.dt_s, decision.positions_of(omega), decision.half_planes
    error = positions - decision.reference_m
    slack = np.maximum(0.0, (shares * -decision.gaps_m(positions, normals)).sum(axis=1))
    of_error = (decision.error_weights_1_m2[:, None] * error**2).sum()
    of_slack = dt * decision.slack_weight_1_m2_s * (slack**2).sum()
    away = np.zeros_like(error) if normals is None else (shares[..., None] * normals).sum(axis=1)
    forces = decision.error_weights_1_m2[:, None] * error
    forces -= dt * decision.slack_weight_1_m2_s * slack[:, None] * away
    return float(of_error + of_slack), _slopes(decision, 2.0 * forces)


def _lower_bound(decision: Decision, omega: Array, shares: Array) -> float:
    """The bound of `enclose`: the tangent at omega, at the lowest corner."""
    value, slopes = _smooth(decision, omega, shares)
    return value + float(np.minimum(-slopes * omega, slopes * (1.0 - omega)).sum())


def _minimiser(decision: Decision, omega: Array, shares: Array) -> Array:
    """Where in the box the smooth function of `enclose` is least, by projected Newton steps; none may raise it."""
    value, slopes = _smooth(decision, omega, shares)
    for _ in range(NEWTON_STEPS):
        free = ~(((omega <= 0.0) & (slopes >= 0.0)) | ((omega >= 1.0) & (slopes <= 0.0)))
        if not free.any():
            break
        shifts = PROBE * np.where(omega < 0.5, 1.0, -1.0)  # slopes are linear but for where a slack becomes 0
        rates = [(_smooth(decision, omega + step, shares)[1] - slopes) / step.sum() for step in np.diag(shifts)]
        curvature = np.stack(rates)[np.ix_(free, free)]
        step = np.zeros_like(omega)
        step[free] = -np.linalg.lstsq(curvature, slopes[free], rcond=None)[0]
        tries = [np.clip(omega + step * 0.5**k, 0.0, 1.0) for k in range(30)]
        found = next((each for each in tries if _smooth(decision, each, shares)[0] < value), None)
        if found is None:
            break
        omega = found
        value, slopes = _smooth(decision, omega, shares)
    return omega


def _shares_at_ties(decision: Decision, positions_m: Array, lacking_m: Array, normals: Array) -> Array:
    """Shares (N, m) under which omega* is as nearly optimal as can be, by least squares.

    Optimal is: slope 0 where 0 < omega*_k < 1, not negative at 0, not positive at 1. Unknown are the shares of the
    points that lack the most, and what the slopes at 0 and 1 are off 0: none of them negative.
    """
    omega, n = decision.relaxed, decision.stages
    slack = lacking_m.max(axis=1)
    tied = (lacking_m >= slack[:, None] - TIED_M) & (lacking_m > 0.0)
    stage, point = np.nonzero(tied)
    shares = np.eye(lacking_m.shape[1])[lacking_m.argmax(axis=1)]
    if not len(stage):
        return shares
    error = positions_m - decision.reference_m
    columns = []
    for k, j in zip(stage, point, strict=True):
        force = np.zeros((n, 3))
        force[k] = -2.0 * decision.dt_s * decision.slack_weight_1_m2_s * slack[k] * normals[k, j]
        columns.append(_slopes(decision, force))
    own = _slopes(decision, 2.0 * decision.error_weights_1_m2[:, None] * error)
    at_0, at_1 = np.eye(n)[:, omega <= EDGE], np.eye(n)[:, omega >= 1.0 - EDGE]
    of_slopes = np.hstack([np.stack(columns, axis=1), -at_0, at_1])
    heavy = 10.0 * max(1.0, float(np.abs(of_slopes).max()))
    involved = np.unique(stage)
    sums = np.hstack([(stage == involved[:, None]) * heavy, np.zeros((len(involved), at_0.shape[1] + at_1.shape[1]))])
    found = least_squares(np.vstack([of_slopes, sums]), np.concatenate([-own, np.full(len(involved), heavy)]))
    shares[involved] = 0.0
    shares[stage, point] = found[: len(stage)]
    return np.asarray(shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-12))


def least_squares(matrix: Array, right: Array) -> Array:
    """x >= 0 with the least ||matrix x - right||, by Lawson and Hanson's active sets."""
    gram, moment = matrix.T @ matrix, matrix.T @ right
    gram += 1e-12 * float(gram.diagonal().max(initial=0.0)) * np.eye(len(gram))  # columns may depend on each other
    x = np.zeros(len(gram))
    free = np.zeros(len(x), dtype=bool)
    for _ in range(3 * len(x)):
        gain = np.where(free, 0.0, moment - gram @ x)
        if gain.max(initial=0.0) <= 1e-9 * np.abs(moment).max():
            break
        free[gain.argmax()] = True
        solved = _solved(gram, moment, free)
        while (solved[free] <= 0.0).any():
            falling = free & (solved <= 0.0)
            step = (x[falling] / np.maximum(x[falling] - solved[falling], 1e-300)).min()
            x = x + step * (solved - x)
            free &= x > 1e-12
            solved = _solved(gram, moment, free)
        x = solved
    return x


def _solved(gram: Array, moment: Array, free: Flags) -> Array:
    x = np.zeros(len(gram))
    x[free] = np.linalg.solve(gram[np.ix_(free, free)], moment[free])
    return x
