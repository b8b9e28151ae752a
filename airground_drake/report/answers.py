"""The questions of a report's reader, answered: safe, arrived, Zeno-free, the threshold, the paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import log
from typing import Any, NamedTuple

from airground_drake.base.statuses import PASSING, UNDECIDED
from airground_drake.report.outcomes import Course, Document, claims, proved_for_d, triggers
from airground_drake.report.phrases import (
    MAX_NAMES,
    Line,
    colliding,
    counted,
    gatekeeper,
    grouped,
    intrusion,
    more_pairs,
    of_run,
)

NEGLIGIBLE = 1e-3
"""A risk that exceeds the smallest one by less than this share counts as the smallest."""
_MATCHES = {"reproduced": "without tuning", "calibrated": "after calibration"}
_REST = {"by_construction": "by construction", "ambiguous": "ambiguous", "not_reproduced": "not reproduced"}


class Answer(NamedTuple):
    """A question and its answer."""

    question: str
    lines: list[Line]


def answers(document: Document, every: Sequence[Course], *, tabulated: bool) -> list[Answer]:
    """The questions that the report has something to say about; `tabulated`: those that no table of runs answers."""
    asked = {"Safe?": _safe(document, every), "Arrived?": _arrived(document, every), "Runs": _runs(document, every)}
    asked = {} if tabulated else asked
    asked |= {"Zeno-free?": _zeno(document), "Threshold?": _threshold(document), "Paper?": _paper(document)}
    return [Answer(question, lines) for question, found in asked.items() if (lines := list(found))]


def _safe(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    bad = [course for course in every if course.safe is False]
    printed = [course for course in bad if not course.plain and not course.collisions]
    for course in bad:
        if course not in printed:
            yield Line("no", f"{course.name}: {_intrusion(course)}{' (expected)' * course.declared_unsafe}.")
    for why, names in grouped((course.why, course.name) for course in every if course.safe is None).items():
        yield Line("open", f"{', '.join(names)}: not known, {why}.")
    kept = [course for course in every if course.safe]
    if pairs := [course.near[0] for course in kept if course.near]:
        tested, least = any(course.tested for course in kept), min(pairs)
        told = f"minimum distance {least.told()}, required {least.required_m:g} m"
        told += "" if tested else "; nothing came near, so this was not tested"
        yield Line("yes" if tested else "none", f"{', '.join(course.name for course in kept)}: {told}.")
    if any(course.method == "d" for course in every):
        yield _proof(document, every)
    if printed:
        told = _intrusion(min(printed, key=lambda course: course.near[:1]))
        told += " (expected)" * any(course.declared_unsafe for course in printed)
        home = "all arrive, but " * all(course.away == {} for course in printed)
        yield Line("no", f"{counted(len(printed), 'run')} with recursion (5) as printed: {home}{told}.")


def _intrusion(course: Course) -> str:
    """Who came how near to what, when, and how many others did."""
    if not (course.near and course.near[0].is_short):
        return intrusion(course)
    least = course.near[0]
    told = f"{colliding(course)}, {least} from {least.other}" if course.collisions else intrusion(course)
    more = more_pairs(course)
    return f"{told} at {least.t_s:.2f} s, required {least.required_m:g} m{more}{' too close' * bool(more)}"


def _proof(document: Document, every: Sequence[Course]) -> Line:
    """Whether the safety of method (d) is proved."""
    if proved_for_d(document, every):
        return Line("", "Proved for (d), whatever the UAV asks for.")
    if {claim["status"] for claim in claims(document, "SAFE-INV", "SAFE-GATE", run="")} == {"proved"}:
        return Line("no", "The proof for (d) does not apply: a run did not meet its conditions (SAFE-HYP).")
    return Line("open", "Not proved for (d).")


def _arrived(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    if home := [course for course in every if course.away == {} and course.plain]:
        last = max(course.last_s for course in home)
        yield Line("yes", f"{', '.join(course.name for course in home)}: all{f', by {last:.1f} s' if last else ''}.")
    away = [course for course in every if course.away != {}]
    for (mark, says), names in grouped((_whereabouts(document, course), course.name) for course in away).items():
        yield Line(mark, f"{', '.join(names)}: {says}.")


def _whereabouts(document: Document, course: Course) -> Line:
    """Who did not arrive, and where each is."""
    if course.away is None:
        return Line("open", f"not known, {course.why}")
    resolved, ends = document["scenario"]["resolved"], []
    as_printed = {
        row["robot"]
        for row in document["reproduction"]
        if row["run"] == course.name
        and row["measure"] in ("stall_position", "collision_position")
        and row["status"] in _MATCHES
    }
    hit = {event["robot"] for event in course.collisions}
    for robot, at in list(course.away.items())[:MAX_NAMES]:
        place = ", ".join(f"{round(x, 2) + 0.0:.2f}" for x in (at if robot == resolved["uav"]["name"] else at[:2]))
        how = "collided, ended" if robot in hit else "stuck" if robot in course.stuck else "ended short of its target,"
        ends.append(f"{robot} {how} at ({place}) m{', as in the paper' * (robot in as_printed)}")
    if len(course.away) > MAX_NAMES:
        ends.append(f"{len(course.away) - MAX_NAMES} more")
    ugvs = len(resolved["ugvs"])
    count = f"{course.there} of {ugvs} UGVs; " if ugvs > 2 else ""
    return Line("no" if course.helped or course.collisions else "none", count + "; ".join(ends))


def _runs(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    """What each run is, for readers who do not know its letter."""
    resolved = document["scenario"]["resolved"]
    told = []
    for course in every:
        if course.plain:
            own = course.method == "c" and not resolved["runs"][course.name].get("set")
            told.append(f"{course.name}: {of_run(resolved, course)}{f', {gatekeeper(resolved)}' if own else ''}")
    if told:
        yield Line("", f"{'; '.join(told)}.")


def _zeno(document: Document) -> Iterator[Line]:
    decision = document["scenario"]["resolved"]["decision"]
    for status in (claim["status"] for claim in claims(document, "ZENO-PROOF", run="")):
        if status == "proved":
            yield Line("yes", f"Proved: triggers are at least {decision['min_inter_event_s']:g} s apart.")
        else:
            bare = ", as the trigger is the bare threshold" if decision["trigger"] == "bare" else ""
            mark = "no" if status == "refuted" else "open"
            yield Line(mark, f"Not proved{bare} (ZENO-PROOF: {status.replace('_', ' ')}).")
    of_runs = claims(document, "ZENO-TRACE")
    bad = [claim for claim in of_runs if claim["status"] == "refuted"]
    for claim in bad:
        gap = (claim["counterexample"] or {}).get("gap_s")
        yield Line("no", f"{claim['run']}: two triggers {f'{gap:.3g} s' if gap is not None else 'too close'} apart.")
    if seen := [claim for claim in of_runs if claim["status"] in PASSING and claim["exercised"]]:
        gaps = [claim["evidence"].get("smallest_gap", {}).get("gap_s") for claim in seen]
        least = min((gap for gap in gaps if gap is not None), default=None)
        smallest = f"; the smallest is {least:.3f} s" if least is not None else ""
        yield Line("", f"Seen: {sum(claim['exercised'] for claim in seen)} gaps between triggers{smallest}.")
    elif of_runs and not bad:
        why = "no UGV triggers twice" if triggers(document) else "nothing triggered"
        yield Line("", f"These runs cannot show it: {why}. Scenario dwell does.")


def _threshold(document: Document) -> Iterator[Line]:
    of_runs = claims(document, "THR-TRIG")
    bad = [claim for claim in of_runs if claim["status"] == "refuted"]
    unknown = [claim["run"] for claim in of_runs if claim["status"] in UNDECIDED]
    fired, runs = triggers(document), document["runs"]
    zeta = " or ".join(f"{zeta:.4g}" for zeta in dict.fromkeys(run["zeta_m"] for run in runs.values()))
    for claim in bad:
        yield Line("no", f"{claim['run']}: a trigger is missed, spurious or at the wrong time (THR-TRIG).")
    if unknown:
        yield Line("open", f"{', '.join(unknown)}: not known whether triggers are missed (THR-TRIG).")
    if not fired and runs:
        yield Line("none", f"Not tested here: nothing reached the {zeta} m.")
    elif of_runs and not bad and not unknown:
        times = sorted({round(event["t_s"], 3) for event in fired})
        in_runs = f" in {len(runs)} runs" if len(runs) > 1 else ""
        when = f"at {times[0]:.3f} s" if len(times) == 1 else f"{len(fired)} times{in_runs}, first at {times[0]:.3f} s"
        yield Line("yes", f"Fired at {zeta} m, {when}; none missed, none spurious.")
    for claim in claims(document, "THR-CHOICE"):
        if "optimal_threshold_m" in claim["evidence"]:
            yield from _choice(claim["evidence"], claim["inputs"])


def _choice(found: Mapping[str, Any], assumed: Mapping[str, Any]) -> Iterator[Line]:
    """How good the threshold is: for the assumed drift, and for the drift in the runs that calls for another most."""
    zeta, best = found["threshold_in_force_m"], found["optimal_threshold_m"]
    excess = found["extra_risk"] / found["least_risk"]
    if found["kind"] != "declared":
        yield Line("yes", f"{zeta:.4g} m is the Bayes optimum for the assumed drift and noise.")
    elif excess < NEGLIGIBLE:
        told = f"is as good as the Bayes optimum {best:.4g} m for the assumed drift"
        yield Line("yes", f"{zeta:.4g} m, set by hand, {told}, {assumed['drift_m_s']:.4g} m/s.")
    else:
        told = f"the Bayes optimum for the assumed drift of {assumed['drift_m_s']:.4g} m/s is {best:.4g} m"
        yield Line("partly", f"{zeta:.4g} m was chosen by hand; {told}, and the risk is {100 * excess:.2g} % higher.")
    wanted = {name: row["optimum_for_this_drift_m"] for name, row in found.get("runs", {}).items()}
    if off := {name: abs(log(other / zeta)) for name, other in wanted.items() if other}:
        name = max(off, key=off.__getitem__)
        run, _, robot = name.partition(" ")
        late = f"{zeta:.4g} m calls the UAV {'late' if zeta > wanted[name] else 'early'}"
        told = f"{robot} drifted at {found['runs'][name]['drift_m_s']:.2g} m/s: for that, {wanted[name]:.2g} m is best"
        yield Line("partly", f"In run {run}, {told}, and {late}.")


def _paper(document: Document) -> Iterator[Line]:
    if not (rows := document["reproduction"]):
        return
    by = {status: [row["id"] for row in rows if row["status"] == status] for status in (*_MATCHES, *_REST)}
    matched = sum(len(by[status]) for status in _MATCHES)
    mark = "yes" if len(by["reproduced"]) == len(rows) else "partly" if matched else "no"
    told = ", ".join(f"{len(by[status])} {says}" for status, says in _MATCHES.items() if by[status])
    parts = [f"{matched} of {len(rows)} results match{': ' if told else ''}{told}"]
    parts += [f"{says}: {', '.join(by[status])}" for status, says in _REST.items() if by[status]]
    yield Line(mark, f"{'; '.join(parts)}.")
