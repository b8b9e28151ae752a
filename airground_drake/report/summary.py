"""The first screen of a report: headline, table of methods, answers, what not to conclude.

Marks follow what happened in the runs. Whether the scenario declares that is another line, `as_declared`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import NOT_EXERCISED, UNDECIDED, outcome
from airground_drake.gatekeeper.reasons import refusal
from airground_drake.registry import METHODS
from airground_drake.report.answers import Answer, answers
from airground_drake.report.outcomes import Document, RunOutcome, courses, tolerance, triggers
from airground_drake.report.phrases import colliding, kept_away, more_pairs, of_run, subject, too_fast, trouble, under
from airground_drake.report.sentences import MARKS, MAX_NAMES, Line, clause, counted, grouped, joined, say, upper

WIDTH = 110
"""Characters of a line on a terminal, about."""


ANSWERS = "accepted", "accepted and given up later", "refused"
"""What becomes of proposals."""


class Row(NamedTuple):
    """What came of a run, for the table of methods."""

    run: str
    method: str
    safe: Line
    arrived: Line
    interventions: str


class FirstScreen(NamedTuple):
    """What the first screen shows; `rows` only for several runs without a counterpart in the paper."""

    headline: Line
    rows: list[Row]
    within: str
    """The arrival tolerance with its unit, '' if it is the default."""
    answers: list[Answer]
    beware: list[str]
    """What a reader might wrongly conclude: clauses that continue "Do not conclude that"."""
    declared: Line

    @property
    def legend(self) -> str:
        """The marks on this screen with their meanings."""
        lines = [self.headline, self.declared, *(line for answer in self.answers for line in answer.lines)]
        used = {line.mark for line in [*lines, *(line for row in self.rows for line in (row.safe, row.arrived))]}
        return ", ".join(f"{mark.icon} {mark.meaning}" for name, mark in MARKS.items() if name in used - {""})


def first_screen(document: Document) -> FirstScreen:
    """The first screen of a report, from report.json."""
    every = courses(document)
    tabulated = len(every) > 1 and not document["reproduction"]
    return FirstScreen(
        headline(document),
        [_row(document, course) for course in every] if tabulated else [],
        tolerance(document),
        answers(document, every, tabulated=tabulated),
        _beware(document, every),
        as_declared(document),
    )


def headline(document: Document) -> Line:
    """The report in a sentence; a second sentence follows if a verdict differs from what the scenario declares."""
    every = courses(document)
    mark, told = _outcome(every, _main(document, every))
    differs = sum(claim["as_expected"] is False and claim["status"] not in UNDECIDED for claim in document["claims"])
    differs += sum(not each["as_expected"] for each in document["overall"]["numbers"])
    if not differs:
        return Line(mark, told)
    checks, are = counted(differs, "check"), "is" if differs == 1 else "are"
    return Line("partly" if mark == "yes" else mark, clause("undeclared", told=told, checks=checks, are=are))


def _main(document: Document, every: Sequence[RunOutcome]) -> Sequence[RunOutcome]:
    """The runs that the headline is about: not those that show the paper's recursion in a comparison with the paper."""
    return ([course for course in every if course.plain] if document["reproduction"] else []) or every


def _outcome(every: Sequence[RunOutcome], main: Sequence[RunOutcome]) -> Line:
    """What came of the runs, in a sentence."""
    unsafe = [course for course in main if course.safe is False]
    fine = [course for course in main if course.fine]
    short = [course for course in main if course.away and course not in unsafe]
    helped, alone = ([course for course in main if course.helped is way] for way in (True, False))
    could_not = _could_not(main)
    if not main:
        return say("nothing_run")
    if all(course.blameless for course in unsafe) and (unsafe or any(course.faster for course in main)):
        return _beside_movers(main, unsafe, short)
    if could_not and not unsafe:
        return say("nothing_judged", which=could_not)
    unjudged = f" {upper(could_not)}." if could_not else ""
    if len(fine) == len(main):
        return _unless_one_crashed(every, clause("either_way" if helped and alone else "alone"))
    if helped and all(course.fine for course in helped):
        failures = _failures(alone, alone, ". Without it, ")
        return _unless_one_crashed(every, clause("helped", failures=failures) + unjudged)
    if fine:
        who, failures = subject(fine, main), _failures([*unsafe, *short], main)
        only = who if unjudged else f"only {who}"
        bring = "brings" if who.endswith("is") else "bring"
        return say("some_arrive", who=upper(only), bring=bring, failures=failures + unjudged)
    if unsafe:
        name = "none_arrive" if len(main) > 1 and not unjudged else "unsafe"
        return say(name, failures=_failures(unsafe, main) + unjudged)
    waits = {trouble(course) for course in short}
    if len(waits) == 1 and len(short) == len(main) and any(kept_away(short[0], robot) for robot in short[0].away or ()):
        return say("safe_but", what=waits.pop())
    return say("safe_but_away", failures=_failures(short, main, ": "))


