"""Runs by the compiled loop: the same traces as Drake's, bit by bit, and what is left to Drake."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground_drake.base.errors import SimulationError, UnknownNameError
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.trigger import excursion
from airground_drake.model.trigger.excursion import Corners
from airground_drake.report.difference import first_difference
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch import noise
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.simulation import Recorder, simulate
from airground_drake.sim.trace import Trace
from airground_drake.study.testing.strategies import scenarios
from airground_drake.uav.planner import Planner
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers


def differences(scenario: Scenario, run: str, seeds: range = range(1)) -> list[object]:
    """The first difference of each seed's traces by Drake and by the loop, which are built once."""
    drake, loop = Recorder(scenario, run), Batch(scenario, run)
    pairs = [(drake.simulate(seed), loop.simulate(seed)) for seed in seeds]
    return [found for pair in pairs if (found := first_difference(*pair)) is not None]


@pytest.mark.parametrize("run", ["c", "d"])
def test_a_run_is_drakes_bit_by_bit(run: str) -> None:
    """All tables, events and parameters; proposals, answers and a release are among them."""
    short = load("case_a", ["duration_s=17.33", "reproduction=[]"])  # no multiple of any period
    assert differences(short, run) == []


def test_a_log_that_is_full_grows() -> None:
    batch = Batch(load("minimal", ["duration_s=2.0"]), "a")
    whole, batch.rows = batch.simulate(), 7
    assert first_difference(batch.simulate(), whole) is None


ODD = {
    "bare and noisy": ["decision.trigger=bare", "decision.noise_m_sqrt_s=0.5"],
    "leak": ["decision.leak_1_s=0.3", "decision.noise_period_s=0.01"],
    "periods that are multiples up to rounding": ["gatekeeper.period_s=0.15", "intervention.period_s=0.3"],
    "appears and goes": ["obstacles.obstacle_1.appears_s=2.0", "obstacles.obstacle_2.disappears_s=9.0"],
    "moves": ["obstacles.obstacle_3={moves: {waypoints_m: [[12, 3, 0], [12, 9, 0]], speed_m_s: 0.4}}"],
}


def test_bodies_that_are_late() -> None:
    """Lags, and a delay before one."""
    assert differences(load("lagging", ["duration_s=9.77"]), "d", range(2)) == []


@pytest.mark.slow
@pytest.mark.parametrize("changes", ODD.values(), ids=ODD)
def test_odd_settings(changes: list[str]) -> None:
    assert differences(load("case_a", ["reproduction=[]", *changes]), "d") == []


def sleepless(scenario: Scenario, run: str) -> Trace:
    with pytest.MonkeyPatch.context() as patch:
        for kind in (Planner, Gatekeepers, OutcomeGatekeepers):
            patch.setattr(kind, "asleep_until", lambda *_: -np.inf)
        return simulate(scenario, run)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["case_a", "noisy_link", "lab", "two_uavs"])
def test_nobody_sleeps_too_long(name: str, run: Callable[[str, str], Trace]) -> None:
    assert first_difference(sleepless(load(name), "d"), run(name, "d")) is None


@pytest.mark.slow
@given(scenarios())
@settings(max_examples=15)
def test_drawn_scenarios_by_drake_by_the_loop_and_with_nobody_asleep(scenario: Scenario) -> None:
    for run in scenario.runs:
        drakes = simulate(scenario, run)
        assert first_difference(Batch(scenario, run).simulate(), drakes) is None
        assert first_difference(sleepless(scenario, run), drakes) is None


@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 40))
@settings(max_examples=20)
def test_the_noise_is_drakes(seed: int, count: int, sets: int) -> None:
    assert np.array_equal(noise._made(seed, count, sets), noise._of_drake(seed, count, sets))


def test_with_another_standard_library_drake_draws_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(noise, "_made", lambda seed, count, sets: np.zeros((sets, count)))
    noise._is_drakes.cache_clear()
    try:
        assert noise.gaussians(3, 2, 5).any()
    finally:
        noise._is_drakes.cache_clear()


POINT = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))


@given(st.lists(POINT, min_size=2, max_size=5, unique=True), st.lists(POINT, min_size=2, max_size=4, unique=True))
def test_a_step_over_corners_misses_nothing(
    first: list[tuple[float, float]], second: list[tuple[float, float]]
) -> None:
    """Two robots stand still while their references go round corners; beside many places in between."""
    presets = [
        Motion(np.linspace(0.2, 0.7, len(way)), np.column_stack([way, np.zeros(len(way))])) for way in (first, second)
    ]
    times = np.linspace(0.0, 1.0, 501)
    errors = np.stack([preset.sample(times) for preset in presets], axis=1)
    signals = [
        np.concatenate([[t], np.column_stack([error, np.zeros(2), np.linalg.norm(error, axis=1)]).ravel()])
        for t, error in ((0.0, errors[0]), (1.0, errors[-1]))
    ]
    found = excursion.ranges(*signals, Corners.of(presets)).reshape(2, 2)
    seen = np.linalg.norm(errors, axis=2)
    assert (found[0] <= seen.min(axis=0) + 1e-12).all()
    assert (found[0] >= seen.min(axis=0) - 0.2).all()
    assert (found[1] >= seen.max(axis=0) - 1e-12).all()
    assert (found[1] <= seen.max(axis=0) + 0.2).all()


def test_what_is_left_to_drake(capsys: pytest.CaptureFixture[str]) -> None:
    scenario = load("minimal", ["duration_s=1.0"])
    assert first_difference(*(simulate(scenario, "a", engine="batch", speed=speed) for speed in (0.0, 1e3))) is None
    assert capsys.readouterr().err.endswith("it has a decision block of your own, observers or a speed\n")
    with pytest.raises(LeftToDrakeError, match="by the clock"):
        Batch(load("case_a", ["gatekeeper.budget=wall_clock"]), "c")


def test_an_engine_that_does_not_exist_is_named() -> None:
    with pytest.raises(UnknownNameError, match="unknown engine 'fast'; allowed: drake, batch"):
        simulate(load("minimal"), "a", engine="fast")  # type: ignore[arg-type]


def test_errors_are_in_drakes_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lost_route.py").write_text(
        "class Route:\n    def solve(self, problem, budget):\n        raise KeyError('lost')\n", encoding="utf-8"
    )
    data = resolved(
        load("case_a", ["duration_s=4.0", "reproduction=[]", "decision.threshold.zeta_m=0.5", "decision.release_m=0.2"])
    )
    monkeypatch.syspath_prepend(tmp_path)
    data["gatekeeper"]["route"] = "lost_route:Route"
    scenario = from_data(data, "own")
    told = []
    for engine in ("drake", "batch"):
        with pytest.raises(SimulationError) as raised:
            simulate(scenario, "c", engine=engine)  # type: ignore[arg-type]
        told.append(str(raised.value))
    assert told[0] == told[1]
