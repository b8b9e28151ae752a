"""Enumeration has a brute-force oracle."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from builders.problems import random_problem, rolled_out
from gatekeeper.contract import used
from gatekeeper.formulas import blocked, cost

from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute


def test_more_budget_is_never_dearer_for_enumeration() -> None:
    for seed in range(5):
        costs = [used("enumeration").solve(rolled_out(seed), Budget(nodes=n)) for n in (1, 10, 100, 1000)]
        assert all(a.objective >= b.objective for a, b in pairwise(costs))
        assert all(a.route_bound <= costs[-1].objective for a in costs)


@pytest.mark.parametrize("make", [lambda s: random_problem(s, 24, s % 5), lambda s: random_problem(s, 8, 2)])
def test_enumeration_agrees_with_brute_force(make: Any) -> None:
    route = EnumerationRoute(8)
    for seed in range(30):
        problem = make(seed)
        plans = blocked(problem.stages, 8)
        costs, first = cost(problem, plans), plans[:, 0]
        solution = route.solve(problem)
        assert solution.objective_accept == pytest.approx(costs[first == 1.0].min(), rel=1e-10)
        assert solution.objective_refuse == pytest.approx(costs[first == 0.0].min(), rel=1e-10)
        assert solution.route_bound == solution.objective
        assert solution.gap == 0.0
        short = route.solve(problem, Budget(nodes=1 + seed))
        assert short.route_bound <= costs.min() * (1.0 + 1e-12)
        assert short.objective >= costs.min() * (1.0 - 1e-12)
