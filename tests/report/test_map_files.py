"""Copies of a map's files in a report: who needs to believe the rectangles can make them again."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from airground_drake.base.files import sha256
from airground_drake.check.line import AGREES, DISAGREES, OPEN
from airground_drake.check.report import check_files
from airground_drake.check.rules import Disagreement
from airground_drake.report import folder, rebuild
from airground_drake.report.after_runs import _map_files
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import MapCells, Scenario

MAPS = Path(__file__).parents[1] / "scenario" / "maps" / "data"
NAMES = ["map/turtlebot3_world.pgm", "map/turtlebot3_world.yaml"]
START, TARGET = [-2.0, -0.5, 0.0], [0.5, 0.5, 0.0]
DATA: dict[str, Any] = {
    "name": "room",
    "ugvs": {"ugv1": {"start_m": START, "target_m": TARGET, "preset": {"waypoints_m": [START, TARGET]}}},
    "uav": {"start_m": [-2.0, -0.5, 3.0]},
    "map": {"file": "turtlebot3_world.yaml"},
    "safe_distance": {"obstacle_m": 0.2},
    "runs": {"a": {"method": "a"}},
}


@pytest.fixture
def scenario() -> Scenario:
    return from_data(DATA, str(MAPS / "scenario.yaml"))


def cells_of(scenario: Scenario) -> MapCells:
    assert scenario.map is not None
    assert scenario.map.cells is not None
    return scenario.map.cells


def test_the_files_are_copied_and_belong_to_the_report(scenario: Scenario, tmp_path: Path) -> None:
    assert sorted(_map_files(cells_of(scenario), tmp_path)) == NAMES
    for name in NAMES:
        assert (tmp_path / name).read_bytes() == (MAPS / Path(name).name).read_bytes()
    (tmp_path / "map" / "mine.txt").touch()
    (tmp_path / "report.json").write_text('{"schema": "airground_drake.report/4"}')
    folder.prepare(tmp_path)  # a report may be written over it
    folder.clear(tmp_path)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["mine.txt"]


@pytest.mark.parametrize(("name", "path"), [("a.yaml", "map/a.yaml"), ("../b.png", "map/b.png"), ("c", "map/c.pgm")])
def test_the_path_of_a_copy_is_in_the_folder_of_maps(name: str, path: str) -> None:
    assert folder.of_map(name) == path


def test_the_cells_are_made_again_from_the_copies(scenario: Scenario, tmp_path: Path) -> None:
    def found() -> list[tuple[str, str]]:
        return [(line["outcome"], line.get("about", "")) for line in rebuild._map(tmp_path, scenario)]

    assert found() == [(OPEN, "")]
    _map_files(cells_of(scenario), tmp_path)
    assert found() == [(AGREES, "")]
    cells_of(scenario).rectangles[5][1] -= 1
    assert found() == [(DISAGREES, "rectangles.5.1")]
    cells_of(scenario).rectangles[5][1] += 1
    image = tmp_path / NAMES[0]
    image.write_bytes(image.read_bytes().replace(b"\xfe", b"\xfd", 1))  # free as before
    assert found() == [(DISAGREES, "sha256.turtlebot3_world.pgm")]


def test_a_copy_leads_to_no_file_outside_of_the_report(tmp_path: Path) -> None:
    """The map's file names an image in another folder, which may be gone, or be another one by now."""
    (tmp_path / "images").mkdir()
    (tmp_path / "maps").mkdir()
    image, about = (MAPS / Path(name).name for name in NAMES)
    text = about.read_text().replace(image.name, f"../images/{image.name}")
    (tmp_path / "maps" / about.name).write_text(text)
    (tmp_path / "images" / image.name).write_bytes(image.read_bytes())
    scenario = from_data(DATA, str(tmp_path / "maps" / "scenario.yaml"))
    _map_files(cells_of(scenario), tmp_path / "report")
    (tmp_path / "images" / image.name).write_bytes(b"")
    assert [line["outcome"] for line in rebuild._map(tmp_path / "report", scenario)] == [AGREES]


def test_the_checker_wants_the_files_that_the_scenario_was_made_with(scenario: Scenario, tmp_path: Path) -> None:
    names = _map_files(cells_of(scenario), tmp_path)
    report: dict[str, Any] = {
        "runs": {},
        "files": {name: sha256((tmp_path / name).read_bytes()) for name in names},
        "scenario": {"resolved": asdict(scenario)},
    }
    assert check_files(tmp_path, names, report) == "2 files"
    report["scenario"]["resolved"]["map"]["cells"]["sha256"]["turtlebot3_world.pgm"] = "0" * 64
    with pytest.raises(Disagreement, match="the map was read from this file"):
        check_files(tmp_path, names, report)
