"""Predicted motion of one UGV: a roll-out of its control law under given answers to a proposal."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.model.geometry import convex
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.kernels import fill_half_spaces
from airground_drake.model.law.ugv_law import AcceptedMotion, Numbers, Tracking, UgvLaw, UgvState, command
from airground_drake.model.plants.steering import EDGES, HAND, NUMBERS, keep_ahead, steer
from airground_drake.uav.policy import Proposal

REFUSED, ACCEPTED = 0, 1  # modes of a control period: whether the proposal is in force


@dataclass(frozen=True, eq=False)
class View:
    """A UGV's view when it decides: m outlines at rest, then n parts of bodies that move (`model.geometry.outline`)."""

    t: float  # time, s
    position: Array  # own position, (3,), m
    preset: Motion  # own preset trajectory
    still: Array  # outlines at rest, (m, W), world frame
    parts: Array  # outlines that move, about the origins of their bodies, (n, W)
    places: Array  # positions of these bodies, (n, 3), m
    velocities: Array  # their velocities, taken as constant, (n, 3), m/s
    distances: Array  # safe distances from the cores, (m + n,), m
    shares: Array  # share of each avoidance inequality, (m + n,)
    max_speed: float  # own speed limit, m/s
    # under method (d), per part that moves, the motion that its body is asked to make, and whether it makes it whatever
    # this UGV answers; or None
    asked: tuple[tuple[Motion, bool] | None, ...] = ()
    heading: float = 0.0  # own heading, rad, of a unicycle
    # numbers of its steering, (6,), see `model.plants.steering`; zeros for a robot that is no unicycle
    steering: Array = field(default_factory=lambda: np.zeros(NUMBERS))

    def apart(self) -> Array:
        """Signed distances of the own position from the cores, (m + n,), m."""
        fixed = convex.distances(self.still, self.position, True)
        moving = [convex.distances(self.parts[j, None], self.position - at, True) for j, at in enumerate(self.places)]
        return np.concatenate([fixed, *moving])

    def restrict(self, sensed: npt.NDArray[np.bool_]) -> View:
        """This view with only the bodies marked as sensed, (m + n,)."""
        fixed, moving = sensed[: len(self.still)], sensed[len(self.still) :]
        return replace(
            self, still=self.still[fixed], parts=self.parts[moving], places=self.places[moving],
            velocities=self.velocities[moving], distances=self.distances[sensed], shares=self.shares[sensed],
        )  # fmt: skip


class ClosedLoop(NamedTuple):
    """The inputs of a UGV's motion over the horizon, except for the answers to the proposal.

    N stages of `substeps` control periods each, S = N * substeps in all. The arrays are never written to.
    """

    law: Numbers  # the numbers of its control law
    start: Array  # position at the beginning, (3,), m, world frame
    preset: Array  # own preset trajectory at the control samples, (S + 1, 3), m
    wanted: Array  # the proposed motion at the control samples, (S + 1, 3), m
    chosen: Array  # J_int^+ J_int, projector onto the directions in which the UAV intervenes, (3, 3)
    still: Array  # outlines at rest, (m, W)
    parts: Array  # outlines that move, (n, W)
    every: npt.NDArray[np.intp]  # 0 to n - 1, the indices of all of them
    places: Array  # where the bodies that move are at the control samples, (S + 1, n, 3), m
    distances: Array  # safe distances from the cores, (m + n,), m
    shares: Array  # share of each avoidance inequality, (m + n,)
    max_speed: float  # own speed limit, m/s
    substeps: int  # control periods per stage
    heading: float  # at the beginning, rad, of a unicycle
    steering: Array  # numbers of its steering, (6,), see `model.plants.steering`


def closed_loop(
    seen: View, law: UgvLaw, proposal: Proposal, after: Array, places: Array, substeps: int = 1
) -> ClosedLoop:
    """The UGV's closed loop among bodies that move in any way, with `substeps` control periods per stage."""
    # `after` are control samples from now on, (S + 1,), s, and `places` where these bodies are then, (S + 1, n, 3), m.
    # The `places` and `velocities` of the view do not count.
    t = seen.t + after
    return ClosedLoop(
        law=law.numbers,
        start=seen.position,
        preset=seen.preset.sample(t),
        wanted=proposal.motion.sample(t),
        chosen=proposal.chosen,
        still=seen.still,
        parts=seen.parts,
        every=np.arange(len(seen.parts)),
        places=np.ascontiguousarray(places),  # the layout that is compiled for
        distances=seen.distances,
        shares=seen.shares,
        max_speed=float(seen.max_speed),
        substeps=substeps,
        heading=float(seen.heading),
        steering=seen.steering,
    )


