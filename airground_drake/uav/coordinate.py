"""The coordinate policy: a joint plan for the triggered UGVs and for UGVs in their way."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import pairwise

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.coordination.joint import Effort, Outcome, Plan, plan
from airground_drake.uav.coordination.roadmap import PITCH, RobotTask, Space
from airground_drake.uav.coordination.single import OtherRobot, Way
from airground_drake.uav.coordination.timed import at_rest, distance, speed, timed, without_repeats
from airground_drake.uav.policy import MovingObstacle, Observation, Policy, Teammate

SHARE = 0.8  # a plan uses this share of a UGV's speed limit; the rest is for catching up
MOST_HALVINGS = 3  # the speed is halved no more often than this
MOST_PLANS = 4  # largest number of joint plans that are tried for one proposal, each with more UGVs
# Shares of the clearance, and of the spacing. The next share of the clearance is tried if the UGV has no way even
# alone, or all joint steps on the roadmaps are exhausted: a gap, or the place where one waits for another, may be too
# narrow for the full clearance. The next share of the spacing is tried if a joint plan helps no UGV: UGVs that have met
# are nearer to each other than the full spacing.
NARROWER = (1.0, 0.1, 0.01)
ON_PRESET_M = 0.5  # a motion that ends this near to the preset, m, is predicted to go on along the preset
BLEND_S = 1.0  # a UGV without a proposal is predicted to approach its preset with this time constant, s

QUICK = Effort(candidates=300_000)  # first effort for a group of UGVs: a larger group may be needed
ONE_BY_ONE = Effort(candidates=0)  # without a search over joint steps, which does not depend on the spacing
# Why there is no plan, by outcome.
REASONS: dict[Outcome, str] = {
    "complete": "",
    "exhausted": "no plan on the roadmaps searched, all of them exhausted",
    "effort spent": "no plan found within the effort",
}
SAME_PLACE_M = 1e-3  # a UGV that has moved no farther than this counts as unmoved, m

Alone = Callable[[int], Way | None]  # the way that a UGV, given by its index in the team, would have without other UGVs


@dataclass(frozen=True)
class Failures:
    """The policy's memory: failed requests, with the reasons."""

    # Of UGVs that had no way even alone, by name.
    shut_in: Mapping[str, tuple[Observation, str]] = field(default_factory=dict)
    # Groups of UGVs, by name, whose plans did not help any UGV.
    in_vain: Mapping[tuple[str, ...], tuple[Observation, str]] = field(default_factory=dict)


