"""Scenarios made from BARN's Gazebo worlds, ROS maps and MovingAI's benchmarks."""

import math
import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path, PureWindowsPath
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError, one_line
from airground_drake.base.limits import MAX_NAME
from airground_drake.scenario import map_file
from airground_drake.scenario.document import text_of
from airground_drake.scenario.maps import gazebo, movingai, sites
from airground_drake.scenario.maps.rectangles import Cells
from airground_drake.scenario.rounding import Rounding
from airground_drake.scenario.schema import Control
from airground_drake.scenario.shipped import scenario_name

MOST_BYTES = 16_000_000  # most bytes of a world, a map or an imported scenario
MAX_SPEED_M_S, UAV_MAX_SPEED_M_S = 1.5, 10.0
RESERVE = 1.5  # the largest speed of UGVs is this many times that of their presets
FAITH = 1.5  # a run lasts this many times as long as the longest way at the speed of presets, and `PATIENCE_S` longer
PATIENCE_S = 20.0
PERIOD_S = 0.05
# Start and goal of the BARN challenge in its worlds 0 to 299 (`run.py` of its repository), m.
BARN = ((-2.25, 3.0), (-2.25, 13.0))
# The UAV flies at least so far above the highest shape, and keeps as much from UGVs if it flies high enough.
CLEARANCE_M = 1.0

Point = tuple[float, float]


class Robot(NamedTuple):
    """A UGV: its name, start and target, m."""

    name: str
    start: Point
    target: Point


class Sizes(NamedTuple):
    """Sizes and speeds of UGVs."""

    radius_m: float  # radius of each UGV
    distance_m: float  # what UGVs keep from obstacles and from one another, between surfaces
    # Largest speed; None: `MAX_SPEED_M_S`, or less where radius and distance are below 0.1 m together.
    max_speed_m_s: float | None = None


class Imported(NamedTuple):
    """A scenario to be written."""

    text: str  # of the scenario's file
    beside: dict[Path, bytes]  # content of further files, by path
    says: list[str]  # what was read and chosen, in words


def barn(path: Path, name: str, robots: Sequence[Robot], sizes: Sizes, height_m: float) -> Imported:
    """The scenario of a Gazebo world; without robots, one goes where the BARN challenge asks it to go."""
    # Objects that begin above the height of UGVs do not stand in their way: they are left out; the UAV flies over them.
    world = gazebo.world(_text(path), str(path))
    left_out = [f"left out: {model}" for model in world.left_out]
    if not world.solids:
        allowed = "wanted: a world with cylinders, spheres or boxes in its models"
        raise ScenarioError(str(path), "", Fault("; ".join(["no obstacle is in it", *left_out])), allowed)
    robots = robots or [Robot("ugv1", *BARN)]
    taken = {robot.name for robot in robots} | {"uav"}
    lines = list[str]()
    for solid in world.solids:
        if solid.bottom > height_m:
            above = f"{solid.name}, which begins {_number(solid.bottom)} m above the ground"
            left_out.append(f"left out: {above}: UGVs of {height_m:g} m pass under it (--height-m)")
            continue
        own = _new_name(solid.name, taken)
        taken.add(own)
        place = f"position_m: {_list((solid.pose.x, solid.pose.y, 0.0))}, height_m: {_number(solid.top)}"
        size = f"radius_m: {_number(solid.size[0])}"
        if len(solid.size) == 2:
            size = f"size_m: {_list(solid.size)}, heading_rad: {_number(math.remainder(solid.pose.heading, math.tau))}"
        lines.append(f"  {own}: {{{place}, {size}}}")
    says = [f"{len(lines)} obstacle{'' if len(lines) == 1 else 's'}", *dict.fromkeys(left_out)]
    top = max(solid.top for solid in world.solids)
    extent = max(max(map(abs, solid.pose[:2])) + math.hypot(*solid.size) for solid in world.solids)
    longest = max(math.dist(robot.start, robot.target) for robot in robots)
    lines = ["obstacles:", *lines] if lines else []
    return _scenario(path, name, robots, sizes, says, lines, _Space(2.0 * longest, extent, top))


