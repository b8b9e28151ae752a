"""Four claims screened on the arrays of a run of the compiled loop, without a trace.

A screen gives a finding without evidence, and only if the trace judge, `judge`, must come to the same finding. It uses
the geometry and the automaton of the robots, whereas the trace judge has its own code. Cases that a screen cannot
decide, or that are so near to a limit that rounding could decide, are left to the trace judge: the claim has no
finding.

    SAFE-TRACE  the least distance of each pair over continuous time, straight between the rows
    ZENO-TRACE  the times of triggers
    THR-TRIG    the decision variable from positions, noise and presets, and the automaton run again on it
    LIVE-GOAL   the conditions of the claim itself, on the rows

Robots move as they are told, and everything is there all the time; other runs have no findings.
"""

from collections.abc import Collection
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.compiling import njit
from airground_drake.base.errors import TraceError
from airground_drake.base.statuses import Status
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.encounter import least_apart
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.trigger import automaton
from airground_drake.model.trigger.automaton import FIELDS, NEW, RELEASED, TRIGGERED, TRIGGERS, transitions_due
from airground_drake.model.trigger.excursion import Corners, gathered, ranges
from airground_drake.sim.batch.loop import Log
from airground_drake.sim.batch.run import Batch
from airground_drake.verify.claim import MOTION_TOLERANCE_M, TIME_TOLERANCE_S
from airground_drake.verify.claims.live_goal import Way, conditions
from airground_drake.verify.claims.thr_trig import EVENT_TOLERANCE_S, VARIABLE_TOLERANCE_M, levels_by
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M, Pair, pairs_by
from airground_drake.verify.runs.triggers import NOISE_TOLERANCE_M, noise_off

SCREENED = ("SAFE-TRACE", "ZENO-TRACE", "THR-TRIG", "LIVE-GOAL")

# Two ways to compute a distance of up to 1e3 m differ by 1e-12 m. So a margin is safe beside its limit, -1e-9 m, though
# robots that slide along an obstacle have margins of 1e-13 m.
DOUBT_M = 1e-10
# Margins of both judges differ by less, m or s: times of events differ by a small multiple of the isolation, 5e-10 s.
SAME = 1e-8


class NoScreenError(Exception):
    """Runs of this scenario need the trace judge; the message says why."""


