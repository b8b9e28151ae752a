"""All binary plans with a minimum dwell, by the exact cost (25)-(26d), in bounded time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.local_search import stage_cost
from airground_drake.gatekeeper.problem import Evaluation, Problem, Solution
from airground_drake.gatekeeper.solution import ConstantPlans, block_of_stage, choose, cut_short, remaining_cost


class EnumerationRoute:
    """Exact minimum of (26) over the plans that are constant on blocks of N / `blocks` stages.

    Mode velocities are data, so that a plan's cost is a sum over its stages and two plans share the cost of
    their common prefix. The tree of 2^blocks plans is searched depth first; a branch is cut where its cost so
    far plus a lower bound of the rest is not below the best plan known. The rest is bounded by the task error
    from the box that any plan stays in (see `remaining_cost`). Distances are exact: no half-planes, no relaxation.

    Both halves of the tree (plans that start by accepting, by refusing) are searched separately, so that both
    `objective_accept` and `objective_refuse` are exact. `lower_bound` equals `objective` and the gap is 0:
    among the plans with this dwell, not among all binary plans.

    Budget: each half visits at most `nodes` blocks, of at most 2^blocks that there are, and the clock is asked
    before each. A half that is not finished is bounded by its open branches, or, not begun, by `remaining_cost`.
    """

    def __init__(self, blocks: int = 10) -> None:
        """Compile the search.

        Raises:
            ValueError: if `blocks` is not from 1 to 20.
        """
        if not 1 <= blocks <= 20:
            raise ValueError(f"blocks: {blocks}, allowed: 1 to 20")
        self._blocks = blocks
        none = np.zeros((1, 0, 3))
        row = np.zeros((1, 3))
        self.solve(Problem(1.0, np.zeros(3), row, row, row, none, np.zeros(0), 1.0, 1.0))

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """Accept or refuse; a tie accepts. Never raises for a broken problem, but refuses and says why."""
        if not problem.is_finite():
            return Solution(False, "refused_not_finite")
        if budget.spent():
            return Solution(False, "refused_budget_spent")
        constants = ConstantPlans.of(problem)
        if not constants.are_finite():
            return Solution(False, "refused_not_finite")
        block = block_of_stage(problem.stages, self._blocks)
        starts = np.searchsorted(block, np.arange(block[-1] + 2)).astype(np.int64)
        modes = np.stack([problem.refuse, problem.accept])
        tail = remaining_cost(problem)
        plans: list[Evaluation] = [constants.refuse, constants.accept]
        bounds, finished = [float(tail[0])] * 2, True
        for first, plan in enumerate(tuple(plans)):
            if budget.spent():
                return cut_short(problem, plans[::-1], tail, bound=min(bounds))
            chosen, bound = _search(
                first, plan.objective, budget.nodes, starts, problem.dt, problem.initial, modes, problem.reference,
                problem.centres, problem.distances, problem.error_weight, problem.slack_weight, tail,
            )  # fmt: skip
            found = problem.evaluate(chosen[block])
            plans[first] = found if found.objective <= plan.objective else plan
            bounds[first] = min(bound, plans[first].objective)
            finished = finished and bound == np.inf
        if not finished:
            return cut_short(problem, plans[::-1], tail, bound=min(bounds))
        return choose(problem, plans[::-1], lower_bound=min(bounds), gap=0.0)


@njit(cache=True)
def _search(
    first: int,
    known: float,
    nodes: int,
    starts: npt.NDArray[np.int64],
    dt: float,
    initial: Array,
    modes: Array,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
    tail: Array,
) -> tuple[Array, float]:
    """Modes (B,) of the cheapest plan whose first block has mode `first`; constant if none is below `known`.

    With them a lower bound of all plans that were not visited; inf if the search finished.

    Args:
        first: 0 or 1.
        known: cost of the constant plan.
        nodes: most blocks to visit.
        starts: first stage of each block and N, (B + 1,).
        dt: s.
        initial: (3,), m.
        modes: velocities of the modes, (2, N, 3), m/s.
        reference: (N, 3), m.
        centres: (N, m, 3), m.
        distances: (m,), m.
        error_weight: a of (25).
        slack_weight: b of (25).
        tail: lower bound of the cost from stage k on, (N + 1,).
    """
    depth = len(starts) - 1
    best = np.full(depth, float(first))
    at = np.empty((depth + 1, 3))
    at[0] = initial
    cost = np.zeros(depth + 1)
    mode = np.zeros(depth, dtype=np.int64)
    tried = np.zeros(depth, dtype=np.int64)
    b = 0
    while b >= 0:
        if tried[b] == (1 if b == 0 else 2):
            b -= 1
            continue
        if nodes == 0:
            # what is open: the continuations of every prefix that has a mode untried
            bound = np.inf
            for i in range(b + 1):
                if tried[i] < (1 if i == 0 else 2):
                    bound = min(bound, cost[i] + tail[starts[i]])
            return best, bound
        nodes -= 1
        # the mode of the block before comes first: constant continuations are good incumbents
        before = first if b == 0 else mode[b - 1]
        mode[b] = before if tried[b] == 0 else 1 - before
        tried[b] += 1
        total, limit = cost[b], known - tail[starts[b + 1]]
        x, y, z = at[b, 0], at[b, 1], at[b, 2]
        for k in range(starts[b], starts[b + 1]):
            x += dt * modes[mode[b], k, 0]
            y += dt * modes[mode[b], k, 1]
            z += dt * modes[mode[b], k, 2]
            total += dt * stage_cost(x, y, z, k, reference, centres, distances, error_weight, slack_weight)
            if total >= limit:
                break
        if total >= limit:
            continue
        if b == depth - 1:
            known = total
            for i in range(depth):
                best[i] = float(mode[i])
            continue
        b += 1
        at[b, 0], at[b, 1], at[b, 2] = x, y, z
        cost[b] = total
        tried[b] = 0
    return best, np.inf