def ros_map(path: Path, name: str, folder: Path, robots: Sequence[Robot], count: int, sizes: Sizes) -> Imported:
    """The scenario of a map_server's map; without robots, some are put where they have room and a way."""
    # folder: in which the scenario will be; the map is named from there.
    # robots: the UGVs; may be empty.
    read = map_file.read(path)
    grid = read.grid()
    rows, columns = grid.occupied.shape
    says = [
        f"{columns} x {rows} cells of {grid.frame.cell_m:g} m: {read.cells.occupied.sum()} occupied, "
        f"{read.cells.unknown.sum()} unknown"
    ]
    longest = 2.0 * max((math.dist(robot.start, robot.target) for robot in robots), default=0.0)
    if not robots:
        needed = sizes.radius_m + sizes.distance_m + grid.frame.cell_m
        try:
            pairs, longest = sites.ways(grid, needed, count)
        except ValueError as error:
            allowed = f"{count} UGVs were asked for: name fewer, smaller ones, or a smaller distance"
            raise ScenarioError(str(path), "", Fault(str(error)), allowed) from None
        robots = [
            Robot(f"ugv{number}", _point(start), _point(target))
            for number, (start, target) in enumerate(pairs.tolist(), 1)
        ]
        says.append(f"starts and targets were chosen: at least {needed:g} m from obstacles, with a way between them")
    corners = grid.frame.points(np.array([[0, 0], [0, rows], [columns, 0], [columns, rows]]))
    space = _Space(longest, float(np.abs(corners).max()))
    file = os.path.relpath(path, folder)
    if not file.isprintable():
        raise ScenarioError(str(path), "", Fault("a scenario cannot name this path"), "wanted: printable UTF-8")
    return _scenario(path, name, robots, sizes, says, _map(file), space)


def mapf(
    path: Path, map_path: Path | None, name: str, folder: Path, agents: int, cell_m: float, max_speed_m_s: float | None
) -> Imported:
    """The scenario of a benchmark of MovingAI: its map as a map_server's, its first agents as UGVs."""
    # A UGV's radius is a fifth of a cell. It keeps a tenth of a cell from others and from obstacles, so it fits through
    # gaps of one cell.
    # map_path: of the `.map` file; None: where the scenario says, beside it.
    text = _text(path)
    if not (named := movingai.map_name(text)):
        raise ScenarioError(str(path), "", Fault("no agent is in it"), "wanted: a scenario of MovingAI")
    map_path = map_path or path.parent / PureWindowsPath(named).name  # which knows both kinds of slashes
    cells = movingai.cells(_text(map_path), str(map_path))
    listed = movingai.agents(text, str(path), cells)
    moving = [agent for agent in listed if agent.start != agent.goal]
    if len(moving) < agents:
        fault = Fault(f"{len(moving)} agents with a way to go")
        raise ScenarioError(str(path), "", fault, f"--agents {agents} needs as many")

    def middle(cell: tuple[int, int]) -> Point:
        return _point([(index + 0.5) * cell_m for index in cell])

    robots = [Robot(f"ugv{n}", middle(agent.start), middle(agent.goal)) for n, agent in enumerate(moving[:agents], 1)]
    longest = max(sum(map(abs, np.subtract(robot.target, robot.start))) for robot in robots)
    rows, columns = cells.shape
    says = [f"{columns} x {rows} cells of {cell_m:g} m: {cells.sum()} in the way", f"the first {agents} agents"]
    image, about = folder / f"{name}_map.pgm", folder / f"{name}_map.yaml"
    beside = {
        image: _pgm(np.pad(cells, 1, constant_values=True)),
        about: text_of(
            {
                "image": image.name, "resolution": cell_m, "origin": [-cell_m, -cell_m, 0.0], "negate": 0,
                "occupied_thresh": 0.65, "free_thresh": 0.196,
            }
        ).encode(),
    }  # fmt: skip
    sizes = Sizes(0.2 * cell_m, 0.1 * cell_m, max_speed_m_s)
    space = _Space(longest, (max(rows, columns) + 1) * cell_m)
    return _scenario(path, name, robots, sizes, says, _map(about.name), space, beside)


class _Space(NamedTuple):
    """Where robots are."""

    longest: float  # a length that no robot's way should exceed, m
    extent: float  # largest coordinate of an obstacle or of the map, m
    top: float = 0.0  # height of the highest shape, m


class _Pace(NamedTuple):
    """How fast robots are, and for how long."""

    ugv: float  # largest speed of a UGV, m/s
    uav: float  # largest speed of the UAV, m/s
    sensing: float  # sensing range, m; it covers what closes in a period
    needed: float  # what the longest way needs, s
    duration: float  # of a run, s


def _pace(sizes: Sizes, space: _Space, air_ground_m: float) -> _Pace:
    # Rounding limits how far robots may go (`rounding.py`). For long ways the UAV is slower; if that does not suffice,
    # the run is shorter than needed.
    radius, distance = sizes.radius_m, sizes.distance_m
    ugv = sizes.max_speed_m_s or min(MAX_SPEED_M_S, RESERVE * 10.0 * (radius + distance))
    needed = math.ceil((FAITH * RESERVE * space.longest / ugv + PATIENCE_S) / 10.0) * 10.0
    most = 0.0
    for uav in (max(UAV_MAX_SPEED_M_S, 2.0 * ugv), 2.0 * ugv):
        closing = max(ugv + uav, 2.0 * ugv)
        reach = distance + air_ground_m + 2.0 * radius + closing * PERIOD_S  # more than any pair needs
        sensing = max(4.0, 10.0 * radius, reach)
        loss = Rounding(sensing, closing, PERIOD_S, Control().avoidance_gain_1_s)
        most = 0.999 * loss.longest(space.extent, uav)  # numbers are rounded in the file
        if needed <= most:
            break
    return _Pace(ugv, uav, sensing, needed, min(needed, max(math.floor(most / 10.0) * 10.0, 10.0)))


