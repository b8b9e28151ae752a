"""Search for better binary plans by the exact cost (25)-(26d): label setting with dominance, 1- and 2-exchanges.

Only `routes.relaxed` and the benchmarks use it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.budget import UNLIMITED, Budget
from airground_drake.gatekeeper.cost import Terms, stage_cost
from airground_drake.gatekeeper.dual_bound import DualBound
from airground_drake.gatekeeper.problem import Evaluation, Kinematics, Problem
from airground_drake.gatekeeper.reachable_box import remaining_cost
from airground_drake.gatekeeper.solution import ConstantPlans

EVERYWHERE = np.inf
"""Radius of a search that is not confined to a tube."""


class LocalSearch:
    """Improves the cheapest known plans that start by refusing and by accepting, each for itself.

    The searches prove no optimality; they only ever replace a plan by a cheaper one, so that the result is
    never worse than what they start from. Each spends at most the budget's nodes: labels, or changed plans.

    Attributes:
        plans: the cheapest known, refusing first and accepting first.
        complete: whether the nodes lasted for all searches so far.
    """

    def __init__(
        self, problem: Problem, constants: ConstantPlans, tail: Array, budget: Budget, ahead: DualBound | None = None
    ) -> None:
        """Start from the constant plans.

        Args:
            problem: data of (26).
            constants: its constant plans.
            tail: `remaining_cost(problem)`.
            budget: of each search.
            ahead: estimate of the cost to come that guides `label_setting`; None: no estimate.
        """
        self._problem = problem
        self._nodes = budget.nodes
        self._tail = tail
        self._blind = DualBound.none(problem.stages)
        self._ahead = self._blind if ahead is None else ahead
        self.plans = [constants.refuse, constants.accept]
        self.complete = True

    def offer(self, plan: Evaluation) -> None:
        """Take a plan, of any origin, if it is cheaper than what is known with its first stage."""
        first = int(plan.omega[0])
        if plan.objective < self.plans[first].objective:
            self.plans[first] = plan

    def offer_both(self, omega: Array) -> None:
        """Offer a plan (N,), and the same with the other first stage."""
        self.offer(self._problem.evaluate(omega))
        other = omega.copy()
        other[0] = 1.0 - other[0]
        self.offer(self._problem.evaluate(other))

    @property
    def best(self) -> Evaluation:
        """The cheaper one; accepting on a tie."""
        refuse, accept = self.plans
        return accept if accept.objective <= refuse.objective else refuse

    def label_setting(self, width: int, radius: float = EVERYWHERE, slackness: float = np.inf) -> None:
        """Dynamic programming over stage and position: see `_set_labels`.

        Args:
            width: most labels per stage; the budget's nodes may allow fewer.
            radius: of the tube about the best plan known in which plans are looked for, m.
            slackness: labels are followed up to that much, relatively, above what the dual bound says is worth
                it; inf: the bound is not asked at all.
        """
        p = self._problem
        for first, known in enumerate(tuple(self.plans)):
            ahead = self._ahead if slackness < np.inf else self._blind
            limit = max(known.objective, ahead.bound) * (1.0 if slackness == np.inf else 1.0 + slackness)
            space = Space(first, known.objective, limit, width, known.positions, radius)
            task = Task(p.kinematics, p.terms, ahead, self._tail, space)
            plan, cost, finished = _set_labels(task, self._nodes)
            self.complete = self.complete and finished
            if cost < known.objective:
                self.offer(p.evaluate(plan))

    def exchanges(self, reach: int) -> None:
        """1-exchanges, and 2-exchanges of stages at most `reach` apart, until none improves: see `_exchange`."""
        p = self._problem
        for known in tuple(self.plans):
            plan, finished = _exchange(p.kinematics, p.terms, known.omega, reach, self._nodes)
            self.complete = self.complete and finished
            self.offer(p.evaluate(plan))


def best_known(problem: Problem, width: int = 4096, offers: Sequence[Array] = ()) -> tuple[float, float]:
    """Lowest costs found, with much work and no relaxation, of plans that refuse first and that accept first.

    Args:
        problem: data of (26).
        width: labels per stage.
        offers: plans (N,) known from elsewhere.
    """
    search = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), UNLIMITED)
    for omega in offers:
        search.offer(problem.evaluate(omega))
    search.exchanges(3)
    search.label_setting(width)
    before = np.inf
    while search.best.objective < before:
        before = search.best.objective
        for radius in (0.5, 0.1, 0.02):
            search.label_setting(width, radius)
        search.exchanges(problem.stages)
    refuse, accept = search.plans
    return refuse.objective, accept.objective


# --- label setting -----------------------------------------------------------------------------------------------


class Space(NamedTuple):
    """Which plans a search over labels looks at.

    Attributes:
        first: mode of their first stage.
        known: cost that they must be below.
        limit: labels whose cost plus the dual bound is not below it are dropped.
        width: most labels per stage.
        tube: axis of the tube that they stay in, (N, 3), m.
        radius: of the tube, m.
    """

    first: int
    known: float
    limit: float
    width: int
    tube: Array
    radius: float


class Task(NamedTuple):
    """All that a search over labels reads.

    Attributes:
        motion: (23).
        terms: (25).
        ahead: bounds of the cost to come, along half-planes.
        tail: bounds of the cost to come that hold for all plans, (N + 1,).
        space: which plans are looked at.
    """

    motion: Kinematics
    terms: Terms
    ahead: DualBound
    tail: Array
    space: Space


class Labels(NamedTuple):
    """Plans for the stages up to one: room for W of them, written to.

    Attributes:
        at: where they lead, (W, 3), m.
        cost: (25) so far, (W,).
        merit: cost plus the slope of the dual bound, (W,): of equal labels the one with less dominates.
        parent: label of the stage before that each continues, (W,).
        mode: of the last stage, (W,).
    """

    at: Array
    cost: Array
    merit: Array
    parent: npt.NDArray[np.int32]
    mode: npt.NDArray[np.int8]


@njit(cache=True)
def _set_labels(task: Task, nodes: int) -> tuple[Array, float, bool]:
    """Plan (N,) of the space, its cost, inf if none below `known` was found, and if the search finished.

    A label is a plan for the first k stages: its position and its cost. Mode velocities do not depend on the
    position, so that of two labels in the same position the cheaper one dominates. Labels are taken for equal when
    they share a cell of a grid, see `_keep_dominant`. Positions and costs themselves are never rounded: the grid
    only decides what is dropped. It has at most `width` cells, and so few that the nodes left last for the stages
    left; below 2 the search gives up.
    """
    stages, width = len(task.terms.reference), task.space.width
    parent, mode = np.empty((stages, width), dtype=np.int32), np.empty((stages, width), dtype=np.int8)
    at, cost, merit = np.empty((width, 3)), np.empty(width), np.empty(width)
    successors = Labels(
        np.empty((2 * width, 3)), np.empty(2 * width), np.empty(2 * width),
        np.empty(2 * width, dtype=np.int32), np.empty(2 * width, dtype=np.int8),
    )  # fmt: skip
    cell = np.empty(width, dtype=np.int32)
    direction = _main_direction(task.motion.velocities)
    at[0], cost[0] = task.motion.initial, 0.0
    count = 1
    for k in range(stages):
        found = _extend(task, k, count, at, cost, successors)
        nodes -= found
        cells = min(width, nodes // (2 * max(1, stages - 1 - k)))
        if found == 0 or cells < 2:
            return np.full(stages, float(task.space.first)), np.inf, found == 0
        kept = Labels(at, cost, merit, parent[k], mode[k])
        count = _keep_dominant(successors, found, direction, cells, cell, kept)
    i = 0
    for j in range(count):
        if cost[j] < cost[i]:
            i = j
    best = cost[i]
    plan = np.empty(stages)
    for k in range(stages - 1, -1, -1):
        plan[k] = mode[k, i]
        i = parent[k, i]
    return plan, best, True


@njit(cache=True)
def _main_direction(velocities: Array) -> tuple[float, float]:
    """Cosine and sine of the main direction, in the plane, of the modes' difference; velocities (2, N, 3), m/s."""
    xx, xy, yy = 0.0, 0.0, 0.0
    for k in range(velocities.shape[1]):
        x, y = velocities[1, k, 0] - velocities[0, k, 0], velocities[1, k, 1] - velocities[0, k, 1]
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return np.cos(angle), np.sin(angle)


