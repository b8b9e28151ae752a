"""What the list of what needs attention says of claims and robots."""

from collections.abc import Sequence
from typing import Any

from airground_drake.base.statuses import PASSING
from airground_drake.report.model import Claim
from airground_drake.report.outcomes import distance, named
from airground_drake.report.sentences import MAX_NAMES, joined

ROLES = ("first", "second", "robot", "other")  # keys that hold the name of a body in the place of a claim


def found_no_way(names: Sequence[str]) -> str:
    return f"the UAV found no way for {joined(names) if len(names) <= MAX_NAMES else f'{len(names)} robots'}"


def place_of(claim: Claim) -> dict[str, Any]:
    """Where the margin of a claim is, and its counterexample."""
    return {**claim.where, **(claim.counterexample or {})}


def bodies_of(claim: Claim) -> list[str]:
    place = place_of(claim)
    there = {role: place[role] for role in ROLES if isinstance(place.get(role), str)}
    return list(
        dict.fromkeys(named(name, place.get("at_m") if role == "second" else None) for role, name in there.items())
    )


def in_words(claim: Claim) -> str:
    """What came of a claim, as far as it is known: who, how far from what was allowed, when."""
    place, who = place_of(claim), " and ".join(bodies_of(claim))
    known = {name: value for name, value in place.items() if isinstance(value, float | int)}
    at = f", {known['t_s']:.3f} s" if "t_s" in known else ""
    if claim.status in PASSING:
        idle = claim.exercised == 0
        return f"nothing put it to the test: no {claim.exercised_by}" if idle else f"{claim.status} all the same"
    if claim.status != "refuted":
        why = claim.evidence.get("reason") or claim.evidence.get("error")
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
    margin, unit = known.get("margin", claim.margin), place.get("unit", claim.unit)
    if margin is not None:
        quantity = place.get("hypothesis") or place.get("condition") or claim.quantity or "margin"
        missed = f"missed by {-margin:.3g} {unit}" if margin < 0.0 else f"{margin:.3g} {unit} left"
        return f"{who}{quantity} {missed}{at}"
    what = next((str(place[key]) for key in ("quantity", "what", "kind", "reason") if place.get(key)), "refuted")
    return f"{who}{what}{at}"
