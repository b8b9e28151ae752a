"""The robots' control law (6), (8)-(11), (14), (20), written again in numpy for many samples at once: B of them.

Velocities in m/s, positions in m, world frame. Nothing of the running code is used.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.control_law import ON_TOP, PLANE, avoided, inequalities_of
from airground_drake.verify.runs.control_law import Inequalities as OfRun
from airground_drake.verify.runs.pairs import pairs_beside, parts_of
from airground_drake.verify.runs.proposals import ProposalRecord
from oracles.positions import acts_on_old, old_positions, unheard
from oracles.projection import CONTRADICTION_M_S, closest, least_violation, shortened

MARGIN_M_S = 1e-12
"""The law's closest velocity keeps its inequalities by this much, m/s. Without it the corner of two nearly parallel
inequalities (a robot squeezed between an obstacle and another robot) is elsewhere by far more."""
TOUCHED_M_S, OPPOSITE = 1e-9, 1e-9
"""A robot touches a body whose inequality asks for no more, m/s; unit normals are opposite up to this."""


class Inequalities(NamedTuple):
    """normal_k.v >= bound_k for K points or cores: normals (B, K, 3), bounds (B, K), -inf where nothing is asked.

    `retreat`: normal_k.v that a task below them asks for, (B, K), 0 where it asks for nothing; None: nowhere.
    """

    normal: Array
    bound: Array
    retreat: Array | None = None

    def also(self, normal: Array, bound: Array, more: Array | None = None) -> "Inequalities":
        more = np.zeros_like(bound) if more is None else more
        retreat = None if self.retreat is None else np.concatenate([self.retreat, more], axis=1)
        both = (np.concatenate(parts, axis=1) for parts in ((self.normal, normal), (self.bound, bound)))
        return Inequalities(*both, retreat)

    def slack(self, velocity: Array) -> Array:
        return np.asarray(np.einsum("bkd,bd->bk", self.normal, velocity) - self.bound)


def as_seen(trace: Trace, robot: str) -> Inequalities:
    """The inequalities of what a robot saw at the control samples, side by side in the order of its controller."""
    given, count = _current(trace, robot), len(trace.sample_rows)
    k = np.arange(len(given.sample)) - np.searchsorted(given.sample, given.sample)
    most = int(k.max(initial=-1)) + 1
    normal, bound, retreat = np.zeros((count, most, 3)), np.full((count, most), -np.inf), np.zeros((count, most))
    normal[given.sample, k], bound[given.sample, k] = given.normal, given.bound
    retreat[given.sample, k] = _retreats(trace, robot, given)
    return Inequalities(normal, bound, retreat if retreat.any() else None).also(*old_positions(trace, robot))


def _current(trace: Trace, robot: str) -> OfRun:
    """The inequalities of a robot, but for those beside robots whose messages it lacks, or has old ones of."""
    given, parts = inequalities_of(trace, robot), len(parts_of(trace).owner)
    lacks = np.pad(unheard(trace, robot), ((0, 0), (parts, 0)))[given.sample, given.column]
    if acts_on_old(trace) and robot in trace.ugvs:
        lacks |= (given.column >= parts) & (given.column < parts + len(trace.ugvs))
    return OfRun(*(array[~lacks] for array in given))


def _retreats(trace: Trace, robot: str, given: OfRun) -> Array:
    """Speeds n.v at which a robot should retreat from the body of each inequality, (C,), m/s."""
    pairs = pairs_beside(trace, robot)
    beside = [pairs.get(name) for name in avoided(trace)]  # None: the robot itself
    safe, speed = (np.array([getattr(pair, name, 0.0) for pair in beside]) for name in ("law_m", "speed_m_s"))
    return retreats(given.distance, safe[given.column], speed[given.column], trace.scenario.control.period_s)


def retreats(distance: Array, safe: Array, speed: Array, period_s: float) -> Array:
    """Speeds n.v, (...), m/s, at which a robot should retreat from bodies that may move: V - (D - d) / h, or 0."""
    return np.where(speed > 0.0, np.maximum(speed - (distance - safe) / period_s, 0.0), 0.0)


def retreating(below: Array, given: Inequalities, limit: Array | float, *, planar: bool) -> Array:
    """Velocities (B, 3) that retreat from what may move: the closest ones that do, within a speed limit."""
    if given.retreat is None:
        return below
    some = (given.retreat > 0.0).any(axis=1)
    asked = Inequalities(given.normal[some], np.where(given.retreat[some] > 0.0, given.retreat[some], -np.inf))
    found = below.copy()
    limits = np.broadcast_to(limit, len(below))[some]
    found[some] = limited(avoiding(below[some], asked, "augmented", planar=planar), limits)
    return found


class Asked(NamedTuple):
    """Accepted interventions: wanted places (B, 3), their rates (B, 3), J_int^+ J_int (B, 3, 3)."""

    wanted: Array
    rate: Array
    chosen: Array


def limited(velocity: Array, limit: Array | float) -> Array:
    speed = np.sqrt(np.square(velocity).sum(axis=1))
    return np.asarray(velocity * np.minimum(1.0, limit / np.maximum(speed, 1e-300))[:, None])


def avoiding(
    below: Array, given: Inequalities, composition: str, *, planar: bool, limit: Array | float = np.inf
) -> Array:
    """The avoidance tasks above velocities (B, 3): the closest ones, or (5) as printed for `recursion_*`.

    Where they contradict one another: those that miss the least, or for `standing` none. `standing` is also none where
    they ask for more than the speed limit, a number or (B,).
    """
    velocity = below.copy()
    missed = (given.slack(below) < 0.0).any(axis=1)
    if not missed.any():
        return velocity
    normal, bound = given.normal[missed], given.bound[missed]
    if composition.startswith("recursion"):
        velocity[missed] = [
            _recursion(*one, nearest_first=composition == "recursion_nearest")
            for one in zip(below[missed], normal, bound, strict=True)
        ]
        return velocity
    axes = 2 if planar else 3
    level = bound + MARGIN_M_S
    found, met = closest(below[missed, :axes], normal[:, :, :axes], level)
    if not met.all():
        standing = composition == "standing"
        found[~met] = 0.0 if standing else least_violation(normal[~met, :, :axes], level[~met])
    velocity[missed, :axes] = shortened(found, normal[:, :, :axes], bound)
    if composition == "standing":
        velocity[np.linalg.norm(velocity, axis=1) > limit + CONTRADICTION_M_S] = 0.0
    return velocity


def squeezed(given: Inequalities, velocity: Array) -> npt.NDArray[np.bool_]:
    """Samples in which a robot touches two bodies on opposite sides, and velocities (B, 3) keep to all inequalities.

    No margin fits between them: it is up to rounding how much of the velocity along both is left. What counts is that
    the inequalities are met.
    """
    touched = np.abs(given.bound) <= TOUCHED_M_S
    opposite = np.einsum("bkd,bld->bkl", given.normal, given.normal) < -1.0 + OPPOSITE
    between = (opposite & touched[:, :, None] & touched[:, None, :]).any(axis=(1, 2))
    return np.asarray(between & (given.slack(velocity) >= -MARGIN_M_S).all(axis=1))


def _recursion(below: Array, normal: Array, bound: Array, *, nearest_first: bool) -> Array:
    """(5), level by level from the lowest priority: each task corrects what the levels below it want."""
    order = np.arange(len(bound))[::-1]  # the one listed first has the highest priority
    if nearest_first:  # the most demanding has it; of two that demand the same, the one listed first
        order = order[np.argsort(bound[order], kind="stable")]
    velocity = below.copy()
    for k in order:
        lacking, squared = bound[k] - normal[k] @ velocity, normal[k] @ normal[k]
        if lacking > 0.0 and squared > 0.0:
            velocity += normal[k] * (lacking / squared)
    return velocity


def tracking(position: Array, preset: Array, rate: Array, gain: float, limit: Array | float) -> Array:
    return limited(PLANE * (rate + gain * (preset - position)), limit)


def intervened(position: Array, below: Array, asked: Asked, gain: float, limit: Array | float) -> Array:
    """(14) above the velocities below it, (20): v_int + (I - J^+ J) v, within the speed limit."""
    wish = PLANE * (asked.rate + gain * (asked.wanted - position))
    return limited(PLANE * (below + np.einsum("bij,bj->bi", asked.chosen, wish - below)), limit)


def composed(trace: Trace) -> str:
    """How the avoidance tasks of a run are composed; with errors or old positions robots stand in contradictions."""
    stand = trace.scenario.position_error_m or acts_on_old(trace)
    return "standing" if stand else str(trace.meta["composition"])


def commanded(
    trace: Trace,
    position: Array,
    own: Array,
    given: Inequalities,
    rows: npt.NDArray[np.intp],
    asked: Asked,
    limit: Array,
) -> Array:
    """A UGV's commands by the law of a run, (B, 3): avoidance, and the interventions that are executed, (20)."""
    composition, gain = composed(trace), trace.scenario.control.intervention_gain_1_s
    if trace.meta["method"] in ON_TOP:
        velocity = avoiding(retreating(own, given, limit, planar=True), given, composition, planar=True, limit=limit)
        velocity[rows] = intervened(position[rows], velocity[rows], asked, gain, limit[rows])
        return velocity
    task = own.copy()
    task[rows] = intervened(position[rows], own[rows], asked, gain, limit[rows])
    return avoiding(retreating(task, given, limit, planar=True), given, composition, planar=True, limit=limit)


def selected(sent: ProposalRecord) -> Array:
    return np.asarray(np.linalg.pinv(sent.selection) @ sent.selection)


def place(sent: ProposalRecord, t: float | Array) -> Array:
    """Where a proposal asks a UGV to be at times: (3,) or (K, 3), m; at rest before its motion and after it."""
    return interpolate(sent.times_s, sent.positions_m, t)


def rates(sent: ProposalRecord, t: float) -> list[Array]:
    """Velocities of that place at a time, (3,), m/s: two at a vertex, before and after it, else one."""
    legs = {int(np.searchsorted(sent.times_s, t + shift)) for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)}
    slopes = np.pad(np.diff(sent.positions_m, axis=0) / np.diff(sent.times_s)[:, None], ((1, 1), (0, 0)))
    return [slopes[leg] for leg in sorted(legs)]
