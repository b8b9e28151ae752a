"""What comes of a proposal and of its refusal, rolled out again from a trace: method (d)'s usefulness, with own code.

Both choices of one decision side by side, in plain numpy. The way that is left is found on another graph than the
gatekeeper's: between points all around the safe circles, which is longer by a part of a thousandth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import dijkstra

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import corner_times, interpolate, travelled
from airground_drake.verify.runs.control_law import Asked, avoiding, inequalities, intervened, tracking
from airground_drake.verify.runs.pairs import Pair, pairs_of, radii_of
from airground_drake.verify.runs.proposals import Sent

STILL_M = 0.05
"""Less than this within the last second is at rest, m."""
AROUND = 48
"""Points around each safe circle."""
AT_ONCE = 5_000_000
"""Coordinates of what decisions that are rolled out side by side keep away from: they have to fit into the memory."""
FAR_M = 1e9
"""A coordinate beyond every sensing range."""
NONE = np.empty(0), np.empty(0), np.empty(0)
Key = tuple[str, float, float]
"""Of a decision: UGV, time, and time of issue of the proposal, s."""
MOST_CLAIMED = 64
"""Obstacles of a message that a UGV takes into account."""


class Foreseen(NamedTuple):
    """What comes of a choice: places (S + 1, 3), m, whether it stalls, (25) along it, m^2 s, and the way left, m.

    `least_left_m` and `most_left_m` are bounds of the latter.
    """

    places_m: Array
    stalls: bool
    integral_m2_s: float
    least_left_m: float
    most_left_m: float


def foreseen(trace: Trace, given: dict[str, Any], sent: Sequence[Sent]) -> tuple[Foreseen, Foreseen]:
    """What comes of refusing and of accepting, for the first decision about a proposal.

    Args:
        trace: the run.
        given: the decision's row.
        sent: all proposals.

    Raises:
        TraceError: if the decision is on a proposal that was not sent.
    """
    known = trace.derived("foreseen", lambda: _all_foreseen(trace, sent))
    key = str(given["robot"]), float(given["t_s"]), float(given["issued_s"])
    if key not in known:
        known[key] = _rolled_out(trace, [_beginning(trace, *key, sent)])[0]
    return known[key]


def _all_foreseen(trace: Trace, sent: Sequence[Sent]) -> dict[Key, tuple[Foreseen, Foreseen]]:
    """What comes of either choice of all decisions for which that was recorded, many side by side."""
    rows = trace.decisions[trace.decisions["accept_stalls"] >= 0.0]
    columns = (rows[name].tolist() for name in ("robot", "t_s", "issued_s"))
    keys = [(str(robot), float(t), float(issued)) for robot, t, issued in zip(*columns, strict=True)]
    found, begun = dict[Key, tuple[Foreseen, Foreseen]](), dict[Key, Beginning]()
    for k, key in enumerate(keys):
        begun[key] = _beginning(trace, *key, sent)
        if k + 1 == len(keys) or len(begun) * max(each.points.size for each in begun.values()) > AT_ONCE:
            found |= dict(zip(begun, _rolled_out(trace, list(begun.values())), strict=True))
            begun = {}
    return found


class Beginning(NamedTuple):
    """What a decision's roll-outs begin with; S is the number of periods, K that of points to keep away from.

    Attributes:
        here: (3,), m.
        preset: at the control samples, (S + 1, 3), m.
        wanted: where the proposed motion is, (S + 1, 3), m.
        chosen: its directions, (3, 3).
        limit: speed limit, m/s.
        periods: for which the proposal is executed.
        settled: periods after which it is over when nothing moves any more.
        points: if it is refused and if it is accepted, (2, S + 1, K, 3), m.
        safe: distances to keep, (K,), m.
        share: of the inequalities, (K,).
        discs: how many of the points are obstacles: they come first.
        goal: (3,), m.
    """

    here: Array
    preset: Array
    wanted: Array
    chosen: Array
    limit: float
    periods: int
    settled: int
    points: Array
    safe: Array
    share: Array
    discs: int
    goal: Array


def _beginning(trace: Trace, robot: str, t: float, issued: float, sent: Sequence[Sent]) -> Beginning:
    scenario, gate, h = trace.scenario, trace.scenario["gatekeeper"], trace.scenario["control"]["period_s"]
    on = [one for one in sent if (one.ugv, one.issued_s) == (robot, issued)]
    if not on:
        raise TraceError(f"the decision of {robot} at t = {t} s is on no proposal that was sent")
    spec = scenario["ugvs"][robot]
    corners, speed = np.asarray(spec["preset"]["waypoints_m"], dtype=np.float64), float(spec["preset"]["speed_m_s"])
    arrives = float(corner_times(corners, speed)[-1]) if len(corners) > 1 else 0.0
    longest = gate["longest_s"]
    until = min(float(on[0].times_s[-1]), t + longest)
    ends = min(max(until, arrives), t + longest) + gate["settling_s"]
    after = h * np.arange(np.ceil((ends - t) / h) + 1.0)
    discs, distances = known_discs(trace, robot, t, on[0])
    pairs = [pair for pair in _among_robots(trace) if robot in (pair.first, pair.second)]
    others = [_other(trace, robot, t, after, pair, sent) for pair in pairs]
    fixed = np.broadcast_to(discs, (2, len(after), *discs.shape))
    moving = np.array([each[0] for each in others]).reshape(len(others), 2, len(after), 3)
    settled = max(until, arrives, t + gate["horizon_s"], *(end for _, _, _, end in others))
    return Beginning(
        here=interpolate(trace.t, trace.position(robot), t),
        preset=travelled(corners, speed, t + after),
        wanted=on[0].place(t + after),
        chosen=on[0].chosen,
        limit=float(spec["max_speed_m_s"]),
        periods=max(0, int(np.ceil((until - t) / h - 1e-9))),
        settled=round(np.ceil((settled - t) / h - 1e-9)),
        points=np.concatenate([fixed, np.moveaxis(moving, 0, 2)], axis=2),
        safe=np.array([*distances, *(each[1] for each in others)]),
        share=np.array([1.0] * len(discs) + [each[2] for each in others]),
        discs=len(discs),
        goal=corners[-1],
    )


def _rolled_out(trace: Trace, begun: Sequence[Beginning]) -> list[tuple[Foreseen, Foreseen]]:
    """Both choices of B decisions side by side: 2 B roll-outs, first all that refuse."""
    scenario, control, h = trace.scenario, trace.scenario["control"], trace.scenario["control"]["period_s"]
    lasting = np.tile([len(each.preset) - 1 for each in begun], 2)
    steps, most = int(lasting.max()), max(len(each.safe) for each in begun)
    preset, wanted = (np.stack([_lengthened(part, steps) for part in parts]) for parts in zip(
        *((each.preset, each.wanted) for each in begun), strict=True))  # fmt: skip
    points = np.stack([_padded(each.points[choice], steps, most) for choice in (0, 1) for each in begun])
    safe, share = (np.tile([np.pad(getattr(each, name), (0, most - len(each.safe))) for each in begun], (2, 1))
                   for name in ("safe", "share"))  # fmt: skip
    preset, wanted, goal, place = (np.concatenate([part, part]) for part in (
        preset, wanted, np.stack([each.goal for each in begun]), np.stack([each.here for each in begun])))  # fmt: skip
    chosen = np.stack([each.chosen for each in begun])
    limit = np.tile([each.limit for each in begun], 2)
    settled, second = np.tile([each.settled for each in begun], 2), max(1, round(1.0 / h))
    periods = np.array([0] * len(begun) + [each.periods for each in begun])
    rates, wishes = (np.diff(part, axis=1) / h for part in (preset, wanted))
    ways, done, earliest = [place], lasting.copy(), int(settled.min())
    for k in range(steps):
        around = inequalities(place, points[:, k], safe, share, control, planar=True)
        task = tracking(place, preset[:, k], rates[:, k], control["motion_gain_1_s"], limit)
        asked = np.flatnonzero(k < periods)
        if asked.size:
            wish = Asked(wanted[asked, k], wishes[asked, k], chosen[asked - len(begun)])
            gain = control["intervention_gain_1_s"]
            task[asked] = intervened(place[asked], task[asked], wish, gain, limit[asked])
        place = place + h * avoiding(task, around, trace.meta["composition"], planar=True)
        ways.append(place)
        if k < earliest:
            continue
        home = np.linalg.norm(goal - place, axis=1) < scenario["arrival_tolerance_m"]
        moved = np.linalg.norm(place - ways[k + 1 - second], axis=1) if k + 1 >= second else np.full(len(place), np.inf)
        resting = (home | (moved < 0.1 * STILL_M)) & (k >= settled)
        done = np.where(resting, np.minimum(done, k + 1), done)
        if (done <= k + 1).all():
            break
    way, found = np.array(ways), []
    away = np.square(preset.swapaxes(0, 1)[1 : len(way)] - way[1:]).sum(axis=2)
    integral = np.concatenate([np.zeros((1, len(place))), np.cumsum(h * away, axis=0)])
    for row, each in enumerate(begun):
        known = each.points[0, 0, : each.discs], each.safe[: each.discs]
        both = [
            _concluded(way[: done[b] + 1, b], float(integral[done[b], b]), each.goal, *known, scenario, h)
            for b in (row, row + len(begun))
        ]
        found.append((both[0], both[1]))
    return found


def _lengthened(places: Array, steps: int) -> Array:
    """(S + 1, 3) to (steps + 1, 3) by staying at the end: what comes of that is not looked at."""
    return np.concatenate([places, np.repeat(places[-1:], steps + 1 - len(places), axis=0)])


def _padded(points: Array, steps: int, most: int) -> Array:
    """(S + 1, K, 3) to (steps + 1, most, 3), with points out of sight."""
    found = np.full((steps + 1, most, 3), FAR_M)
    found[: points.shape[0], : points.shape[1]] = points
    return found


def _among_robots(trace: Trace) -> list[Pair]:
    robots = set(trace.robots)
    return trace.derived("robots", lambda: [pair for pair in pairs_of(trace) if pair.second in robots])


def _concluded(
    places: Array, integral: float, goal: Array, discs: Array, distances: Array, scenario: dict[str, Any], h: float
) -> Foreseen:
    end = places[-1]
    if np.linalg.norm(end - goal) <= scenario["arrival_tolerance_m"]:
        return Foreseen(places, False, integral, 0.0, 0.0)
    before = places[max(0, len(places) - 1 - max(1, round(1.0 / h)))]
    stalls = bool(np.linalg.norm(end - before) < STILL_M)
    least, most = bounds_of_way_left(end, goal, discs, distances)
    return Foreseen(places, stalls, integral, least, most)


def known_discs(trace: Trace, robot: str, t: float, on: Sent) -> tuple[Array, Array]:
    """Obstacles that a UGV has sensed up to a time, and those of the message that it would not sense.

    Of the latter no more than the `MOST_CLAIMED` nearest, and none with a negative radius.

    Returns:
        Centres, (k, 3), and the distances that the UGV keeps from them, (k,), m.
    """
    sensing, gate_s = trace.scenario["control"]["sensing_range_m"], trace.scenario["gatekeeper"]["period_s"]
    samples = gate_s * np.arange(round(t / gate_s) + 1.0)
    was = interpolate(trace.t, trace.position(robot), np.minimum(samples, t))
    places = [o["position_m"] for o in trace.scenario["obstacles"].values()]
    obstacles = np.array(places, dtype=np.float64).reshape(-1, 3)
    seen = (np.linalg.norm(was[:, None] - obstacles, axis=2) <= sensing).any(axis=0)
    hidden = np.linalg.norm(on.mapped_m - was[-1], axis=1) > sensing
    told = np.column_stack([on.mapped_m, on.mapped_radius_m])[hidden & (on.mapped_radius_m >= 0.0)]
    apart = np.linalg.norm(told[:, None, :3] - obstacles[seen], axis=2)
    new = told[(apart > 1e-9).all(axis=1)]
    order = np.linalg.norm(new[:, :3] - was[-1], axis=1).argsort(kind="stable")
    radius = radii_of(trace)
    own = np.array([radius[name] for name in trace.scenario["obstacles"]])
    known = np.concatenate([np.column_stack([obstacles, own])[seen], new[order.argsort() < MOST_CLAIMED]])
    return known[:, :3], trace.scenario["safe_distance"]["obstacle_m"] + (radius[robot] + known[:, 3])


def _other(
    trace: Trace, robot: str, t: float, after: Array, pair: Any, sent: Sequence[Sent]
) -> tuple[tuple[Array, Array], float, float, float]:
    """Where another robot is predicted to be, (S + 1, 3), m; its safe distance, its share, when its motion is over.

    Twice: if the proposal is refused, and if it is accepted. What it has not accepted yet counts in the latter only.
    """
    other = pair.second if pair.first == robot else pair.first
    row = min(int(np.searchsorted(trace.t, t - TIME_TOLERANCE_S)), len(trace.t) - 1)
    place, velocity = interpolate(trace.t, trace.position(other), t), trace.command(other)[row]
    coasting = place + np.minimum(after, trace.scenario["gatekeeper"]["horizon_s"])[:, None] * velocity
    asked, accepted = asked_of(trace, other, t, sent)
    if asked is None:
        return (coasting, coasting), pair.safe_m, pair.share, -np.inf
    goes = asked.place(t + after) + np.exp(-after)[:, None] * (place - asked.place(t))
    return (goes if accepted else coasting, goes), pair.safe_m, pair.share, float(asked.times_s[-1])


def asked_of(trace: Trace, ugv: str, t: float, sent: Sequence[Sent]) -> tuple[Sent | None, bool]:
    """The proposal in force for a UGV at a sample of the gatekeeper, unless it has refused it by the sample before.

    A proposal in force is one that the UGV decides about at that sample. Besides: whether it has accepted it by then.
    """
    when, on, answers = _answers_of(trace).get(ugv, NONE)
    now = np.flatnonzero(np.abs(when - t) <= TIME_TOLERANCE_S)
    if not now.size:
        return None, False
    issued = float(on[now[0]])
    before = np.flatnonzero((on == issued) & (when < t - TIME_TOLERANCE_S))
    answer = str(answers[before[-1]]) if before.size else ""
    if answer == "refuse":
        return None, False
    return next((one for one in sent if (one.ugv, one.issued_s) == (ugv, issued)), None), answer == "accept"


def _answers_of(trace: Trace) -> dict[str, tuple[Array, Array, Any]]:
    """Of each UGV with decisions: their times, those of the proposals, s, and the answers, (D,) each."""

    def found() -> dict[str, tuple[Array, Array, Any]]:
        by_ugv = trace.decisions.groupby("robot", sort=False)
        columns = {
            str(ugv): [rows[name].to_numpy() for name in ("t_s", "issued_s", "decision")] for ugv, rows in by_ugv
        }
        return {ugv: (when, on, answers) for ugv, (when, on, answers) in columns.items()}

    return trace.derived("answers", found)


def bounds_of_way_left(place: Array, goal: Array, discs: Array, distances: Array | float) -> tuple[float, float]:
    """Bounds of the length of the shortest way among safe circles, m: straight, and over points around the circles.

    The latter is infinite where no way between those points is found.
    """
    squared = np.square(distances) - np.square(discs[:, 2] - place[2])
    centres, radii = discs[squared > 0.0, :2], np.sqrt(squared[squared > 0.0])
    direct = float(np.linalg.norm(goal[:2] - place[:2]))
    legs = np.array([place[:2], goal[:2]])
    some = _crossed(legs, centres, radii)
    while True:  # a way round some that crosses none of the others is one round all
        legs = _round(legs[0], legs[-1], centres[some], radii[some])
        if not len(legs):
            return direct, np.inf
        more = some | _crossed(legs, centres, radii)
        if (more == some).all():
            return direct, float(np.linalg.norm(np.diff(legs, axis=0), axis=1).sum())
        some = more


def _crossed(way: Array, centres: Array, radii: Array) -> npt.NDArray[np.bool_]:
    """Which circles (m,) a polyline (M, 2) cuts."""
    legs = np.diff(way, axis=0)
    away = centres - way[:-1, None]
    along = np.clip(np.einsum("lmd,ld->lm", away, legs) / np.maximum((legs**2).sum(axis=1), 1e-300)[:, None], 0.0, 1.0)
    nearest = np.linalg.norm(away - along[..., None] * legs[:, None], axis=2)
    return np.asarray((nearest < radii * (1.0 - 1e-6)).any(axis=0))


def _round(place: Array, goal: Array, centres: Array, radii: Array) -> Array:
    """A short way round circles over points all around them, (M, 2), m; (0, 2) where there is none."""
    ends = np.stack([place, goal])
    if not len(centres):
        return ends
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / AROUND)
    rings = (centres[:, None] + radii[:, None, None] * (1.0 + 1e-9) * ring).reshape(-1, 2)
    free = (np.linalg.norm(rings[:, None] - centres, axis=2) >= radii).all(axis=1)
    nodes = np.concatenate([ends, rings[free]])
    x, y = nodes.T[:, :, None]
    over, up = x.T - x, y.T - y  # from the first node to the second
    squared = over**2 + up**2
    clear = np.ones(squared.shape, dtype=bool)
    for (right, above), radius in zip(centres, radii, strict=True):
        along = np.clip(((right - x) * over + (above - y) * up) / np.maximum(squared, 1e-300), 0.0, 1.0)
        nearest = np.square(x + along * over - right) + np.square(y + along * up - above)
        clear &= nearest >= (radius * (1.0 - 1e-6)) ** 2
    lengths = np.sqrt(squared)
    before = dijkstra(np.where(clear, lengths, 0.0), indices=0, return_predecessors=True)[1]
    if before[1] < 0:
        return np.empty((0, 2))
    chain = [1]
    while chain[-1] != 0:
        chain.append(int(before[chain[-1]]))
    return np.asarray(nodes[chain[::-1]])
