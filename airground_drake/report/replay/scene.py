"""All that a replay shows: positions and states of the robots at each frame, proposals and events, from the trace."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.registry import method_of
from airground_drake.report.interventions import interventions
from airground_drake.report.view.stage import Robot, Stage, stage_of, states
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.proposals import proposal_of

FRAMES_PER_S = 30  # frames in a second of simulated time

MAX_NAMED_BARRIERS = 8  # with more barriers, their names are not shown
Outcome = Literal["asked", "accepted", "refused"]
LINGER_S = 1.0  # time for which a refused or unanswered proposal is shown, s


class Span(NamedTuple):
    """A time interval, s, in which a proposal has one outcome."""

    start_s: float
    end_s: float
    outcome: Outcome


class Sent(NamedTuple):
    """A proposal: its UGV, its policy, the corners of its motion (M, 3), m, and its outcomes over time."""

    robot: str
    policy: str
    path: Array
    spans: tuple[Span, ...]


@dataclass(frozen=True)
class DrawnBody(Robot):
    """A robot in a run, frame by frame: positions (F, 3), m, headings (F,), rad, and states (F,), indices of STATES."""

    # Positions are NaN where it was not recorded.

    positions: Array
    headings: Array
    states: Indices


@dataclass(frozen=True)
class Scene(Stage):
    """A run. `times_s` (F,) are those of the frames, the last one the end."""

    # `moved_m` is by how much each barrier that moves has moved at each frame, (F, 3), m, by its number; NaN where it
    # was not recorded. `has_states` says whether the states of UGVs are known, as they are in runs and not in logs.

    robots: tuple[DrawnBody, ...]
    scenario: Scenario
    run: str
    says: str
    times_s: Array
    moved_m: Mapping[int, Array]
    proposals: tuple[Sent, ...]
    events: tuple[Mapping[str, Any], ...]
    has_states: bool = True


def scene(trace: Trace, scenario: Scenario) -> Scene:
    times = frame_times(trace.t)
    still = stage_of(trace, scenario)

    def positions(name: str) -> Array:
        return np.column_stack([np.interp(times, trace.t, axis) for axis in trace.body(name).T])

    def headings(name: str) -> Array:
        recorded = trace.heading(name)
        return np.zeros(len(times)) if recorded is None else np.interp(times, trace.t, recorded)

    bodies = tuple(
        DrawnBody(
            **vars(robot),
            positions=positions(robot.name),
            headings=headings(robot.name),
            states=states(trace, robot.name, times) if robot.kind == "UGV" else np.zeros(len(times), dtype=np.intp),
        )
        for robot in still.robots
    )
    method = str(trace.meta["method"])
    return Scene(
        **{**vars(still), "robots": bodies},
        scenario=scenario,
        run=trace.run,
        says=f"method ({method}), {method_of(method).says}",
        times_s=times,
        moved_m={k: positions(wall.name) - wall.way_m[0] for k, wall in enumerate(still.barriers) if len(wall.way_m)},
        proposals=sent(trace),
        events=tuple(trace.events),
    )


def frame_times(t: Array) -> Array:
    """Times of the frames, (F,), s, from 0 to the end of a run with rows at times (T,), s."""
    return np.minimum(np.arange(np.ceil(t[-1] * FRAMES_PER_S - 1e-6) + 1) / FRAMES_PER_S, t[-1])


def sent(trace: Trace) -> tuple[Sent, ...]:
    return tuple(
        Sent(became["robot"], became["policy"], proposal_of(trace, became["number"]).positions_m, tuple(_spans(became)))
        for became in interventions(trace)
    )


def _spans(became: Mapping[str, Any]) -> Iterator[Span]:
    """Asked until it is accepted or ends; accepted until it ends; refused for a while, if that was the end."""
    accepted_s, end_s, how = became["accepted_s"], became["ended"]["t_s"], became["ended"]["how"]
    refused = how in ("refused", "given up")
    if accepted_s is not None:
        yield Span(became["sent_s"], accepted_s, "asked")
        yield Span(accepted_s, end_s, "accepted")
    else:
        yield Span(became["sent_s"], end_s if refused else min(end_s, became["sent_s"] + LINGER_S), "asked")
    if refused:
        yield Span(end_s, end_s + LINGER_S, "refused")
