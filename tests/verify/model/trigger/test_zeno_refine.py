"""ZENO-REFINE."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from verify.judging import Judged
from verify.model.trigger.cases import REFINE

from airground_drake.base.arrays import Array
from airground_drake.model.trigger.automaton import Trigger, TriggerState
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claims import zeno_refine
from airground_drake.verify.claims.zeno_refine import ZenoRefine, experiment


def test_the_shipped_trigger_is_supported(judged: Judged, case_a: Scenario) -> None:
    assert ZenoRefine().inputs(case_a) == REFINE
    finding = judged(ZenoRefine())
    assert finding.status == "supported", finding.counterexample
    evidence = finding.evidence
    assert evidence == zeno_refine.series(experiment(REFINE), zeno_refine.counts(experiment(REFINE)))
    assert evidence["dt_s"][0] / evidence["dt_s"][-1] >= 256
    low, high = evidence["fit"]["bare"]["interval"]
    assert low < -0.49 < high < -0.4
    assert max(evidence["automaton"]["largest"]) <= evidence["most_triggers"] == 61
    assert evidence["bare"]["mean"][-1] > 10.0 * evidence["bare"]["mean"][0]
    last = [float(row.split()[-1]) for row in evidence["counts"]["bare"]]
    assert sum(last) / zeno_refine.PATHS == pytest.approx(evidence["bare"]["mean"][-1])


class NoDwell(Trigger):
    @property
    def levels(self) -> Array:
        return np.array([self.zeta, self.release, 0.0])

    def dwell_end(self, state: TriggerState) -> float:
        return state.triggered_at


def test_more_triggers_than_the_dwell_admits_are_noticed() -> None:
    kind = NoDwell(3.0, 3.0, 0.5)
    setting = dataclasses.replace(experiment(REFINE), trigger=kind)
    finding = zeno_refine.judge_experiment(setting)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    i, dt = finding.counterexample["path"], finding.counterexample["dt_s"]
    unit = zeno_refine.path(setting, i)[setting.dt_s.index(dt)]
    times = zeno_refine.triggers(kind, 3.0 + setting.noise_m_sqrt_s * unit, dt)
    assert len(times) == finding.counterexample["triggers"] > 61
    assert min(b - a for a, b in pairwise(times)) < 0.5


def test_a_bare_threshold_without_noise_does_not_diverge(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a sine about the threshold the bare count is the same at every step: the experiment can fail."""

    def sine(setting: zeno_refine.Refinement, index: int) -> list[Array]:
        phase = 2.0 * np.pi * (index + math.sqrt(0.5)) / zeno_refine.PATHS
        steps = [round(setting.duration_s / dt) for dt in setting.dt_s]
        return [np.sin(np.linspace(0.0, 20.0 * np.pi, count + 1) + phase) for count in steps]

    monkeypatch.setattr(zeno_refine, "path", sine)
    finding = zeno_refine.judge_experiment(experiment(REFINE))
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert "bare" in finding.counterexample["what"]
