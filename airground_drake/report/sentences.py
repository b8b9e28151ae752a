"""The marks of lines, and how lists, numbers and distances are put into words."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

K = TypeVar("K")
V = TypeVar("V")
YES_NO = "yes/no"  # unit of 1 and 0 that stand for an answer
# Units at the ends of names of quantities, and their notation; the longest first.
UNITS = {
    "1_m2_s": "1/(m²s)", "1_m_s": "1/(m s)", "m_sqrt_s": "m/√s", "m2_s": "m²s", "m_s": "m/s", "1_s": "1/s",
    "1_m": "1/m", "m": "m", "s": "s",
}  # fmt: skip


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


class Mark(NamedTuple):
    """The appearance of a mark: its icon, its meaning for the legend and screen readers, and its colour class."""

    icon: str
    meaning: str
    look: str


# Marks of lines, never by colour alone; '' continues the line before.
MARKS = {
    "yes": Mark("✓", "yes", "good"),
    "partly": Mark("≈", "in part", "tuned"),
    "no": Mark("✗", "no", "bad"),
    "open": Mark("?", "not known", "open"),
    "none": Mark("\N{EN DASH}", "neither good nor bad", "idle"),
    "": Mark(" ", "", ""),
}
MAX_NAMES = 3  # maximum number of robots that a line names
SLACK_M = 1e-9  # a distance counts as kept if it falls short of the required one by less, as verdicts have it


def unbroken(text: str) -> str:
    """The line with no-break spaces before units and within comparisons."""
    return re.sub(r"(?<=\d) (?=[ms]\b|[≥<])|(?<=[≥<]) ", "\N{NO-BREAK SPACE}", text)


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """The values of each key, in the order in which the keys first appear."""
    groups: dict[K, list[V]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def counted(count: int, noun: str) -> str:
    """A number and its noun: "1 check", "2 checks"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def some(words: Sequence[str], most: int) -> str:
    """The first few words as a list, and how many more there are."""
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def joined(words: Sequence[str]) -> str:
    """Words as a list: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def split(key: str) -> tuple[str, str]:
    """The name and the unit in a key: `min_distance_m` is "min distance" and "m"."""
    for unit in UNITS:
        if key.endswith(f"_{unit}"):
            return key.removesuffix(f"_{unit}").replace("_", " "), UNITS[unit]
    return key.replace("_", " "), ""


def number(x: Any, digits: int = 4) -> str:
    if x is None:
        return "\N{EN DASH}"
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        return str(x)
    if isinstance(x, int) or (x == int(x) and abs(x) < 1e6):
        return str(int(x))
    return f"{x:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def as_text(x: Any, unit: str = "", digits: int = 4) -> str:
    """A value in a line: numbers and vectors with their units, those of a record with their names."""
    if isinstance(x, Mapping):
        parts = ((split(str(key)), item) for key, item in x.items())
        return "; ".join(f"{name} {as_text(item, own or unit, digits)}" for (name, own), item in parts) or "none"
    if isinstance(x, list | tuple):
        if x and all(isinstance(item, int | float) for item in x):
            return f"({', '.join(number(item, digits) for item in x)}) {unit}".rstrip()
        return ", ".join(as_text(item, unit, digits) for item in x) or "none"
    if isinstance(x, bool) or (unit == YES_NO and x is not None):
        return "yes" if x else "no"
    return f"{number(x, digits)} {unit}".rstrip() if isinstance(x, int | float) else number(x)


def named(body: str, at_m: Sequence[float] | None = None) -> str:
    """The name of a body in words; of the map, which is everywhere, with the place that is meant, m."""
    return f"the map at ({', '.join(f'{axis + 0.0:.2f}' for axis in at_m)})" if at_m else body


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    apart = metres(value_m, required_m)
    return f"{apart} (overlap)" if apart.startswith("-") else apart


def metres(value_m: float, required_m: float) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    decimals = 3
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
