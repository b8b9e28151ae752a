"""Outcomes of accepting and of refusing a proposal: both rolled out until the UGV stands still, eq (25).

There are two choices, now and never: follow the proposed motion until it is over and then the own task, or the own task
all along. "Wait, then accept" is not among them: it looks cheaper at every sample, and would never accept.

Each is worth the cost (25) along the roll-out plus a heuristic cost-to-go,

    V(p) = L(p)^3 / (3 v),

with L the length of the shortest way to the goal round known obstacles and v the reference speed: the integral
of L^2 for a UGV that takes this way at that speed. It does not bound the cost to come, because the own task does not
take the shortest way. A roll-out that comes to rest short of the goal will never get there: its cost-to-go counts as
infinite. Of two such roll-outs the one with less way left is better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.distance_field import length_among
from airground_drake.model.geometry.paths import NoPath, shortest_path
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.rollout import ACCEPTED, REFUSED, ClosedLoop, View, advance, closed_loop, workspace

USELESS = 1e-6  # relative gain below which an intervention makes no difference
STILL_SHARE = 0.1  # largest `Outlook.still` as a share of the way that the UGV can do in a second
MOST_CORNERS = 64  # corners among which the shortest way is looked for; it takes 20 ms


@dataclass(frozen=True)
class Outlook:
    """Horizons and tolerances of the roll-outs.

    Attributes:
        longest: time that an accepted intervention may last, s.
        past: time that is rolled out when motion and preset trajectory are over, s.
        coasting: time for which a robot without a proposal is predicted to keep its velocity; then it stands, s.
        near: the own task is done this close to the goal, m.
        still: a UGV that moves less than this within the last second is at rest, m; for slow UGVs it is less.
    """

    longest: float
    past: float = 10.0
    coasting: float = 3.0
    near: float = 0.1
    still: float = 0.05


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of one choice."""

    positions: Array  # at the control samples, (S + 1, 3), m
    stalls: bool  # whether it comes to rest short of the goal
    left: float  # length of the way to the goal from its end, m
    cost: float  # (25) with weight 1, plus the cost-to-go V; V alone for one that stalls, m^2 s

    @property
    def end(self) -> Array:
        """Its last position, (3,), m."""
        return np.asarray(self.positions[-1])

    def better_than(self, other: Outcome) -> bool:
        """Whether it is better by more than `USELESS`; a stall is worse than any cost."""
        if self.stalls != other.stalls:
            return other.stalls
        return self.cost < (1.0 - USELESS) * other.cost


def outcomes(seen: View, law: UgvLaw, proposal: Proposal, look: Outlook) -> tuple[Outcome, Outcome]:
    # seen: what the UGV knows; obstacles stand still, whatever their velocities.
    h, t, m = law.avoidance.period, seen.t, len(seen.still)
    look = replace(look, still=min(look.still, STILL_SHARE * seen.max_speed))
    until = min(proposal.motion.end, t + look.longest)
    ends = min(max(until, seen.preset.end), t + look.longest) + look.past
    after = h * np.arange(0.0, np.ceil((ends - t) / h) + 1.0)
    goal = seen.preset.positions[-1]
    settled = max(until, seen.preset.end, t + look.coasting, *(asked[0].end for asked in seen.asked if asked))
    steps = int(np.ceil((settled - t) / h - 1e-9))
    both = []
    for together, accepted in ((False, 0), (True, max(0, int(np.ceil((until - t) / h - 1e-9))))):
        places = [robot_at(seen, j, after, look.coasting, together=together) for j in range(len(seen.parts))]
        moving = np.stack(places, axis=1) if places else np.empty((len(after), 0, 3))
        loop = closed_loop(seen, law, proposal, after, moving)
        positions, cost = _rolled_out(loop, accepted, goal, steps, look.near, look.still)
        both.append(_outcome(positions, cost, goal, seen, seen.distances[:m], h, look))
    return both[0], both[1]


