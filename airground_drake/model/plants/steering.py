"""Chord steering of unicycles, compiled: speed and turning rate that bring the hand point to the commanded point.

The hand point is ahead of the axle by l. For a command u = (a, b), in the frame of the body, held for a period h,

    beta = atan(b h / (2 l + a h)),   omega = 2 beta / h,   v = (a cos beta + b sin beta) beta / sin beta,

lead it along an arc to exactly h u. On the way it leaves the straight line by at most |omega| ||(v, l omega)|| h^2 / 8.

A command that asks for too fast a turn is shortened: s u with

    s = min(1, 2 l T / (h (|b| - a T))),   T = tan(omega_max h / 2),

needs |omega| <= omega_max (theorems Turning.turns_within and Turning.shortened_chord). It is shortened further, by
bisection, until no wheel exceeds its speed limit, |v| + |omega| B / 2 <= w_max.

A robot that never drives backwards has v >= 0 if a >= 0. One that turns at a radius of R at least has R |omega| <= v
if R |b| <= l a (theorem Turning.car). The law takes that as one or two more inequalities (`keep_ahead`), and where its
other tasks come first, or inequalities contradict each other, a command outside makes it stand.
"""

import math

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

# Entries of the numbers of a steering, (6,): hand point l, m (0: no unicycle); largest turning rate, rad/s; half the
# wheel base, m; largest speed of a wheel, m/s; 1 if it never drives backwards, else 0; and then its least turning
# radius, m. inf: no limit.
HAND, TURN, HALF_BASE, WHEEL, FORWARD, RADIUS = 0, 1, 2, 3, 4, 5
NUMBERS = 6
EDGES = 2  # most half-planes that bound the commands that a robot can follow
OUTSIDE_M_S = 1e-12  # a command outside such a half-plane by no more is on its edge but for rounding, m/s
BISECTIONS = 50  # halvings in the search for a share that the wheels can do; the result always can be done


@njit(cache=True)
def chord(a: float, b: float, hand: float, period: float) -> tuple[float, float]:
    """Speed v, m/s, and turning rate omega, rad/s, for a command (a, b), m/s, in the frame of the body."""
    # hand: l, m.
    # period: h, s.
    if b == 0.0:
        return a, 0.0
    beta = math.atan2(b * period, 2.0 * hand + a * period)
    return (a * math.cos(beta) + b * math.sin(beta)) * (beta / math.sin(beta)), 2.0 * beta / period


@njit(cache=True)
def share(a: float, b: float, steering: Array, period: float) -> float:
    """The feasible factor s of a command (a, b), m/s, in the frame of the body: above 0, at most 1."""
    hand, most, factor = steering[HAND], steering[TURN], 1.0
    if most * period < math.pi:
        tangent = math.tan(0.5 * most * period)
        excess = period * (abs(b) - a * tangent)
        if excess > 2.0 * hand * tangent:
            factor = 2.0 * hand * tangent / excess
    if _wheels(factor * a, factor * b, steering, period) <= steering[WHEEL]:
        return factor
    low, high = 0.0, factor
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _wheels(middle * a, middle * b, steering, period) <= steering[WHEEL]:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True)
def _wheels(a: float, b: float, steering: Array, period: float) -> float:
    """Speed of the faster wheel, m/s."""
    v, omega = chord(a, b, steering[HAND], period)
    return abs(v) + abs(omega) * steering[HALF_BASE]


@njit(cache=True)
def steer(velocity: Array, heading: float, steering: Array, period: float) -> tuple[float, float]:
    """Shorten a command (3,), m/s, world frame, in place, for a unicycle with a heading, rad."""
    # Returns the share s that is left of the command, 0 if it stands, and the turning rate, rad/s.
    cos, sin = math.cos(heading), math.sin(heading)
    edge = np.empty(3)
    for side in range(_edges(steering)):
        _edge(heading, steering, side, edge)
        if velocity[0] * edge[0] + velocity[1] * edge[1] < -OUTSIDE_M_S:
            velocity[:] = 0.0
            return 0.0, 0.0
    left = share(velocity[0] * cos + velocity[1] * sin, velocity[1] * cos - velocity[0] * sin, steering, period)
    if left < 1.0:
        for axis in range(3):
            velocity[axis] *= left
    a, b = velocity[0] * cos + velocity[1] * sin, velocity[1] * cos - velocity[0] * sin
    return left, chord(a, b, steering[HAND], period)[1]


