"""Whole runs: timeline, events, reproducibility."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scenarios.cases import DEADLOCKS
from scipy.stats import kstest
from timeline import kinds, times

from airground_drake.base.errors import TraceError
from airground_drake.base.progress import Progress
from airground_drake.report.reproduction import MEASURES
from airground_drake.run import runs, trace
from airground_drake.run.runs import simulate_all
from airground_drake.run.simulation import Recorder, simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load, shipped
from airground_drake.scenarios.schema import Obstacle, Preset, Run, Scenario, Uav, Ugv
from airground_drake.verify import verify

Runs = Callable[[str, str], Trace]


def test_method_a_stalls_between_the_obstacles(run: Runs) -> None:
    of_run = run("case_a", "a")
    assert np.linalg.norm(of_run.position("ugv1")[-1, :2] - [3.3, 5.1]) < 0.1
    assert kinds(of_run, "ugv1") == ["trigger"]
    assert "arrival" in kinds(of_run, "ugv2")


@pytest.mark.parametrize("method", ["b", "c", "d"])
def test_the_intervention_frees_ugv1(run: Runs, method: str) -> None:
    of_run = run("case_a", method)
    answered = [] if method == "b" else ["accept"]
    assert kinds(of_run, "ugv1") == ["trigger", "proposal", *answered, "release", "arrival"]
    assert times(of_run, "trigger")[0] == pytest.approx(14.45, abs=0.05)


def test_table_1_triggers_at_8_10(run: Runs) -> None:
    assert times(run("case_a_table1", "b"), "trigger")[0] == pytest.approx(8.10, abs=0.05)


def test_recursion_as_printed_is_unsafe_and_does_not_stall(run: Runs) -> None:
    for name in ("a_recursion_nearest", "a_recursion_listed"):
        of_run = run("case_a", name)
        distance = [
            np.linalg.norm(of_run.position("ugv1") - o.position_m, axis=1).min()
            for o in of_run.scenario.obstacles.values()
        ]
        assert min(distance) < 1.95
        assert "arrival" in kinds(of_run, "ugv1")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", sorted(set(shipped()) - set(DEADLOCKS)))
def test_every_run_has_the_verdicts_that_its_scenario_declares(run: Runs, scenario: str) -> None:
    for name in load(scenario)[0].runs:
        for verdict in verify(run(scenario, name)):
            assert verdict.as_expected, (name, verdict.claim.id, verdict.finding)


def test_without_noise_the_decision_variable_is_the_norm_of_the_task_error(case_a: Scenario) -> None:
    case_a.decision.noise_m_sqrt_s = 0.0
    of_run = simulate(case_a, "b")
    for ugv in of_run.ugvs:
        error = np.linalg.norm(of_run.reference(ugv) - of_run.position(ugv), axis=1)
        assert np.abs(of_run.column(f"{ugv}.decision_variable_m") - error).max() < 1e-6


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_events_are_isolated_far_more_precisely_than_claims_ask_for(run: Runs, name: str) -> None:
    (verdict,) = verify(run(name, "d"), ["THR-TRIG"])
    found = {each["robot"]: each for each in verdict.finding.evidence["ugvs"]}["ugv1"]
    assert len(found["events"]) == 2
    assert found["worst_time_difference_s"] < 1e-7


def test_same_seed_same_bytes_other_seed_other_trigger(case_a: Scenario, run: Runs, tmp_path: Path) -> None:
    recorder = Recorder(case_a, "d")
    trace.save(recorder.simulate(), tmp_path / "one")
    trace.save(recorder.simulate(), tmp_path / "two")
    trace.save(run("case_a", "d"), tmp_path / "three")  # another diagram of the same scenario
    for name in ("signals.parquet", "decisions.parquet", "meta.json"):
        first = (tmp_path / "one" / name).read_bytes()
        assert first == (tmp_path / "two" / name).read_bytes() == (tmp_path / "three" / name).read_bytes()
    other = recorder.simulate(seed=7)
    assert times(other, "trigger")[0] != times(run("case_a", "d"), "trigger")[0]
    assert all(verdict.as_expected for verdict in verify(other))


@pytest.mark.slow
def test_runs_in_several_processes_are_those_in_one(
    case_a: Scenario, run: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    case_a.runs = {name: case_a.runs[name] for name in ("a", "d")}
    case_a.reproduction = []
    monkeypatch.setattr(runs, "_compiled", lambda: False)
    told: list[float] = []
    stages: list[str] = []
    progress = Progress()
    progress.advance = lambda amount, what="": told.append(amount)  # type: ignore[method-assign]
    progress.stage = lambda name, *_: stages.append(name)  # type: ignore[method-assign]
    called: list[str] = []
    one, two = simulate_all(case_a, 1), simulate_all(case_a, 2, progress, meanwhile=lambda: called.append("once"))
    assert called == ["once"]
    assert sum(told) == pytest.approx(2.0 * case_a.duration_s)
    assert stages == ["compiling, once, about half a minute", "simulating a, d"]
    for name in case_a.runs:
        assert one[name].signals.equals(two[name].signals)
        assert one[name].decisions.equals(two[name].decisions)
        assert one[name].meta["events"] == two[name].meta["events"] == run("case_a", name).meta["events"]


WARM_UP = """
from airground_drake.run import simulation
from airground_drake.gatekeeper import cost, outcome, relaxation, rollout
from airground_drake.nsbc import kernels, law
from airground_drake.scenarios.load import load


