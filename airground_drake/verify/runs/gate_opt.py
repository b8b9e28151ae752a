"""GATE-SUR and GATE-OPT: how every gatekeeper decision of a run was rounded, and how good its plan is.

A decision's problem is convex once its plan is relaxed and its distances are measured along recorded unit normals,
and convexity gives bounds that need no trust in any solver: see `enclose`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import Finding
from airground_drake.verify.runs.gate_record import POSITION_TOLERANCE_M, GateClaim, Off, Row, conclude, cost_tolerance

TIE = 1e-9
"""Accumulated deficits of sum-up rounding closer to 1/2 than this are a tie: either mode may follow."""
OVERSTATED = 1e-5
"""A recorded lower bound may be above the optimum by this, relative: a solver's primal cost errs by 1e-6 or less."""
UNDERSTATED = 1e-3
"""It may be below it by this, relative: farther below, it would not be the optimum of the relaxation."""
GAP_TOLERANCE = 1e-6
"""Recorded and recomputed gaps may differ by this."""
ROUNDED_ROUTES = ("relaxed", "nonlinear")
"""Routes that solve (27) and round by (28)-(29)."""
BLOCKS = 10
"""Blocks of stages, for each of which the routes with a minimum dwell choose a mode."""
DWELL_ROUTES = ("enumeration", "branch_and_bound")
"""Those routes."""
HALF_PLANE_ROUTES = ("relaxed", "branch_and_bound")
"""Routes that bound the cost with distances along recorded normals; the others know no bound, or an exact one."""


