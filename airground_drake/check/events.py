"""The events of a run: they follow from its signals, its proposals and its decisions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
import pandas as pd

from .rules import SMALL, Disagreement, close, holds, same
from .run import OF_MPC, OF_OUTCOMES, OF_SOLUTIONS, Run
from .safety import distances_m

UNUSED = -1.0
"""Number in a column of decisions that the run's method does not use; an unused text is empty."""


class Event(NamedTuple):
    """An event without its position.

    Attributes:
        policy: of a proposal or an answer.
        status: of the solution that an answer rests on.
        obstacle: that was hit.
        other: robot that was hit.
    """

    t_s: float
    robot: str
    kind: str
    policy: str = ""
    status: str = ""
    obstacle: str = ""
    other: str = ""


def check_events(run: Run) -> str:
    """Check the rules about events.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
    """
    _events_follow_from_signals_and_decisions(run)
    for event in run.events:
        about = f"{event['kind']} of {event['robot']}"
        here = run.place_m(event["robot"], event["t_s"])
        close("place of an event", event["position_m"], here, within=SMALL, about=about, t_s=event["t_s"])
    _nothing_is_executed_before_it_was_proposed(run)
    _decisions_are_on_proposals(run)
    _unused_columns_are_empty(run)
    return f"{len(run.events)} events"


def _events_follow_from_signals_and_decisions(run: Run) -> None:
    recorded = [Event(**{name: value for name, value in each.items() if name != "position_m"}) for each in run.events]
    t = np.array([event.t_s for event in recorded])
    holds("events are in order", t[1:] >= t[:-1], t[1:], "not before the one above", t_s=t[1:])
    found = [*_crossings(run), *_messages(run), *_answers(run), *_arrivals(run), *_collisions(run)]
    for theirs, ours in zip_longest(sorted(recorded), sorted(found)):
        if theirs != ours:
            first = min(event for event in (theirs, ours) if event is not None)
            raise Disagreement("events follow from signals and decisions", theirs, ours, first.robot, first.t_s)


def _crossings(run: Run) -> Iterator[Event]:
    """Triggers and releases: the columns hold the time of the latest one, so each value is the time of one."""
    for ugv in run.ugvs:
        for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
            for when in np.unique(run.column(f"{ugv}.{name}")):
                if when >= 0.0:
                    yield Event(float(when), ugv, kind)


def _messages(run: Run) -> Iterator[Event]:
    """Proposals of the UAV."""
    for row in run.proposals.to_dict("records"):
        yield Event(float(row["issued_s"]), row["robot"], "proposal", row["policy"])


def _answers(run: Run) -> Iterator[Event]:
    """An event whenever the answer to a proposal is new or has changed."""
    known: dict[tuple[str, float], str] = {}
    for row in run.decisions.to_dict("records"):
        proposal = (row["robot"], row["issued_s"])
        if known.get(proposal) != row["decision"]:
            known[proposal] = row["decision"]
            yield Event(row["t_s"], row["robot"], row["decision"], row["policy"], row["status"])


def _arrivals(run: Run) -> Iterator[Event]:
    """A robot arrives at the first row from which on it stays within the arrival tolerance of its target.

    What it does from its first collision on does not count, except for where it starts.
    """
    hits = [*_collisions(run)]
    for robot, spec in run.robots.items():
        end_s = min((hit.t_s for hit in hits if robot in (hit.robot, hit.other)), default=np.inf)
        before = (run.t_s < end_s) | (np.arange(len(run.t_s)) == 0)
        away = np.linalg.norm(run.position_m[robot][before] - np.array(spec["target_m"]), axis=1)
        outside = np.flatnonzero(away > run.scenario["arrival_tolerance_m"])
        first = int(outside[-1]) + 1 if len(outside) else 0
        if first < len(away):
            yield Event(float(run.t_s[first]), robot, "arrival")


def _collisions(run: Run) -> Iterator[Event]:
    """Two bodies collide when their surfaces come closer than the collision distance.

    A collision has the time of the first row inside that distance. If a robot passes between two rows outside it, the
    collision has the time of the earlier of them.
    """
    for pair in run.pairs:
        within = float(run.scenario["safe_distance"]["collision_m"]) + pair.radii_m
        if run.apart_m[pair.robot, pair.other] >= within:
            continue
        first = run.there_from(pair.other)
        away = (run.position_m[pair.robot] - run.position_m[pair.other])[first:]
        near = np.linalg.norm(away, axis=1) < within
        enters = near & ~np.append(False, near[:-1])
        passes = np.append((distances_m(away) < within) & ~near[:-1] & ~near[1:], False)
        hit = {"other" if pair.other in run.robots else "obstacle": pair.other}
        for when in run.t_s[first:][enters | passes]:
            yield Event(float(when), pair.robot, "collision", **hit)


def _nothing_is_executed_before_it_was_proposed(run: Run) -> None:
    for ugv in run.ugvs:
        earliest = run.times_s(ugv, "proposal").min(initial=np.inf)
        executed = run.t_s[run.column(f"{ugv}.accepted") != 0.0]
        what = "an intervention is executed after it was proposed"
        holds(what, executed >= earliest, executed, f"not before {earliest} s", about=ugv, t_s=executed)


def _decisions_are_on_proposals(run: Run) -> None:
    """Proposals are numbered in order, and each decision is on one of them."""
    numbers = run.proposals["number"].tolist()
    same("proposals are numbered as they are sent", numbers, list(range(len(numbers))))
    key = ["number", "robot", "issued_s", "policy"]
    sent = {*run.proposals[key].itertuples(index=False, name=None)}
    for t_s, on in zip(run.decisions["t_s"], run.decisions[key].itertuples(index=False, name=None), strict=True):
        holds("a decision is on a proposal", on in sent, str(on), "one that was sent", t_s=t_s)


def _unused_columns_are_empty(run: Run) -> None:
    """Each method fills its own columns; method (d) weighs no outcomes when it keeps a decision."""
    every = run.decisions
    kept = every[every["reason"] == "kept"]
    unused: dict[str, list[tuple[pd.DataFrame, tuple[str, ...], float | str]]] = {
        "c": [(every, OF_OUTCOMES, UNUSED)],
        "d": [(every, OF_MPC, UNUSED), (every, OF_SOLUTIONS, ""), (kept, OF_OUTCOMES[:-1], UNUSED)],
    }
    for rows, names, value in unused.get(run.method, ()):
        t_s = rows["t_s"].to_numpy()
        for name in names:
            recorded = rows[name].to_numpy()
            holds("an unused column is empty", recorded == value, recorded, value, about=name, t_s=t_s)