def _scenario(
    path: Path,
    name: str,
    robots: Sequence[Robot],
    sizes: Sizes,
    says: Sequence[str],
    world: Sequence[str],
    space: _Space,
    beside: Mapping[Path, bytes] = MappingProxyType({}),
) -> Imported:
    radius, distance = sizes.radius_m, sizes.distance_m
    altitude = max(2.0, space.top + max(CLEARANCE_M, 2.0 * distance), 2.0 * (radius + distance))
    air_ground = min(0.5 * altitude - radius, max(CLEARANCE_M, distance))
    places = [altitude, *(abs(place) for robot in robots for place in (*robot.start, *robot.target))]
    pace = _pace(sizes, space._replace(extent=max(space.extent, *places)), air_ground)
    speed = pace.ugv / RESERVE
    says = [*says, f"UGVs drive at {_number(speed)} m/s, at most at {_number(pace.ugv)} m/s (--max-speed-m-s)"]
    if pace.duration < pace.needed:
        short = f"runs end after {_number(pace.duration)} s, the longest that rounding allows in a world of this size"
        says.append(f"{short}; the longest way may take {_number(pace.needed)} s")
    middle = np.mean([robot.start for robot in robots], axis=0)
    kept = f"UGVs have a radius of {_number(radius)} m, and keep {_number(distance)} m from others"
    comments = [f"Made by `airground import` of {path.name}", *says, f"{kept}; presets are straight"]
    lines = [
        *(f"# {one_line(comment)}" for comment in comments),
        f'name: "{name}"',
        text_of({"title": one_line(f"{len(robots)} {'UGVs' if len(robots) > 1 else 'UGV'} in {path.name}")}).strip(),
        f"duration_s: {_number(pace.duration)}",
        "",
        "uav:",
        f"  start_m: {_list((*middle, altitude))}",
        f"  altitude_m: {_number(altitude)}",
        f"  max_speed_m_s: {_number(pace.uav)}",
        "",
        "safe_distance:",
        f"  obstacle_m: {_number(distance)}",
        f"  ugv_m: {_number(distance)}",
        f"  air_ground_m: {_number(air_ground)}",
        f"  collision_m: {_number(0.1 * distance)}",
        "",
        f"control: {{period_s: {PERIOD_S:g}, sensing_range_m: {_number(pace.sensing)}}}",
        f"decision: {{threshold: {{rule: fixed, zeta_m: 1.0}}, release_m: 0.5, noise_period_s: {PERIOD_S:g}}}",
        "intervention: {policies: [{name: coordinate}]}",
        "gatekeeper: {period_s: 0.2}",
        "",
        "ugvs:",
    ]
    for robot in robots:
        start, target = _list((*robot.start, 0.0)), _list((*robot.target, 0.0))
        lines += [
            f"  {robot.name}:",
            f"    start_m: {start}",
            f"    target_m: {target}",
            f"    preset: {{waypoints_m: [{start}, {target}], speed_m_s: {_number(speed)}}}",
            f"    max_speed_m_s: {_number(pace.ugv)}",
            f"    radius_m: {_number(radius)}",
        ]
    runs = ["runs:", "  a: {method: a, expected: {LIVE-GOAL: nothing}}", "  d: {method: d}"]
    return Imported("\n".join([*lines, "", *world, "", *runs]) + "\n", {**beside}, says)


def _map(file: str) -> list[str]:
    return ["map:", *(f"  {line}" for line in text_of({"file": file}).splitlines())]


def _pgm(occupied: Cells) -> bytes:
    """A PGM image in which occupied cells are black; the lowest row comes last."""
    rows, columns = occupied.shape
    return b"P5\n%d %d\n255\n" % (columns, rows) + np.where(occupied[::-1], 0, 254).astype(np.uint8).tobytes()


def _text(path: Path) -> str:
    """The text of a file that may be hostile."""
    try:
        return files.read_bytes(path, MOST_BYTES, links=True).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError(str(path), "", Fault("not UTF-8 text"), "wanted: a text file") from None


def _new_name(text: str, taken: Collection[str]) -> str:
    """The name of an obstacle: not that of another body, nor one of those that arenas and maps give."""
    base = scenario_name(text, "obstacle")[: MAX_NAME - 10]
    if re.match(r"(arena|map)(_|$)", base):
        base = f"the_{base}"
    name, number = base, 1
    while name in taken:
        number += 1
        name = f"{base}_{number}"
    return name


def _number(value: float) -> str:
    return f"{round(value, 6) + 0.0:.12g}"


def _list(values: Sequence[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _point(values: Sequence[float]) -> Point:
    x, y = (round(value, 6) for value in values)
    return x, y
