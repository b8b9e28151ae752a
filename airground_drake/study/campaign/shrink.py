"""Minimise a counterexample: fewer policies, robots and obstacles, simpler shapes, less time, rounder numbers.

Greedy: each change is kept if the scenario is still valid and still fails, until no change is left.
"""

import copy
import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

# Lists and mappings whose entries may be left out.
PARTS = (("intervention", "policies"), ("ugvs",), ("uav", "phantoms_m"), ("uavs",), ("obstacles",))
SHARES = (0.25, 0.5, 0.75, 0.9)  # shares to which the duration may be shortened
DIGITS = (0, 1, 2, 3)  # decimals that numbers are rounded to, the fewest first
# Keys with numbers that are rounded.
ROUNDED = ("ugvs", "obstacles", "arena_m", "uav", "uavs", "control", "decision", "duration_s")

Json = dict[str, Any]
Fails = Callable[[Json], bool]  # whether a scenario is valid and fails, as before


def shrink(data: Json, fails: Fails, tests: int) -> tuple[Json, int]:
    """Find a smaller scenario that also fails. Returns the smallest one found, and the number of tests."""
    # tests: how often `fails` may be called.
    steps: list[Callable[[Json], Iterator[Json]]] = [partial(_without_entry, path=path) for path in PARTS]
    steps += [_plainer, _shorter, _rounder]
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
            while (shrunk := first(smaller(data))) is not None:
                data, changed = shrunk, True
    return data, tests - left


def _without_entry(data: Json, path: tuple[str, ...]) -> Iterator[Json]:
    entries = _at(data, path)
    for key in range(len(entries)) if isinstance(entries, list) else entries:
        smaller = copy.deepcopy(data)
        del _at(smaller, path)[key]
        for run in smaller["runs"].values():
            run["stalls_m"] = {ugv: place for ugv, place in run["stalls_m"].items() if ugv in smaller["ugvs"]}
        _charge(smaller)
        yield smaller


def _charge(data: Json) -> None:
    """Assign UGVs of removed UAVs to the first remaining one of several."""
    uavs = [*data.get("uavs", {}).values()]
    for uav in uavs:
        uav["ugvs"] = [ugv for ugv in uav["ugvs"] if ugv in data["ugvs"]]
    charged = {ugv for uav in uavs for ugv in uav["ugvs"]}
    for uav in uavs[:1]:
        uav["ugvs"] += [ugv for ugv in data["ugvs"] if ugv not in charged]


def _at(data: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        data = data.get(key, {})
    return data


def _plainer(data: Json) -> Iterator[Json]:
    """Remove the arena, or an obstacle's corner, heading, radius, height or own distance."""
    if data["arena_m"]:
        yield copy.deepcopy(data) | {"arena_m": []}
    for name, obstacle in data["obstacles"].items():
        for key in ("heading_rad", "radius_m", "height_m", "distance_m"):
            if obstacle[key]:
                smaller = copy.deepcopy(data)
                smaller["obstacles"][name][key] = 0.0
                yield smaller
        for key in ("polygon_m", "segment_m"):
            yield from _without_entry(data, ("obstacles", name, key))


def _shorter(data: Json) -> Iterator[Json]:
    """Shorten the duration by a share, to at least one control period."""
    for end in (share * data["duration_s"] for share in SHARES):
        if end >= data["control"]["period_s"]:
            yield copy.deepcopy(data) | {"duration_s": end}


def _rounder(data: Json) -> Iterator[Json]:
    """Round all numbers at once, then the numbers under each key."""
    groups = [ROUNDED, *((key,) for key in ROUNDED)]
    for digits in DIGITS:
        for group in groups:
            rounded = {key: _round(data[key], digits) for key in group if key in data}
            if any(rounded[key] != data[key] for key in rounded):
                yield copy.deepcopy(data) | rounded


def _round(value: Any, digits: int) -> Any:
    if isinstance(value, dict):
        return {key: _round(item, digits) for key, item in value.items()}
    if isinstance(value, list):
        return [_round(item, digits) for item in value]
    return round(value, digits) + 0.0 if isinstance(value, float) else value
