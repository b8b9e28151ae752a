"""`airground import`: scenarios of worlds, maps and benchmarks of others."""

import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from builders import fields
from commands.conftest import Airground

from airground_drake.model.geometry import convex, outline
from airground_drake.scenario.load import load
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.schema import Scenario

MAPS = Path(__file__).parents[1] / "scenario" / "maps" / "data"
PILLAR = (
    "<model name='{name}'><pose frame=''>9 9 0 0 0 0</pose><link name='link'><collision name='c'><geometry>{shape}"
    "</geometry></collision></link></model>"
)
STATE = "<model name='{name}'><pose frame=''>{x} {y} 0 0 -0 {heading}</pose></model>"
CYLINDER = "<cylinder><radius>0.075</radius><length>1</length></cylinder>"
MAP = "type octile\nheight 4\nwidth 5\nmap\n.....\n.@@..\n.@...\n.....\n"
SCEN = (
    "version 1\n0\troom.map\t5\t4\t0\t0\t4\t3\t7\n0\troom.map\t5\t4\t3\t3\t3\t3\t0\n"
    "0\troom.map\t5\t4\t4\t0\t0\t3\t7\n0\troom.map\t5\t4\t0\t1\t0\t2\t1\n"
)


@pytest.fixture
def world(tmp_path: Path) -> Path:
    solids = {f"unit_cylinder_{k}": (x, 0.5 * k, 0.0) for k in range(30) for x in ((-4.4, -0.1)[k % 2],)}
    models = "".join(PILLAR.format(name=name, shape=CYLINDER) for name in solids)
    models += PILLAR.format(name="map", shape="<box><size>1 0.2 2</size></box>")
    states = "".join(STATE.format(name=n, x=x, y=y, heading=h) for n, (x, y, h) in solids.items())
    states += STATE.format(name="map", x=-2.25, y=8, heading=0.5)
    path = tmp_path / "world_7.world"
    path.write_text(f"<sdf version='1.6'><world name='w'>{models}<state>{states}</state></world></sdf>")
    return path


def least_distance(scenario: Scenario, place: list[float]) -> float:
    rows = outline.joined(*(outlines_of(scenario, each) for each in scenario.barriers.values()))
    return float((convex.distances(rows, np.array(place), True) - rows[:, outline.RADIUS]).min())


def test_the_shipped_field_is_what_the_importer_makes_of_its_world(tmp_path: Path, airground: Airground) -> None:
    (tmp_path / "field.world").write_text(fields.world(fields.SHIPPED))
    airground("import", "barn", tmp_path / "field.world", "-o", tmp_path / "field.yaml")
    made, shipped = load(tmp_path / "field.yaml"), load("barn")
    assert (made.barriers, made.ugvs, made.uav) == (shipped.barriers, shipped.ugvs, shipped.uav)
    assert (made.safe_distance, made.control, made.decision) == (
        shipped.safe_distance,
        shipped.control,
        shipped.decision,
    )


def test_a_world_of_barn_is_its_cylinders_and_boxes_with_the_challenges_start_and_goal(
    world: Path, tmp_path: Path, airground: Airground
) -> None:
    said = airground("import", "barn", world, "-o", tmp_path / "barn.yaml")
    assert said.splitlines()[0] == "31 obstacles"
    assert said.endswith(f"next: airground report {tmp_path / 'barn.yaml'}\n")
    scenario = load(tmp_path / "barn.yaml")
    (ugv,) = scenario.ugvs.values()
    assert (ugv.start_m, ugv.target_m, ugv.radius_m) == ([-2.25, 3.0, 0.0], [-2.25, 13.0, 0.0], 0.215)
    assert len(scenario.obstacles) == 31
    pillar = scenario.obstacles["unit_cylinder_3"]
    assert (pillar.position_m, pillar.radius_m, pillar.height_m) == ([-0.1, 1.5, 0.0], 0.075, 0.5)
    box = scenario.obstacles["the_map"]
    assert (box.position_m, box.size_m, box.heading_rad, box.height_m) == ([-2.25, 8.0, 0.0], [1.0, 0.2], 0.5, 1.0)
    assert scenario.uav.altitude_m >= 2.0


def test_a_ros_maps_robots_have_room_and_a_way(tmp_path: Path, airground: Airground) -> None:
    folder = tmp_path / "maps"
    shutil.copytree(MAPS, folder)
    said = airground("import", "ros-map", folder / "turtlebot3_world.yaml", "-o", tmp_path / "new" / "tb3.yaml")
    assert said.startswith("384 x 384 cells of 0.05 m: 795 occupied, 138722 unknown\nstarts and targets were chosen")
    scenario = load(tmp_path / "new" / "tb3.yaml")
    assert scenario.map is not None
    assert scenario.map.file == "../maps/turtlebot3_world.yaml"
    assert scenario.map.cells is not None
    assert len(scenario.map.cells.rectangles) == 147
    assert len(scenario.ugvs) == 3
    for ugv in scenario.ugvs.values():
        assert min(least_distance(scenario, ugv.start_m), least_distance(scenario, ugv.target_m)) > 0.25
        length = math.dist(*ugv.preset.waypoints_m)
        assert length > 1.0
        assert scenario.duration_s >= 1.5 * length / ugv.preset.speed_m_s