class ArrayJudges:
    """Judges the loop's runs of a scenario; raises NoScreenError for scenarios that it cannot judge."""

    def __init__(self, batch: Batch) -> None:
        given, world = batch.given, batch.world
        robots = world.bodies[: len(world.robots)]
        if any(type(robot.plant) is not FirstOrder for robot in robots):
            raise NoScreenError("a robot that does not follow its commands exactly")
        if any(body.appears_s > 0.0 or body.disappears_s < np.inf for body in world.bodies):
            raise NoScreenError("an obstacle that appears or disappears")
        self._batch, self._given, self._world = batch, given, world
        self._stalls = given.runs[batch.name].stalls_m
        bounds = {robot.name: robot.bounds for robot in robots}
        self._pairs: list[Pair] = [*pairs_by(given, bounds, {}, 0)]
        self._safe = np.array([pair.safe_m for pair in self._pairs])
        self._reach = np.array([pair.reach_m for pair in self._pairs])
        self._strikes = given.safe_distance.collision_m + np.array([pair.radii_m for pair in self._pairs])
        index = {name: k for k, name in enumerate(world.names())}
        moving, shapes = len(world.moving), [outline.moved(body.shape, body.start_m) for body in world.resting]
        shapes = [*(body.shape for body in world.moving), *shapes]
        first = np.cumsum([0, *(len(shape) for shape in shapes)])
        of = np.array([(index[pair.first], index[pair.second]) for pair in self._pairs], dtype=np.int64).reshape(-1, 2)
        carrier = np.where(of[:, 1] < moving, of[:, 1], -1)
        self._numbers = np.column_stack([of[:, 0], carrier, first[of[:, 1]], first[of[:, 1] + 1]])
        self._rows = outline.joined(*shapes)

    def findings(self, log: Log, claims: Collection[str] = SCREENED) -> dict[str, Finding]:
        """The findings on a run, by claim; claims without one need the trace judge."""
        if not self._is_a_run(log):
            return {}
        apart = least_of_pairs(log.bodies, self._numbers, self._rows, len(self._world.names("ugv")))
        if (apart < self._strikes + DOUBT_M).any():  # where a robot collides, its run ends
            return {}
        screens: dict[str, Any] = {
            "SAFE-TRACE": lambda: self._safe_trace(apart - self._safe),
            "ZENO-TRACE": lambda: self._zeno_trace(log),
            "THR-TRIG": lambda: self._thr_trig(log),
            "LIVE-GOAL": lambda: self._live_goal(log),
        }
        findings = {claim: screens[claim]() for claim in claims}
        return {claim: finding for claim, finding in findings.items() if finding is not None}

    def _is_a_run(self, log: Log) -> bool:
        """Whether the rows are a whole run in which every robot follows its commands."""
        lasting, r = np.diff(log.t), len(self._world.robots)
        whole = abs(log.t[-1] - self._given.duration_s) <= TIME_TOLERANCE_S and log.t[0] == 0.0
        if not whole or lasting.min() < 0.0 or lasting.max() > self._given.control.period_s + TIME_TOLERANCE_S:
            return False
        off = np.diff(log.bodies[:, : 3 * r], axis=0) - lasting[:, None] * log.command[1:]
        return bool(np.abs(off).max() <= MOTION_TOLERANCE_M)  # a NaN is not

    def _safe_trace(self, margins: Array) -> Finding | None:
        margin = float(margins.min())
        if abs(margin + DISTANCE_TOLERANCE_M) < DOUBT_M or (np.abs(margins - self._reach) < DOUBT_M).any():
            return None
        status: Status = "holds" if margin >= -DISTANCE_TOLERANCE_M else "refuted"
        return Finding(status, margin=margin, unit="m", exercised=int((margins < self._reach).sum()))

    def _zeno_trace(self, log: Log) -> Finding:
        bound = float(self._given.decision.min_inter_event_s)
        if bound <= 0.0:
            return Finding("not_run")
        gaps = np.concatenate([np.diff(times) for times in triggers(log)])
        if not len(gaps):
            return Finding("holds", exercised=0)
        status: Status = "holds" if gaps.min() >= bound - TIME_TOLERANCE_S else "refuted"
        return Finding(status, margin=float(gaps.min()) - bound, unit="s", exercised=len(gaps))

    def _thr_trig(self, log: Log) -> Finding | None:
        """A finding if the claim holds; otherwise the trace judge decides."""
        team, decision = self._batch.team, self._given.decision
        try:
            levels = np.array(levels_by(decision, self._batch.zeta))
        except TraceError:
            return None
        if (noise_off(log.t, log.noise, decision) > NOISE_TOLERANCE_M / 2.0).any() or log.noise[0].any():
            return None
        lag, expected, agreed = replayed(log.t, log.bodies, log.noise, log.x, log.status, team.corners, levels)
        if not agreed or lag > EVENT_TOLERANCE_S / 2.0:
            return None
        return Finding("holds", margin=EVENT_TOLERANCE_S - lag if lag >= 0.0 else None, unit="s", exercised=expected)

    def _live_goal(self, log: Log) -> Finding | None:
        places = {robot: log.bodies[:, 3 * i : 3 * i + 3] for i, robot in enumerate(self._world.robots)}
        ways = {robot: Way(log.t, position) for robot, position in places.items()}
        last = np.array([places[ugv][-1] for ugv in self._world.names("ugv")])
        judged = [*conditions(self._given, self._stalls, ways, last)]
        # The margin of a failed run is that of its most violated condition.
        margin = min(float(condition.entry["margin_m"]) for condition in judged)
        if abs(margin) < DOUBT_M:
            return None
        had_a_way = sum(condition.had_a_way for condition in judged)
        return Finding("holds" if margin >= 0.0 else "refuted", margin=margin, unit="m", exercised=had_a_way)


def triggers(log: Log) -> list[Array]:
    """The times of the triggers of each UGV, s."""
    times = [np.unique(log.status[:, k]) for k in range(TRIGGERED, log.status.shape[1], FIELDS)]
    return [some[some >= 0.0] for some in times]


