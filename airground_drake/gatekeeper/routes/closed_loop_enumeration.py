"""All binary plans with a minimum dwell on the nonlinear closed loop, by the exact cost (25)-(26d)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.blocks import block_of_stage, block_starts, check_blocks
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.closed_loop import ClosedLoop, velocity_of, workspace
from airground_drake.gatekeeper.cost import Terms, stage_cost
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute
from airground_drake.gatekeeper.routes.guard import guarded
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, cheapest, relative_gap

_CHUNK = 64
"""Blocks rolled out between two looks at the clock; it takes them about 0.1 ms if they have six stages."""


class ClosedLoopEnumerationRoute:
    """Exact minimum of (25) over the plans that are constant on each of 10 blocks of the N stages.

    Not with the mode velocities of (23), which hold along the two constant plans only: every plan is rolled out on
    the closed loop that the UGV runs (`Problem.loop`), so that waiting shifts the way that follows. Two plans
    share the roll-out of their common prefix. The tree of 2^blocks plans is searched depth first; a branch is
    cut where its cost so far is not below the best plan known. (The speed limit bounds the rest of the cost as
    well, but that cuts one block in ten and takes as long.)

    Both halves of the tree (plans that start by accepting, by refusing) are searched separately, in turns, so that
    both `objective_accept` and `objective_refuse` are exact. `route_bound` equals `objective` and the gap is 0:
    among the plans with this dwell, not among all binary plans. Without any cut it rolls 2^(blocks + 1) - 2 blocks
    out. Each of them counts as a node of the budget. When that ends before, the best plans found so far decide
    (the constant ones are always among them), with the gap to the least bound of all branches left open; a
    deadline may be overrun by `_CHUNK` blocks.

    A problem without a closed loop is given by its mode velocities alone, and these are then what is searched: by
    `EnumerationRoute` with the same blocks.
    """

    def __init__(self, blocks: int = 10) -> None:
        """Compile the search.

        Raises:
            ValueError: if `blocks` is not from 1 to 20.
        """
        self._blocks = check_blocks(blocks)
        self._by_velocities = EnumerationRoute(blocks)
        self.solve(_smallest())

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`; a tie accepts."""
        if problem.loop is None:
            return self._by_velocities.solve(problem, budget)
        return guarded(problem, budget, self._solve, closed_loop=True)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        block = block_of_stage(problem.stages, self._blocks)
        halves = [_Half(problem, block, int(plan.omega[0]), plan.objective) for plan in constants.both[::-1]]
        nodes = budget.nodes
        while True:
            for half in halves:
                nodes -= half.search(min(_CHUNK, nodes))
            if nodes <= 0 or not any(half.open for half in halves) or budget.spent():
                break
        refuse, accept = (
            min(known, problem.evaluate_closed_loop(half.plan[block]), key=lambda plan: plan.objective)
            for known, half in zip(constants.both[::-1], halves, strict=True)
        )
        best = min(refuse.objective, accept.objective)
        bound = min(best, *(half.bound() for half in halves))
        return cheapest(
            problem,
            (accept, refuse),
            status="budget_spent" if any(half.open for half in halves) else "optimal",
            route_bound=bound,
            gap=relative_gap(best, bound),
        )


class _Tree(NamedTuple):
    """State of a depth-first search over B blocks, written to.

    Attributes:
        starts: first stage of each block, and N, (B + 1,).
        depth: of the block to visit next, (1,); -1 when there is none left.
        known: cost of the best plan known, (1,).
        best: its modes, (B,).
        at: position before each block of the current plan, (B, 3), m.
        cost: of the blocks before, (B,).
        mode: of each block of the current plan, (B,).
        tried: how many modes of each block have been visited, (B,).
    """

    starts: npt.NDArray[np.int64]
    depth: npt.NDArray[np.int64]
    known: Array
    best: npt.NDArray[np.int64]
    at: Array
    cost: Array
    mode: npt.NDArray[np.int64]
    tried: npt.NDArray[np.int64]


