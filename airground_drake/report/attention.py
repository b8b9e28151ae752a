"""What needs attention in a report, each in one line."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import UNDECIDED, outcome
from airground_drake.report.model import Claim, Report, Run
from airground_drake.report.phrases import bodies_of, found_no_way, in_words, place_of
from airground_drake.report.sentences import MAX_NAMES, counted, grouped
from airground_drake.scenario.validate import preset_s
from airground_drake.ugv.reasons import refusal

MAX_FAULT_CHARS = 300
MAX_FAULTS = 3  # maximum number of kinds of faults listed per run; its section of the page has more


class Item(NamedTuple):
    """One thing that needs attention."""

    chip: str  # the status to show
    words: str  # what happened, in one line
    claim: str = ""  # the claim that it is about, '' if none
    run: str = ""  # in which run, '' if none
    about: str = ""  # what was expected, in words
    anchor: str = "claims"  # where in the page there is more about it


def items(report: Report) -> list[Item]:
    """All of a report: what may explain the rest first, then refuted claims, then undecided and missing ones."""
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
    """How often and why a robot that did not get where it must refused proposals."""
    reasons = run.metrics.gatekeeper.refusals.get(robot, {}) if run.metrics.gatekeeper else {}
    if not reasons:
        return ""
    often = sorted(reasons.items(), key=lambda item: -item[1])
    why = "; ".join(f"{refusal(reason)}{f' ({count})' if len(reasons) > 1 else ''}" for reason, count in often)
    return f"; refused {counted(sum(reasons.values()), 'time')}: {why}"


def beforehand(report: Report) -> Iterator[Item]:
    """Shown first, also on the terminal: faults of policies and solvers, no way found, and runs that end too early."""
    yield from _of_faults(report.runs)
    for name, run in report.runs.items():
        why = run.metrics.no_way_reasons
        for reason, lost in grouped((why.get(ugv, ""), ugv) for ugv in run.no_way).items():
            words = found_no_way(lost) + (f": {reason}" if reason else "")
            yield Item("no_way", words, run=name, anchor="happened")
    scenario = report.scenario.resolved
    longer = {name: preset_s(ugv.preset.waypoints_m, ugv.preset.speed_m_s) for name, ugv in scenario.ugvs.items()}
    longer = {name: time_s for name, time_s in longer.items() if time_s > scenario.duration_s}
    if longer:
        names = list(longer)
        who = ", ".join(names[:MAX_NAMES])
        if len(names) > MAX_NAMES:
            who += f" and {len(names) - MAX_NAMES} more"
        ends = f"duration_s = {scenario.duration_s:g} ends the runs before the presets of {who} do"
        yield Item("inconclusive", f"{ends} ({max(longer.values()):.3g} s): they cannot be expected to arrive")


def failures(faults: Mapping[str, Sequence[Mapping[str, Any]]]) -> Iterator[str]:
    """For the terminal, from the faults of each run: how often each policy failed, and its first traceback, once."""
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
    """The faults of a run, equal ones once: policy, what it said (cut), how often, robots, first and last time."""
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
