"""The pairs of bodies that must keep apart, and their positions and distances during a run.

A barrier is an obstacle or a wall of the arena, of one convex part or many: its distance is the least over its parts.
If it moves, its parts are relative to the origin of its frame, and so are positions of the robot. All positions and
distances for claims are computed here.

A distance that users see is the gap of a pair, beside the gap required: between surfaces, below 0 if the bodies
overlap. `least_gap` and `gap_over_time` are its only sources. Bodies keep distances of a robot's centre from the core
of a barrier (`engines.outlines`) or from the centre of another robot, `Pair.safe_m`. The law keeps `Pair.law_m` between
the points that it steers, which is more if a robot's plant takes room.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import ceil, inf
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.model.plants.budget import AT_REST, Bounds, law_distance, of_views, part_of_gain
from airground_drake.scenario.schema import MAP, Scenario
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.engines.geometry import MERGE_S, Approach, apart_at_least, boxes_of, instant_of, interpolate
from airground_drake.verify.engines.outlines import (
    Away,
    Contacts,
    Cores,
    apart_by_blocks,
    away_from,
    closest,
    least_distances,
    nearest_point,
    over_time,
    within,
)
from airground_drake.verify.pair_kinds import ASYNCHRONOUS, MOVING, apart


class Pair(NamedTuple):
    """A robot, and a barrier or another robot that it must avoid."""

    first: str  # the robot
    second: str  # the barrier or other robot
    required_m: float  # gap to keep: the obstacle's own distance, or else the scenario's of the kind of pair
    radii_m: float  # sum of both radii
    share: float  # part of the avoidance inequality that each robot takes: all beside a barrier, half beside a robot
    reach_m: float  # how far they can approach each other in one control period
    row: int  # first row at which both are present
    last: int  # row up to which both are present
    # Largest speed of the barrier that robots expect; above 0 the robot's law is the passive one.
    speed_m_s: float = 0.0
    more_m: float = 0.0  # distance that the law keeps beyond `safe_m`
    # Sum of both bodies' largest distances from their steered points after a period, including the drift of users'
    # plants.
    cover_m: float = 0.0
    drift_m: float = 0.0  # the part of `more_m` that makes up for missed commands and different views
    views_m: float = 0.0  # the part for different views alone
    error_m: float = 0.0  # sum of the bounds of the errors of the measured positions
    asynchronous: bool = False  # whether each of two UGVs acts on an old position of the other one
    slip_m: float = 0.0  # how much of its command the robot may miss in a control period
    # Duration of commands already given, where the theorem requires a safe start of the bodies, too (they lag, are late
    # or follow the steered point as a trailer); None where it does not.
    under_way_s: float | None = None

    @property
    def rows(self) -> slice:
        return slice(self.row, self.last + 1)

    def other(self, robot: str) -> str:
        """The body that this robot of the pair must avoid."""
        return self.second if robot == self.first else self.first

    @property
    def safe_m(self) -> float:
        """Required distance of the robot's centre from the other's core, m."""
        return self.required_m + self.radii_m

    @property
    def law_m(self) -> float:
        """The law's distance of the robot's steered point from the other's core or steered point, m."""
        return self.safe_m + self.more_m

    def keeps_m(self, period_s: float) -> float:
        """The distance of steered points that robots do not undercut by their own motion in a period, m."""
        if self.error_m and not self.speed_m_s:  # errors may use up the rest of what the law keeps
            return self.safe_m + self.cover_m
        return self.law_m - self.error_m + self.speed_m_s * period_s


class Gap(NamedTuple):
    """The smallest gap of a pair."""

    pair: Pair  # the two bodies
    gap_m: float  # distance of their surfaces; below 0 they overlap
    margin_m: float  # how much more that is than the gap required
    t_s: float  # when, the earliest time
    row: int  # row of the trace that ends the segment on which it was


@per_trace
def pairs_of(trace: Trace) -> tuple[Pair, ...]:
    """All robot/barrier and robot/robot pairs of a run, with the safe distances of its scenario."""
    # Barriers that do not appear before the end are in none.
    #
    # Those of one robot come in the order in which its controller lists them: barriers, then robots in array order.
    return tuple(pair for pair in declared_pairs(trace) if pair.row < len(trace.t))


def declared_pairs(trace: Trace) -> Iterator[Pair]:
    """All robot/barrier and robot/robot pairs, also those with barriers that do not appear before the end."""
    there = {name: (trace.there_from(name), trace.there_until(name)) for name in trace.scenario.barriers}
    return pairs_by(trace.scenario, bounds_of(trace), there, len(trace.t) - 1)


