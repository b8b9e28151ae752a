"""Outcomes of accepting and of refusing a proposal, rolled out again from a trace; method (d) decides by them."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from oracles.beginnings import Beginning, beginning
from oracles.closed_loops import Scene, in_batches, roll_out, stacked
from oracles.way_left import bounds_of_way_left

STILL_M = 0.05
"""A UGV is at rest if it moved less than this, m, or a tenth of what it can, within the last second."""
Key = tuple[float, int]
"""Identifies a decision: time, s, and number of the proposal."""
Counts = npt.NDArray[np.int64]


class Foreseen(NamedTuple):
    """The outcome of a choice: whether it stalls, (25) along the way, bounds of the way left."""

    stalls: bool
    integral_m2_s: float
    least_left_m: float
    most_left_m: float


def foreseen(trace: Trace) -> dict[Key, tuple[Foreseen, Foreseen]]:
    """Outcomes of refusing and of accepting, for each decision for which outcomes were recorded."""
    return trace.derived("foreseen", lambda: dict(_foreseen(trace)))


def _foreseen(trace: Trace) -> Iterator[tuple[Key, tuple[Foreseen, Foreseen]]]:
    rows = trace.decisions[trace.decisions["accept_stalls"] >= 0.0]
    keys = [(float(t), int(number)) for t, number in zip(rows["t_s"], rows["number"], strict=True)]
    begun = ((key, beginning(trace, *key)) for key in keys)
    for batch in in_batches(begun, lambda each: (each[1].refused, each[1].accepted)):
        found = _rolled_out(trace, [each for _, each in batch])
        yield from zip([key for key, _ in batch], found, strict=True)


def _rolled_out(trace: Trace, begun: Sequence[Beginning]) -> list[tuple[Foreseen, Foreseen]]:
    """Outcomes of refusing and of accepting, for some decisions."""
    h, scenes = trace.scenario.control.period_s, [each.refused for each in begun]
    scenes += [each.accepted for each in begun]
    goal, settled = np.array([each.goal for each in begun] * 2), np.array([each.settled for each in begun] * 2)
    loops, lasting = stacked(scenes), np.array([len(one.executed) for one in scenes])
    way, done = _followed(trace, loops, goal, settled, lasting)
    away = np.square(loops.preset.swapaxes(0, 1)[1 : len(way)] - way[1:]).sum(axis=2)
    integral = np.concatenate([np.zeros((1, away.shape[1])), np.cumsum(h * away, axis=0)])
    found = [
        _concluded(trace.scenario, each, way[: last + 1, row], float(integral[last, row]))
        for row, (each, last) in enumerate(zip([*begun, *begun], done, strict=True))
    ]
    return list(zip(found[: len(begun)], found[len(begun) :], strict=True))


def _followed(trace: Trace, loops: Scene, goal: Array, settled: Counts, lasting: Counts) -> tuple[Array, Counts]:
    """Where R closed loops lead, (T + 1, R, 3), m, and the period after which each ends, (R,); T is the last."""
    second = max(1, round(1.0 / trace.scenario.control.period_s))
    ways, done, still = [loops.here], lasting, np.minimum(STILL_M, loops.limit / 10.0)
    for k, place in enumerate(roll_out(trace, loops)):
        ways.append(place)
        if k < settled.min():
            continue
        home = np.linalg.norm(goal - place, axis=1) < trace.scenario.arrival_tolerance_m
        moved = np.linalg.norm(place - ways[k + 1 - second], axis=1) if k + 1 >= second else np.full(len(place), np.inf)
        resting = (home | (moved < 0.1 * still)) & (k >= settled)
        done = np.where(resting, np.minimum(done, k + 1), done)
        if (done <= k + 1).all():
            break
    return np.array(ways), done


def _concluded(scenario: Scenario, begun: Beginning, places: Array, integral: float) -> Foreseen:
    end = places[-1]
    if np.linalg.norm(end - begun.goal) <= scenario.arrival_tolerance_m:
        return Foreseen(False, integral, 0.0, 0.0)
    before = places[max(0, len(places) - 1 - max(1, round(1.0 / scenario.control.period_s)))]
    stalls = bool(np.linalg.norm(end - before) < min(STILL_M, float(begun.refused.limit) / 10.0))
    return Foreseen(stalls, integral, *bounds_of_way_left(end, begun.goal, *begun.known))
