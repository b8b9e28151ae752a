"""Phrases about runs and robots that the first screen and the list of what needs attention share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

from airground_drake.registry import METHODS
from airground_drake.report.outcomes import Course

K = TypeVar("K")
V = TypeVar("V")

MARKS = {"yes": "✓", "partly": "≈", "no": "✗", "open": "?", "none": "\N{EN DASH}", "": " "}
"""Marks of a line and their icons; '' continues the line before."""
MEANINGS = {"yes": "yes", "partly": "in part", "no": "no", "open": "not known", "none": "neither good nor bad"}
"""What the marks mean, for their legend and for screen readers."""
MAX_NAMES = 3
"""Maximum number of robots that a line names."""
REFUSALS = {
    "waits": "waiting looked cheaper",
    "first_stage": "waiting looked cheaper",
    "not_cheaper": "the UGV's own task looked as good",
    "no_difference": "it would have changed nothing",
    "no_plan": "no outcome could be computed",
    "stalls": "it would have stalled on the way",
    "exhausted": "it had used all of its tries",
}
"""Why a proposal was refused, in a few words."""
SETTINGS = {
    ("gatekeeper.route", "mixed_integer"): "half-plane problems of (26) solved to optimality, best plan by (26) kept",
    ("gatekeeper.route", "relaxed"): "(27) with half-planes, sum-up rounding (28)-(29)",
    ("gatekeeper.route", "nonlinear"): "(27) by multiple shooting, sum-up rounding (28)-(29)",
    ("gatekeeper.rule", "hysteresis"): "our hysteresis",
    ("gatekeeper.rule", "first_stage"): "first stage applied",
}
"""What keys of the gatekeeper of method (c) mean, in a few words."""


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


def of_run(resolved: Mapping[str, Any], course: Course) -> str:
    """What a run is: its method, or the method's identifier and what the run sets differently."""
    if course.method not in METHODS:
        return course.method
    if changed := resolved["runs"][course.name].get("set"):
        says = [SETTINGS.get((key, str(value)), f"{key} {value}") for key, value in changed.items()]
        return f"({course.method}) with {', '.join(says)}"
    return METHODS[course.method].says


def gatekeeper(resolved: Mapping[str, Any]) -> str:
    """How the gatekeeper of method (c) solves and answers, unless a run sets it differently."""
    pairs = ((f"gatekeeper.{key}", resolved["gatekeeper"][key]) for key in ("route", "rule"))
    return ", ".join(SETTINGS.get(pair, " ".join(pair)) for pair in pairs)


def refusal(reason: str) -> str:
    """The reason of a refusal in words."""
    return REFUSALS.get(reason, reason.replace("_", " "))


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """The values of each key, in the order in which the keys first appear."""
    found: dict[K, list[V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def counted(count: int, noun: str) -> str:
    """A number and its noun: "1 check", "2 checks"."""
    return f"{count} {noun}{'s' * (count != 1)}"


def joined(words: Sequence[str]) -> str:
    """Words as a list: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def methods(those: Sequence[Course]) -> str:
    """The methods of some runs: "(d)", "(c) and (d)"."""
    return joined(list(dict.fromkeys(f"({course.method})" for course in those)))


def methods_are(those: Sequence[Course]) -> str:
    """The same as the beginning of a sentence: "method (d) is", "methods (c) and (d) are"."""
    one = len({course.method for course in those}) == 1
    return f"method {methods(those)} is" if one else f"methods {methods(those)} are"


def trouble(those: Sequence[Course]) -> str:
    """What went wrong in some runs: who came too near, or did not arrive."""
    if unsafe := next((course for course in those if course.safe is False), None):
        hit = {event["robot"] for event in unsafe.collisions}
        away = [robot for robot in unsafe.away or () if robot not in hit]
        return (colliding(unsafe) if hit else intrusion(unsafe)) + (f", and {_absent(away)}" if away else "")
    away = list(dict.fromkeys(robot for course in those for robot in course.away or {}))
    if all(course.stuck == (course.away or {}).keys() for course in those):
        return f"{_robots(away)} {'is' if len(away) == 1 else 'are'} stuck"
    return _absent(away)


def intrusion(course: Course) -> str:
    """Who came how near to what in a run that was not safe."""
    if course.near and course.near[0].is_short:
        least = course.near[0]
        if least.appeared:
            return f"{least.other} appears {least} from {least.robot} (nobody's doing)"
        return f"{least.robot} comes within {least} of {least.other}"
    hit = next(iter(course.collisions), None)
    return f"{hit['robot']} collides at {hit['t_s']:.2f} s" if hit else course.why


def more_pairs(course: Course) -> str:
    """How many pairs besides the first came too near."""
    more = sum(near.is_short for near in course.near) - 1
    return f"; {counted(more, 'more pair')}" if more > 0 else ""


def colliding(course: Course) -> str:
    """Who collides in a run."""
    names = list(dict.fromkeys(event["robot"] for event in course.collisions))
    return f"{_robots(names)} collide{'s' * (len(names) == 1)}"


def _absent(names: Sequence[str]) -> str:
    return f"{_robots(names)} {'does' if len(names) == 1 else 'do'} not arrive"


def _robots(names: Sequence[str]) -> str:
    return joined(names) if len(names) <= MAX_NAMES else f"{len(names)} robots"
