"""GATE-PLAN: every plan of a run is feasible and has its recorded cost; also its gap to the optimum.

A decision's problem is convex once its plan is relaxed and its distances are measured along recorded unit normals,
and convexity gives bounds that need no trust in any solver: see `enclose`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import lsq_linear

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.gate_record import (
    LEAST_COST,
    POSITION_TOLERANCE_M,
    DecisionRecord,
    Deviation,
    GateClaim,
    conclude,
    cost_tolerance,
    reasons_of,
)
from airground_drake.verify.runs.pairs import are_too_near

SPEED_TOLERANCE = 1e-4  # a step may be longer than the speed limit allows by this, relative
# Closer than the safe distance by more than this, m, the avoidance inequalities may ask for more speed than that: they
# ask for less than 1e-5 m/s per point before, at gains up to 10 1/s.
INSIDE_M = 1e-6
LONGER = 1e-6  # relative difference above which one of two remaining ways is longer
# Width of an enclosure of the optimum, relative to the cheaper constant plan's cost, up to which a gap is known.
WIDEST = 1e-5
BLOCKS = 10  # all plans of at most so many choices are evaluated by exact distances, too
# All plans of so many blocks can be evaluated along half-planes; they enclose the optimum of the route's problem.
MOST_BLOCKS = 12
TIE = 1e-9  # accumulated deficits this close to 1/2 are a tie: either mode may follow
ROUNDED_ROUTES = ("relaxed", "nonlinear")  # routes that solve (27) and round by (28)-(29)
WIDE = 1e-5  # relative width of an enclosure above which a better omega* is looked for
NO_PROBLEM = "method (d) compares two predicted outcomes and solves no problem (26)"


class GatePlan(GateClaim):
    id = "GATE-PLAN"
    subject = "plans of the gatekeeper"
    summary = "Every decision is based on a feasible plan whose cost was recorded correctly."
    statement = (
        "Under method (c) the plan of every decision satisfies (26b)-(26e) at its recorded cost, and no step of it is "
        "faster than the UGV may be. Relaxed plans were rounded by sum-up rounding, with an integrated error of at "
        "most half a stage. Under method (d) no decision chose to stop short of the goal if the other choice would "
        "have reached it, or stopped nearer to it. The margin is informative only: it is the largest known gap between "
        "the cost of a plan and the optimum of the half-plane problem."
    )
    latex = (
        r"\rho_k = \rho_{k-1} + \Delta t (\omega_k a_k + (1 - \omega_k) b_k), \quad \rho_0 = p(t), \quad "
        r"\omega_k \in \{0, 1\}",
        r"u_k = \max(0, \max_j (d_j - \lVert \rho_k - o_{jk} \rVert))",
        r"J = \Delta t \sum_k (a \lVert \rho_{rd} - \rho_k \rVert^2 + b u_k^2) + w a \lVert \rho_{rd} - "
        r"\rho_N \rVert^2, \quad w = 0 \text{ unless the scenario says so}",
        r"\bar\omega_k = \begin{cases} 1 & D_k \ge 1 - D_k \\ 0 & \text{otherwise} \end{cases}, \quad "
        r"D_k = \sum_{r \le k} \tilde\omega_r - \sum_{r < k} \bar\omega_r",
        r"\max_k \left| \Delta t \sum_{r \le k} (\tilde\omega_r - \bar\omega_r) \right| \le \frac{\Delta t}{2}",
        r"\text{gap} = \frac{J(\omega_{\text{plan}}) - L}{C}, \quad L \le \min_\omega J_n(\omega), \quad "
        r"C = \min(J(0), J(1))",
    )
    method = (
        "All numbers are computed again in numpy from the recorded problem. No step of a constant plan is longer than "
        "the speed limit allows, unless it begins more than 1e-6 m inside a safe distance, where avoidance may demand "
        "more. For other plans, this limit applies to a stage only if the constant plan of its mode keeps clear there."
        " Rounding is judged stage by stage, by running sums of the recorded relaxed and rounded plans; after a "
        "deficit within 1e-9 of 1/2 either mode may follow. For the gap, the half-plane problems of all decisions are "
        "stacked into one convex program and solved by cvxpy and Clarabel. The solver need not be trusted: any "
        "multipliers give a valid lower bound L by weak duality, which is evaluated in numpy. With up to 12 blocks of "
        "stages all plans are evaluated instead. The gap is unknown if a plan has no half-planes (the route "
        "'nonlinear' records none) or if the bounds of an optimum are more than 1e-5 apart. Problems of at most 10 "
        "choices are also solved by evaluating all plans with the exact distances of (26d)."
    )
    equations = "(22)-(29)"
    assumptions = (
        "The problem of each decision is the recorded one: mode velocities, reference, other bodies, weights and unit "
        "normals. It contains a half-plane only where some plan can come closer than d; elsewhere (26d) has no effect.",
        "The cost of the rejected choice is the recorded one.",
        "The recorded relaxed plan was rounded, and no other.",
        "Under method (d), the recorded outcomes of both choices.",
    )
    does_not_establish = (
        "That the prediction is right, or that the run went as predicted. (26d) is soft: a feasible plan may lead "
        "inside a safe distance, at the cost of its slack (SAFE-TRACE is about safety). A large gap does not refute "
        "the claim: half-planes are conservative, and the best plan by exact distances may cost less than their "
        "optimum. The gatekeeper takes the cheapest plan that it knows, which need not be the rounded one. Refusals "
        "without a plan are only listed."
    )

    exercised_by = "decisions based on a plan or on predicted outcomes"
    margin_decides = False  # it is a gap to an optimum: the larger, the worse

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Judge every plan; the margin is the largest gap."""
        if trace.meta["method"] not in ON_TOP:
            return _judge_outcomes(trace, rows)
        planned = [row for row in rows if row.planned]
        rounded = [row for row in rows if is_rounded(row)]
        compared = [deviation for row in rows for deviation in compare_plan(trace, row)]
        compared += [deviation for row in rounded for deviation in compare_rounding(row)]
        blocks = int(trace.scenario.gatekeeper.blocks)
        bounded = bound([row for row in planned if row.unit_normals], blocks)
        bounded = sorted(bounded, key=lambda decision: -decision.gap)
        widest = max((decision.width for decision in bounded), default=0.0)
        slack = [float(np.maximum(0.0, -row.clearance(row["positions_m"])).max()) for row in planned]
        beside_all = [above_the_best(row, blocks) for row in planned if min(blocks or row.stages, row.stages) <= BLOCKS]
        optimum = "known" if planned else "unknown: no decision rests on a plan"
        if len(bounded) < len(planned):
            optimum = f"unknown: {len(planned) - len(bounded)} of {len(planned)} plans have no half-planes"
        elif widest > WIDEST:
            optimum = f"unknown: the bounds of an optimum are {widest:.2g} apart"
        # gaps and enclosures are relative to the cheaper constant plan
        evidence = (
            _of_decisions(trace, rows, compared, beside_all, optimum)
            | {
                "without_a_plan": [row.label for row in rows if not row.planned],
                "largest_slack_m": max(slack, default=0.0),  # largest intrusion of a plan into a safe distance
                "plans_with_slack": sum(value > 0.0 for value in slack),
                "rounded_plans": len(rounded),
                "largest_rounding_error_s": max(map(integrated_error_s, rounded), default=0.0),
                "largest_gaps": [{"t_s": row.row.t_s, "robot": row.row.robot, "gap": row.gap} for row in bounded[:5]],
                "median_gap": float(np.median([decision.gap for decision in bounded])) if bounded else None,
                "widest_enclosure": widest,
                "first_stage_certified": sum(decision.first_stage_certified for decision in bounded),
            }
        )
        known = optimum == "known"
        worst = evidence["largest_gaps"][0] if known else {}
        finding = Finding(
            "holds",
            margin=max(0.0, worst["gap"]) if known else None,
            unit="of the cheaper constant plan's cost",
            quantity="largest gap of a plan to the half-plane optimum",
            where={name: worst[name] for name in ("robot", "t_s") if known},
            evidence=evidence,
            exercised=len(planned),
        )
        return conclude(finding, compared)


