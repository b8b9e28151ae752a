"""The event trigger in a Drake diagram: events between two updates are isolated, or made up for."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Integrator,
    LogVectorOutput,
    Multiplexer,
    PassThrough,
    Sine,
    TrajectorySource,
    VectorLogSink,
    ZeroOrderHold,
)
from pydrake.trajectories import PiecewisePolynomial
from verify.judging import decided

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, SimulationError
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.trigger.automaton import FIELDS, Trigger
from airground_drake.scenario.load import from_data, load
from airground_drake.sim.blocks.decision import DecisionBlock, DecisionVariable, EventTrigger
from airground_drake.sim.components import integrated_noise
from airground_drake.sim.diagram import build_diagram
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.geometry import NormSignal
from airground_drake.verify.runs.triggers import transitions


@dataclass(frozen=True)
class Path:
    """Task errors (T, n, 3), m, and noise (T, n), m, at times (T,), s, linear in between."""

    t: Array
    error: Array
    noise: Array


def run(trigger: Trigger, path: Path, step: float, presets: Sequence[Motion] = ()) -> Array:
    builder = DiagramBuilder()
    n = path.noise.shape[1]
    variable = builder.AddNamedSystem("decision_variable", DecisionVariable(world(n), presets))
    system = builder.AddNamedSystem("event_trigger", EventTrigger(n, trigger, step))
    for port in ("decision_variable", "decision_range"):
        builder.Connect(variable.GetOutputPort(port), system.GetInputPort(port))
    reference = np.zeros((len(path.t), n, 3))
    t = path.t
    if presets:
        t = np.unique(np.concatenate([path.t, *(preset.times for preset in presets)]))
        reference = np.stack([preset.sample(t) for preset in presets], axis=1)
    signals = {
        "bodies": (path.t, np.vstack([-path.error.reshape(len(path.t), -1).T, np.zeros((3, len(path.t)))])),
        "reference": (t, np.vstack([reference.reshape(len(t), -1).T, np.zeros((3 * n, len(t)))])),
        "noise": (path.t, path.noise.T),
    }
    for name, (times, samples) in signals.items():
        source = TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, samples))
        builder.AddNamedSystem(name, source)
        builder.Connect(source.get_output_port(), variable.GetInputPort(name))
    # steps end at the multiples of `step`; they need a continuous state
    clock, hold = builder.AddNamedSystem("clock", Integrator(1)), builder.AddNamedSystem("hold", ZeroOrderHold(step, 1))
    builder.Connect(hold.get_output_port(), clock.get_input_port())
    builder.Connect(clock.get_output_port(), hold.get_input_port())
    log = LogVectorOutput(system.get_output_port(), builder)
    log.set_name("log")
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetAccuracy(1e-6)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=step, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(path.t[-1] + step)
    return np.array(log.FindLog(simulator.get_context()).data())


def times(status: Array, field: int, robot: int = 0) -> list[float]:
    return [float(t) for t in np.unique(status[FIELDS * robot + field]) if t >= 0.0]


TRIGGER = Trigger(zeta=3.0, release=1.0, dwell=0.0)


def straight(*ends: Sequence[float]) -> Path:
    error = np.array(ends, dtype=np.float64)[:, None]
    return Path(np.arange(len(ends), dtype=np.float64), error, np.zeros((len(ends), 1)))


def simulator_of(x: System, trigger: Trigger, accuracy: float | None = 1e-6) -> tuple[Simulator, VectorLogSink]:
    """A trigger whose range is x now, with nothing else in the diagram that is sampled; and a log of its status."""
    builder = DiagramBuilder()
    system, span = builder.AddSystem(EventTrigger(1, trigger)), builder.AddSystem(Multiplexer([1, 1]))
    source = builder.AddSystem(x).get_output_port(0)
    for port in (span.get_input_port(0), span.get_input_port(1), system.GetInputPort("decision_variable")):
        builder.Connect(source, port)
    builder.Connect(span.get_output_port(0), system.GetInputPort("decision_range"))
    log = LogVectorOutput(system.get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetAccuracy(accuracy)
    return simulator, log


def test_a_decision_variable_that_is_not_a_number_is_an_error() -> None:
    """No comparison with a level would notice it: the trigger would never fire."""
    simulator, _ = simulator_of(ConstantVectorSource([np.nan]), TRIGGER)
    with pytest.raises(PluginError, match=r"decision_range is not a number, .*: \[nan, nan\]"):
        simulator.AdvanceTo(1.0)


def test_every_crossing_is_found_where_nothing_else_bounds_the_steps() -> None:
    """x = 4 sin t, which an integrator without states would pass in one step, reaches 3 m four times in 20 s."""
    simulator, log = simulator_of(Sine(4.0, 1.0, 0.0, 1), TRIGGER)
    simulator.AdvanceTo(20.0)
    due = np.arcsin(0.75) + 2.0 * np.pi * np.arange(4)
    assert times(log.FindLog(simulator.get_context()).data(), 2) == pytest.approx(due, abs=2e-6)


def test_a_context_without_an_accuracy_is_refused_before_the_run() -> None:
    simulator, _ = simulator_of(Sine(4.0, 1.0, 0.0, 1), TRIGGER, accuracy=None)
    with pytest.raises(RuntimeError, match=r"no accuracy.*call SetAccuracy\(1e-6\)"):
        simulator.Initialize()


def test_a_dip_too_short_to_be_isolated_is_a_release_and_a_trigger_at_once() -> None:
    """Below the threshold for less than what an event is isolated to: both transitions are made at the step's end."""
    nearest = 3.0 - 1e-13  # x is below 3 m for 2e-10 s
    status = run(Trigger(3.0, 3.0, 0.0), straight((4e3, nearest, 0.0), (-4e3, nearest, 0.0)), 1.0)
    released = times(status, 3)
    assert released == [pytest.approx(0.5, abs=2e-6)]
    assert times(status, 2) == [0.0, *released]


