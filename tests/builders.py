"""Traces and scenarios for tests, made without the simulator.

- Scenarios: `case_a`, `lone`, `changed`; `gate_scenario` for recorded decisions.
- Runs: `simulate` (a small numpy simulation, of case A or of scripted motions), and those that many tests share.
- Edits of a trace: `with_signals`, `with_meta`, `with_scenario`, `with_events`, `with_decision`, `moved`; edits by name
  (`set_nan`, `dropped`, `bumped`, `rows`) are functions from trace to trace.
- Recorded decisions: `decided_run`, six of them on problems (`GateData`) that are small enough to enumerate every plan.

Nothing here is shared with the checkers; of the package the avoidance inequalities and the rules of the gatekeeper's
answer are used.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from functools import cache
from itertools import pairwise, product
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq, minimize

from airground_drake.arrays import Array
from airground_drake.gatekeeper.answer import Rules, settle
from airground_drake.gatekeeper.solution import Solution
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.schema import Decision, Gatekeeper, Obstacle, Preset, Run, Scenario, Uav, Ugv
from airground_drake.trace import DECISION_COLUMNS, PROBLEM_ARRAYS, PROBLEM_SCALARS, SCHEMA, Trace

Drive = Callable[[float], list[list[float]]]
"""Scripted velocities of all robots, m/s, at a control sample, s."""

DETOUR = np.array([[6.3, 4.8, 0.0], [6.3, 7.5, 0.0]])

AWAY = Uav(start_m=[50.0, 50.0, 2.0], target_m=[50.0, 50.0, 2.0])


def case_a(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Geometry of case A with the printed reference speed, resolved; `changes` maps dotted keys to values."""
    scenario = Scenario(
        name="synthetic",
        duration_s=18.0,
        ugvs={
            "ugv1": Ugv([1.0, 0.5, 0.0], [3.3, 13.0, 0.0], Preset([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]], 1.0)),
            "ugv2": Ugv([-1.0, 0.5, 0.0], [-1.3, 13.0, 0.0], Preset([[-1.3, 0.0, 0.0], [-1.3, 13.0, 0.0]], 1.0)),
        },
        uav=Uav(start_m=[0.2, 1.0, 2.0], target_m=[1.0, 13.0, 2.0]),
        obstacles={
            "obstacle_1": Obstacle([1.7, 4.0, 0.0]),
            "obstacle_2": Obstacle([4.0, 7.0, 0.0]),
            "obstacle_3": Obstacle([-0.5, 5.0, 0.0]),
        },
        decision=Decision(noise_m_sqrt_s=0.004),
        runs={m: Run(method=m) for m in "bcd"} | {"a": Run(method="a", stalls_m={"ugv1": [3.37, 5.10, 0.0]})},
    )
    return changed(asdict(scenario), changes or {})


def lone(start: list[float], target: list[float], preset: Preset, duration_s: float, **more: Any) -> dict[str, Any]:
    """One scripted UGV far from everything else."""
    scenario = Scenario(
        duration_s=duration_s, ugvs={"ugv1": Ugv(start, target, preset)}, uav=AWAY, runs={"d": Run()}, **more
    )
    return asdict(scenario)