def compare_plan(trace: Trace, row: DecisionRecord) -> Iterator[Deviation]:
    """Compare (26b)-(26e), (25) and the recorded numbers of the plan."""
    limit = trace.scenario.ugvs[row.robot].max_speed_m_s
    period = trace.scenario.control.period_s
    begins = row["initial_m"] - _seen_at(trace, row)
    yield Deviation(row, "initial position, m", begins, POSITION_TOLERANCE_M)
    refusing, accepting = row.constant
    clear_refusing, clear_accepting = (_clear(trace, row, way, period) for way in (refusing, accepting))
    ways = [("refusing throughout", refusing, clear_refusing), ("accepting throughout", accepting, clear_accepting)]
    if row.planned:
        plan = row["plan"]
        positions = row["positions_m"]
        given = row.given
        yield Deviation(row, "omega is not binary", np.minimum(np.abs(plan), np.abs(plan - 1.0)), 0.0)
        away = positions - row.positions(plan)
        yield Deviation(row, "positions are not those of (23), m", away, POSITION_TOLERANCE_M)
        # by (23) a mode's velocity is that of its own way, wherever the plan is
        ways.append(("the plan", positions, np.where(plan == 1.0, clear_accepting, clear_refusing)))
        cost = float(row.cost(positions))
        clearance = min(float(row.clearance(positions).min()), 1e9)
        first = "accept" if plan[0] == 1.0 else "refuse"
        tolerance = cost_tolerance(cost)
        yield Deviation(
            row, "objective", given["objective"] - cost, tolerance, recomputed=cost, recorded=given["objective"]
        )
        yield Deviation(
            row, "objective of its first stage", given[f"objective_{first}"] - cost, tolerance, recomputed=cost
        )
        other = min(given["objective_accept"], given["objective_refuse"])
        for name, trajectory in zip(("refuse", "accept"), row.constant, strict=True):
            recomputed = float(row.cost(trajectory))
            shift = given[f"{name}_throughout"] - recomputed
            yield Deviation(row, f"{name} throughout", shift, cost_tolerance(recomputed), recomputed=recomputed)
        yield Deviation(row, "the other choice is cheaper", max(0.0, given["objective"] - other), tolerance)
        yield Deviation(row, "first stage", float(given["plan_first_stage"] != first), 0.0, plan=first)
        shift = given["predicted_clearance_m"] - clearance
        yield Deviation(row, "predicted clearance, m", shift, POSITION_TOLERANCE_M, recomputed_m=clearance)
    for name, positions, clear in ways:
        step = np.linalg.norm(np.diff(positions, axis=0, prepend=row["initial_m"][None]), axis=1)
        over = (step / (limit * row.dt) - 1.0)[clear]
        yield Deviation(row, f"{name}: faster than the speed limit", np.maximum(0.0, over), SPEED_TOLERANCE)


