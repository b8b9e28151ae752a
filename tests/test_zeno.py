"""ZENO-PROOF and ZENO-REFINE: the proofs, the experiment, and the broken variants that they must refute."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Integrator,
    LogVectorOutput,
    TrajectorySource,
    ZeroOrderHold,
)
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.decision.trigger import Trigger
from airground_drake.diagram import integrated_noise
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems.decision import FIELDS, DecisionVariable, EventTrigger
from airground_drake.verify.engines.prover import discharge
from airground_drake.verify.engines.segments import NormSignal
from airground_drake.verify.engines.smt import solve
from airground_drake.verify.engines.symbolic_execution import Path
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.trigger import induction
from airground_drake.verify.model.trigger import refined_paths as counting
from airground_drake.verify.model.trigger import relation as automaton
from airground_drake.verify.model.trigger import zeno_proof as zeno
from airground_drake.verify.model.trigger import zeno_refine as refinement
from airground_drake.verify.model.trigger.refined_paths import experiment
from airground_drake.verify.model.trigger.zeno_proof import ZenoProof
from airground_drake.verify.model.trigger.zeno_refine import ZenoRefine
from airground_drake.verify.runs.trigger_replay import transitions

ZENO = {"zeta_m": 3.0, "released_below_m": 2.0, "dwell_s": 0.3, "min_inter_event_s": 0.3, "duration_s": 30.0}
NOISE = {"noise_m_sqrt_s": 0.004, "leak_1_s": 0.0, "noise_period_s": 0.05, "duration_s": 30.0}
REFINE = {"zeta_m": 3.0, "released_below_m": 2.0, "dwell_s": 0.5, **NOISE}
KINDS: dict[str, type[Trigger]] = {
    "no dwell": zeno._NoDwell,
    "no refractory mode": zeno._NoRefractory,
    "recovers at once": zeno._RecoversAtOnce,
    "forgets a trigger after the dwell": zeno._Forgets,
}


@cache
def proved() -> Finding:
    return ZenoProof().judge(ZENO)


@cache
def refined() -> Finding:
    return ZenoRefine().judge(REFINE)


def simulate(systems: Sequence[tuple[LeafSystem, str]], source: LeafSystem, until: float, step: float) -> np.ndarray:
    """Status (4n, rows) of the last of the systems, which are in a row behind a source."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("source", source)
    output = source.get_output_port()
    for system, port in systems:
        builder.AddNamedSystem(f"{port}_reader", system)
        builder.Connect(output, system.GetInputPort(port))
        if isinstance(system, DecisionVariable):
            count = output.size()
            for name, value in (("team_position", np.zeros(3 * count + 3)), ("reference", [3.0, 0.0, 0.0] * count)):
                given = np.zeros(system.GetInputPort(name).size())
                given[: len(value)] = value
                constant = builder.AddNamedSystem(name, ConstantVectorSource(given))
                builder.Connect(constant.get_output_port(), system.GetInputPort(name))
        output = system.get_output_port()
    # steps end at the multiples of `step`, as they do at the noise samples in the diagram; they need a continuous state
    clock = builder.AddNamedSystem("clock", Integrator(1))
    sampled = builder.AddNamedSystem("sampled", ZeroOrderHold(step, 1))
    rate = builder.AddNamedSystem("rate", ConstantVectorSource([1.0]))
    builder.Connect(rate.get_output_port(), clock.get_input_port())
    builder.Connect(clock.get_output_port(), sampled.get_input_port())
    log = LogVectorOutput(output, builder)
    log.set_name("log")
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    context.SetAccuracy(1e-6)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=step, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    found: np.ndarray = log.FindLog(context).data()
    return found


def trigger_times(status: np.ndarray, j: int) -> list[float]:
    """Times of the triggers of UGV j by a log of the trigger's status."""
    return sorted({float(t) for t in status[FIELDS * j + 2] if t >= 0.0})


# ZENO-PROOF