def pairs_by(
    scenario: Scenario, bounds: Mapping[str, Bounds], there: Mapping[str, tuple[int, int]], end: int
) -> Iterator[Pair]:
    """All pairs, by bounds of the robots, the first and last row of each barrier, and the last row of all."""
    period, gain = scenario.control.period_s, scenario.control.avoidance_gain_1_s
    for given in apart(scenario):
        first, second, *_ = given
        passive, share = given.kind == MOVING, 1.0 if second in there else 0.5
        own, other = bounds[first], bounds.get(second, AT_REST)
        speed = scenario.barriers[second].expected_speed_m_s if second in there else 0.0
        reach = (own.speed_m_s + (speed or other.speed_m_s)) * period
        row, last = there.get(second, (0, end))
        safe = given.required_m + sum(given.radii_m)
        part, views_m = part_of_gain(own, other), float(of_views(safe, own, other, gain=gain))
        drawn = own.drawn and own.cover_m > 0.0 and second in there
        needs_start = not passive and (drawn or own.late or other.late)
        yield Pair(
            first, second, given.required_m, sum(given.radii_m), share, reach, row, last, speed,
            more_m=float(law_distance(safe, own, other, gain=gain, passive=passive)) - safe,
            cover_m=sum(plant.rolling_m + plant.drift_m_s * period for plant in (own, other)),
            drift_m=sum(plant.drift_m_s / (gain * part) for plant in (own, other) if plant.drift_m_s) + views_m,
            views_m=views_m,
            error_m=own.error_m + other.error_m,
            asynchronous=given.kind == ASYNCHRONOUS,
            slip_m=own.drift_m_s * period,
            under_way_s=max(own.delay_s, other.delay_s) if needs_start else None,
        )  # fmt: skip


@per_trace
def bounds_of(trace: Trace) -> dict[str, Bounds]:
    robots = trace.scenario.robots
    return {
        name: trace.plant(name).bounds(robots[name].max_speed_m_s)._replace(**trace.scenario.seen(name))
        for name in robots
    }


class Parts(NamedTuple):
    """The convex parts of all barriers of a scenario, m of them in the order of the barriers and their parts."""

    cores: Cores  # (m, ...), world frame; those of a barrier that moves are about its origin
    owner: Indices  # the barrier of each, by its number in the order of `names`, (m,)
    first: Indices  # number of the first part of each barrier
    names: list[str]  # of the barriers


@per_trace
def parts_of(trace: Trace) -> Parts:
    """The convex parts of the barriers, whether the UAV knows them or not."""
    cores = cores_of(trace)
    counts = [len(parts.base) for parts in cores.values()]
    first = np.concatenate([[0], np.cumsum(counts)])[: len(counts)].astype(np.intp)
    return Parts(Cores.joined([*cores.values()]), np.repeat(np.arange(len(counts)), counts), first, [*cores])


@per_trace
def cores_of(trace: Trace) -> dict[str, Cores]:
    cores = dict[str, Cores]()
    for name, barrier in trace.scenario.barriers.items():
        parts, place = convex_parts(barrier), np.array([barrier.position_m or [0.0, 0.0, 0.0]], dtype=np.float64)
        cores[name] = Cores.at(place) if parts is None else Cores.prisms(parts, barrier.height_m)
    return cores


def origin_of(trace: Trace, name: str) -> Array:
    """Where the body of a robot or the origin of a barrier's parts is at the rows, (T, 3), m; 0 for one at rest."""
    if name in trace.robots or trace.scenario.barriers[name].moves:
        return trace.body(name)
    return np.broadcast_to(0.0, (len(trace.t), 3))


def steered(trace: Trace, name: str) -> Array:
    """Where the steered point of a robot or the origin of a barrier's parts is at the rows, (T, 3), m."""
    return trace.position(name) if name in trace.robots else origin_of(trace, name)


def seen_from(trace: Trace, robot: str, other: str) -> Array:
    """Places of a robot's body at the rows as seen from another robot or the origin of a barrier's parts, (T, 3), m."""
    return trace.body(robot) - origin_of(trace, other)


@per_trace
def carried(trace: Trace) -> list[tuple[Indices, Array]]:
    """Indices of static parts, and of the parts of each moving barrier with the positions of its origin."""
    parts, barriers = parts_of(trace), trace.scenario.barriers
    still = np.array([barriers[name].moves is None for name in parts.names], dtype=np.bool_)
    moving = [(np.flatnonzero(parts.owner == k), trace.body(parts.names[k])) for k in np.flatnonzero(~still).tolist()]
    return [(np.flatnonzero(still[parts.owner]), np.broadcast_to(0.0, (len(trace.t), 3))), *moving]


