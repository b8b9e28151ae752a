"""Observations and proposals as arrays of numbers, for agents and for the policies that they become."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import convex
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.policy import Observation

Numbers = npt.NDArray[np.float32]  # an observation or an action

# Bounds of entries of observations; greater values are clipped.
LONGEST_S, MOST_REFUSALS, FASTEST_M_S = 3600.0, 100.0, 100.0
TOUCHING_M = 0.02  # a way that leads towards an obstacle is blocked if the distance left to it is at most this, m
APART_M = 0.01  # waypoints that are nearer to the one before are left out, m


@dataclass(frozen=True)
class Encoding:
    """How observations become arrays, and arrays proposals. All places are in the UGV's frame, m: see `frame`.

    An observation has, in this order:

    - 1 if a proposal for this UGV is asked for; 0, and 0 everywhere else, if not;
    - the time, s, and the number of proposals that the UGV has refused since its trigger;
    - the distance to its target, m;
    - for each of `rays` directions, from ahead and then to the left, the free way, m: how far the UGV can go straight
      until it is as near as allowed to an obstacle at rest that the UAV knows;
    - for each of the `bodies` nearest other UGVs and moving obstacles: where it is (2), its velocity (2), m/s, and the
      distance to keep between the centre of the UGV and its centre or edge, m. The velocity is that of an accepted
      proposal; without one the velocity of a UGV counts as 0. All are 0 if there are fewer bodies.

    An action has numbers from -1 to 1: the first is below 0 if nothing is to be proposed; the others are the waypoints
    (2 each) in units of `reach_m`. The proposal leads from the UGV through them to its target, at its largest speed.

    Attributes:
        rays: number of directions.
        bodies: number of bodies.
        waypoints: number of waypoints.
        reach_m: of free ways, bodies and waypoints, m; what is farther is clipped.
    """

    rays: int = 16
    bodies: int = 4
    waypoints: int = 2
    reach_m: float = 10.0

    @property
    def low(self) -> Numbers:
        """Least observation, (O,)."""
        others = [*(-low for low in self._far), 0.0]
        return np.array([*[0.0] * (4 + self.rays), *others * self.bodies], dtype=np.float32)

    @property
    def high(self) -> Numbers:
        """Largest observation, (O,)."""
        own = [1.0, LONGEST_S, MOST_REFUSALS, self.reach_m, *[self.reach_m] * self.rays]
        return np.array([*own, *[*self._far, self.reach_m] * self.bodies], dtype=np.float32)

    @property
    def _far(self) -> tuple[float, ...]:
        return self.reach_m, self.reach_m, FASTEST_M_S, FASTEST_M_S

    @property
    def size(self) -> int:
        """Length of an observation, O."""
        return 4 + self.rays + 5 * self.bodies

    @property
    def actions(self) -> int:
        """Length of an action, A."""
        return 1 + 2 * self.waypoints

    def nothing(self) -> Numbers:
        """The observation of a UGV for which nothing is asked."""
        return np.zeros(self.size, dtype=np.float32)

    def observed(self, seen: Observation) -> Numbers:
        """An observation, (O,), of a UGV for which a proposal is asked for."""
        axes, away = frame(seen)
        turns = 2.0 * np.pi * np.arange(self.rays) / self.rays
        headings = np.column_stack([np.cos(turns), np.sin(turns)]) @ axes
        ways = free_ways(seen.obstacles, seen.obstacle_distances, seen.position, headings, self.reach_m)
        others = np.zeros((self.bodies, 5))
        near = sorted(_others(seen, axes), key=lambda row: float(np.hypot(row[0], row[1])))[: self.bodies]
        others[: len(near)] = np.reshape(near, (-1, 5))
        observation = np.concatenate([[1.0, seen.t, seen.refusals, away], ways, others.ravel()]).astype(np.float32)
        return np.clip(observation, self.low, self.high)

    def motion(self, action: npt.ArrayLike, seen: Observation, speed: float | None = None) -> Motion | None:
        """What an action proposes for a UGV.

        Args:
            action: (A,).
            seen: what the UAV knows.
            speed: along the way, m/s; default: the UGV's largest.

        Raises:
            ValueError: if the action has another shape or numbers that are not finite.
        """
        numbers = np.asarray(action, dtype=np.float64)
        if numbers.shape != (self.actions,) or not np.isfinite(numbers).all():
            raise ValueError(f"wanted: {self.actions} finite numbers, got {action!r}")
        if numbers[0] < 0.0:
            return None
        axes, _ = frame(seen)
        corners = self.reach_m * numbers[1:].reshape(-1, 2) @ axes + seen.position[:2]
        places = [seen.position]
        for place in np.vstack([corners, seen.target[:2]]):
            if np.hypot(*(place - places[-1][:2])) > APART_M:
                places.append(np.append(place, seen.position[2]))
        if len(places) == 1:
            return None
        fastest = next(mate.max_speed for mate in seen.team if mate.name == seen.robot)
        return Motion.at_speed(np.array(places), fastest if speed is None else speed, start=seen.start)


def frame(seen: Observation) -> tuple[Array, float]:
    """Unit vectors ahead, towards the target, and to the left, (2, 2), and the distance to the target, m."""
    way = (seen.target - seen.position)[:2]
    away = float(np.hypot(way[0], way[1]))
    ahead = way / away if away > 0.0 else np.array([1.0, 0.0])
    return np.array([ahead, [-ahead[1], ahead[0]]]), away


def free_ways(rows: Array, keep: Array, position: Array, headings: Array, reach: float) -> Array:
    """How far a straight way keeps the distances from cores, (R,), m."""
    # rows: (m, W); keep: (m,), m; position: (3,), m; headings: (R, 2)
    if not len(rows):
        return np.full(len(headings), reach)
    away = position[:2] - convex.nearest_points(rows, position[None])[0, :, :2]
    left = convex.distances(rows, position, True) - keep
    free_m = np.full(len(headings), reach)
    for k, heading in enumerate(headings):
        closing = away @ heading < 0.0  # signed distances are convex: one that does not shrink at first never does
        if (closing & (left <= TOUCHING_M)).any():
            free_m[k] = 0.0
        elif closing.any():
            free_m[k] = _first(rows[closing], keep[closing], position, np.append(heading, 0.0), reach)
    return free_m


def _first(rows: Array, keep: Array, position: Array, heading: Array, reach: float) -> float:
    """Length of the way until it touches something, m: steps as long as the distance left cannot pass anything."""
    gone = 0.0
    while gone < reach:
        left = float((convex.distances(rows, position + gone * heading, True) - keep).min())
        if left <= TOUCHING_M:
            return gone
        gone += left
    return reach


def _others(seen: Observation, axes: Array) -> Iterator[Array]:
    """Rows of 5 numbers of other UGVs and of moving obstacles; see `Encoding`."""
    for mate in seen.team:
        if mate.name != seen.robot:
            follows = mate.proposal is not None and mate.answered == "accepted"
            velocity = mate.proposal.motion.at(seen.t)[1] if mate.proposal and follows else np.zeros(3)
            yield _row(mate.position - seen.position, velocity, seen.distance_to(mate), axes)
    for body in seen.moving:
        distances = body.distances(seen.radius)
        apart = convex.distances(body.outlines, seen.position - body.position, True) - distances
        nearest = convex.nearest_points(body.outlines, (seen.position - body.position)[None])[0]
        k = int(np.argmin(apart))
        yield _row(nearest[k] - (seen.position - body.position), body.velocity, float(distances[k]), axes)


def _row(offset: Array, velocity: Array, keep: float, axes: Array) -> Array:
    return np.concatenate([axes @ offset[:2], axes @ velocity[:2], [keep]])
