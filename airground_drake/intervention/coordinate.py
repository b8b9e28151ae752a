"""The coordinate policy: a joint plan for the robots that are triggered and those in their way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np

from airground_drake.arrays import Array
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.coordination.joint import Effort, Plan, plan
from airground_drake.intervention.coordination.roadmap import Errand, Space
from airground_drake.intervention.coordination.single import Body, Way
from airground_drake.intervention.coordination.timed import at_rest, distance, speed, timed, without_repeats
from airground_drake.intervention.policy import Observation, Policy, Teammate

SHARE = 0.8
"""Of a UGV's speed limit that a plan uses: the rest is for catching up with it."""
MOST_PLANS = 4
"""Joint plans that are made at most for one proposal, each for more robots."""
NARROWER = (1.0, 0.1, 0.01)
"""Shares of the clearance that are tried one after the other, while the UGV that is planned for has no way even alone:
its own task may have taken it through a gap with no room for more."""
ON_PRESET_M = 0.5
"""A motion that ends within this of the preset goes on along it."""
BLEND_S = 1.0
"""Time constant with which a UGV is taken to come back to its preset, s."""


class Coordinate(Policy):
    """Bring every triggered UGV back to its preset by motions that were planned together.

    First only the triggered UGVs that have no proposal in force are planned for, round obstacles, robots that stand,
    and the predicted motions of the others. If they find no way, those in their way are planned for, too, if they are
    willing: a parked one steps aside and comes back. If nothing serves, as many move as can. One plan concerns all: its
    proposals have the same time of issue. A UGV that would find no way even alone is planned for with less clearance.

    Attributes:
        speed: largest, m/s; of each UGV no more than SHARE of its limit.
        clearance: kept from obstacles beyond the safe distance, m.
        spacing: kept between UGVs beyond their safe distance, m.
        follow: how long a proposal goes on along the preset after it has been joined, s, and for which it must be free.
    """

    counted = True

    def __init__(
        self, *, speed_m_s: float = math.inf, clearance_m: float = 0.1, spacing_m: float = 0.2, follow_s: float = 8.0
    ) -> None:
        """Set the parameters; all have defaults.

        Raises:
            ValueError: if one is not positive (`follow_s`: negative).
        """
        if not (speed_m_s > 0.0 and clearance_m > 0.0 and spacing_m > 0.0 and follow_s >= 0.0):
            raise ValueError(
                f"coordinate needs speed_m_s, clearance_m, spacing_m > 0 and follow_s >= 0, "
                f"got {speed_m_s!r}, {clearance_m!r}, {spacing_m!r}, {follow_s!r}"
            )
        self.speed = speed_m_s
        self.clearance = clearance_m
        self.spacing = spacing_m
        self.follow = follow_s
        warm_up()

    def propose(self, seen: Observation) -> dict[str, Motion] | None:
        """Motions by UGV; None if no triggered UGV can be helped."""
        if not seen.team:
            return None
        own, tried = [mate.name for mate in seen.team].index(seen.robot), []
        for share in NARROWER:
            space = self._space(seen, share * self.clearance)
            tried.append(self._joint(seen, space))
            lost = tried[-1][0][0]
            if not lost or self._alone(seen, space, own) is not None:
                break
        _, group, found = min(tried, key=lambda each: each[0])
        return self._proposals(seen, group, found)

    def _joint(self, seen: Observation, space: Space) -> tuple[tuple[float, ...], list[int], Plan]:
        """The best plan, its cost and whom it is for."""
        everyone = range(len(seen.team))
        group = [i for i in everyone if seen.team[i].name == seen.robot or _waits(seen.team[i], seen.t)]
        best: tuple[list[int], Plan] | None = None
        least: tuple[float, ...] = ()
        for _ in range(MOST_PLANS):
            found = self._plan(seen, space, group)
            cost = _cost(seen, group, found)
            if best is None or cost < least:
                best, least = (group, found), cost
            if cost[0] == 0:
                break
            more = self._in_the_way(seen, space, group, found)
            if not more:
                break
            group = sorted([*group, *more])
        assert best is not None
        return least, *best

    def _plan(self, seen: Observation, space: Space, group: Sequence[int]) -> Plan:
        team = seen.team
        fixed = [Body(predicted(mate, seen.start), mate.radius) for i, mate in enumerate(team) if i not in group]
        errands = [errand(team[i], seen.start) for i in group]
        speeds = [min(self.speed, SHARE * team[i].max_speed) for i in group]
        return plan(space, errands, speeds, fixed, follow=self.follow, effort=Effort())

    def _in_the_way(self, seen: Observation, space: Space, group: Sequence[int], found: Plan) -> list[int]:
        """Willing UGVs that keep triggered ones of a group, that found no way, from the way they would have alone."""
        others = [i for i, mate in enumerate(seen.team) if i not in group and _is_willing(mate, seen.t)]
        ahead = {i: predicted(seen.team[i], seen.start) for i in others}
        more = set()
        for i, way in zip(group, found.ways, strict=True):
            if way is not None or not seen.team[i].triggered:
                continue
            mate, alone = seen.team[i], self._alone(seen, space, i)
            if alone is None:
                continue
            near = {j: self.spacing + space.apart + (mate.radius + seen.team[j].radius) for j in others}
            more |= {j for j in others if distance(alone.motion, ahead[j]) < near[j]}
        return sorted(more or others)

    def _alone(self, seen: Observation, space: Space, i: int) -> Way | None:
        """What a UGV would do if there were no others."""
        mate = seen.team[i]
        pace = min(self.speed, SHARE * mate.max_speed)
        return plan(space, [errand(mate, seen.start)], [pace], follow=self.follow).ways[0]

    def _proposals(self, seen: Observation, group: Sequence[int], found: Plan) -> dict[str, Motion] | None:
        motions = {}
        for i, way in zip(group, found.ways, strict=True):
            mate = seen.team[i]
            if way is None or (not mate.triggered and speed(way.motion) == 0.0):
                continue
            motions[mate.name] = _motion(way, seen.start, self.follow, float(mate.position[2]))
        helped = any(seen.team[i].triggered and seen.team[i].name in motions for i in group)
        return motions if helped else None

    def _space(self, seen: Observation, clearance: float) -> Space:
        """What UGVs without bodies keep away from in the plane of the one that is planned for."""
        radii = seen.safe_distance + np.broadcast_to(seen.obstacle_radii, len(seen.obstacles))
        above = seen.obstacles[:, 2] - float(seen.position[2])
        return Space(seen.obstacles[:, :2], radii, clearance, seen.robot_distance, self.spacing, above)


