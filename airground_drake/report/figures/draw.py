"""The figures of a report: the paper's Figures 3-6 (case B: 7-10) redrawn, and recursion (5) against augmented.

Each figure is a row of panels, one per run: separate drawings, so that a page can stack them on a phone. Each
panel comes with a table of its data.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from airground_drake.arrays import Array
from airground_drake.report.figures import canvas, comparison, maps, timelines
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Table, per_run, series
from airground_drake.report.metrics import closest_obstacle, events_of, gap_m, radius_m
from airground_drake.report.reproduction import MEASURES
from airground_drake.report.scrubber import tracks
from airground_drake.scenarios.schema import Scenario
from airground_drake.trace import Trace

MAX_RUNS, MAX_UGVS, MAX_TEAM, MAX_OBSTACLES = 6, 3, 12, 4
"""What a figure shows at most; the rest is in the trace, and the caption says so. A map, or lines in one panel, of full
width have room for a team."""

_PAPER = {"case_a": (3, 4, 5, 6), "case_b": (7, 8, 9, 10)}
"""Numbers of the paper's figures, by the beginning of a scenario's name."""
FARTHEST = 10.0
"""Distances are drawn up to so many safe distances: nobody looks for what is on the other side of a fleet's field."""
_HAPPENINGS = ("trigger", "release", "proposal", "accept", "refuse", "collision")


@dataclass(frozen=True)
class _Selection:
    """What the figures show."""

    runs: dict[str, Trace]
    team: list[str]
    ugvs: list[str]
    obstacles: list[str]
    wide: bool

    @property
    def width_in(self) -> float:
        """Width of a panel over time."""
        return canvas.FULL_IN if self.wide else canvas.WIDE_IN

    @property
    def scale(self) -> float:
        """CSS pixels per point, 0 where the page decides."""
        return canvas.SCALE if self.wide else 0.0


def draw(scenario: Scenario, traces: Mapping[str, Trace]) -> list[Figure]:
    """All figures of a report; none without traces.

    Args:
        scenario: names the runs.
        traces: by run.

    Raises:
        TraceError: if a trace lacks a column or holds numbers that are not finite.
    """
    if not traces:
        return []
    numbers = next((paper for name, paper in _PAPER.items() if scenario.name.startswith(name)), ())
    with canvas.style():
        chosen = _select(scenario, traces, wide=not scenario.reproduction)
        drawn = [_trajectories(chosen), _decision(chosen)]
        drawn += [_distances(chosen)] if chosen.obstacles else []
        drawn += [_events(chosen)]
        compared = comparison.draw(scenario, traces)
    order = {"trajectories": 0, "decision": 1, "distances": 2, "events": 3}
    numbered = [
        replace(
            f, title=f"{f.title} (the paper's Figure {numbers[order[f.id]]})" if numbers else f.title, wide=chosen.wide
        )
        for f in drawn
    ]
    return numbered + ([compared] if compared else [])


def _select(scenario: Scenario, traces: Mapping[str, Trace], *, wide: bool) -> _Selection:
    plain = {name: trace for name, trace in traces.items() if scenario.runs[name].composition == "augmented"}
    runs = dict(list((plain or dict(traces)).items())[:MAX_RUNS])
    first = next(iter(runs.values()))
    busy = [name for name in first.ugvs if any(events_of(trace, name, *_HAPPENINGS) for trace in runs.values())]
    ranked = [*busy, *(name for name in first.ugvs if name not in busy)]
    team, ugvs = ranked[: MAX_TEAM if wide else MAX_UGVS], ranked[:MAX_UGVS]
    gap = {
        name: min(gap_m(trace, ugv, name).min() for trace in runs.values() for ugv in ugvs)
        for name in first.scenario["obstacles"]
    }
    near = sorted(gap, key=gap.__getitem__)[:MAX_OBSTACLES]
    return _Selection(
        runs,
        [name for name in first.ugvs if name in team],
        [name for name in first.ugvs if name in ugvs],
        [name for name in first.scenario["obstacles"] if name in near],
        wide,
    )


