"""Wrong interventions: by occlusion, noise, a stale map or malice."""

from dataclasses import replace

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.detour import Detour
from airground_drake.uav.policy import SHORTEST_LEG_S, Observation, Policy


class Towards(Policy):
    """Go straight to a fixed point and stay there: the paper's wrong intervention of case B."""

    def __init__(self, *, x_m: float, y_m: float, speed_m_s: float) -> None:
        """Set the point, m, and the speed, m/s; raises ValueError unless the speed is positive."""
        self.point = np.array([x_m, y_m])
        self.speed = _positive("towards", speed_m_s)

    def propose(self, seen: Observation) -> Motion | None:
        """The straight path from the UGV, through any obstacle."""
        return _straight(seen, np.append(self.point, seen.position[2]), self.speed)


class StaleMap(Detour):
    """The detour on the UAV's own map: it ignores obstacles learnt from answers."""

    def propose(self, seen: Observation) -> Motion | None:
        """The detour round the obstacles of its own map."""
        return super().propose(replace(seen, obstacles=seen.mapped))


class Noisy(Detour):
    """The detour with measurement errors: independent Gaussian noise displaces every vertex in the plane."""

    def __init__(
        self, *, speed_m_s: float, noise_m: float, seed: float = 0.0, clearance_m: float = 0.05, follow_s: float = 5.0
    ) -> None:
        """`noise_m`: standard deviation; `seed`: of the sequence of the noise. Detour has the other parameters."""
        super().__init__(speed_m_s=speed_m_s, clearance_m=clearance_m, follow_s=follow_s)
        if not noise_m >= 0.0:
            raise ValueError(f"noisy needs noise_m >= 0, got {noise_m!r}")
        self.noise, self.seed = noise_m, int(seed)

    def propose(self, seen: Observation) -> Motion | None:
        """The displaced detour, a function of time and seed."""
        motion = super().propose(seen)
        if motion is None:
            return None
        random = np.random.default_rng([self.seed, round(1e6 * seen.t)])
        shift = np.zeros(motion.positions.shape)
        shift[:, :2] = random.normal(scale=self.noise, size=(len(shift), 2))
        return Motion(motion.times, motion.positions + shift)


class Hostile(Policy):
    """Straight into the nearest obstacle or robot, chosen anew for each proposal."""

    def __init__(self, *, speed_m_s: float) -> None:
        """Set the speed, m/s; raises ValueError unless it is positive."""
        self.speed = _positive("hostile", speed_m_s)

    def propose(self, seen: Observation) -> Motion | None:
        """The straight path to the middle of the nearest obstacle or robot."""
        middles = seen.obstacles[:, [outline.MIDDLE, outline.MIDDLE + 1, outline.BASE]]
        around = np.concatenate([middles, seen.others])
        if not len(around):
            return None
        fixed = convex.distances(seen.obstacles, seen.position, True)
        apart = np.concatenate([fixed, np.linalg.norm(seen.others - seen.position, axis=1)])
        nearest = around[apart.argmin()]
        return _straight(seen, np.append(nearest[:2], seen.position[2]), self.speed)


def _straight(seen: Observation, goal: Array, speed: float) -> Motion:
    length = float(np.linalg.norm(goal - seen.position))
    if length < SHORTEST_LEG_S * speed:
        return Motion(np.array([seen.start, seen.start + HOLD_S]), np.array([goal, goal]))
    arrival = seen.start + length / speed
    return Motion(np.array([seen.start, arrival, arrival + HOLD_S]), np.array([seen.position, goal, goal]))


HOLD_S = 1e4  # a wrong intervention holds its goal for this time, s: in effect, until it is refused


def _positive(policy: str, speed: float) -> float:
    if not speed > 0.0:
        raise ValueError(f"{policy} needs speed_m_s > 0, got {speed!r}")
    return speed
