"""A small scene: case A in small, with a proposal that is refused and one that is accepted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.report.replay import scene as scenes
from airground_drake.report.replay.scene import Scene
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.tables import DECISION_COLUMNS, PROPOSAL_COLUMNS
from airground_drake.sim.trace import Trace


def with_proposals(trace: Trace, issued: list[float], decisions: list[tuple[float, float, str]]) -> Trace:
    """A trace with proposals to ugv1 issued at some times, s, and decisions (time, time of issue, decision)."""
    path = np.array([[3.4, 5.1, 0.0], [6.5, 5.0, 0.0], [6.5, 5.0, 0.0], [6.5, 9.0, 0.0]]).ravel()
    one = {"robot": "ugv1", "policy": "p", "positions_m": path, "cause": "ugv1"}
    rows = [one | {"number": k, "issued_s": at} for k, at in enumerate(issued)]
    found = [
        {"t_s": t, "robot": "ugv1", "number": issued.index(at), "issued_s": at, "decision": what}
        for t, at, what in decisions
    ]
    latest = pd.Series(np.searchsorted(issued, trace.samples["t_s"]) - 1.0)  # -1 before the first
    return replace(
        trace,
        samples=trace.samples.assign(**{"ugv1.executing": latest.where(trace.samples["ugv1.executing"] >= 0, -1.0)}),
        proposals=pd.DataFrame(rows, columns=list(PROPOSAL_COLUMNS)),
        decisions=pd.DataFrame(found, columns=list(DECISION_COLUMNS)),
    )


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    return make_scenario()


@pytest.fixture(scope="session")
def trace(scenario: Scenario) -> Trace:
    made = make_trace(scenario, "c", GOING_ROUND, SUCCESS)
    return with_proposals(made, [12.0, 14.5], [(12.1, 12.0, "refuse"), (14.6, 14.5, "accept"), (16.9, 14.5, "accept")])


@pytest.fixture(scope="session")
def scene(trace: Trace, scenario: Scenario) -> Scene:
    return scenes.scene(trace, scenario)