def _could_not(main: Sequence[RunOutcome]) -> str:
    """Which runs could not be judged, as a clause; '' if all could."""
    unknown = [course.name for course in main if course.safe is None or course.away is None]
    return clause("could_not", s="s" * (len(unknown) > 1), runs=", ".join(unknown)) if unknown else ""


def _beside_movers(main: Sequence[RunOutcome], unsafe: Sequence[RunOutcome], short: Sequence[RunOutcome]) -> Line:
    """What obstacles did that move: that they came too near themselves, or faster than declared."""
    faster = [course for course in main if course.faster]
    parts = [
        *_told(((trouble(course), course) for course in unsafe), main),
        *[clause("blameless")] * bool(unsafe),
        *_told(((too_fast(course), course) for course in faster), main),
        *_told(((trouble(course), course) for course in short), main),
        *[upper(each) for each in [_could_not(main)] if each],
    ]
    return Line("no" if faster else "partly", " ".join(f"{part}." for part in parts))


def _told(what: Iterable[tuple[str, RunOutcome]], among: Sequence[RunOutcome]) -> list[str]:
    """What happened, each once, and in which runs if not in all. A name at the beginning is left as it is."""
    return [told if len(alike) == len(among) else f"{upper(under(alike, among))}, {told}"
            for told, alike in grouped(what).items()]  # fmt: skip


def _failures(those: Iterable[RunOutcome], among: Sequence[RunOutcome], same: str = "") -> str:
    """What went wrong in those runs, as a sentence; `same`: begins it if the same went wrong in all of `among`."""
    told = grouped((trouble(course), course) for course in those if course.safe is False or course.away)
    if same and [len(alike) for alike in told.values()] == [len(among)]:
        return f"{same}{next(iter(told))}."
    return ". " + _sentence(f"{under(alike, among)}, {what}" for what, alike in told.items())


def _unless_one_crashed(every: Iterable[RunOutcome], told: str) -> Line:
    """Good news, unless a robot collided in any run."""
    crashed = [course for course in every if course.hits]
    hits = [f"in run {course.name}, {colliding(course)}" for course in crashed if not course.plain]
    return Line("partly" if crashed else "yes", f"{told} {_sentence(hits)}" if hits else told)


def _sentence(clauses: Iterable[str]) -> str:
    return f"{upper('; '.join(clauses))}."


def _row(document: Document, course: RunOutcome) -> Row:
    resolved = document["scenario"]["resolved"]
    says = of_run(resolved, course)
    if course.away is None:
        return Row(course.name, says, _safe(course), Line("open", "not known"), "not run")
    count = len(resolved["ugvs"])
    uav = "; not the UAV" * (bool(course.away) and course.there == count)
    collided = sum(robot in resolved["ugvs"] for robot in course.hits if robot in course.away)
    told = f"{course.there} of {count}{f'; {collided} collided' * bool(collided)}{uav}"
    arrived = Line("no" if course.away else "yes", told)
    return Row(course.name, says, _safe(course), arrived, _interventions(document, course))


def _safe(course: RunOutcome) -> Line:
    near = course.near[0] if course.near else None
    if course.safe is None:
        return Line("open", f"not known, {course.why}")
    if course.blameless:
        return Line("partly", f"{near.compared} ({near.between}): not its own doing" if near else "not its own doing")
    if not course.safe:
        return Line("no", f"{near.compared} ({near.between}){more_pairs(course)}" if near else course.why)
    if not near:
        return Line("none", "nothing near")
    proved = bool(course.proof and course.proof.holds)
    movers = course.movers or [near.whom] * near.moves
    told = f"{near.compared}, {'proved' if proved else 'not proved'}"
    told += f", except from {movers[0] if len(movers) == 1 else 'what moves'}" * (proved and bool(movers))
    return Line("yes", told) if course.tested else Line("none", f"{told}; not tested")


def _interventions(document: Document, course: RunOutcome) -> str:
    """What became of the proposals of the UAV in a run."""
    run = document["runs"][course.name]
    kinds = Counter(event["kind"] for event in run["events"])
    failed = f"policy failed {counted(len(run['faults']), 'time')}" if run.get("faults") else ""
    if not kinds["proposal"]:
        return f"{failed or 'none'}{': no way found' * bool(course.no_way)}"
    failed = f"; {failed}" if failed else ""
    if course.method in METHODS and not METHODS[course.method].gated:
        return f"{kinds['proposal']} obeyed{failed}"
    answered = Counter(_answer(answers) for answers in _answers(run["events"]))
    told = ", ".join(f"{answered[answer]} {answer}" for answer in ANSWERS if answered[answer])
    reasons = Counter[str]()
    for found in (run["metrics"]["gatekeeper"] or {}).get("refusals", {}).values():
        for reason, count in found.items():
            reasons[refusal(reason)] += count
    del reasons[refusal("joint_refused")]  # that of the UGV which did not want to says more
    why = f": {reasons.most_common(1)[0][0]}" if answered["refused"] and reasons else ""
    return f"{told or 'no answer'}{why}{failed}"