@njit(cache=True)
def steer_all(velocity: Array, headings: Array, steering: Array, period: float) -> Array:
    """Shorten the commands (n, 3), m/s, of UGVs with headings (n,), rad, in place; `steering` is (n, 6)."""
    # Returns the shares that are left, (n,); 1 for a UGV that is no unicycle.
    left = np.ones(len(velocity))
    for i in range(len(velocity)):
        if steering[i, HAND] > 0.0:
            left[i] = steer(velocity[i], headings[i], steering[i], period)[0]
    return left


@njit(cache=True)
def _edges(steering: Array) -> int:
    """How many half-planes bound the commands that a robot can follow: 0, 1, or 2 with a least turning radius."""
    if steering[FORWARD] == 0.0:
        return 0
    return 2 if steering[RADIUS] > 0.0 else 1


@njit(cache=True)
def _edge(heading: float, steering: Array, side: int, direction: Array) -> None:
    """Write the unit normal of such a half-plane, for a heading in rad."""
    cos, sin, radius = math.cos(heading), math.sin(heading), steering[RADIUS]
    direction[0], direction[1], direction[2] = cos, sin, 0.0
    if radius > 0.0:
        length = math.hypot(steering[HAND], radius)
        a, b = steering[HAND] / length, (radius if side == 0 else -radius) / length
        direction[0], direction[1] = a * cos - b * sin, a * sin + b * cos


@njit(cache=True)
def keep_ahead(heading: float, steering: Array, normal: Array, bound: Array, retreat: Array, count: int) -> int:
    """Add the inequalities of a robot that never drives backwards to the first `count`; returns how many there are."""
    for side in range(_edges(steering)):
        _edge(heading, steering, side, normal[count])
        bound[count], retreat[count] = 0.0, 0.0
        count += 1
    return count


@njit(cache=True)
def along(base: Array, velocity: Array, heading: float, elapsed: float, hand: float, period: float) -> Array:
    """Axle (3,), m, and heading, rad, of a unicycle within a period: (4,); `velocity` (3,), m/s."""
    # base: where a first-order robot would be that started from the hand point, (3,), m, world frame.
    # elapsed: time since then, s.
    # hand: l, m.
    # period: h, s.
    cos, sin = math.cos(heading), math.sin(heading)
    v, omega = chord(velocity[0] * cos + velocity[1] * sin, velocity[1] * cos - velocity[0] * sin, hand, period)
    half = 0.5 * omega * elapsed
    length = v * elapsed * (math.sin(half) / half if half != 0.0 else 1.0)  # of the chord of the axle's arc
    ahead, left = length * math.cos(half) - hand, length * math.sin(half)
    state = np.empty(4)
    state[0] = base[0] - elapsed * velocity[0] + (ahead * cos - left * sin)
    state[1] = base[1] - elapsed * velocity[1] + (ahead * sin + left * cos)
    state[2] = base[2] - elapsed * velocity[2]
    state[3] = heading + 2.0 * half
    return state


@njit(cache=True)
def heading_after(heading: float, velocity: Array, elapsed: float, hand: float, period: float) -> float:
    """The heading, rad, after a command (3,), m/s, of a time, s, in all a period; arguments as of `along`."""
    cos, sin = math.cos(heading), math.sin(heading)
    a, b = velocity[0] * cos + velocity[1] * sin, velocity[1] * cos - velocity[0] * sin
    return heading + 2.0 * (0.5 * chord(a, b, hand, period)[1] * elapsed)
