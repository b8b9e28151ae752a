"""Broken variants of the threshold are refuted."""

from __future__ import annotations

import json

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from verify.judging import Judged

from airground_drake.decision.bayes import decision_time, error_rate
from airground_drake.verify.model.threshold import mutants
from airground_drake.verify.model.threshold.first_passages import PassageExperiment

MUTANTS = {f"{mutant.claim}: {mutant.says}": mutant for mutant in mutants.MUTANTS}


@pytest.mark.parametrize("name", [n for n in MUTANTS if not n.startswith("THR-DDM")])
def test_mutants_of_the_threshold_are_refuted(judged: Judged, name: str) -> None:
    finding = judged(MUTANTS[name])
    assert finding.status == "refuted"
    assert finding.counterexample
    assert finding.margin is None or finding.margin < 0.0
    json.dumps(finding.counterexample, allow_nan=False)


@pytest.mark.parametrize("name", [n for n in MUTANTS if n.startswith("THR-DDM")])
def test_mutants_of_the_formulas_are_refuted(judged: Judged, name: str) -> None:
    finding = judged(MUTANTS[name])
    assert finding.status == "refuted"
    assert finding.counterexample
    assert abs(finding.counterexample["z_score"]) > 5.0


def test_the_printed_threshold_is_not_refuted_where_it_is_the_same() -> None:
    inputs = {"drift_m_s": 1.0, "noise_m_sqrt_s": 1.0, "c1_1_s": 1.0, "c2": 1.0}
    assert MUTANTS["THR-DDM: the threshold with c1/c2 minimises the risk"].check(inputs).status == "inconclusive"


@given(st.floats(0.2, 5.0), st.floats(0.5, 5.0), st.floats(0.2, 3.0), st.floats(-0.9, 0.9))
def test_the_printed_formulas_are_ours_with_the_deviation_in_seconds(
    drift: float, noise: float, zeta: float, share: float
) -> None:
    assume(0.01 < zeta * drift / noise**2 < 20.0)
    each = PassageExperiment("", drift, noise, zeta, share * zeta, 1, 0)
    time, rate = mutants.printed(each, each.deviation / drift)
    assert time == pytest.approx(decision_time(zeta, drift, noise, share * zeta), rel=1e-6, abs=1e-9)
    assert rate == pytest.approx(error_rate(zeta, drift, noise, share * zeta), rel=1e-6, abs=1e-9)
