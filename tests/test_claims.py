"""Every claim on a trace: what it must pass, and the mutants that it must not."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from synthetic import Drive, case_a, changed, lone, moved, simulate, with_meta, with_scenario, with_signals

from airground_drake.errors import TraceError
from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.schema import Decision, Obstacle, Preset, Threshold
from airground_drake.trace import Trace, load, save
from airground_drake.verify import TRACE_CLAIMS, Finding, TraceClaim, verify
from airground_drake.verify.engines.segments import NormSignal, closest_approach, corner_times, interpolate, travelled

CLAIMS = {claim.id: claim for claim in TRACE_CLAIMS}
GATE = {"GATE-OPT", "GATE-SUR", "GATE-FEAS"}
"""Claims about recorded problems, which the synthetic runs do not have: see tests/test_gatekeeping.py."""
STILL = Preset([[0.0, 0.0, 0.0]], 1.0)


@cache
def run_of(method: str) -> Trace:
    """One run of the synthetic case A by each method."""
    return simulate(case_a(), method)


@cache
def chattering() -> Trace:
    """A bare trigger whose decision variable hovers at the threshold: many triggers."""
    decision = Decision(trigger="bare", noise_m_sqrt_s=0.3, min_inter_event_s=0.5)
    return simulate(lone([3.01, 0.0, 0.0], [3.0, 0.0, 0.0], STILL, 3.0, decision=decision), drive=at_rest, seed=28)


def at_rest(t: float) -> list[list[float]]:
    """Nobody moves."""
    return [[0.0] * 3, [0.0] * 3]


def there_and_back(t: float) -> list[list[float]]:
    """Out beyond the threshold, back below the release level, out again and home."""
    speed = 2.0 if t < 2.0 or 3.5 <= t < 6.0 else -2.0 if t < 8.9 else 0.0
    return [[speed, 0.0, 0.0], [0.0] * 3]


def refractory(noise: float = 0.0) -> Trace:
    """Triggers at 1.5 s; released at 3.25 s; above again before the dwell of 4 s is over: triggers at 5.5 s."""
    decision = Decision(min_inter_event_s=4.0, noise_m_sqrt_s=noise)
    return simulate(lone([0.0] * 3, [0.2, 0.0, 0.0], STILL, 10.0, decision=decision), drive=there_and_back)


def passing_by(offset: float) -> Trace:
    """A UGV passes an obstacle at 2 m + offset, closest in the middle between two rows."""
    scenario = lone(
        [-0.5125, 2.0 + offset, 0.0], [0.4875, 2.0 + offset, 0.0], STILL, 1.0, obstacles={"o": Obstacle([0.0] * 3)}
    )
    return simulate(scenario, drive=lambda t: [[1.0, 0.0, 0.0], [0.0] * 3])


def judge(claim: str, trace: Trace) -> Finding:
    """One claim on one trace."""
    return CLAIMS[claim].judge(trace)


def counterexample(claim: str, trace: Trace) -> dict[str, Any]:
    """That of a claim which must be refuted; where there is a margin, it is negative."""
    finding = judge(claim, trace)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.margin is None or finding.margin < 0.0
    return finding.counterexample


# --- passing runs ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", "abcd")
def test_every_claim_holds_on_a_valid_run(method: str) -> None:
    verdicts = {verdict.claim.id: verdict for verdict in verify(run_of(method))}
    assert {name: v.finding.status for name, v in verdicts.items()} == {
        name: "not_run" if name in GATE else "holds" for name in verdicts
    }
    left_out = {"a": {"GATE-TIME", "COMM", *GATE}, "b": {"GATE-TIME", *GATE}, "c": set(), "d": set()}[method]
    assert set(verdicts) == set(CLAIMS) - left_out
    assert all(json.dumps(v.to_json(), allow_nan=False) for v in verdicts.values())


def test_verdicts_survive_saving(tmp_path: Any) -> None:
    save(run_of("d"), tmp_path)
    assert [v.finding for v in verify(load(tmp_path))] == [v.finding for v in verify(run_of("d"))]


def test_every_claim_says_what_it_is() -> None:
    for claim in TRACE_CLAIMS:
        for name in ("statement", "formula", "method", "equations", "does_not_establish"):
            assert getattr(claim, name).strip(), (claim.id, name)
        assert claim.assumptions
        assert all(claim.assumptions)


def test_expected_status_is_the_scenarios() -> None:
    trace = with_scenario(run_of("a"), runs__a__expected={"SAFE-TRACE": "refuted"})
    assert {v.claim.id for v in verify(trace) if not v.as_expected} == {"SAFE-TRACE"}


# --- broken traces: never a pass, whatever the claim -----------------------------------------------------------------


def set_nan(column: str) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals.loc[300, column] = np.nan

    return lambda trace: with_signals(trace, edit)


def dropped(column: str) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: signals.drop(columns=column))


def bumped(column: str, by: float, row: int = 500) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals[column] += by * (signals.index == row)

    return lambda trace: with_signals(trace, edit)


def rows(keep: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: keep(signals).reset_index(drop=True))


BROKEN: dict[str, Callable[[Trace], Trace]] = {
    "NaN in a position": set_nan("ugv1.x_m"),
    "NaN in a command": set_nan("uav.vz_m_s"),
    "no column of positions": dropped("ugv2.y_m"),
    "no column of commands": dropped("ugv2.vy_m_s"),
    "one command altered": bumped("ugv1.vx_m_s", 1e-4),
    "one position altered": bumped("uav.z_m", 1e-8),
    "truncated at the end": rows(lambda signals: signals.iloc[:-1]),
    "truncated at the start": rows(lambda signals: signals.iloc[1:]),
    "one row left out": rows(lambda signals: signals.drop(index=400)),
    "time runs backwards": rows(lambda signals: signals.iloc[[0, 2, 1, *range(3, len(signals))]]),
    "no rows": rows(lambda signals: signals.iloc[:0]),
    "a robot left out": lambda trace: with_meta(trace, robots=["ugv1", "uav"], ugvs=["ugv1"]),
    "no scenario": lambda trace: with_meta(trace, scenario={}),
    "another run": lambda trace: with_meta(trace, run="none"),
    "another method": lambda trace: with_meta(trace, method="b"),
}


@pytest.mark.parametrize("claim", CLAIMS)
@pytest.mark.parametrize("name", BROKEN)
def test_broken_traces_never_pass(claim: str, name: str) -> None:
    finding = judge(claim, BROKEN[name](run_of("d")))
    assert finding.status in ("refuted", "not_run") or (finding.status == "error" and finding.evidence["error"])


def test_checkers_that_fail_are_errors() -> None:
    class Failing(type(CLAIMS["COMM"])):  # type: ignore[misc]
        def check(self, trace: Trace) -> Finding:
            return self.finding(trace)

    def crash(trace: Trace) -> Finding:
        raise ZeroDivisionError("division")

    claim = Failing()
    for behaviour in (crash, lambda trace: Finding("holds", margin=float("nan")), lambda trace: None):
        claim.finding = behaviour
        assert claim.judge(run_of("d")).status == "error"
    assert TraceClaim.applies(claim, run_of("a"))


def test_half_a_run_can_refute_but_not_pass() -> None:
    cut = rows(lambda signals: signals[signals["t_s"] < 0.8])
    assert judge("SAFE-TRACE", cut(passing_by(-1e-3))).status == "refuted"
    assert judge("SAFE-TRACE", cut(passing_by(+1e-3))).status == "error"


# --- SAFE-TRACE -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("offset", "status"), [(-1e-6, "refuted"), (-2e-9, "refuted"), (-5e-10, "holds"), (1e-6, "holds")]
)
def test_safe_trace_sees_a_dip_between_two_rows(offset: float, status: str) -> None:
    trace = passing_by(offset)
    at_rows = np.linalg.norm(trace.position("ugv1"), axis=1).min()
    finding = judge("SAFE-TRACE", trace)
    assert at_rows > 2.0  # no row shows it
    assert finding.status == status
    assert finding.margin == pytest.approx(offset, abs=1e-12)
    assert finding.where["t_s"] == pytest.approx(0.5125, abs=1e-9)
    if status == "refuted":
        seen = counterexample("SAFE-TRACE", trace)
        np.testing.assert_allclose(seen["positions_m"]["ugv1"], [0.0, 2.0 + offset, 0.0], atol=1e-9)


@pytest.mark.parametrize("robot", ["ugv1", "ugv2", "uav"])
def test_safe_trace_sees_every_robot_in_every_pair(robot: str) -> None:
    trace = run_of("d")
    for entry in judge("SAFE-TRACE", trace).evidence["pairs"]:
        if robot not in (entry["first"], entry["second"]):
            continue
        other = entry["second"] if robot == entry["first"] else entry["first"]
        row = int(np.searchsorted(trace.t, 9.0))
        there = trace.scenario["obstacles"].get(other, {}).get("position_m")
        there = trace.position(other)[row] if there is None else np.array(there)
        offset = there + np.array([0.0, 0.0, entry["safe_distance_m"] - 1e-6]) - trace.position(robot)[row]
        finding = judge("SAFE-TRACE", moved(trace, robot, row, offset.tolist()))
        assert finding.status == "refuted", other


def test_safe_trace_has_every_pair_with_its_distance() -> None:
    pairs = judge("SAFE-TRACE", run_of("d")).evidence["pairs"]
    listed = {(entry["first"], entry["second"]): entry["safe_distance_m"] for entry in pairs}
    robots = {("ugv1", "ugv2"): 2.0, ("ugv1", "uav"): 1.0, ("ugv2", "uav"): 1.0}
    assert listed == robots | {(r, f"obstacle_{i}"): 2.0 for r in ("ugv1", "ugv2", "uav") for i in (1, 2, 3)}


def test_safe_trace_does_not_care_what_the_uav_knows() -> None:
    unknown = with_scenario(passing_by(-1e-6), obstacles__o__known_to_uav=False)
    assert judge("SAFE-TRACE", unknown).status == "refuted"


# --- SAFE-HYP ---------------------------------------------------------------------------------------------------------


def crowd(seed: int) -> Trace:
    """Robots near and inside each other's and an obstacle's safe distance, moving at random."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([-0.5, 2.0, 0.0], [3.0, 6.0, 0.0], (3, 3))
    start[2, 2] = 1.5
    starts = {f"{name}.start_m": s.tolist() for name, s in zip(("ugvs.ugv1", "ugvs.ugv2", "uav"), start, strict=True)}
    velocity = rng.normal(0.0, 1.5, (20, 3, 3)) * [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    scenario = case_a(starts | {"duration_s": 0.5})
    return simulate(scenario, drive=lambda t: velocity[round(t / 0.025)].tolist())


@pytest.mark.parametrize("seed", range(8))
def test_safe_hyp_margins_are_those_of_the_controllers_inequalities(seed: int) -> None:
    """The inequalities, written twice, in nsbc and for this claim, agree for every robot at every sample."""
    trace = crowd(seed)
    found = [w for w in judge("SAFE-HYP", trace).evidence["worst"] if w["hypothesis"] == "avoidance"]
    avoidance = Avoidance(gain=3.0, period=0.025, sensing_range=4.0)
    ticks = np.flatnonzero(np.abs(trace.t / 0.025 - np.round(trace.t / 0.025)) < 1e-6)[:-1]
    for robot in trace.robots:
        others = [r for r in trace.robots if r != robot]
        obstacles = [np.broadcast_to(o["position_m"], (len(ticks), 3)) for o in trace.scenario["obstacles"].values()]
        centre = np.stack([*obstacles, *(trace.position(r)[ticks] for r in others)], axis=1)
        apart = [1.0 if "uav" in (robot, r) else 2.0 for r in others]
        distance = np.tile([2.0] * 3 + apart, (len(ticks), 1))
        share = np.tile([1.0] * 3 + [0.5] * len(others), (len(ticks), 1))
        mobility = np.tile([1.0, 1.0, float(robot == "uav")], (len(ticks), 1))
        spaces = avoidance.half_spaces(trace.position(robot)[ticks], mobility, Surroundings(centre, distance, share))
        least = spaces.slack(trace.command(robot)[ticks + 1]).min(axis=1)
        (entry,) = [w for w in found if w["robot"] == robot]
        assert entry["margin"] == pytest.approx(least.min(), abs=1e-11)
        assert entry["t_s"] == trace.t[ticks][least.argmin()]


def crossing_the_hold(trace: Trace) -> Trace:
    """The event row gets a command of its own: the robot takes a detour inside one control period."""
    event = int(np.flatnonzero(trace.t == trace.events[0]["t_s"])[0])
    return moved(trace, "ugv2", event, [1e-7, 0.0, 0.0])


HYPOTHESES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "avoidance": ("avoidance", lambda trace: moved(trace, "ugv1", 100, [1e-6, 0.0, 0.0])),
    "zero-order hold": ("zero-order hold", crossing_the_hold),
    "gain": ("gain: A h <= 1", lambda trace: with_scenario(trace, control__avoidance_gain_1_s=40.1)),
    "sensing range": ("sensing range", lambda trace: with_scenario(trace, control__sensing_range_m=2.29)),
    "speed limit": ("speed limit", lambda trace: with_scenario(trace, ugvs__ugv1__max_speed_m_s=2.0)),
    "safe start": ("safe start", lambda trace: with_scenario(trace, safe_distance__ugv_m=2.001)),
    "planar": ("planar motion", lambda trace: moved(trace, "ugv2", 200, [0.0, 0.0, 1e-9])),
    "sampling": ("sampling", lambda trace: with_scenario(trace, control__period_s=0.0125)),
}


