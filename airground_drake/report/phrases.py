"""Phrases about runs and robots that the first screen and the list of what needs attention share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeVar

from airground_drake.base.statuses import PASSING
from airground_drake.registry import METHODS
from airground_drake.report.outcomes import RunOutcome, distance

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


ROLES = ("first", "second", "robot", "other")
"""Keys that hold the name of a body in the place of a claim."""


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


def of_run(resolved: Mapping[str, Any], course: RunOutcome) -> str:
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


def labels(those: Sequence[RunOutcome], among: Sequence[RunOutcome]) -> tuple[list[str], list[str]]:
    """Methods all of whose runs among `among` are those: "(d)"; and the names of the other runs of those."""
    apart = {course.method for course in among if course not in those}
    by_method = [f"({course.method})" for course in those if course.method not in apart]
    return list(dict.fromkeys(by_method)), [course.name for course in those if course.method in apart]


def under(those: Sequence[RunOutcome], among: Sequence[RunOutcome]) -> str:
    """Those runs as a condition: "under (c) and (d)", "under (b) and in run c_literal"."""
    of_methods, runs = labels(those, among)
    parts = [f"under {joined(of_methods)}" if of_methods else "", f"in {_plural('run', runs)}" if runs else ""]
    return joined([part for part in parts if part])


def subject(those: Sequence[RunOutcome], among: Sequence[RunOutcome]) -> str:
    """Those runs as the subject of a sentence: "method (d) is", "methods (b) and (c) and run d_far are"."""
    of_methods, runs = labels(those, among)
    parts = [_plural("method", of_methods) if of_methods else "", _plural("run", runs) if runs else ""]
    return f"{joined([part for part in parts if part])} {'is' if len(of_methods) + len(runs) == 1 else 'are'}"


def _plural(noun: str, names: Sequence[str]) -> str:
    return f"{noun}{'s' * (len(names) != 1)} {joined(names)}"


def trouble(course: RunOutcome) -> str:
    """What went wrong in a run: who came too near, and who did not arrive."""
    away = [robot for robot in course.away or () if robot not in course.hits]
    told = [] if course.safe is not False else [colliding(course) if course.hits else intrusion(course)]
    told = [*map(partial(encounter, course), course.encounters[:1])] if course.blameless else told
    return ", and ".join([*told, *([_absent(course, away)] if away else [])])


def encounter(course: RunOutcome, one: Mapping[str, Any]) -> str:
    """How an obstacle that moves came too near to a robot by its own motion, and what the robot did."""
    robot, mover, apart = one["first"], one["second"], f"{one['gap_m']:.2f} m"
    if one["appeared"]:
        return f"{mover} appeared {apart} from {robot}: nobody's doing"
    if one["caught_s"] and one["blocked_by"]:
        begin, end = (f"{time_s:.2f}" for time_s in one["caught_s"])
        between = joined([f"{'wall ' * (name in course.walls)}{name}" for name in one["blocked_by"][:MAX_NAMES]])
        kept = {f"{near.required_m:.2f} m from {near.other} was kept" for near in course.near
                if robot == near.robot and near.other in one["blocked_by"] and not near.is_short}  # fmt: skip
        told = f"{robot} was caught between {mover} and {between}, {begin} to {end} s"
        told += f": {'; '.join([f'{mover} came to {apart} by its own motion', *sorted(kept)])}"
        return f"{told}. It had nowhere to retreat, and stood" if one["reaction"] == "stood" else told
    how = f"; {robot} {one['reaction']}"
    how += f", {one['speed_m_s']:.2f} m/s" if one["reaction"].startswith("retreated") else ""
    at = f"at {one['t_s']:.2f} s ({apart}, required {one['required_m']:.2f} m)"
    return f"{mover} {'ran into' if one['collided'] else 'came too near to'} {robot} {at}{how}"


def too_fast(course: RunOutcome) -> str:
    """Which obstacles moved faster than declared, and what is proved all the same."""
    told = []
    for mover, each in course.faster.items():
        speeds = f"at {each['too_fast_m_s']:.2f} m/s at {each['too_fast_s']:.2f} s, declared {each['declared_m_s']:.2f}"
        lost = f"{each['safe_distance_m']:.2f} m from {mover} is not promised from then on"
        told.append(f"{mover} moved {speeds}: {lost}")
    still = ["no robot brought itself too near"] if course.own_doing is False else []
    still += ["distances from walls and robots"] if course.else_met else []
    return "; ".join(told) + (f". Still proved: {'; '.join(still)}" if still else "")


def intrusion(course: RunOutcome) -> str:
    """Who came how near to what in a run that was not safe."""
    if course.near and course.near[0].is_short:
        least = course.near[0]
        if least.appeared:
            return f"{least.other} appears {least} from {least.robot} (nobody's doing)"
        return f"{least.robot} comes within {least} of {least.other}"
    return course.why


def more_pairs(course: RunOutcome, named: int = 1) -> str:
    """How many pairs besides those named came too near."""
    more = sum(near.is_short for near in course.near) - named
    return f"; {counted(more, 'more pair')}" if more > 0 else ""


def colliding(course: RunOutcome) -> str:
    """Who collides in a run."""
    names = list(course.hits)
    return f"{_robots(names)} collide{'s' * (len(names) == 1)}"


def collision(hit: Mapping[str, Any]) -> str:
    """Who collided with what and when, by the event."""
    return f"{hit['robot']} collides with {hit.get('other') or hit['obstacle']} at {hit['t_s']:.2f} s"


def ending(course: RunOutcome, robot: str) -> str:
    """How a robot ended that neither arrived nor collided, without the verb "is"."""
    known = course.on_the_way.get(robot)
    if robot in course.stuck:
        return "stuck"
    if known and known["stands"]:
        return "standing still"
    if known and known["left_s"] is not None:
        return f"still moving at the end (about {rounded(known['left_s'])} s more)"
    return "still moving at the end" if known else "short of its target"


def rounded(value: float) -> str:
    """Two digits of a number, without an exponent."""
    return f"{float(f'{value:.2g}'):.15g}"


def kept_away(course: RunOutcome, robot: str) -> str:
    """Since when a robot has stood because an obstacle that moves is at its target; '' if it has not."""
    found = course.on_the_way.get(robot, {}).get("kept_away")
    if not found:
        return ""
    least = min(
        (near.value_m for near in course.near if {near.robot, near.other} == {robot, found["by"]}), default=None
    )
    never = f" (never nearer than {least:.2f} m)" if least is not None else ""
    where = f"{found['off_m']:.2f} m from its target, {'on' if found['on'] else 'near'} which {found['by']} stands"
    return f"from {found['since_s']:.1f} s it stood {where}{never}"


def _absent(course: RunOutcome, names: Sequence[str]) -> str:
    """How those ended that did not arrive, and for whom the UAV found no way."""
    apart = [f"{robot} does not arrive: {why}" for robot in names if (why := kept_away(course, robot))]
    if apart:
        rest = [robot for robot in names if not kept_away(course, robot)]
        return "; ".join([*apart, *([_absent(course, rest)] if rest else [])])
    told = grouped((ending(course, robot), robot) for robot in names)
    clauses = [f"{_robots(alike)} {'is' if len(alike) == 1 else 'are'} {how}" for how, alike in told.items()]
    lost = [robot for robot in names if robot in course.no_way]
    return joined(clauses) + (f": {found_no_way(lost)}" if lost else "")


def found_no_way(names: Sequence[str]) -> str:
    """For whom the UAV found no way."""
    return f"the UAV found no way for {_robots(names)}"


def _robots(names: Sequence[str]) -> str:
    return joined(names) if len(names) <= MAX_NAMES else f"{len(names)} robots"


def place_of(claim: Mapping[str, Any]) -> dict[str, Any]:
    """Where the margin of a claim is, and its counterexample."""
    return {**claim["where"], **(claim["counterexample"] or {})}


def bodies_of(claim: Mapping[str, Any]) -> list[str]:
    """The bodies that a claim names."""
    place = place_of(claim)
    return list(dict.fromkeys(str(place[name]) for name in ROLES if isinstance(place.get(name), str)))


def in_words(claim: Mapping[str, Any]) -> str:
    """What came of a claim, as far as it is known: who, how far from what was allowed, when."""
    place, who = place_of(claim), " and ".join(bodies_of(claim))
    known = {name: value for name, value in place.items() if isinstance(value, float | int)}
    at = f", {known['t_s']:.3f} s" if "t_s" in known else ""
    if claim["status"] in PASSING:
        idle = claim["exercised"] == 0
        return f"nothing put it to the test: no {claim['exercised_by']}" if idle else f"{claim['status']} all the same"
    if claim["status"] != "refuted":
        why = claim["evidence"].get("reason") or claim["evidence"].get("error")
        return why if isinstance(why, str) else "could not be decided"
    if {"min_distance_m", "safe_distance_m"} <= known.keys():
        apart = distance(known["min_distance_m"], known["safe_distance_m"])
        return f"{who} at {apart}, {known['safe_distance_m']:g} m required{at}"
    if {"distance_m", "margin_m"} <= known.keys() and "condition" in place:
        allowed = known["distance_m"] + known["margin_m"]
        ended = f"collided at {known['collided_s']:.2f} s," if "collided_s" in known else "ended"
        return f"{who} {ended} {known['distance_m']:.2f} m from where it must end, {allowed:g} m allowed"
    who = f"{who}: " if who else ""
    if {"parameter", "built", "scenario"} <= place.keys():
        return f"{who}{place['parameter']} was built as {place['built']}, the scenario has {place['scenario']}"
    margin, unit = known.get("margin", claim["margin"]), place.get("unit", claim["unit"])
    if margin is not None:
        quantity = place.get("hypothesis") or place.get("condition") or claim["quantity"] or "margin"
        missed = f"missed by {-margin:.3g} {unit}" if margin < 0.0 else f"{margin:.3g} {unit} left"
        return f"{who}{quantity} {missed}{at}"
    what = next((str(place[key]) for key in ("quantity", "what", "kind", "reason") if place.get(key)), "refuted")
    return f"{who}{what}{at}"
