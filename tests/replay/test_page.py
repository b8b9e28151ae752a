"""The page of a run: whole, offline, escaped, and small beside Meshcat's own."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatAnimation

from airground_drake.base.errors import ReplayError
from airground_drake.replay import page as pages
from airground_drake.replay import recording
from airground_drake.replay.scene import FRAMES_PER_S, Scene

HOSTILE = "</script><script>alert(1)</script>"


@pytest.fixture(scope="module")
def page(scene: Scene) -> str:
    return pages.page(scene)


def test_it_says_what_is_shown_and_has_a_time_slider(page: str, scene: Scene) -> None:
    data = json.loads(re.findall(r'id="replay-data">(.*?)</script>', page)[0])
    assert data["end_s"] == scene.times_s[-1]
    assert [each["name"] for each in data["robots"]] == ["ugv1", "ugv2", "uav"]
    assert page.count('type="range"') == 1
    assert page.count("data-time=") >= len(scene.events)
    assert all(f"proposal, {outcome}" in page for outcome in ("not answered yet", "accepted", "refused"))


def test_it_asks_nothing_of_a_network(page: str) -> None:
    own = page[page.index('<section class="replay"') :]
    assert not re.search(r"(?:src|href)\s*=|https?://|@import|fetch\(", own)


def test_names_are_escaped(scene: Scene) -> None:
    hostile = replace(scene, scenario=HOSTILE, run=HOSTILE, events=({**scene.events[0], "robot": HOSTILE},))
    assert HOSTILE not in pages.page(hostile)


def test_a_minute_of_eight_robots_is_small(scene: Scene) -> None:
    t = np.arange(60 * FRAMES_PER_S) / FRAMES_PER_S
    wild = np.column_stack([np.sin(3.0 * t), np.cos(2.0 * t), 0.1 * np.sin(t)])
    body = scene.robots[0]
    bodies = tuple(
        replace(body, name=f"ugv{k}", positions=wild + k, states=np.zeros(len(t), dtype=np.intp)) for k in range(8)
    )
    crowded = replace(scene, times_s=t, robots=bodies)
    alone = replace(scene, robots=(), proposals=(), obstacles=())
    assert len(pages.page(crowded)) - len(pages.page(alone)) < 3_000_000


def test_only_frames_that_change_something_are_kept(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> None:
    kept: list[int] = []

    class Counting(MeshcatAnimation):  # type: ignore[misc]
        def SetTransform(self, frame: int, *rest: object) -> None:
            kept.append(frame)

    monkeypatch.setattr(recording, "MeshcatAnimation", Counting)
    monkeypatch.setattr(Meshcat, "SetAnimation", lambda *_: None)
    recording.recorded(replace(scene, robots=scene.robots[:1], proposals=()))
    corners = 9  # of the path, each between two frames
    assert 2 <= len(kept) <= 3 * corners
    assert (kept[0], kept[-1]) == (0, len(scene.times_s) - 1)


def test_another_page_of_meshcat_is_noticed(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> None:
    monkeypatch.setattr(Meshcat, "StaticHtml", lambda _: "<html></html>")
    with pytest.raises(ReplayError, match="no place for the time slider"):
        pages.page(scene)
