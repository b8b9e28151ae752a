"""The page of a run: whole, offline, escaped, and small."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatAnimation

from airground_drake.base.errors import ReplayError
from airground_drake.report.replay import page as pages
from airground_drake.report.replay.scene import Scene

HOSTILE = "</script><script>alert(1)</script>"


@pytest.fixture(scope="module")
def page(scene: Scene) -> str:
    return pages.page(scene)


def test_it_has_names_events_and_a_time_slider_and_asks_nothing_of_a_network(page: str, scene: Scene) -> None:
    data = json.loads(re.findall(r'id="replay-data">(.*?)</script>', page)[0])
    assert data["end_s"] == scene.times_s[-1]
    assert [each["name"] for each in data["robots"]] == ["ugv1", "ugv2", "uav"]
    assert page.count('type="range"') == 1
    assert page.count("data-time=") >= len(scene.events)
    own = page[page.index('<section class="replay"') :]
    assert not re.search(r"(?:src|href)\s*=|https?://|@import|fetch\(", own)


def test_names_are_escaped(scene: Scene) -> None:
    hostile = replace(
        scene,
        scenario=replace(scene.scenario, name=HOSTILE),
        run=HOSTILE,
        events=({**scene.events[0], "robot": HOSTILE},),
    )
    assert HOSTILE not in pages.page(hostile)


def test_nothing_is_drawn_where_a_body_was_not_recorded(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> None:
    """Its path has a part before the gap and one after it; in between the body is hidden, and does not move."""
    shown: dict[str, list[tuple[int, bool]]] = {}
    moved: dict[str, list[int]] = {}

    class Noting(MeshcatAnimation):  # type: ignore[misc]
        def SetProperty(self, frame: int, path: str, name: str, value: bool) -> None:
            shown.setdefault(path, []).append((frame, value))

        def SetTransform(self, frame: int, path: str, *rest: object) -> None:
            moved.setdefault(path, []).append(frame)

    monkeypatch.setattr(pages, "MeshcatAnimation", Noting)
    monkeypatch.setattr(Meshcat, "SetAnimation", lambda *_: None)
    positions = scene.robots[0].positions.copy()
    positions[100:120] = np.nan
    meshcat = pages.recorded(replace(scene, robots=(replace(scene.robots[0], positions=positions),), proposals=()))
    assert [meshcat.HasPath(f"/paths/0/{k}") for k in range(3)] == [True, True, False]
    assert shown["/robots/0"] == [(0, True), (100, False), (120, True)]
    assert {99, 120} <= set(moved["/robots/0"])
    assert not set(range(100, 120)) & set(moved["/robots/0"])


def test_another_page_of_meshcat_is_noticed(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> None:
    monkeypatch.setattr(Meshcat, "StaticHtml", lambda _: "<html></html>")
    with pytest.raises(ReplayError, match="no place for the time slider"):
        pages.page(scene)
