"""The cheapest of all plans that are constant on blocks, by evaluating each: what routes are held against."""

from __future__ import annotations

import numpy as np

from airground_drake.gatekeeper.binary_program import block_of_stage
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.problem import Evaluation, Problem
from airground_drake.gatekeeper.solution import Solution, cheapest


def every_plan(stages: int, blocks: int) -> np.ndarray:
    """Every binary plan (2^blocks, stages) that is constant on blocks of any length."""
    bits = np.arange(2**blocks)[:, None] >> np.arange(blocks) & 1
    return bits[:, block_of_stage(stages, blocks)].astype(float)


class Enumeration:
    """(26) by mode velocities and exact distances."""

    def __init__(self, blocks: int = 8) -> None:
        self._blocks = blocks

    def _evaluate(self, problem: Problem, plan: np.ndarray) -> Evaluation:
        return problem.evaluate(plan)

    def solve(self, problem: Problem, budget: Budget | None = None) -> Solution:
        """Whatever the budget."""
        plans = [self._evaluate(problem, plan) for plan in every_plan(problem.stages, self._blocks)[::-1]]
        best = min(plan.objective for plan in plans)
        return cheapest(problem, plans, route_bound=best, gap=0.0)


class ClosedLoopEnumeration(Enumeration):
    """The same with every plan rolled out on the closed loop, so that waiting shifts the way that follows."""

    def _evaluate(self, problem: Problem, plan: np.ndarray) -> Evaluation:
        return problem.evaluate_closed_loop(plan)