def changed(tree: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A copy of nested dicts with some dotted keys set."""
    tree = copy.deepcopy(tree)
    for key, value in changes.items():
        *path, last = key.split(".")
        node = tree
        for part in path:
            node = node[part]
        assert last in node, key
        node[last] = value
    return tree


def simulate(scenario: dict[str, Any], run: str = "d", drive: Drive | None = None, seed: int = 0) -> Trace:
    """Simulate a run: NSBC with avoidance on top and a fixed detour, or scripted velocities as they are."""
    return _Simulation(scenario, run, drive, seed).trace()


class _Simulation:
    def __init__(self, scenario: dict[str, Any], run: str, drive: Drive | None, seed: int) -> None:
        self.scenario, self.run, self.drive, self.rng = scenario, run, drive, np.random.default_rng(seed)
        self.method = scenario["runs"][run]["method"]
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
        self.rows: list[list[float]] = []
        self.events: list[dict[str, Any]] = []
        self.decisions: list[dict[str, Any]] = []

    def reference(self, i: int, t: float) -> list[float]:
        preset = self.specs[i]["preset"]
        left = preset["speed_m_s"] * t
        for a, b in pairwise(preset["waypoints_m"]):
            length = math.dist(a, b)
            if left <= length:
                return [p + (q - p) * left / length for p, q in zip(a, b, strict=True)]
            left -= length
        return list(preset["waypoints_m"][-1])

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
            found = [event for i in range(self.n) if (event := self.next_event(i, begin, end, rate[i]))]
            until, i, mode = min(found, default=(end, -1, 0))
            self.position = self.position + (until - begin) * self.command
            self.noise = self.noise + (until - begin) * rate
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
            row = dict.fromkeys(DECISION_COLUMNS, -1.0) | {"t_s": t, "robot": self.robots[i], "policy": "detour"}
            self.decisions.append(row | {"issued_s": self.issued[i], "decision": "accept", "status": "", "route": ""})
        for i in np.flatnonzero(intervening & (self.issued < 0.0)):
            self.issued[i], self.leg[i] = t, 0
            self.events.append({"t_s": t, "robot": self.robots[i], "kind": "proposal", "position_m": [0.0, 0.0, 0.0]})
        self.issued[~intervening] = -1.0

    def velocities(self, t: float) -> Array:
        """NSBC with the avoidance inequalities on top; an accepted detour replaces the tracking task."""
        control, safe = self.scenario["control"], self.scenario["safe_distance"]
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
        speed = np.linalg.norm(lower, axis=1)
        lower *= np.minimum(1.0, 5.9 / np.maximum(speed, 1e-9))[:, None]
        obstacles = np.array([o["position_m"] for o in self.scenario["obstacles"].values()]).reshape(-1, 3)
        m = len(obstacles)
        centre, distance = np.empty((self.n + 1, m + self.n, 3)), np.full((self.n + 1, m + self.n), safe["obstacle_m"])
        share, mobility = np.ones(distance.shape), np.ones((self.n + 1, 3))
        centre[:, :m], share[:, m:], mobility[: self.n, 2] = obstacles, 0.5, 0.0
        for i in range(self.n + 1):
            centre[i, m:] = np.delete(self.position, i, axis=0)
            distance[i, m:] = safe["air_ground_m"] if i == self.n else safe["ugv_m"]
        distance[: self.n, -1] = safe["air_ground_m"]
        avoidance = Avoidance(control["avoidance_gain_1_s"], control["period_s"], control["sensing_range_m"])
        spaces = avoidance.half_spaces(self.position, mobility, Surroundings(centre, distance, share))
        return avoidance.apply(lower, spaces)

    def record(self, t: float) -> None:
        row = [t, *self.position.ravel(), *self.command.ravel()]
        for i in range(self.n):
            x = self.x(i, self.position[i], self.noise[i], t)
            row += [*self.reference(i, t), self.noise[i], x, *self.status[i], float(self.accepted[i])]
        self.rows.append(row)

    def finish(self) -> Trace:
        names = ["t_s", *(f"{r}.{a}_m" for r in self.robots for a in "xyz")]
        names += [f"{r}.v{a}_m_s" for r in self.robots for a in "xyz"]
        held = ["noise_m", "decision_variable_m", "mode", "triggers", "triggered_at_s", "released_at_s", "accepted"]
        for ugv in self.robots[:-1]:
            names += [f"{ugv}.{name}" for name in [*(f"ref_{a}_m" for a in "xyz"), *held]]
        meta = {"schema": SCHEMA, "run": self.run, "method": self.method, "composition": "augmented", "seed": 0}
        meta |= {"robots": self.robots, "ugvs": self.robots[:-1], "zeta_m": self.zeta, "faults": []}
        meta |= {"scenario": self.scenario, "events": sorted(self.events, key=lambda event: event["t_s"])}
        decisions = pd.DataFrame(self.decisions, columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS)
        times = [] if decisions.empty else (0.002 + 0.001 * self.rng.random(len(decisions))).tolist()
        return Trace(meta, pd.DataFrame(self.rows, columns=names), decisions, {"decision_times_s": times})


def with_signals(trace: Trace, edit: Callable[[pd.DataFrame], pd.DataFrame | None]) -> Trace:
    """A copy whose signals were edited, in place or by returning new ones."""
    signals = trace.signals.copy()
    edited = edit(signals)
    return replace(trace, signals=signals if edited is None else edited)


def with_meta(trace: Trace, **changes: Any) -> Trace:
    """A copy with entries of `meta` replaced."""
    return replace(trace, meta=copy.deepcopy(trace.meta) | changes)


def with_scenario(trace: Trace, **changes: Any) -> Trace:
    """A copy that claims to be of another scenario: dotted keys, with __ for the dots."""
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return with_meta(trace, scenario=changed(trace.scenario, dotted))


def with_events(trace: Trace, change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]]) -> Trace:
    return with_meta(trace, events=sorted(change(list(trace.events)), key=lambda event: float(event["t_s"])))


def moved(trace: Trace, robot: str, row: int, offset: list[float]) -> Trace:
    """A copy in which a robot is elsewhere at one row, with commands that lead there and back."""

    def edit(signals: pd.DataFrame) -> None:
        dt = np.diff(signals["t_s"].to_numpy())
        for axis, delta in zip("xyz", offset, strict=True):
            place, velocity = (
                signals[f"{robot}.{axis}_m"].to_numpy(copy=True),
                signals[f"{robot}.v{axis}_m_s"].to_numpy(copy=True),
            )
            place[row] += delta
            velocity[row] += delta / dt[row - 1]
            if row + 1 < len(signals):
                velocity[row + 1] -= delta / dt[row]
            signals[f"{robot}.{axis}_m"], signals[f"{robot}.v{axis}_m_s"] = place, velocity

    return with_signals(trace, edit)


STILL = Preset([[0.0, 0.0, 0.0]], 1.0)


@cache
def run_of(method: str) -> Trace:
    """One run of the synthetic case A by each method."""
    return simulate(case_a(), method)


@cache
def chattering() -> Trace:
    """A bare trigger whose decision variable hovers at the threshold: many triggers."""
    decision = Decision(trigger="bare", noise_m_sqrt_s=0.3, min_inter_event_s=0.5)
    return simulate(lone([3.01, 0.0, 0.0], [3.0, 0.0, 0.0], STILL, 3.0, decision=decision), drive=at_rest, seed=28)


def at_rest(t: float) -> list[list[float]]:
    """Nobody moves."""
    return [[0.0] * 3, [0.0] * 3]


def there_and_back(t: float) -> list[list[float]]:
    """Out beyond the threshold, back below the release level, out again and home."""
    speed = 2.0 if t < 2.0 or 3.5 <= t < 6.0 else -2.0 if t < 8.9 else 0.0
    return [[speed, 0.0, 0.0], [0.0] * 3]


def refractory(noise: float = 0.0) -> Trace:
    """Triggers at 1.5 s; released at 3.25 s; above again before the dwell of 4 s is over: triggers at 5.5 s."""
    decision = Decision(min_inter_event_s=4.0, noise_m_sqrt_s=noise)
    return simulate(lone([0.0] * 3, [0.2, 0.0, 0.0], STILL, 10.0, decision=decision), drive=there_and_back)


def passing_by(offset: float) -> Trace:
    """A UGV passes an obstacle at 2 m + offset, closest in the middle between two rows."""
    scenario = lone(
        [-0.5125, 2.0 + offset, 0.0], [0.4875, 2.0 + offset, 0.0], STILL, 1.0, obstacles={"o": Obstacle([0.0] * 3)}
    )
    return simulate(scenario, drive=lambda t: [[1.0, 0.0, 0.0], [0.0] * 3])


def set_nan(column: str) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals.loc[300, column] = np.nan

    return lambda trace: with_signals(trace, edit)


def dropped(column: str) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: signals.drop(columns=column))


def bumped(column: str, by: float, row: int = 500) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals[column] += by * (signals.index == row)

    return lambda trace: with_signals(trace, edit)


def rows(keep: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: keep(signals).reset_index(drop=True))


def first_of(events: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return next(event for event in events if event["kind"] == kind)


STAGES, STAGE_S = 8, 0.05

ALL_PLANS = np.array(list(product((0.0, 1.0), repeat=STAGES)))


class GateData:
    """One problem (26) and its costs, written down for a test: loops instead of the checkers' broadcasting."""

    def __init__(
        self,
        seed: int,
        initial: Array,
        reference: Array,
        centres: Array,
        distances: Array,
        slack_weight: float = 10.0,
    ) -> None:
        rng = np.random.default_rng(seed)
        planar = np.array([1.0, 1.0, 0.0])
        self.accept = (np.array([2.0, 3.0, 0.0]) + rng.uniform(-1.0, 1.0, (STAGES, 3))) * planar
        self.refuse = (np.array([0.0, 0.5, 0.0]) + rng.uniform(-0.4, 0.4, (STAGES, 3))) * planar
        self.initial, self.reference, self.centres, self.distances = initial, reference, centres, distances
        self.error_weight, self.slack_weight = 1.0, slack_weight
        self.guide = min((self.positions(np.full(STAGES, mode)) for mode in (0.0, 1.0)), key=self.cost)
        away = self.guide[:, None] - centres
        self.normals = away / np.linalg.norm(away, axis=2)[:, :, None]

    def positions(self, omega: Array) -> Array:
        at, path = self.initial.copy(), []
        for k in range(STAGES):
            at = at + STAGE_S * (omega[k] * self.accept[k] + (1.0 - omega[k]) * self.refuse[k])
            path.append(at)
        return np.array(path)

    def cost(self, positions: Array, along: bool = False) -> float:
        total = 0.0
        for k, at in enumerate(positions):
            slack = 0.0
            for j, distance in enumerate(self.distances):
                away = at - self.centres[k, j]
                slack = max(slack, distance - (self.normals[k, j] @ away if along else np.linalg.norm(away)))
            total += STAGE_S * (
                self.error_weight * np.sum((self.reference[k] - at) ** 2) + self.slack_weight * slack**2
            )
        return float(total)

    def plan_cost(self, omega: Array, along: bool = False) -> float:
        return self.cost(self.positions(omega), along)

    def relaxed(self) -> tuple[Array, float]:
        """By a quasi-Newton method in a box: another method, and another form, than the checker's."""
        best = minimize(
            lambda omega: self.plan_cost(omega, along=True), np.full(STAGES, 0.5), bounds=[(0.0, 1.0)] * STAGES,
            method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-10, "maxfun": 100000},
        )  # fmt: skip
        return np.clip(best.x, 0.0, 1.0), float(best.fun)

    def clearance(self, positions: Array) -> float:
        return float((np.linalg.norm(positions[:, None] - self.centres, axis=2) - self.distances).min())