def _answers(events: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The answers to each proposal, in order."""
    latest, found = dict[str, list[str]](), list[list[str]]()
    for event in events:
        if event["kind"] == "proposal":
            found.append([])
            latest[event["robot"]] = found[-1]
        elif event["kind"] in ("accept", "refuse") and event["robot"] in latest:
            latest[event["robot"]].append(event["kind"])
    return found


def _answer(answers: Sequence[str]) -> str:
    """What became of a proposal, one of `ANSWERS`; '' without an answer."""
    if "accept" in answers:
        return "accepted" if answers[-1] == "accept" else "accepted and given up later"
    return "refused" if answers else ""


def _own_plants(document: Document) -> list[dict[str, Any]]:
    """What SAFE-HYP says of each robot with a user's plant, with the largest numbers of all runs."""
    found = dict[str, dict[str, Any]]()
    for claim in document["claims"]:
        for each in (claim["evidence"] or {}).get("own_plants", ()) if claim["id"] == "SAFE-HYP" else ():
            before = found.setdefault(each["robot"], each)
            found[each["robot"]] = each | {key: max(each[key], before[key]) for key in ("drift_m_s", "cover_m")}
    return [*found.values()]


def _beware(document: Document, every: Sequence[RunOutcome]) -> list[str]:
    main = _main(document, every)
    robots = [*document["scenario"]["resolved"]["ugvs"].values(), document["scenario"]["resolved"]["uav"]]
    plants = [plant for robot in robots for plant in robot.get("plant", ())]
    own, real = _own_plants(document), "real_plants" if any(p["kind"] != "first_order" for p in plants) else "real"
    told = [clause("real_own", each) for each in own[:MAX_NAMES]] or [clause(real)]
    if seen := [course for course in main if course.safe and not (course.proof and course.proof.holds)]:
        told.append(clause("elsewhere", who=subject(seen, main)))
    if movers := list(dict.fromkeys(name for course in main for name in course.movers)):
        who = joined(movers) if len(movers) <= MAX_NAMES else f"{len(movers)} obstacles that may move"
        told.append(clause("beside_movers", who=who))
    home = [course.away == {} for course in every]
    if any(home):
        told.append(clause("other_starts", who="all" if all(home) else "those that arrive here"))
    if document["runs"] and not triggers(document):
        told.append(clause("never_called"))
    if any(course.safe is None for course in every):
        told.append(clause("open_is_fine"))
    return told


def as_declared(document: Document) -> Line:
    """Whether the verdicts are those that the scenario declares: a statement about the scenario, not about safety."""
    overall, claims = document["overall"], document["claims"]
    if overall["status"] != "as_expected":
        return Line("no" if overall["status"] == "not_as_expected" else "open", str(overall["why"]))
    failed = sum(claim["status"] == "refuted" and claim["as_expected"] is True for claim in claims)
    undecided, unpromised = sum(claim["status"] in UNDECIDED for claim in claims), overall["unpromised"]
    idle = sum(outcome(claim["status"], claim["exercised"]) == NOT_EXERCISED for claim in claims)
    parts = [
        counted(failed, "deliberate failure") * bool(failed),
        f"{undecided} undecided" * bool(undecided),
        f"{idle} not tested" * bool(idle),
    ]
    told = ", ".join(filter(None, parts))
    more = f" For {counted(len(unpromised), 'more claim')} nothing is promised." * bool(unpromised)
    return say("declared", checks=overall["checks"], told=f": {told}" * bool(told), more=more)


def text(document: Document) -> str:
    """The first screen for a terminal."""
    screen = first_screen(document)
    lines = [one_line(_marked(screen.headline)), *_table(screen)]
    for question, answered in screen.answers:
        for k, line in enumerate(answered):
            asked = "" if k else question
            said = f"{asked:<11} {_marked(line)}" if line.mark else f"{asked:<15} {line.text}"
            lines += wrap(one_line(said), WIDTH, subsequent_indent=16 * " ")
    beware = [one_line(f"  - {each}") for each in screen.beware]
    return "\n".join([*lines, "Do not conclude that", *beware, f"Marks: {screen.legend}."])


def _marked(line: Line) -> str:
    return f"[{MARKS[line.mark].icon}] {line.text}"


def _table(screen: FirstScreen) -> list[str]:
    """The table of methods in columns of equal width."""
    arrived = f"arrived?{f' (within {screen.within})' if screen.within else ''}"
    cells = [["", "method", "safe?", arrived, "UAV proposals"]]
    cells += [[row.run, row.method, _marked(row.safe), _marked(row.arrived), row.interventions] for row in screen.rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [one_line("  ".join(map(str.ljust, row, widths)).rstrip()) for row in cells] if screen.rows else []
