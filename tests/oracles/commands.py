"""What a run commanded is the control law with the proposals that each UGV should execute, evaluated again."""

from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import corner_times, travelled
from airground_drake.verify.runs.pairs import preset_of
from oracles.control_law import (
    Asked,
    as_seen,
    avoiding,
    commanded,
    limited,
    place,
    rates,
    retreating,
    selected,
    squeezed,
    tracking,
)
from oracles.fault import Fault
from oracles.positions import acts_on_old, stands
from oracles.protocol import executed_at
from oracles.turning import able, edges, numbers_of

COMMAND_TOLERANCE_M_S = 1e-6
"""A command may differ from the law by this, m/s. Both are evaluated at the same recorded positions and differ by
rounding (1e-13 m/s). A corner of two nearly parallel inequalities divides that by the sine of their angle, which is at
least 1e-10: the controller treats flatter ones as parallel. In 100 s the tolerance is 0.1 mm."""

Rows = npt.NDArray[np.intp]


class Law(NamedTuple):
    """Commands by the law, (S, 3), m/s, and how far the recorded ones are from them, (S,), m/s."""

    command: Array
    away: Array


def wrong_commands(trace: Trace) -> list[Fault]:
    samples = trace.sample_rows
    laws = {ugv: _law_of_ugv(trace, ugv, samples) for ugv in trace.ugvs}
    for name, uav in trace.scenario.aerial.items():
        if uav.task == "formation":  # another task is third-party code
            laws[name] = _law_of_uav(trace, name, samples)
    found = []
    for robot, law in laws.items():
        wrong = np.flatnonzero(~(law.away <= COMMAND_TOLERANCE_M_S))
        if wrong.size and (given := as_seen(trace, robot)).normal.shape[1] > 1:
            wrong = wrong[~squeezed(given, trace.chosen(robot))[wrong]]
        if wrong.size:
            k = int(wrong[0])
            recorded, due = (v.tolist() for v in (trace.chosen(robot)[k], law.command[k]))
            found.append(Fault("command", robot, float(trace.t[samples][k]), {"due": due, "recorded": recorded}))
    return found


def _law_of_ugv(trace: Trace, ugv: str, samples: Rows) -> Law:
    """(6) with avoidance and the proposal that the UGV should execute, if any, by the priorities of the method."""
    scenario, t = trace.scenario, trace.t[samples]
    position, recorded = trace.as_seen(ugv, ugv), trace.chosen(ugv)
    given, numbers = as_seen(trace, ugv), numbers_of(trace, ugv)
    heading = trace.column(f"{ugv}.heading_rad")[samples] if numbers[0] else np.zeros(len(samples))
    given = given.also(*edges(heading, numbers))
    limit = np.full(len(samples), scenario.ugvs[ugv].max_speed_m_s)
    executed, standing = executed_at(trace, ugv), stands(trace, ugv)
    rows = np.flatnonzero([sent is not None for sent in executed])
    now = [(sent, float(t[k])) for k, sent in enumerate(executed) if sent is not None]
    wanted = np.array([place(*each) for each in now]).reshape(-1, 3)
    chosen = np.array([selected(sent) for sent, _ in now]).reshape(-1, 3, 3)
    both = [rates(*each) for each in now]
    asked = [Asked(wanted, np.array([each[side] for each in both]).reshape(-1, 3), chosen) for side in (0, -1)]
    waypoints, speed = preset_of(trace, ugv)
    preset, gain = travelled(waypoints, speed, t), scenario.control.motion_gain_1_s
    found = Law(np.zeros((len(t), 3)), np.full(len(t), np.inf))
    # at a corner of a motion either rate may have been used: the closer one counts
    for rate, wish in product(_preset_rates(waypoints, speed, t), asked):
        own = tracking(position, preset, rate, gain, limit)
        command = commanded(trace, position, own, given, rows, wish, limit)
        if numbers[0]:
            command = able(command, heading, numbers, scenario.control.period_s)
        command[standing] = 0.0
        away = np.linalg.norm(recorded - command, axis=1)
        closer = ~(away >= found.away)
        found.command[closer], found.away[closer] = command[closer], away[closer]
    return found


def _preset_rates(waypoints: Array, speed: float, t: Array) -> list[Array]:
    times = corner_times(waypoints, speed)
    legs = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    slopes = np.concatenate([speed * legs / np.where(lengths > 0.0, lengths, 1.0), np.zeros((1, 3))])
    if not len(times):
        slopes = np.zeros((1, 3))
    return [slopes[np.searchsorted(times, t + shift)] for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)]


def _law_of_uav(trace: Trace, name: str, samples: Rows) -> Law:
    """(9)-(11); it feeds the commands of its UGVs of the sample before forward."""
    uav, ugvs, control = trace.scenario.aerial[name], trace.scenario.in_charge(name), trace.scenario.control
    position, recorded = trace.as_seen(name, name), trace.chosen(name)
    centroid = np.mean([trace.as_seen(name, ugv) for ugv in ugvs], axis=0)
    fed = np.mean([trace.command(ugv)[samples] for ugv in ugvs], axis=0)
    fed[trace.t[samples] <= TIME_TOLERANCE_S] = 0.0  # nothing was commanded before the first sample
    over = centroid + np.array([0.0, 0.0, uav.altitude_m])
    below = limited(fed + control.formation_gain_1_s * (over - position), uav.max_speed_m_s)
    given, limit = as_seen(trace, name), uav.max_speed_m_s
    composition = "standing" if trace.scenario.position_error_m or acts_on_old(trace) else "augmented"
    command = avoiding(retreating(below, given, limit, planar=False), given, composition, planar=False, limit=limit)
    return Law(command, np.linalg.norm(recorded - command, axis=1))