def sum_up_rounding(relaxed: Array) -> Array:
    rounded: list[float] = []
    for k in range(STAGES):
        deficits = relaxed[: k + 1].sum() - sum(rounded), (1.0 - relaxed[: k + 1]).sum() - (k - sum(rounded))
        rounded.append(1.0 if deficits[0] >= deficits[1] else 0.0)
    return np.array(rounded)


def gate_scenario(route: str) -> dict[str, Any]:
    def ugv(x: float) -> Ugv:
        return Ugv([x, 0.0, 0.0], [x, 9.0, 0.0], Preset([[x, 2.0, 0.0], [x, 9.0, 0.0]], 1.0))

    gate = Gatekeeper(route=route, horizon_s=STAGES * STAGE_S, stages=STAGES, slack_weight_1_m2_s=10.0)
    spec = Scenario(
        duration_s=0.5, ugvs={"ugv1": ugv(0.0), "ugv2": ugv(-3.0)}, uav=AWAY, gatekeeper=gate,
        obstacles={"rock": Obstacle([1.2, 2.4, 0.0]), "far": Obstacle([30.0, 0.0, 0.0])}, runs={"d": Run()},
    )  # fmt: skip
    return asdict(spec)


def gate_data_at(trace: Trace, t: float) -> GateData:
    """What ugv1 senses: the rock, and ugv2, which drives at it."""
    k = int(np.argmin(np.abs(trace.t - t)))
    after = STAGE_S * np.arange(1, STAGES + 1)[:, None]
    rock = np.tile([1.2, 2.4, 0.0], (STAGES, 1))
    other = trace.position("ugv2")[k] + after * np.array([0.5, 0.1, 0.0])
    centres, distances = np.stack([rock, other], axis=1), np.array([2.0, 2.0])
    reference = np.array([0.0, 2.0, 0.0]) + (t + after) * np.array([0.0, 1.0, 0.0])
    return GateData(round(1000 * t), trace.position("ugv1")[k], reference, centres, distances)