@njit(cache=True)
def _extend(task: Task, k: int, count: int, at: Array, cost: Array, successors: Labels) -> int:
    """Extend `count` labels, at (W, 3), m, with cost (W,), by stage k in either mode; returns how many there are then.

    Dropped are labels outside the tube, labels whose cost plus `tail` is not below `known` (they cannot lead
    to a cheaper plan), and those whose cost plus the dual bound is not below `limit` (they could, where an
    obstacle is passed on the other side than the half-planes have it).
    """
    motion, terms, ahead, tail, space = task
    dt, velocities, tube = motion.dt, motion.velocities, space.tube
    slope_x, slope_y, slope_z = ahead.slopes[k + 1, 0], ahead.slopes[k + 1, 1], ahead.slopes[k + 1, 2]
    offset = ahead.constants[k + 1] - slope_x * ahead.at[k, 0] - slope_y * ahead.at[k, 1] - slope_z * ahead.at[k, 2]
    found = 0
    for i in range(count):
        for w in range(2):
            if k == 0 and w != space.first:
                continue
            x = at[i, 0] + dt * velocities[w, k, 0]
            y = at[i, 1] + dt * velocities[w, k, 1]
            z = at[i, 2] + dt * velocities[w, k, 2]
            if (x - tube[k, 0]) ** 2 + (y - tube[k, 1]) ** 2 > space.radius * space.radius:
                continue
            total = cost[i] + stage_cost(terms, k, x, y, z)
            merit = total + slope_x * x + slope_y * y + slope_z * z
            if total + tail[k + 1] >= space.known or merit + offset >= space.limit:
                continue
            successors.at[found, 0], successors.at[found, 1], successors.at[found, 2] = x, y, z
            successors.cost[found], successors.merit[found] = total, merit
            successors.parent[found], successors.mode[found] = i, w
            found += 1
    return found


