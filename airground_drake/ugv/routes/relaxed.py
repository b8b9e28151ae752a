"""Relaxation (27) with half-planes for (27d), a convex quadratic program, then sum-up rounding (28)-(29).

The positions are eliminated, which is equivalent to multiple shooting; `nonlinear` is (27) by the letter.
"""

import numpy as np

from airground_drake.ugv.binary_program import Programs
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.drake_solvers import relax
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.relaxation import dual_bound, normals_along, sum_up_rounding, unavoidable_cost
from airground_drake.ugv.routes.guard import Guarded, without_optimum
from airground_drake.ugv.solution import ConstantPlans, Solution, cheapest

ACTIVE_SETS = 100  # active sets that DAQP may try for each iteration of the budget: they are as quick as that


class RelaxedRoute(Guarded):
    """Relax, solve, round; every solution carries its optimality gap.

    Half-planes along the better of the two constant plans stand for (26d). Half-planes along the best plan found, and
    a second solve, cost half as much again and brought the plans no nearer to the best known.

    The rounded plan, the same with the other first stage, and both constant plans are evaluated with the exact
    distances; the cheapest is returned. (A search for better plans, which came within 0.1 % of the best known, was
    tried and taken out: it changed no answer of any shipped case, and plans that switch are predicted to no better
    than 0.3 m.)

    Budget: iterations (active sets: `ACTIVE_SETS` times as many) and the time left go to the solver. Without an optimum
    the better constant plan decides.
    """

    def __init__(self) -> None:
        self._programs = Programs()

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        normals = normals_along(problem, constants.better.positions)
        program = self._programs.of(problem.stages, problem.stages)
        program.update(problem, normals)
        result = relax(program, budget.left_s(), ACTIVE_SETS * budget.iterations)
        if result.omega is None:
            return without_optimum(problem, constants, budget, normals, ended=result.ended)
        relaxed = result.omega.clip(0.0, 1.0)
        bound = dual_bound(problem, normals, relaxed)
        if result.multipliers is not None and program.within.any():  # better where half-planes share the slack
            multipliers = np.zeros(program.within.shape)
            multipliers[program.within] = result.multipliers.clip(0.0)
            bound = max(bound, dual_bound(problem, normals, relaxed, multipliers))
        rounded = sum_up_rounding(relaxed)
        other = np.append(1.0 - rounded[0], rounded[1:])
        return cheapest(
            problem,
            (constants.accept, constants.refuse, problem.evaluate(rounded), problem.evaluate(other)),
            route_bound=max(bound, unavoidable_cost(problem)),
            normals=normals,
            relaxed=relaxed,
            rounded=rounded,
        )
