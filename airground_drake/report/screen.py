"""The first screen of a report, for the page and the terminal, in the same form for every scenario.

Each cell is a mark and short lines; each line is one fact and needs no other line. The tables are in `rules`.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import NamedTuple

from airground_drake.base.errors import one_line
from airground_drake.base.statuses import PASSING
from airground_drake.report import rules
from airground_drake.report.facts import RunFacts
from airground_drake.report.model import Claim, Report
from airground_drake.report.sentences import MARKS, Line, counted, grouped, some, unbroken
from airground_drake.scenario.schema import Run
from airground_drake.ugv.reasons import refusal

# Maximum numbers of endings of UGVs in a cell, of names in a line, and of warnings.
MOST_ENDINGS, MOST_NAMES, MOST_WARNINGS = 4, 2, 3


class Cell(NamedTuple):
    """Lines with a mark, a key of `sentences.MARKS`, or ''."""

    mark: str
    lines: list[str]


class Check(NamedTuple):
    """An answer to a question about all runs, and the section of the page with details."""

    question: str
    mark: str
    answer: str
    section: str = ""


@dataclass
class Row:
    """A row of the table of runs."""

    run: str  # its name
    says: str  # its description
    plain: bool  # whether it uses the package's composition of priorities; other runs are for comparison
    # safe, arrived, uav: its cells.
    safe: Cell = field(default_factory=lambda: Cell("open", ["not run"]))
    arrived: Cell = field(default_factory=lambda: Cell("open", ["not run"]))
    uav: Cell = field(default_factory=lambda: Cell("", ["\N{EN DASH}"]))
    facts: RunFacts | None = None  # none if the scenario names the run, but it was not run
    bad_seeds: int = 0  # other seeds with which a distance was not kept
    kept: bool = False  # whether every distance was kept
    what: str = "not run"  # why not, for the headline

    @property
    def rank(self) -> tuple[int, bool, int, int]:
        """Sort key, best first: kept, not known, too close, collided; then by cause, seeds and arrivals."""
        facts = self.facts
        order = 0 if self.kept else 3 if facts and facts.collided else 2 if facts and facts.is_broken else 1
        alien = facts is not None and facts.whose.startswith("not")
        return order, not alien, self.bad_seeds, -facts.there if facts else 0

    @property
    def clause(self) -> tuple[str, str]:
        if self.facts is None:
            return "open", self.what
        there, ugvs = self.facts.there, len(self.facts.ugvs)
        came = f"{there} of {ugvs} arrive"
        if self.facts.ends_too_early and there < ugvs:
            came += " before the run ends"
        if not self.kept:
            return self.safe.mark, f"{came}, {self.what}"
        if self.bad_seeds:
            return "no", f"{came}, distances kept here, but not with every seed"
        return self.arrived.mark if there < ugvs else "yes", f"{came}, every distance kept"


class FirstScreen(NamedTuple):
    """The content of the first screen."""

    headline: list[Line]  # one or two lines with the marks of their own runs
    rows: list[Row]  # a row per run
    within: str  # the arrival tolerance, in words
    checks: list[Check]  # seeds, triggers, threshold, and the paper
    beware: list[str]  # possible wrong conclusions: clauses that continue "Do not conclude that"
    declared: Cell  # whether the verdicts are those that the scenario declares: nothing about safety


def first_screen(report: Report) -> FirstScreen:
    rows = _rows(report)
    checks = [*_seeds(report), *_zeno(report), *_threshold(report, rows), *_paper(report)]
    within = f"within {report.scenario.resolved.arrival_tolerance_m:g} m"
    return FirstScreen(_headline(rows), rows, within, checks, _beware(report, rows), declared(report))


def _headline(rows: Sequence[Row]) -> list[Line]:
    main = sorted([row for row in rows if row.plain] or rows, key=lambda row: row.rank)
    collided = [row for row in rows if not row.plain and row.facts and row.facts.collided]
    rest = sorted((row for row in [*main, *collided] if row.clause != main[0].clause), key=lambda row: row.rank)
    lines = []
    for row, among in ((main[0], main), *[(rest[-1], rest) for _ in rest[:1]]):
        mark, says = row.clause
        alike = [other for other in among if other.clause == row.clause]
        lines.append(Line(mark, f"{_who(alike)} ({', '.join(other.run for other in alike)}): {says}."))
    return lines


def _who(alike: Sequence[Row]) -> str:
    runs = [row.facts for row in alike if row.facts]
    helped = {run.is_helped for run in runs}
    uav = "UAVs" if any(len(run.uavs) > 1 for run in runs) else "UAV"
    return f"{'With or without' if len(helped) != 1 else 'With' if True in helped else 'Without'} the {uav}"


def _rows(report: Report) -> list[Row]:
    rows = []
    for name, spec in report.scenario.resolved.runs.items():
        row = Row(name, _says(spec), spec.composition == "augmented")
        if name in report.runs:
            row.facts = run = RunFacts(report, name)
            rule = next(rule for rule in rules.SAFE if rule.applies(run))
            row.kept, row.what = rule.kept, _what(run)
            row.safe, row.arrived, row.uav = _safe(run, rule), _arrived(run), _uav(run)
            row.bad_seeds = sum(seed.run == name and not seed.kept for seed in report.seeds)
        rows.append(row)
    return rows


def _says(spec: Run) -> str:
    """The description of a run: its method, or the method's identifier and the run's own settings."""
    says = [rules.SETTINGS.get((key, str(value)), f"{key.split('.')[-1]} {value}") for key, value in spec.set.items()]
    if spec.composition != "augmented":
        says.append(rules.PRINTED)
    return f"({spec.method}) with {', '.join(says)}" if says else rules.RUNS.get(spec.method, spec.method)


def _safe(run: RunFacts, rule: rules.Rule) -> Cell:
    judged = run.claim(rules.DISTANCES)
    faster = [f"{mover} was faster than declared" for mover in run.faster]
    if rule.kept:
        near = [near_body.line for near_body in run.approaches() if not near_body.is_short]
        return Cell(rule.mark, [rule.words, *(near[:MOST_NAMES] or ["no other body"]), *faster])
    if rule.mark == "open":
        return Cell(
            rule.mark, [rule.words, f"the check: {(judged.status if judged.id else 'not made').replace('_', ' ')}"]
        )
    as_declared = " (as declared)" if judged.status == "refuted" and judged.as_expected is True else ""
    lines = [rule.words + as_declared, *(breach.line for breach in run.breaches[:1])]
    if run.collided and len(run.breaches) > 1:
        lines.append(counted(len(run.breaches) - 1, "more collision"))
    if run.others_too_close:
        lines.append(f"{counted(run.others_too_close, 'more pair')} too close")
    if run.whose:
        lines.append(run.whose)
    lines += faster
    lines += [f"{body} is not on the UAV's map" for body in run.unmapped[:MOST_NAMES]]
    if run.contradicts_its_proof:
        lines.append("contradicts its proof: please report")
    return Cell(rule.mark, lines)


def _what(run: RunFacts) -> str:
    """Why a run was not safe, in a few words for the headline."""
    few, many = ("collide", "collisions") if run.collided else ("too close", "pairs too close")
    if not (run.collided or run.is_broken):
        return "safety not known"
    breaches = f"{len(run.breaches) or 'some'} {many}"
    if len(run.breaches) == 1:
        breaches = f"{run.breaches[0].first} and {run.breaches[0].second} {few}"
    return f"{breaches} ({run.whose})" if run.whose else breaches


def _arrived(run: RunFacts) -> Cell:
    count = f"{run.there} of {len(run.ugvs)}"
    away = [ugv for ugv in run.ugvs if ugv not in run.home]
    if not away:
        last = max((run.arrived_s.get(ugv, 0.0) for ugv in run.ugvs), default=0.0)
        astray = [uav for uav in run.uavs if uav not in run.home]
        who = "the UAV" if astray == run.uavs and len(astray) == 1 else some(astray, MOST_NAMES)
        others = [f"{who} did not"] if astray else []
        return Cell("partly" if astray else "yes", [f"{count}, by {last:.1f} s", *others])
    goal = run.claim(rules.ARRIVAL)
    as_declared = " (as declared)" if goal.as_expected is True else ""
    ends = [*grouped((run.ending(ugv), ugv) for ugv in away).items()]
    endings = [f"{some(who, MOST_NAMES)} {how}" for how, who in ends]
    rest = sum(len(who) for _, who in ends[MOST_ENDINGS:])
    more = [counted(rest, "more UGV")] if rest else []
    return Cell(
        "partly" if run.there or run.ends_too_early else "no", [count + as_declared, *endings[:MOST_ENDINGS], *more]
    )


def _uav(run: RunFacts) -> Cell:
    if not run.is_helped:
        return Cell("", ["\N{EN DASH}"])
    sent = run.fates.total()
    lines = [f"{sent} sent: {', '.join(f'{count} {fate}' for fate, count in sorted(run.fates.items()))}"]
    if not sent:
        lines = [f"called {counted(run.triggers, 'time')}, sent none" if run.triggers else "never called"]
    if run.refusals:
        (reason, _), *others = run.refusals.most_common()
        lines.append(f"{'mostly' if others else 'why'} refused: {refusal(reason)}")
    lines += [f"{name} was lost at {lost_s:g} s" for name, lost_s in run.lost_s.items()]
    if failed := len(run.run.faults):
        lines.append(f"policy failed {counted(failed, 'time')}")
    messages = run.run.metrics.messages
    if messages and (took := messages.proposals + messages.withdrawals + messages.answers):
        lines.append(f"{counted(took, 'message')} ({sum(messages.always_on.values())} if always on)")
    return Cell("", lines)


def _seeds(report: Report) -> Iterator[Check]:
    scenario = report.scenario.resolved
    of_runs = grouped((seed.run, seed) for seed in report.seeds)
    ours = scenario.decision.noise_m_sqrt_s
    noise = [run.set.get("decision.noise_m_sqrt_s", ours) for run in scenario.runs.values()]
    by_outcome = grouped(
        ((sum(seed.kept for seed in those), sum(seed.home for seed in those), len(those)), run)
        for run, those in of_runs.items()
    )
    for (kept, home, count), names in by_outcome.items():
        mark = "no" if kept < count else "partly" if home < count else "yes"
        says = f"{', '.join(names)}: distances kept in {kept} of {count}, all arrive in {home}"
        yield Check("Other seeds?", mark, says)
        if kept < count:
            worst = min((seed for name in names for seed in of_runs[name]), key=lambda seed: seed.margin_m)
            yield Check("Other seeds?", "", f"the worst: {worst.line}, run {worst.run}, seed {worst.seed}")
    if of_runs and not any(level > 0.0 for level in noise):
        yield Check("Other seeds?", "none", "without decision noise a seed changes nothing")


def _zeno(report: Report) -> Iterator[Check]:
    """A line for each bound on the gaps between triggers, with the runs that have it."""
    bounds = report.about(rules.DWELL)
    own = {bound.run for bound in bounds}
    by_bound = grouped(
        ((bound.status, bound.inputs.get("dwell_s", 0.0)), name)
        for bound in bounds
        for name in ([bound.run] if bound.run else [name for name in report.runs if name not in own])
    )
    for (status, dwell_s), names in by_bound.items():
        traces = [claim for claim in report.about(rules.TRIGGER_GAPS) if claim.run in names]
        gaps = [claim.evidence["smallest_gap"]["gap_s"] for claim in traces if "smallest_gap" in claim.evidence]
        short = dwell_s < report.scenario.resolved.control.period_s
        says, mark = f"at least {dwell_s:g} s between two triggers, proved", "partly" if short else "yes"
        if short:
            says += ": less than a control period"
        if status != "proved":
            says, mark = "no least time between two triggers is proved", "no" if status == "refuted" else "open"
        if bad := [claim.run for claim in traces if claim.status == "refuted"]:
            says, mark = f"two triggers too close in {', '.join(bad)}", "no"
        if gaps:
            says += f"; least gap {min(gaps):.3g} s"
        elif _verdict(traces) == "yes":
            says += "; no robot triggered twice"
        yield Check("Zeno-free?", mark, f"{', '.join(names)}: {says}" if len(by_bound) > 1 else says, "claims")
    if not by_bound:
        yield Check("Zeno-free?", "open", "not checked", "claims")


def _threshold(report: Report, rows: Sequence[Row]) -> Iterator[Check]:
    """A line for each threshold about the triggers of its runs; its choice has a section of its own."""
    scenario = report.scenario.resolved
    ours = scenario.decision.threshold.rule
    of = grouped(
        ((run.run.zeta_m, scenario.runs[run.name].set.get("decision.threshold.rule", ours)), run)
        for run in (row.facts for row in rows)
        if run
    )
    for (zeta, rule), runs in of.items():
        exact, timing = ([run.claim(rule) for run in runs] for rule in (rules.CROSSINGS, rules.TIMING))
        timed = [claim.evidence for claim in timing if "counts" in claim.evidence]
        mark = _verdict([*exact, *timing])
        fired = sum(run.triggers for run in runs)
        says = [f"{counted(fired, 'trigger')} at {zeta:.3g} m ({rules.THRESHOLDS.get(rule, rule)})"]
        if not fired:
            most = [ugv["largest_decision_variable_m"] for claim in exact for ugv in claim.evidence.get("ugvs", ())]
            says += [f"{round(value, 9):.3g} m reached" for value in sorted(most)[-1:]]
            mark = "none" if mark == "yes" else mark
        says += [f"{sum(entry['counts'][kind] for entry in timed)} {kind}" for kind in ("false", "missed") if timed]
        off_s = [abs(entry[kind]["late_s"]) for entry in timed for kind in ("latest", "earliest") if entry[kind]]
        if timed and fired:
            says.append(f"at most {max(off_s, default=0.0):.2f} s off")
        above = list(dict.fromkeys(ugv for run in runs for ugv in run.run.metrics.above_at_start))
        if above:
            says.append(f"{some(above, MOST_NAMES)} above the threshold from the start")
        wrong = [run.name for run, claim in zip(runs, exact, strict=True) if claim.status == "refuted"]
        if wrong:
            says.append(f"{', '.join(wrong)}: triggers not at the crossings")
        if mark == "open":
            says.append("not known whether all are in time")
        yield Check("Threshold correct?", mark, ", ".join(says), "intervened")


def _verdict(those: Iterable[Claim]) -> str:
    statuses = {claim.status for claim in those}
    return "no" if "refuted" in statuses else "yes" if statuses and statuses <= {*PASSING} else "open"


def _paper(report: Report) -> Iterator[Check]:
    count = Counter[str](row.status for row in report.reproduction)
    match = sum(count[status] for status in rules.MATCHES)
    matches, rest = (
        [f"{count[status]} {says}" for status, says in words.items() if count[status]]
        for words in (rules.MATCHES, rules.REST)
    )
    if not count:
        yield Check("Paper reproduced?", "none", "not a scenario of the paper")
        return
    mark = "yes" if count["reproduced"] == count.total() else "partly" if match else "no"
    how = f" ({', '.join(matches)})" if matches else ""
    says = ", ".join([f"{match} of {count.total()} numbers match{how}", *rest])
    yield Check("Paper reproduced?", mark, says, "reproduction")


def _beware(report: Report, rows: Sequence[Row]) -> list[str]:
    """At most `MOST_WARNINGS` clauses; the last one always applies."""
    ran = [(row, row.facts) for row in rows if row.facts]
    movers = list(dict.fromkeys(name for _, run in ran for name in run.movers))
    seen = [row.run for row, run in ran if row.plain and row.kept and not run.is_proved]
    helped = [run for _, run in ran if run.is_helped]
    warnings = {
        "unknown results are good: they were not checked": any(row.safe.mark == "open" for row in rows),
        "the UAV helps: it was never called": bool(helped) and not any(run.triggers for run in helped),
        f"robots can keep away from {some(movers, MOST_NAMES)}: obstacles may move arbitrarily close": bool(movers),
        f"distances are kept in other runs of {', '.join(seen)}: this is not proved": bool(seen),
    }
    applying = [says for says, applies in warnings.items() if applies]
    return [*applying[: MOST_WARNINGS - 1], _real(report)]


def _real(report: Report) -> str:
    """Other starts and real robots may differ; with the measured drift and cover of a user's plant."""
    own = [plant for claim in report.about(rules.CONDITIONS) for plant in claim.evidence.get("own_plants", ())]
    if not own:
        given = report.scenario.resolved
        error_m, faults = given.position_error_m, given.faults
        perfect = "sensing is perfect" if given.ugv_links is None else "received positions are exact"
        sensing = f"position errors are at most {error_m:g} m" if error_m else perfect
        if faults and (faults.position_error_m or faults.late):
            sensing = "positions are worse than declared"
        return f"robots arrive from other starts or in reality: arrival is only observed, and {sensing} here"
    most = max(own, key=lambda plant: float(plant["cover_m"]))
    return (
        "robots arrive from other starts or in reality: {robot} showed {drift_m_s:.2g} of {declared_drift_m_s:.3g} m/s "
        "drift and {cover_m:.3g} of {declared_cover_m:.3g} m cover here"
    ).format_map(most)


