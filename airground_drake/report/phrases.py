"""Clauses about runs, robots and claims that the first screen and the list of what needs attention share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from airground_drake.base.statuses import PASSING
from airground_drake.registry import METHODS
from airground_drake.report.outcomes import RunOutcome, distance, metres, named
from airground_drake.report.sentences import MAX_NAMES, clause, counted, grouped, joined

SETTINGS = {
    ("gatekeeper.route", "mixed_integer"): "half-plane problems of (26) solved to optimality, best plan by (26) kept",
    ("gatekeeper.route", "relaxed"): "(27) with half-planes, sum-up rounding (28)-(29)",
    ("gatekeeper.route", "nonlinear"): "(27) by multiple shooting, sum-up rounding (28)-(29)",
    ("gatekeeper.rule", "hysteresis"): "our hysteresis",
    ("gatekeeper.rule", "first_stage"): "first stage applied",
}
"""What keys of the gatekeeper of method (c) mean, in a few words."""
RECURSION = "recursion (5) as printed"
"""What a run has in place of the package's composition of priorities."""
ROLES = ("first", "second", "robot", "other")
"""Keys that hold the name of a body in the place of a claim."""


def of_run(resolved: Mapping[str, Any], course: RunOutcome) -> str:
    """What a run is: its method, or the method's identifier and what the run sets differently."""
    if course.method not in METHODS:
        return course.method
    changed = resolved["runs"][course.name].get("set") or {}
    says = [SETTINGS.get((key, str(value)), f"{key} {value}") for key, value in changed.items()]
    says += [RECURSION] * (not course.plain)
    return f"({course.method}) with {', '.join(says)}" if says else METHODS[course.method].says


def gatekeeper(resolved: Mapping[str, Any]) -> str:
    """How the gatekeeper of method (c) solves and answers, unless a run sets it differently."""
    pairs = ((f"gatekeeper.{key}", resolved["gatekeeper"][key]) for key in ("route", "rule"))
    return ", ".join(SETTINGS.get(pair, " ".join(pair)) for pair in pairs)


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
    told = []
    if course.blameless:
        told = [encounter(course, course.encounters[0])]
    elif course.safe is False:
        told = [intrusion(course) if appeared(course) or not course.hits else colliding(course)]
    away = [robot for robot in course.away or () if robot not in course.hits]
    return ", and ".join([*told, *([_absent(course, away)] if away else [])])


def encounter(course: RunOutcome, one: Mapping[str, Any]) -> str:
    """How an obstacle that moves came too near to a robot by its own motion, and what the robot did."""
    if one["appeared"]:
        return clause("appeared", one)
    if one["t_s"] == 0.0:
        return clause("starts", one)
    if one["caught_s"] and (around := one["blocked_by"]):
        between = joined([f"{'wall ' * (name in course.walls)}{name}" for name in around[:MAX_NAMES]])
        kept = {clause("beside", near=near) for near in course.near
                if near.robot == one["first"] and near.other in around and not near.is_short}  # fmt: skip
        stood = ". It had nowhere to retreat, and stood" * (one["reaction"] == "stood")
        return clause("caught", one, between=between, kept="".join(sorted(kept))) + stood
    speed = f", {one['speed_m_s']:.2f} m/s" if one["reaction"].startswith("retreated") else ""
    met = "ran into" if one["collided"] else "came too near to"
    gap = metres(one["gap_m"], one["required_m"], decimals=2)
    return clause("met", one, met=met, gap=gap, reacted=f"{one['reaction']}{speed}")


def too_fast(course: RunOutcome) -> str:
    """Which obstacles moved faster than declared, and what is proved all the same."""
    still = ["no robot brought itself too near"] * (course.own_doing is False)
    still += ["all other distances"] * course.else_met
    told = "; ".join(clause("too_fast", each) for each in course.faster.values())
    return told + (f". Still proved: {'; '.join(still)}" if still else "")


def intrusion(course: RunOutcome) -> str:
    """Who came how near to what in a run that was not safe."""
    if course.near and course.near[0].is_short:
        near = course.near[0]
        appears = "appears_on" if near.value_m < 0.0 else "appears"
        return clause(appears if near.appeared else "comes_within", near=near)
    return course.why


