"""Systems of different periods tick at the same instants, to the last bit."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import ORACLES
from properties import examples
from sim.blocks.test_gatekeeper import Alternating

from airground_drake.base.registry import ROUTES
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.blocks.ticks import Ticks
from airground_drake.sim.simulation import simulate


@examples(50, fuzz=5000)
@given(st.integers(1, 40), st.floats(1e-3, 1.0), st.integers(0, 100_000))
def test_every_tick_is_one_of_the_controllers(every: int, control: float, k: int) -> None:
    ticks = Ticks(every * control, control)
    j = k * round(every * control / ticks.period)  # the k-th tick, counted in declared events
    instant = j * ticks.period
    assert ticks.due(instant)
    assert instant == (k * every) * control
    neighbours = [ticks.due((j + more) * ticks.period) for more in range(1, round(every * control / ticks.period))]
    assert not any(neighbours)


@pytest.mark.parametrize(("period", "control"), [(0.05, 0.025), (0.1, 0.1), (0.2, 0.1)])
def test_periods_that_are_exact_multiples_are_declared_as_they_are(period: float, control: float) -> None:
    assert Ticks(period, control).period == period


@pytest.mark.parametrize(
    ("period", "control"), [(0.05, 0.1), (0.25, 0.1), (0.0, 0.1), (-0.1, 0.1), (0.1, 0.0), (math.nan, 0.1)]
)
def test_other_periods_are_refused(period: float, control: float) -> None:
    with pytest.raises(ValueError, match="a multiple of the control period"):
        Ticks(period, control)


def test_answers_are_executed_from_the_sample_at_which_they_are_given(case_a: Scenario) -> None:
    """0.3 s is three times 0.1 s but for rounding: an answer of one instant was executed a sample late."""
    case_a.duration_s, case_a.control.period_s, case_a.decision.noise_period_s = 25.0, 0.1, 0.1
    case_a.intervention.period_s, case_a.gatekeeper.period_s = 0.1, 3 * 0.1
    case_a.gatekeeper.stages, case_a.gatekeeper.horizon_s, case_a.gatekeeper.min_dwell_s = 30, 3.0, 0.0
    case_a.control.formation_gain_1_s, case_a.control.sensing_range_m = 3.0, 6.0
    case_a.intervention.retry_s, case_a.gatekeeper.route = 0.0, "alternating"
    with ROUTES.adding("alternating", Alternating):
        trace = simulate(case_a, "c")
    assert set(trace.decisions["decision"]) == {"accept", "refuse"}, trace.decisions
    assert not [*ORACLES["commands"](trace), *ORACLES["protocol"](trace)]
