"""Search for better binary plans by the exact cost (25)-(26d): dynamic programming over labels, and exchanges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.budget import UNLIMITED, Budget
from airground_drake.gatekeeper.half_planes import DualBound
from airground_drake.gatekeeper.problem import Evaluation, Problem
from airground_drake.gatekeeper.solution import ConstantPlans, remaining_cost

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
        self, problem: Problem, constants: ConstantPlans, tail: Array, budget: Budget, outlook: DualBound | None = None
    ) -> None:
        """Start from the constant plans.

        Args:
            problem: data of (26).
            constants: its constant plans.
            tail: `remaining_cost(problem)`.
            budget: of each search.
            outlook: estimate of the cost to come that guides `labels`; None: no estimate.
        """
        self._problem = problem
        self._nodes = budget.nodes
        self._modes = np.stack([problem.refuse, problem.accept])
        self._tail = tail
        none = np.zeros((problem.stages + 1, 3))
        self._blind = DualBound(np.full(problem.stages + 1, -np.inf), none, none[1:], pressed=False)
        self._outlook = self._blind if outlook is None else outlook
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

    def labels(self, width: int, radius: float = EVERYWHERE, slackness: float = np.inf) -> None:
        """Dynamic programming over stage and position: see `_labels`.

        Args:
            width: most labels per stage; the budget's nodes may allow fewer.
            radius: of the tube about the best plan known in which plans are looked for, m.
            slackness: labels are followed up to that much, relatively, above what the outlook says is worth it;
                inf: the outlook is not asked at all.
        """
        p = self._problem
        for first, known in enumerate(tuple(self.plans)):
            ahead = self._outlook if slackness < np.inf else self._blind
            limit = max(known.objective, ahead.bound) * (1.0 if slackness == np.inf else 1.0 + slackness)
            plan, cost, finished = _labels(
                first, known.objective, limit, width, self._nodes, known.positions, radius, self._tail,
                ahead.constants, ahead.slopes, ahead.at, p.dt, p.initial, self._modes,
                p.reference, p.centres, p.distances, p.error_weight, p.slack_weight,
            )  # fmt: skip
            self.complete = self.complete and finished
            if cost < known.objective:
                self.offer(p.evaluate(plan))

    def exchanges(self, reach: int) -> None:
        """Flip single stages and swap stages at most `reach` apart until nothing improves: see `_exchange`."""
        p = self._problem
        for known in tuple(self.plans):
            plan, finished = _exchange(
                known.omega, self._nodes, reach, p.dt, p.initial, self._modes, p.reference, p.centres,
                p.distances, p.error_weight, p.slack_weight,
            )  # fmt: skip
            self.complete = self.complete and finished
            self.offer(p.evaluate(plan))


def best_known(problem: Problem, width: int = 4096, offers: Sequence[Array] = ()) -> tuple[float, float]:
    """Lowest costs found, with much work and no relaxation, of plans that refuse first and that accept first.

    Args:
        problem: data of (26).
        width: labels per stage.
        offers: plans (N,) known from elsewhere.
    """
    polish = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), UNLIMITED)
    for omega in offers:
        polish.offer(problem.evaluate(omega))
    polish.exchanges(3)
    polish.labels(width)
    before = np.inf
    while polish.best.objective < before:
        before = polish.best.objective
        for radius in (0.5, 0.1, 0.02):
            polish.labels(width, radius)
        polish.exchanges(problem.stages)
    refuse, accept = polish.plans
    return refuse.objective, accept.objective


@njit(cache=True)
def stage_cost(
    x: float,
    y: float,
    z: float,
    k: int,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
) -> float:
    """Integrand of (25) at the end of stage k in (x, y, z), m; roots are drawn only within a safe distance."""
    slack = 0.0
    for m in range(len(distances)):
        squared = (x - centres[k, m, 0]) ** 2 + (y - centres[k, m, 1]) ** 2 + (z - centres[k, m, 2]) ** 2
        if squared < distances[m] ** 2:
            slack = max(slack, distances[m] - np.sqrt(squared))
    error = (reference[k, 0] - x) ** 2 + (reference[k, 1] - y) ** 2 + (reference[k, 2] - z) ** 2
    return error_weight * error + slack_weight * slack * slack


@njit(cache=True)
def _labels(
    first: int,
    known: float,
    limit: float,
    width: int,
    nodes: int,
    tube: Array,
    radius: float,
    tail: Array,
    constants: Array,
    slopes: Array,
    along_at: Array,
    dt: float,
    initial: Array,
    modes: Array,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
) -> tuple[Array, float, bool]:
    """Plan (N,) whose first stage is `first`, its cost, inf if none below `known` was found, and if it finished.

    A label is a plan for the first k stages: its position and its cost. Mode velocities do not depend on the
    position, so that of two labels in the same position only the cheaper one matters. Labels are taken for
    equal when they share a cell of a grid that is laid, at each stage, over where the labels are, along the
    main direction of the modes' difference; the cheaper one, by its cost plus the slope of the outlook, stays.
    Positions and costs themselves are never rounded: the grid only decides what is dropped. It has at most
    `width` cells, and so few that the nodes left last for the stages left; below 2 the search gives up.

    Dropped are labels outside the tube, labels whose cost plus `tail` is not below `known` (they cannot lead
    to a cheaper plan), and those whose cost plus the outlook is not below `limit` (they could, where an obstacle
    is passed on the other side than the half-planes have it).
    """
    stages = modes.shape[1]
    parent = np.empty((stages, width), dtype=np.int32)
    mode = np.empty((stages, width), dtype=np.int8)
    at, cost, merit = np.empty((width, 3)), np.empty(width), np.empty(width)
    new_at, new_cost, new_merit = np.empty((2 * width, 3)), np.empty(2 * width), np.empty(2 * width)
    along, across = np.empty(2 * width), np.empty(2 * width)
    new_parent, new_mode = np.empty(2 * width, dtype=np.int32), np.empty(2 * width, dtype=np.int8)
    cell = np.full(width, -1, dtype=np.int32)
    xx, xy, yy = 0.0, 0.0, 0.0
    for k in range(stages):
        x, y = modes[1, k, 0] - modes[0, k, 0], modes[1, k, 1] - modes[0, k, 1]
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    cos, sin = np.cos(angle), np.sin(angle)
    at[0], cost[0] = initial, 0.0
    count = 1
    for k in range(stages):
        found = 0
        slope_x, slope_y, slope_z = slopes[k + 1]
        offset = constants[k + 1] - slope_x * along_at[k, 0] - slope_y * along_at[k, 1] - slope_z * along_at[k, 2]
        low_a, high_a, low_c, high_c = np.inf, -np.inf, np.inf, -np.inf
        for i in range(count):
            for w in range(2):
                if k == 0 and w != first:
                    continue
                x, y, z = at[i, 0] + dt * modes[w, k, 0], at[i, 1] + dt * modes[w, k, 1], at[i, 2] + dt * modes[w, k, 2]
                if (x - tube[k, 0]) ** 2 + (y - tube[k, 1]) ** 2 > radius * radius:
                    continue
                total = cost[i] + dt * stage_cost(x, y, z, k, reference, centres, distances, error_weight, slack_weight)
                toward = total + slope_x * x + slope_y * y + slope_z * z
                if total + tail[k + 1] >= known or toward + offset >= limit:
                    continue
                new_merit[found] = toward
                new_at[found, 0], new_at[found, 1], new_at[found, 2] = x, y, z
                new_cost[found], new_parent[found], new_mode[found] = total, i, w
                a, c = cos * x + sin * y, cos * y - sin * x
                along[found], across[found] = a, c
                low_a, high_a, low_c, high_c = min(low_a, a), max(high_a, a), min(low_c, c), max(high_c, c)
                found += 1
        nodes -= found
        cells = min(width, nodes // (2 * max(1, stages - 1 - k)))
        if found == 0 or cells < 2:
            return np.full(stages, float(first)), np.inf, found == 0
        # the cells of this side just suffice: (length / side + 1) (breadth / side + 1) = cells
        length, breadth = high_a - low_a, high_c - low_c
        both = length + breadth
        side = (both + np.sqrt(both * both + 4.0 * (cells - 1) * length * breadth)) / (2.0 * (cells - 1))
        side = max(side, 1e-9) * (1.0 + 1e-9)
        columns = int(length / side) + 1
        cell[:] = -1
        count = 0
        for j in range(found):
            c = int((across[j] - low_c) / side) * columns + int((along[j] - low_a) / side)
            t = cell[c]
            if t < 0:
                t = count
                cell[c] = t
                count += 1
            elif new_merit[j] >= merit[t]:
                continue
            at[t, 0], at[t, 1], at[t, 2] = new_at[j, 0], new_at[j, 1], new_at[j, 2]
            cost[t], merit[t], parent[k, t], mode[k, t] = new_cost[j], new_merit[j], new_parent[j], new_mode[j]
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
def _advance(
    since: int,
    omega: npt.NDArray[np.int64],
    at: Array,
    cost: Array,
    dt: float,
    modes: Array,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
) -> None:
    """Positions (N + 1, 3), m, and running costs (N + 1,) of a plan after stage `since`, in place."""
    for k in range(since, len(omega)):
        for a in range(3):
            at[k + 1, a] = at[k, a] + dt * modes[omega[k], k, a]
        cost[k + 1] = cost[k] + dt * stage_cost(
            at[k + 1, 0], at[k + 1, 1], at[k + 1, 2], k, reference, centres, distances, error_weight, slack_weight
        )


@njit(cache=True)
def _exchange(
    start: Array,
    nodes: int,
    reach: int,
    dt: float,
    initial: Array,
    modes: Array,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
) -> tuple[Array, bool]:
    """Plan (N,) that no single flip, and no swap within `reach`, makes cheaper, and whether `nodes` lasted.

    The first stage stays. A node is one changed plan, costed from the first change on until it is dearer.
    """
    stages = len(start)
    omega = start.astype(np.int64)
    at, cost = np.empty((stages + 1, 3)), np.zeros(stages + 1)
    at[0] = initial
    _advance(0, omega, at, cost, dt, modes, reference, centres, distances, error_weight, slack_weight)
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
                omega[i] = 1 - omega[i]
                if j > i:
                    omega[j] = 1 - omega[j]
                x, y, z = at[i, 0], at[i, 1], at[i, 2]
                total = cost[i]
                for k in range(i, stages):
                    x += dt * modes[omega[k], k, 0]
                    y += dt * modes[omega[k], k, 1]
                    z += dt * modes[omega[k], k, 2]
                    total += dt * stage_cost(x, y, z, k, reference, centres, distances, error_weight, slack_weight)
                    if total >= limit:
                        break
                if total < limit:
                    improved = True
                    _advance(i, omega, at, cost, dt, modes, reference, centres, distances, error_weight, slack_weight)
                else:
                    omega[i] = 1 - omega[i]
                    if j > i:
                        omega[j] = 1 - omega[j]
    return omega.astype(np.float64), True
