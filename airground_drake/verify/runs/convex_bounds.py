"""Bounds of the optimum of a decision's convex problem by weak duality; the solver need not be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import lsq_linear

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.verify.runs.gate_record import DecisionRecord

WIDE = 1e-5  # relative width of an enclosure above which a better omega* is looked for


@dataclass(frozen=True)
class Enclosure:
    """Bounds of the optimum of a decision's problem, and a lower bound for plans with the other first stage."""

    lower: float
    upper: float
    other_first: float

    def __and__(self, other: Enclosure) -> Enclosure:
        """The better of each bound."""
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
    import cvxpy  # takes a second, which other claims need not wait for

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
