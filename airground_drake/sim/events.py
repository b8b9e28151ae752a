"""Events of a run: trigger, release, proposal, accept, refuse, over, arrival, collision.

`over` means that a UGV has completed a proposal and follows its own task again; it is not a refusal.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from airground_drake.base.arrays import Array, Indices
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.motion import SAME_S, PeriodMotion
from airground_drake.model.bodies.world import Body
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.encounter import least_apart
from airground_drake.scenario.schema import MAP
from airground_drake.scenario.world import make_world
from airground_drake.sim.collisions import first_collisions
from airground_drake.sim.trace import Trace
from airground_drake.ugv.reasons import OVER

FEW = 8  # a shape of so many convex parts is first looked at as a whole: most robots come near to nothing
ROUNDING_M = 1e-9  # what such a look leaves for rounding, m


def extract(trace: Trace) -> list[dict[str, Any]]:
    """All events of a run in the order of time, from its states, proposals and decisions."""
    t, order = trace.t, {robot: k for k, robot in enumerate(trace.robots)}
    events: list[dict[str, Any]] = []

    def add(time_s: float, robot: str, kind: str, **more: Any) -> None:
        where = [float(np.interp(time_s, t, axis)) for axis in trace.body(robot).T]
        events.append({"t_s": float(time_s), "robot": robot, "kind": kind, "position_m": where, **more})

    for ugv in trace.ugvs:
        for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
            for when in np.unique(trace.column(f"{ugv}.{name}")):
                if when >= 0.0:
                    add(when, ugv, kind)
    sent = (trace.proposals[name].tolist() for name in ("robot", "issued_s", "policy"))
    for ugv, issued, policy in zip(*sent, strict=True):
        add(issued, ugv, "proposal", policy=policy)
    previous: dict[int, str] = {}
    columns = ("t_s", "robot", "policy", "number", "decision", "reason", "status")
    decided = (trace.decisions[name].tolist() for name in columns)
    for when, robot, policy, number, decision, reason, status in zip(*decided, strict=True):
        if previous.get(number) != decision:
            previous[number] = decision
            add(when, robot, OVER if reason == OVER else decision, policy=policy, status=status)
    _add_collisions(trace, add)
    hits = first_collisions(events)
    for robot in trace.robots:
        _add_arrival(trace, robot, trace.rows_before(hits[robot]["t_s"] if robot in hits else np.inf), add)
    return sorted(events, key=lambda event: (event["t_s"], order[event["robot"]]))


def unheard(trace: Trace) -> Iterator[tuple[str, float, int]]:
    """What UGVs execute although no such proposal has arrived: the UGV, the time, s, and the number."""
    sent = trace.messages[trace.messages["kind"] == "proposal"].sort_values("received_s")
    for ugv in trace.ugvs:
        numbers, t_s = trace.samples[f"{ugv}.executing"], trace.samples["t_s"]
        arrived_s = sent[sent["receiver"] == ugv].drop_duplicates("about").set_index("about")["received_s"]
        early = (numbers >= 0) & ~(numbers.map(arrived_s) <= t_s + SAME_S)
        yield from ((ugv, float(t_s[k]), int(numbers[k])) for k in np.flatnonzero(early))


def _add_arrival(trace: Trace, robot: str, rows: int, add: Any) -> None:
    """Add the time from which the robot stays within the arrival tolerance of its target, within the first rows."""
    scenario = trace.scenario
    target, tolerance_m = scenario.robots[robot].target_m, scenario.arrival_tolerance_m
    first = arrival_row(trace.position(robot)[:rows], target, tolerance_m)
    if first is not None:
        add(trace.t[first], robot, "arrival")


def arrival_row(position: Array, target: Sequence[float], tolerance_m: float) -> int | None:
    """The row from which a robot at (T, 3), m, stays within the tolerance of its target; None without one."""
    away = np.linalg.norm(position - np.array(target), axis=1)
    outside = np.flatnonzero(away > tolerance_m)
    first = int(outside[-1]) + 1 if len(outside) else 0
    return first if first < len(away) else None


def _add_collisions(trace: Trace, add: Any) -> None:
    """Add each robot's visits within collision distance of obstacles and of robots later in the list."""
    world, collision_m = make_world(trace.scenario), trace.scenario.safe_distance.collision_m
    ways = [_way(trace, body) for body in world.bodies]
    low, high = (np.array(corners) for corners in zip(*map(_box, ways, world.bodies), strict=True))
    for i, (own, radius) in enumerate(zip(world.bodies[world.select(*ROBOTS)], world.radius, strict=True)):
        within = collision_m + float(radius)
        gap = np.maximum(np.maximum(ways[i].box[0] - high[i + 1 :], low[i + 1 :] - ways[i].box[1]), 0.0)
        near = i + 1 + np.flatnonzero(np.linalg.norm(gap, axis=1) <= within)
        for k in sorted(near.tolist(), key=lambda k: world.bodies[k].kind in ROBOTS):
            body = world.bodies[k]
            role = "other" if body.kind in ROBOTS else "obstacle"
            first, last = trace.there_from(body.name), trace.there_until(body.name)
            apart = ways[i].seen_from(ways[k])
            apart = apart._replace(start=apart.start[first:last], end=apart.end[first:last])
            planar = own.mobility[2] == 0.0
            for row in first + visits(apart, body.shape, within, planar) if first < last else ():
                at = {"at_m": _nearest(trace, own.name, body, int(row))} if body.name == MAP else {}
                add(trace.t[row], own.name, "collision", **{role: body.name}, **at)