def contacts(trace: Trace, places: Array, rows: Indices, reach: float, *, planar: bool) -> Contacts:
    """Pairs of a position and a part of a barrier within a distance, m; positions (K, 3), m, along a path."""
    # Moving barriers are taken at their places at each of the K rows; absent ones are ignored.
    parts = parts_of(trace)
    near_parts = list[Contacts]()
    for some, origin in carried(trace):
        near = within(parts.cores.take(some), places - origin[rows], reach, planar=planar)
        near_parts.append(near._replace(core=some[near.core]))
    place, core = (np.concatenate([contact[k] for contact in near_parts]) for k in (0, 1))
    distance, normal = (np.concatenate([contact.away[k] for contact in near_parts]) for k in (0, 1))
    first, last = lifetimes(trace)
    there = np.flatnonzero((first[core] <= rows[place]) & (rows[place] < last[core]))
    there = there[np.lexsort([core[there], place[there]])]
    return Contacts(place[there], core[there], Away(distance[there], normal[there]))


@per_trace
def lifetimes(trace: Trace) -> tuple[Indices, Indices]:
    """The first row at which each convex part exists, and the first one after it, (m,)."""
    parts, end = parts_of(trace), len(trace.t) - 1
    first = np.array([trace.there_from(name) for name in parts.names], dtype=np.intp)
    last = np.array([trace.there_until(name) for name in parts.names], dtype=np.intp)
    return first[parts.owner], np.where(last == end, end + 1, last)[parts.owner]


def is_planar(trace: Trace, robot: str) -> bool:
    return robot in trace.ugvs


def pair_of(trace: Trace, first: str, second: str) -> Pair:
    """The pair of two bodies, named in either order."""
    return pairs_of(trace)[numbers_of(trace)[frozenset((first, second))]]


@per_trace
def numbers_of(trace: Trace) -> dict[frozenset[str], int]:
    """The place of each pair in `pairs_of`, by the names of its bodies."""
    return {frozenset((pair.first, pair.second)): k for k, pair in enumerate(pairs_of(trace))}


@per_trace
def least_gap(trace: Trace, pair: Pair) -> Gap:
    """The smallest gap of a pair over continuous time."""
    # It is exact if both bodies move on straight lines between rows, and to `BENT_M` where it is below the one
    # required; else it is a lower bound.
    t = trace.t[pair.rows]
    off_m = off_m_of(trace, pair.first) + off_m_of(trace, pair.second)
    cores = cores_of(trace).get(pair.second, CENTRE)
    way = seen_from(trace, pair.first, pair.second)[pair.rows]
    distance, row, share = closest(cores, way, planar=is_planar(trace, pair.first))
    distance = max(distance - off_m, 0.0) if off_m and cores.are_points else distance - off_m
    t_s = instant_of(t, row, share)
    if off_m and distance < pair.safe_m:
        distance, t_s, row = _least_of_bent(trace, pair, off_m)
    return Gap(pair, distance - pair.radii_m, distance - pair.safe_m, t_s, row + pair.row)


def start_margin(trace: Trace, pair: Pair) -> float:
    """Margin of a pair's bodies to their distance when both first exist, m; inf if none is needed."""
    # Earlier commands move a body with a delay for that time, so its way counts, too.
    if pair.under_way_s is None:
        return inf
    until = trace.t[pair.row] + pair.under_way_s - MERGE_S
    end = min(int(np.searchsorted(trace.t, until)), pair.last)
    if end > pair.row:
        return least_gap(trace, pair._replace(last=end)).margin_m
    return float(gap_over_time(trace, pair)[pair.row]) - pair.required_m


def at_appearance(trace: Trace, gap: Gap) -> bool:
    """Whether the gap of a pair was smallest when its obstacle appeared."""
    return bool(gap.pair.row > 0 and gap.t_s <= trace.t[gap.pair.row])


@per_trace
def steered_margin(trace: Trace, pair: Pair) -> float:
    """The least distance of a pair's steered points minus the law's distance, m."""
    cores = cores_of(trace).get(pair.second, CENTRE)
    way = (trace.position(pair.first) - steered(trace, pair.second))[pair.rows]
    return closest(cores, way, planar=is_planar(trace, pair.first)).distance - pair.law_m


