"""A small scene: case A in small, with a proposal that is refused and one that is accepted."""

from dataclasses import replace

import numpy as np
import pytest
from report.cases import GOING_ROUND, SUCCESS, make_trace

from airground_drake.report.replay import scene as scenes
from airground_drake.report.replay.scene import Scene, Sent, Span
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

PATH = np.array([[3.4, 5.1, 0.0], [6.5, 5.0, 0.0], [6.5, 5.0, 0.0], [6.5, 9.0, 0.0]])
PROPOSALS = (
    Sent("ugv1", "p", PATH, (Span(12.0, 12.1, "asked"), Span(12.1, 13.1, "refused"))),
    Sent("ugv1", "p", PATH, (Span(14.5, 14.6, "asked"), Span(14.6, 16.9, "accepted"))),
)


@pytest.fixture(scope="session")
def trace(scenario: Scenario) -> Trace:
    return make_trace(scenario, "c", GOING_ROUND, SUCCESS)


@pytest.fixture(scope="session")
def scene(trace: Trace, scenario: Scenario) -> Scene:
    return replace(scenes.scene(trace, scenario), proposals=PROPOSALS)