class Coordinate(Policy):
    """Bring every triggered UGV back to its preset by motions that are planned together.

    1. The first plan is for the triggered UGVs without a proposal in force. They avoid obstacles, robots that stand,
       and the predicted motions of all others.
    2. If one of them finds no way, the next plan includes willing UGVs in its way. A parked UGV steps aside and comes
       back.
    3. If no plan gives every UGV a way, the plan with the fewest UGVs left behind is proposed.
    4. If the UGV `seen.robot` finds no way even alone, less clearance is tried. Without any way, it is not planned for
       again until it has moved or the map has changed.
    5. If it has a way alone, but the joint plan helps nobody, less spacing is tried. A plan that helps nobody is not
       made again until a UGV has moved by more than the spacing of the roadmap, is asked for something else, or the map
       has changed.
    6. A UGV whose limits or lag kept it behind a motion, or would have, gets a slower one next time.

    Attributes:
        speed: largest speed, m/s; no UGV uses more than SHARE of its limit.
        clearance: distance to keep from obstacles beyond the safe distance, m.
        spacing: distance to keep between UGVs beyond their safe distance, m.
        follow: how long a proposal follows the preset after joining it, s. The preset must be free for so long.
    """

    counted = True

    def __init__(
        self, *, speed_m_s: float = math.inf, clearance_m: float = 0.1, spacing_m: float = 0.2, follow_s: float = 8.0
    ) -> None:
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
        """Motions by UGV; None if no triggered UGV can be helped. `reason` then says why."""
        self.reason = ""
        if not seen.team:
            return None
        failures: Failures = self.remembered or Failures()
        if (known := failures.shut_in.get(seen.robot)) is not None and _stands_as_before(known[0], seen):
            self.reason = known[1]
            return None
        waiting = tuple(seen.team[i].name for i in self._first_group(seen))
        if (known := failures.in_vain.get(waiting)) is not None and _is_as_before(known[0], seen):
            self.reason = known[1]
            return None
        own = [mate.name for mate in seen.team].index(seen.robot)
        tried = []
        for share in NARROWER:
            space = self._space(seen, share * self.clearance, self.spacing)
            alone = cache(partial(self._alone, seen, space))
            tried.append(self._joint(seen, space, alone))
            lost = tried[-1][0][0]
            if not lost or (alone(own) is not None and tried[-1][2].outcome != "exhausted"):
                break
        _, group, joint_plan = min(tried, key=lambda option: option[0])
        self.reason = _reason(seen, group, joint_plan)
        if lost and alone(own) is None:
            failures = replace(failures, shut_in={**failures.shut_in, seen.robot: (seen, self.reason)})
            self.remembered = failures
        motions = self._proposals(seen, group, joint_plan)
        if motions is None and alone(own) is not None:
            for spacing in NARROWER[1:]:
                space = self._space(seen, share * self.clearance, spacing * self.spacing)
                _, group, joint_plan = self._joint(seen, space, cache(partial(self._alone, seen, space)), ONE_BY_ONE)
                if (motions := self._proposals(seen, group, joint_plan)) is not None:
                    return motions
            self.remembered = replace(failures, in_vain={**failures.in_vain, waiting: (seen, self.reason)})
        return motions

    def _first_group(self, seen: Observation) -> list[int]:
        """The indices of the UGVs of the first joint plan."""
        return [i for i, mate in enumerate(seen.team) if mate.name == seen.robot or _waits(mate, seen.t)]

    def _joint(
        self, seen: Observation, space: Space, alone: Alone, effort: Effort = QUICK
    ) -> tuple[tuple[float, ...], list[int], Plan]:
        """The best joint plan, with its cost and the indices of its UGVs."""
        # effort: of each plan; with `QUICK`, the last group gets the full effort if that was not enough.
        group = self._first_group(seen)
        best: tuple[list[int], Plan] | None = None
        least: tuple[float, ...] = ()
        for _ in range(MOST_PLANS):
            joint_plan = self._plan(seen, space, group, effort)
            cost = _cost(seen, group, joint_plan)
            if best is None or cost < least:
                best, least = (group, joint_plan), cost
            if cost[0] == 0:
                break
            more = self._in_the_way(seen, space, group, joint_plan, alone)
            if not more:
                break
            group = sorted([*group, *more])
        assert best is not None
        if least[0] > 0 and effort is QUICK and joint_plan.outcome == "effort spent":
            joint_plan = self._plan(seen, space, group, Effort())
            if (cost := _cost(seen, group, joint_plan)) < least:
                best, least = (group, joint_plan), cost
        return least, *best

    def _plan(self, seen: Observation, space: Space, group: Sequence[int], effort: Effort) -> Plan:
        team = seen.team
        fixed = [OtherRobot(predicted(mate, seen.start), mate.radius) for i, mate in enumerate(team) if i not in group]
        fixed += [_as_robot(body, seen) for body in seen.moving]
        tasks = [task_of(team[i], seen.start) for i in group]
        speeds = [self._pace(team[i]) for i in group]
        return plan(space, tasks, speeds, fixed, follow=self.follow, effort=effort)

    def _in_the_way(
        self, seen: Observation, space: Space, group: Sequence[int], joint_plan: Plan, alone: Alone
    ) -> list[int]:
        """Willing UGVs outside the group that are in the way of its triggered UGVs without a way."""
        # A UGV is in the way if it comes near the way that such a UGV would have alone. Without any near one, all
        # willing UGVs are returned. If no such UGV has a way even alone, no other UGV can help: the list is empty.
        lost = [i for i, way in zip(group, joint_plan.ways, strict=True) if way is None and seen.team[i].triggered]
        ways = [(seen.team[i], way) for i in lost if (way := alone(i)) is not None]
        if not ways:
            return []
        others = [i for i, mate in enumerate(seen.team) if i not in group and _is_willing(mate, seen.t)]
        near = []
        for j in others:
            other, ahead = seen.team[j], predicted(seen.team[j], seen.start)
            apart = space.spacing + space.apart
            if any(distance(way.motion, ahead) < apart + (mate.radius + other.radius) for mate, way in ways):
                near.append(j)
        return near or others

    def _alone(self, seen: Observation, space: Space, i: int) -> Way | None:
        mate = seen.team[i]
        return plan(space, [task_of(mate, seen.start)], [self._pace(mate)], follow=self.follow).ways[0]

    def _pace(self, mate: Teammate) -> float:
        """The planning speed of a UGV, m/s, halved after each motion that was too fast for it."""
        return min(self.speed, SHARE * mate.max_speed) / 2.0 ** min(mate.too_fast, MOST_HALVINGS)

    def _proposals(self, seen: Observation, group: Sequence[int], joint_plan: Plan) -> dict[str, Motion] | None:
        motions = {}
        for i, way in zip(group, joint_plan.ways, strict=True):
            mate = seen.team[i]
            if way is None or (not mate.triggered and speed(way.motion) == 0.0):
                continue
            motions[mate.name] = _motion(way, seen.start, self.follow, float(mate.position[2]))
        helped = any(seen.team[i].triggered and seen.team[i].name in motions for i in group)
        return motions if helped else None

    def _space(self, seen: Observation, clearance: float, spacing: float) -> Space:
        """Obstacles and distances for a point, in the plane of `seen.robot`."""
        keep, height = outline.keep(seen.obstacles, 0.0), float(seen.position[2])
        return Space(seen.obstacles, keep, clearance, seen.robot_distance, spacing, height)


