"""The detour policy: the shortest path back to the preset, round known obstacles and bodies that stand."""

import math

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.paths import NoPath, Path, PathsFrom
from airground_drake.uav.policy import Observation, Policy, Teammate

SAMPLE_S = 0.05  # spacing of the vertices of the motion, s

RENDEZVOUS_TOLERANCE_S = 1e-3

CHASED = 16  # after so many steps without a rendezvous the steps are doubled: the preset moves away

LONGEST_FOLLOW_S = 600.0  # longest time for which a proposal follows the preset, s


class Detour(Policy):
    """Meet the preset trajectory again as early as possible, on the shortest safe path at a set speed.

    Attributes:
        speed: along the path, m/s.
        clearance: distance to keep beyond the safe distance, m.
        follow: how long the proposal follows the preset trajectory after the rendezvous, s.
    """

    def __init__(self, *, speed_m_s: float, clearance_m: float = 0.05, follow_s: float = 5.0) -> None:
        """Set the parameters.

        Raises:
            ValueError: if the speed is not positive, another parameter negative, or `follow_s` above LONGEST_FOLLOW_S.
        """
        if not (speed_m_s > 0.0 and clearance_m >= 0.0 and 0.0 <= follow_s <= LONGEST_FOLLOW_S):
            raise ValueError(
                f"detour needs speed_m_s > 0, clearance_m >= 0 and follow_s from 0 to {LONGEST_FOLLOW_S:g}, "
                f"got {speed_m_s!r}, {clearance_m!r}, {follow_s!r}"
            )
        self.speed = speed_m_s
        self.clearance = clearance_m
        self.follow = follow_s

    def propose(self, seen: Observation) -> Motion | None:
        """The shortest path to the earliest rendezvous with the preset trajectory, then the trajectory.

        Robots that stand and have not accepted a motion count as obstacles, and so do moving obstacles that stand.
        None if no free path leads to the preset trajectory before its end.
        """
        height = seen.position[2]
        met = self._rendezvous(seen, PathsFrom(seen.position[:2], *self._in_the_way(seen)))
        if met is None:
            return None
        duration, path = met

        count = max(1, math.ceil(duration / SAMPLE_S))
        legs = path.points(path.length_m * k / count for k in range(count + 1))
        times = seen.start + np.linspace(0.0, max(duration, RENDEZVOUS_TOLERANCE_S), count + 1)
        return _then_follow(times, legs, seen.preset, self.follow, height)

    def _rendezvous(self, seen: Observation, paths: PathsFrom) -> tuple[float, Path] | None:
        """Time to a rendezvous, s, and the path to it; None if the preset is blocked up to its end."""
        # The tried duration only grows: by a sample where the preset is blocked, otherwise to the travel time. So the
        # search finds every rendezvous that lasts longer than a sample. If the preset moves away nearly as fast as the
        # UGV, the steps double and the last step is bisected. That finds a rendezvous, perhaps not the earliest.
        gap = np.linalg.norm(seen.preset.at(seen.start)[0][:2] - seen.position[:2])
        duration = float(gap) / (self.speed + seen.preset.max_speed)  # no rendezvous can be earlier
        missed, strides = duration, 0
        while True:
            needed, path = self._way(seen, duration, paths)
            if path is not None and needed <= duration + RENDEZVOUS_TOLERANCE_S:
                break
            missed = duration
            if path is None:
                if seen.start + duration > seen.preset.end:
                    return None
                duration += SAMPLE_S
            else:
                stride = 2.0 ** max(0, strides - CHASED)
                duration = needed + (stride - 1.0) * (needed - duration)
                strides += 1
        while strides > CHASED and duration - missed > RENDEZVOUS_TOLERANCE_S:
            middle = 0.5 * (missed + duration)
            needed, between = self._way(seen, middle, paths)
            if between is not None and needed <= middle + RENDEZVOUS_TOLERANCE_S:
                duration, path = middle, between
            else:
                missed = middle
        return duration, path

    def _way(self, seen: Observation, duration: float, paths: PathsFrom) -> tuple[float, Path | None]:
        """Travel time, s, and path to the preset's place after the duration, s; infinite and None without a path."""
        goal = seen.preset.at(seen.start + duration)[0][:2]
        try:
            path = paths.to(goal)
        except NoPath:
            return math.inf, None
        return path.length_m / self.speed, path

    def _in_the_way(self, seen: Observation) -> tuple[Array, Array]:
        """Outlines (m, W) that block paths in the plane, and the distances to keep from their cores, (m,), m."""
        robots = [mate for mate in seen.team if mate.name != seen.robot and mate.standing and not _will_move(mate)]
        waiting = [body for body in seen.moving if not body.velocity.any()]
        stand = [outline.moved(body.outlines, body.position) for body in waiting]
        around = outline.joined(seen.obstacles, outline.balls([mate.position for mate in robots]), *stand)
        apart = [seen.distance_to(mate) for mate in robots]
        least = np.concatenate([seen.obstacle_distances, apart, *(body.distances(seen.radius) for body in waiting)])
        # an obstacle may be as near to the target as the safe distance allows: then it gets no clearance
        from_target = convex.distances(around, seen.preset.positions[-1], True)
        reach = np.clip(from_target, least, least + self.clearance)
        return outline.sections(around, reach, float(seen.position[2]))


def _will_move(mate: Teammate) -> bool:
    return mate.proposal is not None and mate.answered == "accepted"


def _then_follow(times: Array, legs: Array, preset: Motion, follow: float, height: float) -> Motion:
    """The motion along planar legs (k, 2), m, at times (k,), s, then along the preset trajectory."""
    after = times[-1] + np.arange(1, max(1, round(follow / SAMPLE_S)) + 1) * SAMPLE_S
    points = np.concatenate([legs, preset.sample(after)[:, :2]])
    return Motion(np.concatenate([times, after]), np.column_stack([points, np.full(len(points), height)]))
