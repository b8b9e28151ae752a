"""A recorded decision of the gatekeeper: its problem (26), predictions (23) and costs (25)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from .rules import Array, holds, same
from .run import Run

LEAST_COST = 1e-6
"""Costs are compared relative to the cheaper constant plan's, but to no less than this: 1 mm of error for 1 s."""
PLANNED = ("optimal", "budget_spent", "solver_failed")
"""Statuses of decisions that rest on a plan; the others are refusals for want of one."""
OF_OUTCOMES = (
    "refuse_outcome_m2_s", "accept_outcome_m2_s", "refuse_stalls", "accept_stalls", "refuse_left_m", "accept_left_m",
    "lag_m", "predicted_lag_m", "tries",
)  # fmt: skip
"""Columns about decisions by outcomes, which say nothing of those by problems (26)."""
NOTHING = -1.0
"""Stands where a column says nothing."""
ARRAYS = (
    "initial_m", "accept_m_s", "refuse_m_s", "reference_m", "centres_m", "distances_m",
    "plan", "positions_m", "relaxed", "rounded", "normals",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Decision:
    """One decision; N stages, m points to keep away from.

    Attributes:
        row: its row of the table of decisions.
        dt_s: length of a stage.
        error_weight_1_m2_s: a of (25).
        slack_weight_1_m2_s: b of (25).
        terminal_weight_s: w of the terminal cost w a ||rho_rd - rho_N||^2, which (25) has besides; 0 in the paper.
        initial_m: (3,).
        accept_m_s: a_k of (23), (N, 3).
        refuse_m_s: b_k of (23), (N, 3).
        reference_m: (N, 3).
        centres_m: points at the ends of the stages, (N, m, 3).
        distances_m: d of each point, (m,).
        plan: omega, (N,), 1: accept, 0: refuse; empty without a plan.
        positions_m: predicted under the plan, (N, 3); empty without a plan.
        relaxed: omega of (27), (N,) or empty.
        rounded: the same rounded, (N,) or empty.
        normals: of the half-planes that the lower bound is about, (N, m, 3); None if there are none.
    """

    row: dict[str, Any]
    dt_s: float
    error_weight_1_m2_s: float
    slack_weight_1_m2_s: float
    terminal_weight_s: float
    initial_m: Array
    accept_m_s: Array
    refuse_m_s: Array
    reference_m: Array
    centres_m: Array
    distances_m: Array
    plan: Array
    positions_m: Array
    relaxed: Array
    rounded: Array
    normals: Array | None

    @property
    def t_s(self) -> float:
        """When."""
        return float(self.row["t_s"])

    @property
    def ugv(self) -> str:
        """Who decides."""
        return str(self.row["robot"])

    @property
    def stages(self) -> int:
        """N."""
        return len(self.reference_m)

    @property
    def planned(self) -> bool:
        """Whether it rests on a plan."""
        return self.row["status"] in PLANNED

    def positions_of(self, omega: Array) -> Array:
        """(23): rho_k = rho_(k-1) + dt (omega_k a_k + (1 - omega_k) b_k); omega (..., N) to (..., N, 3), m."""
        velocity = self.refuse_m_s + omega[..., None] * (self.accept_m_s - self.refuse_m_s)
        return self.initial_m + self.dt_s * np.cumsum(velocity, axis=-2)

    def gaps_m(self, positions_m: Array, normals: Array | None = None) -> Array:
        """Distances less d at the end of each stage, (..., N, m); along normals (N, m, 3), if given, that are not 0."""
        away = positions_m[..., None, :] - self.centres_m
        if normals is None:
            return np.asarray(np.linalg.norm(away, axis=-1) - self.distances_m)
        asked = (normals != 0.0).any(axis=-1)
        return np.where(asked, (away * normals).sum(axis=-1) - self.distances_m, 0.0)

    @cached_property
    def half_planes(self) -> Array | None:
        """The normals, but 0 where the point is out of reach: in the box of a stage's positions none is within d.

        The box is spanned by the sums of the smaller and of the larger velocities up to there.
        """
        if self.normals is None:
            return None
        slower = np.minimum(self.accept_m_s, self.refuse_m_s)
        faster = np.maximum(self.accept_m_s, self.refuse_m_s)
        lowest = self.initial_m + self.dt_s * np.cumsum(slower, axis=0)
        highest = self.initial_m + self.dt_s * np.cumsum(faster, axis=0)
        beyond = np.maximum(lowest[:, None] - self.centres_m, self.centres_m - highest[:, None])
        distance = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return np.where((distance < self.distances_m)[..., None], self.normals, 0.0)

    def cost(self, positions_m: Array, normals: Array | None = None) -> Array:
        """(25): sum_k e_k ||rho_rd - rho_k||^2 + dt b u_k^2, u_k being what the distances lack at most; (...)."""
        error = (((positions_m - self.reference_m) ** 2).sum(axis=-1) * self.error_weights_1_m2).sum(axis=-1)
        slack = self.gaps_m(positions_m, normals).min(axis=-1, initial=0.0)
        return np.asarray(error + self.dt_s * self.slack_weight_1_m2_s * (slack**2).sum(axis=-1))

    @cached_property
    def error_weights_1_m2(self) -> Array:
        """e_k: dt a for every stage, and w a besides for the last, (N,)."""
        seconds = np.full(self.stages, self.dt_s)
        seconds[-1] += self.terminal_weight_s
        return self.error_weight_1_m2_s * seconds

    @cached_property
    def constant_m(self) -> Array:
        """Positions under the plans that refuse and that accept throughout, (2, N, 3)."""
        return self.positions_of(np.array([[0.0], [1.0]]) * np.ones(self.stages))

    @cached_property
    def constant_cost(self) -> Array:
        """Costs of the plans that refuse and that accept throughout, (2,)."""
        return self.cost(self.constant_m)

    @cached_property
    def scale(self) -> float:
        """What differences of cost are compared with: the cost of the cheaper constant plan."""
        return max(LEAST_COST, float(self.constant_cost.min()))


@lru_cache(maxsize=8)
def decisions_of(run: Run) -> list[Decision]:
    """All decisions of a run, with their problems.

    Raises:
        Disagreement: if the tables do not belong together, a number is not finite or has no place.
    """
    same("a problem for each decision", len(run.problems), len(run.decisions))
    stages = int(run.scenario["gatekeeper"]["stages"])
    rows, problems = run.decisions.to_dict("records"), run.problems.to_dict("records")
    return [_decision(row, problem, stages) for row, problem in zip(rows, problems, strict=True)]


def _decision(row: dict[Any, Any], problem: dict[Any, Any], stages: int) -> Decision:
    """A row of both tables, arrays in shape."""
    flat: dict[str, Array] = {name: np.asarray(problem[name], dtype=np.float64).ravel() for name in ARRAYS}
    about, when = f"decision of {row['robot']}", float(row["t_s"])
    scalars = [value for value in (*row.values(), *problem.values()) if isinstance(value, float)]
    numbers = np.concatenate([scalars, *flat.values()])
    holds("numbers of a decision are finite", np.isfinite(numbers), numbers, "a number", about=about, t_s=when)
    for name in OF_OUTCOMES:
        holds(f"nothing is said of {name}", row[name] == NOTHING, row[name], NOTHING, about=about, t_s=when)
    points = len(flat["distances_m"])
    for name, allowed in _sizes(stages, points, planned=row["status"] in PLANNED).items():
        holds(f"size of {name}", len(flat[name]) in allowed, len(flat[name]), str(allowed), about=about, t_s=when)
    normals = flat["normals"] if len(flat["normals"]) == 3 * stages * points else None
    return Decision(
        row={str(name): value for name, value in row.items()},
        dt_s=float(problem["dt_s"]),
        error_weight_1_m2_s=float(problem["error_weight_1_m2_s"]),
        slack_weight_1_m2_s=float(problem["slack_weight_1_m2_s"]),
        terminal_weight_s=float(problem["terminal_weight_s"]),
        initial_m=flat["initial_m"],
        accept_m_s=flat["accept_m_s"].reshape(stages, 3),
        refuse_m_s=flat["refuse_m_s"].reshape(stages, 3),
        reference_m=flat["reference_m"].reshape(stages, 3),
        centres_m=flat["centres_m"].reshape(stages, points, 3),
        distances_m=flat["distances_m"],
        plan=flat["plan"],
        positions_m=flat["positions_m"].reshape(-1, 3),
        relaxed=flat["relaxed"],
        rounded=flat["rounded"],
        normals=None if normals is None else normals.reshape(stages, points, 3),
    )


def _sizes(stages: int, points: int, *, planned: bool) -> dict[str, tuple[int, ...]]:
    """How many numbers each array of a problem may have."""
    return {
        "initial_m": (3,),
        "accept_m_s": (3 * stages,),
        "refuse_m_s": (3 * stages,),
        "reference_m": (3 * stages,),
        "centres_m": (3 * stages * points,),
        "plan": (stages,) if planned else (0,),
        "positions_m": (3 * stages,) if planned else (0,),
        "relaxed": (0, stages),
        "rounded": (0, stages),
        "normals": (0, 3 * stages * points),
    }


def silent_ugvs(run: Run) -> list[str]:
    """If nobody decided: UGVs that needed a decision, for they were intervened on or executed an intervention."""
    if len(run.decisions):
        return []
    return [ugv for ugv in run.ugvs if run.executed(ugv).any() or run.talk_is_due(ugv)]
