"""A small simulation in numpy: NSBC with avoidance on top and a fixed detour, or scripted velocities."""

import math
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from airground_drake.base.arrays import Array
from airground_drake.scenario.recorded import of_run
from airground_drake.scenario.world import make_world
from airground_drake.sim.components import make_avoidance
from airground_drake.sim.trace import Trace
from builders.layout import HELD, laid_out, reference_at

Drive = Callable[[float], list[list[float]]]
"""Scripted velocities of all robots, m/s, at a control sample, s."""

DETOUR = np.array([[6.3, 4.8, 0.0], [6.3, 7.5, 0.0]])


def simulate(scenario: dict[str, Any], run: str = "d", drive: Drive | None = None, seed: int = 0) -> Trace:
    """Simulate a run: NSBC with avoidance on top and a fixed detour, or scripted velocities as they are."""
    return _Simulation(scenario, run, drive, seed).trace()


class _Simulation:
    def __init__(self, scenario: dict[str, Any], run: str, drive: Drive | None, seed: int) -> None:
        self.scenario, self.run, self.drive, self.rng = scenario, run, drive, np.random.default_rng(seed)
        self.method = scenario["runs"][run]["method"]
        typed = of_run(scenario, run)
        self.avoidance, self.near = make_avoidance(typed), make_world(typed).around(slice(0, len(typed.robots)))
        self.specs = list(scenario["ugvs"].values())
        self.robots = [*scenario["ugvs"], scenario["uav"]["name"]]
        self.n = len(self.specs)
        self.position = np.array([*(ugv["start_m"] for ugv in self.specs), scenario["uav"]["start_m"]])
        self.command = np.zeros((self.n + 1, 3))
        self.noise = np.zeros(self.n)
        decision = scenario["decision"]
        self.zeta, bare = decision["threshold"]["zeta_m"], decision["trigger"] == "bare"
        self.release: float = self.zeta if bare else decision["release_m"]
        self.dwell: float = 0.0 if bare else decision["min_inter_event_s"]
        self.status = np.tile([0.0, 0.0, -1.0, -1.0], (self.n, 1))  # mode, triggers, triggered at, released at
        self.leg = np.zeros(self.n, dtype=int)
        self.issued = np.full(self.n, -1.0)
        self.accepted = np.zeros(self.n)
        self.rows: list[tuple[float, Array, Array, Array]] = []
        self.events: list[dict[str, Any]] = []
        self.decisions: list[dict[str, Any]] = []

    def reference(self, i: int, t: float) -> list[float]:
        return reference_at(self.specs[i]["preset"], t)

    def x(self, i: int, position: Iterable[float], noise: float, t: float) -> float:
        return math.dist(self.reference(i, t), position) + noise

    def trace(self) -> Trace:
        h, duration = self.scenario["control"]["period_s"], self.scenario["duration_s"]
        for i in range(self.n):
            if self.x(i, self.position[i], 0.0, 0.0) >= self.zeta:
                self.transit(i, 1, 0.0)
        self.record(0.0)
        for k in range(round(duration / h)):
            t = k * h
            self.converse(k, t)
            self.command = self.velocities(t) if self.drive is None else np.array(self.drive(t), dtype=float)
            self.advance(t, (k + 1) * h)
        return self.finish()

    def transit(self, i: int, mode: int, t: float) -> None:
        before, self.status[i, 0] = self.status[i, 0], mode
        for kind, happens, column in (("trigger", mode == 1, 2), ("release", before == 1, 3)):
            if happens:
                self.status[i, column] = t
                self.status[i, 1] += kind == "trigger"
                where = self.position[i].tolist()
                self.events.append({"t_s": t, "robot": self.robots[i], "kind": kind, "position_m": where})

    def advance(self, begin: float, end: float) -> None:
        rate = self.scenario["decision"]["noise_m_sqrt_s"] * self.rng.standard_normal(self.n) / math.sqrt(end - begin)
        while begin < end:
            drift = rate - self.scenario["decision"]["leak_1_s"] * self.noise
            found = [event for i in range(self.n) if (event := self.next_event(i, begin, end, drift[i]))]
            until, i, mode = min(found, default=(end, -1, 0))
            self.position = self.position + (until - begin) * self.command
            self.noise = self.noise + (until - begin) * drift
            self.record(until)
            if i >= 0:
                self.transit(i, mode, until)
            begin = until

    def next_event(self, i: int, begin: float, end: float, rate: float) -> tuple[float, int, int] | None:
        """(time, UGV, next mode) of the first transition in (begin, end), by search on a fine grid."""
        motion = list(zip(self.position[i].tolist(), self.command[i].tolist(), strict=True))
        noise = float(self.noise[i])

        def x(t: float) -> float:
            return self.x(i, [p + (t - begin) * v for p, v in motion], noise + (t - begin) * rate, t)

        mode, over = self.status[i, 0], self.status[i, 2] + self.dwell
        if mode == 2:
            return (over, i, 1 if x(over) >= self.zeta else 0) if begin < over <= end else None
        level, sign = (self.zeta, 1.0) if mode == 0 else (self.release, -1.0)
        grid = [begin + 1e-12 + (end - begin - 1e-12) * j / 8 for j in range(9)]
        values = [(t, sign * (x(t) - level)) for t in grid]
        for (a, left), (b, right) in pairwise(values):
            if left < 0.0 <= right:
                t = float(brentq(lambda s: x(s) - level, a, b, xtol=1e-13))
                return t, i, 1 if mode == 0 else 0 if t >= over else 2
        return None

    def converse(self, k: int, t: float) -> None:
        """Every other sample: propose once per intervention, and decide (accept) from the next sample on."""
        intervening = (self.status[:, 0] == 1) & (self.method != "a")
        self.accepted = intervening & (self.issued >= 0.0) & ((self.accepted > 0) | (self.method == "b") | (k % 2 == 0))
        if k % 2:
            return
        for i in np.flatnonzero(intervening & (self.issued >= 0.0) & (self.method not in ("b",))):
            known = {"t_s": t, "robot": self.robots[i], "policy": "detour", "issued_s": self.issued[i]}
            self.decisions.append(known | {"decision": "accept"})
        for i in np.flatnonzero(intervening & (self.issued < 0.0)):
            self.issued[i], self.leg[i] = t, 0
            self.events.append({"t_s": t, "robot": self.robots[i], "kind": "proposal", "position_m": [0.0, 0.0, 0.0]})
        self.issued[~intervening] = -1.0

    def velocities(self, t: float) -> Array:
        control = self.scenario["control"]
        lower = np.zeros((self.n + 1, 3))
        for i in range(self.n):
            reference = np.array(self.reference(i, t))
            rate = (np.array(self.reference(i, t + 1e-6)) - reference) / 1e-6
            lower[i] = rate + control["motion_gain_1_s"] * (reference - self.position[i])
            if self.accepted[i] and self.leg[i] < len(DETOUR):
                offset = DETOUR[self.leg[i]] - self.position[i]
                self.leg[i] += np.linalg.norm(offset) < 0.3
                lower[i] = 2.6 * offset / np.linalg.norm(offset)
        centroid = self.position[: self.n].mean(axis=0) + np.array([0.0, 0.0, self.scenario["uav"]["altitude_m"]])
        lower[self.n] = control["formation_gain_1_s"] * (centroid - self.position[self.n])
        return self.avoidance.command(lower, self.position, self.near)

    def record(self, t: float) -> None:
        x = [self.x(i, self.position[i], self.noise[i], t) for i in range(self.n)]
        held = np.column_stack([self.noise, x, self.status, self.accepted - 1.0])
        self.rows.append((t, self.position, self.command, held))

    def finish(self) -> Trace:
        t, position, velocity, held = (np.array(values) for values in zip(*self.rows, strict=True))
        times = [] if not self.decisions else (0.002 + 0.001 * self.rng.random(len(self.decisions))).tolist()
        columns = {name: held[:, :, k] for k, name in enumerate([*HELD, "executing"])}
        timings = {"decision_times_s": times}
        return laid_out(self.scenario, self.run, t, position, velocity, columns, self.events, self.decisions, timings)
