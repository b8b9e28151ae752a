"""Obstacles that move, appear and disappear, in each kind of replay."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image

from airground_drake.report.export import recording
from airground_drake.report.replay import scene as scenes
from airground_drake.report.replay import video
from airground_drake.report.replay.page import page
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace

START, END = np.array([-3.0, 8.0]), np.array([-1.0, 8.0])


@pytest.fixture(scope="module")
def trace() -> Trace:
    data = resolved(load("minimal")) | {"duration_s": 2.0}
    cart = {"size_m": [1.0, 0.5], "disappears_s": 1.5, "distance_m": 0.5}
    data["obstacles"] = {"cart": cart | {"moves": {"waypoints_m": [START.tolist(), END.tolist()], "speed_m_s": 1.0}}}
    return simulate(from_data(data, "moving"), "a")


def test_a_scene_has_by_how_much_it_moved_and_a_page_and_a_video_can_be_made(trace: Trace, tmp_path: Path) -> None:
    scene = scenes.scene(trace, trace.scenario)
    assert {*scene.moved_m} == {0}
    assert scene.barriers[0].place_m[:2].tolist() == START.tolist()
    moved = np.minimum(scene.times_s, 2.0)[:, None] * [1.0, 0.0, 0.0]
    assert scene.moved_m[0] == pytest.approx(moved, abs=1e-6)
    assert '"name": "cart"' in page(scene)
    path = tmp_path / "run.webp"
    video.write(scene, path, 1.0)
    with Image.open(path) as pictures:
        assert pictures.is_animated  # type: ignore[attr-defined]


def test_an_mcap_file_has_it_where_it_is_at_each_time(trace: Trace) -> None:
    reader = make_reader(io.BytesIO(recording.recorded(trace, trace.scenario)))
    placed = [
        (message.log_time / 1e9, entity["triangles"][0]["pose"]["position"]["x"])
        for _, _, message in reader.iter_messages(["/scene"])
        for entity in json.loads(message.data)["entities"]
        if entity["id"] == "obstacle cart"
    ]
    assert len(placed) == len(trace.t) + 1
    assert all(x == pytest.approx(min(t, 2.0), abs=1e-6) for t, x in placed)
