"""Honest runs of random scenarios: no disagreement, no error. `benchmarks/random_scenarios.py` tries hundreds."""

import contextlib
from pathlib import Path
from typing import Any

import pytest
from random_scenarios import draw, tried

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.load import from_data, load
from airground_drake.scenario.schema import Scenario

pytestmark = pytest.mark.slow

AT_ONCE = {"threshold": {"rule": "fixed", "zeta_m": 0.01}, "release_m": 0.0105}
DRIFT = {"c1_1_s": 0.5, "c2": 1.0, "drift_m_s": 6.05, "noise_m_sqrt_s": 1.0}
KINDS: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "as_drawn": ("b", {}),
    "nothing_triggers": ("d", {"decision": {"threshold": {"rule": "fixed", "zeta_m": 1e3}}}),
    "triggers_at_once": ("d", {"decision": AT_ONCE}),
    "bare": ("b", {"decision": {**AT_ONCE, "trigger": "bare", "release_m": 0.005}}),
    "bayes": ("c", {"decision": {"threshold": {"rule": "bayes", **DRIFT}, "release_m": 0.01}}),
    "printed": ("d", {"decision": {"threshold": {"rule": "printed", **DRIFT}, "release_m": 0.01}}),
    "reversals": ("c", {"decision": AT_ONCE, "gatekeeper": {"switching_margin": 0.0, "min_dwell_s": 0.3}}),
}
"""A method, and changes of what is drawn."""


def drawn(method: str, changes: dict[str, dict[str, Any]], periods: int, first: int) -> Scenario:
    for number in range(first, first + 100):
        data = draw(number)
        data["duration_s"] = min(12.0, periods * data["control"]["period_s"])
        data["runs"] = {method: {"method": method}}
        for part, values in changes.items():
            data[part] |= values
        with contextlib.suppress(ScenarioError):
            if len(data["ugvs"]) <= 4:
                return from_data(data, f"random {number}")
    raise AssertionError("no valid one")


@pytest.mark.parametrize("kind", KINDS)
def test_the_checker_agrees_with_honest_runs(kind: str) -> None:
    assert tried(drawn(*KINDS[kind], 40, 1000 * [*KINDS].index(kind)))[2] == []


def test_the_checker_agrees_with_a_run_of_one_period() -> None:
    assert tried(drawn("c", {"decision": AT_ONCE}, 1, 77))[2] == []


DRAWN = {
    "steered_point_within_reach": (20089, 6),
    "bent_ways_that_overlap": (20051, 6),  # in contact in many periods: the checker once did not end within its limit
    "unicycles_under_b": (39, 6),
    "every_plant_under_c": (51, 6),
    "wheels_and_delay_under_d": (66, 6),
    "nineteen_under_c": (8, 30),
}
"""Random scenarios by number and most UGVs; something is proposed, but for the first two."""


@pytest.mark.parametrize("name", DRAWN)
def test_the_checker_agrees_where_bodies_are_apart_from_their_steered_points(name: str) -> None:
    number, most_ugvs = DRAWN[name]
    trace, _, wrong = tried(from_data(draw(number, most_ugvs), "drawn"))
    assert wrong == []
    assert len(trace.proposals) > 0 or number > 20000


@pytest.mark.parametrize("name", "bcd")
def test_a_crowd(name: str) -> None:
    """Everything at once: most mutants of `benchmarks/mutation` are noticed here."""
    scenario = load(str(Path(__file__).parents[1] / "builders" / "crowd.yaml"))
    scenario.runs = {name: scenario.runs[name]}
    trace, _, wrong = tried(scenario)
    assert wrong == []
    assert len(trace.proposals)


def test_points_are_listed_as_the_controllers_list_them() -> None:
    """Recursion (5) depends on what comes first: here an obstacle and a robot, both in the way of a UGV."""
    data = draw(366) | {"runs": {"a": {"method": "a", "composition": "recursion_listed"}}}
    data["duration_s"] = 60 * data["control"]["period_s"]
    assert tried(from_data(data, "a crowd"))[2] == []


def test_a_proposal_at_the_very_beginning_is_not_one_too_many() -> None:
    """The UAV plans at t = 0, too: a run that is shorter than its period has one instant, not none."""
    at_once = {
        "ugvs.ugv1.start_m": [0.0, -5.0, 0.0],
        "intervention.policies": [{"name": "hostile", "parameters": {"speed_m_s": 3.0}}],
        "intervention.period_s": 0.3,
        "duration_s": 0.2,
        "runs": {"d": {"method": "d"}},
    }
    trace, _, wrong = tried(load("minimal", at_once))
    assert wrong == []
    assert len(trace.proposals) == 1
