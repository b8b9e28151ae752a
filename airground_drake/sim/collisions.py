"""Collisions among the events of a run; imports nothing, because quick commands use it."""

from collections.abc import Iterable, Mapping
from typing import Any


def first_collisions(events: Iterable[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """The first collision, an event, of each robot that collided, with an obstacle or with another robot."""
    firsts: dict[str, Mapping[str, Any]] = {}
    for event in sorted((event for event in events if event["kind"] == "collision"), key=lambda event: event["t_s"]):
        for robot in filter(None, (event["robot"], event.get("other"))):
            firsts.setdefault(robot, event)
    return firsts
