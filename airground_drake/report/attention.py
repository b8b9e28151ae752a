"""What needs a person's attention in a report, each in one line of words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import PASSING, UNDECIDED, outcome
from airground_drake.scenarios.validate import preset_s

MAX_FAULT_CHARS = 300
MAX_FAULTS = 3
"""Kinds of faults of a run that are listed; its section of the page has more."""
MAX_NAMES = 3
"""Robots that are listed in a line."""

REFUSED = {
    "waits": "the best plan began by refusing and accepted later",
    "not_cheaper": "its own task looked as good, or better",
    "no_difference": "it would have changed nothing",
    "first_stage": "the best plan began by refusing",
    "no_plan": "no outcome could be computed",
    "stalls": "with the proposal it would have come to rest short of its goal, no nearer than without",
    "exhausted": "it had used all of its tries and had not rested since",
}
"""Why a proposal was refused, for a reader who knows no reason's name."""
_NAMES = ("first", "second", "robot", "other")


@dataclass(frozen=True)
class Item:
    """One thing.

    Attributes:
        chip: the status to show.
        words: what happened, in one line.
        claim: whose claim it is, '' if none.
        run: in which run, '' if none.
        about: what ought to have been, in words.
        anchor: where in the page there is more about it.
    """

    chip: str
    words: str
    claim: str = ""
    run: str = ""
    about: str = ""
    anchor: str = "claims"


def items(document: Mapping[str, Any]) -> list[Item]:
    """All of a report, in the order of the page.

    What may explain the rest comes first; then what is refuted, and what is open.
    """
    unexpected = [claim for claim in document["claims"] if not claim["as_expected"]]
    unexpected.sort(key=lambda claim: claim["status"] in UNDECIDED)
    return [
        *beforehand(document),
        *(_of_claim(claim, document["runs"].get(claim["run"], {})) for claim in unexpected),
        *(Item("not_run", f"{each['why']}", each["id"], each["run"]) for each in document["overall"]["missing"]),
        *_of_the_paper(document),
    ]


def _of_claim(claim: Mapping[str, Any], run: Mapping[str, Any]) -> Item:
    place = {**claim["where"], **(claim["counterexample"] or {})}
    bodies = tuple(dict.fromkeys(str(place[name]) for name in _NAMES if isinstance(place.get(name), str)))
    words = _words(claim, place, bodies)
    if "condition" in place and run and bodies:
        words += _refused(run, bodies[0])
    return Item(
        outcome(claim["status"], claim["exercised"]),
        words,
        claim["id"],
        claim["run"],
        about=f"expected: {str(claim['expected']).replace('_', ' ')}",
        anchor=f"claim-{claim['id']}",
    )


def _words(claim: Mapping[str, Any], place: Mapping[str, Any], bodies: Sequence[str]) -> str:
    """What came of a claim: who, how far from what was allowed, when; whatever of it is known."""
    who = " and ".join(bodies)
    known = {name: value for name, value in place.items() if isinstance(value, float | int)}
    at = f", {known['t_s']:.3f} s" if "t_s" in known else ""
    if claim["status"] in PASSING:
        idle = claim["exercised"] == 0
        return f"nothing put it to the test: no {claim['exercised_by']}" if idle else f"{claim['status']} all the same"
    if claim["status"] != "refuted":
        why = claim["evidence"].get("reason") or claim["evidence"].get("error")
        return why if isinstance(why, str) else "could not be decided"
    if {"min_distance_m", "safe_distance_m"} <= known.keys():
        return f"{who} at {known['min_distance_m']:.2f} m, {known['safe_distance_m']:g} m needed{at}"
    if {"distance_m", "margin_m"} <= known.keys() and "condition" in place:
        allowed = known["distance_m"] + known["margin_m"]
        return f"{who} ended {known['distance_m']:.2f} m from where it must end, {allowed:g} m allowed"
    margin, unit = known.get("margin", claim["margin"]), place.get("unit", claim["unit"])
    if margin is not None:
        quantity = place.get("hypothesis") or place.get("condition") or claim["quantity"] or "margin"
        missed = f"missed by {-margin:.3g} {unit}" if margin < 0.0 else f"{margin:.3g} {unit} left"
        return f"{who + ': ' if who else ''}{quantity} {missed}{at}"
    what = next((str(place[key]) for key in ("quantity", "what", "kind", "reason") if place.get(key)), "refuted")
    return f"{who + ': ' if who else ''}{what}{at}"


def _refused(run: Mapping[str, Any], robot: str) -> str:
    """What became of the proposals to a robot that did not get where it must."""
    gate = run["metrics"]["gatekeeper"] or {}
    reasons: Mapping[str, int] = gate.get("refusals", {}).get(robot, {})
    if not reasons:
        return ""
    why = "; ".join(
        f"{REFUSED.get(reason, reason.replace('_', ' '))}{f' ({count})' if len(reasons) > 1 else ''}"
        for reason, count in sorted(reasons.items(), key=lambda item: -item[1])
    )
    count = sum(reasons.values())
    return f"; refused {count} {'time' if count == 1 else 'times'}: {why}"


def _of_the_paper(document: Mapping[str, Any]) -> Iterator[Item]:
    for number in document["overall"]["undemonstrated"]:
        yield Item("not_demonstrated", f"finding {number} about the paper", anchor="audit")


def beforehand(document: Mapping[str, Any]) -> Iterator[Item]:
    """What the report begins with, on the terminal too: faults of policies and solvers, and runs that are cut short."""
    yield from _of_faults(document["runs"])
    scenario = document["scenario"]["resolved"]
    longer = {name: preset_s(**ugv["preset"]) for name, ugv in scenario["ugvs"].items()}
    longer = {name: time_s for name, time_s in longer.items() if time_s > scenario["duration_s"]}
    if longer:
        names = list(longer)
        who = ", ".join(names[:MAX_NAMES]) + f" and {len(names) - MAX_NAMES} more" * (len(names) > MAX_NAMES)
        ends = f"duration_s = {scenario['duration_s']:g} ends the runs before the presets of {who} do"
        yield Item("inconclusive", f"{ends} ({max(longer.values()):.3g} s): they cannot be expected to arrive")


def _of_faults(runs: Mapping[str, Mapping[str, Any]]) -> Iterator[Item]:
    for name, run in runs.items():
        kinds = faults_together(run["faults"])
        for kind in kinds[:MAX_FAULTS]:
            count, first = kind["count"], f"first at {kind['first_s']:.2f} s"
            often = f"{count} times, {first}" if count > 1 else f"once, at {kind['first_s']:.2f} s"
            yield Item(
                "error", f"{kind['what']} ({often})", run=name, about=f"policy {kind['policy']}", anchor="happened"
            )
        if len(kinds) > MAX_FAULTS:
            yield Item("error", f"{len(kinds) - MAX_FAULTS} more kinds of faults", run=name, anchor="happened")


def faults_together(faults: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """What went wrong in a run, each thing once: the policy, what it said (cut), how often, of whom, first and last."""
    together: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for fault in faults:
        together.setdefault((str(fault["policy"]), str(fault["what"])), []).append(fault)
    return [
        {
            "policy": one_line(policy),
            "what": one_line(what if len(what) <= MAX_FAULT_CHARS else f"{what[:MAX_FAULT_CHARS]}…"),
            "count": len(alike),
            "robots": sorted({str(fault["robot"]) for fault in alike}),
            "first_s": alike[0]["t_s"],
            "last_s": alike[-1]["t_s"],
        }
        for (policy, what), alike in together.items()
    ]
