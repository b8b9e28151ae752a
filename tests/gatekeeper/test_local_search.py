"""Label setting and exchanges against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from builders.problems import random_problem, rolled_out
from gatekeeper.formulas import blocked, cost
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.local_search import LocalSearch, best_known
from airground_drake.gatekeeper.reachable_box import remaining_cost
from airground_drake.gatekeeper.solution import ConstantPlans


def test_the_search_finds_what_brute_force_finds() -> None:
    plans = blocked(10, 10)
    for seed in range(40):
        problem = random_problem(seed, 10, seed % 4)
        costs = cost(problem, plans)
        refuse, accept = best_known(problem, 2048)
        assert refuse == pytest.approx(costs[plans[:, 0] == 0.0].min(), rel=1e-10)
        assert accept == pytest.approx(costs[plans[:, 0] == 1.0].min(), rel=1e-10)


@given(st.integers(0, 10**6), st.integers(2, 40), st.integers(0, 3), st.integers(1, 5000))
@examples(50)
def test_the_search_never_makes_a_plan_dearer(seed: int, width: int, reach: int, nodes: int) -> None:
    problem = random_problem(seed)
    constants = ConstantPlans.of(problem)
    search = LocalSearch(problem, constants, remaining_cost(problem), Budget(nodes=nodes))
    known = [constants.refuse.objective, constants.accept.objective]
    for step in (
        lambda: search.label_setting(width),
        lambda: search.exchanges(reach),
        lambda: search.label_setting(width, 0.1),
    ):
        step()
        for first, plan in enumerate(search.plans):
            assert plan.omega[0] == first
            assert plan.objective <= known[first]
            assert cost(problem, plan.omega[None])[0] == pytest.approx(plan.objective, rel=1e-9)
            known[first] = plan.objective
        assert search.best.objective == min(known)


def test_exchanges_leave_no_better_neighbour() -> None:
    for seed in range(10):
        problem = random_problem(seed)
        search = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), Budget())
        search.exchanges(2)
        for plan in search.plans:
            around = []
            for i in range(1, 24):
                for j in range(i, min(i + 3, 24)):
                    other = plan.omega.copy()
                    other[i] = 1.0 - other[i]
                    if j > i and plan.omega[i] != plan.omega[j]:
                        other[j] = 1.0 - other[j]
                    around.append(other)
            assert plan.objective <= cost(problem, np.array(around)).min() * (1.0 + 1e-9)


def test_nodes_that_do_not_last_are_admitted() -> None:
    problem = rolled_out(1)
    for nodes, lasts in ((1, False), (100, False), (20_000, True)):
        search = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), Budget(nodes=nodes))
        search.label_setting(64)
        assert search.complete == lasts
