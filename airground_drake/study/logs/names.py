"""Which body of a scenario a name in a log is about."""

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
    return [segment for segment in re.split(r"[/.\s:|]+", name) if segment]


def is_elsewhere(name: str, bodies: Collection[str]) -> bool:
    """Whether a name says that it is not about where a body is: a goal, a velocity. Names of bodies do not count."""
    words = (
        word for segment in segments(name) if segment not in bodies for word in re.split(r"[^A-Za-z]+", segment.lower())
    )
    return not ELSEWHERE.isdisjoint(words)


def body_of(name: str, bodies: Collection[str], *, is_file: bool = False) -> str:
    """The one body that a name names, or ''."""
    # It is a part of the path: `/tb3_0/odom`, `tb3_0_pose`. The stem of a file may contain it between other words:
    # `run2_tb3_0-odom`. Capitals count only if two bodies differ by them.
    parts = {part for segment in segments(name) for part in (segment, AFTER.sub("", segment))}
    named = {body for body in bodies if body in parts}
    if not named:
        low = {part.lower() for part in parts}
        named = {body for body in bodies if body.lower() in low}
    if not named and is_file:
        named = {body for body in bodies if re.search(rf"(?<![A-Za-z0-9]){re.escape(body)}(?![A-Za-z0-9])", name)}
        named -= {body for body in named for other in named if body != other and body in other}
    return named.pop() if len(named) == 1 else ""


def renamed(names: Iterable[str], rename: Mapping[str, str]) -> str:
    """The body that `--rename` gives to the first of some names, or ''; a slash at the ends does not count."""
    known = {key.strip("/"): body for key, body in rename.items()}
    return next((known[name.strip("/")] for name in names if name.strip("/") in known), "")