class GateSur(GateClaim):
    """GATE-SUR."""

    id = "GATE-SUR"
    statement = "Every relaxed plan was rounded by sum-up rounding, with an integrated error of at most half a stage."
    formula = (
        "rounded_k = 1 if D_k >= 1 - D_k else 0, D_k = sum_{r <= k} relaxed_r - sum_{r < k} rounded_r; "
        "max_k |dt sum_{r <= k} (relaxed_r - rounded_r)| <= dt / 2"
    )
    method = (
        "Running sums of the recorded relaxed and rounded plans. Each stage is judged by the deficits that the "
        "recorded rounding before it leaves, so that one wrong stage does not blur the next; deficits within 1e-9 of "
        "1/2 are a tie, where either mode may follow (exact ties should accept). Each error is judged against its own "
        "bound as well, so that the verdict does not rest on the theorem that follows from the rule."
    )
    equations = "(28)-(29)"
    assumptions = ("The relaxed plan recorded is the one that was rounded.",)
    does_not_establish = (
        "That the relaxed plan is optimal (GATE-OPT), or that the rounded one was taken: the cheapest plan known was. "
        "A small integrated error bounds positions, not costs."
    )

    def applies(self, trace: Trace) -> bool:
        """Only some routes round; a trace without a scenario is for `judge` to reject."""
        gate = trace.meta.get("scenario", {}).get("gatekeeper", {})
        return super().applies(trace) and gate.get("route", ROUNDED_ROUTES[0]) in ROUNDED_ROUTES

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Round again, and sum up; the margin is what is left of dt/2."""
        without = [row for row in rows if row.data["relaxed"] is None]
        if cut := [row for row in without if row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no relaxation")
        rounded = [row for row in rows if row.data["relaxed"] is not None]
        skipped = {"decisions": len(rows), "without_relaxation": [row.label for row in without]}
        if not rounded:
            return Finding("not_run", evidence={"reason": "no decision has a relaxation", **skipped})
        worst = min(rounded, key=lambda row: row.dt / 2.0 - _deviation(row))
        error, bound = _deviation(worst), worst.dt / 2.0
        finding = Finding(
            "holds",
            margin=max(0.0, bound - error),
            unit="s",
            where={name: worst.given[name] for name in ("robot", "t_s")},
            evidence={**skipped, "largest_error_s": error, "bound_s": bound},
        )
        return conclude(finding, (one for row in rounded for one in _rounding(row)))


def _deviation(row: Row) -> float:
    """Largest integrated difference of the relaxed and the rounded plan, s."""
    return float(row.dt * np.abs(np.cumsum(row["relaxed"] - row["rounded"])).max())


def _rounding(row: Row) -> Iterator[Off]:
    """(28)-(29) and what was recorded about it."""
    relaxed, rounded, given = row["relaxed"], row["rounded"], row.given
    yield Off(row, "relaxed omega is outside [0, 1]", np.maximum(0.0, np.abs(relaxed - 0.5) - 0.5), 0.0)
    yield Off(row, "rounded omega is not binary", np.minimum(np.abs(rounded), np.abs(rounded - 1.0)), 0.0)
    deficit = np.cumsum(relaxed) - np.concatenate([[0.0], np.cumsum(rounded)[:-1]])
    against = np.where(rounded == 1.0, 0.5 - deficit, deficit - 0.5)  # positive: the other mode lacks more
    yield Off(row, "rounded against the rule", np.maximum(0.0, against), TIE, stage=int(np.argmax(against)))
    deviation = _deviation(row)
    yield Off(row, "integrated rounding error, s", deviation, (0.5 + TIE) * row.dt)
    yield Off(row, "recorded rounding error, s", given["rounding_deviation_s"] - deviation, TIE, recomputed_s=deviation)
    yield Off(row, "recorded relaxed first stage", given["relaxed_first_stage"] - relaxed[0], TIE)


class GateOpt(GateClaim):
    """GATE-OPT."""

    largest_gap = 0.05
    """Gap that a decision may have: what a reversal needs by default (`switching_margin`) is no less."""
    widest = 1e-5
    """Width of an enclosure of the optimum, relative, up to which it decides anything."""

    id = "GATE-OPT"
    statement = (
        "Every gatekeeper decision that rests on a plan costs at most 5 % of the cheaper constant plan's cost more "
        "than the optimum of the problem that its route solves, and neither its lower bound nor its gap is recorded "
        "better than it is."
    )
    formula = (
        "L <= min J_n <= U, U - L <= 1e-5 C; lower_bound <= U + 1e-5 C; lower_bound >= L - 1e-3 C (relaxed); "
        "(J(plan) - L) / C <= 0.05; J(plan) <= J(0), J(1); C = min(J(0), J(1)); J is (25), J_n >= J with distances "
        "along unit normals n"
    )
    method = (
        "Route 'relaxed': the half-plane relaxations of all decisions, from recorded data and normals, are stacked "
        "into one program in multiple-shooting form and solved by cvxpy and Clarabel (OSQP reaches the same only to "
        "2e-5, in three to ten times the time). No solver is trusted: its plan, evaluated, is the upper "
        "bound U; its multipliers give L by weak duality, evaluated in numpy, whatever their quality. Routes "
        "'enumeration' and 'branch_and_bound': all plans of 10 blocks are evaluated. Other routes bound nothing, "
        "and the claim is inconclusive."
    )
    equations = "(25)-(27)"
    assumptions = (
        "The optimum is that of the recorded problem: mode velocities, and unit normals, are data.",
        "Route 'enumeration' and 'branch_and_bound' choose one mode for each of 10 blocks of stages.",
    )
    does_not_establish = (
        "Optimality for the exact distances of (26d) (half-planes are conservative: another choice of normals may "
        "allow a cheaper plan), for another dwell, or for the nonlinear closed loop; nor that the first stage is the "
        "optimal one, unless counted as certified. Where the plan is the better by exact distances, it may cost less "
        "than the bound, and the gap is negative. Refusals for want of a plan are only listed."
    )

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Enclose every optimum; the margin is what is left of the largest gap allowed."""
        route, planned = trace.scenario["gatekeeper"]["route"], [row for row in rows if row.planned]
        halfplanes, dwelling = route in HALF_PLANE_ROUTES, route in DWELL_ROUTES
        lacking = [row for row in planned if halfplanes and row.data["normals"] is None]
        if cut := [row for row in lacking if row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no normals")
        compared = [one for row in planned for one in _no_worse(row)]
        if not (halfplanes or dwelling):
            reason = f"route {route!r} has no bound that can be established again"
            return conclude(Finding("inconclusive", evidence={"decisions": len(rows), "reason": reason}), compared)
        bounded = [row for row in planned if row not in lacking]
        lines = [row["normals"] if halfplanes else None for row in bounded]
        found = [_cheapest(*one) for one in zip(bounded, lines, strict=True)] if dwelling else enclose(bounded)
        gaps, widths, certified = [], [], 0
        open_gaps: list[str] = []
        for row, normals, one in zip(bounded, lines, found, strict=True):
            gap = (float(row.cost(row["positions_m"])) - one.lower) / row.scale
            gaps.append(gap)
            widths.append((one.upper - one.lower) / row.scale)
            certified += bool(one.other_first > one.lower + gap * row.scale)
            compared += _bounds(row, one, normals)
            if gap > self.largest_gap:  # open, unless a cheaper plan can be shown: rounding may cost that much
                open_gaps.append(row.label)
                shown = (float(row.cost(row["positions_m"])) - _cheapest(row, None).lower) / row.scale
                compared.append(Off(row, "a plan of blocks is cheaper", max(0.0, shown), self.largest_gap))
        width = max(widths, default=0.0)
        undecided = bool(lacking) or not bounded or width > self.widest or bool(open_gaps)
        at = [{name: row.given[name] for name in ("t_s", "robot")} for row in bounded]
        worst = [{**at[i], "gap": float(gaps[i])} for i in np.argsort(gaps)[:-6:-1]]
        finding = Finding(
            "inconclusive" if undecided else "holds",
            margin=None if undecided else self.largest_gap - worst[0]["gap"],
            unit="of the cheaper constant plan's cost",
            where={name: worst[0][name] for name in ("robot", "t_s")} if worst else {},
            evidence={
                "decisions": len(rows),
                "bounded": len(bounded),
                "without_a_bound": [row.label for row in lacking],
                "gap_too_wide_to_decide": open_gaps,
                "without_a_plan": [row.label for row in rows if not row.planned],
                "largest_gap": worst[0]["gap"] if worst else None,
                "median_gap": float(np.median(gaps)) if gaps else None,
                "widest_enclosure": float(width),
                "first_stage_certified": certified,
                "largest_gaps": worst,
            },
        )
        return conclude(finding, compared)


@dataclass(frozen=True)
class Enclosure:
    """Bounds of the optimum of one decision's problem, and a lower one for plans with the other first stage."""

    lower: float
    upper: float
    other_first: float


def _no_worse(row: Row) -> Iterator[Off]:
    """The plan against the constant ones, by the exact cost; each choice against the constant plan that makes it."""
    for name, constant in zip(("refuse", "accept"), row.cost(row.constant).tolist(), strict=True):
        tolerance = cost_tolerance(constant)
        for column in ("objective", f"objective_{name}"):
            excess = max(0.0, row.given[column] - constant)
            yield Off(row, f"{column} above {name} throughout", excess, tolerance, constant_plan=constant)


def _bounds(row: Row, found: Enclosure, normals: Array | None) -> Iterator[Off]:
    """The recorded normals, lower bound and gap."""
    given, bound, scale = row.given, float(row.given["lower_bound"]), row.scale
    own = float(row.cost(row["positions_m"], normals))
    known = [*row.constant, *([row.positions(row["rounded"])] if row.data["rounded"] is not None else [])]
    # the losing choice's plan is not recorded, but along normals it costs no less than by exact distances
    loser = max(given["objective_accept"], given["objective_refuse"])
    best = min(own, loser, *(float(row.cost(positions, normals)) for positions in known))
    if normals is not None:
        yield Off(row, "length of a normal, minus 1", np.linalg.norm(normals, axis=2) - 1.0, POSITION_TOLERANCE_M)
    more = {"lower_bound": bound, "optimum_at_least": found.lower, "optimum_at_most": found.upper}
    yield Off(row, "lower bound above the plan's cost", max(0.0, bound - own) / scale, OVERSTATED, cost=own)
    yield Off(row, "lower bound overstated", max(0.0, bound - found.upper) / scale, OVERSTATED, **more)
    if given["status"] == "optimal" and given["route"] != "branch_and_bound":
        yield Off(row, "lower bound understated", max(0.0, found.lower - bound) / scale, UNDERSTATED, **more)
    least, most = ((cost - bound) / max(cost, 1e-12) for cost in (best, own))
    beyond = max(0.0, least - given["gap"], given["gap"] - most)
    yield Off(row, "recorded gap", beyond, GAP_TOLERANCE, recorded=given["gap"], at_least=least, at_most=most)


def _cheapest(row: Row, normals: Array | None) -> Enclosure:
    """The cheapest of all plans that are constant on blocks, by evaluating each."""
    stages = len(row["reference_m"])
    blocks = min(BLOCKS, stages)
    modes = (np.arange(2**blocks)[:, None] >> np.arange(blocks)) % 2
    omega = modes[:, np.arange(stages) * blocks // stages].astype(np.float64)
    cost = row.cost(row.positions(omega), normals)
    least = float(cost.min())
    return Enclosure(least, least, float(cost[omega[:, 0] != row["plan"][0]].min()))


def enclose(rows: Sequence[Row]) -> list[Enclosure]:
    """Bounds of the optimum over omega in [0, 1]^N of the cost with distances along the normals.

    For any multipliers l_kj >= 0 of u_k >= d_j - n_kj.(rho_k - o_kj), minimising the Lagrangian over u leaves
    q(omega) - sum_k (sum_j l_kj)^2 / (4 dt b), q convex and quadratic, of which the tangent at any omega* is below
    it everywhere, and least at a corner of the box. Both l and omega* are the solver's; neither need be good.
    """
    if not rows:
        return []
    shares, multipliers = _solve(rows)
    found = []
    for row, omega, solved in zip(rows, shares, multipliers, strict=True):
        dt, error, slack, normals = row.dt, row.error_weight, row.slack_weight, row["normals"]
        multiplier = solved * row.scale if slack > 0.0 else 0.0 * solved
        positions = row.positions(omega)
        away = positions - row["reference_m"]
        value = dt * error * np.square(away).sum() - (multiplier * row.gaps(positions, normals)).sum()
        value -= np.square(multiplier.sum(axis=1)).sum() / (4.0 * dt * slack) if slack > 0.0 else 0.0
        by_position = 2.0 * dt * error * away - np.einsum("km,kmi->ki", multiplier, normals)
        change = dt * (row["accept_m_s"] - row["refuse_m_s"])
        slope = np.einsum("ki,ki->k", change, np.cumsum(by_position[::-1], axis=0)[::-1])
        corner = np.minimum(-slope * omega, slope * (1.0 - omega))
        other = value + corner[1:].sum() + slope[0] * (1.0 - row["plan"][0] - omega[0])
        found.append(Enclosure(float(value + corner.sum()), float(row.cost(positions, normals)), float(other)))
    return found


def _solve(rows: Sequence[Row]) -> tuple[list[Array], list[Array]]:
    """Relaxed plans (N,) and multipliers (N, m) >= 0, costs relative to `Row.scale`, of all rows as one program.

    Variables, stage by stage of row by row: task errors e = rho - reference, omega and u.

    Raises:
        TraceError: if the solver gives no solution at all.
    """
    import cvxpy  # takes a second, which other claims need not wait for

    cp: Any = cvxpy  # its types are incomplete
    stages = len(rows[0]["reference_m"])
    total = stages * len(rows)
    change = np.concatenate([row.dt * (row["accept_m_s"] - row["refuse_m_s"]) for row in rows])
    moved = [np.diff(row["reference_m"], axis=0, prepend=row["initial_m"][None]) for row in rows]
    drift = np.concatenate([row.dt * row["refuse_m_s"] - step for row, step in zip(rows, moved, strict=True)])
    follows = np.arange(3, 3 * total) // 3 % stages != 0
    dynamics = sparse.eye(3 * total) - sparse.diags(follows.astype(float), -3)
    steering = sparse.bsr_matrix((change[:, :, None], np.arange(total), np.arange(total + 1))).tocsr()
    points = [len(row["distances_m"]) for row in rows]
    at = np.repeat(np.arange(total), np.repeat(points, stages))  # inequality by inequality, its stage
    count, normals = len(at), np.concatenate([row["normals"].reshape(-1, 1, 3) for row in rows])
    facing = sparse.bsr_matrix((normals, at, np.arange(count + 1)), shape=(count, 3 * total)).tocsr()
    picks = sparse.csr_matrix((np.ones(count), at, np.arange(count + 1)), shape=(count, total))
    least = np.concatenate([-row.gaps(row["reference_m"], row["normals"]).ravel() for row in rows])
    weights = [(row.dt * row.error_weight / row.scale, row.dt * row.slack_weight / row.scale) for row in rows]
    of_error, of_slack = np.sqrt(weights).T
    e, omega, u = cp.Variable(3 * total), cp.Variable(total), cp.Variable(total)
    constraints = [dynamics @ e - steering @ omega == drift.ravel(), omega >= 0.0, omega <= 1.0, u >= 0.0]
    constraints += [facing @ e + picks @ u >= least] if count else []
    error = cp.sum_squares(cp.multiply(np.repeat(of_error, 3 * stages), e))
    slack = cp.sum_squares(cp.multiply(np.repeat(of_slack, stages), u))
    cp.Problem(cp.Minimize(error + slack), constraints).solve(solver=cp.CLARABEL)
    if omega.value is None:
        raise TraceError("the independent solver gave no solution")
    shares = [np.clip(part, 0.0, 1.0) for part in np.split(omega.value, len(rows))]
    dual = np.maximum(0.0, constraints[-1].dual_value) if count else np.empty(0)
    parts = np.split(dual, np.cumsum(stages * np.array(points))[:-1])
    return shares, [part.reshape(stages, m) for part, m in zip(parts, points, strict=True)]
