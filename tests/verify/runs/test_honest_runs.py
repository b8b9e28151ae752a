"""Runs that put a claim to an unusual test, and hold; what a claim says of them."""

from itertools import islice
from typing import Any

import numpy as np
import pytest
from builders.edits import with_meta, with_scenario
from builders.runs import at_rest, refractory, run_of
from builders.scenarios import STILL, changed, lone
from builders.simulation import simulate as simulate_synthetic
from verify.judging import decided

from airground_drake.scenario.schema import Decision, Preset, Threshold
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.thr_quality import Judge, Watch
from airground_drake.verify.claims.zeno_trace import ZenoTrace
from airground_drake.verify.engines.geometry import NormSignal


def held(claim: str, trace: Trace) -> dict[str, Any]:
    finding = decided(claim, trace)
    assert finding.status == "holds", finding
    return dict(finding.evidence)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_crossing_inside_the_dwell_triggers_at_its_end(noise: float) -> None:
    trace = refractory(noise)
    times = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    assert np.diff(times) == pytest.approx([4.0], abs=1e-9)
    assert held("THR-TRIG", trace)
    assert set(trace.column("ugv1.mode")) == {0.0, 1.0, 2.0}
    assert decided("ZENO-TRACE", trace).margin == pytest.approx(0.0, abs=1e-12)


def test_the_most_triggers_of_a_run_are_counted_in_decimals() -> None:
    """In floating point 7 / 0.07 is a little less than 100."""
    trace = with_scenario(run_of("d"), duration_s=7.0, decision__min_inter_event_s=0.07)
    assert ZenoTrace().check(trace).evidence["most_triggers_possible"] == 101


def test_above_the_threshold_at_the_start_triggers_at_once() -> None:
    trace = simulate_synthetic(lone([4.0, 0.0, 0.0], [4.0, 0.0, 0.0], STILL, 1.0), drive=at_rest)
    assert [event["t_s"] for event in trace.events if event["kind"] != "proposal"] == [0.0]
    assert held("THR-TRIG", trace)
    assert decided("THR-TRIG", with_meta(trace, events=[])).status == "refuted"


def test_a_corner_of_the_preset_inside_a_row_interval() -> None:
    """The variable peaks at the corner, between two rows, above the threshold: seen only if it is cut there."""
    out_and_home = Preset([[0.0, 0.0, 0.0], [3.0125, 0.0, 0.0], [0.0, 0.0, 0.0]], 1.0)
    decision = Decision(threshold=Threshold(zeta_m=3.005), release_m=3.0045)
    trace = simulate_synthetic(lone([0.0] * 3, [0.0] * 3, out_and_home, 7.0, decision=decision), drive=at_rest)
    samples = trace.column("ugv1.decision_variable_m")[np.abs(trace.t - np.round(trace.t / 0.025) * 0.025) < 1e-9]
    assert samples.max() < 3.005
    assert [event["kind"] for event in trace.events if event["kind"] != "proposal"] == ["trigger", "release"]
    assert held("THR-TRIG", trace)
    never = simulate_synthetic(changed(trace.meta["scenario"], {"decision.threshold.zeta_m": 99.0}), drive=at_rest)
    unseen = with_meta(with_scenario(never, decision__threshold__zeta_m=3.005), zeta_m=3.005)
    found = decided("THR-TRIG", unseen).counterexample or {}
    assert (found["what"], found["t_s"]) == ("missing trigger", pytest.approx(3.005, abs=1e-9))


def test_a_bare_trigger_is_judged_in_a_bounded_number_of_steps() -> None:
    """Release level and threshold are one: at a crossing the task error may equal both, and time must go on."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        t = np.cumsum(rng.uniform(0.05, 0.4, 12))
        e = NormSignal.of(t, np.column_stack([rng.uniform(0.0, 6.0, 12), np.zeros((12, 3))]))
        zeta = float(rng.uniform(1.0, 5.0))
        found = Judge("ugv1", e, zeta, zeta, 0.0)._of_watch(Watch(float(t[0]), None, float(t[-1])))
        assert sum(1 for _ in islice(found, 50)) < 12