@pytest.mark.parametrize("name", HYPOTHESES)
def test_safe_hyp_names_the_broken_hypothesis(name: str) -> None:
    hypothesis, mutate = HYPOTHESES[name]
    base = run_of("a") if name != "avoidance" else stopped_at_the_limit()
    assert judge("SAFE-HYP", base).status == "holds"
    assert counterexample("SAFE-HYP", mutate(base))["hypothesis"] == hypothesis


def stopped_at_the_limit() -> Trace:
    """A UGV that stands at the safe distance of an obstacle, so that any step towards it is one too many."""
    scenario = lone([-2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], STILL, 3.0, obstacles={"o": Obstacle([0.0] * 3)})
    return simulate(scenario, drive=at_rest)


def test_safe_hyp_refuted_although_the_distance_was_kept() -> None:
    assert counterexample("SAFE-HYP", passing_by(1e-6))["other"] == "o"
    assert judge("SAFE-TRACE", passing_by(1e-6)).status == "holds"


def test_safe_hyp_a_missing_sample_is_seen_even_if_the_motion_is_straight() -> None:
    mutant = rows(lambda signals: signals.drop(index=50))(stopped_at_the_limit())
    assert counterexample("SAFE-HYP", mutant)["hypothesis"] == "sampling"
    assert "no row" in judge("SAFE-TRACE", mutant).evidence["error"]