@njit(cache=True)
def least_of_pairs(bodies: Array, pairs: Indices, rows: Array, ugvs: int) -> Array:
    """Least distances of P pairs, (P,), m: of a robot from cores."""
    # bodies: (T, 3 M), m; the first `ugvs` of them stay in their plane
    # pairs: the robot; the body that carries the cores, or -1; their first row and that after the last, (P, 4)
    apart, way = np.full(len(pairs), np.inf), np.empty((len(bodies), 3))
    for p in range(len(pairs)):
        robot, carrier, first, last = pairs[p]
        for k in range(len(bodies)):
            for a in range(3):
                way[k, a] = bodies[k, 3 * robot + a] - (bodies[k, 3 * carrier + a] if carrier >= 0 else 0.0)
        for row in range(first, last):
            apart[p] = min(apart[p], least_apart(rows[row], way, robot < ugvs))
    return apart


@njit(cache=True)
def signals_of(t: Array, bodies: Array, noise: Array, corners: Corners) -> Array:
    """Signals of the decision block at times (T,), s, as `excursion.gathered` gives them, (T, 1 + 5n)."""
    n = noise.shape[1]
    signals, wanted = np.empty((len(t), 1 + 5 * n)), np.empty((len(t), 3 * n))
    for j in range(n):
        own = slice(corners.first[j], corners.first[j + 1])
        for a in range(3):
            wanted[:, 3 * j + a] = np.interp(t, corners.own_times[own], corners.places[own, a])
    for k in range(len(t)):
        signals[k] = gathered(t[k], bodies[k], wanted[k], noise[k])
    return signals


@njit(cache=True)
def replayed(
    t: Array, bodies: Array, noise: Array, x: Array, status: Array, corners: Corners, levels: Array
) -> tuple[float, int, bool]:
    """Run the trigger again on the rows: largest lag of an event, s (-1 without events); transitions; agreement."""
    n, last = noise.shape[1], len(t) - 1
    signals = signals_of(t, bodies, noise, corners)
    own = np.array([NEW[k % FIELDS] for k in range(FIELDS * n)])
    automaton.begin(own, t[0], signals[0, 5::5], levels)
    lag, transitions = -1.0, 0
    for j in range(n):
        if own[FIELDS * j + TRIGGERS] > 0.0:
            lag, transitions = 0.0, transitions + 1
    for k in range(last + 1):
        for column in range(FIELDS * n):
            if status[k, column] != own[column]:
                return lag, transitions, False
        for j in range(n):
            if not abs(x[k, j] - signals[k, 5 + 5 * j]) <= VARIABLE_TOLERANCE_M / 2.0:
                return lag, transitions, False
        begun, now = signals[max(k - 1, 0)], signals[k]
        span = ranges(begun, now, corners)
        expected = transitions_due(own, t[k], span, levels)
        if not expected.any():
            continue
        if k == last:  # the run ends before it can be made
            return lag, transitions, False
        before = own.copy()
        automaton.advance(own, t[k], now[5::5], span, levels)
        for j in range(n):
            was, became = before[FIELDS * j : FIELDS * (j + 1)], own[FIELDS * j : FIELDS * (j + 1)]
            events = int(became[TRIGGERS] - was[TRIGGERS]) + (1 if became[RELEASED] != was[RELEASED] else 0)
            if events > 0:
                rows = slice(max(k - 1, 0), k + 1)
                lag = max(lag, t[k] - _first_due(j, before, t[rows], bodies[rows], noise[rows], corners, levels))
            elif expected[j]:
                events = 1  # the end of a refractory time
            transitions += events
    return lag, transitions, True


@njit(cache=True)
def _first_due(j: int, status: Array, t: Array, bodies: Array, noise: Array, corners: Corners, levels: Array) -> float:
    """When in a step between two rows a transition of a UGV became due, s, by bisection."""
    begun = signals_of(t[:1], bodies[:1], noise[:1], corners)[0]
    low, high = t[0], t[-1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        share = (middle - t[0]) / (t[-1] - t[0])
        there, noisy = bodies[:1] + share * (bodies[-1:] - bodies[:1]), noise[:1] + share * (noise[-1:] - noise[:1])
        now = signals_of(np.array([middle]), there, noisy, corners)[0]
        if transitions_due(status, middle, ranges(begun, now, corners), levels)[j]:
            high = middle
        else:
            low = middle
    return high
