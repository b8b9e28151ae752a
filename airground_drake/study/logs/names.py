"""Which body of a scenario a name in a log is about."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping

# What loggers put after a body's name.
AFTER = re.compile(r"_(?:pos|position|pose|odom|odometry|translation|p)$", re.IGNORECASE)
# Words in a name that say that it is not about where a body is.
ELSEWHERE = {
    "orientation", "rotation", "quaternion", "quat", "rot", "twist", "linear", "angular", "velocity", "vel",
    "acceleration", "accel", "acc", "force", "torque", "imu", "gyro", "mag", "euler", "rpy", "cmd", "command", "goal",
    "target", "ref", "reference", "desired", "setpoint", "plan", "waypoint", "initialpose", "covariance", "error",
    "marker", "markers",
}  # fmt: skip


def segments(name: str) -> list[str]:
    """The parts of a path: a topic, a frame, or the name of a column."""
    return [each for each in re.split(r"[/.\s:|]+", name) if each]


def is_elsewhere(name: str, bodies: Collection[str]) -> bool:
    """Whether a name says that it is not about where a body is: a goal, a velocity. Names of bodies do not count."""
    words = (word for each in segments(name) if each not in bodies for word in re.split(r"[^A-Za-z]+", each.lower()))
    return not ELSEWHERE.isdisjoint(words)


def body_of(name: str, bodies: Collection[str], *, is_file: bool = False) -> str:
    """The one body that a name names, or ''."""
    # It is a part of the path: `/tb3_0/odom`, `tb3_0_pose`. The stem of a file may contain it between other words:
    # `run2_tb3_0-odom`. Capitals count only if two bodies differ by them.
    parts = {part for each in segments(name) for part in (each, AFTER.sub("", each))}
    found = {body for body in bodies if body in parts}
    if not found:
        low = {part.lower() for part in parts}
        found = {body for body in bodies if body.lower() in low}
    if not found and is_file:
        found = {body for body in bodies if re.search(rf"(?<![A-Za-z0-9]){re.escape(body)}(?![A-Za-z0-9])", name)}
        found -= {body for body in found for other in found if body != other and body in other}
    return found.pop() if len(found) == 1 else ""


def renamed(names: Iterable[str], rename: Mapping[str, str]) -> str:
    """The body that `--rename` gives to the first of some names, or ''; a slash at the ends does not count."""
    known = {key.strip("/"): body for key, body in rename.items()}
    return next((known[name.strip("/")] for name in names if name.strip("/") in known), "")