def test_robots_of_ones_own_and_their_size(tmp_path: Path, airground: Airground) -> None:
    airground(
        "import", "ros-map", MAPS / "depot.yaml", "--ugv", "a:2,7:15,7", "--ugv", "b:10,12.5:3,7",
        "--radius-m", 0.3, "--distance-m", 0.2, "-o", tmp_path / "depot.yaml",
    )  # fmt: skip
    scenario = load(tmp_path / "depot.yaml")
    assert {name: (ugv.start_m[:2], ugv.target_m[:2], ugv.radius_m) for name, ugv in scenario.ugvs.items()} == {
        "a": ([2.0, 7.0], [15.0, 7.0], 0.3),
        "b": ([10.0, 12.5], [3.0, 7.0], 0.3),
    }
    assert (scenario.safe_distance.obstacle_m, scenario.safe_distance.ugv_m) == (0.2, 0.2)


def test_a_benchmark_of_movingai_becomes_a_map_of_ros_with_a_frame_round_it(
    tmp_path: Path, airground: Airground
) -> None:
    (tmp_path / "room.map").write_text(MAP.replace("\n", "  \r\n"))
    (tmp_path / "some.scen").write_text(SCEN.replace("room.map", "maps\\room.map"))
    said = airground("import", "mapf", tmp_path / "some.scen", "--agents", 2, "--cell-m", 2, "-o", tmp_path / "s.yaml")
    assert said.splitlines()[:2] == ["5 x 4 cells of 2 m: 3 in the way", "the first 2 agents"]
    scenario = load(tmp_path / "s.yaml")
    ways = [(ugv.start_m[:2], ugv.target_m[:2]) for ugv in scenario.ugvs.values()]
    assert ways == [([1.0, 7.0], [9.0, 1.0]), ([9.0, 7.0], [1.0, 1.0])]  # the second agent is at its goal
    assert scenario.duration_s == 50.0  # of 14 m along the axes at 1 m/s, 1.5 times as long, and 20 s
    rows = MAP.split("map\n")[1].split()
    outlines = outlines_of(scenario, scenario.barriers["map"])
    for row, column in np.ndindex(6, 7):
        place = np.array([2.0 * column - 1.0, 2.0 * row - 1.0, 0.0])
        inside = 0 < row < 5 and 0 < column < 6
        blocked = not inside or rows[4 - row][column - 1] == "@"
        assert (convex.distances(outlines, place, True).min() < 0.0) == blocked, (row, column)
    airground("import", "mapf", tmp_path / "some.scen", "-o", tmp_path / "s.yaml", code=2)


def test_a_shape_above_the_ugvs_is_no_obstacle_and_is_named(tmp_path: Path, airground: Airground) -> None:
    """The UAV flies over it. It is an obstacle for higher UGVs."""
    lamps = [PILLAR.format(name=name, shape="<box><size>1 1 0.5</size></box>") for name in ("a lamp", "a-lamp")]
    lamps = [lamp.replace("9 9 0", f"5 {k} 2.75") for k, lamp in enumerate(lamps)]
    (tmp_path / "lamp.world").write_text(f"<sdf><world name='w'>{''.join(lamps)}</world></sdf>")
    said = airground("import", "barn", tmp_path / "lamp.world", "-o", tmp_path / "lamp.yaml")
    assert said.startswith("0 obstacles\nleft out: a lamp, which begins 2.5 m above the ground")
    scenario = load(tmp_path / "lamp.yaml")
    assert not scenario.barriers
    assert scenario.uav.altitude_m > 3.0
    airground("import", "barn", tmp_path / "lamp.world", "--height-m", 2.5, "-o", tmp_path / "high.yaml")
    assert [*load(tmp_path / "high.yaml").barriers] == ["a_lamp", "a_lamp_2"]