def compiled():
    modules = (kernels, law, rollout, cost, outcome, relaxation)
    functions = [(f.__qualname__, f) for module in modules for f in vars(module).values() if hasattr(f, "signatures")]
    return {name: list(map(str, f.signatures)) for name, f in functions}


simulation.warm_up()
before = compiled()
for method in "cd":
    simulation.simulate(load("case_a")[0], method)
assert before and compiled() == before, (before, compiled())
"""


@pytest.mark.slow
def test_warming_up_compiles_all_that_a_run_needs() -> None:
    """Otherwise the first decision of a process would count the compiler's time as its own."""
    subprocess.run([sys.executable, "-c", WARM_UP], check=True, timeout=300)


def test_noise_is_normal_and_has_the_intensity_of_the_scenario(case_a: Scenario) -> None:
    """Independent increments of mean 0 and variance sigma^2 dt, eq (15)."""
    case_a.decision.noise_m_sqrt_s = 0.1
    case_a.decision.threshold.zeta_m = 50.0
    recorder = Recorder(case_a, "a")
    steps = [
        np.diff(recorder.simulate(seed, 3.0).column(f"{ugv}.noise_m")) for seed in range(3) for ugv in ("ugv1", "ugv2")
    ]
    deviation = 0.1 * np.sqrt(0.05)
    assert np.std(steps) == pytest.approx(deviation, rel=0.15)  # 360 increments: 4 standard errors
    assert abs(np.mean(steps)) < 4.0 * deviation / np.sqrt(360.0)
    assert kstest(np.ravel(steps) / deviation, "norm").statistic < 2.0 / np.sqrt(360.0)
    assert abs(np.corrcoef(steps[0], steps[1])[0, 1]) < 0.5  # each UGV has its own noise


def test_noise_leaks_at_the_rate_of_the_scenario(case_a: Scenario) -> None:
    """The same noise with and without a leak, by explicit Euler steps."""
    case_a.decision.noise_m_sqrt_s, case_a.decision.threshold.zeta_m = 0.1, 50.0
    noise = []
    for case_a.decision.leak_1_s in (0.0, 0.5):
        noise.append(Recorder(case_a, "a").simulate(1, 3.0).column("ugv1.noise_m"))
    kept = 1.0 - 0.5 * case_a.decision.noise_period_s
    np.testing.assert_allclose(noise[1][1:], kept * noise[1][:-1] + np.diff(noise[0]), atol=1e-12)


