"""The words of a report's first screen: headline, five answers, what not to conclude. `outcomes` has the facts.

Marks follow what happened in the runs. Whether the scenario declared it so is a statement of its own, `as_declared`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import log
from textwrap import wrap
from typing import Any, NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import NOT_EXERCISED, PASSING, UNDECIDED, admits_either, outcome
from airground_drake.registry import METHODS
from airground_drake.report.outcomes import SLACK_M, Course, Document, courses, distance, proved_for_d, statuses

MARKS = {"yes": "✓", "partly": "≈", "no": "✗", "open": "?", "none": "\N{EN DASH}", "": " "}
"""Marks of a line and their icons; '' continues the line before."""
MEANINGS = {
    "yes": "yes",
    "partly": "in part",
    "no": "no",
    "open": "not known",
    "none": "neither good nor bad",
}
"""What the marks mean, for their legend and for screen readers."""
NEGLIGIBLE = 1e-3
"""A risk that is higher by this share than the least counts as least."""
WIDTH = 110
"""Characters of a line on a terminal, about."""
MAX_NAMES = 3
"""Robots that a line names."""
WORDS_OF_REFUSALS = {
    "waits": "waiting looked cheaper",
    "first_stage": "waiting looked cheaper",
    "not_cheaper": "the UGV's own task looked as good",
    "no_difference": "it would have changed nothing",
    "no_plan": "no outcome could be computed",
    "stalls": "it would have stalled on the way",
    "exhausted": "it had used all of its tries",
}
"""Why a proposal was refused, in a few words."""


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


class Answer(NamedTuple):
    """A question of the reader and its answer."""

    question: str
    lines: list[Line]


class Row(NamedTuple):
    """What came of a run, for the table of methods."""

    run: str
    method: str
    safe: Line
    arrived: Line
    interventions: str


def headline(document: Document) -> Line:
    """The report in a sentence, and in another one if a verdict is not the one that the scenario declares."""
    mark, told = _outcome(document)
    differs = sum(not c["as_expected"] and c["status"] not in UNDECIDED for c in document["claims"])
    if not differs:
        return Line(mark, told)
    checks = "1 check is" if differs == 1 else f"{differs} checks are"
    return Line("partly" if mark == "yes" else mark, f"{told} {checks} not as declared.")


def _outcome(document: Document) -> Line:
    """What came of the runs, in a sentence."""
    every = courses(document)
    main = [course for course in every if course.plain] or every
    unknown = [course.name for course in main if course.safe is None or course.away is None]
    unsafe = [course for course in main if course.safe is False]
    fine = [course for course in main if course.fine]
    helped, alone = ([course for course in main if course.helped is way] for way in (True, False))
    if not main:
        return Line("open", "Nothing was run.")
    if unknown and not unsafe:
        return Line("open", f"Not decided: {_of_runs(unknown)} could not be judged.")
    if len(fine) == len(main):
        told = "With and without help, all arrive safely." if helped and alone else "All arrive safely."
        return _unless_one_crashed(every, told)
    short = [course for course in main if course.away and course not in unsafe]
    if helped and all(course.fine for course in helped):
        return _unless_one_crashed(every, f"With help, all arrive safely. Without it, {_trouble(alone)}.")
    if fine:
        of = _methods(fine)
        told = f"Only {of} {'is' if len({course.method for course in fine}) == 1 else 'are'} safe and "
        told += "brings everyone home." if len({course.method for course in fine}) == 1 else "bring everyone home."
        return Line("partly", f"{told} {_capital(_failures(unsafe, short))}")
    if unsafe:
        rest = "No method brings everyone home safely." if len(main) > 1 else "Not safe."
        return Line("no", f"{rest} {_capital(_failures(unsafe, []))}")
    return Line("no", f"Safe, but not all arrive: {_trouble(short)}.")


def answers(document: Document) -> list[Answer]:
    """The five questions, as far as the report has something to say about each."""
    every = courses(document)
    asked = [Answer("Safe?", list(_safe(document, every))), Answer("Arrived?", list(_arrived(document, every)))]
    asked = [] if methods(document) else [*asked, Answer("Runs", list(_runs(document, every)))]
    rest = [("Zeno-free?", _zeno(document)), ("Threshold?", _threshold(document)), ("Paper?", _paper(document))]
    return [answer for answer in [*asked, *(Answer(name, list(lines)) for name, lines in rest)] if answer.lines]


def methods(document: Document) -> list[Row]:
    """A row for each run of a scenario that has no counterpart in the paper; none with a single run."""
    every = courses(document)
    if document["reproduction"] or len(every) < 2:
        return []
    return [_row(document, course) for course in every]


def required_m(document: Document) -> str:
    """The distances that pairs must keep, m."""
    required = sorted({near.required_m for course in courses(document) for near in course.near})
    return f"{required[0]:g} m" if len(required) == 1 else f"{required[0]:g} to {required[-1]:g} m" if required else ""


def do_not_conclude(document: Document) -> list[str]:
    """What a reader might wrongly conclude: clauses that continue "Do not conclude that"."""
    every = courses(document)
    said = ["real vehicles are safe: the model is first-order, its sensing perfect"]
    seen = [course for course in every if course.safe and not (course.method == "d" and proved_for_d(document, every))]
    if seen:
        said.append(
            f"{_methods(seen)} {'is' if _one(seen) else 'are'} also safe elsewhere: that was only seen in these runs"
        )
    if any(course.away == {} for course in every):
        who = "all" if all(course.away == {} for course in every) else "those that arrive here"
        said.append(f"{who} also arrive from other starts or with other seeds: arrival is seen, not proved")
    if document["runs"] and not _triggers(document):
        said.append("the UAV helps: it was never called")
    if any(course.safe is None for course in every):
        said.append("what could not be judged is fine")
    return said


def as_declared(document: Document) -> Line:
    """Whether the verdicts are those that the scenario declares: a statement about the scenario, not about safety."""
    overall, claims = document["overall"], document["claims"]
    if overall["status"] != "as_expected":
        return Line("no" if overall["status"] == "not_as_expected" else "open", str(overall["why"]))
    failed = sum(claim["status"] == "refuted" and not admits_either(claim["expected"]) for claim in claims)
    open_ones = sum(claim["status"] in UNDECIDED for claim in claims)
    idle = sum(outcome(claim["status"], claim["exercised"]) == NOT_EXERCISED for claim in claims)
    parts = [
        f"{failed} deliberate failure{'s' * (failed != 1)}" if failed else "",
        f"{open_ones} undecided" if open_ones else "",
        f"{idle} not tested" if idle else "",
        f"{len(overall['either'])} allowed either way" if overall["either"] else "",
    ]
    told = ", ".join(filter(None, parts))
    return Line("yes", f"{len(claims)} checks as declared{': ' if told else ''}{told}.")


def text(document: Document) -> str:
    """The first screen for a terminal."""
    mark, says = headline(document)
    lines = [one_line(f"[{MARKS[mark]}] {says}")]
    lines += _table(methods(document), required_m(document))
    for question, answered in answers(document):
        for k, (mark, says) in enumerate(answered):
            asked = "" if k else question
            said = f"{asked:<11} [{MARKS[mark]}] {says}" if mark else f"{asked:<15} {says}"
            lines += wrap(one_line(said), WIDTH, subsequent_indent=16 * " ")
    lines.append("Do not conclude that")
    lines += [one_line(f"  - {clause}") for clause in do_not_conclude(document)]
    lines.append(f"Marks: {legend(document)}.")
    return "\n".join(lines)


def _table(rows: Sequence[Row], required: str) -> list[str]:
    """The table of methods in columns of equal width."""
    cells = [["", "method", f"safe? ({required})", "arrived?", "UAV proposals"]]
    for row in rows:
        safe, arrived = (f"[{MARKS[mark]}] {says}" for mark, says in (row.safe, row.arrived))
        cells.append([row.run, row.method, safe, arrived, row.interventions])
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [one_line("  ".join(map(str.ljust, row, widths)).rstrip()) for row in cells] if rows else []


def legend(document: Document) -> str:
    """The marks on the first screen with their meanings."""
    found = [
        headline(document),
        as_declared(document),
        *(line for answer in answers(document) for line in answer.lines),
    ]
    found += [line for row in methods(document) for line in (row.safe, row.arrived)]
    used = {line.mark for line in found}
    return ", ".join(f"{MARKS[mark]} {meaning}" for mark, meaning in MEANINGS.items() if mark in used)


def _runs(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    """What the runs are, for those who do not know their letters."""
    told = []
    for course in every:
        changed = document["scenario"]["resolved"]["runs"][course.name].get("set") or {}
        extra = ", ".join(f"{key} {value}" for key, value in changed.items())
        if course.plain and course.method in METHODS:
            says = f"({course.method}) with {extra}" if extra else METHODS[course.method].says
            told.append(f"{course.name}: {says}")
    if told:
        yield Line("", f"{'; '.join(told)}.")


def _safe(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    bad = [course for course in every if course.safe is False]
    for course in bad:
        if course.plain or course.crashed:
            yield Line("no", f"{course.name}: {_intrusion(course)}{_declared(document, course)}.")
    for why in dict.fromkeys(course.why for course in every if course.safe is None):
        alike = [course.name for course in every if course.safe is None and course.why == why]
        yield Line("open", f"{', '.join(alike)}: not known, {why}.")
    kept = [course for course in every if course.safe]
    pairs = [course.near[0] for course in kept if course.near]
    if pairs:
        tested, least = any(course.tested for course in kept), min(pairs)
        untested = "" if tested else "; nothing came near, so this was not tested"
        told = f"minimum distance {least.told()}, required {least.required_m:g} m{untested}"
        yield Line("yes" if tested else "none", f"{', '.join(course.name for course in kept)}: {told}.")
    if any(course.method == "d" for course in every):
        yield _proof(document, every)
    printed = [course for course in bad if not course.plain and not course.crashed]
    if printed:
        worst = min(printed, key=lambda course: course.near[:1])
        declared = "".join(dict.fromkeys(_declared(document, course) for course in printed))
        runs = "1 run" if len(printed) == 1 else f"{len(printed)} runs"
        home = "all arrive, but " if all(course.away == {} for course in printed) else ""
        yield Line("no", f"{runs} with recursion (5) as printed: {home}{_intrusion(worst)}{declared}.")


def _proof(document: Document, every: Sequence[Course]) -> Line:
    if proved_for_d(document, every):
        return Line("", "Proved for (d), whatever the UAV asks for.")
    theorems = statuses(document, ("SAFE-INV", "SAFE-GATE"))
    if theorems and set(theorems) == {"proved"}:
        return Line("no", "The proof for (d) does not apply: a run did not meet its conditions (SAFE-HYP).")
    return Line("open", "Not proved for (d).")


def _arrived(document: Document, every: Sequence[Course]) -> Iterator[Line]:
    home = [course for course in every if course.away == {} and course.plain]
    if home:
        last = max(course.last_s for course in home)
        yield Line("yes", f"{', '.join(course.name for course in home)}: all{f', by {last:.1f} s' if last else ''}.")
    told: dict[tuple[str, str], list[str]] = {}
    for course in every:
        if course.away is None:
            told.setdefault(("open", f"not known, {course.why}"), []).append(course.name)
        elif course.away:
            mark = "no" if course.helped or course.crashed else "none"
            told.setdefault((mark, _whereabouts(document, course)), []).append(course.name)
    for (mark, says), names in told.items():
        yield Line(mark, f"{', '.join(names)}: {says}.")


def _whereabouts(document: Document, course: Course) -> str:
    """Who did not arrive, and where each is."""
    ends = []
    uav = document["scenario"]["resolved"]["uav"]["name"]
    for robot, at in list((course.away or {}).items())[:MAX_NAMES]:
        place = ", ".join(f"{round(x, 2) + 0.0:.2f}" for x in (at if robot == uav else at[:2]))
        as_printed = any(
            (row["run"], row["robot"]) == (course.name, robot)
            and row["measure"] in ("stall_position", "collision_position")
            and row["status"] in ("reproduced", "calibrated")
            for row in document["reproduction"]
        )
        hit = any(event["robot"] == robot for event in course.collisions)
        how = "collided, ended" if hit else "stuck" if robot in course.stuck else "ended short of its target,"
        ends.append(f"{robot} {how} at ({place}) m{', as in the paper' * as_printed}")
    more = len(course.away or {}) - MAX_NAMES
    ugvs = document["scenario"]["resolved"]["ugvs"]
    count = f"{course.there} of {len(ugvs)} UGVs; " if len(ugvs) > 2 else ""
    return f"{count}{'; '.join(ends)}{f'; {more} more' if more > 0 else ''}"


def _zeno(document: Document) -> Iterator[Line]:
    decision = document["scenario"]["resolved"]["decision"]
    bound = decision["min_inter_event_s"]
    for status in statuses(document, ["ZENO-PROOF"]):
        if status == "proved":
            yield Line("yes", f"Proved: triggers are at least {bound:g} s apart.")
        else:
            bare = ", as the trigger is the bare threshold" if decision["trigger"] == "bare" else ""
            mark = "no" if status == "refuted" else "open"
            yield Line(mark, f"Not proved{bare} (ZENO-PROOF: {status.replace('_', ' ')}).")
    claims = [claim for claim in document["claims"] if claim["id"] == "ZENO-TRACE"]
    bad = [claim for claim in claims if claim["status"] == "refuted"]
    for claim in bad:
        gap = (claim["counterexample"] or {}).get("gap_s")
        yield Line("no", f"{claim['run']}: two triggers {f'{gap:.3g} s' if gap is not None else 'too close'} apart.")
    seen = [claim for claim in claims if claim["status"] in PASSING and claim["exercised"]]
    if seen:
        gaps = [c["evidence"].get("smallest_gap", {}).get("gap_s") for c in seen]
        least = min((gap for gap in gaps if gap is not None), default=None)
        smallest = f"; the smallest is {least:.3f} s" if least is not None else ""
        yield Line("", f"Seen: {sum(claim['exercised'] for claim in seen)} gaps between triggers{smallest}.")
    elif claims and not bad:
        why = "no UGV triggers twice" if _triggers(document) else "nothing triggered"
        yield Line("", f"These runs cannot show it: {why}. Scenario dwell does.")


def _threshold(document: Document) -> Iterator[Line]:
    claims = [claim for claim in document["claims"] if claim["id"] == "THR-TRIG"]
    bad = [claim for claim in claims if claim["status"] == "refuted"]
    unknown = [str(claim["run"]) for claim in claims if claim["status"] in UNDECIDED]
    fired = _triggers(document)
    zeta = " or ".join(f"{zeta:.4g}" for zeta in dict.fromkeys(run["zeta_m"] for run in document["runs"].values()))
    for claim in bad:
        yield Line("no", f"{claim['run']}: a trigger is missed, spurious or at the wrong time (THR-TRIG).")
    if unknown:
        yield Line("open", f"{', '.join(unknown)}: not known whether triggers are missed (THR-TRIG).")
    if not fired and document["runs"]:
        yield Line("none", f"Not tested here: nothing reached the {zeta} m.")
    elif claims and not bad and not unknown:
        times = sorted({round(event["t_s"], 3) for event in fired})
        runs = f" in {len(document['runs'])} runs" if len(document["runs"]) > 1 else ""
        when = f"at {times[0]:.3f} s" if len(times) == 1 else f"{len(fired)} times{runs}, first at {times[0]:.3f} s"
        yield Line("yes", f"Fired at {zeta} m, {when}; none missed, none spurious.")
    for claim in document["claims"]:
        if claim["id"] == "THR-CHOICE" and "optimal_threshold_m" in claim["evidence"]:
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
    real = {
        name: (abs(log(row["optimum_for_this_drift_m"] / zeta)), row)
        for name, row in found.get("runs", {}).items()
        if row.get("optimum_for_this_drift_m")
    }
    if real:
        name = max(real, key=lambda each: real[each][0])
        run, _, robot = name.partition(" ")
        row = real[name][1]
        wanted = row["optimum_for_this_drift_m"]
        late = f"{zeta:.4g} m calls the UAV {'late' if zeta > wanted else 'early'}"
        told = f"{robot} drifted at {row['drift_m_s']:.2g} m/s: for that, {wanted:.2g} m is best, and {late}"
        yield Line("partly", f"In run {run}, {told}.")


def _paper(document: Document) -> Iterator[Line]:
    rows = document["reproduction"]
    words = {
        "reproduced": "without tuning", "calibrated": "after calibration", "by_construction": "by construction",
        "ambiguous": "ambiguous", "not_reproduced": "not reproduced",
    }  # fmt: skip
    by = {status: [row["id"] for row in rows if row["status"] == status] for status in words}
    matched = sum(len(by[status]) for status in ("reproduced", "calibrated"))
    mark = "yes" if len(by["reproduced"]) == len(rows) else "partly" if matched else "no"
    told = [f"{len(by[status])} {words[status]}" for status in ("reproduced", "calibrated") if by[status]]
    rest = [
        f"{words[status]}: {', '.join(by[status])}"
        for status in ("by_construction", "ambiguous", "not_reproduced")
        if by[status]
    ]
    if rows:
        yield Line(mark, f"{matched} of {len(rows)} results match{_listed(': ', told)}{_listed('; ', rest, '; ')}.")


def _row(document: Document, course: Course) -> Row:
    says = METHODS[course.method].says if course.method in METHODS else course.method
    own = document["scenario"]["resolved"]["runs"][course.name].get("set", {})
    says += "".join(f", {key}: {value}" for key, value in own.items())
    proved = ", proved" if course.method == "d" and proved_for_d(document, [course]) else ""
    if course.safe is None:
        safe = Line("open", f"not known, {course.why}")
    elif not course.safe:
        near = course.near[0] if course.near else None
        more = _more(course, "; {} more pair{}")
        safe = Line("no", f"{near.told()}{more}" if near else course.why)
    elif course.near:
        told = f"{distance(course.near[0].value_m, course.near[0].required_m)}{proved or ', not proved'}"
        safe = Line("yes" if course.tested else "none", told if course.tested else f"{told}; not tested")
    else:
        safe = Line("none", "nothing near")
    if course.away is None:
        return Row(course.name, says, safe, Line("open", "not known"), "not run")
    count = len(document["scenario"]["resolved"]["ugvs"])
    home = "yes" if not course.away else "no"
    uav = "; not the UAV" if course.away and course.there == count else ""
    return Row(course.name, says, safe, Line(home, f"{course.there} of {count}{uav}"), _interventions(document, course))


def _interventions(document: Document, course: Course) -> str:
    run = document["runs"][course.name]
    kinds = [event["kind"] for event in run["events"]]
    proposed, accepted, refused = (kinds.count(kind) for kind in ("proposal", "accept", "refuse"))
    if not proposed:
        return "none"
    if course.method in METHODS and not METHODS[course.method].gated:
        return f"{proposed} obeyed"
    told = ", ".join(f"{n} {what}" for n, what in ((accepted, "accepted"), (refused, "refused")) if n) or "no answer"
    reasons: dict[str, int] = {}
    for found in (run["metrics"]["gatekeeper"] or {}).get("refusals", {}).values():
        for reason, count in found.items():
            words = WORDS_OF_REFUSALS.get(reason, reason.replace("_", " "))
            reasons[words] = reasons.get(words, 0) + count
    return told + (f": {max(reasons, key=reasons.__getitem__)}" if refused and reasons else "")


def _intrusion(course: Course, *, brief: bool = False) -> str:
    if not course.near or course.near[0].margin_m >= -SLACK_M:
        hit = course.collisions[0] if course.collisions else None
        return f"{hit['robot']} collides at {hit['t_s']:.2f} s" if hit else course.why
    least = course.near[0]
    told = f"{least.robot} comes within {distance(least.value_m, least.required_m)} of {least.other}"
    if brief:
        return told
    if course.collisions:
        told = f"{_colliding(course)}, {distance(least.value_m, least.required_m)} from {least.other}"
    told += f" at {least.t_s:.2f} s, required {least.required_m:g} m"
    return told + _more(course, "; {} more pair{} too close")


def _more(course: Course, told: str) -> str:
    """How many pairs besides the first were too near, in words with places for the number and a plural's s."""
    short = sum(near.margin_m < -SLACK_M for near in course.near) - 1
    return told.format(short, "s" * (short > 1)) if short > 0 else ""


