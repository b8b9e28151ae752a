"""The checker's own decision variable against closed forms."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.check.run import Run
from airground_drake.check.scenario import Levels
from airground_drake.check.triggers import Variable, automaton, decision_variable, thr_quality

SPEED_M_S = 2.0


def passed(aside_m: float, slope_m_s: float, **more: Any) -> Run:
    """A preset passes a standing UGV at so many metres, in one segment of 10 s; the noise is linear in time."""

    def position_m(t_s: np.ndarray) -> np.ndarray:
        return np.column_stack([SPEED_M_S * (t_s - 5.0), np.zeros_like(t_s), np.zeros_like(t_s)])

    t = np.array([0.0, 10.0])
    preset = SimpleNamespace(corner_s=t, position_m=position_m)
    run = SimpleNamespace(
        t_s=t, presets={"ugv1": preset}, position_m={"ugv1": np.tile([0.0, aside_m, 0.0], (2, 1))},
        column={"ugv1.noise_m": slope_m_s * t}.__getitem__, ugvs=["ugv1"], **more,
    )  # fmt: skip
    return cast("Run", cast("Any", run))


def passing(aside_m: float, slope_m_s: float) -> Variable:
    """X of such a run. With v = 2 m/s: x = sqrt(c^2 + v^2 (t - 5)^2) + m t."""
    return decision_variable(passed(aside_m, slope_m_s), "ugv1")


@pytest.mark.parametrize("aside_m", [0.0, 0.3, 1.0])
def test_a_dip_within_one_segment_is_found(aside_m: float) -> None:
    x, level = passing(aside_m, 0.0), aside_m + 0.01
    before = np.sqrt(level**2 - aside_m**2) / SPEED_M_S
    assert x.reaches(level, 0.0, above=False) == pytest.approx(5.0 - before, abs=1e-9)
    assert x.reaches(level, 5.0, above=True) == pytest.approx(5.0 + before, abs=1e-9)
    assert x.reaches(aside_m - 1e-9, 0.0, above=False) is None


@given(aside_m=st.floats(1e-3, 5.0), slope_m_s=st.floats(-1.9, 1.9))
def test_the_least_value_of_a_segment_is_a_knot(aside_m: float, slope_m_s: float) -> None:
    x = passing(aside_m, slope_m_s)
    t = np.linspace(0.0, 10.0, 2001)
    sampled = np.hypot(aside_m, SPEED_M_S * (t - 5.0)) + slope_m_s * t
    assert x.x_m.min() <= sampled.min() + 1e-9
    assert x.x_m.min() >= sampled.min() - 0.01 * (SPEED_M_S + abs(slope_m_s))


def test_a_rest_ends_with_a_trigger_only_at_the_threshold() -> None:
    for last, due in ((0.99, ["trigger", "release", ""]), (1.0, ["trigger", "release", "", "trigger"])):
        t, x = np.array([0.0, 1.0, 2.0, 3.0, 9.0]), np.array([0.0, 1.5, 0.2, last, last])
        steps = automaton(Variable(t, np.pad(x[:, None], ((0, 0), (3, 0))), x), Levels(1.0, 0.5, 4.0))
        assert [step.event for step in steps] == due


@pytest.mark.parametrize(("dwell_s", "decisions"), [(5.0, 2), (20.0, 1)])
def test_no_excursion_is_missed_in_a_dwell_that_outlasts_the_run(dwell_s: float, decisions: int) -> None:
    """The error is 10 m at the trigger at once, least in the middle, and 10 m at the end."""
    times = {"trigger": np.array([0.0]), "release": np.array([4.9])}
    run = passed(0.1, 0.0, levels=Levels(1.0, 0.5, dwell_s), times_s=lambda _, kind: times[kind])
    assert thr_quality(run).exercised == (decisions, decisions)
