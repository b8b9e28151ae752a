"""Honest runs of random scenarios: no disagreement, no error. `benchmarks/random_scenarios.py` tries hundreds."""

from __future__ import annotations

from typing import Any

import pytest
from random_scenarios import draw, tried

from airground_drake.errors import ScenarioError
from airground_drake.scenarios.load import from_data
from airground_drake.scenarios.schema import Scenario

KINDS: dict[str, dict[str, dict[str, Any]]] = {
    "as_drawn": {},
    "nothing_triggers": {"decision": {"threshold": {"rule": "fixed", "zeta_m": 1e3}}},
    "triggers_at_once": {"decision": {"threshold": {"rule": "fixed", "zeta_m": 0.01}, "release_m": 0.005}},
    "bare": {"decision": {"trigger": "bare", "threshold": {"rule": "fixed", "zeta_m": 0.05}, "release_m": 0.0}},
    "bayes": {
        "decision": {
            "threshold": {"rule": "bayes", "c1_1_s": 0.5, "c2": 1.0, "drift_m_s": 6.05, "noise_m_sqrt_s": 1.0},
            "release_m": 0.0,
        }
    },
    "reversals": {
        "decision": {"threshold": {"rule": "fixed", "zeta_m": 0.01}, "release_m": 0.005},
        "gatekeeper": {"switching_margin": 0.0, "min_dwell_s": 0.3},
    },
    "small_budgets": {
        "decision": {"threshold": {"rule": "fixed", "zeta_m": 0.01}, "release_m": 0.005},
        "gatekeeper": {"budget_iterations": 1, "budget_nodes": 1},
    },
}
METHODS = dict(zip(KINDS, "bddbccc", strict=True))
"""Under which method each kind is tried here."""


def drawn(method: str, kind: str, periods: int, first: int) -> Scenario:
    """The first valid one."""
    for number in range(first, first + 100):
        data = draw(number)
        if len(data["ugvs"]) > 4:
            continue
        data["duration_s"] = min(12.0, periods * data["control"]["period_s"])
        data["runs"] = {method: {"method": method}}
        for part, values in KINDS[kind].items():
            data[part] |= values
        try:
            return from_data(data, f"random {number}")
        except ScenarioError:
            continue
    raise AssertionError("no valid one")


@pytest.mark.parametrize("kind", KINDS)
def test_the_checker_agrees_with_honest_runs(kind: str) -> None:
    assert tried(drawn(METHODS[kind], kind, 40, 1000 * [*KINDS].index(kind)))[2] == []


def test_the_checker_agrees_with_a_run_of_one_period() -> None:
    assert tried(drawn("c", "triggers_at_once", 1, 77))[2] == []


def test_points_are_listed_as_the_controllers_list_them() -> None:
    """Four UGVs, and an obstacle in the middle that all want to be at: recursion (5) depends on what comes first."""
    data = draw(3)
    ugv, middle = next(iter(data["ugvs"].values())), [0.65, 0.65, 0.0]
    starts = [[-1.0, -1.0, 0.0], [2.3, -1.0, 0.0], [-1.0, 2.3, 0.0], [2.3, 2.3, 0.0]]
    preset = {"speed_m_s": ugv["max_speed_m_s"]}
    data["obstacles"] = {"o0": {"position_m": middle}}
    data["safe_distance"] = {"obstacle_m": 1.0, "ugv_m": 1.5, "air_ground_m": 0.4}
    data["ugvs"] = {
        f"u{i}": {**ugv, "start_m": start, "preset": {**preset, "waypoints_m": [start, middle]}}
        for i, start in enumerate(starts)
    }
    data["control"]["sensing_range_m"] = 10.0 + 8.0 * ugv["max_speed_m_s"] * data["control"]["period_s"]
    data["duration_s"] = 60 * data["control"]["period_s"]
    data["runs"] = {"a": {"method": "a", "composition": "recursion_listed"}}
    assert tried(from_data(data, "a crowd"))[2] == []
