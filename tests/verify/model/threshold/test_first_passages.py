"""Simulated paths between two thresholds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import kstest
from verify.model.threshold.cases import INPUTS

from airground_drake.verify.model.threshold import first_passages, thr_ddm
from airground_drake.verify.model.threshold.first_passages import PassageExperiment


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
@pytest.mark.parametrize("drift", [0.01, 0.1815, 0.5, 1.0, 2.0, 4.0, 10.0])
def test_what_the_barrier_correction_leaves_is_within_the_allowances(drift: float, deviation: float) -> None:
    each = PassageExperiment("", drift, 1.0, 1.0, deviation, 1, 0)
    periods, wrong = sampled(each)
    time, rate = first_passages.running(each)
    assert abs(periods - 0.25 - time / each.period) < thr_ddm.TIME_ALLOWANCE
    assert abs(wrong - rate) < thr_ddm.ERROR_ALLOWANCE


def test_the_experiments_are_within_the_range_of_that_test() -> None:
    for inputs in INPUTS.values():
        for each in first_passages.experiments(inputs):
            assert 0.0 < each.zeta * each.drift / each.noise**2 <= 10.0
            assert abs(each.deviation) <= 0.4 * each.zeta * (1.0 + 1e-12)


@pytest.mark.parametrize("zeta", [1.0, 1e-3])  # noise periods of 4 ms and 4 ns
def test_increments_are_those_of_the_process(zeta: float) -> None:
    each = PassageExperiment("", 2.0, 3.0, zeta, 0.0, 1, 5)
    steps = np.array(first_passages.increments(each, 1000))
    assert steps.shape == (1000 * first_passages.CHANNELS,)
    deviation = each.noise * math.sqrt(each.period)
    assert abs(steps.mean() - each.drift * each.period) < 4.0 * deviation / math.sqrt(len(steps))
    assert steps.std() == pytest.approx(deviation, rel=4.0 / math.sqrt(2.0 * len(steps)))
    assert kstest((steps - steps.mean()) / deviation, "norm").statistic < 2.0 / math.sqrt(len(steps))
    assert abs(np.corrcoef(steps[:-1], steps[1:])[0, 1]) < 4.0 / math.sqrt(len(steps))
    assert first_passages.increments(each, 20) == first_passages.increments(each, 20)
    assert first_passages.increments(each, 20) != first_passages.increments(replace(each, seed=6), 20)


def test_passages() -> None:
    assert first_passages.passage(iter([0.5, -0.2, 0.9]), 0.0, 1.0) == (3, pytest.approx(1.2))
    assert first_passages.passage(iter([-2.0, 5.0]), 0.5, 1.0) == (1, -1.5)
    with pytest.raises(ArithmeticError, match="within a path"):
        first_passages.passage(iter([0.1]), 0.0, 1.0)
