"""The marks of lines, and how lists and numbers are put into words."""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


class Mark(NamedTuple):
    """How a mark is shown: its icon, its meaning for the legend and screen readers, and the class of its colour."""

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


def unbroken(text: str) -> str:
    """A line that is broken neither before a unit nor within a comparison: no-break spaces are there."""
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


def joined(words: Sequence[str]) -> str:
    """Words as a list: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
