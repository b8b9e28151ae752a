"""The lower bound of a relaxed plan, also where several points lack the same."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airground_drake.check import optimality
from airground_drake.check.decisions import Decision
from airground_drake.check.optimality import NARROW, Enclosure, enclose, gate_opt, least_squares


def decision(relaxed: np.ndarray, centres_m: list[list[float]], terminal_weight_s: float) -> Decision:
    """Accepting leads along x at 1 m/s, towards the reference and between the points; refusing stays."""
    n = len(relaxed)
    offset = np.array([0.0, 0.0, 0.0]) - centres_m
    normals = np.tile(offset / np.linalg.norm(offset, axis=1)[:, None], (n, 1, 1))
    return Decision(
        row={"t_s": 0.0, "robot": "ugv1", "status": "optimal"},
        dt_s=0.1,
        error_weight_1_m2_s=1.0,
        slack_weight_1_m2_s=50.0,
        terminal_weight_s=terminal_weight_s,
        initial_m=np.zeros(3),
        accept_m_s=np.tile([1.0, 0.0, 0.0], (n, 1)),
        refuse_m_s=np.zeros((n, 3)),
        reference_m=np.tile([3.0, 0.0, 0.0], (n, 1)),
        centres_m=np.tile(np.array(centres_m), (n, 1, 1)),
        distances_m=np.full(len(centres_m), 1.0),
        plan=np.ones(n),
        positions_m=np.zeros((n, 3)),
        relaxed=relaxed,
        rounded=relaxed,
        normals=normals,
    )


def least_cost(problem: Decision, steps: int = 20000) -> float:
    """By projected gradient with the gradient by differences of the exact cost: slow and independent."""
    omega, best = problem.relaxed.copy(), np.inf
    for k in range(steps // 100):
        values = problem.cost(
            problem.positions_of(np.clip(omega + 1e-6 * np.eye(len(omega)), 0.0, 1.0)), problem.half_planes
        )
        here = float(problem.cost(problem.positions_of(omega), problem.half_planes))
        best = min(best, here)
        omega = np.clip(omega - 0.05 / np.sqrt(k + 1.0) * (values - here) / 1e-6, 0.0, 1.0)
    return best


@pytest.mark.parametrize("terminal_weight_s", [0.0, 0.4])
@pytest.mark.parametrize("centres", [[[1.5, 0.3, 0.0]], [[1.5, 0.3, 0.0], [1.5, -0.3, 0.0]]])
def test_the_bound_is_below_what_can_be_had_and_close_to_it(
    centres: list[list[float]], terminal_weight_s: float
) -> None:
    rng = np.random.default_rng(1)
    start = decision(np.full(12, 0.5), centres, terminal_weight_s)
    least = least_cost(start)
    found = [enclose(decision(rng.uniform(0.0, 1.0, 12), centres, terminal_weight_s)) for _ in range(20)]
    assert all(each.lower <= least + 1e-9 for each in found)
    assert max(each.lower for each in found) <= min(each.upper for each in found) + 1e-12
    if len(centres) == 1:  # no ties: wherever the relaxation ended
        assert max(each.upper - each.lower for each in found) <= NARROW * start.scale
        assert all(each.upper <= least + 1e-9 for each in found)


@pytest.mark.parametrize("off", [1e-9, 1e-6, 1e-3])
def test_a_relaxation_that_is_a_little_off_is_enclosed_as_narrowly(off: float) -> None:
    """Costs of 1e-8 m^2 s: what a solver stops at is no minimiser to so many digits."""
    tiny = replace(decision(np.full(12, off), [[1.5, 0.3, 0.0]], 0.0), reference_m=np.full((12, 3), 1e-5))
    found = enclose(tiny)
    assert 0.0 < found.lower <= found.upper <= found.lower + NARROW * tiny.scale


def test_a_half_plane_of_a_point_that_no_plan_can_come_near_asks_for_nothing() -> None:
    """Turned round, it would ask for metres."""
    near = [1.5, 0.3, 0.0]
    problem = decision(np.full(12, 0.5), [near, [50.0, 0.0, 0.0]], 0.0)
    turned = replace(problem, normals=problem.normals * np.array([1.0, -1.0])[:, None])
    alone = enclose(decision(np.full(12, 0.5), [near], 0.0))
    for each in (problem, turned):
        found = enclose(each)
        assert (found.lower, found.upper) == pytest.approx((alone.lower, alone.upper), rel=1e-12)


def test_least_squares_are_not_negative() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        matrix, right = rng.normal(size=(8, 12)), rng.normal(size=8)
        x = least_squares(matrix, right)
        assert (x >= 0.0).all()
        gradient = matrix.T @ (matrix @ x - right)
        assert (gradient >= -1e-6).all()
        assert abs(gradient @ x) <= 1e-6


@pytest.mark.parametrize(("gap", "status"), [(0.04, "holds"), (0.06, "inconclusive")])
def test_a_plan_is_at_most_a_twentieth_dearer_than_the_optimum(
    gap: float, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = decision(np.full(12, 0.5), [[1.5, 0.3, 0.0]], 0.0)
    optimum = float(problem.cost(problem.positions_m)) - gap * problem.scale
    monkeypatch.setattr(optimality, "silent_ugvs", lambda run: [])
    monkeypatch.setattr(optimality, "decisions_of", lambda run: [problem])
    monkeypatch.setattr(optimality, "enclose", lambda _: Enclosure(optimum, optimum))
    others = (
        "_no_dearer_than_constant_plans",
        "_bound_and_gap_are_not_overstated",
        "_no_plan_of_blocks_is_much_cheaper",
    )
    for rule in others:
        monkeypatch.setattr(optimality, rule, lambda *_: None)
    found = gate_opt(SimpleNamespace(scenario={"gatekeeper": {"route": "relaxed"}}), {})
    assert found.status == status
