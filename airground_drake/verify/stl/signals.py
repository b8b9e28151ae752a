"""Signals that the formulas of `cross_check.py` are about, from the columns, events and decisions of a trace.

Other formulas than those of the checkers are used; from the checkers come only the tolerances, which are part of the
claims. Two kinds of signals:
- for `discrete` formulas, a sequence of samples; how far apart they are plays no part. What happens between two rows
  is covered by the sequence itself: where a distance has its minimum inside a segment, the instant of the closest
  approach is a sample of its own, and on both sides of it the distance is monotone.
- for `dense` formulas, true (+1) or false (-1) from an event to another, or for `PULSE_S` after an instant. rtamt holds
  each value until the next sample, which is exact for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise, zip_longest
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.interventions import GATED_METHODS
from airground_drake.verify.runs.live_goal import AT_REST_M, AT_REST_S
from airground_drake.verify.runs.thr_trig import EVENT_TOLERANCE_S, VARIABLE_TOLERANCE_M

PULSE_S = 1e-9
"""An instant is a pulse of this length in a dense signal, s: the tolerance of the claims on times."""
NEVER = 1e6
"""Value of a margin where nothing is asked, in its unit; a robustness of half of it is vacuous."""
Rows = npt.NDArray[np.intp]
Samples = tuple[Array, Array]
"""Times, s, and values of a signal, (K,) each."""


class Signals(NamedTuple):
    """What a formula is evaluated on: the constants in its text, and one or several sets of signals by name."""

    constants: dict[str, float]
    sets: list[dict[str, Samples]]


def _pairs(trace: Trace) -> Iterator[tuple[str, str, Array, float, float]]:
    """Robot, other, offset (T, 3) from the other to the robot, safe distance, share of the robot; each pair once.

    Left out is who keeps farther apart than the sensing range, and by more than the pair of least margin at the start:
    things in two balls are no nearer than the balls.
    """
    safe, place = trace.scenario["safe_distance"], {robot: trace.position(robot) for robot in trace.robots}
    rocks = trace.scenario["obstacles"]
    things = [*place.values(), *(np.array([rock["position_m"]], dtype=np.float64) for rock in rocks.values())]
    names, count = [*place, *rocks], len(place)
    bodies = [*trace.scenario["ugvs"].values(), trace.scenario["uav"], *rocks.values()]
    radius = np.array([body["radius_m"] for body in bodies])
    kind = np.array([safe["ugv_m"]] * (count - 1) + [safe["air_ground_m"]] + [safe["obstacle_m"]] * len(rocks))
    start, middle = np.array([thing[0] for thing in things]), np.array([thing.mean(axis=0) for thing in things])
    ball = np.array([np.linalg.norm(a - m, axis=1).max() for a, m in zip(things, middle, strict=True)])
    one, other = np.triu_indices(count, 1, len(things))
    apart = kind[other] + (radius[one] + radius[other])
    least = np.linalg.norm(middle[one] - middle[other], axis=1) - ball[one] - ball[other] - 1e-6
    nearest = (np.linalg.norm(start[one] - start[other], axis=1) - apart).min(initial=np.inf)
    kept = (least <= trace.scenario["control"]["sensing_range_m"]) | (least - apart <= nearest)
    for i, j, distance in zip(one[kept].tolist(), other[kept].tolist(), apart[kept].tolist(), strict=True):
        yield names[i], names[j], things[i] - things[j], distance, 0.5 if j < count else 1.0


def clearance(trace: Trace) -> Signals:
    """Least margin of all pairs at the rows, and inside each segment that of the lowest closest approach.

    A range rate that changes from negative to positive between two rows shows the approach; the distance there is
    that of a point from a line, by the cross product.
    """
    t = trace.t
    at_rows = np.full(len(t), NEVER)
    between = np.full(len(t) - 1, NEVER)
    instant = t[:-1].copy()
    for _, _, offset, safe, _ in _pairs(trace):
        at_rows = np.minimum(at_rows, np.sqrt((offset**2).sum(axis=1)) - safe)
        step = offset[1:] - offset[:-1]
        rates = (offset[:-1] * step).sum(axis=1), (offset[1:] * step).sum(axis=1)
        k = np.flatnonzero((rates[0] < 0.0) & (rates[1] > 0.0))
        normal = np.cross(offset[k], step[k])
        margin = np.sqrt((normal**2).sum(axis=1) / (step[k] ** 2).sum(axis=1)) - safe
        lower = margin < between[k]
        k, margin = k[lower], margin[lower]
        between[k] = margin
        instant[k] = t[k] + (t[k + 1] - t[k]) * (rates[0][k] / (rates[0][k] - rates[1][k]))
    inner = between < NEVER
    times = np.concatenate([t, instant[inner]])
    values = np.concatenate([at_rows, between[inner]])
    order = np.argsort(times, kind="stable")
    return Signals({}, [{"margin_m": (times[order], values[order])}])


def _intervals(trace: Trace) -> tuple[Rows, Rows]:
    """Rows that begin an interval, and for each the one of them that is the control sample before it or at it."""
    t, period = trace.t, trace.scenario["control"]["period_s"]
    begins = np.flatnonzero(np.diff(t) >= TIME_TOLERANCE_S)
    sampled = np.abs(t[begins] - period * np.round(t[begins] / period)) <= TIME_TOLERANCE_S
    return begins, np.maximum.accumulate(np.where(sampled, np.arange(len(begins)), 0))


def motion(trace: Trace) -> Signals:
    """Speed to spare, climbing rate and departure from the held command, of the worst robot on each interval."""
    (begins, held), scenario = _intervals(trace), trace.scenario
    limits = {name: robot["max_speed_m_s"] for name, robot in scenario["ugvs"].items()}
    limits[scenario["uav"]["name"]] = scenario["uav"]["max_speed_m_s"]
    commands = {robot: trace.command(robot)[1:] for robot in trace.robots}
    inside = {robot: command[begins] for robot, command in commands.items()}
    spare = np.min([limits[r] - np.sqrt((v**2).sum(axis=1)) for r, v in commands.items()], axis=0)
    climb = np.max([np.abs(commands[ugv][:, 2]) for ugv in trace.ugvs], axis=0)
    drift = np.zeros(len(spare))
    drift[begins] = np.max([np.linalg.norm(v - v[held], axis=1) for v in inside.values()], axis=0)
    t = trace.t[:-1]
    return Signals({}, [{"spare_m_s": (t, spare), "climb_m_s": (t, climb), "drift_m_s": (t, drift)}])


def levels(trace: Trace) -> Signals:
    """x at the rows from recorded reference, position and noise; modes on both sides of a row; time since trigger."""
    decision = trace.scenario["decision"]
    zeta = float(trace.meta["zeta_m"])
    t = trace.t
    bare = decision["trigger"] == "bare"
    release, dwell = (zeta, 0.0) if bare else (decision["release_m"], decision["min_inter_event_s"])
    sets, rate = [], 0.0
    for ugv in trace.ugvs:
        noise = trace.column(f"{ugv}.noise_m")
        mode = trace.column(f"{ugv}.mode")
        spec = trace.scenario["ugvs"][ugv]
        gap = np.diff(t)
        slope = np.abs(np.diff(noise))[gap >= TIME_TOLERANCE_S] / gap[gap >= TIME_TOLERANCE_S]
        rate = max(rate, spec["max_speed_m_s"] + spec["preset"]["speed_m_s"] + float(slope.max()))
        x = np.linalg.norm(trace.reference(ugv) - trace.position(ugv), axis=1) + noise
        last = trace.column(f"{ugv}.triggered_at_s")
        before = np.append(2.0, mode[1:-1])
        since = np.where(last >= 0.0, t - last, NEVER)
        values = {"x_m": x[:-1], "before": before, "after": mode[1:], "since_s": since[:-1]}
        rows = _telling((before, mode[1:]), (x[:-1], since[:-1]))
        sets.append({name: (t[rows], value[rows]) for name, value in values.items()})
    slop = EVENT_TOLERANCE_S * rate + VARIABLE_TOLERANCE_M
    constants = {"least": zeta - slop, "most": zeta + slop, "low": release - slop, "high": release + slop}
    return Signals(constants | {"dwell": dwell - EVENT_TOLERANCE_S, "over": dwell + EVENT_TOLERANCE_S}, sets)


def _telling(modes: tuple[Array, ...], values: tuple[Array, ...]) -> Rows:
    """Of the rows with the same modes, those of the least and of the largest of each value: the others say less."""
    of_row = np.unique(np.stack(modes), axis=1, return_inverse=True)[1].ravel()
    found = list[np.intp]()
    for same in (np.flatnonzero(of_row == kind) for kind in np.unique(of_row)):
        found += [same[pick(value[same])] for value in values for pick in (np.argmin, np.argmax)]
    return np.unique(np.array(found, dtype=np.intp))


def square(intervals: Iterable[tuple[float, float]], end: float) -> Samples:
    """+1 inside a union of half-open intervals, -1 outside, from 0 to `end` at least."""
    edges: list[list[float]] = []
    for begin, until in sorted((max(a, 0.0), b) for a, b in intervals):
        if edges and begin <= edges[-1][1]:
            edges[-1][1] = max(edges[-1][1], until)
        else:
            edges.append([begin, until])
    t = [0.0] * (not edges or edges[0][0] > 0.0) + [edge for pair in edges for edge in pair]
    first = 1.0 if edges and edges[0][0] == 0.0 else -1.0
    values = [first * (-1.0) ** k for k in range(len(t))]
    last = [end] if t[-1] < end else []
    return np.array(t + last), np.array(values + [values[-1]] * len(last))


def _times(trace: Trace, ugv: str, kind: str) -> list[float]:
    return sorted(float(e["t_s"]) for e in trace.events if e["robot"] == ugv and e["kind"] == kind)


def triggers(trace: Trace) -> Signals | None:
    """Per UGV a pulse at each trigger, and one where another follows so soon that their pulses are hard to tell apart.

    The formula looks for another pulse from `2 PULSE_S` after the beginning of each: where a pulse ends is a sum that
    rtamt rounds otherwise.
    """
    bound = float(trace.scenario["decision"]["min_inter_event_s"])
    end = float(trace.t[-1]) + 1.0
    if bound <= 0.0:
        return None
    sets: list[dict[str, Samples]] = []
    for ugv in trace.ugvs:
        times = _times(trace, ugv, "trigger")
        trigger = square(((t, t + PULSE_S) for t in times), end)
        twice = square(((b, b + PULSE_S) for a, b in pairwise(times) if b - a < 3.0 * PULSE_S), end)
        sets.append({"trigger": trigger, "twice": twice})
    return Signals({"past": 2.0 * PULSE_S, "dwell": bound - 2.0 * PULSE_S}, sets)


def messages(trace: Trace) -> Signals | None:
    """A pulse at each proposal and decision, and when the events say that its UGV or its cause was intervened on.

    One set for each UGV and each UGV that it was asked to make way for, itself among them.
    """
    if trace.meta["method"] == "a":
        return None
    end = float(trace.t[-1])
    scenario = trace.scenario
    table = trace.decisions
    issued = trace.proposals.to_dict("records")
    pairs = {(ugv, ugv) for ugv in trace.ugvs} | {(row["robot"], row["cause"]) for row in issued}
    sets: list[dict[str, Samples]] = []
    for ugv, cause in sorted(pairs):
        elsewhere = {row["issued_s"] for row in issued if row["robot"] == ugv and row["cause"] != cause}
        own = table[(table["robot"] == ugv) & ~table["issued_s"].isin(elsewhere)]
        sent = [t for t in _times(trace, ugv, "proposal") if t not in elsewhere] + own["t_s"].tolist()
        spans = [span for name in {ugv, cause} for span in _stays(trace, name, end)]
        message = square(((t, t + PULSE_S) for t in sent), end + 1.0)
        asked = square(((b - TIME_TOLERANCE_S, e + TIME_TOLERANCE_S + PULSE_S) for b, e in spans), end + 1.0)
        sets.append({"message": message, "intervening": asked})
    return Signals({"allowance": scenario["intervention"]["period_s"] + scenario["gatekeeper"]["period_s"]}, sets)


def _stays(trace: Trace, ugv: str, end: float) -> list[tuple[float, float]]:
    """From each trigger to the release after it, or to the end, s."""
    begins, ends = _times(trace, ugv, "trigger"), _times(trace, ugv, "release")
    return list(zip_longest(begins, ends[: len(begins)], fillvalue=end))  # they alternate


def counts(trace: Trace) -> Signals | None:
    """Messages so far."""
    if trace.meta["method"] == "a":
        return None
    scenario = trace.scenario
    n = len(trace.ugvs)
    before = trace.scenario["duration_s"] - TIME_TOLERANCE_S  # the first instant is at 0
    gated = trace.meta["method"] in GATED_METHODS
    sent = {
        "proposals": np.sort([t for ugv in trace.ugvs for t in _times(trace, ugv, "proposal")]),
        "decisions": np.sort(trace.decisions["t_s"].to_numpy(dtype=np.float64)),
    }
    most = {
        "most_proposals": float(n * math.ceil(before / scenario["intervention"]["period_s"])),
        "most_decisions": float(n * math.ceil(before / scenario["gatekeeper"]["period_s"]) * gated),
    }
    t = trace.t
    so_far = {kind: np.searchsorted(times, t + TIME_TOLERANCE_S).astype(np.float64) for kind, times in sent.items()}
    return Signals(most, [{kind: (t, count) for kind, count in so_far.items()}])


def goal(trace: Trace) -> Signals:
    """Least margin of what a robot must be near to or away from, and of standing still in the last second."""
    scenario, t = trace.scenario, trace.t
    stalls = scenario["runs"][trace.run]["stalls_m"]
    arrival = scenario["arrival_tolerance_m"]
    place = {robot: trace.position(robot) for robot in trace.robots}
    goal, rest = np.full(len(t), NEVER), np.full(len(t), NEVER)
    uav = scenario["uav"]

    def away(robot: str, point: Any) -> Array:
        distance: Array = np.sqrt(((place[robot] - point) ** 2).sum(axis=1))
        return distance

    for ugv in trace.ugvs:
        target = scenario["ugvs"][ugv]["target_m"]
        if ugv not in stalls:
            goal = np.minimum(goal, arrival - away(ugv, target))
            continue
        near = scenario["stall_tolerance_m"] - away(ugv, stalls[ugv])
        goal = np.minimum.reduce([goal, near, away(ugv, target) - arrival])
        # a step between rows is straight, so that the farthest point of the last second is a row or its beginning
        k = max(int(np.searchsorted(t, t[-1] - AT_REST_S)), 1)
        share = (t[-1] - AT_REST_S - t[k - 1]) / (t[k] - t[k - 1])
        begin = place[ugv][k - 1] + max(share, 0.0) * (place[ugv][k] - place[ugv][k - 1])
        rest[k:] = np.minimum(rest[k:], AT_REST_M - away(ugv, place[ugv][-1])[k:])
        rest[k] = min(rest[k], AT_REST_M - float(np.linalg.norm(begin - place[ugv][-1])))
    if stalls:
        over = np.mean([place[ugv] for ugv in trace.ugvs], axis=0) + np.array([0.0, 0.0, uav["altitude_m"]])
        goal = np.minimum(goal, arrival - away(uav["name"], over))
    else:
        goal = np.minimum(goal, arrival - away(uav["name"], uav["target_m"]))
    return Signals({}, [{"goal_m": (t, goal), "rest_m": (t, rest)}])
