"""Simulated paths between two thresholds."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr
from verify.model.threshold.cases import INPUTS

from airground_drake.verify.claims import thr_ddm
from airground_drake.verify.claims.thr_ddm import PassageExperiment


def sampled(each: PassageExperiment, nodes: int = 160) -> tuple[float, float]:
    """Mean number of periods and error rate of the sampled walk between the barriers, by Gauss-Legendre quadrature."""
    x, weight = (each.barrier * values for values in np.polynomial.legendre.leggauss(nodes))
    step, mean = each.noise * math.sqrt(each.period), each.drift * each.period

    def kernel(start: Any) -> Any:
        return np.exp(-(((x - start - mean) / step) ** 2) / 2.0) / (step * math.sqrt(2.0 * math.pi)) * weight

    matrix = np.eye(nodes) - np.array([kernel(start) for start in x])
    beyond = ndtr((-each.barrier - x - mean) / step)
    periods, wrong = np.linalg.solve(matrix, np.ones(nodes)), np.linalg.solve(matrix, beyond)
    first = kernel(each.deviation)
    at_once = float(ndtr((-each.barrier - each.deviation - mean) / step))
    return 1.0 + float(first @ periods), at_once + float(first @ wrong)


@pytest.mark.parametrize("deviation", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("drift", [0.01, 0.1815, 1.0, 10.0])
def test_what_the_barrier_correction_leaves_is_within_the_allowances(drift: float, deviation: float) -> None:
    each = PassageExperiment("", drift, 1.0, 1.0, deviation, 1, 0)
    periods, wrong = sampled(each)
    time, rate = thr_ddm.running(each)
    assert abs(periods - 0.25 - time / each.period) < thr_ddm.TIME_ALLOWANCE
    assert abs(wrong - rate) < thr_ddm.ERROR_ALLOWANCE
    for inputs in INPUTS.values():  # whose experiments are in the range of this test
        for one in thr_ddm.experiments(inputs):
            assert 0.0 < one.zeta * one.drift / one.noise**2 <= 10.0
            assert abs(one.deviation) <= 0.4 * one.zeta * (1.0 + 1e-12)


def test_paths_are_followed_to_their_ends() -> None:
    each = PassageExperiment("", 1.0, 1.0, 1.0, 0.0, 500, 3)
    found, again = thr_ddm.simulate(each), thr_ddm.simulate(replace(each, seed=4))
    assert found == thr_ddm.simulate.__wrapped__(each)
    assert (found.wrong, found.periods) != (again.wrong, again.periods)
    assert thr_ddm.simulate(replace(each, drift=1e-3, noise=1e-6)).wrong == 0  # the drift alone decides
