"""The events of a run: they follow from its signals, its proposals and its decisions."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import SMALL, Array, Disagreement, close, holds, same
from .run import OF_MPC, OF_OUTCOMES, OF_SOLUTIONS, Run
from .scenario import apart_m

UNUSED = -1.0
"""Value of a column of decisions that does not belong to the run's method."""


class Event(NamedTuple):
    """An event that follows from the rest of a trace.

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

    @classmethod
    def of(cls, recorded: Json) -> Event:
        """A recorded event without its position, which has a rule of its own."""
        said = {name: value for name, value in recorded.items() if name != "position_m"}
        unknown = sorted(said.keys() - {*cls._fields})
        holds("what is said of an event", not unknown, unknown, ", ".join(cls._fields), t_s=said["t_s"])
        return cls(**{**said, "t_s": float(said["t_s"])})


@lru_cache(maxsize=8)
def check_events(run: Run) -> str:
    """Apply the rules about events.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
    """
    _events_are_in_order(run)
    _events_follow_from_signals_and_decisions(run)
    _events_are_where_their_robots_were(run)
    _nothing_is_executed_before_it_was_proposed(run)
    _decisions_are_on_proposals(run)
    return f"{len(run.events)} events"


def _events_are_in_order(run: Run) -> None:
    for before, after in pairwise(run.events):
        later = f"not before {before['t_s']}"
        holds("events are in order", after["t_s"] >= before["t_s"], after["t_s"], later, t_s=after["t_s"])


def _events_follow_from_signals_and_decisions(run: Run) -> None:
    found = sorted([*_crossings(run), *_messages(run), *_answers(run), *_arrivals(run), *_collisions(run)])
    recorded = sorted(Event.of(event) for event in run.events)
    for theirs, ours in zip_longest(recorded, found):
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
    """The row from which on a robot stays within the arrival tolerance of its target."""
    for robot, spec in run.robots.items():
        away = np.linalg.norm(run.position_m[robot] - np.array(spec["target_m"]), axis=1)
        outside = np.flatnonzero(away > run.scenario["arrival_tolerance_m"])
        first = int(outside[-1]) + 1 if len(outside) else 0
        if first < len(away):
            yield Event(float(run.t_s[first]), robot, "arrival")


def _collisions(run: Run) -> Iterator[Event]:
    """Collisions with obstacles and other robots: surfaces are closer than the collision distance.

    A collision has the time of the first row inside that distance. If a robot passes between two rows outside it, the
    collision has the time of the earlier of them.
    """
    bodies = {**run.robots, **run.scenario["obstacles"]}
    for pair in run.pairs:
        within = apart_m(run.scenario, "collision_m", bodies[pair.robot], bodies[pair.other])
        if run.apart_m[pair.robot, pair.other] >= within:
            continue
        away = run.position_m[pair.robot] - run.position_m[pair.other]
        near, passed = np.linalg.norm(away, axis=1) < within, _least_on_the_way(away) < within
        for row in range(len(near)):
            enters = near[row] and not (row and near[row - 1])
            passes = row + 1 < len(near) and passed[row] and not near[row] and not near[row + 1]
            if enters or passes:
                hit = {"other" if pair.other in run.robots else "obstacle": pair.other}
                yield Event(float(run.t_s[row]), pair.robot, "collision", **hit)


def _least_on_the_way(away_m: Array) -> Array:
    """Least length of relative positions (T, 3) on the straight line from each row to the next, (T - 1,)."""
    begin, step = away_m[:-1], np.diff(away_m, axis=0)
    length = np.maximum(np.square(step).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(-(begin * step).sum(axis=1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(begin + share[:, None] * step, axis=1))


def _events_are_where_their_robots_were(run: Run) -> None:
    for event in run.events:
        here = run.place_m(event["robot"], event["t_s"])
        about = f"{event['kind']} of {event['robot']}"
        close("place of an event", event["position_m"], here, within=SMALL, about=about, t_s=event["t_s"])


def _nothing_is_executed_before_it_was_proposed(run: Run) -> None:
    for ugv in run.ugvs:
        sent = run.times_s(ugv, "proposal")
        earliest = sent[0] if len(sent) else np.inf
        executed = run.t_s[run.executed(ugv)]
        what = "an intervention is executed after it was proposed"
        holds(what, executed >= earliest, executed, f"not before {earliest} s", about=ugv, t_s=executed)


def _decisions_are_on_proposals(run: Run) -> None:
    """Proposals have numbers; each decision is on one that was sent; the columns of the other method are unused."""
    numbers = run.proposals["number"]
    same("proposals are numbered as they are sent", numbers.tolist(), list(range(len(numbers))))
    key = ["number", "robot", "issued_s", "policy"]
    sent = set(run.proposals[key].itertuples(index=False, name=None))
    unused = OF_OUTCOMES if run.method == "c" else OF_MPC
    for row in run.decisions.to_dict("records"):
        about, on = f"decision of {row['robot']}", tuple(row[name] for name in key)
        holds("a decision is on a proposal", on in sent, str(on), "one that was sent", about=about, t_s=row["t_s"])
        kept = OF_OUTCOMES[:-1] if run.method == "d" and row["reason"] == "kept" else ()  # nothing is weighed again
        for name in (*unused, *kept):
            same(f"column {name} is unused", row[name], UNUSED, about=about, t_s=row["t_s"])
        for name in OF_SOLUTIONS if run.method == "d" else ():
            same(f"column {name} is unused", row[name], "", about=about, t_s=row["t_s"])