def appeared(course: RunOutcome) -> bool:
    """Whether all that collided did so with obstacles that appeared on them, the first one named by `intrusion`."""
    on = {(near.robot, near.other) for near in course.near if near.appeared and near.is_short}
    all_on = all((robot, hit.get("obstacle")) in on for robot, hit in course.hits.items())
    return bool(course.hits) and all_on and course.near[0].appeared


def more_pairs(course: RunOutcome, named: int = 1) -> str:
    """How many pairs besides those named came too near."""
    more = sum(near.is_short for near in course.near) - named
    return f"; {counted(more, 'more pair')}" if more > 0 else ""


def colliding(course: RunOutcome) -> str:
    """Who collides in a run."""
    return f"{_robots([*course.hits])} collide{'s' * (len(course.hits) == 1)}"


def collision(hit: Mapping[str, Any], unknown: Sequence[str] = ()) -> str:
    """Who collided with what and when, by the event; and whether that is among the obstacles unknown to the UAV."""
    what = hit.get("other") or named(hit["obstacle"], hit.get("at_m"))
    return clause("collides", hit, what=what + ", which the UAV did not know," * (hit.get("obstacle") in unknown))


def ending(course: RunOutcome, robot: str) -> str:
    """How a robot ended that neither arrived nor collided, without the verb "is"."""
    known = course.on_the_way.get(robot)
    if robot in course.stuck:
        return "stuck"
    if not known:
        return "short of its target"
    if known["stands"]:
        return f"standing still at {named('map', known['at_m'])}" if "at_m" in known else "standing still"
    if known["creeps"]:
        return "hardly moving at the end"
    left_s = known["left_s"]
    rounded = f" (about {float(f'{left_s:.2g}'):.15g} s more)" if left_s is not None else ""  # without an exponent
    return f"still moving at the end{rounded}"


def kept_away(course: RunOutcome, robot: str) -> str:
    """Since when a robot has stood because an obstacle that moves is at its target; '' if it has not."""
    found = course.on_the_way.get(robot, {}).get("kept_away")
    if not found:
        return ""
    between = [near.value_m for near in course.near if {near.robot, near.other} == {robot, found["by"]}]
    never = f" (never nearer than {min(between):.2f} m)" if between else ""
    return clause("kept_away", found, where="on" if found["on"] else "near", never=never)


def _absent(course: RunOutcome, names: Sequence[str]) -> str:
    """How those ended that did not arrive, and for whom the UAV found no way."""
    apart = {robot: why for robot in names if (why := kept_away(course, robot))}
    if apart:
        told = [f"{robot} does not arrive: {why}" for robot, why in apart.items()]
        rest = [robot for robot in names if robot not in apart]
        return "; ".join([*told, *([_absent(course, rest)] if rest else [])])
    ends = grouped((ending(course, robot), robot) for robot in names)
    clauses = [f"{_robots(alike)} {'is' if len(alike) == 1 else 'are'} {how}" for how, alike in ends.items()]
    lost = [robot for robot in names if robot in course.no_way]
    return joined(clauses) + (f": {found_no_way(lost)}" if lost else "")


def found_no_way(names: Sequence[str]) -> str:
    """For whom the UAV found no way."""
    return clause("no_way", who=_robots(names))


def _robots(names: Sequence[str]) -> str:
    return joined(names) if len(names) <= MAX_NAMES else f"{len(names)} robots"


def place_of(claim: Mapping[str, Any]) -> dict[str, Any]:
    """Where the margin of a claim is, and its counterexample."""
    return {**claim["where"], **(claim["counterexample"] or {})}


def bodies_of(claim: Mapping[str, Any]) -> list[str]:
    """The bodies that a claim names."""
    place = place_of(claim)
    there = {role: place[role] for role in ROLES if isinstance(place.get(role), str)}
    return list(
        dict.fromkeys(named(name, place.get("at_m") if role == "second" else None) for role, name in there.items())
    )


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