def test_starting_above_the_threshold_triggers_at_once(case_a: Scenario) -> None:
    case_a.decision.threshold.zeta_m = 2.0  # UGV1 starts 2.35 m from its preset trajectory
    case_a.decision.release_m = 1.0
    case_a.duration_s = 2.0
    of_run = simulate(case_a, "a")
    assert times(of_run, "trigger")[0] == 0.0
    assert next(v for v in verify(of_run) if v.claim.id == "THR-TRIG").finding.status == "holds"


def test_events_are_isolated_not_sampled(run: Runs) -> None:
    of_run = run("case_a", "b")
    x = of_run.column("ugv1.decision_variable_m")
    when = times(of_run, "trigger")[0]
    assert when % 0.05 > 1e-6
    assert np.interp(when, of_run.t, x) == pytest.approx(3.0, abs=1e-5)


def test_bare_trigger_chatters_where_the_automaton_does_not(case_a: Scenario) -> None:
    """A task error that rests at the threshold, under noise: what the hysteresis and the dwell are for."""
    case_a.ugvs["ugv1"].preset.waypoints_m = [[3.3, 0.0, 0.0], [3.3, 8.1, 0.0]]
    case_a.runs = {"a": Run("a", expected={"LIVE-GOAL": "refuted"})}
    case_a.reproduction.clear()
    case_a.decision.leak_1_s = 2.0
    case_a.decision.noise_m_sqrt_s = 0.3
    counts = {}
    for kind in ("bare", "automaton"):
        case_a.decision.trigger = kind
        of_run = simulate(case_a, "a")
        counts[kind] = len(times(of_run, "trigger"))
        verdicts = {v.claim.id: v.finding.status for v in verify(of_run)}
        assert verdicts["THR-TRIG"] == "holds"
        assert verdicts["ZENO-TRACE"] == ("refuted" if kind == "bare" else "holds")
    assert counts["bare"] > 2 * counts["automaton"]


def test_a_team_of_six_among_many_obstacles_stays_safe(case_a: Scenario) -> None:
    """More robots and obstacles than the paper has, presets crossing each other: safe under method (d)."""
    rng = np.random.default_rng(4)
    case_a.ugvs = {
        f"r{i}": Ugv([4.0 * i, 0.0, 0.0], [4.0 * (5 - i), 20.0, 0.0],
                     Preset([[4.0 * i, 0.0, 0.0], [4.0 * (5 - i), 20.0, 0.0]], 0.8), 3.0)
        for i in range(6)
    }  # fmt: skip
    case_a.obstacles = {f"o{k}": Obstacle([*rng.uniform([0, 4], [20, 15]), 0.0]) for k in range(10)}
    case_a.uav.start_m, case_a.uav.target_m = [10.0, 0.0, 2.0], [10.0, 20.0, 2.0]
    case_a.reproduction, case_a.choices, case_a.runs = [], [], {"d": Run(method="d")}
    statuses = {v.claim.id: v.finding.status for v in verify(simulate(case_a, "d"))}
    assert statuses["SAFE-TRACE"] == statuses["SAFE-HYP"] == statuses["THR-TRIG"] == "holds"


def test_a_trace_survives_saving_and_a_changed_file_does_not(run: Runs, tmp_path: Path) -> None:
    of_run = run("case_a", "c")
    trace.save(of_run, tmp_path)
    back = trace.load(tmp_path)
    assert back.signals.equals(of_run.signals)
    assert back.decisions.equals(of_run.decisions)
    assert back.meta == of_run.meta
    (tmp_path / "signals.parquet").write_bytes((tmp_path / "signals.parquet").read_bytes()[:-1])
    with pytest.raises(TraceError, match="SHA-256"):
        trace.load(tmp_path)
    trace.save(of_run, tmp_path / "other")
    (tmp_path / "other" / "decisions.parquet").unlink()
    with pytest.raises(TraceError, match=r"other/decisions\.parquet: No such file or directory"):
        trace.load(tmp_path / "other")
    with pytest.raises(TraceError, match=r"nowhere/meta\.json: No such file or directory"):
        trace.load(tmp_path / "nowhere")
    (tmp_path / "meta.json").write_text("[" * 100_000, encoding="utf-8")
    with pytest.raises(TraceError, match="not a readable trace"):
        trace.load(tmp_path)