def _least_of_bent(trace: Trace, pair: Pair, off_m: float) -> Approach:
    """The least distance of a pair on curved paths, by dividing segments that may be too near."""
    cores = cores_of(trace).get(pair.second, CENTRE)
    planar = is_planar(trace, pair.first)
    way = seen_from(trace, pair.first, pair.second)[pair.rows]
    beside = cores.take((slice(None), None))
    lower = least_distances(beside, way[:-1], way[1:], planar=planar)[0].min(axis=0) - off_m
    most = min(ceil((off_m / BENT_M) ** 0.5), MOST_PARTS)
    t = trace.t[pair.rows]
    far = np.where(lower < pair.safe_m, inf, lower)  # these segments need not be divided
    k = int(far.argmin())
    best = Approach(float(far[k]), float(t[k]), k + 1)
    for k in sorted(np.flatnonzero(lower < pair.safe_m).tolist(), key=lower.__getitem__):
        if lower[k] > best.distance_m:
            break
        for parts in (min(FEW_PARTS, most), most):  # a few suffice to exclude most segments
            shares = np.linspace(0.0, 1.0, parts + 1)
            places = [bent(trace, name, pair.row + k, shares) for name in (pair.first, pair.second)]
            fine = places[0] - places[1]
            least, where = least_distances(beside, fine[:-1], fine[1:], planar=planar)
            least, where = least.min(axis=0), where[least.argmin(axis=0), np.arange(parts)]
            j = int(np.argmin(least))
            nearest = Approach(
                float(least[j]) - off_m / parts**2, instant_of(t, k + 1, (j + float(where[j])) / parts), k + 1
            )
            if nearest.distance_m > best.distance_m:
                break
        else:
            best = min(best, nearest)
    return best


def bent(trace: Trace, name: str, row: int, shares: Array) -> Array:
    """Positions of a body, or a barrier's origin, at shares (n,) of the time between two rows, (n, 3), m."""
    if name not in trace.robots:
        way = origin_of(trace, name)
        return way[row] + shares[:, None] * (way[row + 1] - way[row])
    ends = slice(row, row + 2)
    return trace.plant(name).between(trace.t[ends], trace.signals(name)[ends], shares)


def to_barrier(trace: Trace, pair: Pair, place: Array) -> float:
    """Distance of a place (3,), m, from the core of the barrier of a pair as it is at the end of the run, m."""
    here = place - origin_of(trace, pair.second)[-1]
    return float(away_from(cores_of(trace)[pair.second], here, planar=is_planar(trace, pair.first)).distance.min())


def place_on_map(trace: Trace, robot: str, t_s: float) -> dict[str, list[float]]:
    """`at_m`: the place of the map, [x, y], m, that is nearest to a robot at a time, s; {} without a map."""
    cores = cores_of(trace).get(MAP)
    if cores is None:
        return {}
    place = interpolate(trace.t, trace.position(robot), t_s)
    return {"at_m": nearest_point(cores, place, planar=is_planar(trace, robot))[:2].tolist()}


def gap_over_time(trace: Trace, pair: Pair) -> Array:
    """The gap of a pair at the rows of a trace, (T,), m; NaN where an obstacle is not there."""
    cores = cores_of(trace).get(pair.second)
    way = seen_from(trace, pair.first, pair.second)
    if cores is None:
        return np.asarray(np.linalg.norm(way, axis=1)) - pair.radii_m
    gaps_m, rows = np.full(len(trace.t), np.nan), pair.rows
    gaps_m[rows] = over_time(cores, way[rows], planar=is_planar(trace, pair.first)) - pair.radii_m
    return gaps_m


def distances_when_there(trace: Trace, robot: str) -> dict[str, float]:
    """Distances, m, of a robot's steered point from the cores of all barriers, by name, at each one's first row."""
    parts, last = parts_of(trace), len(trace.t) - 1
    if not parts.names:
        return {}
    row = np.minimum(lifetimes(trace)[0], last)
    place = trace.position(robot)[row]
    for some, origin in carried(trace):
        place[some] -= origin[row[some]]
    apart = away_from(parts.cores, place, planar=is_planar(trace, robot)).distance
    return dict(zip(parts.names, np.minimum.reduceat(apart, parts.first).tolist(), strict=True))


def are_too_near(trace: Trace, robot: str, places: Array, t_s: float, by_m: float) -> Flags:
    """Positions (K, 3), m, of a steered point that are too near to a barrier by more than `by_m`, (K,)."""
    too_near = np.zeros(len(places), dtype=np.bool_)
    pairs = pairs_beside(trace, robot)
    parts = parts_of(trace)
    row = max(int(np.searchsorted(trace.t, t_s + MERGE_S)) - 1, 0)
    keep = np.array([pairs[name].law_m for name in parts.names])[parts.owner] - by_m
    rows, most = np.full(len(places), row), float(keep.max(initial=0.0))
    near = contacts(trace, places, rows, most, planar=is_planar(trace, robot))
    too_near[near.place[near.away.distance < keep[near.core]]] = True
    return too_near


