"""The steps of Drake's Simulator for one run, compiled: the package's own kernels, in Drake's order.

In each step Drake publishes, makes the unrestricted updates (noise, planner, gatekeeper) on the state before any of
them, then the discrete ones (trigger, decision block, halts, controllers) on the state after those and before any of
these, and integrates to the next event. An event of the trigger is isolated by bisection: the first midpoint at which
the witness has not fired ends the step. Planner and gatekeepers stay Python: where one of them has something to do, the
loop stops in front of its update (`PYTHON`), and goes on after it.

All results equal Drake's bit by bit. So no sum here may be reordered, contracted or computed by BLAS, and `log` must be
the C library's.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry import moving
from airground_drake.model.geometry.convex import news_within
from airground_drake.model.law import ugv_law
from airground_drake.model.law.kernels import Layer, commands
from airground_drake.model.law.tasks import over_centroid
from airground_drake.model.law.ugv_law import AcceptedMotion, Numbers, Tracking
from airground_drake.model.plants.steering import HAND, along, heading_after, steer_all
from airground_drake.model.trigger import automaton
from airground_drake.model.trigger.automaton import FIELDS, INTERVENING, anything_due, are_numbers
from airground_drake.model.trigger.excursion import Corners, gathered, ranges
from airground_drake.sim.blocks.decision import MOST_SHORT, SHORTEST_S
from airground_drake.uav.halts import watched

Ints = npt.NDArray[np.int64]

# The updates due at a tick, as bits.
CONTROL, PLAN, GATE, NOISE = 1, 2, 4, 8
WATCH = 16  # the surroundings change
# Why the loop stops: the end; an update for Python; no room for another row; as in Drake, an error.
DONE, PYTHON, FULL, NOT_A_NUMBER, SHORT_STEPS, NOT_FINITE = 0, 1, 2, 3, 4, 5
# How it is entered: at the beginning of a run, to go on with it, or to publish a row for which there was no room.
BEGIN, GO_ON, AGAIN = 0, 1, 2
SIGNALS = 4  # of a unicycle: the place of its axle, m, and its heading, rad


class Team(NamedTuple):
    """The constants of a run of n UGVs and one UAV."""

    law: Numbers  # of the UGVs
    layer: Layer  # of the UAV
    uav: Array  # altitude, m, and gain of its task, 1/s, (2,)
    steering: Array  # of the UGVs, (n, NUMBERS)
    turns: bool  # whether a UGV is a unicycle
    levels: Array  # of the trigger, (3,)
    corners: Corners  # of the presets
    breaks: Array  # of the presets as one first-order hold, (K,), s
    holds: Array  # its value and slope in each piece, (K - 1, 3n, 2)
    script_of: Ints  # rows of each script among those of `script_breaks`
    script_breaks: Array
    script_holds: Array  # (.., 3, 2)
    room: Array  # radii of one place, (n,), m: see `halts`
    numbers: Array  # see `run`: period, shortest step, isolation, noise gain, leak, sensing range, (6,)
    ticks: Array  # times of all timed events, s
    due: Ints  # what is due then
    draws: Array  # the noise, (.., n)
    gated: bool  # whether UGVs judge proposals
    remembers: bool  # whether UGVs may sense something new


class Around(NamedTuple):
    """The robots' present surroundings."""

    ugvs: Neighbours
    uav: Neighbours


class Accepted(NamedTuple):
    """The motions that UGVs execute, one after the other."""

    executing: Flags  # (n,)
    number: Array  # of the proposal, -1 without one, (n,)
    chosen: Array  # the directions of the intervention, (n, 3, 3)
    first: Ints  # rows of each motion, (n + 1,)
    times: Array  # s
    places: Array  # (.., 3), m
    slopes: Array  # (.., 3), m/s; the row of a last vertex is not used


class State(NamedTuple):
    """The variables of a run."""

    # Now; when the trigger's step began; number of short steps in a row; until when the planner sleeps, and until when
    # the gatekeepers do, (5,).
    time: Array
    counts: Ints  # next tick, rows written, samples of noise used, what is due now, 1 after Python's update, (5,)
    called: Flags  # which UGVs were triggered when the planner fell asleep, (n,)
    place: Array  # of all bodies that move, (M, 3), m
    noise: Array  # (n,), m
    drawn: Array  # the sample in force, (n,)
    command: Array  # of the robots, (r, 3), m/s
    executing: Array  # (n,)
    share: Array  # (n,)
    heading: Array  # at the last control sample, (n,), rad
    sampled: Array  # when that was, (1,), s
    status: Array  # (4n,)
    halts: Array  # (4n,)
    begun: Array  # signals of the decision block when its step began, (1 + 5n,)
    now: Array  # and now
    reference: Array  # (6n,)
    quiet: Flags  # outlines that are known to each UGV, (n, m)


