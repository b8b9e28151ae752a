"""All binary plans with a minimum dwell, by the exact cost (25)-(26d), in bounded time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.blocks import block_of_stage, block_starts, check_blocks
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.cost import Terms, stage_cost
from airground_drake.gatekeeper.problem import Kinematics, Problem
from airground_drake.gatekeeper.reachable_box import remaining_cost
from airground_drake.gatekeeper.routes.guard import guarded
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, cheapest, cut_short


class EnumerationRoute:
    """Exact minimum of (26) over the plans that are constant on each of 10 blocks of the N stages.

    Mode velocities are data, so that a plan's cost is a sum over its stages and two plans share the cost of
    their common prefix. The tree of 2^blocks plans is searched depth first; a branch is cut where its cost so
    far plus a lower bound of the rest is not below the best plan known. The rest is bounded by the task error
    from the box that any plan stays in (see `remaining_cost`). Distances are exact: no half-planes, no relaxation.

    Both halves of the tree (plans that start by accepting, by refusing) are searched separately, so that both
    `objective_accept` and `objective_refuse` are exact. `route_bound` equals `objective` and the gap is 0:
    among the plans with this dwell, not among all binary plans.

    Budget: each half visits at most `nodes` blocks, of at most 2^blocks that there are, and the clock is asked
    before each. A half that is not finished is bounded by its open branches, or, not begun, by `remaining_cost`.
    """

    def __init__(self, blocks: int = 10) -> None:
        """Compile the search.

        Raises:
            ValueError: if `blocks` is not from 1 to 20.
        """
        self._blocks = check_blocks(blocks)
        none = np.zeros((1, 0, 3))
        row = np.zeros((1, 3))
        self.solve(Problem(1.0, np.zeros(3), row, row, row, none, np.zeros(0), 1.0, 1.0))

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`; a tie accepts."""
        return guarded(problem, budget, self._solve)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        block = block_of_stage(problem.stages, self._blocks)
        tail = remaining_cost(problem)
        plans = [constants.refuse, constants.accept]
        bounds, finished = [float(tail[0])] * 2, True
        for first, known in enumerate(constants.both[::-1]):
            if first and budget.spent():
                return cut_short(problem, plans[::-1], max(float(tail[0]), min(bounds)))
            modes, bound = _search(
                problem.kinematics, problem.terms, block_starts(block), tail, first, known.objective, budget.nodes
            )
            found = problem.evaluate(modes[block])
            plans[first] = found if found.objective <= known.objective else known
            bounds[first] = min(bound, plans[first].objective)
            finished = finished and bound == np.inf
        if not finished:
            return cut_short(problem, plans[::-1], max(float(tail[0]), min(bounds)))
        return cheapest(problem, plans[::-1], route_bound=min(bounds), gap=0.0)


@njit(cache=True)
def _search(
    motion: Kinematics,
    terms: Terms,
    starts: npt.NDArray[np.int64],
    tail: Array,
    first: int,
    known: float,
    nodes: int,
) -> tuple[Array, float]:
    """Modes (B,) of the cheapest plan whose first block has mode `first`; constant if none is below `known`.

    With them a lower bound of all plans that were not visited; inf if the search finished.

    Args:
        motion: (23).
        terms: (25).
        starts: first stage of each block and N, (B + 1,).
        tail: lower bound of the cost from stage k on, (N + 1,).
        first: 0 or 1.
        known: cost of the constant plan.
        nodes: most blocks to visit.
    """
    depth = len(starts) - 1
    best = np.full(depth, float(first))
    at = np.empty((depth + 1, 3))
    at[0] = motion.initial
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
            x += motion.dt * motion.velocities[mode[b], k, 0]
            y += motion.dt * motion.velocities[mode[b], k, 1]
            z += motion.dt * motion.velocities[mode[b], k, 2]
            total += stage_cost(terms, k, x, y, z)
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