def _seen_at(trace: Trace, row: DecisionRecord) -> Array:
    """A UGV's measured position when it decided, (3,), m."""
    if trace.scenario.sensing is None:
        return interpolate(trace.t, trace.position(row.robot), row.t_s)
    sample = int(np.searchsorted(trace.sampled("t_s"), row.t_s - TIME_TOLERANCE_S))
    seen: Array = trace.as_seen(row.robot, row.robot)[sample]
    return seen


def _clear(trace: Trace, row: DecisionRecord, positions: Array, period: float) -> Flags:
    """Stages (N,) in which no control sample (every `period`, s) is within a safe distance by more than rounding."""
    # Neither the points of the problem nor the barriers themselves may be this near: the problem represents a wall by
    # points.
    centres = row["centres_m"]
    before = centres[0] - (centres[min(1, len(centres) - 1)] - centres[0])
    start = (np.linalg.norm(row["initial_m"] - before, axis=1) - row["distances_m"]).min(initial=np.inf)
    inside = np.concatenate([[start], row.clearance(positions)]) < -INSIDE_M
    inside |= are_too_near(trace, row.robot, np.concatenate([row["initial_m"][None], positions]), row.t_s, INSIDE_M)
    several = row.dt > period + TIME_TOLERANCE_S  # samples within the stage: what they sense is not recorded
    return ~(inside[:-1] | (inside[1:] & several))


def _judge_outcomes(trace: Trace, rows: Sequence[DecisionRecord]) -> Finding:
    """Method (d): the choice of every decision for which both outcomes were predicted."""
    looked = [row for row in rows if row.given["accept_stalls"] >= 0.0]
    compared = [deviation for row in looked for deviation in _compare_choice(trace, row)]
    gaps = [_above_the_other(row) for row in looked]
    evidence = _of_decisions(trace, rows, compared, gaps, f"unknown: {NO_PROBLEM}")
    return conclude(Finding("holds", evidence=evidence, exercised=len(looked)), compared)


def _of_decisions(
    trace: Trace, rows: Sequence[DecisionRecord], compared: Sequence[Deviation], gaps: Sequence[float], optimum: str
) -> dict[str, Any]:
    """The evidence about decisions under both methods; `gaps` of those for which all choices were evaluated."""
    return {
        "decisions": len(rows),
        "reasons": reasons_of(trace),
        "comparisons": len(compared),
        "wrong": sum(deviation.wrong for deviation in compared),
        "optimum": optimum,
        "enumerated": len(gaps),
        "largest_gap_to_enumeration": max(gaps, default=None),  # relative to the best
    }


