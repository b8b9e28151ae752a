"""Where a team's inequalities bind, and hostile inputs that put them to the test.

Every robot is put beside every obstacle (of many: beside some) and every other robot, inside and outside of the safe
distance, near enough for the inequality to bind; then robots crowd around one obstacle. Presets,
proposals and the UGVs' velocities that the UAV feeds forward drive every robot to what it must avoid. What each may
want by them is written here in plain numpy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from airground_drake.arrays import Array
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.motion import Motion
from airground_drake.verify.engines.rounding import unit
from airground_drake.verify.model.avoidance.scenario_pairs import Inputs, Views

STATES = 240
"""Team positions at least; more where there are many pairs."""
MOST_BESIDE = 40
"""Obstacles that every robot is put beside at most, unless it takes more that every obstacle has a robot beside it."""
MANY = 80
"""Rounds of partners from which on each is gone through with one kind of distance, not with all."""
KINDS_OF_DISTANCES = 5
CROWDED = 60
"""Team positions besides, in which robots crowd around one obstacle."""
MOST_CROWDED = 1200
"""Robots in these positions, counted in each: of a team of more than 20 there are fewer positions."""
TRIALS = 24
"""Directions from an obstacle that are tried for one that is clear of the others."""
ACCEPT, SILENT, REFUSE = 1.0, 0.0, -1.0
"""Answers, as messages have them."""
ANSWERS = {"none": ACCEPT, "accepted": ACCEPT, "refused": REFUSE, "silent": SILENT, "answered_another": ACCEPT}
"""What may be the matter with a proposal, and the answer that there is."""
TIME_S = 2.0
"""Time in the contexts, s."""


class State(NamedTuple):
    """Positions of a team, (n + 1, 3), m, and for each robot the point that it is drawn to, (n + 1, 3), m."""

    positions: Array
    drawn_to: Array


class Asked(NamedTuple):
    """What is put on the controllers' ports, and what each robot may want by it.

    Attributes:
        reference: presets, (n, 6): m, m/s.
        proposals: per UGV.
        answers: (n, 2), one of ACCEPT, SILENT, REFUSE and the number of the proposal that is answered.
        feed_forward: velocity that the UAV is told of every UGV, (3,), m/s.
        wanted: (n + 1, 3), m/s, within speed limits.
        executed: (n,), whether there is an accepted proposal.
        how: per UGV, one of ANSWERS.
    """

    reference: Array
    proposals: tuple[Proposal | None, ...]
    answers: Array
    feed_forward: Array
    wanted: Array
    executed: npt.NDArray[np.bool_]
    how: list[str]


def states(inputs: Inputs, views: Views, rng: np.random.Generator) -> Iterator[State]:
    """Positions in which every robot is beside what it must avoid (but for obstacles beyond many), then crowded ones.

    In a round every robot has one partner: an obstacle, or another robot away from everything else.
    """
    n, m = len(views.robots), len(views.obstacles)
    spaced = np.linspace(0, m, min(m, max(MOST_BESIDE, -(-m // n))), endpoint=False).astype(int).tolist()
    rounds: list[list[tuple[int, int]]] = [[(i, -1 - (i + r) % m) for i in range(n)] for r in spaced]
    rounds += list(_round_robin(n))
    repeated = max(KINDS_OF_DISTANCES, -(-STATES // len(rounds))) if len(rounds) <= MANY else 1
    for r in range(repeated):
        for k, pairs in enumerate(rounds):
            yield beside(inputs, views, pairs, r if len(rounds) <= MANY else r + k, rng)
    for _ in range(min(CROWDED, -(-MOST_CROWDED // n))):
        yield _crowded(inputs, views, rng)


def _round_robin(count: int) -> Iterator[list[tuple[int, int]]]:
    """Rounds in which every two of `count` meet once (circle method)."""
    members = list(range(count + count % 2))
    for _ in range(len(members) - 1):
        pairs = list(zip(members[: len(members) // 2], reversed(members[len(members) // 2 :]), strict=True))
        yield [(i, j) for i, j in pairs if max(i, j) < count]
        members = [members[0], members[-1], *members[1:-1]]


def _distance(inputs: Inputs, how: int, safe: float, share: float, speed: float, rng: np.random.Generator) -> float:
    """A distance at which an inequality binds at full speed towards: inside, at d, outside, almost too far."""
    free = speed * inputs["period_s"] / share  # farther outside than this nothing binds
    match how % KINDS_OF_DISTANCES:
        case 0:
            return safe * (1.0 - 0.3 * rng.random())
        case 1:
            return safe * (1.0 + 1e-9 * rng.random())
        case 2:
            return safe + 0.5 * free * rng.random()
        case 3:
            return min(safe + free * (0.9 + 0.09 * rng.random()), float(inputs["sensing_range_m"]) * (1.0 - 1e-9))
    return safe + free * rng.random()


def beside(inputs: Inputs, views: Views, pairs: Sequence[tuple[int, int]], how: int, rng: np.random.Generator) -> State:
    """Every pair (robot, robot or -1 - obstacle) beside each other; robots without a partner far away."""
    n, uav = len(views.robots), len(views.ugvs)
    cell = 4.0 * (inputs["sensing_range_m"] + views.safe.max(initial=1.0))
    corner = np.abs(views.obstacles).max(initial=0.0) + cell
    columns = int(np.ceil(np.sqrt(n)))
    positions = np.array([[corner + cell * (i % columns), corner + cell * (i // columns), 0.0] for i in range(n)])
    drawn_to = positions + unit(rng, n)
    for i, j in pairs:
        if j < 0:
            centre = views.obstacles[-1 - j]
            reach = _distance(inputs, how, views.apart(i, j), 1.0, views.max_speed[i], rng)
            positions[i] = _clear_of_others(views, centre, reach, i == uav, rng)
            drawn_to[i] = centre
        else:
            i, j = min(i, j), max(i, j)
            speed = min(views.max_speed[i], views.max_speed[j])
            reach = _distance(inputs, how, views.apart(i, j), 0.5, speed, rng)
            steep = 0.5 * np.pi if rng.random() < 0.1 else rng.uniform(0.0, 1.2)
            positions[j] = positions[i] + reach * _direction(rng.uniform(0.0, 2.0 * np.pi), steep if j == uav else 0.0)
            drawn_to[i], drawn_to[j] = positions[j], positions[i]
    return State(positions, drawn_to)


def _direction(turn: Array | float, rise: Array | float) -> Array:
    return np.stack(np.broadcast_arrays(np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)), -1)


def _clear_of_others(views: Views, centre: Array, reach: float, flies: bool, rng: np.random.Generator) -> Array:
    """A place at distance `reach` of an obstacle, as far from the others as some random directions allow."""
    if flies:
        turn, rise = rng.uniform([0.0, -1.5], [2.0 * np.pi, 1.5], (TRIALS, 2)).T
        places = centre + reach * _direction(turn, rise)
    else:
        across = np.sqrt(max(reach**2 - centre[2] ** 2, 1e-4))
        places = (centre + across * _direction(rng.uniform(0.0, 2.0 * np.pi, TRIALS), 0.0)) * [1.0, 1.0, 0.0]
    between = cdist(places, views.obstacles) - views.obstacle_radius
    between[:, (views.obstacles == centre).all(axis=1)] = np.inf
    found: Array = places[int(np.argmax(between.min(axis=1)))]
    return found


def _crowded(inputs: Inputs, views: Views, rng: np.random.Generator) -> State:
    """Robots at random around one obstacle, or one point, drawn to one of what they avoid."""
    n, m = len(views.robots), len(views.obstacles)
    centre = views.obstacles[rng.integers(m)] if m else np.zeros(3)
    spread = views.safe.max() * np.sqrt(n) * rng.uniform(0.5, 2.0)
    positions = centre + rng.uniform(-spread, spread, (n, 3))
    positions[:-1, 2] = 0.0
    excess = views.distances(positions) - views.safe
    nearest = np.where(rng.random(n) < 0.5, np.argmin(excess, axis=1), rng.integers(excess.shape[1], size=n))
    return State(positions, views.centres(positions)[np.arange(n), nearest])


def hostile(inputs: Inputs, views: Views, state: State, rng: np.random.Generator) -> Asked:
    """Presets, proposals and a feed-forward that drive every robot to what it is drawn to, at up to 10 times its limit.

    What each may want follows by (6), (9)-(10), (12)-(14) and (20): the intervention's directions from an accepted
    proposal, the rest from the robot's own task; never more than the speed limit.
    """
    n, own = len(views.ugvs), state.positions[:-1]
    towards = state.drawn_to - state.positions
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
    towards = towards + rng.choice([0.0, 0.3, 1.0], (n + 1, 1)) * unit(rng, n + 1)
    push = towards * views.max_speed[:, None] * rng.choice([0.5, 1.5, 10.0], (n + 1, 1))
    planar = views.mobility[:-1]

    places = own + rng.choice([0.0, 1.0], (n, 1)) * rng.uniform(-1.0, 1.0, (n, 3))
    rates = push[:-1] - inputs["motion_gain_1_s"] * (places - own)
    task = limited(planar * (rates + inputs["motion_gain_1_s"] * (places - own)), views.max_speed[:-1])
    how = rng.choice(list(ANSWERS), n, p=[0.2, 0.4, 0.15, 0.1, 0.15])
    executed = how == "accepted"
    # away from its own task's way where it must not be executed, so that the two cannot be confused
    rate = np.where(executed[:, None], push[:-1], -push[:-1])
    there = own + rng.uniform(-1.0, 1.0, (n, 3))
    turned = rng.random(n) < 0.3
    bases = np.where(turned[:, None, None], np.linalg.qr(rng.normal(size=(n, 3, 3)))[0], np.eye(3))
    rank = np.where(turned, rng.integers(1, 4, n), 3)
    kept = bases * (np.arange(3) < rank[:, None])[..., None]
    intervention = planar * (rate + inputs["intervention_gain_1_s"] * (there - own))
    followed = task + np.einsum("ika,ikb,ib->ia", kept, kept, intervention - task)
    wanted = limited(np.where(executed[:, None], planar * followed, task), views.max_speed[:-1])

    numbers = rng.integers(1, 100, n)
    answers = np.column_stack([[ANSWERS[each] for each in how], numbers + (how == "answered_another")])
    times, legs = np.array([TIME_S - 1.0, TIME_S + 1.0]), np.stack([there - rate, there + rate], axis=1)
    proposals = tuple(
        None if how[i] == "none"
        else Proposal(f"hostile_{i}", 0.0, Motion(times, legs[i]), bases[i, : rank[i]], number=int(numbers[i]))
        for i in range(n)
    )  # fmt: skip

    above = own.mean(axis=0) + np.array([0.0, 0.0, inputs["altitude_m"]])
    formation = inputs["formation_gain_1_s"] * (above - state.positions[-1])
    feed_forward = push[-1] - formation
    flown = limited((feed_forward + formation)[None], views.max_speed[-1:])
    return Asked(
        np.hstack([places, rates]), proposals, answers, feed_forward, np.vstack([wanted, flown]), executed, how.tolist()
    )  # fmt: skip


def limited(velocity: Array, most: Array) -> Array:
    """Velocities (n, 3) shortened to at most `most` (n,), m/s."""
    speed = np.linalg.norm(velocity, axis=1)
    found: Array = velocity * np.where(speed > most, most / np.maximum(speed, 1e-300), 1.0)[:, None]
    return found
