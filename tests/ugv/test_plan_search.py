"""Beam search and local search by the cost (25), against evaluating every plan or every change."""

from itertools import combinations_with_replacement

import numpy as np
import pytest
from builders.problems import random_problem, rolled_out
from ugv.oracles import every_plan

from airground_drake.ugv.binary_program import block_of_stage
from airground_drake.ugv.plan_search import beam_search, improve
from airground_drake.ugv.problem import Problem

PROBLEMS = [*(random_problem(seed, 12, 1 + seed % 3) for seed in range(8)), *(rolled_out(seed) for seed in range(3))]


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("blocks", [5, 12])
def test_a_beam_that_holds_every_plan_finds_the_cheapest(problem: Problem, blocks: int) -> None:
    block = block_of_stage(problem.stages, min(blocks, 7))
    found = beam_search(problem.terms, block, width=2**7)
    costs = [problem.evaluate(plan).objective for plan in every_plan(problem.stages, min(blocks, 7))]
    assert problem.evaluate(found).objective == pytest.approx(min(costs), rel=1e-12)


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("pairs", [False, True])
def test_no_change_makes_an_improved_plan_cheaper(problem: Problem, *, pairs: bool) -> None:
    block = block_of_stage(problem.stages, 12)
    start = np.random.default_rng(0).integers(0, 2, 12).astype(float)[block]
    plan, cost = improve(problem.terms, block, start, pairs)
    assert cost == pytest.approx(problem.evaluate(plan).objective, rel=1e-12)
    assert problem.evaluate(plan).objective <= problem.evaluate(start).objective
    for i, j in combinations_with_replacement(range(12), 2):
        if pairs or i == j:
            changed = np.where((block == i) | (block == j), 1.0 - plan, plan)
            assert problem.evaluate(changed).objective >= cost * (1.0 - 1e-12)