@pytest.mark.parametrize("gap", [0.0, 1e-17, 5e-10])
def test_rows_of_one_instant_are_merged(gap: float) -> None:
    """Around control samples, a row before with the old and a row after with the new command."""

    def split(signals: pd.DataFrame) -> pd.DataFrame:
        pieces, done = [], 0
        for k in range(100, 700, 20):
            row = signals.iloc[[k]]
            before, after = shifted(row, -gap, row.iloc[0]), shifted(row, gap, signals.iloc[k + 1])
            pieces += [signals.iloc[done:k], before, row, after]
            done = k + 1
        return pd.concat([*pieces, signals.iloc[done:]], ignore_index=True)

    def shifted(row: pd.DataFrame, dt: float, commanded: Any) -> pd.DataFrame:
        row = row.assign(t_s=row["t_s"] + dt)
        for name in (f"{robot}.{{}}{axis}_m" for robot in ("ugv1", "ugv2", "uav") for axis in "xyz"):
            velocity = float(commanded[name.format("v") + "_s"])
            row = row.assign(
                **{name.format(""): row[name.format("")] + dt * velocity, name.format("v") + "_s": velocity}
            )
        return row

    verdicts = verify(with_signals(run_of("d"), split))
    assert {v.claim.id for v in verdicts if v.finding.status != "holds"} == GATE


