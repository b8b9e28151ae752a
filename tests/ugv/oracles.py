"""The gatekeeper's formulas written again, and the cheapest of all plans by evaluating each."""

import numpy as np

from airground_drake.ugv.binary_program import block_of_stage
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.solution import Solution, cheapest


def cost(problem: Problem, plans: np.ndarray, normals: np.ndarray | None = None) -> np.ndarray:
    """(25) with (26d) of plans (..., N), with the exact distances or those along normals (N, m, 3): (...)."""
    velocity = plans[..., None] * problem.accept + (1.0 - plans[..., None]) * problem.refuse
    p = problem.initial + problem.dt * np.cumsum(velocity, axis=-2)
    offset = p[..., None, :] - problem.centres
    distance = np.linalg.norm(offset, axis=-1) if normals is None else (normals * offset).sum(axis=-1)
    slack = np.maximum(0.0, problem.distances - distance).max(axis=-1, initial=0.0)
    error = np.square(problem.reference - p).sum(axis=-1)
    total = problem.dt * error.sum(axis=-1) + problem.terminal_weight * error[..., -1]
    return np.asarray(problem.error_weight * total + problem.dt * problem.slack_weight * np.square(slack).sum(axis=-1))


def every_plan(stages: int, blocks: int) -> np.ndarray:
    """Every binary plan (2^blocks, stages) that is constant on blocks of any length."""
    bits = np.arange(2**blocks)[:, None] >> np.arange(blocks) & 1
    return bits[:, block_of_stage(stages, blocks)].astype(float)


class Enumeration:
    """A route: the cheapest of all plans of some blocks, whatever the budget."""

    def __init__(self, blocks: int = 8) -> None:
        self._blocks = blocks

    def solve(self, problem: Problem, budget: Budget | None = None) -> Solution:
        plans = [problem.evaluate(plan) for plan in every_plan(problem.stages, self._blocks)[::-1]]
        return cheapest(problem, plans, route_bound=min(plan.objective for plan in plans))
