"""`airground import FORMAT FILE`: make a scenario of a BARN world, a ROS map, or a benchmark of MovingAI."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import ScenarioError, one_line
from airground_drake.base.limits import MAX_NAME, MAX_UGVS
from airground_drake.base.usage import between, output_file, refuse, whole
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import argument, scenario_name

if TYPE_CHECKING:
    from airground_drake.scenario.imported import Imported

# What can be imported, and the options for it.
FORMATS = {
    "barn": ("radius_m", "distance_m", "ugv", "max_speed_m_s", "height_m"),
    "ros-map": ("radius_m", "distance_m", "ugv", "max_speed_m_s", "ugvs"),
    "mapf": ("agents", "map", "cell_m", "max_speed_m_s"),
}
RADII_M = {"barn": 0.215, "ros-map": 0.15}  # default radius of a UGV: half the width of BARN's Jackal; a TurtleBot
DISTANCE_M, UGVS, AGENTS, CELL_M = 0.1, 3, 4, 1.0
HEIGHT_M = 1.0  # default height of UGVs, m: robots of this kind are lower, with what they carry
SIZES = (0.001, 100.0)  # least and greatest radius and distance, m


def parser() -> Parser:
    size = between(*SIZES)
    radii = ", ".join(f"{kind} {radius:g}" for kind, radius in RADII_M.items())
    return parser_of(
        "import",
        "Make a scenario from a Gazebo world such as BARN's, a ROS map, or a benchmark of MovingAI with its map.",
        {
            "format": option("kind of FILE", choices=tuple(FORMATS)),
            "file": option("barn: NAME.world; ros-map: the map's YAML file; mapf: NAME.scen", "FILE", Path),
            "-o --output": option("default: %(default)s", "YAML", output_file, default=Path("scenario.yaml")),
            "--ugv": option("barn, ros-map: a UGV with its start and target in m; may be repeated (default for barn: "
                            "the challenge's)", "NAME:X,Y:X,Y", _ugv, action="append"),
            "--ugvs": option(f"ros-map: number of UGVs (default: {UGVS})", "N", whole(1, MAX_UGVS)),
            "--radius-m": option(f"barn, ros-map: radius of UGVs (default: {radii})", "R", size),
            "--distance-m": option("barn, ros-map: safe distance of UGVs (default: "
                                   f"{DISTANCE_M:g})", "D", size),
            "--max-speed-m-s": option("largest speed of UGVs; presets have two thirds of it (default: 1.5, less for "
                                      "the smallest UGVs)", "V", between(0.01, 50.0)),
            "--height-m": option("barn: height of UGVs; shapes that begin above it are left out (default: "
                                 f"{HEIGHT_M:g})", "H", size),
            "--agents": option(f"mapf: the first N agents (default: {AGENTS})", "N", whole(1, MAX_UGVS)),
            "--map": option("mapf: the map (default: as FILE names it, in its folder)", "FILE", Path),
            "--cell-m": option(f"mapf: side of a cell (default: {CELL_M:g})", "M", between(0.1, 100.0)),
        },
    )  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    for key in dict.fromkeys(key for theirs in FORMATS.values() for key in theirs):
        if getattr(options, key) is not None and key not in FORMATS[options.format]:
            fitting = " and ".join(kind for kind, theirs in FORMATS.items() if key in theirs)
            return refuse(f"--{key.replace('_', '-')} is for {fitting}")
    if options.ugv and options.ugvs:
        return refuse("--ugv and --ugvs exclude each other")
    files.try_to_create(options.output)
    from airground_drake.scenario.load import load

    made = _imported(options)
    for path in made.beside:
        files.try_to_create(path)
    written = {**made.beside, options.output: made.text.encode()}
    for path, content in written.items():
        files.write_bytes(path, content)
    try:
        load(options.output)
    except ScenarioError:  # where the robots were put by hand, there may be no room
        for path in written:
            path.unlink()
        raise
    print("\n".join(map(one_line, [*made.says, *map(str, made.beside), str(options.output)])))
    print(f"next: airground report {argument(options.output)}")
    return 0


def _imported(options: argparse.Namespace) -> Imported:
    from airground_drake.scenario import imported

    path, folder = options.file, options.output.parent
    name = scenario_name(options.output.stem, options.format.replace("-", "_"))
    speed = options.max_speed_m_s
    if options.format == "mapf":
        cell_m = options.cell_m or CELL_M
        return imported.mapf(path, options.map, name, folder, options.agents or AGENTS, cell_m, speed)
    radius_m, distance_m = options.radius_m or RADII_M[options.format], options.distance_m or DISTANCE_M
    sizes = imported.Sizes(radius_m, distance_m, speed)
    robots = [imported.Robot(*robot) for robot in options.ugv or ()]
    if options.format == "barn":
        return imported.barn(path, name, robots, sizes, options.height_m or HEIGHT_M)
    return imported.ros_map(path, name, folder, robots, options.ugvs or UGVS, sizes)


def _ugv(text: str) -> tuple[str, tuple[float, float], tuple[float, float]]:
    """Parse a UGV: its name, start and target."""
    name, _, rest = text.partition(":")
    try:
        (x, y), (to_x, to_y) = (map(float, point.split(",")) for point in rest.split(":"))
        good = math.isfinite(math.fsum(map(abs, (x, y, to_x, to_y))))
    except ValueError:
        good = False
    if not (good and re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) and len(name) <= MAX_NAME):
        wanted = "wanted: NAME:X,Y:X,Y with start and target in m, such as ugv1:0,0:4.5,2"
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; {wanted}")
    return name, (x, y), (to_x, to_y)