def _trajectories(chosen: _Selection) -> Figure:
    first = next(iter(chosen.runs.values()))
    frame = maps.frame_of(list(chosen.runs.values()), first.robots)
    width_in = frame.width_in(canvas.FULL_IN, canvas.TALLEST_IN) if chosen.wide else canvas.MAP_IN
    stalls = list(filter(None, (_standing(name, trace, chosen.team) for name, trace in chosen.runs.items())))
    reach = first.scenario["safe_distance"]["obstacle_m"]
    circles = "their safe circles"
    if _has_bodies(chosen):
        circles = "dark discs as large as they are (robots: at their starts and ends), with safe circles round them"
    caption = (
        f"{_sentence('; '.join(stalls)) if stalls else 'No UGV shown stands still short of its target. '}"
        "○ start, \N{MULTIPLICATION SIGN} target, ▲ trigger, □ stands still, ✖ collision. Hexagons are obstacles "
        f"(hollow: not on the UAV's map) in {circles} of {reach:g} m. The thin dashed line is the UAV's path, "
        f"projected onto the ground. Equal scales, in m.{_thin(chosen)}"
    )
    robots = [*chosen.team, first.robots[-1]]
    panels = per_run(
        "trajectories",
        chosen.runs,
        lambda trace: maps.plane(trace, chosen.team, frame, width_in),
        lambda trace: f"Paths of {', '.join(robots)} in the ground plane; final positions: {_finals(trace, robots)}.",
        lambda trace: series(
            trace, "Positions, m", {f"{r} {a}": trace.position(r)[:, k] for r in robots for k, a in enumerate("xy")}
        ),
        chosen.scale,
        lambda drawing, trace: tracks(drawing, trace, chosen.team),
    )
    return Figure("trajectories", "Trajectories", caption, panels)


def _has_bodies(chosen: _Selection) -> bool:
    """Whether a robot or an obstacle is more than a point."""
    first = next(iter(chosen.runs.values()))
    return any(radius_m(first, name) > 0.0 for name in (*first.robots, *first.scenario["obstacles"]))


def _decision(chosen: _Selection) -> Figure:
    columns = {
        name: {ugv: trace.column(f"{ugv}.decision_variable_m") for ugv in chosen.team}
        for name, trace in chosen.runs.items()
    }
    first = next(iter(chosen.runs.values()))
    highest = max(float(x.max()) for each in columns.values() for x in each.values())
    top = 1.08 * max(highest, float(first.meta["zeta_m"]) * 1.1)
    caption = (
        "A UGV that stands still falls behind its moving reference, so its decision variable grows; ▲ marks where it "
        "reaches the threshold (solid line) and an intervention is triggered. A helped UGV falls below it again, and "
        "the intervention ends at the release level (dotted)." + _left_out(chosen, chosen.team)
    )
    panels = per_run(
        "decision",
        chosen.runs,
        lambda trace: timelines.decision(trace, chosen.team, top, chosen.width_in),
        lambda trace: (
            "Decision variable over time; largest values: "
            + ", ".join(f"{ugv} {x.max():.2f} m" for ugv, x in columns[trace.run].items())
            + f"; threshold {float(trace.meta['zeta_m']):.3g} m."
        ),
        lambda trace: series(trace, "Decision variables, m", columns[trace.run]),
        chosen.scale,
    )
    return Figure("decision", "Decision variables", caption, panels)