def _colliding(course: Course) -> str:
    names = list(dict.fromkeys(event["robot"] for event in course.collisions))
    return f"{_some(names)} collide{'s' * (len(names) == 1)}"


def _declared(document: Document, course: Course) -> str:
    """Whether the scenario declares that a run is not safe."""
    claim = next(
        c for c in [*document["claims"], None] if c is None or (c["id"], c["run"]) == ("SAFE-TRACE", course.name)
    )
    return " (expected)" if claim and claim["as_expected"] and claim["status"] == "refuted" else ""


def _failures(unsafe: Sequence[Course], short: Sequence[Course]) -> str:
    """What went wrong under the other methods: the worst first."""
    told: dict[str, list[Course]] = {}
    for course in [*unsafe, *short]:
        told.setdefault(_trouble([course]), []).append(course)
    return "; ".join(f"under {_methods(those, '')}, {what}" for what, those in told.items()) + "."


def _trouble(those: Sequence[Course]) -> str:
    """What became of those who did not arrive, or came too near."""
    unsafe = next((course for course in those if course.safe is False), None)
    if unsafe is not None:
        told = _colliding(unsafe) if unsafe.crashed else _intrusion(unsafe, brief=True)
        hit = {event["robot"] for event in unsafe.collisions}
        away = [robot for robot in unsafe.away or () if robot not in hit]
        return f"{told}, and {_absent(away)}" if away else told
    away = list(dict.fromkeys(robot for course in those for robot in course.away or {}))
    stuck = all(robot in course.stuck for course in those for robot in course.away or {})
    if stuck:
        return f"{_some(away)} {'is' if len(away) == 1 else 'are'} stuck"
    return _absent(away)