class _Half:
    """The plans whose first block has one of the modes; `known` is the cost of the constant one."""

    def __init__(self, problem: Problem, block: npt.NDArray[np.int64], first: int, known: float) -> None:
        starts = block_starts(block)
        blocks = len(starts) - 1
        self._loop: ClosedLoop = problem.loop  # type: ignore[assignment]  # the route sees to that
        self._terms = problem.terms
        mode, tried = np.full(blocks, first, dtype=np.int64), np.zeros(blocks, dtype=np.int64)
        at, cost = np.tile(self._loop.start, (blocks, 1)), np.zeros(blocks)
        self._tree = _Tree(starts, np.zeros(1, dtype=np.int64), np.array([known]), mode.copy(), at, cost, mode, tried)

    @property
    def open(self) -> bool:
        """Whether plans are left that neither were visited nor cut."""
        return bool(self._tree.depth[0] >= 0)

    @property
    def plan(self) -> Array:
        """Modes of the blocks of the best plan known, (B,)."""
        return self._tree.best.astype(np.float64)

    def search(self, nodes: int) -> int:
        """Visit that many blocks at most; how many it were."""
        return int(_search(self._loop, self._terms, self._tree, nodes))

    def bound(self) -> float:
        """Lower bound of the cost of all plans of this half that were neither visited nor cut; inf without any."""
        tree = self._tree
        reached = range(tree.depth[0] + 1)
        return min((float(tree.cost[b]) for b in reached if tree.tried[b] < _modes(b)), default=np.inf)


@njit(cache=True)
def _search(loop: ClosedLoop, terms: Terms, tree: _Tree, nodes: int) -> int:
    """Go on with the search for that many nodes (blocks rolled out) at most; how many it were."""
    blocks = len(tree.mode)
    position, work = np.empty(3), workspace(loop)
    visited = 0
    b = tree.depth[0]
    while b >= 0 and visited < nodes:
        # the mode of the block before comes first: constant continuations are good incumbents
        if b > 0:
            tree.mode[b] = tree.mode[b - 1] if tree.tried[b] == 0 else 1 - tree.mode[b - 1]
        tree.tried[b] += 1
        visited += 1
        position[:] = tree.at[b]
        total = tree.cost[b]
        for stage in range(tree.starts[b], tree.starts[b + 1]):
            for k in range(stage * loop.substeps, (stage + 1) * loop.substeps):
                velocity = velocity_of(loop, tree.mode[b], k, position, work)
                for a in range(3):
                    position[a] += loop.period * velocity[a]
            total += stage_cost(terms, stage, position[0], position[1], position[2])
            if total >= tree.known[0]:
                break
        if total < tree.known[0]:
            if b == blocks - 1:
                tree.known[0] = total
                tree.best[:] = tree.mode
            else:
                b += 1
                tree.at[b] = position
                tree.cost[b] = total
                tree.tried[b] = 0
        while b >= 0 and tree.tried[b] == _modes(b):
            b -= 1
    tree.depth[0] = b
    return visited


@njit(cache=True)
def _modes(block: int) -> int:
    """How many modes a block may have: the first one has that of its half."""
    return 1 if block == 0 else 2


def _smallest() -> Problem:
    """One stage without points, to compile the search with."""
    still, row = np.zeros((2, 3)), np.zeros((1, 3))
    loop = ClosedLoop(
        start=np.zeros(3), preset=still, wanted=still, chosen=np.eye(3), points=np.zeros((2, 0, 3)),
        distances=np.zeros(0), shares=np.zeros(0), max_speed=1.0, motion_gain=1.0, intervention_gain=1.0,
        avoidance_gain=1.0, period=1.0, sensing_range=1.0, composition=0, intervention_on_top=False, substeps=1,
    )  # fmt: skip
    return Problem(1.0, np.zeros(3), row, row, row, np.zeros((1, 0, 3)), np.zeros(0), 1.0, 1.0, loop=loop)