def robot_at(seen: View, robot: int, after: Array, coasting: float, *, together: bool) -> Array:
    """Predicted positions of another body, (S + 1, 3), m, at times `after` from now, (S + 1,), s."""
    # A robot that is asked to make a motion tracks it: its distance from the motion decays with a time constant of 1 s.
    # Any other robot keeps its velocity for `coasting`, s, then stands. The other parts of a joint plan count only if
    # this UGV accepts its own (`together`): otherwise each would refuse because the other parts free its way.
    place, asked = seen.places[robot], seen.asked[robot]
    if asked is None or not (together or asked[1]):
        return place + np.minimum(after, coasting)[:, None] * seen.velocities[robot]
    motion, _ = asked
    beside = place - motion.at(seen.t)[0]
    return motion.sample(seen.t + after) + np.exp(-after)[:, None] * beside


def _outcome(
    positions: Array, cost: float, goal: Array, seen: View, distances: Array, h: float, look: Outlook
) -> Outcome:
    end = positions[-1]
    if np.linalg.norm(end - goal) <= look.near:
        return Outcome(positions, False, 0.0, cost)
    before = positions[max(0, len(positions) - 1 - max(1, round(1.0 / h)))]
    stalls = bool(np.linalg.norm(end - before) < look.still)
    left = way_left(end, goal, seen.still, distances)
    ahead = left**3 / (3.0 * max(seen.preset.max_speed, 1e-9))
    return Outcome(positions, stalls, left, ahead if stalls else cost + ahead)


def way_left(place: Array, goal: Array, rows: Array, distances: Array) -> float:
    """Length of the shortest path to the goal at distances (m,), m, from cores (m, W), m; straight if none exists."""
    # Among cores with more than `MOST_CORNERS` the length is that of a way on a lattice (`distance_field`), a little
    # longer: no map makes it slow.
    rows, distances = outline.sections(rows, distances, float(place[2]))
    start, end = (np.append(point[:2], 0.0) for point in (place, goal))
    leg = end - start
    length = float(np.sqrt(leg @ leg))
    beside = convex.beside(rows, start, end) - distances
    if (beside >= 0.0).all():
        return length
    if rows[:, outline.COUNT].sum() > MOST_CORNERS:
        left = length_among(start[:2], end[:2], rows, distances)
        return left if np.isfinite(left) else length
    try:
        return shortest_path(start[:2], end[:2], rows, distances).length_m
    except NoPath:
        return length


@njit(cache=True)
def _rolled_out(
    loop: ClosedLoop, accepted: int, goal: Array, settled: int, near: float, still: float
) -> tuple[Array, float]:
    """Positions at the control samples (k + 1, 3), m, and (25) with weight 1, when `accepted` periods are accepted."""
    # It ends after `settled` periods, when the preset and all predicted motions are over, as soon as the UGV is at the
    # goal or has been at rest for a second.
    steps = len(loop.preset) - 1
    second = max(1, round(1.0 / loop.law.layer.period))
    positions = np.empty((steps + 1, 3))
    position, work = loop.start.copy(), workspace(loop)
    for a in range(3):
        positions[0, a] = position[a]
    cost = 0.0
    for k in range(steps):
        advance(loop, ACCEPTED if k < accepted else REFUSED, k, position, work)
        squared, left, moved = 0.0, 0.0, 0.0
        for a in range(3):
            positions[k + 1, a] = position[a]
            squared += (loop.preset[k + 1, a] - position[a]) ** 2
            left += (goal[a] - position[a]) ** 2
            if k + 1 >= second:
                moved += (position[a] - positions[k + 1 - second, a]) ** 2
        cost += loop.law.layer.period * squared
        if k >= settled and (left < near**2 or (k + 1 >= second and moved < (0.1 * still) ** 2)):
            return positions[: k + 2], cost
    return positions, cost