def _absent(names: Sequence[str]) -> str:
    return f"{_some(names)} {'does' if len(names) == 1 else 'do'} not arrive"


def _unless_one_crashed(every: Iterable[Course], told: str) -> Line:
    """Good news, unless a robot collided in any run at all."""
    crashed = [course for course in every if course.crashed]
    if not crashed:
        return Line("yes", told)
    hits = "; ".join(f"in run {course.name}, {_colliding(course)}" for course in crashed if course.plain is False)
    return Line("partly", f"{told} {_capital(hits)}." if hits else told)


def _triggers(document: Document) -> list[Mapping[str, Any]]:
    return [event for run in document["runs"].values() for event in run["events"] if event["kind"] == "trigger"]


def _one(those: Sequence[Course]) -> bool:
    return len({course.method for course in those}) == 1


def _methods(those: Sequence[Course], noun: str = "method") -> str:
    names = list(dict.fromkeys(f"({course.method})" for course in those))
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    return f"{noun}{'s' * (len(names) > 1)} {listed}" if noun else listed


def _of_runs(names: Sequence[str]) -> str:
    return f"run{'s' * (len(names) > 1)} {', '.join(names)}"


def _some(names: Sequence[str]) -> str:
    shown = list(names[:MAX_NAMES])
    if len(names) > MAX_NAMES:
        return f"{len(names)} robots"
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"


def _listed(before: str, words: Sequence[str], between: str = ", ") -> str:
    return before + between.join(words) if words else ""


def _capital(says: str) -> str:
    return says[:1].upper() + says[1:]
