"""A small scenario, its traces and their figures."""

import pytest
from report.cases import make_scenario, make_traces

from airground_drake.report.figures import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    return make_scenario()


@pytest.fixture(scope="session")
def traces(scenario: Scenario) -> dict[str, Trace]:
    return make_traces(scenario)


@pytest.fixture(scope="session")
def drawn(scenario: Scenario, traces: dict[str, Trace]) -> list[Figure]:
    return draw.draw(scenario, traces)