def _has_the_map_of(before: Observation, seen: Observation) -> bool:
    """Whether the obstacles are those of an earlier observation."""
    moved = any(body.velocity.any() for body in (*before.moving, *seen.moving))
    same = [body.name for body in before.moving] == [body.name for body in seen.moving]
    return before.t <= seen.t and same and not moved and np.array_equal(before.obstacles, seen.obstacles)


def _stands_as_before(before: Observation, seen: Observation) -> bool:
    """Whether a UGV stands where it stood, on the same map: then a failure to find a path even alone persists."""
    # Waiting cannot open a way: with time there are fewer places at which the preset can be joined.
    return math.dist(before.position, seen.position) <= SAME_PLACE_M and _has_the_map_of(before, seen)


def _reason(seen: Observation, group: Sequence[int], joint_plan: Plan) -> str:
    """Why a plan leaves UGVs without a way; empty if it leaves none."""
    if joint_plan.outcome == "no plan exists":
        names = [seen.team[group[i]].name for i in joint_plan.separated]
        return f"no plan exists: on the UAV's map, {', '.join(names)} cannot come to the target"
    return REASONS[joint_plan.outcome]


def _is_as_before(before: Observation, seen: Observation) -> bool:
    """Whether map, UGV positions (roughly) and requests are those of an earlier observation."""
    return (
        _has_the_map_of(before, seen)
        and [_state(mate) for mate in before.team] == [_state(mate) for mate in seen.team]
        and all(
            math.dist(member.position, other.position) <= PITCH * seen.robot_distance
            for member, other in zip(before.team, seen.team, strict=True)
        )
    )


