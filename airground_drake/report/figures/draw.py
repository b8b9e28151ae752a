"""The figures of a report: maps, distances, decision variables with events; histograms of a large team.

Each figure is a row of panels, separate drawings that a page can stack on a phone. Runs with identical paths share a
panel. Each panel has a table of its data.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.base.registry import method_of
from airground_drake.report.figures import findings, maps, timelines
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Panel, Table, panel, series
from airground_drake.report.metrics import close_by, events_of, gap_m
from airground_drake.report.reproduction import MEASURES
from airground_drake.report.rules import SETTINGS
from airground_drake.report.view import canvas
from airground_drake.report.view.plane import frame_of
from airground_drake.report.view.stage import barriers_of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

# Maximum numbers of runs, of UGVs in the figure of distances, and of UGVs by name. Larger teams get histograms.
MAX_RUNS, MAX_UGVS, MAX_TEAM = 6, 4, 6
ALIKE_M = 1e-9  # paths that differ by no more than this are identical but for rounding
# Distances are drawn up to this multiple of the largest required one, of bodies that came nearer than that one.
FARTHEST, NEAR = 5.0, 3.0

# Numbers of the paper's figures, by the beginning of a scenario's name.
_PAPER = {
    "case_a": ("Figure 3", "Figure 5", "Figures 4 and 6"), "case_b": ("Figure 7", "Figure 9", "Figures 8 and 10"),
}  # fmt: skip
_NUMBERED = ("trajectories", "distances", "timelines")
# Marks of maps by kind.
_MARKS = {
    "stall": "□ stood still", "accepted": "● accepted proposal (dashed green path)",
    "refused": "✖ refused proposal (dotted red path)", "unanswered": "◆ proposal without an answer (dash-dotted path)",
    "collision": "★ collision (short dashes from there: it does not count)",
}  # fmt: skip
# Marks of events by kind.
_EVENTS = {"trigger": "▲ trigger", "release": "▼ release", "proposal": "◆ proposal", "accept": "● accepted",
           "refuse": "✖ refused", "over": "■ time over"}  # fmt: skip


@dataclass(frozen=True)
class _Selection:
    """The runs and UGVs that the figures show."""

    runs: dict[str, Trace]
    shown: dict[str, Trace]  # one run for each set of identical paths, by the heading of its panels
    team: list[str]  # UGVs with names and looks
    ugvs: list[str]  # UGVs of the team with distances of their own

    @property
    def first(self) -> Trace:
        return next(iter(self.runs.values()))


def draw(scenario: Scenario, traces: Mapping[str, Trace], settings: Mapping[str, Any] | None = None) -> list[Figure]:
    """All figures of a report; none without traces."""
    # settings: of matplotlib (rcParams), in place of a report's.
    if not traces:
        return []
    for trace in traces.values():
        if trace.robots != (known := [*trace.scenario.robots]):
            wrong = f"its robots are {', '.join(trace.robots)}; those of its scenario: {', '.join(known)}"
            raise TraceError(f"run {trace.run}: {wrong}")
    numbers = next((paper for name, paper in _PAPER.items() if scenario.name.startswith(name)), ())
    with canvas.style(settings):
        chosen = _select(scenario, traces)
        drawn = [_trajectories(chosen), _distances(chosen), _timelines(chosen)]
        drawn += [_team(chosen)] if len(chosen.first.ugvs) > MAX_TEAM else []
        compared = findings.recursion(scenario, traces)
    counterpart = dict(zip(_NUMBERED, numbers, strict=False))
    figures = [figure for figure in [*drawn, compared] if figure is not None]
    ours = {figure.id: f" (the paper's {counterpart[figure.id]})" for figure in figures if figure.id in counterpart}
    return [replace(figure, title=f"{figure.title}{ours.get(figure.id, '')}") for figure in figures]


def _select(scenario: Scenario, traces: Mapping[str, Trace]) -> _Selection:
    plain = {name: trace for name, trace in traces.items() if scenario.runs[name].composition == "augmented"}
    runs = dict(list((plain or dict(traces)).items())[:MAX_RUNS])
    groups: list[list[str]] = []
    for name, trace in runs.items():
        known = next((group for group in groups if _alike(runs[group[0]], trace)), None)
        groups.append([name]) if known is None else known.append(name)
    first = next(iter(runs.values()))

    def rank(ugv: str) -> tuple[bool, bool, bool, int]:
        near = [close_by(trace, ugv)[:1] for trace in runs.values()]
        kept = all(not least.is_short for nearest in near for least in nearest)
        arrived = all(MEASURES["arrives"](trace, ugv)[0] for trace in runs.values())
        called = any(events_of(trace, ugv, "trigger") for trace in runs.values())
        return kept, arrived, not called, first.ugvs.index(ugv)

    ranked = sorted(first.ugvs, key=rank)
    few = MAX_TEAM if len(ranked) <= MAX_TEAM else MAX_UGVS
    team, ugvs = ([name for name in first.ugvs if name in ranked[:most]] for most in (few, MAX_UGVS))
    return _Selection(runs, {_heading(group, runs, scenario): runs[group[0]] for group in groups}, team, ugvs)


def _alike(run: Trace, other: Trace) -> bool:
    """Whether runs have the same motions of all robots and the same events of UGVs."""
    t = np.union1d(run.t, other.t)
    first, second = ([mark[:6] for mark in maps.marks_of(trace, trace.ugvs)] for trace in (run, other))
    return (
        first == second
        and bool(run.t[-1] == other.t[-1])
        and all(
            np.abs(np.interp(t, run.t, a) - np.interp(t, other.t, b)).max() <= ALIKE_M
            for robot in run.robots
            for a, b in zip(run.body(robot).T, other.body(robot).T, strict=True)
        )
    )


def _heading(group: list[str], runs: Mapping[str, Trace], scenario: Scenario) -> str:
    if len(group) > 1:
        return f"Runs {' = '.join(group)}: identical paths"
    method = str(runs[group[0]].meta["method"])
    changed = scenario.runs[group[0]].set
    says = ", ".join(SETTINGS.get((key, str(value)), f"{key} {value}") for key, value in changed.items())
    return f"Run {group[0]}: method ({method}){f' with {says}' if says else f', {method_of(method).says}'}"


def _runs(heading: str) -> str:
    return heading.partition(":")[0]


def _trajectories(chosen: _Selection) -> Figure:
    first = chosen.first
    frame = frame_of(
        first.scenario, ((robot, trace.body(robot)) for trace in chosen.runs.values() for robot in first.ugvs)
    )
    barriers = barriers_of(first.scenario)
    keys = {heading: maps.key_of(trace, chosen.team, frame) for heading, trace in chosen.shown.items()}
    lines = max(len(maps.lines_of(key)) for key in keys.values())
    has_walls = not all(body.is_round for body in barriers)
    true_size = any(robot.radius_m > 0.0 for robot in first.scenario.robots.values()) or any(
        body.is_round and body.radius_m[0] > 0.0 for body in barriers
    )
    kinds = ["Hexagon: obstacle"] if any(body.is_round for body in barriers) or not has_walls else []
    kinds += ["Filled: walls"] if has_walls else []
    circles = "dark disc as large as it is, " if true_size else ""
    circles += "band around them: too near" if has_walls else "safe circle dashed"
    hidden = len(first.ugvs) - len(chosen.team)
    dashed = " Thin dashed lines: the UAVs." if len(first.uavs) > 1 else " Thin dashed line: the UAV."
    thin = f" Thin grey lines, which end in dots: {hidden} more UGVs." if hidden else ""
    frame_is = " Frame: the arena." if first.scenario.arena_m else ""
    frame_is += " Dots: ways of obstacles, drawn where they start." if any(len(body.way_m) for body in barriers) else ""
    drawn = {mark.kind for key in keys.values() for entry in key for mark in entry.marks}
    marks = "".join(f", {text}" for kind, text in _MARKS.items() if kind in drawn) + "."
    if any(not entry.letter for key in keys.values() for entry in key):
        marks += f" Where more than {maps.MAX_MARKS} marks would be, only the last proposal of each UGV is drawn."
    if "accepted" in drawn:
        marks += " Thick: the UGV follows the UAV."
    caption = (
        f"○ start, \N{MULTIPLICATION SIGN} target{marks} "
        f"{'. '.join(kinds)} (hollow: not on the UAV's map), {circles}.{frame_is}{dashed}{thin}"
    )
    robots = [*chosen.team, *first.uavs]
    panels = []
    for position, (heading, trace) in enumerate(chosen.shown.items()):
        drawing = maps.plane(trace, chosen.team, frame, keys[heading], lines)
        finals = ", ".join(f"{r} ({x:.2f}, {y:.2f}) m" for r in robots for x, y, _ in [trace.body(r)[-1]])
        keyed = "".join(f" {entry.text}." for entry in keys[heading])
        says = f"Paths of {', '.join(robots)} in the ground plane.{keyed} Final positions: {finals}."
        table = _points(trace, robots, maps.marks_of(trace, chosen.team))
        panels.append(panel(drawing, f"trajectories-{position}", f"Map of {heading}", says, heading, table))
    return Figure("trajectories", "Maps", caption, tuple(panels))


def _points(trace: Trace, robots: list[str], marks: Sequence[maps.Mark]) -> Table:
    starts, ends = (
        [(r, trace.t[k], word, trace.body(r)[k, :2]) for r in robots] for k, word in ((0, "starts"), (-1, "ends"))
    )
    marked = [(mark.ugv, mark.t_s, maps.summary([mark]), mark.at) for mark in marks[:MAX_TABLE_ROWS]]
    rows = tuple((r, f"{t:.2f}", what, *(f"{x:.3f}" for x in at)) for r, t, what, at in [*starts, *marked, *ends])
    some = f", the first {MAX_TABLE_ROWS} of {len(marks)} events" if len(marks) > MAX_TABLE_ROWS else ""
    return Table(f"Run {trace.run}: what happened where{some}", ("robot", "t, s", "what", "x, m", "y, m"), rows)


def _distances(chosen: _Selection) -> Figure | None:
    near = {(heading, ugv): close_by(trace, ugv) for heading, trace in chosen.shown.items() for ugv in chosen.ugvs}
    most = max((at.safe_distance_m for those in near.values() for at in those), default=None)
    if most is None:
        return None
    near = {key: [at for at in those if at is those[0] or at.value < NEAR * most] for key, those in near.items()}
    top = FARTHEST * most
    world = [*chosen.first.scenario.barriers, *chosen.first.robots]
    met = {ugv: {at.second for those in near.values() for at in those if at.first == ugv} for ugv in chosen.ugvs}
    looks = {ugv: {other: k for k, other in enumerate(filter(met[ugv].__contains__, world))} for ugv in chosen.ugvs}
    half = (len(chosen.ugvs) + 1) // 2  # a single run takes both columns of the page
    columns = [chosen.ugvs] if len(chosen.shown) > 1 else [chosen.ugvs[:half], chosen.ugvs[half:]]
    panels = list[Panel]()
    for heading, trace, ugvs in [(*run, ugvs) for run in chosen.shown.items() for ugvs in columns if ugvs]:
        of_ugvs = {ugv: near[heading, ugv] for ugv in ugvs}
        gaps = {f"{ugv} to {at.second}": gap_m(trace, ugv, at.second) for ugv, those in of_ugvs.items() for at in those}
        smallest = "; ".join(
            f"{ugv} {those[0]} to {those[0].whom} at {those[0].t_s:.2f} s" for ugv, those in of_ugvs.items() if those
        )
        drawing = timelines.distances(trace, of_ugvs, looks, top)
        table = series(trace, "Distances, m", gaps)
        says = f"Smallest distances: {smallest}."
        name = f"distances-{len(panels)}"
        panels.append(panel(drawing, name, f"Distances, {heading}", says, _runs(heading), table))
    pairs = [(those[0], ugv, heading) for (heading, ugv), those in near.items() if those]
    at, ugv, heading = min(pairs, key=lambda pair: pair[0].margin_m)
    least = "Too close" if at.is_short else "Closest"
    least += f": {ugv} is {at} from {at.whom} at {at.t_s:.2f} s"
    least += f", {at.safe_distance_m:g} m required"
    hidden = len(chosen.first.ugvs) - len(chosen.ugvs)
    left_out = f" {hidden} more UGVs are not drawn; their data are in the trace." if hidden else ""
    caption = (
        f"{least} ({_runs(heading).lower()}). No line may enter the hatched band. "
        f"Circle: the smallest distance, exact; red: too small.{left_out}"
    )
    return Figure("distances", "Distances to the nearest obstacles and robot", caption, tuple(panels))


def _timelines(chosen: _Selection) -> Figure:
    panels, hidden = [], 0
    for position, (run, trace) in enumerate(chosen.runs.items()):
        first = [*chosen.team, *(ugv for ugv in trace.ugvs if ugv not in chosen.team)]
        having = [ugv for ugv in first if events_of(trace, ugv, *timelines.MARKS)]
        rows = having[:MAX_TEAM] or [max(trace.ugvs, key=lambda ugv: trace.column(f"{ugv}.decision_variable_m").max())]
        hidden = max(hidden, len(having) - MAX_TEAM)
        words = "; ".join(f"{ugv}: {timelines.events_in_words(trace, ugv)}" for ugv in rows)
        says = f"Threshold {float(trace.meta['zeta_m']):.3g} m. {words}."
        name, heading, drawing = f"timelines-{position}", f"Run {run}", timelines.events(trace, rows)
        panels.append(panel(drawing, name, f"Events over time, {heading}", says, heading, _happened(trace, rows)))
    drawn = {event["kind"] for trace in chosen.runs.values() for event in trace.events}
    marks = ", ".join(text for kind, text in _EVENTS.items() if kind in drawn)
    more = f" At most {MAX_TEAM} UGVs are drawn, up to {hidden} more are in the trace." if hidden > 0 else ""
    caption = (
        "Line: decision variable. Grey: the UAV is called. Hatched bar: the UGV follows the UAV."
        f"{marks and f' {marks}.'} // time in which nothing happens is left out.{more}"
    )
    return Figure("timelines", "Decision variables, triggers, proposals, answers", caption, tuple(panels))


def _happened(trace: Trace, ugvs: Sequence[str]) -> Table:
    """Events of UGVs with their decision variables; of a UGV without events its largest one."""
    x = {ugv: trace.column(f"{ugv}.decision_variable_m") for ugv in ugvs}
    every = [(e["t_s"], ugv, e["kind"]) for ugv in ugvs for e in events_of(trace, ugv, *timelines.MARKS)]
    every = sorted(every) or [(float(trace.t[x[ugv].argmax()]), ugv, "largest value") for ugv in ugvs]
    rows = ((f"{t:.3f}", ugv, what, f"{np.interp(t, trace.t, x[ugv]):.3f}") for t, ugv, what in every[:MAX_TABLE_ROWS])
    some = f", the first {MAX_TABLE_ROWS} of {len(every)}" if len(every) > MAX_TABLE_ROWS else ""
    return Table(f"Run {trace.run}: events{some}", ("t, s", "UGV", "event", "decision variable, m"), tuple(rows))


def _team(chosen: _Selection) -> Figure:
    """Histograms over the UGVs of a large team."""
    ugvs = chosen.first.ugvs
    quantities: dict[str, dict[str, list[float]]] = {
        "distance left to the required one, m": {}, "time of arrival, s": {}, "largest decision variable, m": {},
    }  # fmt: skip
    for name, trace in chosen.runs.items():
        columns = (
            [min((at.margin_m for at in close_by(trace, ugv)), default=np.nan) for ugv in ugvs],
            [float(event["t_s"]) for ugv in ugvs for event in events_of(trace, ugv, "arrival")[-1:]],
            [float(trace.column(f"{ugv}.decision_variable_m").max()) for ugv in ugvs],
        )
        for quantity, values in zip(quantities.values(), columns, strict=True):
            quantity[name] = [value for value in values if np.isfinite(value)]
    panels = []
    for position, (what, of_runs) in enumerate(quantities.items()):
        if not any(of_runs.values()):
            continue
        rows = tuple(
            (name, str(len(values)), *(f"{stat(values):.3f}" for stat in (np.min, np.median, np.max)))
            for name, values in of_runs.items()
            if values
        )
        table = Table(f"{what}, over the UGVs", ("run", "UGVs", "least", "median", "largest"), rows)
        says = "; ".join(f"run {run}: {least} to {largest}, median {middle}" for run, _, least, middle, largest in rows)
        drawing, heading = timelines.histogram(what, of_runs), f"UGVs by {what.partition(',')[0]}"
        panels.append(panel(drawing, f"team-{position}", f"UGVs by {what}", says, heading, table))
    there = []
    for name, of in quantities["time of arrival, s"].items():
        called = sum(bool(events_of(chosen.runs[name], ugv, "trigger")) for ugv in ugvs)
        there.append(f"Run {name}: {len(of)} of {len(ugvs)} UGVs arrive, {called} triggered.")
    return Figure("team", "The whole team", f"{' '.join(there)} Each bar counts UGVs.", tuple(panels))