class Log(NamedTuple):
    """A row per step."""

    t: Array
    bodies: Array
    command: Array
    reference: Array
    noise: Array
    x: Array
    status: Array
    executing: Array
    signals: Array
    share: Array


@njit(cache=True)
def hold(breaks: Array, holds: Array, t: float, value: Array, rate: Array) -> None:
    """Write value and rate of a first-order hold, rounded as by PiecewisePolynomial and TrajectorySource."""
    last = len(breaks) - 1
    inside = min(max(t, breaks[0]), breaks[last])
    piece = min(max(np.searchsorted(breaks, inside, side="right") - 1, 0), last - 1)
    for d in range(holds.shape[1]):
        value[d] = holds[piece, d, 0] + holds[piece, d, 1] * (inside - breaks[piece])
        rate[d] = holds[piece, d, 1] if breaks[0] <= t <= breaks[last] else 0.0


@njit(cache=True)
def since(t: float, sampled: float, period: float) -> float:
    """Time since the last control sample, s; a whole period if it differs from that only by rounding."""
    elapsed = t - sampled
    return period if abs(elapsed - period) <= 1e-9 else elapsed


@njit(cache=True)
def headings_at(t: float, state: State, steering: Array, period: float) -> Array:
    """Headings of the UGVs, (n,), rad; 0 for other plants than unicycles."""
    found, heading, command, elapsed = (
        np.zeros(len(steering)),
        state.heading,
        state.command,
        since(t, state.sampled[0], period),
    )
    for j in range(len(steering)):
        if steering[j, HAND] > 0.0:
            found[j] = heading_after(heading[j], command[j], elapsed, steering[j, HAND], period)
    return found


