"""What comes of a proposal and of its refusal, rolled out again from a trace: method (d)'s usefulness, with own code.

Both choices of many decisions side by side, in plain numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.runs.beginnings import Beginning, beginning
from airground_drake.verify.runs.control_law import Asked, avoiding, inequalities, intervened, tracking
from airground_drake.verify.runs.proposals import Sent
from airground_drake.verify.runs.way_left import bounds_of_way_left

STILL_M = 0.05
"""Less than this within the last second is at rest, m; for a UGV that is slow, a tenth of what it can do then."""
AT_ONCE = 5_000_000
"""Coordinates of what decisions that are rolled out side by side keep away from: they have to fit into the memory."""
FAR_M = 1e9
"""A coordinate beyond every sensing range."""
Key = tuple[float, int]
"""Of a decision: time, s, and number of the proposal."""
Counts = npt.NDArray[np.int64]


class Foreseen(NamedTuple):
    """What comes of a choice: places (S + 1, 3), m, whether it stalls, (25) along it, m^2 s, and the way left, m.

    `least_left_m` and `most_left_m` are bounds of the latter.
    """

    places_m: Array
    stalls: bool
    integral_m2_s: float
    least_left_m: float
    most_left_m: float


def foreseen(trace: Trace, given: dict[str, Any], sent: Sequence[Sent]) -> tuple[Foreseen, Foreseen]:
    """What comes of refusing and of accepting, for the first decision about a proposal.

    Args:
        trace: the run.
        given: the decision's row.
        sent: all proposals.
    """
    known = trace.derived("foreseen", lambda: _all_foreseen(trace, sent))
    key = float(given["t_s"]), int(given["number"])
    if key not in known:
        known[key] = _rolled_out(trace, [beginning(trace, *key, sent)])[0]
    return known[key]


def _all_foreseen(trace: Trace, sent: Sequence[Sent]) -> dict[Key, tuple[Foreseen, Foreseen]]:
    """What comes of either choice of all decisions for which that was recorded, many side by side."""
    rows = trace.decisions[trace.decisions["accept_stalls"] >= 0.0]
    keys = [(float(t), int(number)) for t, number in zip(rows["t_s"], rows["number"], strict=True)]
    found, begun = dict[Key, tuple[Foreseen, Foreseen]](), dict[Key, Beginning]()
    for k, key in enumerate(keys):
        begun[key] = beginning(trace, *key, sent)
        if k + 1 == len(keys) or len(begun) * max(each.points.size for each in begun.values()) > AT_ONCE:
            found |= dict(zip(begun, _rolled_out(trace, list(begun.values())), strict=True))
            begun = {}
    return found


class Choices(NamedTuple):
    """Both choices of some decisions side by side: R rows, first all that refuse; S and K are the most of any decision.

    Attributes:
        here, goal: (R, 3), m.
        preset, wanted: at the control samples, (R, S + 1, 3), m.
        chosen: directions of the proposals, (R, 3, 3).
        limit: speed limits, (R,), m/s.
        periods: for which the proposal is executed, (R,): none if it is refused.
        settled, lasting: periods after which it may be over, and is, (R,).
        points: to keep away from, (R, S + 1, K, 3), m.
        safe, share: distances to keep, m, and shares of the inequalities, (R, K).
    """

    here: Array
    goal: Array
    preset: Array
    wanted: Array
    chosen: Array
    limit: Array
    periods: Counts
    settled: Counts
    lasting: Counts
    points: Array
    safe: Array
    share: Array


def _choices(begun: Sequence[Beginning]) -> Choices:
    steps, most = max(len(each.preset) for each in begun) - 1, max(len(each.safe) for each in begun)

    def twice(of: Callable[[Beginning], Any]) -> Any:
        return np.stack([of(each) for each in begun] * 2)

    return Choices(
        here=twice(lambda each: each.here),
        goal=twice(lambda each: each.goal),
        preset=twice(lambda each: _lengthened(each.preset, steps)),
        wanted=twice(lambda each: _lengthened(each.wanted, steps)),
        chosen=twice(lambda each: each.chosen),
        limit=twice(lambda each: each.limit),
        periods=np.array([0] * len(begun) + [each.periods for each in begun]),
        settled=twice(lambda each: each.settled),
        lasting=twice(lambda each: len(each.preset) - 1),
        points=np.stack([_padded(each.points[choice], steps, most) for choice in (0, 1) for each in begun]),
        safe=twice(lambda each: np.pad(each.safe, (0, most - len(each.safe)))),
        share=twice(lambda each: np.pad(each.share, (0, most - len(each.share)))),
    )


def _lengthened(places: Array, steps: int) -> Array:
    """(S + 1, 3) to (steps + 1, 3) by staying at the end: what comes of that is not looked at."""
    return np.concatenate([places, np.repeat(places[-1:], steps + 1 - len(places), axis=0)])


def _padded(points: Array, steps: int, most: int) -> Array:
    """(S + 1, K, 3) to (steps + 1, most, 3), with points out of sight."""
    found = np.full((steps + 1, most, 3), FAR_M)
    found[: points.shape[0], : points.shape[1]] = points
    return found


def _rolled_out(trace: Trace, begun: Sequence[Beginning]) -> list[tuple[Foreseen, Foreseen]]:
    """What comes of refusing and of accepting, for some decisions."""
    choices, h = _choices(begun), trace.scenario["control"]["period_s"]
    way, done = _followed(trace, choices)
    away = np.square(choices.preset.swapaxes(0, 1)[1 : len(way)] - way[1:]).sum(axis=2)
    integral = np.concatenate([np.zeros((1, away.shape[1])), np.cumsum(h * away, axis=0)])
    found = [
        _concluded(trace.scenario, each, way[: last + 1, row], float(integral[last, row]))
        for row, (each, last) in enumerate(zip([*begun, *begun], done, strict=True))
    ]
    return list(zip(found[: len(begun)], found[len(begun) :], strict=True))


def _followed(trace: Trace, choices: Choices) -> tuple[Array, Counts]:
    """Where each row is led, (T + 1, R, 3), m, and the period after which it is over, (R,); T is the last of these."""
    scenario, control, h = trace.scenario, trace.scenario["control"], trace.scenario["control"]["period_s"]
    rates, wishes = (np.diff(part, axis=1) / h for part in (choices.preset, choices.wanted))
    place, limit, second = choices.here, choices.limit, max(1, round(1.0 / h))
    ways, done, earliest = [place], choices.lasting, int(choices.settled.min())
    still = np.minimum(STILL_M, limit / 10.0)
    for k in range(int(choices.lasting.max())):
        around = inequalities(place, choices.points[:, k], choices.safe, choices.share, control, planar=True)
        task = tracking(place, choices.preset[:, k], rates[:, k], control["motion_gain_1_s"], limit)
        asked = np.flatnonzero(k < choices.periods)
        if asked.size:
            wish = Asked(choices.wanted[asked, k], wishes[asked, k], choices.chosen[asked])
            task[asked] = intervened(place[asked], task[asked], wish, control["intervention_gain_1_s"], limit[asked])
        place = place + h * avoiding(task, around, trace.meta["composition"], planar=True)
        ways.append(place)
        if k < earliest:
            continue
        home = np.linalg.norm(choices.goal - place, axis=1) < scenario["arrival_tolerance_m"]
        moved = np.linalg.norm(place - ways[k + 1 - second], axis=1) if k + 1 >= second else np.full(len(place), np.inf)
        resting = (home | (moved < 0.1 * still)) & (k >= choices.settled)
        done = np.where(resting, np.minimum(done, k + 1), done)
        if (done <= k + 1).all():
            break
    return np.array(ways), done


def _concluded(scenario: dict[str, Any], begun: Beginning, places: Array, integral: float) -> Foreseen:
    end = places[-1]
    if np.linalg.norm(end - begun.goal) <= scenario["arrival_tolerance_m"]:
        return Foreseen(places, False, integral, 0.0, 0.0)
    before = places[max(0, len(places) - 1 - max(1, round(1.0 / scenario["control"]["period_s"])))]
    stalls = bool(np.linalg.norm(end - before) < min(STILL_M, begun.limit / 10.0))
    return Foreseen(places, stalls, integral, *bounds_of_way_left(end, begun.goal, *begun.known))