def pairs_beside(trace: Trace, robot: str) -> dict[str, Pair]:
    """The pairs of a robot by the name of the other body, also those that do not appear before the end."""
    return _beside(trace)[robot]


@per_trace
def _beside(trace: Trace) -> dict[str, dict[str, Pair]]:
    beside = {name: dict[str, Pair]() for name in trace.robots}
    for pair in declared_pairs(trace):
        beside[pair.first][pair.second] = pair
        if pair.second in beside:
            beside[pair.second][pair.first] = pair
    return beside


@per_trace
def apart_of(trace: Trace) -> Array:
    """A lower bound of the distance of each pair, as of `Pair.safe_m`, over the run: (P,), m, as in `pairs_of`."""
    # Obstacles count as present all the time.
    robots, parts = trace.robots, parts_of(trace)
    off = {robot: off_m_of(trace, robot) for robot in robots}
    bounds_m = dict[tuple[str, str], float]()
    for robot in robots:
        apart, place = np.empty(len(parts.owner)), trace.body(robot)
        for some, origin in carried(trace):
            apart[some] = apart_by_blocks(parts.cores.take(some), place - origin).min(axis=1) - off[robot]
        least = np.minimum.reduceat(apart, parts.first) if len(apart) else apart
        bounds_m |= {(robot, name): bound for name, bound in zip(parts.names, least.tolist(), strict=True)}
    first, second = np.triu_indices(len(robots), 1)
    between = apart_at_least(boxes_of(np.stack([trace.body(robot) for robot in robots])), first, second)
    for bound, i, j in zip(between.tolist(), first.tolist(), second.tolist(), strict=True):
        bounds_m[robots[i], robots[j]] = bound - (off[robots[i]] + off[robots[j]])
    return np.array([bounds_m[pair.first, pair.second] for pair in pairs_of(trace)])


@per_trace
def off_m_of(trace: Trace, name: str) -> float:
    """Largest deviation of a body from the straight line between two rows, m."""
    if name not in trace.robots:
        return 0.0
    return float(trace.plant(name).bends_m(trace.t, trace.signals(name)).max(initial=0.0))


def least_of(bounds: Array, most: int, value: Callable[[int], float]) -> list[int]:
    """Indices of the smallest of K values, sorted; lower `bounds` (K,) avoid computing most values."""
    if len(bounds) <= most:
        return list(range(len(bounds)))
    enough = max(value(int(k)) for k in np.argsort(bounds, kind="stable")[:most])
    return sorted(sorted(np.flatnonzero(bounds <= enough).tolist(), key=value)[:most])


def preset_of(trace: Trace, ugv: str) -> tuple[Array, float]:
    """Corners of a UGV's preset trajectory, (m, 3), m, and its speed along them, m/s."""
    preset = trace.scenario.ugvs[ugv].preset
    return np.asarray(preset.waypoints_m, dtype=np.float64), preset.speed_m_s


def snapshot(trace: Trace, names: Iterable[str], t_s: float) -> dict[str, Any]:
    """Positions of the robots among `names` at a time, and their velocities just after it."""
    # For a barrier it is the point of its core nearest to the first of these robots.
    t, given = trace.t, list(names)
    row = min(int(np.searchsorted(t, t_s + MERGE_S)), len(t) - 1)
    moving = [name for name in given if name in trace.robots]
    places = {name: interpolate(t, trace.body(name), t_s) for name in sorted(moving)}
    fixed = dict[str, list[float]]()
    for name, cores in cores_of(trace).items():
        if name in given and moving:
            origin = interpolate(t, origin_of(trace, name), t_s)
            there = nearest_point(cores, places[moving[0]] - origin, planar=is_planar(trace, moving[0]))
            fixed[name] = (origin + there).tolist()
    return {
        "positions_m": fixed | {name: place.tolist() for name, place in places.items()},
        "velocities_m_s": {name: trace.command(name)[row].tolist() for name in sorted(moving)},
    }


CENTRE = Cores.at(np.zeros((1, 3)))  # the core of a robot, as seen from its place
# Segments of curved motion that may be too near are divided until they are straight within this, m.
BENT_M = 1e-10
MOST_PARTS = 5000  # parts of such a segment at most
FEW_PARTS = 50  # parts into which it is divided first
# A distance may be this much below the safe one, m: the controller steers *onto* the safe distance, and sums of some
# thousand rounded steps err by 1e-12 m. The reported margin does not contain it.
DISTANCE_TOLERANCE_M = 1e-9
MOST_LISTED = 300  # pairs that the evidence of a claim lists at most: those of least margin