def _nearest(trace: Trace, robot: str, body: Body, row: int) -> list[float]:
    """The place of a body at rest that is nearest to a robot at a row, [x, y], m."""
    place = trace.position(robot)[row]
    apart = convex.distances(body.shape, place, True) - body.shape[:, outline.RADIUS]
    point: Array = convex.nearest_points(body.shape[[apart.argmin()]], place[None])[0, 0]
    return point[:2].tolist()


def _way(trace: Trace, body: Body) -> PeriodMotion:
    """Straight motion of a body's origin between the rows: (T - 1, 3), or (3,) if it is static."""
    if body.plant is None:
        return PeriodMotion(body.start_m, body.start_m)
    position = trace.body(body.name)
    return PeriodMotion(position[:-1], position[1:])


def _box(way: PeriodMotion, body: Body) -> tuple[Array, Array]:
    """Two opposite corners, (3,), m, of a box around a body that moves."""
    (start, end), (low, high) = way.box, outline.box(body.shape)
    return start + low, end + high


def visits(apart: PeriodMotion, shape: Array, within: float, planar: bool) -> Indices:
    """Rows, (K,), at or after which a centre comes within a distance of a shape."""
    # apart: (T - 1, 3), m; shape: (k, W); within: m
    places = np.concatenate([apart.start, apart.end[-1:]])
    reaches = within + apart.off_m + shape[:, outline.RADIUS] + ROUNDING_M
    comes_near = (least_apart(row, places, planar) < reach for row, reach in zip(shape, reaches, strict=True))
    if len(shape) <= FEW and not any(comes_near):
        return np.empty(0, dtype=np.intp)
    near, passes = np.zeros(len(places), dtype=bool), np.zeros(len(apart.start), dtype=bool)
    longest = float(np.linalg.norm(apart.end - apart.start, axis=1).max())
    far = 1.001 * (within + apart.off_m + longest + shape[:, outline.RADIUS] + shape[:, outline.EXTENT])
    nearby = cKDTree(places[:, :2]).query_ball_point(shape[:, outline.MIDDLE : outline.EXTENT], far)
    for row, indices in zip(shape, nearby, strict=True):
        if not indices:
            continue
        some, reach = np.array(indices), within + row[outline.RADIUS]
        near[some] |= convex.within(row[None], places[some], np.nextafter(reach, -np.inf), planar)[:, 0]
        some = some[some < len(passes)]
        least = convex.approaches(row, apart.start[some], apart.end[some], planar)[0]
        passes[some] |= least < reach + apart.off_m
    enters = near & ~np.append(False, near[:-1])
    return np.flatnonzero(enters | np.append(passes & ~near[:-1] & ~near[1:], False))
