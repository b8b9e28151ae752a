"""Closed loops of UGVs under method (d), many of them rolled out side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .law import PLANE, avoiding, inequalities, limited
from .rules import Array
from .run import Run

STILL_M = 0.05
"""Less than this within the last second is at rest, or less than a tenth of what a slow UGV can do in a second."""
UNSEEN_M = 1e9
"""As far away is put what fills a table up."""
TOGETHER = 10_000_000
"""Numbers of the tables of loops that are rolled out together, so that they fit into the memory."""


class Loop(NamedTuple):
    """What a roll-out over S control periods begins from.

    Attributes:
        start_m: (3,).
        goal_m: end of the preset trajectory, (3,).
        own_m: preset trajectory at the control samples, (S + 1, 3).
        asked_m: the proposed motion at them, (S + 1, 3).
        projector: J_int^+ J_int, (3, 3).
        periods: for how many of them the proposed motion is executed.
        discs_m: obstacles that are known, (D, 3).
        disc_safe_m: distances to keep from them, (D,).
        others_m: other robots at the control samples, (S + 1, V, 3); as many in all loops that are rolled out together.
        other_safe_m: distances to keep from them, (V,).
        other_share: part of that the UGV takes, (V,).
        settled: periods before which the roll-out does not end.
        limit_m_s: speed limit.
    """

    start_m: Array
    goal_m: Array
    own_m: Array
    asked_m: Array
    projector: Array
    periods: int
    discs_m: Array
    disc_safe_m: Array
    others_m: Array
    other_safe_m: Array
    other_share: Array
    settled: int
    limit_m_s: float


class Rolled(NamedTuple):
    """What came of a loop.

    Attributes:
        places_m: at the control samples, (S + 1, 3), or fewer if it ended before.
        stalls: whether it is at rest short of the goal in the end.
        home: whether it is at the goal.
        integral_m2_s: of the squared distance from the preset trajectory.
        goal_m, discs_m, disc_safe_m: as in the loop.
    """

    places_m: Array
    stalls: bool
    home: bool
    integral_m2_s: float
    goal_m: Array
    discs_m: Array
    disc_safe_m: Array


def rolled_out(run: Run, loops: Iterable[Loop]) -> Iterator[Rolled]:
    """What comes of each loop, in order."""
    group: list[Loop] = []
    for loop in loops:
        longest = max(len(each.own_m) * (6 + each.others_m[0].size) for each in [*group, loop])
        if group and (len(group) + 1) * longest > TOGETHER:
            yield from _side_by_side(run, group)
            group = []
        group.append(loop)
    if group:
        yield from _side_by_side(run, group)


def _side_by_side(run: Run, loops: Sequence[Loop]) -> Iterator[Rolled]:
    control, composition = run.scenario["control"], run.scenario["runs"][run.name]["composition"]
    h, arrival_m = control["period_s"], run.scenario["arrival_tolerance_m"]
    second = max(1, round(1.0 / h))
    goal, projector = np.stack([o.goal_m for o in loops]), np.stack([o.projector for o in loops])
    own, asked = _filled([o.own_m for o in loops], 0.0), _filled([o.asked_m for o in loops], 0.0)
    discs, disc_safe = _filled([o.discs_m for o in loops], UNSEEN_M), _filled([o.disc_safe_m for o in loops], 0.0)
    others = _filled([o.others_m for o in loops], 0.0)
    safe = np.concatenate([disc_safe, np.stack([o.other_safe_m for o in loops])], axis=1)
    share = np.concatenate([np.ones_like(disc_safe), np.stack([o.other_share for o in loops])], axis=1)
    limit = np.array([o.limit_m_s for o in loops])
    still_m = np.minimum(STILL_M, limit / 10.0)
    steps, settled, periods = np.array([[len(o.own_m) - 1, o.settled, o.periods] for o in loops]).T
    places = np.zeros_like(own)
    places[:, 0] = [o.start_m for o in loops]
    last, integral = np.zeros(len(loops), dtype=np.intp), np.zeros(len(loops))
    on = np.flatnonzero(steps > 0)
    k = 0
    while len(on):
        here = places[on, k]
        points = np.concatenate([discs[on], others[on, k]], axis=1)
        given = inequalities(here[:, None] - points, safe[on], share[on], control, PLANE)
        rate = (own[on, k + 1] - own[on, k]) / h
        task = limited(PLANE * (rate + control["motion_gain_1_s"] * (own[on, k] - here)), limit[on])
        rate = (asked[on, k + 1] - asked[on, k]) / h
        wish = PLANE * (rate + control["intervention_gain_1_s"] * (asked[on, k] - here))
        above = limited(PLANE * (task + np.einsum("bij,bj->bi", projector[on], wish - task)), limit[on])
        wanted = np.where((k < periods[on])[:, None], above, task)
        there = places[on, k + 1] = here + h * avoiding(wanted, given, composition)
        integral[on] += h * ((own[on, k + 1] - there) ** 2).sum(axis=1)
        k += 1
        last[on] = k
        over = np.linalg.norm(goal[on] - there, axis=1) < arrival_m
        if k >= second:
            over |= np.linalg.norm(there - places[on, k - second], axis=1) < 0.1 * still_m[on]
        on = on[(k < steps[on]) & ~(over & (k > settled[on]))]
    for b, (loop, end) in enumerate(zip(loops, last.tolist(), strict=True)):
        way = places[b, : end + 1].copy()
        home = bool(np.linalg.norm(way[-1] - goal[b]) <= arrival_m)
        stalls = not home and bool(np.linalg.norm(way[-1] - way[max(0, end - second)]) < still_m[b])
        yield Rolled(way, stalls, home, float(integral[b]), loop.goal_m, loop.discs_m, loop.disc_safe_m)


def _filled(tables: Sequence[Array], with_what: float) -> Array:
    """Tables of different lengths as one, (B, longest, ...)."""
    found = np.full((len(tables), max(map(len, tables)), *tables[0].shape[1:]), with_what)
    for row, table in zip(found, tables, strict=True):
        row[: len(table)] = table
    return found
