"""A small scenario, its traces and their figures; a real browser."""

import os
import shutil
from collections.abc import Iterator
from typing import Any

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


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None and not os.environ.get("CI"):
        pytest.skip("no Chromium on the path: apt-get install chromium")
    sandbox = [] if os.getuid() else ["--no-sandbox"]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=chromium, args=[*sandbox, "--use-gl=angle", "--use-angle=swiftshader"]
        )
        yield started
        started.close()