class Workspace(NamedTuple):
    """Arrays that one control period writes to, and the UGV's mobility."""

    # See `fill_half_spaces` for `which`, `normal`, `bound` and `retreat`; `rate` and `asked` are the velocities of the
    # preset trajectory and of the proposed motion, (3,), m/s; `heading` is that of a unicycle now, (1,), rad.

    mobility: Array
    which: npt.NDArray[np.intp]
    normal: Array
    bound: Array
    retreat: Array
    rate: Array
    asked: Array
    heading: Array


@njit(cache=True)
def workspace(loop: ClosedLoop) -> Workspace:
    """Arrays for `advance`, uninitialised but for the heading."""
    count = 2 * len(loop.distances) + EDGES
    plane = np.array([1.0, 1.0, 0.0])
    which, normal, bound, retreat = np.empty(count, np.intp), np.empty((count, 3)), np.empty(count), np.empty(count)
    return Workspace(plane, which, normal, bound, retreat, np.empty(3), np.empty(3), np.full(1, loop.heading))


@njit(cache=True)
def advance(loop: ClosedLoop, mode: int, k: int, position: Array, work: Workspace) -> Array:
    """Move the UGV through control period k, and return its mean velocity in it, (3,), m/s."""
    # Only here do predictions assume a plant. The steered point of every plant of `model.plants.plant` gets from sample
    # to sample as its command says; that of a unicycle may be shortened, which turns on its heading.
    #
    # `mode` is REFUSED or ACCEPTED. `position`, (3,), m, is that at the beginning of the period, then that at its end.
    velocity = _command(loop, mode, k, position, work)
    if loop.steering[HAND] > 0.0:
        turning = steer(velocity, work.heading[0], loop.steering, loop.law.layer.period)[1]
        work.heading[0] += 2.0 * (0.5 * turning * loop.law.layer.period)
    for a in range(3):
        position[a] += loop.law.layer.period * velocity[a]
    return velocity


@njit(cache=True, inline="always")
def _command(loop: ClosedLoop, mode: int, k: int, position: Array, work: Workspace) -> Array:
    """Velocity that the law commands in control period k, (3,), m/s; rates are of the sampled motions."""
    mobility, which, normal, bound, retreat, rate, asked, heading = work
    law, every = loop.law, loop.every
    count = fill_half_spaces(
        position, mobility, loop.still, loop.parts, every, every, loop.places[k], loop.distances, loop.shares,
        law.layer, which, normal, bound, retreat,
    )  # fmt: skip
    count = keep_ahead(heading[0], loop.steering, normal, bound, retreat, count)
    for a in range(3):
        rate[a] = (loop.preset[k + 1, a] - loop.preset[k, a]) / law.layer.period
        asked[a] = (loop.wanted[k + 1, a] - loop.wanted[k, a]) / law.layer.period
    ugv, track = UgvState(position, mobility, loop.max_speed), Tracking(loop.preset[k], rate)
    intervention = AcceptedMotion(loop.wanted[k], asked, loop.chosen)
    return command(law, ugv, track, intervention, mode == ACCEPTED, normal[:count], bound[:count], retreat[:count])


@njit(cache=True)
def follow(loop: ClosedLoop, answers: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Roll out under an answer per stage, (N,), REFUSED or ACCEPTED."""
    # Returns positions at the ends of the stages, (N, 3), m, and mean velocities of the stages, (N, 3), m/s.
    stages = len(answers)
    positions, mean = np.empty((stages, 3)), np.zeros((stages, 3))
    position, work = loop.start.copy(), workspace(loop)
    for stage in range(stages):
        for k in range(stage * loop.substeps, (stage + 1) * loop.substeps):
            velocity = advance(loop, answers[stage], k, position, work)
            for a in range(3):
                mean[stage, a] += velocity[a] / loop.substeps
        for a in range(3):
            positions[stage, a] = position[a]
    return positions, mean