def _distances(chosen: _Selection) -> Figure:
    gaps: dict[str, dict[str, Array]] = {
        run: {f"{ugv} to {name}": gap_m(trace, ugv, name) for ugv in chosen.ugvs for name in chosen.obstacles}
        for run, trace in chosen.runs.items()
    }
    largest = max(float(gap.max()) for each in gaps.values() for gap in each.values())
    first = next(iter(chosen.runs.values()))
    far = FARTHEST * float(first.scenario["safe_distance"]["obstacle_m"])
    top = 1.05 * min(largest, far)
    caption = (
        "No line may enter the hatched band below the safe distance d. The circle marks the smallest distance, which "
        "is exact in continuous time: robots move on straight lines between samples."
        f"{' Distances are of surfaces.' if _has_bodies(chosen) else ''}{_left_out(chosen, chosen.ugvs)}"
        f"{f' What is farther away than {far:g} m is not drawn.' if largest > far else ''}"
    )

    def describe(trace: Trace) -> str:
        minima = [(ugv, closest_obstacle(trace, ugv)) for ugv in chosen.ugvs]
        return "Distance to each obstacle over time; smallest: " + ", ".join(
            f"{ugv} {at.value:.3f} m to {at.other} at {at.t_s:.2f} s" for ugv, at in minima if at
        )

    panels = per_run(
        "distances",
        chosen.runs,
        lambda trace: timelines.distances(trace, chosen.ugvs, chosen.obstacles, top, chosen.width_in),
        describe,
        lambda trace: series(trace, "Distances, m", gaps[trace.run]),
        chosen.scale,
    )
    return Figure("distances", "Distances to the obstacles", caption, panels)


def _events(chosen: _Selection) -> Figure:
    def busy(trace: Trace) -> list[str]:
        return [ugv for ugv in chosen.ugvs if events_of(trace, ugv, *_HAPPENINGS)]

    def table(trace: Trace) -> Table:
        listed = [event for event in trace.events if event["robot"] in chosen.ugvs]
        cells = tuple(
            (f"{e['t_s']:.3f}", e["robot"], e["kind"], ", ".join(f"{x:.3f}" for x in e["position_m"]))
            for e in listed[:MAX_TABLE_ROWS]
        )
        shown = "" if len(listed) <= MAX_TABLE_ROWS else f", the first {MAX_TABLE_ROWS} of {len(listed)}"
        return Table(f"Run {trace.run}: events{shown}", ("t, s", "robot", "event", "position x, y, z, m"), cells)

    def describe(trace: Trace) -> str:
        listed = [
            f"{e['kind']} of {e['robot']} at {e['t_s']:.2f} s"
            for u in busy(trace)
            for e in events_of(trace, u, *_HAPPENINGS)
        ]
        return "Events over time: " + ("; ".join(listed[:12]) or "none") + "."

    caption = (
        "▲ trigger and ▼ release, with the grey bar between them: the UAV is called upon (under method (a) it does not "
        "come). ◆ proposal of the UAV. ● accepted and ✖ refused by the UGV's gatekeeper (method (b) has none). The "
        "hatched bar: the UGV carries out an intervention." + _left_out(chosen, chosen.ugvs)
    )
    panels = per_run(
        "events",
        chosen.runs,
        lambda trace: (
            timelines.events(trace, busy(trace), chosen.width_in)
            if busy(trace)
            else timelines.nothing_happened(trace, chosen.width_in)
        ),
        describe,
        table,
        chosen.scale,
    )
    return Figure("events", "Triggers, proposals and decisions", caption, panels)


def _standing(run: str, trace: Trace, ugvs: Sequence[str]) -> str:
    """Which UGVs stand still short of their targets, and where, if they are few."""
    found = {ugv: at for ugv in ugvs if (at := MEASURES["stall_position"](trace, ugv))}
    listed = ", ".join(f"{ugv} stands still at ({at[0]:.2f}, {at[1]:.2f}) m" for ugv, at in found.items())
    many = f"{len(found)} UGVs stand still"
    return f"in run {run} {listed if len(found) <= MAX_UGVS else many}" if found else ""


def _finals(trace: Trace, robots: Iterable[str]) -> str:
    return ", ".join(f"{robot} ({x:.2f}, {y:.2f}) m" for robot in robots for x, y, _ in [trace.position(robot)[-1]])


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}. "


def _thin(chosen: _Selection) -> str:
    hidden = len(next(iter(chosen.runs.values())).ugvs) - len(chosen.team)
    return f" The thin grey lines, which end in dots, are the paths of {hidden} more UGVs." if hidden else ""


def _left_out(chosen: _Selection, drawn: Sequence[str]) -> str:
    first = next(iter(chosen.runs.values()))
    hidden = [name for name in first.ugvs if name not in drawn]
    return f" {len(hidden)} more UGVs are not drawn; their data are in the trace." if hidden else ""