def large_map(folder: Path, side_m: float) -> Path:
    n = int(side_m / 0.5)
    cells = np.full((n, n), 254, np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 0
    cells[n // 2, :-40] = 0
    (folder / "large.pgm").write_bytes(b"P5 %d %d 255\n" % (n, n) + cells.tobytes())
    about = "image: large.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (folder / "large.yaml").write_text(about)
    return folder / "large.yaml"


@pytest.mark.parametrize(
    ("side_m", "options", "in_time"),
    [
        (200, (), True),
        (200, ("--max-speed-m-s", 20), True),
        (600, ("--max-speed-m-s", 0.5), False),
        (50, ("--radius-m", 0.001, "--distance-m", 0.001), True),
        (100, ("--distance-m", 6), True),
    ],
)
def test_what_is_chosen_is_never_refused(
    side_m: float, options: tuple[object, ...], in_time: bool, tmp_path: Path, airground: Airground
) -> None:
    path = tmp_path / "large.s.yaml"
    said = airground("import", "ros-map", large_map(tmp_path, side_m), "--ugvs", 1, *options, "-o", path)
    assert ("the longest that rounding allows" in said) == (not in_time)
    (ugv,) = load(path).ugvs.values()
    asked = dict(zip(options[::2], options[1::2], strict=True)).get("--max-speed-m-s", ugv.max_speed_m_s)
    assert ugv.max_speed_m_s == asked
    assert f"at most at {asked:g} m/s" in said


def test_a_map_whose_path_no_scenario_can_name_is_refused_as_such(tmp_path: Path, airground: Airground) -> None:
    folder = tmp_path / os.fsdecode(b"b\xff")
    folder.mkdir()
    said = airground("import", "ros-map", large_map(folder, 20.0), "--ugvs", 1, "-o", tmp_path / "s.yaml", code=2)
    assert "a scenario cannot name this path; wanted: printable UTF-8" in said


MISTAKES = """
import                                          # the following arguments are required: format, FILE
import gazebo x                                 # invalid choice: 'gazebo'
import barn nowhere.world                       # nowhere.world: No such file
import barn /dev/zero                           # not a regular file
import barn some.scen                           # some.scen:1: not XML
import barn empty.world                         # empty.world: no obstacle is in it; wanted: a world with cylinders
import barn binary.map                          # binary.map: not UTF-8 text
import barn w.world --ugvs 2                    # --ugvs is for ros-map
import barn w.world --agents 2                  # --agents is for mapf
import barn w.world --ugv a:1,2:3               # wanted: NAME:X,Y:X,Y with start and target in m
import barn w.world --ugv a:1,2:3,nan           # wanted: NAME:X,Y:X,Y
import barn w.world --ugv 1a:1,2:3,4            # wanted: NAME:X,Y:X,Y
import barn w.world --radius-m 0                # a number from 0.001 to 100
import barn mesh.world                          # no obstacle is in it; left out: a mesh of house; wanted: a world with
import ros-map depot.yaml --height-m 1          # --height-m is for barn
import barn w.world -o w.world                  # w.world exists; name a file that does not
import barn w.world --ugv a:-4.4,0:0,5          # a starts -0.29 m from unit_cylinder_0, at least safe_distance.
import barn w.world --ugv map_1:-2,3:-2,13      # ugvs.map_1: 'map_1' is not allowed
import ros-map nowhere.yaml                     # nowhere.yaml cannot be read
import ros-map some.scen                        # some.scen:
import ros-map depot.yaml --distance-m 3        # there is room for 1, with 3.2 m around each; 3 UGVs were asked for
import ros-map depot.yaml --ugvs 2 --ugv a:2,7:15,7 # exclude each other
import ros-map depot.yaml --ugv a:2,7:15,0.1    # a would end -0.2
import mapf some.scen --agents 4                # some.scen: 3 agents with a way to go; --agents 4 needs as many
import mapf none.scen                           # none.scen: no agent is in it; wanted: a scenario of MovingAI
import mapf some.scen --map nowhere.map         # nowhere.map: No such file
import mapf some.scen --map some.scen           # some.scen:1: type: missing
import mapf some.scen --cell-m 0                # a number from 0.1 to 100
import mapf some.scen --ugv a:1,2:3,4           # --ugv is for barn and ros-map
import mapf some.scen --agents 2 -o taken.yaml  # taken_map.pgm exists
"""


@pytest.mark.parametrize(
    ("line", "says"), [[part.strip() for part in each.split("#")] for each in MISTAKES.strip("\n").splitlines()]
)
def test_a_mistake_is_one_line_and_leaves_nothing(
    line: str, says: str, world: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, airground: Airground
) -> None:
    monkeypatch.chdir(tmp_path)
    world.rename("w.world")
    for name in ("depot.yaml", "depot.pgm"):
        shutil.copy(MAPS / name, name)
    Path("room.map").write_text(MAP)
    Path("some.scen").write_text(SCEN)
    Path("none.scen").write_text("version 1\n")
    Path("empty.world").write_text("<sdf><world name='w'/></sdf>")
    mesh = PILLAR.format(name="house", shape="<mesh/>")
    Path("mesh.world").write_text(f"<sdf><world name='w'>{mesh}</world></sdf>")
    Path("binary.map").write_bytes(b"\xff\xfe")
    Path("taken_map.pgm").touch()
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert says in airground(*line.split(), code=2)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
