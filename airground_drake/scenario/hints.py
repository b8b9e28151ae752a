"""Help for refused files: explanations of YAML mistakes, and of keys that do not exist."""

import re
from typing import NamedTuple

import yaml

LIMITS = 'see "Known limits" in docs/verification.md'

# Patterns of keys that do not exist, and the reasons.
NOT_MODELLED = {
    r"accel|decel|jerk|brak": "acceleration limits are not modelled",
    r"mass|inertia|torque|force|friction|slip|grip": "forces are not modelled: robots have the velocities that are "
    "commanded",
    r"latenc|packet|bandwidth|(message|link|communication).*(delay|loss|rate)": "what happens to messages is under "
    "channel",
    r"(sensor|sensing|position|measurement|odometry).*(noise|error|drift)|occlu|field_of_view|fov": "sensing within "
    "range misses nothing, and sensing.position_error_m bounds errors of positions",
    r"batter|energy|fuel|power": "energy is not modelled",
    r"wind|weather|slope|terrain": "the ground is flat, and there is no wind",
}  # fmt: skip


def not_modelled(name: str) -> str:
    """Why there is no key with such a name, as the beginning of a message; empty if nothing is known."""
    for pattern, why in NOT_MODELLED.items():
        if re.search(pattern, name.lower()):
            return f"{why}; {LIMITS}; "
    return ""


FAST_M_S, FAR_M = 50.0, 1000.0  # greater speeds and coordinates may be in another unit


def fast(speed_m_s: float) -> str:
    """The end of a message about a speed, m/s, that may be in another unit; '' for others."""
    return f"; speeds are in m/s: this is {3.6 * speed_m_s:g} km/h" if speed_m_s > FAST_M_S else ""


def far(place_m: float) -> str:
    """The end of a message about a coordinate, m, that may be in another unit; '' for others."""
    return f"; coordinates are in m: this is {place_m / 1000.0:g} km" if place_m > FAR_M else ""


def plugin_path(name: str) -> str:
    """The end of a message that refuses a name of third-party code, if it looks like a path; '' if not."""
    looks_like_a_path = re.search(r"[/\\]|\.py\b", name)
    rule = " with a path from the folder of the scenario, such as robots/mine.py:Mine: folders and file have letters, "
    return f"{rule}digits, _ and - only, so no .., no / at the beginning, no spaces" if looks_like_a_path else ""


class Slip(NamedTuple):
    """A mistake in YAML: its line, from 1, what it is, and what is wanted."""

    line: int
    what: str
    wanted: str


_NO_SPACE = re.compile(r"\s*(- )?[\w.-]+:[^\s/]")  # a key without a space after its colon; `scheme://` does not count
_QUOTES = "wanted: quotes around a text with ': ' or ' #' in it"


def slip(error: yaml.MarkedYAMLError, text: str) -> Slip | None:
    """A frequent mistake in plain words; None for others."""
    mark, problem = error.problem_mark, error.problem or ""
    if mark is None:
        return None
    lines, line = [*text.splitlines(), ""], mark.line + 1
    begun = error.context_mark.line + 1 if error.context_mark else line
    here = lines[min(mark.line, len(lines) - 1)]
    if "'\\t'" in problem:
        return Slip(line, "a tab where YAML allows none", "wanted: spaces, no tabs")
    if "cannot start any token" in problem:
        sign = problem.split("'")[1]
        return Slip(line, f"a text that begins with {sign}", "wanted: quotes around it")
    if "mapping values are not allowed" in problem:
        before = next((n for n in range(mark.line, 0, -1) if lines[n - 1].strip()), 0)
        if before and _NO_SPACE.match(lines[before - 1]) and ": " not in lines[before - 1]:
            return Slip(before, "no space after the colon of a key", "wanted: key: value")
        if len(re.findall(r":(?= |$)", here)) > 1:
            return Slip(line, "a second colon in a line", _QUOTES)
        return Slip(line, "a key where none can be", "wanted: keys of one mapping, each in a line, equally indented")
    if problem.startswith(("expected ',' or ']'", "expected ',' or '}'")):
        sign = problem[len("expected ',' or '")]
        return Slip(begun, "brackets that are not closed", f"wanted: {sign} at the end")
    if "end of stream" in problem and "quoted" in (error.context or ""):
        return Slip(begun, "quotes that are not closed", "wanted: the same quotes at the end of the text")
    if problem.startswith("expected <block end>"):
        return Slip(line, "an indentation that does not fit the lines above", "wanted: equal indentation in a mapping")
    return None
