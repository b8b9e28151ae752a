"""The gatekeeper's formulas written again."""

from __future__ import annotations

from typing import Any

import numpy as np

from airground_drake.gatekeeper.problem import Problem


def task_error(problem: Problem, p: np.ndarray) -> np.ndarray:
    """The task error of (25) through positions (..., N, 3), and the terminal cost."""
    squared = np.square(problem.reference - p).sum(axis=-1)
    total = problem.dt * squared.sum(axis=-1) + problem.terminal_weight * squared[..., -1]
    return np.asarray(problem.error_weight * total)


def cost(problem: Problem, omega: np.ndarray) -> np.ndarray:
    """(25) with (26d) from the formulas: plans (P, N) to costs (P,)."""
    velocity = omega[..., None] * problem.accept + (1.0 - omega[..., None]) * problem.refuse
    p = problem.initial + problem.dt * np.cumsum(velocity, axis=1)
    distance = np.linalg.norm(p[:, :, None] - problem.centres, axis=3)
    slack = np.maximum(0.0, problem.distances - distance).max(axis=2, initial=0.0)
    return task_error(problem, p) + problem.dt * problem.slack_weight * np.square(slack).sum(axis=1)


def half_plane_cost(problem: Problem, omega: np.ndarray, normals: np.ndarray) -> float:
    """(25) from the formulas, with distances along normals."""
    p = problem.initial + problem.dt * np.cumsum(
        omega[:, None] * problem.accept + (1.0 - omega[:, None]) * problem.refuse, axis=0
    )
    lacking = problem.distances - np.sum(normals * (p[:, None] - problem.centres), axis=2)
    slack = np.maximum(0.0, lacking).max(axis=1, initial=0.0)
    return float(task_error(problem, p) + problem.dt * problem.slack_weight * np.square(slack).sum())


def cost_through(problem: Problem, positions: np.ndarray) -> float:
    """(25) with (26d) from the formulas, through positions (N, 3)."""
    gaps = np.linalg.norm(positions[:, None] - problem.centres, axis=2) - problem.distances
    slack = np.maximum(0.0, -gaps.min(axis=1, initial=np.inf))
    return float(task_error(problem, positions) + problem.dt * problem.slack_weight * np.square(slack).sum())


def blocked(stages: int, blocks: int) -> np.ndarray:
    """All binary plans (2^blocks, stages) that are constant on blocks of equal length."""
    bits = np.arange(2**blocks)[:, None] >> np.arange(blocks) & 1
    return np.repeat(bits, stages // blocks, axis=1).astype(float)


def total(program: Any, values: np.ndarray) -> float:
    """Sum of all costs of a program."""
    return sum(float(program.EvalBinding(binding, values)[0]) for binding in program.GetAllCosts())
