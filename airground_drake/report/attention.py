"""The items of a report that need attention, each in one line."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import PASSING, UNDECIDED, outcome
from airground_drake.report.model import Claim, Report, Run
from airground_drake.report.sentences import MAX_NAMES, counted, distance, grouped, joined, named, some
from airground_drake.scenario.validate import preset_s
from airground_drake.ugv.reasons import refusal

MAX_FAULT_CHARS = 300
MAX_FAULTS = 3  # maximum number of kinds of faults listed per run; its section of the page has more
ROLES = ("first", "second", "robot", "other")  # keys that hold the name of a body in the place of a claim


class Item(NamedTuple):
    """An item that needs attention."""

    chip: str  # the status to show
    words: str  # what happened, in one line
    claim: str = ""  # the claim that it is about, '' if none
    run: str = ""  # in which run, '' if none
    about: str = ""  # what was expected, in words
    anchor: str = "claims"  # where in the page there is more about it


def items(report: Report) -> list[Item]:
    """All items: first possible explanations of the rest, then refuted claims, then undecided and missing ones."""
    unexpected = [claim for claim in report.claims if claim.as_expected is False]
    unexpected.sort(key=lambda claim: claim.status in UNDECIDED)
    return [
        *beforehand(report),
        *(_of_claim(claim, report.runs.get(claim.run)) for claim in unexpected),
        *(
            Item("not_as_expected", f"{number.found} {number.id}", run=number.run,
                 about=f"expected: at least {number.least}", anchor="happened")
            for number in report.overall.numbers if not number.as_expected
        ),
        *(Item("not_run", missing.why, missing.id, missing.run) for missing in report.overall.missing),
        *(
            Item("not_demonstrated", f"finding {number} about the paper", anchor="audit")
            for number in report.overall.undemonstrated
        ),
    ]  # fmt: skip


def _of_claim(claim: Claim, run: Run | None) -> Item:
    words = in_words(claim)
    if "condition" in place_of(claim) and run and (bodies := bodies_of(claim)):
        words += _refused(run, bodies[0])
    return Item(
        outcome(claim.status, claim.exercised),
        words,
        claim.id,
        claim.run,
        about=f"expected: {str(claim.expected).replace('_', ' ')}",
        anchor=f"claim-{claim.id}",
    )


def _refused(run: Run, robot: str) -> str:
    """The refusals, with reasons, of a robot that did not end where it must."""
    reasons = run.metrics.gatekeeper.refusals.get(robot, {}) if run.metrics.gatekeeper else {}
    if not reasons:
        return ""
    often = sorted(reasons.items(), key=lambda item: -item[1])
    why = "; ".join(f"{refusal(reason)}{f' ({count})' if len(reasons) > 1 else ''}" for reason, count in often)
    return f"; refused {counted(sum(reasons.values()), 'time')}: {why}"


def beforehand(report: Report) -> Iterator[Item]:
    """Items shown first, also on the terminal: faults of policies, failed searches, and runs that end too early."""
    yield from _of_faults(report.runs)
    for name, run in report.runs.items():
        why = run.metrics.no_way_reasons
        for reason, lost in grouped((why.get(ugv, ""), ugv) for ugv in run.no_way).items():
            who = joined(lost) if len(lost) <= MAX_NAMES else f"{len(lost)} robots"
            words = f"the UAV found no way for {who}" + (f": {reason}" if reason else "")
            yield Item("no_way", words, run=name, anchor="happened")
    scenario = report.scenario.resolved
    longer = {name: preset_s(ugv.preset.waypoints_m, ugv.preset.speed_m_s) for name, ugv in scenario.ugvs.items()}
    longer = {name: time_s for name, time_s in longer.items() if time_s > scenario.duration_s}
    if longer:
        who = some([*longer], MAX_NAMES)
        ends = f"duration_s = {scenario.duration_s:g} ends the runs before the presets of {who} do"
        yield Item("inconclusive", f"{ends} ({max(longer.values()):.3g} s): they cannot be expected to arrive")


def failures(faults: Mapping[str, Sequence[Mapping[str, Any]]]) -> Iterator[str]:
    """Lines for the terminal: how often each policy failed, and its first traceback, once."""
    seen = set[str]()
    for run, those in faults.items():
        for policy, alike in grouped((str(fault["policy"]), fault) for fault in those).items():
            often = f"failed {counted(len(alike), 'time')}, first at {alike[0]['t_s']:.2f} s"
            yield one_line(f"run {run}: policy {policy} {often}: {alike[0]['what'][:MAX_FAULT_CHARS]}")
            traceback = next((fault["traceback"] for fault in alike if fault.get("traceback")), "")
            if traceback and traceback not in seen:
                seen.add(traceback)
                yield traceback


def _of_faults(runs: Mapping[str, Run]) -> Iterator[Item]:
    for name, run in runs.items():
        kinds = faults_together(run.faults)
        for kind in kinds[:MAX_FAULTS]:
            count, first_s = kind["count"], kind["first_s"]
            often = f"{count} times, first at {first_s:.2f} s" if count > 1 else f"once, at {first_s:.2f} s"
            yield Item("error", f"policy {kind['policy']}: {kind['what']} ({often})", run=name, anchor="happened")
        if len(kinds) > MAX_FAULTS:
            more = len(kinds) - MAX_FAULTS
            noun = "fault" if more == 1 else "faults"
            yield Item("error", f"{counted(more, 'more kind')} of {noun}", run=name, anchor="happened")


def faults_together(faults: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The faults of a run, grouped: policy, truncated message, count, robots, first and last time."""
    kinds = grouped(((str(fault["policy"]), str(fault["what"])), fault) for fault in faults)
    return [
        {
            "policy": one_line(policy),
            "what": one_line(what if len(what) <= MAX_FAULT_CHARS else f"{what[:MAX_FAULT_CHARS]}…"),
            "count": len(alike),
            "robots": sorted({str(fault["robot"]) for fault in alike}),
            "first_s": alike[0]["t_s"],
            "last_s": alike[-1]["t_s"],
        }
        for (policy, what), alike in kinds.items()
    ]


def place_of(claim: Claim) -> dict[str, Any]:
    """The place of a claim's margin, and its counterexample."""
    return {**claim.where, **(claim.counterexample or {})}


def bodies_of(claim: Claim) -> list[str]:
    place = place_of(claim)
    there = {role: place[role] for role in ROLES if isinstance(place.get(role), str)}
    return list(
        dict.fromkeys(named(name, place.get("at_m") if role == "second" else None) for role, name in there.items())
    )


def in_words(claim: Claim) -> str:
    """The result of a claim in words, as far as known: bodies, excess over the allowed value, time."""
    place, who = place_of(claim), " and ".join(bodies_of(claim))
    known = {name: value for name, value in place.items() if isinstance(value, float | int)}
    at = f", {known['t_s']:.3f} s" if "t_s" in known else ""
    if claim.status in PASSING:
        idle = claim.exercised == 0
        return f"not tested: no {claim.exercised_by}" if idle else f"{claim.status} all the same"
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