def declared(report: Report) -> Cell:
    """Whether the verdicts are as the scenario declares, which says nothing about safety."""
    overall = report.overall
    refuted = sum(claim.status == "refuted" and claim.as_expected is True for claim in report.claims)
    lines = [f"{overall.as_expected} of {counted(overall.checks, 'check')} are as the scenario declares"]
    if refuted:
        lines[0] += f" ({counted(refuted, 'failure')} among them)"
    wrong = [*overall.differs, *overall.undecided, *overall.missing]
    subjects = {claim.id: claim.subject for claim in report.claims}
    names = [f"{claim.run or 'model'}: {subjects.get(claim.id) or claim.id or 'run'} "
             f"{rules.CAME_OUT.get(claim.status, claim.status)}" for claim in wrong]  # fmt: skip
    names += [f"finding {number} about the paper not demonstrated" for number in overall.undemonstrated]
    if names:
        lines.append(some(names, 3))
    if more := len(overall.unpromised):
        lines.append(f"{counted(more, 'more check')}: nothing is promised")
    mark = {"as_expected": "yes", "not_as_expected": "no"}.get(overall.status, "open")
    return Cell(mark, lines)


WIDTH = 100  # characters of a line
# Widths of the columns of runs, and of questions and answers; two blanks are between columns.
COLUMNS, ANSWERS = (20, 29, 23, 22), (18, 80)


