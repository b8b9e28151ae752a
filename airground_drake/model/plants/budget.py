"""The distance budget: the distance that the law must keep so that the bodies keep the promised distance.

The law steers a point. The theorems of `verify/coq/` (Budget, Plants, Pieces, Passive) bound the distance of the body
from this point, and the cost in distance. For two bodies that keep d, with `Bounds` and the gain A of the law,

    d_law = d + b + covers + dips + (drift_i + drift_j) / A,

where b is the cost of delays and lags. With V the slower speed limit, V_rel the sum of both, and any tau >= 0,

    delay   d' = d + V |delta_i - delta_j|
    lag     d' + b = |tau_i - tau| V_i + |tau_j - tau| V_j + sqrt(d'^2 + (tau V_rel)^2).

Beside a static set a delay costs nothing and a lag sqrt(d^2 + (tau V)^2) - d. Beside an obstacle that may move the law
only promises that the robot does not come nearer by its own motion; there lag and delay count as covers, tau V and
delta V.

If the law acts on measured positions with errors of at most e_i and e_j, then with e = e_i + e_j (Budget.budget_always)

    d_law = e + sqrt((d + b + covers + dips)^2 + e^2) + (drift_i + drift_j) / A',

if e (1 - A' h) <= A' h (d_law - e - drifts / A'), where the last factor is the distance of the points at the samples.
Beside a static set A' = A. One of two robots may have to stand, because measured inequalities contradict one another or
because it misses the other's position: then the pair meets the law with A' = A / 2 (theorem Budget.one_stands).

Two robots that do not share measured positions, but measure each other, see the pair in two directions. With m the
square root above and V the larger speed limit, this costs 2 V e / ((m - e) A') (theorem Budget.own_views).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array


class Bounds(NamedTuple):
    """Bounds of a body's deviation from its steered point."""

    cover_m: float = 0.0  # of the body from the steered point
    dip_m: float = 0.0  # of the steered point from the straight line of its command within a period
    drift_m_s: float = 0.0  # by which the steered point may miss its command; it adds up over periods
    lag_s: float = 0.0  # time constant with which the body's velocity follows the command
    delay_s: float = 0.0  # time after which a command takes effect
    speed_m_s: float = 0.0  # largest command
    # Whether the body is drawn after the steered point, as a trailer: then beside a set at rest a cover l costs
    # sqrt(d^2 + l^2) - d (theorem Plants.forwards).
    drawn: bool = False
    # Error bound of the measured position of the steered point.
    error_m: float = 0.0
    may_stand: bool = False  # whether the robot may stand because it misses another one's position
    own_views: bool = False  # whether the robot acts on its own measurements of other robots

    @property
    def exact(self) -> bool:
        """Whether body, steered point and measured position coincide, and commands are followed exactly."""
        return not (any(self[:5]) or self.error_m)

    @property
    def late(self) -> bool:
        """Whether the body still follows earlier commands."""
        return self.lag_s > 0.0 or self.delay_s > 0.0

    @property
    def rolling_m(self) -> float:
        """Largest distance of the body from the steered point, without drift, m."""
        return self.cover_m + self.dip_m + (self.lag_s + self.delay_s) * self.speed_m_s


AT_REST = Bounds()  # of a set that does not move


class Cost(NamedTuple):
    """A term of the budget: its cause, its body (0, 1; -1: both), and its size in m."""

    term: str
    of: int
    metres: float


def law_distance(
    distance: Array | float, one: Bounds, other: Bounds = AT_REST, *, gain: float, passive: bool = False
) -> Array | float:
    """Distance that the law must keep between steered points so that bodies keep `distance`, m, of any shape."""
    # gain: 1/s
    # passive: beside an obstacle that may move.
    if one.exact and other.exact:
        return distance
    kept = distance
    if not passive:
        kept = kept + _delay(one, other)
        kept = _lagging(kept, one, other)
    if _draws(one, other, passive=passive):
        kept = np.hypot(kept, one.cover_m)
    added = list(_added(one, other, gain=gain, passive=passive))
    error = one.error_m + other.error_m
    if not error:
        return kept + sum(cost.metres for cost in added)
    kept = kept + sum(cost.metres for cost in added if cost.term != "drift")
    drifts = sum(cost.metres for cost in added if cost.term == "drift")
    return error + np.hypot(kept, error) + drifts + of_views(distance, one, other, gain=gain)


def of_views(distance: Array | float, one: Bounds, other: Bounds = AT_REST, *, gain: float) -> Array | float:
    """Cost of the different directions that two robots see if each measures the other, m; `distance` of bodies in m."""
    error = one.error_m + other.error_m
    if not (error and one.own_views and other.own_views):
        return 0.0
    sharing = (bounds._replace(drift_m_s=0.0, own_views=False) for bounds in (one, other))
    least = np.asarray(law_distance(distance, *sharing, gain=gain)) - 2.0 * error  # that either measures
    speed = max(one.speed_m_s, other.speed_m_s)
    cost = 2.0 * speed * error / np.where(least > 0.0, least, np.inf) / (gain * part_of_gain(one, other))
    return cost if cost.ndim else float(cost)