def _state(mate: Teammate) -> tuple[object, ...]:
    """The inputs of a plan besides the UGV's position."""
    asked = mate.proposal and (mate.proposal.issued, mate.proposal.number)
    return mate.name, mate.triggered, mate.standing, mate.resting, mate.answered, mate.too_fast, asked


def task_of(mate: Teammate, start: float) -> RobotTask:
    """The task to bring a UGV back to its preset, from time `start`, s, on."""
    preset = mate.preset
    times = np.append(start, preset.times[preset.times > start + 1e-6])
    return RobotTask(mate.position[:2].copy(), timed(times - start, preset.sample(times)[:, :2]), mate.radius)


def predicted(mate: Teammate, start: float) -> Array:
    """Predicted motion of a UGV from time `start`, s, on: timed, (M, 3), from t = 0."""
    # A UGV with a proposal in force that it has not refused follows the proposal, and then its preset if the proposal
    # ends near it. Any other UGV stays where it is if it stands or is triggered, and returns to its preset if not.
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


def _as_robot(obstacle: MovingObstacle, seen: Observation) -> OtherRobot:
    """A moving obstacle as a disc, with a radius such that robots keep its distance."""
    rows = obstacle.outlines
    reach = np.hypot(*rows[:, outline.MIDDLE : outline.EXTENT].T) + rows[:, outline.EXTENT]
    radius = float((reach + obstacle.distances(0.0)).max()) - seen.robot_distance
    times = obstacle.motion.times[obstacle.motion.times > seen.start + 1e-6]
    places = obstacle.motion.sample(np.append(seen.start, times))[:, :2]
    return OtherRobot(without_repeats(timed(np.append(0.0, times - seen.start), places)), radius)


def _waits(mate: Teammate, t: float) -> bool:
    """Whether a UGV is triggered, may be asked, and has no proposal in force or has refused it."""
    idle = mate.proposal is None or mate.answered == "refused"
    return mate.triggered and idle and _is_willing(mate, t)


def _is_willing(mate: Teammate, t: float) -> bool:
    """Whether a UGV may get a proposal of this UAV at time t, s."""
    just_asked = mate.proposal is not None and mate.proposal.issued == t
    return mate.in_charge and not (mate.resting or just_asked)


def _cost(seen: Observation, group: Sequence[int], joint_plan: Plan) -> tuple[float, ...]:
    """Cost of a plan: triggered UGVs without a path, moving UGVs, and the sum of the times to join presets, s."""
    ways = list(zip(group, joint_plan.ways, strict=True))
    lost = sum(way is None and seen.team[i].triggered for i, way in ways)
    moved = sum(way is not None and speed(way.motion) > 0.0 for _, way in ways)
    return float(lost), float(moved), float(sum(way.joined for _, way in ways if way is not None))


def _motion(way: Way, start: float, follow: float, height: float) -> Motion:
    """A way as a motion in space, which ends `follow`, s, after it has joined the preset."""
    until = min(way.joined + follow, float(way.motion[-1, 0]))
    rows = way.motion[way.motion[:, 0] < until - 1e-9]
    last = [until, *(np.interp(until, way.motion[:, 0], axis) for axis in way.motion[:, 1:].T)]
    rows = np.concatenate([rows, [last]])
    return Motion(start + rows[:, 0], np.column_stack([rows[:, 1:], np.full(len(rows), height)]))


@cache
def warm_up() -> None:
    """Load the compiled functions before the first proposal is needed."""
    room = Space(outline.balls([0.0, 1.0, 0.0]), np.array([0.1]), 0.1, 1.0, 0.1)
    ends = [np.array([0.0, 0.0]), np.array([3.0, 0.0])]
    tasks = [RobotTask(a, np.array([[0.0, *b]])) for a, b in pairwise([*ends, ends[0]])]
    plan(room, tasks, [1.0, 1.0], effort=Effort(candidates=20_000))