def text(report: Report) -> str:
    screen = first_screen(report)
    lines = []
    for mark, clause in screen.headline:
        lines += wrap(one_line(f"[{MARKS[mark].icon}] {clause}"), WIDTH, subsequent_indent="    ")
    titles = ("Run", "Safe? (nearest approach)", f"Arrived? ({screen.within})", "UAV proposals")
    runs = [[Cell("", [title]) for title in titles]]
    runs += [[Cell("", [f"{row.run}: {row.says}"]), row.safe, row.arrived, row.uav] for row in screen.rows]
    below = [(check.question, Cell(check.mark, [check.answer])) for check in screen.checks]
    below += [("Do not conclude", Cell("", [f"that {warning}" for warning in screen.beware]))]
    below += [("As declared?", screen.declared)]
    asked = [question for question, _ in below]
    first = [question if question not in asked[:k] else "" for k, question in enumerate(asked)]
    answers = [[Cell("", [question]), cell] for question, (_, cell) in zip(first, below, strict=True)]
    return "\n".join([*lines, "", *_table(runs, COLUMNS), "", *_table(answers, ANSWERS)])


def _table(rows: Sequence[Sequence[Cell]], widths: Sequence[int]) -> list[str]:
    """Rows of text with columns of these widths; wrapped lines are indented past the mark."""
    lines = []
    for row in rows:
        cells = [_wrapped(cell, width) for cell, width in zip(row, widths, strict=True)]
        for k in range(max(map(len, cells))):
            parts = ((cell[k] if k < len(cell) else "").ljust(width) for cell, width in zip(cells, widths, strict=True))
            lines.append("  ".join(parts).rstrip())
    return lines


def _wrapped(cell: Cell, width: int) -> list[str]:
    indent = "  " if cell.mark else ""
    lines = []
    for k, line in enumerate(cell.lines):
        begin = f"{MARKS[cell.mark].icon} " if cell.mark and not k else indent
        lines += wrap(unbroken(one_line(line)), width, initial_indent=begin, subsequent_indent=f"{indent}  ")
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]
