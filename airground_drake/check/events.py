"""Arrivals and collisions, recomputed from the positions of a run."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from .rules import SMALL, Disagreement, close
from .run import Run


class Event(NamedTuple):
    """An arrival, or a collision with an obstacle or with another robot; without its position."""

    t_s: float
    robot: str
    kind: str
    obstacle: str = ""
    other: str = ""


def check_events(run: Run) -> str:
    """Compare the recorded arrivals and collisions, and the places of all events, with the positions."""
    recorded = [
        Event(**{name: value for name, value in event.items() if name not in ("position_m", "at_m")})
        for event in run.events
        if event["kind"] in ("arrival", "collision")
    ]
    hits = [*_collisions(run)]
    recomputed = [*_arrivals(run, hits), *hits]
    for theirs, ours in zip_longest(sorted(recorded), sorted(recomputed)):
        if theirs != ours:
            first = min(event for event in (theirs, ours) if event is not None)
            raise Disagreement("arrivals and collisions follow from positions", theirs, ours, first.robot, first.t_s)
    for event in run.events:
        here = [np.interp(event["t_s"], run.t_s, axis) for axis in run.body_m[event["robot"]].T]
        about = f"{event['kind']} of {event['robot']}"
        close("place of an event", event["position_m"], here, within=SMALL, about=about, t_s=event["t_s"])
    return f"{len(recomputed) - len(hits)} arrivals, {len(hits)} collisions"


def _arrivals(run: Run, hits: Sequence[Event]) -> Iterator[Event]:
    """A robot arrives at the first row from which on it stays within the arrival tolerance of its target."""
    # Its motion after its first collision does not count, except for where it starts.
    for robot, spec in run.robots.items():
        end_s = min((hit.t_s for hit in hits if robot in (hit.robot, hit.other)), default=np.inf)
        before = (run.t_s < end_s) | (np.arange(len(run.t_s)) == 0)
        away = np.linalg.norm(run.position_m[robot][before] - np.array(spec["target_m"]), axis=1)
        outside = np.flatnonzero(away > run.scenario["arrival_tolerance_m"])
        first = int(outside[-1]) + 1 if len(outside) else 0
        if first < len(away):
            yield Event(float(run.t_s[first]), robot, "arrival")


def _collisions(run: Run) -> Iterator[Event]:
    """Two bodies collide when their surfaces come closer than the collision distance."""
    # A collision has the time of the first row inside that distance. If a robot passes between two rows outside it, the
    # collision has the time of the earlier of them.
    for pair in run.pairs:
        within = float(run.scenario["safe_distance"]["collision_m"]) + pair.radii_m
        if run.apart_m[pair.robot, pair.other] >= within:
            continue
        near, passes = pair.shape.within(run.apart(pair), within)
        enters = near & ~np.append(False, near[:-1])
        passes = np.append(passes & ~near[:-1] & ~near[1:], False)
        hit = {"other" if pair.other in run.robots else "obstacle": pair.other}
        for when in run.t_s[run.there(pair.other)][enters | passes]:
            yield Event(float(when), pair.robot, "collision", **hit)