def _compare_choice(trace: Trace, row: DecisionRecord) -> Iterator[Deviation]:
    """Compare a choice that stops short of the goal with the other one."""
    given, speed = row.given, trace.scenario.ugvs[row.robot].preset.speed_m_s
    chosen, other = ("accept", "refuse") if given["decision"] == "accept" else ("refuse", "accept")
    worse = given[f"{chosen}_stalls"] - given[f"{other}_stalls"]
    yield Deviation(row, f"{chosen} stops short of the goal, {other} does not", max(0.0, worse), 0.0)
    if given["accept_stalls"] == given["refuse_stalls"] == 1.0:
        longer = given[f"{chosen}_left_m"] / max(given[f"{other}_left_m"], LEAST_COST) - 1.0
        yield Deviation(row, f"{chosen} stops farther from the goal than {other}", max(0.0, longer), LONGER)
    for choice in (chosen, other):
        cost = given[f"{choice}_outcome_m2_s"]
        ahead = given[f"{choice}_left_m"] ** 3 / (3.0 * max(speed, 1e-9))
        off = cost - ahead if given[f"{choice}_stalls"] == 1.0 else min(0.0, cost - ahead)
        yield Deviation(row, f"cost of the way left, {choice}", off, cost_tolerance(ahead), recomputed=ahead)


def _above_the_other(row: DecisionRecord) -> float:
    """Relative excess cost of the choice over the better one; 0 if only the other one stops short."""
    cost = {choice: row.given[f"{choice}_outcome_m2_s"] for choice in ("accept", "refuse")}
    if row.given["accept_stalls"] != row.given["refuse_stalls"]:
        return 0.0
    best = min(cost.values())
    return float(cost["accept" if row.given["decision"] == "accept" else "refuse"] - best) / max(best, LEAST_COST)


@dataclass(frozen=True)
class Bounded:
    """A decision with a plan, and bounds of the optimum of the problem that its route solves."""

    row: DecisionRecord
    optimum: Enclosure

    @cached_property
    def gap(self) -> float:
        """Cost of the plan by exact distances above the lower bound, in units of the row's scale."""
        return (float(self.row.cost(self.row["positions_m"])) - self.optimum.lower) / self.row.scale

    @property
    def width(self) -> float:
        """Width of the enclosure, in the same units."""
        return (self.optimum.upper - self.optimum.lower) / self.row.scale

    @property
    def first_stage_certified(self) -> bool:
        """Whether no plan with the other first stage can be as cheap as this one."""
        return self.optimum.other_first > self.optimum.lower + self.gap * self.row.scale


def bound(rows: Sequence[DecisionRecord], blocks: int) -> list[Bounded]:
    """Bounds for each decision: of the relaxation, or of all plans if `blocks` are few (0: one per stage)."""
    optima = [cheapest_of_blocks(row, blocks) for row in rows] if 0 < blocks <= MOST_BLOCKS else enclose(rows)
    return [Bounded(row, optimum) for row, optimum in zip(rows, optima, strict=True)]


def cheapest_of_blocks(row: DecisionRecord, blocks: int) -> Enclosure:
    """The cheapest along the half-planes of all plans that are constant on blocks, by evaluating each."""
    omega = plans_of_blocks(row.stages, blocks)
    cost = row.cost(row.positions(omega), row.half_planes)
    least = float(cost.min())
    return Enclosure(least, least, float(cost[omega[:, 0] != row["plan"][0]].min()))


def above_the_best(row: DecisionRecord, blocks: int) -> float:
    """Relative excess cost of the plan over the best of all plans, by exact distances."""
    best = float(row.cost(row.positions(plans_of_blocks(row.stages, blocks or row.stages))).min())
    return (float(row.cost(row["positions_m"])) - best) / max(best, LEAST_COST)