# --- ZENO-TRACE -------------------------------------------------------------------------------------------------------


def test_zeno_refutes_a_bare_trigger_that_chatters() -> None:
    evidence = judge("ZENO-TRACE", chattering()).evidence
    assert evidence["triggers"]["ugv1"]["count"] > evidence["most_triggers_possible"]
    assert 0.0 < counterexample("ZENO-TRACE", chattering())["gap_s"] < 0.5
    assert judge("THR-TRIG", chattering()).status == "holds"


@pytest.mark.parametrize(("bound", "status"), [(4.0, "holds"), (4.0 + 5e-10, "holds"), (4.0 + 2e-9, "refuted")])
def test_zeno_compares_with_the_bound(bound: float, status: str) -> None:
    finding = judge("ZENO-TRACE", with_scenario(refractory(), decision__min_inter_event_s=bound))
    assert finding.status == status
    assert finding.margin == pytest.approx(4.0 - bound, abs=1e-12)


def test_zeno_without_a_gap_says_so() -> None:
    finding = judge("ZENO-TRACE", run_of("d"))
    assert (finding.status, finding.margin) == ("holds", None)
    assert finding.evidence["triggers"]["ugv1"]["count"] == 1
    assert finding.evidence["reason"]
    assert judge("ZENO-TRACE", with_scenario(run_of("d"), decision__min_inter_event_s=0.0)).status == "not_run"