def part_of_gain(one: Bounds, other: Bounds = AT_REST) -> float:
    """A' / A of a pair: a half where one of two robots may have to stand, else 1."""
    stands = one.error_m + other.error_m > 0.0 or one.may_stand or other.may_stand
    return 0.5 if stands and other != AT_REST else 1.0


def least_gain(distance: float, one: Bounds, other: Bounds = AT_REST) -> float:
    """The least A h for which the theorem covers the pair's position errors; `distance` of bodies in m."""
    error = one.error_m + other.error_m
    undrifting = (bounds._replace(drift_m_s=0.0, own_views=False) for bounds in (one, other))
    kept = float(law_distance(distance, *undrifting, gain=1.0)) - error
    return error / (error + kept) / part_of_gain(one, other) if error else 0.0


def kept_distance(points: float, one: Bounds, other: Bounds = AT_REST, *, gain: float, passive: bool = False) -> float:
    """Lower bound of the bodies' distance if steered points keep `points`, m: the inverse of `law_distance`."""
    # Without `of_views`, which depends on the promised distance.
    # -inf where nothing is promised: within tau V of a set, say, the body may be anywhere beside it.
    added = list(_added(one, other, gain=gain, passive=passive))
    if error := one.error_m + other.error_m:
        drifts = sum(cost.metres for cost in added if cost.term == "drift")
        points = _leg(points - drifts - error, error)
        added = [cost for cost in added if cost.term != "drift"]
    left = points - sum(cost.metres for cost in added)
    if passive:
        return left
    if _draws(one, other, passive=passive):
        left = _leg(left, one.cover_m)
    if not (one.lag_s or other.lag_s):
        return left - _delay(one, other)
    choices = (one.lag_s,) if other == AT_REST else (0.0, one.lag_s, other.lag_s)
    closing = one.speed_m_s + other.speed_m_s
    return max(_leg(left - _apart(one, other, tau), tau * closing) for tau in choices) - _delay(one, other)


def _leg(hypotenuse: float, leg: float) -> float:
    """A lower bound of the other leg of a right-angled triangle; -inf if the hypotenuse is too short."""
    if leg == 0.0:
        return hypotenuse
    if hypotenuse < leg:
        return -math.inf
    return max(math.sqrt((hypotenuse - leg) * (hypotenuse + leg)) * (1.0 - 1e-15), 0.0)


def costs(distance: float, one: Bounds, other: Bounds = AT_REST, *, gain: float, passive: bool = False) -> list[Cost]:
    """The positive terms that `law_distance` adds to a distance, m, in order."""
    terms = list(_added(one, other, gain=gain, passive=passive))
    if not passive:
        delay = _delay(one, other)
        lag = float(_lagging(distance + delay, one, other)) - (distance + delay)
        terms += [Cost("delay", -1, delay), Cost("lag", -1, lag)]
    if _draws(one, other, passive=passive):
        terms.insert(0, Cost("cover", 0, math.hypot(distance, one.cover_m) - distance))
    if error := one.error_m + other.error_m:
        kept = distance + sum(cost.metres for cost in terms if cost.term != "drift")
        views = float(of_views(distance, one, other, gain=gain))
        terms += [Cost("error", -1, error + math.hypot(kept, error) - kept), Cost("views", -1, views)]
    return [cost for cost in terms if cost.metres > 0.0]


def _added(one: Bounds, other: Bounds, *, gain: float, passive: bool) -> Iterator[Cost]:
    """The terms that do not depend on the distance, without delays."""
    gain *= part_of_gain(one, other)
    for k, bounds in enumerate((one, other)):
        yield Cost("cover", k, 0.0 if k == 0 and _draws(one, other, passive=passive) else bounds.cover_m)
        yield Cost("dip", k, bounds.dip_m)
        yield Cost("drift", k, bounds.drift_m_s / gain if bounds.drift_m_s else 0.0)
        if passive:
            yield Cost("lag", k, bounds.lag_s * bounds.speed_m_s)
            yield Cost("delay", k, bounds.delay_s * bounds.speed_m_s)


def _draws(one: Bounds, other: Bounds, *, passive: bool) -> bool:
    """Whether the first body trails its steered point beside a static set."""
    return one.drawn and other == AT_REST and not passive


def _delay(one: Bounds, other: Bounds) -> float:
    """Cost of different delays, m. A static set counts as having the robot's delay, since its speed is 0."""
    return min(one.speed_m_s, other.speed_m_s) * abs(one.delay_s - other.delay_s)


def _lagging(distance: Array | float, one: Bounds, other: Bounds) -> Array | float:
    """The distance of steered points for a distance of lagging bodies, m: the least over tau = 0, tau_i and tau_j."""
    if not (one.lag_s or other.lag_s):
        return distance
    closing = one.speed_m_s + other.speed_m_s
    distances = [
        _apart(one, other, tau) + np.sqrt(np.square(distance) + (tau * closing) ** 2)
        for tau in (0.0, one.lag_s, other.lag_s)
    ]
    least: Array | float = np.minimum.reduce(distances)
    return least


def _apart(one: Bounds, other: Bounds, tau: float) -> float:
    """Cost of lags that differ from tau, m."""
    return abs(one.lag_s - tau) * one.speed_m_s + abs(other.lag_s - tau) * other.speed_m_s
