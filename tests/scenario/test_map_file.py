"""The key `map`: files of map_server become an obstacle; every mistake is one line."""

import copy
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from airground_drake.base.errors import ScenarioError
from airground_drake.base.files import sha256
from airground_drake.model.geometry import convex, outline
from airground_drake.scenario import map_file
from airground_drake.scenario.load import from_data, load, resolved, validated
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world

ROOM = """
..........
.########.
.#......#.
.#.u....#.
.#......#.
.#####..#.
.#...#..#.
.########.
"""
"""From above: walls #, unknown u. In the lower left is a closet that nobody can enter."""
ABOUT = {
    "image": "room.pgm",
    "resolution": 0.5,
    "origin": [-1.0, 2.0, 0.0],
    "occupied_thresh": 0.65,
    "free_thresh": 0.25,
    "negate": 0,
}
SCENARIO: dict[str, Any] = {
    "name": "room",
    "ugvs": {
        "ugv1": {
            "start_m": [0.75, 4.75, 0.0],
            "target_m": [2.25, 3.25, 0.0],
            "preset": {"waypoints_m": [[0.75, 4.75, 0.0], [2.25, 3.25, 0.0]]},
        }
    },
    "uav": {"start_m": [0.75, 4.75, 2.0]},
    "map": {"file": "maps/room.yaml"},
    "safe_distance": {"obstacle_m": 0.2},
    "runs": {"a": {"method": "a"}, "d": {"method": "d", "set": {"gatekeeper.tries": 3}}},
}
GREYS = {".": 254, "#": 0, "u": 205}


def image() -> np.ndarray:
    return np.array([[GREYS[each] for each in row] for row in ROOM.split()], np.uint8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "maps").mkdir()
    grey = image()
    (tmp_path / "maps/room.pgm").write_bytes(b"P5\n%d %d\n255\n" % grey.shape[::-1] + grey.tobytes())
    (tmp_path / "maps/room.yaml").write_text(yaml.safe_dump(ABOUT), encoding="utf-8")
    write(tmp_path)
    return tmp_path


def write(folder: Path, **changed: object) -> Path:
    path = folder / "scenario.yaml"
    path.write_text(yaml.safe_dump(SCENARIO | changed), encoding="utf-8")
    return path


def in_the_way(scenario: Scenario, x: float, y: float) -> bool:
    rows = outlines_of(scenario, scenario.barriers["map"])
    return bool((convex.distances(rows, np.array([x, y, 0.0]), True) < 0.0).any())


def test_cells_in_the_way_and_out_of_reach_are_one_obstacle(folder: Path) -> None:
    scenario = load(folder / "scenario.yaml")
    rows, reached = ROOM.split(), 0
    for row, column in np.ndindex(len(rows), len(rows[0])):
        inside = 0 < row < 7 and 1 < column < 8 and not (row == 1 and column < 5)  # but not in the closet
        free = rows[-1 - row][column] == "." and inside
        x, y = -1.0 + 0.5 * (column + 0.5), 2.0 + 0.5 * (row + 0.5)
        assert in_the_way(scenario, x, y) is not free, (row, column)
        reached += free
    cells = scenario.map.cells if scenario.map else None
    assert cells is not None
    assert (cells.rows, cells.columns, cells.occupied, cells.unsure) == (8, 10, 31, 1)
    assert cells.unreached == 80 - 31 - 1 - reached
    names = [body.name for body in make_world(scenario).resting]
    assert names == ["map"]
    assert str(cells).startswith("map maps/room.yaml: 10 x 8 cells of 0.5 m, 31 occupied, 1 unknown (occupied), ")


def test_free_unknown_cells_and_the_keys_of_the_obstacle(folder: Path) -> None:
    given = {"file": "maps/room.yaml", "unknown": "free", "height_m": 1.5, "distance_m": 0.1, "known_to_uav": False}
    scenario = load(write(folder, map=given))
    assert not in_the_way(scenario, 0.75, 4.25)  # the unknown cell
    barrier = scenario.barriers["map"]
    assert not barrier.known_to_uav
    rows = outlines_of(scenario, barrier)
    assert {(row[outline.BASE], row[outline.TOP], row[outline.GAP]) for row in rows} == {(0.0, 1.5, 0.1)}


def test_the_scenario_of_a_report_needs_no_file(folder: Path) -> None:
    scenario = load(folder / "scenario.yaml")
    data = resolved(scenario)
    for name in ("room.yaml", "room.pgm"):
        content = (folder / "maps" / name).read_bytes()
        assert data["map"]["cells"]["sha256"][name] == sha256(content)
        assert map_file.content(sha256(content)) == content
        (folder / "maps" / name).unlink()
    again = from_data(copy.deepcopy(data), "a report")
    assert again == scenario
    assert again.digest == scenario.digest
    assert validated(scenario, {"duration_s": 5.0}).map == scenario.map
    with pytest.raises(ScenarioError, match=r"room\.yaml cannot be read"):  # other cells than those that were read
        validated(scenario, {"map.unknown": "free"})


def test_the_digest_depends_on_the_image(folder: Path) -> None:
    before = load(folder / "scenario.yaml").digest
    path = folder / "maps/room.pgm"
    path.write_bytes(path.read_bytes().replace(b"\xcd", b"\xcc"))  # in the way as before
    after = load(folder / "scenario.yaml")
    assert after.digest != before


def changing(**keys: object) -> Callable[[Path], object]:
    about = {key: value for key, value in (ABOUT | keys).items() if value is not None}
    return lambda folder: (folder / "maps/room.yaml").write_text(yaml.safe_dump(about), encoding="utf-8")


