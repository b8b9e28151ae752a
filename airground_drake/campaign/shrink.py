"""Make a counterexample small: fewer robots and obstacles, plainer shapes, less time, rounder numbers.

Greedy: each change is kept if the scenario is still valid and still fails, until no change is left.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from airground_drake.geometry.motion import Motion
from airground_drake.run.trace import Trace

DIGITS = (0, 1, 2, 3)
"""Decimals that numbers are rounded to, the fewest first."""
SPARE_S = (0.25, 0.5, 1.0, 2.0, 5.0)
"""Time that is kept before the first trigger, or after the last event, s."""
SEEDS = (1, 2, 3, 4)
"""Seeds of the noise to try after a change that draws other noise."""
ROUNDED = ("ugvs", "obstacles", "arena_m", "uav", "control", "decision", "duration_s")
"""Keys with numbers that are rounded."""

Json = dict[str, Any]
Fails = Callable[[Json], bool]
"""Whether a scenario is valid and fails, as before."""
Traced = Callable[[Json], Trace | None]
"""Simulates a scenario's run; None if it cannot be simulated."""


def shrink(data: Json, fails: Fails, traced: Traced, tests: int) -> tuple[Json, int]:
    """Find a smaller scenario that fails, too.

    Args:
        data: a scenario that fails, as `scenarios.load.resolved` returns it, with one run.
        fails: the test.
        traced: simulates the run; not counted.
        tests: how often `fails` may be called.

    Returns:
        The smallest scenario found, and the number of tests.
    """
    steps = (
        partial(_without_items, part="intervention", key="policies"),
        _without_robots,
        _without_obstacles,
        _plainer,
        partial(_later, traced),
        partial(_shorter, traced),
        _rounder,
    )
    left = tests

    def first(candidates: Iterator[Json]) -> Json | None:
        """The first candidate that fails, while tests are left."""
        nonlocal left
        for candidate in itertools.islice(candidates, left):
            left -= 1
            if fails(candidate):
                return candidate
        return None

    changed = True
    while changed:
        changed = False
        for smaller in steps:
            while (found := first(smaller(data))) is not None:
                data, changed = found, True
    return data, tests - left


def _without_robots(data: Json) -> Iterator[Json]:
    if len(data["ugvs"]) > 1:
        yield from _with_seeds(_without_entries(data, "ugvs"))


def _with_seeds(candidates: Iterator[Json]) -> Iterator[Json]:
    """All candidates with their own seed, then with other seeds."""
    own = list(candidates)
    yield from own
    for seed in SEEDS:
        for each in own:
            yield copy.deepcopy(each) | {"seed": seed}


def _without_obstacles(data: Json) -> Iterator[Json]:
    yield from _without_items(data, "uav", "phantoms_m")
    yield from _without_entries(data, "obstacles")
    if data["arena_m"]:
        yield copy.deepcopy(data) | {"arena_m": []}


def _plainer(data: Json) -> Iterator[Json]:
    """Leave out a corner of a wall or polygon, or its heading, radius, height or own distance."""
    for name, obstacle in data["obstacles"].items():
        changes = [{key: 0.0} for key in ("heading_rad", "radius_m", "height_m", "distance_m") if obstacle[key]]
        for key in ("polygon_m", "segment_m"):
            corners = obstacle[key]
            changes += [{key: corners[:k] + corners[k + 1 :]} for k in range(len(corners))]
        for change in changes:
            smaller = copy.deepcopy(data)
            smaller["obstacles"][name] |= change
            yield smaller


def _without_entries(data: Json, key: str) -> Iterator[Json]:
    for name in data[key]:
        smaller = copy.deepcopy(data)
        del smaller[key][name]
        for run in smaller["runs"].values():
            run["stalls_m"].pop(name, None)
        yield smaller


def _without_items(data: Json, part: str, key: str) -> Iterator[Json]:
    for at in range(len(data[part][key])):
        smaller = copy.deepcopy(data)
        del smaller[part][key][at]
        yield smaller


def _later(traced: Traced, data: Json) -> Iterator[Json]:
    """Begin shortly before the first trigger, at the robots' positions at that time."""
    if (trace := traced(data)) is not None:
        first = min((event["t_s"] for event in trace.events if event["kind"] == "trigger"), default=0.0)
        yield from _with_seeds(_from(data, trace, first - spare) for spare in SPARE_S if first > 1.5 * spare)


BESIDE_M = 1e-3
"""Length of a preset that has ended, m: its two waypoints must differ."""


def _from(data: Json, trace: Trace, t: float) -> Json:
    """The scenario from a time t of its run on, s."""
    later = copy.deepcopy(data)
    row = int(np.searchsorted(trace.t, t))
    t = float(trace.t[row])
    for name, ugv in later["ugvs"].items():
        waypoints = np.asarray(ugv["preset"]["waypoints_m"], dtype=np.float64)
        motion = Motion.at_speed(waypoints, ugv["preset"]["speed_m_s"], start=0.0)
        here = motion.sample(np.array([t]))[0]
        ahead = motion.positions[motion.times > t + 1e-6]
        if not len(ahead):  # its preset has ended
            ahead = here[None] + [BESIDE_M, 0.0, 0.0]
        ugv["preset"]["waypoints_m"] = [here.tolist(), *ahead.tolist()]
        ugv["start_m"] = trace.position(name)[row].tolist()
    uav = later["uav"]
    uav["start_m"] = trace.position(uav["name"])[row].tolist()
    later["duration_s"] = data["duration_s"] - t
    return later


def _shorter(traced: Traced, data: Json) -> Iterator[Json]:
    """End soon after an event other than an arrival, or earlier by a share; at least one control period is left."""
    trace = traced(data)
    ends = [data["duration_s"] * share for share in (0.25, 0.5, 0.75, 0.9)]
    if trace is not None:
        events = [event["t_s"] for event in trace.events if event["kind"] != "arrival"]
        ends += [event + spare for event in events[:20] for spare in SPARE_S]
    for end in sorted(ends):
        if data["control"]["period_s"] <= end < 0.95 * data["duration_s"]:
            yield copy.deepcopy(data) | {"duration_s": end}


def _rounder(data: Json) -> Iterator[Json]:
    """Round all numbers at once, then the numbers under each key."""
    groups = [ROUNDED, *((key,) for key in ROUNDED)]
    for digits in DIGITS:
        for group in groups:
            rounded = {key: _round(data[key], digits) for key in group}
            if any(rounded[key] != data[key] for key in group):
                yield copy.deepcopy(data) | rounded


def _round(value: Any, digits: int) -> Any:
    if isinstance(value, dict):
        return {key: _round(each, digits) for key, each in value.items()}
    if isinstance(value, list):
        return [_round(each, digits) for each in value]
    return round(value, digits) + 0.0 if isinstance(value, float) else value
