"""THR-DDM."""

from __future__ import annotations

import math
import sys
from statistics import NormalDist

import pytest

from airground_drake.verify.finding import Finding
from airground_drake.verify.model import thr_ddm
from airground_drake.verify.model.first_passages import PassageExperiment


def test_formulas_are_supported(simulated: Finding) -> None:
    assert simulated.status == "supported"
    assert simulated.evidence["paths"] >= 20000
    assert len(simulated.evidence["comparisons"]) == 12
    assert simulated.margin is not None
    assert 0.0 < simulated.margin <= 1.0


def test_intervals_can_be_redone_by_hand(simulated: Finding) -> None:
    """Binomial tails and the normal quantile with `math` only, from the recorded counts."""
    tail = (1.0 - simulated.evidence["family_level"]) / 12 / 2
    quantile = NormalDist().inv_cdf(1.0 - tail)

    def below(k: int, n: int, p: float) -> float:
        logs = math.log(p), math.log1p(-p)
        return math.fsum(
            math.exp(math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * logs[0] + (n - i) * logs[1])
            for i in range(k + 1)
        )

    for row in simulated.evidence["comparisons"]:
        n, wrong, constants = row["constants"]["paths"], row["wrong_decisions"], row["constants"]
        low, high = row["interval"]
        if row["quantity"] == "error rate":
            assert below(wrong, n, high - thr_ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
            assert 1.0 - below(wrong - 1, n, low + thr_ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
        else:
            mean = row["periods_sum"] / n
            spread = math.sqrt((row["periods_sum_of_squares"] / n - mean**2) / (n - 1))
            half = (quantile * spread + thr_ddm.TIME_ALLOWANCE) * constants["noise_period_s"]
            assert (high - low) / 2 == pytest.approx(half, rel=1e-9)
            assert (high + low) / 2 == pytest.approx((mean - 0.25) * constants["noise_period_s"], rel=1e-9)
        assert low < row["formula"] < high


def test_pyddm_agrees(simulated: Finding) -> None:
    pytest.importorskip("pyddm")
    for row in simulated.evidence["comparisons"]:
        key = "error_rate" if row["quantity"] == "error rate" else "decision_time_s"
        assert simulated.evidence["pyddm"][row["experiment"]][key] == pytest.approx(row["formula"], rel=1e-4)


def test_without_pyddm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyddm", None)
    assert thr_ddm._pyddm(PassageExperiment("", 1.0, 1.0, 1.0, 0.0, 1, 0)) == "not installed"