def plans_of_blocks(stages: int, blocks: int) -> Array:
    """All plans of so many stages that are constant on blocks, (2^B, N)."""
    blocks = min(blocks, stages)
    modes = (np.arange(2**blocks)[:, None] >> np.arange(blocks)) % 2
    return modes[:, np.arange(stages) * blocks // stages].astype(np.float64)


def is_rounded(row: DecisionRecord) -> bool:
    """Whether a relaxed plan or a rounded one was recorded; each needs the other."""
    rounded = row.data["relaxed"] is not None or row.data["rounded"] is not None
    if not rounded and row.given["route"] in ROUNDED_ROUTES and row.given["status"] == "optimal":
        raise TraceError(f"{row.label} claims to be complete, but has no relaxation")
    return rounded


def integrated_error_s(row: DecisionRecord) -> float:
    """Largest integrated difference of the relaxed and the rounded plan, s."""
    return float(row.dt * np.abs(np.cumsum(row["relaxed"] - row["rounded"])).max())


def compare_rounding(row: DecisionRecord) -> Iterator[Deviation]:
    """Compare the rounded plan with the rule (28)-(29), and the recorded numbers with the plans."""
    # Each stage is judged by the deficit that the recorded stages before it leave, so that one wrong stage does not
    # blur the next. The integrated error is judged against its own bound as well, so that the verdict does not rest on
    # the theorem that follows from the rule.
    relaxed = row["relaxed"]
    rounded = row["rounded"]
    given = row.given
    yield Deviation(row, "relaxed omega is outside [0, 1]", np.maximum(0.0, np.abs(relaxed - 0.5) - 0.5), 0.0)
    yield Deviation(row, "rounded omega is not binary", np.minimum(np.abs(rounded), np.abs(rounded - 1.0)), 0.0)
    deficit = np.cumsum(relaxed) - np.concatenate([[0.0], np.cumsum(rounded)[:-1]])
    against = np.where(rounded == 1.0, 0.5 - deficit, deficit - 0.5)  # positive: the other mode lacks more
    yield Deviation(row, "rounded against the rule", np.maximum(0.0, against), TIE, stage=int(np.argmax(against)))
    error = integrated_error_s(row)
    beyond = max(0.0, error - row.dt / 2.0)
    yield Deviation(row, "integrated rounding error beyond half a stage, s", beyond, TIE * row.dt, error_s=error)
    yield Deviation(row, "recorded rounding error, s", given["rounding_deviation_s"] - error, TIE, recomputed_s=error)
    yield Deviation(row, "recorded relaxed first stage", given["relaxed_first_stage"] - relaxed[0], TIE)
    first = "accept" if rounded[0] == 1.0 else "refuse"
    yield Deviation(row, "recorded rounded first stage", float(given["rounded_first_stage"] != first), 0.0)


@dataclass(frozen=True)
class Enclosure:
    """Bounds of the optimum of a decision's problem, and a lower bound for plans with the other first stage."""

    lower: float
    upper: float
    other_first: float

    def __and__(self, other: Enclosure) -> Enclosure:
        lower, upper = max(self.lower, other.lower), min(self.upper, other.upper)
        return Enclosure(lower, upper, max(self.other_first, other.other_first))


def enclose(rows: Sequence[DecisionRecord]) -> list[Enclosure]:
    """Bounds of the optimum over omega in [0, 1]^N of the cost with distances along the half-planes' normals."""
    # For any multipliers l_kj >= 0 of u_k >= d_j - n_kj.(rho_k - o_kj), minimising the Lagrangian over u leaves
    # q(omega) - sum_k (sum_j l_kj)^2 / (4 dt b) with q convex and quadratic. The tangent of q at any omega* is below q
    # everywhere, and its minimum is at a corner of the box. Both l and omega* are the solver's; neither need be good.
    # Where costs are tiny, the solver's omega* is not accurate enough, and the minimiser of q is used, too.
    if not rows:
        return []
    enclosures = []
    for row, omega, solved in zip(rows, *_solve(rows), strict=True):
        multiplier = solved * row.scale if row.slack_weight > 0.0 else 0.0 * solved
        bounds = _bounds(row, omega, multiplier)
        if bounds.upper - bounds.lower > WIDE * row.scale:
            bounds &= _bounds(row, _minimiser(row, multiplier), multiplier)
        enclosures.append(bounds)
    return enclosures


def _bounds(row: DecisionRecord, omega: Array, multiplier: Array) -> Enclosure:
    """The bounds of `enclose` for a plan (N,) and multipliers (N, m), 1/m."""
    dt, slack, normals = row.dt, row.slack_weight, row.half_planes
    error = row.error_weight * row.lasting[:, None]
    positions = row.positions(omega)
    away = positions - row["reference_m"]
    value = (error * np.square(away)).sum() - (multiplier * row.gaps(positions, normals)).sum()
    value -= np.square(multiplier.sum(axis=1)).sum() / (4.0 * dt * slack) if slack > 0.0 else 0.0
    by_position = 2.0 * error * away - np.einsum("km,kmi->ki", multiplier, normals)
    change = dt * (row["accept_m_s"] - row["refuse_m_s"])
    slope = np.einsum("ki,ki->k", change, np.cumsum(by_position[::-1], axis=0)[::-1])
    corner = np.minimum(-slope * omega, slope * (1.0 - omega))
    other = value + corner[1:].sum() + slope[0] * (1.0 - row["plan"][0] - omega[0])
    return Enclosure(float(value + corner.sum()), float(row.cost(positions, normals)), float(other))


def _minimiser(row: DecisionRecord, multiplier: Array) -> Array:
    """Minimiser of q in the box, by bounded least squares; the multipliers' forces shift the reference."""
    n = row.stages
    weight = row.error_weight * row.lasting[:, None]
    force = np.einsum("km,kmi->ki", multiplier, row.half_planes)
    aim = row["reference_m"] + force / (2.0 * weight) - row.positions(np.zeros(n))
    change = row.dt * (row["accept_m_s"] - row["refuse_m_s"])
    reached = np.tril(np.ones((n, n)))[:, None, :] * change.T  # (stage, axis, omega)
    matrix = (np.sqrt(weight)[..., None] * reached).reshape(3 * n, n)
    fitted = lsq_linear(matrix, (np.sqrt(weight) * aim).ravel(), (0.0, 1.0), method="bvls", tol=1e-14)
    return np.clip(np.asarray(fitted.x), 0.0, 1.0)


def _solve(rows: Sequence[DecisionRecord]) -> tuple[list[Array], list[Array]]:
    """Relaxed plans (N,) and multipliers (N, m) >= 0, costs relative to each scale, of all rows as one program."""
    # Variables, stage by stage of row by row: task errors e = rho - reference, omega and u.
    import cvxpy  # takes a second, which only this claim needs

    cp: Any = cvxpy  # its types are incomplete
    stages = rows[0].stages
    total = stages * len(rows)
    change = np.concatenate([row.dt * (row["accept_m_s"] - row["refuse_m_s"]) for row in rows])
    moved = [np.diff(row["reference_m"], axis=0, prepend=row["initial_m"][None]) for row in rows]
    drift = np.concatenate([row.dt * row["refuse_m_s"] - step for row, step in zip(rows, moved, strict=True)])
    follows = np.arange(3, 3 * total) // 3 % stages != 0
    dynamics = sparse.eye(3 * total) - sparse.diags(follows.astype(float), -3)
    steering = sparse.bsr_matrix((change[:, :, None], np.arange(total), np.arange(total + 1))).tocsr()
    points = [len(row["distances_m"]) for row in rows]
    at = np.repeat(np.arange(total), np.repeat(points, stages))  # inequality by inequality, its stage
    count = len(at)
    normals = np.concatenate([row.half_planes.reshape(-1, 1, 3) for row in rows])
    facing = sparse.bsr_matrix((normals, at, np.arange(count + 1)), shape=(count, 3 * total)).tocsr()
    picks = sparse.csr_matrix((np.ones(count), at, np.arange(count + 1)), shape=(count, total))
    least = np.concatenate([-row.gaps(row["reference_m"], row.half_planes).ravel() for row in rows])
    of_error = np.sqrt(np.concatenate([row.error_weight * row.lasting / row.scale for row in rows]))
    of_slack = np.sqrt([row.dt * row.slack_weight / row.scale for row in rows])
    e = cp.Variable(3 * total)
    omega = cp.Variable(total)
    u = cp.Variable(total)
    constraints = [dynamics @ e - steering @ omega == drift.ravel(), omega >= 0.0, omega <= 1.0, u >= 0.0]
    constraints += [facing @ e + picks @ u >= least] if count else []
    error = cp.sum_squares(cp.multiply(np.repeat(of_error, 3), e))
    slack = cp.sum_squares(cp.multiply(np.repeat(of_slack, stages), u))
    cp.Problem(cp.Minimize(error + slack), constraints).solve(solver=cp.CLARABEL)
    if omega.value is None:
        raise TraceError("the independent solver gave no solution")
    shares = [np.clip(part, 0.0, 1.0) for part in np.split(omega.value, len(rows))]
    dual = np.maximum(0.0, constraints[-1].dual_value) if count else np.empty(0)
    parts = np.split(dual, np.cumsum(stages * np.array(points))[:-1])
    return shares, [part.reshape(stages, m) for part, m in zip(parts, points, strict=True)]
