"""Scenarios made from BARN's Gazebo worlds, ROS maps and MovingAI's benchmarks."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Sequence
from pathlib import Path, PureWindowsPath
from typing import NamedTuple

import numpy as np

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError, one_line
from airground_drake.maps import gazebo, movingai, sites
from airground_drake.maps.rectangles import Cells
from airground_drake.scenarios import map_file
from airground_drake.scenarios.document import text_of
from airground_drake.scenarios.limits import MAX_NAME

MOST_BYTES = 16_000_000
"""Most bytes of a world, a map or an imported scenario."""
SPEED_M_S = 1.0
"""Speed of presets."""
FAITH = 1.5
"""A run lasts this many times as long as the longest way at `SPEED_M_S`, and `PATIENCE_S` longer."""
PATIENCE_S = 20.0
BARN = ((-2.25, 3.0), (-2.25, 13.0))
"""Start and goal of the BARN challenge in its worlds 0 to 299 (`run.py` of its repository), m."""
CLEARANCE_M = 1.0
"""The UAV flies at least so far above the highest obstacle."""

Point = tuple[float, float]


class Robot(NamedTuple):
    """A UGV: its name, start and target, m."""

    name: str
    start: Point
    target: Point


class Sizes(NamedTuple):
    """Sizes of robots and distances, m.

    Attributes:
        radius_m: radius of each UGV.
        distance_m: what UGVs keep from obstacles and from one another, between surfaces.
    """

    radius_m: float
    distance_m: float


class Imported(NamedTuple):
    """A scenario to be written.

    Attributes:
        text: of the scenario's file.
        beside: content of further files, by path.
        says: what was read and chosen, in words.
    """

    text: str
    beside: dict[Path, bytes]
    says: list[str]


def barn(path: Path, name: str, robots: Sequence[Robot], sizes: Sizes) -> Imported:
    """The scenario of a Gazebo world; without robots, one goes where the BARN challenge asks it to go.

    Raises:
        ScenarioError: if the file cannot be used.
    """
    world = gazebo.world(_text(path), str(path))
    if not world.solids:
        allowed = "wanted: a world with cylinders, spheres or boxes in its models"
        raise ScenarioError(str(path), "", Fault("no obstacle is in it"), allowed)
    robots = robots or [Robot("ugv1", *BARN)]
    taken = {each.name for each in robots} | {"uav"}
    lines = ["obstacles:"]
    for solid in world.solids:
        own = _new_name(solid.name, taken)
        taken.add(own)
        place = f"position_m: {_list((solid.pose.x, solid.pose.y, 0.0))}, height_m: {_number(solid.top)}"
        size = f"radius_m: {_number(solid.size[0])}"
        if len(solid.size) == 2:
            size = f"size_m: {_list(solid.size)}, heading_rad: {_number(solid.pose.heading)}"
        lines.append(f"  {own}: {{{place}, {size}}}")
    says = [f"{len(world.solids)} obstacles", *(f"left out: {each}" for each in world.left_out)]
    top = max(solid.top for solid in world.solids)
    longest = max(math.dist(each.start, each.target) for each in robots)
    return Imported(_scenario(path, name, robots, sizes, says, lines, 2.0 * longest, top), {}, says)


def ros_map(path: Path, name: str, folder: Path, robots: Sequence[Robot], count: int, sizes: Sizes) -> Imported:
    """The scenario of a map_server's map; without robots, some are put where they have room and a way.

    Args:
        path: of the map's YAML file.
        name: of the scenario.
        folder: in which the scenario will be; the map is named from there.
        robots: the UGVs; may be empty.
        count: number of UGVs if none is given.
        sizes: of robots and distances.

    Raises:
        ScenarioError: if the files cannot be used, or there is no room for the robots.
    """
    found = map_file.read(path)
    grid = found.grid()
    rows, columns = grid.occupied.shape
    says = [
        f"{columns} x {rows} cells of {grid.frame.cell_m:g} m: {found.cells.occupied.sum()} occupied, "
        f"{found.cells.unknown.sum()} unknown"
    ]
    longest = 2.0 * max((math.dist(each.start, each.target) for each in robots), default=0.0)
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
    file = os.path.relpath(path, folder)
    return Imported(_scenario(path, name, robots, sizes, says, _map(file), longest), {}, says)


def mapf(path: Path, map_path: Path | None, name: str, folder: Path, agents: int, cell_m: float) -> Imported:
    """The scenario of a benchmark of MovingAI: its map as a map_server's, its first agents as UGVs.

    A UGV's radius is a fifth of a cell. It keeps a tenth of a cell from others and from obstacles, so it fits through
    gaps of one cell.

    Args:
        path: of the `.scen` file.
        map_path: of the `.map` file; None: where the scenario says, beside it.
        name: of the scenario, and of the map's files.
        folder: in which they will be.
        agents: number of agents.
        cell_m: side of a cell, m.

    Raises:
        ScenarioError: if the files cannot be used, or have fewer agents.
    """
    text = _text(path)
    if not (named := movingai.map_name(text)):
        raise ScenarioError(str(path), "", Fault("no agent is in it"), "wanted: a scenario of MovingAI")
    map_path = map_path or path.parent / PureWindowsPath(named).name  # which knows both kinds of slashes
    cells = movingai.cells(_text(map_path), str(map_path))
    found = movingai.agents(text, str(path), cells)
    moving = [each for each in found if each.start != each.goal]
    if len(moving) < agents:
        fault = Fault(f"{len(moving)} agents with a way to go")
        raise ScenarioError(str(path), "", fault, f"--agents {agents} needs as many")

    def middle(cell: tuple[int, int]) -> Point:
        return _point([(index + 0.5) * cell_m for index in cell])

    robots = [Robot(f"ugv{n}", middle(each.start), middle(each.goal)) for n, each in enumerate(moving[:agents], 1)]
    longest = max(sum(map(abs, np.subtract(each.target, each.start))) for each in robots)
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
    sizes = Sizes(0.2 * cell_m, 0.1 * cell_m)
    return Imported(_scenario(path, name, robots, sizes, says, _map(about.name), longest), beside, says)


def _scenario(
    path: Path,
    name: str,
    robots: Sequence[Robot],
    sizes: Sizes,
    says: Sequence[str],
    world: Sequence[str],
    longest: float,
    top: float = 0.0,
) -> str:
    """The text of a scenario.

    Args:
        path: of the file that it is made of.
        name: of the scenario.
        robots: the UGVs.
        sizes: of robots and distances.
        says: what was read and chosen; becomes comments.
        world: lines with the obstacles or the map.
        longest: a length, m, that no robot's way should exceed.
        top: height of the highest obstacle, m.
    """
    altitude = max(2.0, top + CLEARANCE_M, 2.0 * (sizes.radius_m + sizes.distance_m))
    speed = min(SPEED_M_S, 10.0 * (sizes.radius_m + sizes.distance_m))  # m/s
    duration = math.ceil((FAITH * longest / speed + PATIENCE_S) / 10.0) * 10.0
    middle = np.mean([each.start for each in robots], axis=0)
    kept = f"UGVs have a radius of {_number(sizes.radius_m)} m, and keep {_number(sizes.distance_m)} m from others"
    comments = [f"Made by `airground import` of {path.name}", *says, f"{kept}; presets are straight"]
    lines = [
        *(f"# {one_line(each)}" for each in comments),
        f'name: "{name}"',
        text_of({"title": one_line(f"{len(robots)} UGV{'s' * (len(robots) > 1)} in {path.name}")}).strip(),
        f"duration_s: {_number(duration)}",
        "",
        "uav:",
        f"  start_m: {_list((*middle, altitude))}",
        f"  altitude_m: {_number(altitude)}",
        "",
        "safe_distance:",
        f"  obstacle_m: {_number(sizes.distance_m)}",
        f"  ugv_m: {_number(sizes.distance_m)}",
        f"  air_ground_m: {_number(0.5 * altitude - sizes.radius_m)}",
        f"  collision_m: {_number(0.1 * sizes.distance_m)}",
        "",
        f"control: {{period_s: 0.05, sensing_range_m: {_number(max(4.0, 10.0 * sizes.radius_m))}}}",
        "decision: {threshold: {rule: fixed, zeta_m: 1.0}, release_m: 0.5, noise_period_s: 0.05}",
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
            f"    max_speed_m_s: {_number(1.5 * speed)}",
            f"    radius_m: {_number(sizes.radius_m)}",
        ]
    runs = ["runs:", "  a: {method: a, expected: {LIVE-GOAL: nothing}}", "  d: {method: d}"]
    return "\n".join([*lines, "", *world, "", *runs]) + "\n"


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


def scenario_name(text: str, instead: str) -> str:
    """A text as a name that a scenario may have: letters, digits and underscores; `instead` if nothing is left."""
    return re.sub(r"^[\W\d_]+|[\W_]+$", "", re.sub(r"\W+", "_", text, flags=re.ASCII))[:MAX_NAME] or instead


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
    x, y = (round(each, 6) for each in values)
    return x, y
