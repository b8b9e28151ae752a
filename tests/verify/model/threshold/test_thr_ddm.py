"""THR-DDM."""

import math
from dataclasses import replace
from statistics import NormalDist

import pytest
from verify.judging import Judged
from verify.model.threshold.cases import TABLE_1

from airground_drake.verify.claims import thr_ddm
from airground_drake.verify.claims.thr_ddm import ThrDdm


def test_formulas_are_supported_and_intervals_can_be_redone_by_hand(judged: Judged) -> None:
    """Binomial tails and the normal quantile with `math` only, from the recorded counts."""
    simulated = judged(ThrDdm())
    assert (simulated.status, len(simulated.evidence["comparisons"])) == ("supported", 12)
    assert simulated.evidence["paths"] >= 20000
    tail = (1.0 - simulated.evidence["family_level"]) / 12 / 2
    quantile = NormalDist().inv_cdf(1.0 - tail)

    def below(k: int, n: int, p: float) -> float:
        logs = math.log(p), math.log1p(-p)
        return math.fsum(
            math.exp(math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * logs[0] + (n - i) * logs[1])
            for i in range(k + 1)
        )

    for row in simulated.evidence["comparisons"]:
        n, wrong, period = row["constants"]["paths"], row["wrong_decisions"], row["constants"]["noise_period_s"]
        low, high = row["interval"]
        if row["quantity"] == "error rate":
            assert below(wrong, n, high - thr_ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
            assert 1.0 - below(wrong - 1, n, low + thr_ddm.ERROR_ALLOWANCE) == pytest.approx(tail, rel=1e-6)
        else:
            mean = row["periods_sum"] / n
            spread = math.sqrt((row["periods_sum_of_squares"] / n - mean**2) / (n - 1))
            half = quantile * spread + thr_ddm.TIME_ALLOWANCE
            assert ((high - low) / 2, (high + low) / 2) == pytest.approx((half * period, (mean - 0.25) * period))
        assert low < row["formula"] < high


def test_wrong_formulas_are_refuted() -> None:
    """Without the initial deviation."""
    chosen = thr_ddm.experiments(TABLE_1)
    finding = thr_ddm.compare(chosen, lambda each: thr_ddm.running(replace(each, deviation=0.0)))
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["constants"]["deviation"] != 0.0


def test_pyddm_agrees_with_the_formulas() -> None:
    """An independent package, in units of zeta and zeta^2/noise^2."""
    pyddm = pytest.importorskip("pyddm")
    for each in thr_ddm.experiments(TABLE_1):
        unit = (each.zeta / each.noise) ** 2
        model = pyddm.gddm(
            drift=each.drift * unit / each.zeta,
            noise=1.0,
            bound=1.0,
            starting_position=each.deviation / each.zeta,
            T_dur=20.0,
            mixture_coef=0.0,
        )
        solution = model.solve()
        density = solution.pdf("correct") + solution.pdf("error")
        found = float(density @ solution.t_domain) * float(model.dt) * unit, float(solution.prob("error"))
        assert found == pytest.approx(thr_ddm.running(each), rel=1e-4)