def solve_as_documented(data: GateData, route: str) -> Solution:
    """As the route's documentation has it."""
    relaxed, optimum = data.relaxed()
    rounded = sum_up_rounding(relaxed)
    every = route in ("enumeration", "branch_and_bound")
    plans = [*ALL_PLANS] if every else [rounded, np.ones(STAGES), np.zeros(STAGES)]
    best = min(plans, key=data.plan_cost)
    positions = data.positions(best)
    along = route in ("relaxed", "branch_and_bound")
    least = min(data.plan_cost(plan, along) for plan in (best, rounded, np.ones(STAGES), np.zeros(STAGES)))
    bound = {"relaxed": optimum, "enumeration": least}.get(route, -1.0)
    if route == "branch_and_bound":
        bound = 0.99 * min(data.plan_cost(plan, along=True) for plan in ALL_PLANS)
        least = min(data.plan_cost(plan, along=True) for plan in (best, np.ones(STAGES), np.zeros(STAGES)))
    rounds, solves = route in ("relaxed", "nonlinear"), route in ("relaxed", "enumeration", "branch_and_bound")
    return Solution(
        accept_first=best[0] == 1.0,
        status="optimal",
        objective=data.cost(positions),
        route_bound=bound,
        gap=(least - bound) / least if solves else -1.0,
        objective_accept=min(data.plan_cost(plan) for plan in plans if plan[0] == 1.0),
        objective_refuse=min(data.plan_cost(plan) for plan in plans if plan[0] == 0.0),
        relaxed_first_stage=float(relaxed[0]) if rounds else -1.0,
        rounding_deviation=float(STAGE_S * np.abs(np.cumsum(relaxed - rounded)).max()) if rounds else -1.0,
        clearance=data.clearance(positions),
        plan=best,
        positions=positions,
        relaxed=relaxed if rounds else None,
        rounded=rounded if rounds else None,
        normals=data.normals if along else None,
    )


