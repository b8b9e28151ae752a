"""The scrubber: places as in the drawing, and a picture that needs no script."""

from __future__ import annotations

import json
import re
from html import unescape
from itertools import pairwise

import numpy as np
import pytest
from report.cases import FINE, built

from airground_drake.report import html, scrubber
from airground_drake.report.figures.panels import Figure
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario


def test_places_are_those_of_the_drawing(drawn: list[Figure]) -> None:
    """The path of a robot, as it is drawn, goes through the places of its mark."""
    for panel in drawn[0].panels:
        assert panel.tracks is not None
        for robot, color in zip(panel.tracks["robots"], ("#0060a8", "#b34700"), strict=False):
            path = re.search(rf'<path d="([^"]*)"[^>]*stroke(?:="|: ){color}', panel.svg)
            assert path
            corners = np.array(re.findall(r"[ML] (\S+) (\S+)", path[1]), dtype=np.float64)
            dense = np.concatenate([np.linspace(*pair, 200) for pair in pairwise(corners)])
            places = np.reshape(robot["places"], (-1, 2)) / scrubber.PER_UNIT
            assert np.abs(dense[:, None] - places).max(axis=2).min(axis=0).max() < 1.0


def test_tracks_are_small_and_of_the_whole_run(drawn: list[Figure]) -> None:
    panels = drawn[0].panels
    assert all(panel.tracks for panel in panels)
    assert not any(panel.tracks for figure in drawn[1:] for panel in figure.panels)
    for panel in panels:
        assert panel.tracks is not None
        assert panel.tracks["end"] == 30.0
        assert len(json.dumps(panel.tracks)) < 6000
        for robot in panel.tracks["robots"]:
            assert len(robot["states"]) == scrubber.SAMPLES == len(robot["places"]) // 2
    helped = next(panel.tracks for panel in panels if panel.heading.startswith("Run c"))
    assert helped is not None
    assert "2" in helped["robots"][0]["states"]


@pytest.fixture(scope="module")
def page(scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]) -> str:
    return html.render(built(scenario, traces, FINE), drawn)


def test_without_the_script_the_picture_is_as_it_was(page: str, drawn: list[Figure]) -> None:
    found = re.findall(r'<div class="scrubber" data-tracks="([^"]*)" hidden>', page)
    assert len(found) == 1
    assert json.loads(unescape(found[0])) == [panel.tracks for panel in drawn[0].panels]
    assert 'class="scrubbed"' not in page
    slider = re.findall(r"<label>Time, s <input ([^>]*)>", page)
    assert len(slider) == 1
    assert 'type="range"' in slider[0]
    assert 'max="30.0"' in slider[0]