def test_the_shipped_trigger_is_proved(case_a: Scenario) -> None:
    claim = ZenoProof()
    inputs = claim.inputs(case_a)
    finding = claim.judge(inputs)
    assert finding.status == "proved", finding.evidence
    assert inputs["dwell_s"] == inputs["min_inter_event_s"] == case_a.decision.min_inter_event_s
    assert finding.margin is not None
    assert 0.99e-9 < finding.margin < 1e-9
    evidence = finding.evidence
    assert evidence["spacer"] == "an invariant exists"
    assert set(map(tuple, evidence["invariant"].values())) == {("unsat", "unsat")}
    assert {each["status"] for each in evidence["obligations"]} == {"proved"}
    assert json.loads(finding.certificates["relation.json"])["bound_s"] == "1/2"


def test_a_bare_trigger_is_refuted(case_a: Scenario) -> None:
    case_a.decision.trigger = "bare"
    finding = ZenoProof().judge(ZenoProof().inputs(case_a))
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["gap_s"] <= case_a.decision.min_inter_event_s / 2.0
    case_a.decision.min_inter_event_s = 0.0  # no bound to compare with: any is broken
    assert ZenoProof().judge(ZenoProof().inputs(case_a)).status == "refuted"


def test_a_dwell_that_is_too_short_is_refuted() -> None:
    finding = ZenoProof().judge(ZENO | {"min_inter_event_s": 0.4})
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert 0.3 <= finding.counterexample["gap_s"] < 0.4
    broken = [each for each in induction.remarks(Trigger(3.0, 2.0, 0.3), 0.4) if not each.certified()]
    assert [each.name for each in broken] == ["dwell_is_the_bound"]


@pytest.mark.parametrize("name", zeno.MUTANTS)
def test_mutants_are_refuted_by_a_run(name: str) -> None:
    """The run breaks the mutant and not the trigger itself; where the simulator can show it, it does."""
    finding = zeno.MUTANTS[name](ZENO)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    run = finding.counterexample["run"]
    t, x = [row["t_s"] for row in run], [row["x_m"] for row in run]
    mutant = KINDS[name](3.0, 2.0, 0.3) if name in KINDS else Trigger.bare(3.0)
    for trigger, broken in ((mutant, True), (Trigger(3.0, 2.0, 0.3), False)):
        times = [row["t_s"] for row in automaton.replay(trigger, list(zip(t, x, strict=True))) if row["trigger"]]
        assert (min((b - a for a, b in pairwise(times)), default=math.inf) < 0.3) == broken
    if name in ("no dwell", "no refractory mode", "no hysteresis, no dwell"):
        source = TrajectorySource(PiecewisePolynomial.FirstOrderHold([*t, t[-1] + 1.0], [[*x, x[-1]]]))
        status = simulate([(EventTrigger(1, mutant), "decision_variable")], source, t[-1] + 0.5, 1.0 / 256.0)
        before, after = trigger_times(status, 0)[-2:]
        assert after - before < 0.3


@pytest.mark.parametrize("name", KINDS)
def test_mutants_have_no_symbolic_proof_either(name: str) -> None:
    broken = automaton.relation(lambda path: KINDS[name](*map(path.symbol, ("zeta", "release", "dwell"))))
    failing = [each for each in induction.obligations(broken) if not each.certified()]
    assert failing
    assert "refuted" in {proof.status for proof in discharge(failing)}


@pytest.mark.parametrize("name", KINDS)
def test_conformance_notices_another_trigger(name: str) -> None:
    relation = automaton.relation(lambda _: KINDS[name](3.0, 2.0, 0.3))
    found = automaton.conformance(Trigger(3.0, 2.0, 0.3), relation, 30.0)
    assert found["disagreements"] > 0
    assert found["first"] is not None


def test_conformance_meets_every_transition_and_the_rounding() -> None:
    found = proved().evidence["conformance"]
    assert found["states"] >= 2000
    assert found["disagreements"] == 0
    assert found["within_rounding"] > 0  # 0.3 is no binary fraction: it matters, and the bound on it covers it
    relation = automaton.relation(lambda _: Trigger(3.0, 2.0, 0.3))
    events = {each.name for each in relation if each.source is not None and not each.name.endswith("waits")}
    assert events - set(found["transitions"]) == {"intervening_refractory_untriggered"}  # only at s < 0


@given(st.floats(0.0, 30.0), st.floats(1e-3, 10.0))
@example(0.1, 0.2)
def test_rounding_bounds_the_end_of_the_dwell(triggered_at: float, dwell: float) -> None:
    trigger = Trigger(3.0, 2.0, dwell)
    end = trigger.dwell_end(trigger.rise(trigger.start(0.0, 0.0), triggered_at))
    exact = Fraction(triggered_at) + Fraction(repr(dwell))
    assert abs(Fraction(end) - exact) <= Fraction(automaton.rounding(trigger, 30.0))