def with_image(content: bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / "maps/room.pgm").write_bytes(content)


MISTAKES: list[tuple[Callable[[Path], object], str]] = [
    (lambda folder: (folder / "maps/room.yaml").unlink(), "scenario.yaml:2: map.file: "),
    (
        lambda folder: write(folder, map={"file": "/dev/zero"}),
        "/dev/zero cannot be read (not a regular file)",
    ),
    (lambda folder: write(folder, map={"file": "maps"}), "maps cannot be read (not a regular file)"),
    (lambda folder: write(folder, map={"file": "maps/room.pgm"}), "room.pgm: not UTF-8 text"),
    (lambda folder: write(folder, map={"file": ""}), "map.file: '' is not allowed"),
    (lambda folder: write(folder, map={}), "map.file: missing"),
    (lambda folder: write(folder, map={"file": "maps/room.yaml", "unknown": "wall"}), "one of occupied, free"),
    (lambda folder: write(folder, map={"file": "maps/room.yaml", "hight_m": 1}), "did you mean height_m?"),
    (lambda folder: write(folder, obstacles={"map": {"position_m": [50, 50, 0]}}), "obstacles.map: 'map' is not"),
    (lambda folder: write(folder, obstacles={"map_1": {"position_m": [50, 50, 0]}}), "does not begin with map_"),
    (
        lambda folder: write(folder, safe_distance={"obstacle_m": 0.6}),
        "free ones that cannot be reached from any start count as occupied), at least safe_distance.obstacle_m = 0.6 m",
    ),
    (changing(image=None), "room.yaml:1: image: missing; wanted: the path of a PGM, PPM, PNG or BMP file"),
    (changing(image="no.pgm"), "room.yaml:2: image: "),
    (changing(image="a\0b"), "image: '\\x00' is not allowed"),
    (changing(image="room.yaml"), "image: room.yaml is not a PGM, PPM, PNG or BMP image; wanted: the image of a map"),
    (changing(resolution=0.0), "room.yaml:9: resolution: 0.0 is not allowed; wanted: the side of a cell, 0.001 to"),
    (changing(resolution=math.nan), "resolution: nan is not allowed"),
    (changing(resolution="5 cm"), "resolution: '5 cm' is not allowed"),
    (changing(origin=[0.0, 0.0]), "origin: [0.0, 0.0] is not allowed; wanted: 3 numbers: [x, y, yaw], m and rad"),
    (changing(origin=[0.0, 0.0, 90]), "room.yaml:8: origin.2: 90.0 is not allowed; from -6.28319 to 6.28319 rad"),
    (changing(origin=[0.0, 0.0, math.inf]), "origin.2: inf is not allowed"),
    (changing(occupied_thresh=65), "occupied_thresh: 65.0 is not allowed; wanted: a number from 0 to 1"),
    (changing(free_thresh=0.7), "free_thresh: 0.7 is not allowed; at most occupied_thresh = 0.65"),
    (changing(negate=2), "negate: 2 is not allowed; wanted: 0 or 1"),
    (changing(mode="scale"), "mode: 'scale' is not allowed; wanted: trinary"),
    (changing(mode=3), "mode: '3' is not allowed; wanted: trinary"),
    (with_image(b"P5\n10 8\n255\n" + bytes(79)), "image: room.pgm is a broken image (image file is truncated"),
    (with_image(b"P6\n100000 100000\n255\n"), "image: room.pgm is an image of more than 16000000 cells"),
    (lambda folder: os.truncate(folder / "maps/room.pgm", 1 << 40), "image: "),
    (lambda folder: (folder / "maps/room.yaml").write_text("a: &a [*a]"), "room.yaml:1: nested too deeply"),
]


@pytest.mark.parametrize(("spoil", "says"), MISTAKES)
def test_a_mistake_is_one_line_with_its_place(spoil: Callable[[Path], object], says: str, folder: Path) -> None:
    spoil(folder)
    with pytest.raises(ScenarioError) as caught:
        load(folder / "scenario.yaml")
    assert says in str(caught.value).replace(f"{folder}/maps/", "").replace(f"{folder}/", "")
    assert "\n" not in str(caught.value)


def test_unused_keys_of_a_map_are_left_to_others(folder: Path) -> None:
    changing(mode="Trinary", unknown_thresh=0.4)(folder)
    assert load(folder / "scenario.yaml").map


def test_a_map_of_noise_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_file, "MAX_RECTANGLES", 3)
    with pytest.raises(ScenarioError, match=r"map\.file: maps/room\.yaml needs . rectangles; at most 3 are allowed"):
        load(folder / "scenario.yaml")


@pytest.mark.parametrize("rectangle", [[0, 0, 0, 1], [0, 9, 0, 1], [0, 1, 3, 11], [2, 1, 0, 1]])
def test_recorded_rectangles_are_within_the_map(folder: Path, rectangle: list[int]) -> None:
    data = resolved(load(folder / "scenario.yaml"))
    data["map"]["cells"]["rectangles"][1] = rectangle
    with pytest.raises(ScenarioError, match=r"map\.cells\.rectangles\.1: .* a rectangle of the 8 rows and 10 columns"):
        from_data(data, "a report")


def test_an_empty_map_is_no_obstacle(folder: Path) -> None:
    with_image(b"P5\n10 8\n255\n" + b"\xff" * 80)(folder)
    scenario = load(folder / "scenario.yaml")
    assert "map" not in scenario.barriers
    assert scenario.map