# --- THR-TRIG ---------------------------------------------------------------------------------------------------------


def edited_events(edit: Callable[[list[dict[str, Any]]], None], trace: Trace) -> Trace:
    events = [dict(event) for event in trace.events]
    edit(events)
    return with_meta(trace, events=events)


def first_of(events: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return next(event for event in events if event["kind"] == kind)


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
    "decision variable": bumped("ugv1.decision_variable_m", 2e-6),
    "noise": bumped("ugv1.noise_m", 2e-6),
    "mode": bumped("ugv1.mode", 1.0),
    "count of triggers": bumped("ugv1.triggers", 1.0),
    "time of the trigger": bumped("ugv1.triggered_at_s", 1e-3),
    "time of the release": bumped("ugv1.released_at_s", 1e-3),
    "release level": lambda trace: with_scenario(trace, decision__release_m=1.4),
    "speed of the preset": lambda trace: with_scenario(trace, ugvs__ugv1__preset__speed_m_s=1.001),
    "bare": lambda trace: with_scenario(trace, decision__trigger="bare"),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_wrong_signals_are_refuted(name: str) -> None:
    assert judge("THR-TRIG", SIGNALS[name](run_of("d"))).status == "refuted"


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
    unseen = simulate(changed(trace.scenario, {"decision.threshold.zeta_m": 99.0}), drive=at_rest)  # no event rows
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


# --- LIVE-GOAL --------------------------------------------------------------------------------------------------------


def stall(y: float) -> dict[str, list[float]]:
    return {"ugv1": [3.35, y, 0.0]}


OUTCOMES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "UGV off target": ("d", lambda trace: with_scenario(trace, ugvs__ugv2__target_m=[-1.3, 13.2, 0.0])),
    "UAV off target": ("d", lambda trace: with_scenario(trace, uav__target_m=[1.0, 13.0, 2.2])),
    "late jump off target": ("d", lambda trace: moved(trace, "ugv1", len(trace.t) - 1, [0.0, 0.11, 0.0])),
    "no stall where one is declared": ("d", lambda trace: with_scenario(trace, runs__d__stalls_m=stall(5.1))),
    "arrives where a stall is declared": ("d", lambda trace: with_scenario(trace, runs__d__stalls_m=stall(12.95))),
    "stalls elsewhere": ("a", lambda trace: with_scenario(trace, runs__a__stalls_m=stall(5.3))),
    "stalls undeclared": ("a", lambda trace: with_scenario(trace, runs__a__stalls_m={})),
    "still moving": ("a", lambda trace: moved(trace, "ugv1", len(trace.t) - 20, [0.0, -2e-3, 0.0])),
    "UAV not over the centroid": ("a", lambda trace: moved(trace, "uav", len(trace.t) - 1, [0.2, 0.0, 0.0])),
}  # fmt: skip


@pytest.mark.parametrize("name", OUTCOMES)
def test_live_goal_mutants(name: str) -> None:
    method, mutate = OUTCOMES[name]
    assert counterexample("LIVE-GOAL", mutate(run_of(method)))["margin_m"] < 0.0


def test_live_goal_unknown_stall_is_an_error() -> None:
    assert judge("LIVE-GOAL", with_scenario(run_of("a"), runs__a__stalls_m={"ugv9": [0.0] * 3})).status == "error"