def test_certificates_are_answered_alike_from_their_text() -> None:
    files = proved().certificates
    assert [result.answer for result in solve([files["zeno_horn.smt2"]])] == ["sat"]
    for name in ("initiation", "consecution", "safety"):
        assert solve([files[f"inv_{name}.smt2"]], "cvc5")[0].answer == "unsat"
    weaker = files["inv_consecution.smt2"].replace("(= a l)", "true")  # not inductive without the memory
    assert solve([weaker])[0].answer == "sat"


def test_symbols_refuse_what_they_cannot_decide() -> None:
    symbol = Path([]).symbol("a")
    for question in (lambda: bool(symbol), lambda: symbol == 1.0):
        with pytest.raises(TypeError):
            question()


def test_symbols_explore_every_outcome() -> None:
    relation = automaton.relation(lambda path: Trigger(*map(path.symbol, ("zeta", "release", "dwell"))))
    assert {(str(f), strict) for f, strict in relation[0].guards} >= {("zeta", True), ("zeta - release", False)}
    assert len([each for each in relation if each.source is None]) == 2
    assert {each.name for each in relation if each.triggers and not each.name.endswith("untriggered")} == {
        "start_intervening",
        "supervising_intervening",
        "refractory_intervening",
    }


# ZENO-REFINE


def test_the_shipped_trigger_is_supported(case_a: Scenario) -> None:
    assert ZenoRefine().inputs(case_a) == REFINE
    finding = refined()
    assert finding.status == "supported", finding.counterexample
    evidence = finding.evidence
    assert evidence == refinement.series(experiment(REFINE), counting.counts(experiment(REFINE)))
    dt = evidence["dt_s"]
    assert dt[0] / dt[-1] >= 256
    for name in counting.SERIES:
        assert {len(values) for values in evidence[name].values()} == {len(dt)}
    low, high = evidence["fit"]["bare"]["interval"]
    assert low < -0.49 < high < -0.4
    assert max(evidence["automaton"]["largest"]) <= evidence["most_triggers"] == 61
    assert evidence["bare"]["mean"][-1] > 10.0 * evidence["bare"]["mean"][0]
    rows = finding.certificates["counts.csv"].splitlines()
    assert len(rows) == 1 + counting.PATHS * len(dt)
    last = [float(row.split(",")[2]) for row in rows[1:] if float(row.split(",")[1]) == dt[-1]]
    assert math.fsum(last) / len(last) == pytest.approx(evidence["bare"]["mean"][-1])


def test_experiments_that_must_fail() -> None:
    found = {name: mutant(REFINE) for name, mutant in refinement.REFINED.items()}
    assert {finding.status for finding in found.values()} == {"refuted"}
    whats: list[Any] = [finding.counterexample["what"] for finding in found.values() if finding.counterexample]
    assert ["automaton" in whats[0], "bare" in whats[1]] == [True, True]


def test_more_triggers_than_the_dwell_admits_are_noticed() -> None:
    kind = zeno._NoDwell(3.0, 3.0, 0.5)
    setting = dataclasses.replace(experiment(REFINE), trigger=kind)
    finding = refinement.judge_experiment(setting)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    i, dt = finding.counterexample["path"], finding.counterexample["dt_s"]
    unit = counting.path(setting, i)[setting.dt_s.index(dt)]
    times = counting.triggers(kind, 3.0 + setting.noise_m_sqrt_s * unit, dt)
    assert len(times) == finding.counterexample["triggers"] > 61
    assert min(b - a for a, b in pairwise(times)) < 0.5


@pytest.mark.parametrize("leak", [0.0, 0.7])
def test_expected_bare_count_against_random_walks(leak: float) -> None:
    """Exact expectation against 40 000 walks of 64 steps made here."""
    setting = experiment(REFINE | {"leak_1_s": leak, "duration_s": 3.2})
    dt, rng, walks = setting.dt_s[0], np.random.default_rng(0), 40_000
    x = rng.normal(0.0, math.sqrt(dt), walks)
    count = (x >= 0.0).astype(float)
    for _ in range(round(setting.duration_s / dt)):
        after = x - leak * dt * x + rng.normal(0.0, math.sqrt(dt), walks)
        count += (x < 0.0) & (after >= 0.0)
        x = after
    error = count.std() / math.sqrt(walks)
    assert abs(count.mean() - counting.expected_bare(setting, dt)) < 4.0 * error