@njit(cache=True)
def _keep_dominant(
    successors: Labels,
    found: int,
    direction: tuple[float, float],
    cells: int,
    cell: npt.NDArray[np.int32],
    kept: Labels,
) -> int:
    """Put the dominant ones of the first `found` successors into `kept`; returns how many these are.

    A grid of at most `cells` squares is laid over where the labels are, along `direction` (cosine and sine); of
    the labels of a square the one of least merit stays.
    """
    cos, sin = direction
    low_a, high_a, low_c, high_c = np.inf, -np.inf, np.inf, -np.inf
    for j in range(found):
        x, y = successors.at[j, 0], successors.at[j, 1]
        along, across = cos * x + sin * y, cos * y - sin * x
        low_a, high_a, low_c, high_c = min(low_a, along), max(high_a, along), min(low_c, across), max(high_c, across)
    # the squares of this side just suffice: (length / side + 1) (breadth / side + 1) = cells
    length, breadth = high_a - low_a, high_c - low_c
    both = length + breadth
    side = (both + np.sqrt(both * both + 4.0 * (cells - 1) * length * breadth)) / (2.0 * (cells - 1))
    side = max(side, 1e-9) * (1.0 + 1e-9)
    columns = int(length / side) + 1
    cell[:] = -1
    count = 0
    for j in range(found):
        x, y = successors.at[j, 0], successors.at[j, 1]
        along, across = cos * x + sin * y, cos * y - sin * x
        c = int((across - low_c) / side) * columns + int((along - low_a) / side)
        t = cell[c]
        if t < 0:
            t = count
            cell[c] = t
            count += 1
        elif successors.merit[j] >= kept.merit[t]:
            continue
        kept.at[t, 0], kept.at[t, 1], kept.at[t, 2] = x, y, successors.at[j, 2]
        kept.cost[t], kept.merit[t] = successors.cost[j], successors.merit[j]
        kept.parent[t], kept.mode[t] = successors.parent[j], successors.mode[j]
    return count


# --- exchanges ---------------------------------------------------------------------------------------------------


@njit(cache=True)
def _exchange(motion: Kinematics, terms: Terms, start: Array, reach: int, nodes: int) -> tuple[Array, bool]:
    """Plan (N,) that no 1-exchange, and no 2-exchange within `reach`, makes cheaper, and whether `nodes` lasted.

    A 1-exchange flips one stage; a 2-exchange swaps two that differ. The first stage stays. A node is one changed
    plan, costed from the first change on until it is dearer.
    """
    stages = len(start)
    omega = start.astype(np.int64)
    at, cost = np.empty((stages + 1, 3)), np.zeros(stages + 1)
    at[0] = motion.initial
    _advance(motion, terms, omega, 0, at, cost)
    improved = True
    while improved:
        improved = False
        for i in range(stages - 1, 0, -1):
            for j in range(i, min(i + reach, stages - 1) + 1):
                if j > i and omega[j] == omega[i]:
                    continue
                if nodes == 0:
                    return omega.astype(np.float64), False
                nodes -= 1
                limit = cost[stages] * (1.0 - 1e-12)  # less is rounding, which would go round in circles
                _flip(omega, i, j)
                if _is_below(motion, terms, omega, i, at[i], cost[i], limit):
                    improved = True
                    _advance(motion, terms, omega, i, at, cost)
                else:
                    _flip(omega, i, j)
    return omega.astype(np.float64), True


@njit(cache=True)
def _flip(omega: npt.NDArray[np.int64], i: int, j: int) -> None:
    """The other mode in stage i and, if it is another one, in stage j, in place."""
    omega[i] = 1 - omega[i]
    if j > i:
        omega[j] = 1 - omega[j]


@njit(cache=True)
def _is_below(
    motion: Kinematics, terms: Terms, omega: npt.NDArray[np.int64], since: int, at: Array, cost: float, limit: float
) -> bool:
    """Whether a plan that is at (3,), m, before stage `since`, with that cost so far, stays below the limit."""
    x, y, z = at[0], at[1], at[2]
    for k in range(since, len(omega)):
        x += motion.dt * motion.velocities[omega[k], k, 0]
        y += motion.dt * motion.velocities[omega[k], k, 1]
        z += motion.dt * motion.velocities[omega[k], k, 2]
        cost += stage_cost(terms, k, x, y, z)
        if cost >= limit:
            return False
    return True


@njit(cache=True)
def _advance(
    motion: Kinematics, terms: Terms, omega: npt.NDArray[np.int64], since: int, at: Array, cost: Array
) -> None:
    """Positions (N + 1, 3), m, and running costs (N + 1,) of a plan after stage `since`, in place."""
    for k in range(since, len(omega)):
        for a in range(3):
            at[k + 1, a] = at[k, a] + motion.dt * motion.velocities[omega[k], k, a]
        cost[k + 1] = cost[k] + stage_cost(terms, k, at[k + 1, 0], at[k + 1, 1], at[k + 1, 2])