@pytest.mark.parametrize(("period", "noise_period"), [(0.01, 0.05), (0.05, 0.01), (0.025, 0.05)])
def test_claims_do_not_depend_on_the_periods(case_a: Scenario, period: float, noise_period: float) -> None:
    """Periods that are not binary fractions give steps of 1e-17 s; event times may coincide with samples."""
    case_a.control.period_s, case_a.decision.noise_period_s = period, noise_period
    of_run = simulate(case_a, "d")
    assert {verdict.finding.status for verdict in verify(of_run)} == {"holds"}
    assert times(of_run, "trigger")[0] == pytest.approx(14.45, abs=0.1)


def test_case_b_refuses_the_wrong_intervention_and_accepts_the_right_one(run: Runs) -> None:
    """B1-B3, B5: the collision without a gatekeeper, and the timeline with one."""
    collision = next(event for event in run("case_b", "b").events if event["kind"] == "collision")
    assert np.linalg.norm(np.array(collision["position_m"][:2]) - [5.5, 5.8]) < 0.1
    assert MEASURES["execution_time"](run("case_b", "b"), "ugv1") == [pytest.approx(10.55)]
    for method in ("c", "d"):
        of_run = run("case_b", method)
        assert kinds(of_run, "ugv1") == ["trigger", "proposal", "refuse", "proposal", "accept", "release", "arrival"]
        assert times(of_run, "refuse")[0] == pytest.approx(10.6, abs=0.05)
        assert times(of_run, "accept")[0] == pytest.approx(13.1, abs=0.1)
        if method == "d":
            continue
        first = of_run.decisions.groupby("issued_s").first()
        gap = (first["refuse_throughout"] - first["accept_throughout"]).abs()
        assert (gap / first[["accept_throughout", "refuse_throughout"]].max(axis=1) > 0.05).all()  # no knife edge


def test_what_a_refusal_teaches_is_on_the_uavs_map_afterwards(run: Runs) -> None:
    """The detour accepted in case B keeps clear of the obstacle that the UAV did not know at first."""
    of_run = run("case_b", "c")
    accepted = times(of_run, "accept")[0]
    after = of_run.position("ugv1")[of_run.t > accepted]
    assert np.linalg.norm(after - [5.5, 5.8, 0.0], axis=1).min() >= 2.0 - 1e-9


def test_the_soft_gate_accepts_a_predicted_intrusion_and_avoidance_on_top_is_safe(run: Runs) -> None:
    accepted = run("soft_gate", "c").decisions.iloc[0]
    assert accepted["decision"] == "accept"
    assert accepted["predicted_clearance_m"] < -1.0
    safety = {name: verify(run("soft_gate", name))[0].finding for name in ("c", "d")}
    assert safety["c"].status == "refuted"
    assert safety["d"].status == "holds"


def test_a_uav_without_a_target_of_its_own_arrives_where_its_task_leads() -> None:
    """Two UGVs that are not side by side: the first thing that a new user writes."""
    ways = {"one": ([0.0, 0.0, 0.0], [6.0, 0.0, 0.0]), "two": ([0.0, 5.0, 0.0], [7.0, 6.0, 0.0])}
    scenario = Scenario(
        name="new", duration_s=12.0, runs={"a": Run("a")}, uav=Uav(start_m=[0.0, 2.0, 2.0]),
        ugvs={name: Ugv(start, end, Preset([start, end])) for name, (start, end) in ways.items()},
    )  # fmt: skip
    verdicts = {verdict.claim.id: verdict.finding.status for verdict in verify(simulate(scenario, "a"))}
    assert verdicts["LIVE-GOAL"] == "holds"