def test_expected_bare_count_grows_as_stated() -> None:
    setting = experiment(REFINE)
    for dt in setting.dt_s:
        steps = round(setting.duration_s / dt)
        first = round(setting.dt_s[0] / dt)
        exact = 0.5 + sum(math.atan(1.0 / math.sqrt(first + k)) for k in range(steps)) / (2.0 * math.pi)
        assert counting.expected_bare(setting, dt) == pytest.approx(exact, rel=1e-9)
        assert abs(exact - (math.sqrt(first + steps) - math.sqrt(first)) / math.pi) < 1.0


@given(
    st.lists(st.floats(0.0, 6.0), min_size=3, max_size=40),
    st.sampled_from([Trigger(3.0, 2.0, 0.5), Trigger(3.0, 3.0, 0.5), Trigger(3.0, 2.0, 0.0), Trigger.bare(3.0)]),
)
def test_fast_triggers_are_those_of_the_independent_checker(values: list[float], trigger: Trigger) -> None:
    x = np.array(values) + 1e-3 * math.sqrt(2.0)  # not at a level, where a touch may count or not
    dt = 0.125
    t = dt * np.arange(len(x))
    signal = NormSignal.of(t, np.column_stack([np.zeros((len(x), 3)), x]))
    expected = [
        time for time, kind in transitions(signal, trigger.zeta, trigger.release, trigger.dwell) if kind == "trigger"
    ]
    assert counting.triggers(trigger, x, dt) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("kind", ["automaton", "bare"])
def test_fast_triggers_are_those_of_the_running_systems(kind: str) -> None:
    """DecisionVariable and EventTrigger in a Drake diagram on six of the experiment's paths."""
    trigger = Trigger(3.0, 2.0, 0.5) if kind == "automaton" else Trigger.bare(3.0)
    setting = experiment(REFINE | {"duration_s": 8.0})
    dt = setting.dt_s[1]
    noise = np.array([setting.noise_m_sqrt_s * counting.path(setting, i)[1] for i in range(6)])
    source = TrajectorySource(PiecewisePolynomial.FirstOrderHold(dt * np.arange(noise.shape[1]), noise))
    systems = [(DecisionVariable(6), "noise"), (EventTrigger(6, trigger), "decision_variable")]
    # every UGV's reference is 3 m away: only its noise moves x
    status = simulate(systems, source, dt * (noise.shape[1] - 1), dt)
    total = 0
    for j in range(6):
        expected = counting.triggers(trigger, 3.0 + noise[j], dt)
        assert trigger_times(status, j) == pytest.approx(expected, abs=1e-5)
        total += len(expected)
    assert total > 6


def test_paths_are_those_of_the_diagrams_noise() -> None:
    """The same normal samples through the diagram's AffineSystem, held over each noise step."""
    setting = experiment(REFINE | {"leak_1_s": 0.7, "noise_period_s": 1.0 / 32.0, "duration_s": 2.0})
    dt, n = setting.dt_s[2], counting.path(setting, 0)[2]
    samples = (np.diff(n) + setting.leak_1_s * dt * n[:-1]) / math.sqrt(dt)
    builder = DiagramBuilder()
    held = PiecewisePolynomial.ZeroOrderHold(dt * np.arange(len(n)), [[*samples, 0.0]])
    source = builder.AddNamedSystem("samples", TrajectorySource(held))
    noise = builder.AddNamedSystem("noise", integrated_noise(1, 1.0, setting.leak_1_s, dt))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    log = LogVectorOutput(noise.get_output_port(), builder)
    log.set_name("log")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    noise.GetMyMutableContextFromRoot(context).SetContinuousState([n[0]])
    simulator = Simulator(diagram, context)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=dt, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(dt * (len(n) - 1))
    found = log.FindLog(context)
    assert np.interp(dt * np.arange(len(n)), found.sample_times(), found.data()[0]) == pytest.approx(n, abs=1e-9)