# --- COMM -------------------------------------------------------------------------------------------------------------


def more_decisions(trace: Trace, **columns: Any) -> Trace:
    """The last decision once more, with some columns changed."""
    extra = trace.decisions.iloc[[-1]].assign(**columns)
    return replace(trace, decisions=pd.concat([trace.decisions, extra], ignore_index=True))


def proposals(trace: Trace, *times: float, robot: str = "ugv1") -> Trace:
    template = first_of(trace.events, "proposal")
    return with_meta(trace, events=[*trace.events, *({**template, "t_s": t, "robot": robot} for t in times)])


def without(trace: Trace, kind: str) -> Trace:
    return with_meta(trace, events=[event for event in trace.events if event["kind"] != kind])


def supervising(signals: pd.DataFrame) -> pd.DataFrame:
    return signals.assign(**{"ugv1.mode": 0.0})


MESSAGES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "decision after the allowance": ("refuted", lambda trace: more_decisions(trace, t_s=10.95)),
    "decision before the trigger": ("refuted", lambda trace: more_decisions(trace, t_s=8.1)),
    "decision for the other UGV": ("error", lambda trace: more_decisions(trace, robot="ugv2")),
    "decision for nobody": ("error", lambda trace: more_decisions(trace, robot="ugv9")),
    "decision at no time": ("error", lambda trace: more_decisions(trace, t_s=np.nan)),
    "decision on no proposal": ("error", lambda trace: more_decisions(trace, issued_s=9.0)),
    "proposal while supervising": ("refuted", lambda trace: proposals(trace, 5.0)),
    "proposal to the other UGV": ("refuted", lambda trace: proposals(trace, 9.0, robot="ugv2")),
    "proposal to the UAV": ("error", lambda trace: proposals(trace, 9.0, robot="uav")),
    "more proposals than always-on": ("refuted", lambda trace: proposals(trace, *np.linspace(8.2, 10.7, 721))),
    "no proposals": ("error", lambda trace: without(trace, "proposal")),
    "no decisions": ("not_run", lambda trace: replace(trace, decisions=trace.decisions.iloc[:0])),
    "nothing": ("not_run", lambda trace: with_meta(replace(trace, decisions=trace.decisions.iloc[:0]), events=[])),
    "no column": ("error", lambda trace: replace(trace, decisions=trace.decisions.drop(columns="t_s"))),
    "never intervening": ("refuted", lambda trace: with_signals(trace, supervising)),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_comm_mutants(name: str) -> None:
    status, mutate = MESSAGES[name]
    assert judge("COMM", mutate(run_of("d"))).status == status


def test_comm_allows_the_latency_of_a_withdrawal() -> None:
    released = next(event["t_s"] for event in run_of("d").events if event["kind"] == "release")
    assert judge("COMM", more_decisions(run_of("d"), t_s=released + 0.1)).status == "holds"
    assert judge("COMM", more_decisions(run_of("d"), t_s=released + 0.1001)).status == "refuted"


def test_comm_counts() -> None:
    finding = judge("COMM", run_of("d"))
    assert finding.evidence["spent"] == {"proposal": 1, "decision": len(run_of("d").decisions)}
    assert finding.evidence["always_on"] == {"proposal": 720, "decision": 720}
    assert finding.margin == pytest.approx(1.0 - len(run_of("d").decisions) / 720)


# --- GATE-TIME --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("times", "status"),
    [
        ([0.01] * 200, "holds"),
        ([0.01] * 199 + [0.2], "holds"),
        ([0.01] * 197 + [0.2] * 3, "refuted"),
        ([0.05] * 60, "refuted"),
        ([0.01] * 59 + [0.06], "refuted"),
        ([], "not_run"),
        ([0.01] * 10, "error"),
        ([0.01] * 59 + [float("nan")], "error"),
        ([0.01] * 59 + [-1.0], "error"),
    ],
)
def test_gate_time(times: list[float], status: str) -> None:
    assert judge("GATE-TIME", replace(run_of("d"), timings={"decision_times_s": times})).status == status


def test_gate_time_without_data_is_not_run() -> None:
    assert judge("GATE-TIME", replace(run_of("d"), timings={})).status == "not_run"
    assert judge("GATE-TIME", replace(run_of("d"), decisions=run_of("d").decisions.iloc[:0])).status == "not_run"


