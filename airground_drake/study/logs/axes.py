"""Axes of a log. In a scenario z is up; other axes are recognised, or the command asks for them."""

import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import LogError
from airground_drake.check.files import Json
from airground_drake.check.scenario import robots_of
from airground_drake.study.logs.stream import PER_M, Stream
from airground_drake.study.logs.units import begin_at_starts

# Axes of a log along x, y and z of the scenario: as they are; and of one with x north, y east, z down.
PLAIN, NED = "x,y,z", "y,x,-z"
# Axes that other programs use.
OTHERS = {
    NED: "x is north, y east and z down", "x,-y,-z": "z is down", "x,-z,y": "y is up", "z,x,y": "y is up",
    "-x,z,y": "y is up", "-z,-x,y": "y is up", "x,z,y": "y is up, as in Unity",
}  # fmt: skip
LEVEL_M, WIDE_M = 0.1, 0.5  # heights of ground vehicles vary by less than this, and their horizontal motion is wider, m
BELOW_M = 0.2  # an aircraft lower than this is below the ground, m
# In names of files, topics and frames: the axes of PX4 and MAVLink.
_IS_NED = re.compile(r"(?<![a-z])ned(?![a-z])|vehicle_local_position", re.IGNORECASE)


def parsed(text: str) -> list[tuple[int, float]]:
    """The column and sign of each axis: `x,-z,y`; ValueError for anything else."""
    if not re.fullmatch(r"[+-]?[xyz](,[+-]?[xyz]){2}", text) or not {*"xyz"} <= {*text}:
        raise ValueError(text)
    return [("xyz".index(part[-1]), -1.0 if part[0] == "-" else 1.0) for part in text.split(",")]


def chosen(streams: Mapping[str, Stream], choice: Mapping[str, str]) -> None:
    """Convert positions to the axes of the command line, by body; '' is for all others."""
    for name, stream in streams.items():
        _turn(stream, choice.get(name, choice.get("", PLAIN)))


def _turn(stream: Stream, axes: str) -> None:
    places = _turned(stream.places, axes)
    if not np.isfinite(places[:, :2]).all():
        raise LogError(f"{stream.label} has rows without z, and --axes {axes} needs them")
    stream.places = places


def _turned(places: Array, axes: str) -> Array:
    return np.stack([sign * places[:, axis] + 0.0 for axis, sign in parsed(axes)], axis=1)


def recognised(streams: Mapping[str, Stream], scenario: Json, without: Collection[str]) -> list[str]:
    """Convert positions named as NED if they then begin at the scenario's starts; returns remarks."""
    robots = {name: stream for name, stream in streams.items() if name in robots_of(scenario) and name not in without}
    robots = {name: stream for name, stream in robots.items() if len(stream.whole)}
    if not robots or _fits(robots, scenario, PLAIN):
        _ask(robots, scenario, _below(robots, scenario), [NED, "x,-y,-z"])
        return []
    named = {
        name: stream for name, stream in robots.items()
        if any(map(_IS_NED.search, (stream.name, stream.frame, stream.child, Path(stream.source).name)))
    }  # fmt: skip
    if named and _fits(named, scenario, NED):
        for turned in named.values():
            _turn(turned, NED)
        names = ", ".join(named)
        return [f"positions of {names} are taken as NED, as the log calls them: x is north, y east, z down"]
    down, up = [NED, "x,-y,-z"], [axes for axes, says in OTHERS.items() if says.startswith("y is up")]
    _ask(robots, scenario, _below(robots, scenario), down)
    if named:
        _ask(robots, scenario, f"positions of {', '.join(named)} are called NED in the log", down)
    _ask(robots, scenario, _level(robots, scenario), up)
    if fitting := [axes for axes in OTHERS if _fits(robots, scenario, axes)]:
        where = f"{', '.join(robots)} begin where the scenario has them only if {OTHERS[fitting[0]]}"
        _ask(robots, scenario, where, fitting)
    return []


def _ask(robots: Mapping[str, Stream], scenario: Json, why: str, likely: Iterable[str]) -> None:
    """Raise LogError if the axes are unclear, suggesting first those that match the robots' starts."""
    if why:
        first = sorted(likely, key=lambda axes: not _fits(robots, scenario, axes))[0]
        begins = ", with which they begin at their starts," if _fits(robots, scenario, first) else ""
        option = f"--axes={first}" if first[0] == "-" else f"--axes {first}"
        wanted = f"wanted: {option}{begins} if {OTHERS[first]}, or --axes {PLAIN} if they are as in the scenario"
        raise LogError(f"the axes of the log are not clear: {why}; {wanted}")


def _fits(robots: Mapping[str, Stream], scenario: Json, axes: str) -> bool:
    """Whether robots begin at the scenario's starts, some far enough from (0, 0) to distinguish axes."""
    first_m = {
        name: _turned(stream.places[:1], axes)[0, :2] / PER_M[stream.length_unit] for name, stream in robots.items()
    }
    return begin_at_starts(first_m, scenario)


def _below(robots: Mapping[str, Stream], scenario: Json) -> str:
    """The robots that fly below the ground, in words; '' without any."""
    for name, stream in robots.items():
        heights = stream.places[:, 2] / PER_M[stream.length_unit]
        if name not in scenario["ugvs"] and np.isfinite(heights).any() and np.nanmedian(heights) < -BELOW_M:
            return f"{name} is at a height of {float(np.nanmedian(heights)):.3g} m, below the ground"
    return ""


def _level(robots: Mapping[str, Stream], scenario: Json) -> str:
    """Why y may be the height of ground robots, in words; '' if it is not."""
    ugvs = [stream for name, stream in robots.items() if name in scenario["ugvs"]]
    heights = [stream.places[:, 1:] / PER_M[stream.length_unit] for stream in ugvs]  # if y, or z, is the height
    if not ugvs or not np.isfinite(np.concatenate(heights)).all():
        return ""
    inner = [np.percentile(places, (2.0, 98.0), axis=0) for places in heights]  # a body that is lost is far away
    varies = max(float(span[1, 0] - span[0, 0]) for span in inner)
    spans = float(max(span[1, 1] for span in inner) - min(span[0, 1] for span in inner))
    if varies > LEVEL_M or spans < WIDE_M:
        return ""
    return f"y of what drives on the ground varies by {varies:.2g} m, and z spans {spans:.3g} m"
