"""ZENO-REFINE."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import pytest
from verify.judging import Judged
from verify.model.trigger.cases import REFINE

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.model.trigger import mutants, refined_paths, zeno_refine
from airground_drake.verify.model.trigger.refined_paths import experiment
from airground_drake.verify.model.trigger.zeno_refine import ZenoRefine


def test_the_shipped_trigger_is_supported(judged: Judged, case_a: Scenario) -> None:
    assert ZenoRefine().inputs(case_a) == REFINE
    finding = judged(ZenoRefine())
    assert finding.status == "supported", finding.counterexample
    evidence = finding.evidence
    assert evidence == zeno_refine.series(experiment(REFINE), refined_paths.counts(experiment(REFINE)))
    dt = evidence["dt_s"]
    assert dt[0] / dt[-1] >= 256
    for name in refined_paths.SERIES:
        assert {len(values) for values in evidence[name].values()} == {len(dt)}
    low, high = evidence["fit"]["bare"]["interval"]
    assert low < -0.49 < high < -0.4
    assert max(evidence["automaton"]["largest"]) <= evidence["most_triggers"] == 61
    assert evidence["bare"]["mean"][-1] > 10.0 * evidence["bare"]["mean"][0]
    rows = finding.certificates["counts.csv"].splitlines()
    assert len(rows) == 1 + refined_paths.PATHS * len(dt)
    last = [float(row.split(",")[2]) for row in rows[1:] if float(row.split(",")[1]) == dt[-1]]
    assert math.fsum(last) / len(last) == pytest.approx(evidence["bare"]["mean"][-1])


def test_more_triggers_than_the_dwell_admits_are_noticed() -> None:
    kind = mutants.NoDwell(3.0, 3.0, 0.5)
    setting = dataclasses.replace(experiment(REFINE), trigger=kind)
    finding = zeno_refine.judge_experiment(setting)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    i, dt = finding.counterexample["path"], finding.counterexample["dt_s"]
    unit = refined_paths.path(setting, i)[setting.dt_s.index(dt)]
    times = refined_paths.triggers(kind, 3.0 + setting.noise_m_sqrt_s * unit, dt)
    assert len(times) == finding.counterexample["triggers"] > 61
    assert min(b - a for a, b in pairwise(times)) < 0.5
