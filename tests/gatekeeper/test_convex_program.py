"""The program of a team is the problem."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.problems import random_problem, rolled_out
from pydrake.solvers import ClarabelSolver

from airground_drake.gatekeeper.convex_program import team_program
from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.solution import ConstantPlans
from gatekeeper.formulas import half_plane_cost, total

TEAM = (
    rolled_out(0),
    replace(random_problem(5, 12, 3), distances=np.full(3, 2.0)),
    random_problem(6, 24, 0),
)


def team_normals() -> list[np.ndarray]:
    return [normals_along(p, ConstantPlans.of(p).better.positions) for p in TEAM]


def test_the_optimum_of_a_team_is_the_sum_of_the_optima() -> None:
    together = ClarabelSolver().Solve(team_program(TEAM, team_normals()).program)
    assert together.is_success()
    alone = [
        ClarabelSolver().Solve(team_program([p], [n]).program).get_optimal_cost()
        for p, n in zip(TEAM, team_normals(), strict=True)
    ]
    assert together.get_optimal_cost() == pytest.approx(sum(alone), rel=1e-6)


def check_program(team: Any, problems: tuple[Problem, ...], normals: list[np.ndarray]) -> None:
    """With the true states of a plan and its slack, all constraints hold and the cost is (25); with less, not."""
    program, rng = team.program, np.random.default_rng(0)
    values, claimed = np.zeros(program.num_vars()), 0.0

    def put(prefix: str, name: str, numbers: np.ndarray) -> None:
        for i, number in enumerate(np.ravel(numbers)):
            values[index[f"{prefix}_{name}({i})"]] = number

    index = {variable.get_name(): i for i, variable in enumerate(program.decision_variables())}
    for i, (problem, n) in enumerate(zip(problems, normals, strict=True)):
        omega = rng.integers(0, 2, problem.stages).astype(float)
        p = problem.positions(omega)
        lacking = problem.distances - np.sum(n * (p[:, None] - problem.centres), axis=2)
        put("start", f"UGV {i + 1}", problem.initial[:2])
        put("e", f"UGV {i + 1}", (p - problem.reference)[:, :2])
        put("omega", f"UGV {i + 1}", omega)
        put("u", f"UGV {i + 1}", np.maximum(0.0, lacking).max(axis=1, initial=0.0))
        claimed += half_plane_cost(problem, omega, n)
    bindings = program.GetAllConstraints()
    assert program.CheckSatisfied(bindings, values, 1e-9)
    assert total(program, values) == pytest.approx(claimed, rel=1e-12)
    for name, binding in ((b.evaluator().get_description(), b) for b in bindings):
        spoilt = values.copy()
        spoilt[[index[v.get_name()] for v in binding.variables()]] -= 2.0 if "half" in name or "slack" in name else 1.5
        if "half" not in name:
            assert not program.CheckSatisfied(binding, spoilt, 1e-9), f"{name} constrains nothing"


def test_the_program_is_the_problem() -> None:
    check_program(team_program(TEAM, team_normals()), TEAM, team_normals())


def test_every_constraint_says_which_equation_and_whose() -> None:
    program = team_program(TEAM, team_normals()).program
    names = [b.evaluator().get_description() for b in [*program.GetAllConstraints(), *program.GetAllCosts()]]
    assert all(re.fullmatch(r"\(2\d[a-e]?\).*, UGV [123]", name) for name in names), names
    assert len(set(names)) == len(names) == 3 * 7


def test_a_program_of_other_data_is_refuted() -> None:
    normals = team_normals()
    for wrong in (
        (replace(TEAM[0], reference=TEAM[0].reference + 0.01), *TEAM[1:]),
        (replace(TEAM[0], initial=TEAM[0].initial + 0.01), *TEAM[1:]),
        (TEAM[0], replace(TEAM[1], accept=TEAM[1].refuse), TEAM[2]),
        (TEAM[0], replace(TEAM[1], distances=TEAM[1].distances + 0.5), TEAM[2]),
        (TEAM[0], replace(TEAM[1], slack_weight=1.0), TEAM[2]),
        (TEAM[0], replace(TEAM[1], terminal_weight=0.0), TEAM[2]),
    ):
        with pytest.raises(AssertionError):
            check_program(team_program(wrong, normals), TEAM, normals)
    with pytest.raises(AssertionError):
        check_program(team_program(TEAM, [-n for n in normals]), TEAM, normals)
