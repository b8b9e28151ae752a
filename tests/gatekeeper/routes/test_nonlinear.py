"""The nonlinear program is (27)."""

from __future__ import annotations

import numpy as np
import pytest
from builders.problems import INSTANCES
from gatekeeper.formulas import cost, total
from pydrake.solvers import SnoptSolver

from airground_drake.gatekeeper.routes import nonlinear
from airground_drake.gatekeeper.solution import ConstantPlans


@pytest.mark.parametrize("instance", ["random 24x2", "a point at the robot", "case A, stalled",
                                      "deep inside a large disc", "rolled out, a terminal cost"])  # fmt: skip
def test_the_nonlinear_program_is_27(instance: str) -> None:
    """The guess is feasible and, like the optimum, costs what (25) says with the exact slack."""
    problem = INSTANCES[instance]
    for start in (ConstantPlans.of(problem).accept, ConstantPlans.of(problem).refuse):
        program, variables, guess = nonlinear.relaxation(problem, start)
        bindings = program.GetAllConstraints()
        assert program.CheckSatisfied(bindings, guess, 1e-7)
        assert total(program, guess) == pytest.approx(start.objective, rel=1e-9)
        result = SnoptSolver().Solve(program, guess, None)
        assert result.is_success()
        omega = np.clip(result.GetSolution(variables), 0.0, 1.0)
        assert result.get_optimal_cost() == pytest.approx(cost(problem, omega[None])[0], rel=1e-3)
        assert result.get_optimal_cost() <= start.objective * (1.0 + 1e-6)