def errand(mate: Teammate, start: float) -> Errand:
    """From where a UGV is to its preset, from time `start`, s, on."""
    preset = mate.preset
    times = np.append(start, preset.times[preset.times > start + 1e-6])
    return Errand(mate.position[:2].copy(), timed(times - start, preset.sample(times)[:, :2]), mate.radius)


def predicted(mate: Teammate, start: float) -> Array:
    """What a UGV is taken to do from time `start`, s, on: a timed motion (M, 3) from t = 0.

    It goes along the proposal in force unless it has refused it, then along its preset if that ends there. Without one
    it stays if it stands or is triggered, and otherwise comes back to its preset.
    """
    here, proposal = mate.position[:2], mate.proposal
    if proposal is not None and mate.answered != "refused":
        motion = proposal.motion
        times = np.append(start, motion.times[motion.times > start + 1e-6])
        places = motion.sample(times)[:, :2]
        if np.hypot(*(mate.preset.at(float(times[-1]))[0][:2] - places[-1])) <= ON_PRESET_M:
            later = mate.preset.times[mate.preset.times > times[-1] + 1e-6]
            times, places = np.append(times, later), np.concatenate([places, mate.preset.sample(later)[:, :2]])
        places[0] = here
        return without_repeats(timed(times - start, places))
    if mate.standing or mate.triggered:
        return at_rest(here)
    after = np.concatenate([start + 0.25 * BLEND_S * np.arange(17), mate.preset.times[mate.preset.times > start]])
    times = np.unique(after)
    off = here - mate.preset.at(start)[0][:2]
    places = mate.preset.sample(times)[:, :2] + off * np.exp(-(times - start) / BLEND_S)[:, None]
    return without_repeats(timed(times - start, places))


def _waits(mate: Teammate, t: float) -> bool:
    """Whether a UGV is triggered, may be asked, and has nothing in force that it has not refused."""
    idle = mate.proposal is None or mate.answered == "refused"
    return mate.triggered and idle and _is_willing(mate, t)


def _is_willing(mate: Teammate, t: float) -> bool:
    """Whether a UGV may be asked at time t, s."""
    just_asked = mate.proposal is not None and mate.proposal.issued == t
    return not (mate.resting or just_asked)


def _cost(seen: Observation, group: Sequence[int], found: Plan) -> tuple[float, ...]:
    """Triggered UGVs of a plan without a way, UGVs that move, sum of the times until they are back on their presets."""
    ways = list(zip(group, found.ways, strict=True))
    lost = sum(way is None and seen.team[i].triggered for i, way in ways)
    moved = sum(way is not None and speed(way.motion) > 0.0 for _, way in ways)
    return float(lost), float(moved), float(sum(way.joined for _, way in ways if way is not None))


def _motion(way: Way, start: float, follow: float, height: float) -> Motion:
    """A way as a motion in space that ends so long, s, after the preset is joined."""
    until = min(way.joined + follow, float(way.motion[-1, 0]))
    rows = way.motion[way.motion[:, 0] < until - 1e-9]
    last = [until, *(np.interp(until, way.motion[:, 0], axis) for axis in way.motion[:, 1:].T)]
    rows = np.concatenate([rows, [last]])
    return Motion(start + rows[:, 0], np.column_stack([rows[:, 1:], np.full(len(rows), height)]))


@cache
def warm_up() -> None:
    """Load the compiled loops before a plan is asked for, which has little time."""
    room = Space(np.array([[0.0, 1.0]]), np.array([0.1]), 0.1, 1.0, 0.1)
    ends = [np.array([0.0, 0.0]), np.array([3.0, 0.0])]
    errands = [Errand(a, np.array([[0.0, *b]])) for a, b in pairwise([*ends, ends[0]])]
    plan(room, errands, [1.0, 1.0], effort=Effort(orders=2))