# --- geometry ---------------------------------------------------------------------------------------------------------

COORDINATES = st.floats(-10.0, 10.0, allow_subnormal=False)
PATHS = st.integers(2, 6).flatmap(lambda n: st.tuples(*[arrays(np.float64, (n, 3), elements=COORDINATES)] * 2))


@settings(max_examples=150, deadline=None)
@given(PATHS, st.booleans())
def test_closest_approach_against_sampling(paths: tuple[np.ndarray, np.ndarray], at_rest: bool) -> None:
    first, second = paths[0], paths[1][0] if at_rest else paths[1]
    t = np.cumsum(np.linspace(0.1, 0.5, len(first)))
    found = closest_approach(t, first, second)
    fine = np.unique(np.concatenate([np.linspace(a, b, 101) for a, b in pairwise(t)]))
    there = second if at_rest else interpolate(t, second, fine)
    sampled = np.linalg.norm(interpolate(t, first, fine) - there, axis=1).min()
    longest = np.linalg.norm(np.diff(first - second, axis=0), axis=1).max() / 100.0
    assert sampled - longest / 2.0 - 1e-9 <= found.distance_m <= sampled + 1e-9
    assert t[found.row - 1] <= found.t_s <= t[found.row]
    at = interpolate(t, first, found.t_s) - (second if at_rest else interpolate(t, second, found.t_s))
    assert np.linalg.norm(at) == pytest.approx(found.distance_m, abs=1e-9)


def test_closest_approach_by_hand() -> None:
    t = np.array([0.0, 1.0, 3.0])
    first = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    second = np.array([[4.0, 1.0, 0.0], [4.0, 1.0, 0.0], [2.0, 1.0, 0.0]])  # meet at x = 3, t = 2
    found = closest_approach(t, first, second)
    assert (found.distance_m, found.t_s, found.row) == (1.0, 2.0, 2)
    assert closest_approach(t[:1], first[:1], second[0]).row == 0
    assert closest_approach(t, first * 0.0, second[0]).t_s == 0.0


def test_travelled_holds_its_last_point() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    np.testing.assert_allclose(corner_times(corners, 0.5), [4.0, 6.0])
    np.testing.assert_allclose(travelled(corners, 0.5, np.array([2.0, 5.0, 9.0]))[:, :2], [[1, 0], [2, 0.5], [2, 1]])
    assert corner_times(corners[:1], 0.5).size == corner_times(corners, 0.0).size == 0


@settings(max_examples=100, deadline=None)
@given(arrays(np.float64, (4, 4), elements=st.floats(-2.0, 2.0, allow_subnormal=False)), st.floats(-1.0, 3.0))
def test_norm_signal_against_sampling(parts: np.ndarray, level: float) -> None:
    t = np.array([0.0, 0.3, 1.0, 1.2])
    x = NormSignal.of(t, parts)
    fine = np.linspace(0.0, 1.2, 2401)
    sampled = np.linalg.norm(interpolate(t, parts[:, :3], fine), axis=1) + np.interp(fine, t, parts[:, 3])
    np.testing.assert_allclose(x.at(fine), sampled, atol=1e-9)
    for a, b in pairwise(x.t):  # monotone between knots
        steps = np.diff(x.at(np.linspace(a, b, 20)))
        assert (steps >= -1e-9).all() or (steps <= 1e-9).all()
    for above in (True, False):
        begin = next((s for s, v in zip(fine, sampled, strict=True) if (v >= level) != above), None)
        if begin is None:
            continue
        reached = x.reaches(level, begin, above=above)
        beyond = fine[(fine > begin) & ((sampled >= level + 1e-9) if above else (sampled < level - 1e-9))]
        assert reached is not None or not beyond.size
        if reached is not None:
            assert float(x.at(reached)) == pytest.approx(level, abs=1e-8)
            assert not beyond.size or reached <= beyond[0] + 1e-9


def test_trace_errors_name_the_place() -> None:
    finding = judge("SAFE-TRACE", BROKEN["one command altered"](run_of("d")))
    assert TraceError.__name__ in finding.evidence["error"]
    assert "ugv1" in finding.evidence["error"]
