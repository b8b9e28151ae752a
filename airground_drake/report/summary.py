"""The first screen of a report: headline, table of methods, answers, what not to conclude.

Marks follow what happened in the runs. Whether the scenario declares that is another line, `as_declared`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import NOT_EXERCISED, UNDECIDED, outcome
from airground_drake.registry import METHODS
from airground_drake.report.answers import Answer
from airground_drake.report.answers import answers as answers_of
from airground_drake.report.outcomes import Document, RunOutcome, courses, tolerance, triggers
from airground_drake.report.phrases import (
    MARKS,
    MAX_NAMES,
    MEANINGS,
    Line,
    colliding,
    counted,
    grouped,
    joined,
    kept_away,
    more_pairs,
    of_run,
    refusal,
    subject,
    too_fast,
    trouble,
    under,
)

WIDTH = 110
"""Characters of a line on a terminal, about."""


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
    required: str
    """The distances that pairs must keep, with their unit."""
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
        return ", ".join(f"{MARKS[mark]} {meaning}" for mark, meaning in MEANINGS.items() if mark in used)


def first_screen(document: Document) -> FirstScreen:
    """The first screen of a report, from report.json."""
    every = courses(document)
    tabulated = len(every) > 1 and not document["reproduction"]
    required = sorted({near.required_m for course in every for near in course.near})
    return FirstScreen(
        headline(document),
        [_row(document, course) for course in every] if tabulated else [],
        f"{' to '.join(f'{each:g}' for each in dict.fromkeys(required[:1] + required[-1:]))} m" if required else "",
        tolerance(document),
        answers_of(document, every, tabulated=tabulated),
        _beware(document, every),
        as_declared(document),
    )


def headline(document: Document) -> Line:
    """The report in a sentence, and in another one if a verdict is not the one that the scenario declares."""
    mark, told = _outcome(courses(document))
    differs = sum(claim["as_expected"] is False and claim["status"] not in UNDECIDED for claim in document["claims"])
    differs += sum(not each["as_expected"] for each in document["overall"]["numbers"])
    if not differs:
        return Line(mark, told)
    checks = f"{counted(differs, 'check')} {'is' if differs == 1 else 'are'}"
    return Line("partly" if mark == "yes" else mark, f"{told} {checks} not as declared.")


def _outcome(every: Sequence[RunOutcome]) -> Line:
    """What came of the runs, in a sentence."""
    main = [course for course in every if course.plain] or every
    unknown = [course.name for course in main if course.safe is None or course.away is None]
    unsafe = [course for course in main if course.safe is False]
    fine = [course for course in main if course.fine]
    helped, alone = ([course for course in main if course.helped is way] for way in (True, False))
    if not main:
        return Line("open", "Nothing was run.")
    if movers := _beside_movers(main, unsafe):
        return movers
    could_not = f"un{'s' * (len(unknown) > 1)} {', '.join(unknown)} could not be judged."
    if unknown and not unsafe:
        return Line("open", f"Not decided: r{could_not}")
    unjudged = f" R{could_not}" if unknown else ""
    if len(fine) == len(main):
        told = "With and without help, all arrive safely." if helped and alone else "All arrive safely."
        return _unless_one_crashed(every, told)
    if helped and all(course.fine for course in helped):
        told = f"With help, all arrive safely{_failures(alone, alone, '. Without it, ')}"
        return _unless_one_crashed(every, told + unjudged)
    short = [course for course in main if course.away and course not in unsafe]
    if fine:
        who = subject(fine, main) if unjudged else f"only {subject(fine, main)}"
        told = f"{who} safe and {'brings' if who.endswith('is') else 'bring'} everyone home"
        return Line("partly", f"{told[0].upper()}{told[1:]}{_failures([*unsafe, *short], main)}{unjudged}")
    if unsafe:
        told = "No method brings everyone home safely" if len(main) > 1 and not unjudged else "Not safe"
        return Line("no", f"{told}{_failures(unsafe, main)}{unjudged}")
    waits = {trouble(course) for course in short}
    if len(waits) == 1 and len(short) == len(main) and any(kept_away(short[0], robot) for robot in short[0].away or ()):
        return Line("no", f"Safe, but {waits.pop()}.")
    return Line("no", f"Safe, but not all arrive{_failures(short, main, ': ')}")


def _beside_movers(main: Sequence[RunOutcome], unsafe: Sequence[RunOutcome]) -> Line | None:
    """What obstacles did that move: that they came too near themselves, or faster than declared; None: neither."""
    blamed = [course for course in unsafe if not course.blameless]
    faster = [course for course in main if course.faster]
    if blamed or not (unsafe or faster):
        return None
    told = grouped((trouble(course), course) for course in unsafe)
    said = [_where(what, alike, main) for what, alike in told.items()]
    parts = [*said, "No robot brought a distance below the required one itself"] if said else []
    speeds = grouped((too_fast(course), course) for course in faster)
    parts += [_where(what, alike, main) for what, alike in speeds.items()]
    missing = grouped((trouble(course), course) for course in main if course.away and course not in unsafe)
    parts += [_where(what, alike, main) for what, alike in missing.items()]
    if unknown := [course.name for course in main if course.safe is None or course.away is None]:
        parts.append(f"Run{'s' * (len(unknown) > 1)} {', '.join(unknown)} could not be judged")
    return Line("no" if faster else "partly", " ".join(f"{part}." for part in parts))


def _where(what: str, those: Sequence[RunOutcome], among: Sequence[RunOutcome]) -> str:
    """What happened in those runs, and in which if not in all."""
    if len(those) == len(among):
        return what
    runs = under(those, among)
    return f"{runs[0].upper()}{runs[1:]}, {what}"


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
    says = "; ".join(clauses)
    return f"{says[0].upper()}{says[1:]}."


def _row(document: Document, course: RunOutcome) -> Row:
    resolved = document["scenario"]["resolved"]
    says = of_run(resolved, course)
    if course.away is None:
        return Row(course.name, says, _safe(course), Line("open", "not known"), "not run")
    count = len(resolved["ugvs"])
    uav = "; not the UAV" if course.away and course.there == count else ""
    arrived = Line("no" if course.away else "yes", f"{course.there} of {count}{uav}")
    return Row(course.name, says, _safe(course), arrived, _interventions(document, course))


def _safe(course: RunOutcome) -> Line:
    near = course.near[0] if course.near else None
    if course.safe is None:
        return Line("open", f"not known, {course.why}")
    if course.blameless:
        return Line("partly", f"{near.told()}: not its own doing" if near else "not the robots' own doing")
    if not course.safe:
        return Line("no", f"{near.told()}{more_pairs(course)}" if near else course.why)
    if not near:
        return Line("none", "nothing near")
    proved = bool(course.proof and course.proof.holds)
    told = f"{near}, {'proved' if proved and not near.moves else 'not proved'}"
    told += f" beside {near.other}; all else proved" if proved and near.moves else ""
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
    answers = {"accepted": kinds["accept"], "refused": kinds["refuse"]}
    answered = [f"{count} {answer}" for answer, count in answers.items() if count]
    reasons = Counter[str]()
    for found in (run["metrics"]["gatekeeper"] or {}).get("refusals", {}).values():
        for reason, count in found.items():
            reasons[refusal(reason)] += count
    why = f": {reasons.most_common(1)[0][0]}" if kinds["refuse"] and reasons else ""
    return f"{', '.join(answered) or 'no answer'}{why}{failed}"


def _beware(document: Document, every: Sequence[RunOutcome]) -> list[str]:
    said = ["real vehicles are safe: the model is first-order, its sensing perfect"]
    main = [course for course in every if course.plain] or every
    if seen := [course for course in main if course.safe and not (course.proof and course.proof.holds)]:
        said.append(f"{subject(seen, main)} also safe elsewhere: that was only seen in these runs")
    if movers := list(dict.fromkeys(name for course in main for name in course.movers)):
        who = joined(movers) if len(movers) <= MAX_NAMES else counted(len(movers), "obstacle that may move")
        said.append(f"a robot can keep its distance from {who}: what moves can come as near as it likes")
    home = [course.away == {} for course in every]
    if any(home):
        who = "all" if all(home) else "those that arrive here"
        said.append(f"{who} also arrive from other starts or with other seeds: arrival is seen, not proved")
    if document["runs"] and not triggers(document):
        said.append("the UAV helps: it was never called")
    if any(course.safe is None for course in every):
        said.append("what could not be judged is fine")
    return said


def as_declared(document: Document) -> Line:
    """Whether the verdicts are those that the scenario declares: a statement about the scenario, not about safety."""
    overall, claims = document["overall"], document["claims"]
    if overall["status"] != "as_expected":
        return Line("no" if overall["status"] == "not_as_expected" else "open", str(overall["why"]))
    failed = sum(claim["status"] == "refuted" and claim["as_expected"] is True for claim in claims)
    undecided, unpromised = sum(claim["status"] in UNDECIDED for claim in claims), overall["unpromised"]
    idle = sum(outcome(claim["status"], claim["exercised"]) == NOT_EXERCISED for claim in claims)
    parts = [
        counted(failed, "deliberate failure") if failed else "",
        f"{undecided} undecided" if undecided else "",
        f"{idle} not tested" if idle else "",
    ]
    told = ", ".join(filter(None, parts))
    more = f" For {counted(len(unpromised), 'more claim')} nothing is promised." if unpromised else ""
    return Line("yes", f"{overall['checks']} checks as declared{': ' if told else ''}{told}.{more}")


def text(document: Document) -> str:
    """The first screen for a terminal."""
    screen = first_screen(document)
    lines = [one_line(_marked(screen.headline)), *_table(screen)]
    for question, answered in screen.answers:
        for k, line in enumerate(answered):
            asked = "" if k else question
            said = f"{asked:<11} {_marked(line)}" if line.mark else f"{asked:<15} {line.text}"
            lines += wrap(one_line(said), WIDTH, subsequent_indent=16 * " ")
    beware = [one_line(f"  - {clause}") for clause in screen.beware]
    return "\n".join([*lines, "Do not conclude that", *beware, f"Marks: {screen.legend}."])


def _marked(line: Line) -> str:
    return f"[{MARKS[line.mark]}] {line.text}"


def _table(screen: FirstScreen) -> list[str]:
    """The table of methods in columns of equal width."""
    arrived = f"arrived?{f' (within {screen.within})' if screen.within else ''}"
    cells = [["", "method", f"safe? ({screen.required})", arrived, "UAV proposals"]]
    cells += [[row.run, row.method, _marked(row.safe), _marked(row.arrived), row.interventions] for row in screen.rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [one_line("  ".join(map(str.ljust, row, widths)).rstrip()) for row in cells] if screen.rows else []
