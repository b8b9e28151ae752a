"""THR-TRIG."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.edits import bumped, dropped, first_of, set_nan, with_meta, with_scenario
from builders.runs import at_rest, refractory, run_of
from builders.scenarios import STILL, changed, lone
from builders.simulation import Drive, simulate
from verify.judging import counterexample, judge

from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Decision, Preset, Threshold


def edited_events(edit: Callable[[list[dict[str, Any]]], None], trace: Trace) -> Trace:
    events = [dict(event) for event in trace.events]
    edit(events)
    return with_meta(trace, events=events)


EVENTS: dict[str, tuple[str, Callable[[list[dict[str, Any]]], None]]] = {
    "trigger removed": ("missing trigger", lambda events: events.remove(first_of(events, "trigger"))),
    "release removed": ("missing release", lambda events: events.remove(first_of(events, "release"))),
    "trigger late": ("missing trigger", lambda events: first_of(events, "trigger").update(t_s=1.501)),
    "release early": ("spurious release", lambda events: first_of(events, "release").update(t_s=3.249)),
    "trigger added": ("spurious trigger", lambda events: events.append({**events[0], "t_s": 0.7})),
    "last trigger added": ("spurious trigger", lambda events: events.append({**events[0], "t_s": 9.9})),
    "trigger of the UAV": ("spurious trigger: not a UGV", lambda events: events.append({**events[0], "robot": "uav"})),
}


@pytest.mark.parametrize("name", EVENTS)
def test_wrong_events_are_refuted(name: str) -> None:
    what, edit = EVENTS[name]
    mutant = edited_events(edit, refractory())
    assert counterexample("THR-TRIG", mutant)["what"] == what
    if name != "trigger of the UAV":
        assert judge("ZENO-TRACE", mutant).status == "error"  # events and columns disagree


SIGNALS: dict[str, Callable[[Trace], Trace]] = {
    "noise": bumped("ugv1.noise_m", 2e-6),
    "mode": bumped("ugv1.mode", 1.0),
    "count of triggers": bumped("ugv1.triggers", 1.0),
    "time of the trigger, in the column alone": bumped("ugv1.triggered_at_s", 1e-3),
    "time of the release": bumped("ugv1.released_at_s", 1e-3),
    "release level": lambda trace: with_scenario(trace, decision__release_m=1.4),
    "speed of the preset": lambda trace: with_scenario(trace, ugvs__ugv1__preset__speed_m_s=1.001),
    "bare": lambda trace: with_scenario(trace, decision__trigger="bare"),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_wrong_signals_are_refuted(name: str) -> None:
    assert judge("THR-TRIG", SIGNALS[name](run_of("d"))).status == "refuted"


def leaking() -> Trace:
    """Noise that triggers within its periods, so that these have rows within."""
    decision = Decision(
        Threshold(zeta_m=0.5), release_m=0.4, min_inter_event_s=0.1, noise_m_sqrt_s=1.0, leak_1_s=0.5
    )  # fmt: skip
    return simulate(lone([0.0] * 3, [0.2, 0.0, 0.0], STILL, 10.0, decision=decision), drive=at_rest)


NOISE: dict[str, Callable[[Trace], Trace]] = {
    "other leak": lambda trace: with_scenario(trace, decision__leak_1_s=0.49),
    "no leak": lambda trace: with_scenario(trace, decision__leak_1_s=0.0),
    "longer periods": lambda trace: with_scenario(trace, decision__noise_period_s=0.05),
    "a tenth of the intensity": lambda trace: with_scenario(trace, decision__noise_m_sqrt_s=0.1),
    "no noise": lambda trace: with_scenario(trace, decision__noise_m_sqrt_s=0.0),
    "from elsewhere": lambda trace: bumped("ugv1.noise_m", 1e-7, row=0)(trace),
}


def test_noise_moves_by_one_sample_a_period() -> None:
    assert judge("THR-TRIG", leaking()).status == "holds"


@pytest.mark.parametrize("name", NOISE)
def test_noise_that_moves_otherwise_is_refuted(name: str) -> None:
    assert counterexample("THR-TRIG", NOISE[name](leaking()))["what"].startswith("noise")


@pytest.mark.parametrize("column", ["noise_m", "decision_variable_m", "mode", "triggers", "triggered_at_s"])
def test_missing_trigger_data_is_an_error(column: str) -> None:
    assert judge("THR-TRIG", dropped(f"ugv2.{column}")(run_of("d"))).status == "error"
    assert judge("THR-TRIG", set_nan(f"ugv2.{column}")(run_of("d"))).status == "error"


def test_a_threshold_that_is_not_the_scenarios_is_an_error() -> None:
    assert judge("THR-TRIG", with_meta(run_of("d"), zeta_m=2.9)).status == "error"
    bayes = with_scenario(run_of("d"), decision__threshold__rule="bayes")
    assert judge("THR-TRIG", bayes).status == "error"  # 3 m is not quite the minimiser for a drift of 6.05 m/s
    drift = with_scenario(bayes, decision__threshold__drift_m_s=6.066688755667553)
    assert judge("THR-TRIG", drift).status == "holds"
    assert judge("THR-TRIG", with_meta(drift, zeta_m=2.9)).status == "error"


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_crossing_inside_the_dwell_triggers_at_its_end(noise: float) -> None:
    trace = refractory(noise)
    times = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    assert np.diff(times) == pytest.approx([4.0], abs=1e-9)
    assert judge("THR-TRIG", trace).status == "holds"
    assert set(trace.column("ugv1.mode")) == {0.0, 1.0, 2.0}


def test_above_the_threshold_at_the_start_triggers_at_once() -> None:
    scenario = lone([4.0, 0.0, 0.0], [4.0, 0.0, 0.0], STILL, 1.0)
    trace = simulate(scenario, drive=at_rest)
    assert [event["t_s"] for event in trace.events if event["kind"] != "proposal"] == [0.0]
    assert judge("THR-TRIG", trace).status == "holds"
    assert judge("THR-TRIG", with_meta(trace, events=[])).status == "refuted"


def test_a_corner_of_the_preset_inside_a_row_interval() -> None:
    """x peaks at the corner, between two rows, above the threshold: seen only if the interval is cut there."""
    out_and_home = Preset([[0.0, 0.0, 0.0], [3.0125, 0.0, 0.0], [0.0, 0.0, 0.0]], 1.0)
    decision = Decision(threshold=Threshold(zeta_m=3.005), release_m=3.0045)
    trace = simulate(lone([0.0] * 3, [0.0] * 3, out_and_home, 7.0, decision=decision), drive=at_rest)
    samples = trace.column("ugv1.decision_variable_m")[np.abs(trace.t - np.round(trace.t / 0.025) * 0.025) < 1e-9]
    assert samples.max() < 3.005
    assert [event["kind"] for event in trace.events if event["kind"] != "proposal"] == ["trigger", "release"]
    assert judge("THR-TRIG", trace).status == "holds"
    unseen = simulate(
        changed(trace.meta["scenario"], {"decision.threshold.zeta_m": 99.0}), drive=at_rest
    )  # no event rows
    unseen = with_meta(with_scenario(unseen, decision__threshold__zeta_m=3.005), zeta_m=3.005)
    seen = counterexample("THR-TRIG", unseen)
    assert seen["what"] == "missing trigger"
    assert seen["t_s"] == pytest.approx(3.005, abs=1e-9)


@pytest.mark.parametrize("trigger", ["automaton", "bare"])
@pytest.mark.parametrize("seed", range(6))
def test_random_motions_and_noise(trigger: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocities = np.repeat(rng.normal(0.0, 2.0, (40, 3)), 4, axis=0) * [1.0, 1.0, 0.0]
    drive: Drive = lambda t: [velocities[round(t / 0.025)].tolist(), [0.0] * 3]  # noqa: E731
    decision = Decision(trigger=trigger, release_m=0.6, min_inter_event_s=0.4, noise_m_sqrt_s=0.2)
    decision.threshold.zeta_m = 1.0
    preset = Preset([[0.0, 0.0, 0.0], [0.7, 0.3, 0.0], [0.7, -0.2, 0.0]], 0.61)
    trace = simulate(lone([0.5, 0.0, 0.0], [0.0] * 3, preset, 4.0, decision=decision), drive=drive, seed=seed)
    finding = judge("THR-TRIG", trace)
    assert finding.status == "holds", finding.counterexample
    assert trace.events
    assert finding.margin is not None