@njit(cache=True)
def advance(team: Team, around: Around, accepted: Accepted, state: State, log: Log, until: float, enter: int) -> int:
    """Simulate up to a time, s, or to an update made in Python; returns the reason to stop."""
    # At that time the row is published, and the updates of the instant are still to be made.
    # Reading an array of a tuple counts references: once, here.
    law, layer, uav_task, steering, turns, levels, corners, breaks, holds = team[:9]
    script_of, script_breaks, script_holds, room, numbers, ticks, due, draws, gated, remembers = team[9:]
    period, shortest, isolation, gain, leak, sensing = numbers
    ugvs, uav = around
    on, number, chosen, row_of, motion_t, motion_p, motion_v = accepted
    time, counts, called, place, noise, drawn, command, executing, share, heading = state[:10]
    sampled, status, halts, held_begun, held_now, reference, quiet = state[10:]
    log_t, log_bodies, log_command, log_reference, log_noise = log[:5]
    log_x, log_status, log_executing, log_signals, log_share = log[5:]

    n, r = len(noise), len(command)
    still, flat, track = ugvs.still, place.reshape(-1), reference.reshape(2, n, 3)
    wanted, wanted_rate, lower = np.zeros((n, 3)), np.zeros((n, 3)), np.empty((1, 3))
    began, noise_began, script_rate = np.empty((r, 3)), np.empty(n), np.empty(3)
    t, tick, rows, mask, resumed = time[0], counts[0], counts[1], counts[3], counts[4] == 1
    begun, now, code = held_begun.copy(), held_now.copy(), -1
    if enter == BEGIN:
        hold(breaks, holds, t, reference[: 3 * n], reference[3 * n :])
        for k in range(len(script_of) - 1):
            rows_of = slice(script_of[k], script_of[k + 1])
            hold(script_breaks[rows_of], script_holds[rows_of], t, place[r + k], script_rate)
        now = gathered(t, flat, reference, noise)
        begun = now
        automaton.begin(status, t, now[5::5], levels)
        time[1] = t
    span, ended = ranges(begun, now, corners), enter != GO_ON
    while True:
        if ended:
            if rows >= len(log_t):
                code = FULL
                break
            log_t[rows], log_bodies[rows], log_command[rows] = t, flat, command.reshape(-1)
            log_reference[rows], log_noise[rows], log_x[rows] = reference, noise, now[5::5]
            log_status[rows], log_executing[rows] = status, executing
            if turns:
                elapsed, at = since(t, sampled[0], period), 0
                for j in range(n):
                    hand = steering[j, HAND]
                    if hand > 0.0:
                        signals = along(place[j], command[j], heading[j], elapsed, hand, period)
                        log_signals[rows, at : at + SIGNALS] = signals
                        at += SIGNALS
                log_share[rows] = share
            rows += 1
            if t >= until:
                code = DONE
                break
        ended = True
        if not resumed:  # unrestricted updates
            awake = mask & WATCH != 0
            if mask & PLAN:
                awake = awake or t >= time[3]
                for j in range(n):
                    awake = awake or (status[FIELDS * j] == INTERVENING) != called[j]
            if mask & GATE and gated and not awake:
                awake = t >= time[4]
                if remembers and not awake:
                    awake = quiet.shape != (n, len(still)) or news_within(still, place[:n], sensing, True, quiet)
            if awake:
                code = PYTHON
                break
        resumed = False
        if mask & NOISE:
            drawn[:] = draws[counts[2]]
            counts[2] += 1
        if not are_numbers(span):  # discrete updates
            code = NOT_A_NUMBER
            break
        if mask & PLAN:
            halts[:] = watched(halts, t, flat, room)
        if anything_due(status, t, span, levels):
            automaton.advance(status, t, now[5::5], span, levels)
            time[2] = 0.0
        else:
            time[2] = time[2] + 1.0 if t - time[1] < shortest else 0.0
            if time[2] > MOST_SHORT:
                code = SHORT_STEPS
                break
        time[1], begun = t, now
        if mask & CONTROL:
            if not np.isfinite(flat).all():
                code = NOT_FINITE
                break
            for j in range(n):
                if on[j]:
                    own = slice(row_of[j], row_of[j + 1])
                    wanted[j], wanted_rate[j] = moving.at(motion_t[own], motion_p[own], motion_v[own], t)
            headings = headings_at(t, state, steering, period)
            asked = AcceptedMotion(wanted, wanted_rate, chosen)
            task = Tracking(track[0], track[1])
            velocity = ugv_law.commands(law, ugvs, place, task, asked, on, headings, steering)
            target, rate = over_centroid(place[:n], command[:n], uav_task[0])
            for a in range(3):
                lower[0, a] = rate[0, a] + uav_task[1] * (target[0, a] - place[n, a])
            command[n] = commands(lower, place, uav, layer)[0]
            if turns:
                share[:] = steer_all(velocity, headings, steering, period)
                heading[:] = headings
                sampled[0] = t
            command[:n] = velocity
            for j in range(n):
                executing[j] = number[j] if on[j] else -1.0
        upcoming = ticks[tick] if tick < len(ticks) else np.inf  # continuous
        end = min(until, upcoming)
        began[:], noise_began[:] = place[:r], noise
        start, low, high = t, t, end
        tolerance = max(max(1e-14, abs(end) * 1e-14), isolation)
        t, whole = end, True
        while True:
            for i in range(r):
                for a in range(3):
                    place[i, a] = began[i, a] + (t - start) * command[i, a]
            for j in range(n):
                noise[j] = noise_began[j] + (t - start) * (-leak * noise_began[j] + gain * drawn[j])
            hold(breaks, holds, t, reference[: 3 * n], reference[3 * n :])
            for k in range(len(script_of) - 1):
                rows_of = slice(script_of[k], script_of[k + 1])
                hold(script_breaks[rows_of], script_holds[rows_of], t, place[r + k], script_rate)
            now = gathered(t, flat, reference, noise)
            span = ranges(begun, now, corners)
            if t - time[1] < SHORTEST_S or not anything_due(status, t, span, levels):
                break
            if not whole:
                high = t
                if high - low <= tolerance:
                    break
            whole = False
            t = (low + high) / 2.0
        mask = 0
        if whole and upcoming <= until:
            mask = due[tick]
            tick += 1
    time[0], counts[0], counts[1], counts[3], counts[4] = t, tick, rows, mask, 0
    held_begun[:], held_now[:] = begun, now
    return code