def test_a_peak_at_a_corner_of_the_reference_is_a_trigger() -> None:
    """The reference turns back in the middle of a step: x is below the threshold at both updates."""
    preset = Motion(np.array([0.0, 0.45, 0.9]), np.array([[0.0, 0.0, 0.0], [4.5, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    path = straight((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert times(run(TRIGGER, path, 1.0, [preset]), 2) == [pytest.approx(0.3, abs=2e-6)]
    assert times(run(TRIGGER, path, 1.0), 2) == []


@pytest.mark.parametrize("late", [0.0, 3e-16, 2e-9])
def test_two_ugvs_at_nearly_the_same_instant(late: float) -> None:
    noise = np.array([[0.0, -late * 10.0], [10.0, 10.0 - late * 10.0]])
    path = Path(np.array([0.0, 1.0]), np.zeros((2, 2, 3)), noise)
    status = run(TRIGGER, path, 0.3)
    for robot in range(2):
        assert times(status, 2, robot) == [pytest.approx(0.3, abs=2e-6)]  # at the very end of the first step


def test_a_bare_trigger_that_starts_at_the_threshold_lasts_while_x_stays_there_and_ends_when_it_falls() -> None:
    bare = Trigger(3.0, 3.0, 0.0)
    resting = run(bare, straight((3.0, 0.0, 0.0), (3.0, 0.0, 0.0)), 0.25)
    assert (times(resting, 2), times(resting, 3)) == ([0.0], [])
    falling = run(bare, straight((3.0, 0.0, 0.0), (2.0, 0.0, 0.0)), 0.25)
    assert (times(falling, 2), times(falling, 3)) == ([0.0], [pytest.approx(0.0, abs=2e-6)])


@examples(25, fuzz=1500)
@given(
    seed=st.integers(0, 2**32), zeta=st.floats(0.5, 4.0), share=st.floats(0.05, 0.9), dwell=st.sampled_from([0.0, 0.35])
)
def test_events_are_those_of_the_replay(seed: int, zeta: float, share: float, dwell: float) -> None:
    """Random errors and noise with steps as coarse as their changes, against the exact replay of THR-TRIG."""
    rng = np.random.default_rng(seed)
    path = Path(np.arange(9.0), rng.normal(0.0, 2.0, (9, 2, 3)), rng.normal(0.0, 0.7, (9, 2)))
    trigger = Trigger(zeta, share * zeta, dwell)
    status = run(trigger, path, 1.0)
    for j in range(2):
        signal = NormSignal.of(path.t, np.column_stack([path.error[:, j], path.noise[:, j]]))
        expected = list(transitions(signal, trigger.zeta, trigger.release, trigger.dwell))
        starts = [t for t, kind in expected if kind == "trigger"]
        ends = [t for t, kind in expected if kind in ("release", "refractory")]
        instants = np.sort([*starts, *ends])
        if (np.diff(instants) < 1e-4).any() or (instants > 8.0 - 1e-4).any():
            continue  # closer than what is isolated apart
        assert times(status, 2, j) == pytest.approx(starts, abs=3e-6)
        assert times(status, 3, j) == pytest.approx(ends, abs=3e-6)


def test_what_is_above_the_threshold_at_the_start_is_intervened_on_at_the_first_tick() -> None:
    """The trigger comes before the planner's first update, not with the first step after it."""
    scenario = load(pathlib.Path(__file__).parents[2] / "builders" / "crowd.yaml")
    proposals = simulate(scenario, "b").proposals
    assert proposals["issued_s"].min() == 0.0


@pytest.mark.parametrize("period", [0.25, 0.01])
def test_a_sample_of_the_noise_moves_the_variable_by_what_its_period_is_worth(period: float) -> None:
    """Held over a period h, w adds intensity sqrt(h) w: after any time T the variance is intensity^2 T."""
    noise = integrated_noise(2, 0.4, 0.0, period)
    np.testing.assert_allclose(period * noise.B(), 0.4 * np.sqrt(period) * np.eye(2), rtol=1e-12)
    np.testing.assert_array_equal(integrated_noise(2, 0.4, 0.3, period).A(), -0.3 * np.eye(2))


class Silent(DecisionBlock):
    def value(self, t: float, parts: Array) -> Array:
        return np.zeros(len(parts))


class Played(DecisionBlock):
    """A recorded signal: rises to 4 m in 2 s and falls to 0 m in 2 s, for every UGV."""

    def value(self, t: float, parts: Array) -> Array:
        return np.full(len(parts), np.interp(t, [0.0, 2.0, 4.0], [0.0, 4.0, 0.0]))


def of_kind(trace: Trace, kind: str) -> list[float]:
    return [float(event["t_s"]) for event in trace.events if event["kind"] == kind]


def test_a_decision_block_that_returns_0_triggers_nothing_and_does_not_pass_for_15() -> None:
    trace = simulate(load("case_a", {"duration_s": 15.0}), "b", decision_block=Silent)
    assert of_kind(trace, "trigger") == []
    assert trace.meta["decision_block"] == "Silent"
    finding = decided("THR-TRIG", trace)
    assert (finding.status, finding.exercised) == ("holds", 0)
    assert finding.evidence["ugvs"][0]["port_against_15"]["status"] == "not_run"
    passed_off = decided("THR-TRIG", replace(trace, meta={**trace.meta, "decision_block": ""}))
    assert passed_off.status == passed_off.evidence["ugvs"][0]["port_against_15"]["status"] == "refuted"


class EndsOnly(DecisionVariable):
    """Knows x at the ends of steps only."""

    extremes = DecisionBlock.extremes


def test_with_the_ends_of_steps_a_crossing_is_isolated_too() -> None:
    scenario = load("case_a", {"duration_s": 15.0})
    (exact, *_), (ends, *_) = (
        of_kind(simulate(scenario, "b", decision_block=b), "trigger") for b in (DecisionVariable, EndsOnly)
    )
    assert ends == pytest.approx(exact, abs=2e-6)


def test_a_recorded_signal_drives_the_trigger_and_its_crossings_are_isolated() -> None:
    scenario = load("case_a", {"duration_s": 5.0, "decision.release_m": 1.0})
    trace = simulate(scenario, "b", decision_block=Played)
    ugvs = len(trace.ugvs)
    assert of_kind(trace, "trigger") == pytest.approx([scenario.decision.threshold.zeta_m / 2.0] * ugvs, abs=2e-6)
    assert of_kind(trace, "release") == pytest.approx([3.5] * ugvs, abs=2e-6)
    assert decided("THR-TRIG", trace).status == "holds"
    late = [{**e, "t_s": e["t_s"] + 0.001 * (e["kind"] == "release")} for e in trace.events]
    assert decided("THR-TRIG", replace(trace, meta={**trace.meta, "events": late})).status == "refuted"


@pytest.mark.parametrize("x", [None, np.full(2, np.nan), np.zeros(3), "x"])
@pytest.mark.parametrize("method", ["value", "extremes"])
def test_a_decision_block_that_returns_no_numbers_is_named(x: Any, method: str) -> None:
    odd = type("Odd", (DecisionBlock,), {"value": lambda self, t, parts: np.zeros(2), method: lambda *given: x})
    with pytest.raises(SimulationError, match=r"decision block Odd returned .*; wanted: .*2 finite numbers"):
        simulate(load("case_a", {"duration_s": 15.0}), "b", decision_block=odd)


def test_a_decision_block_that_raises_is_named_with_its_place() -> None:
    odd = type("Odd", (DecisionBlock,), {"value": lambda self, t, parts: 1 / 0})
    with pytest.raises(SimulationError, match=r"test_decision\.py:\d+ ZeroDivisionError: .*: Odd of the trigger\)"):
        simulate(load("case_a"), "b", decision_block=odd)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("x", "decision_block is 'x'"),
        (int, "decision_block is <class 'int'>"),
        (lambda world, presets: 3, "decision_block makes 3"),
    ],
)
def test_what_makes_no_decision_block_is_refused(given: Any, said: str) -> None:
    with pytest.raises(PluginError, match=said):
        build_diagram(load("case_a"), decision_block=given)


def test_a_decision_block_without_a_range_is_refused() -> None:
    with pytest.raises(PluginError, match=r"the decision block has output ports of sizes .*'decision_range': 4"):
        build_diagram(load("case_a"), decision_block=lambda bodies, presets: PassThrough(len(bodies.names("ugv"))))


def test_where_rounding_keeps_an_event_from_being_isolated_the_run_ends_with_the_reason() -> None:
    """A UGV falls to the release level in steps that are too short to move it: its coordinates have 1e-8 m at most."""
    far = 1e8
    on, ahead = [far, 0.0, 0.0], [far + 10.0, 0.0, 0.0]
    ugv = {
        "start_m": [far - 1.0, 0.0, 0.0],
        "target_m": ahead,
        "preset": {"waypoints_m": [on, ahead], "speed_m_s": 1.0},
    }
    data = {
        "name": "far", "duration_s": 5.0, "ugvs": {"ugv1": ugv}, "uav": {"start_m": [far, 9.0, 2.0]},
        "control": {"avoidance_gain_1_s": 0.0}, "runs": {"a": {"method": "a"}},
        "decision": {"threshold": {"zeta_m": 0.5}, "release_m": 0.1, "min_inter_event_s": 0.1},
    }  # fmt: skip
    with pytest.raises(SimulationError, match="an event cannot be isolated: coordinates are rounded too coarsely"):
        simulate(from_data(data, "far"), "a")