def decided_run(route: str = "relaxed") -> Trace:
    """Six decisions of ugv1 on a proposal of t = 0."""
    spec = gate_scenario(route)
    base = simulate(spec, "d", lambda t: [[0.1, 0.2, 0.0], [0.5, 0.1, 0.0], [0.0, 0.0, 0.0]])
    rules = Rules(switching_margin=spec["gatekeeper"]["switching_margin"], min_dwell=0.2, max_bend=0.5)
    standing, since, decisions, problems = SILENT, 0.0, [], []
    for k in range(1, 7):
        t = k * STAGE_S
        data = gate_data_at(base, t)
        found = solve_as_documented(data, route)
        throughout = data.plan_cost(np.ones(STAGES)), data.plan_cost(np.zeros(STAGES))
        accepted, reason = settle(found, throughout, 0.1, standing, t - since, rules)
        answer = ACCEPT if accepted else REFUSE
        standing, since = answer, since if answer == standing else t
        decisions.append(
            {
                "t_s": t, "robot": "ugv1", "policy": "detour", "issued_s": 0.0, "reason": reason,
                "decision": "accept" if accepted else "refuse", "status": found.status, "route": route,
                "first_stage": "accept" if found.accept else "refuse", "objective": found.objective,
                "relaxed_first_stage": found.relaxed_first_stage, "route_bound": found.route_bound, "gap": found.gap,
                "objective_accept": found.objective_accept, "objective_refuse": found.objective_refuse,
                "accept_throughout": throughout[0], "refuse_throughout": throughout[1],
                "rounding_deviation_s": found.rounding_deviation, "predicted_clearance_m": found.clearance,
                "bend": 0.1,
            }
        )  # fmt: skip
        arrays = (
            data.initial, data.accept, data.refuse, data.reference, data.centres, data.distances,
            found.plan, found.positions, found.relaxed, found.rounded, found.normals,
        )  # fmt: skip
        flat = [[] if array is None else array.ravel().tolist() for array in arrays]
        problems.append([STAGE_S, data.error_weight, data.slack_weight, *flat])
    return replace(
        base,
        decisions=pd.DataFrame(decisions, columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )


DecisionEdit = Callable[[dict[str, Any], dict[str, Any]], None]


def with_decision(trace: Trace, edit: DecisionEdit, row: int = 2) -> Trace:
    """A copy in which one decision, given as its columns and its problem (arrays flat), was edited."""
    decisions, problems = trace.decisions.to_dict("records"), trace.problems.to_dict("records")
    problems[row] = {k: np.array(v, dtype=float) if k in PROBLEM_ARRAYS else v for k, v in problems[row].items()}
    edit(decisions[row], problems[row])
    return replace(
        trace,
        decisions=pd.DataFrame(decisions, columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )
