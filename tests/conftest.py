"""Session-scoped simulations: every test that needs a long run shares these."""

from __future__ import annotations

import os
from collections.abc import Callable

import pytest
from hypothesis import settings

from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.simulation import simulate
from airground_drake.trace import Trace

settings.register_profile("airground", deadline=None)  # the first call compiles; nothing here asserts on time
settings.load_profile("airground")


@pytest.fixture(scope="session", autouse=True)
def _cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Findings are kept in a folder of the session, not in the user's."""
    os.environ["AIRGROUND_DRAKE_CACHE"] = str(tmp_path_factory.mktemp("kept"))


@pytest.fixture(scope="session")
def run() -> Callable[[str, str], Trace]:
    """`run(scenario, name)`: one simulation of a shipped scenario, made once per session."""
    made: dict[tuple[str, str], Trace] = {}

    def get(scenario: str, name: str) -> Trace:
        if (scenario, name) not in made:
            made[scenario, name] = simulate(load(scenario)[0], name)
        return made[scenario, name]

    return get


@pytest.fixture
def case_a() -> Scenario:
    """A fresh copy of the shipped scenario, to be changed at will."""
    return load("case_a")[0]
