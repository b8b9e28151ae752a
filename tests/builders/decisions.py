"""Recorded decisions, on problems that are small enough to enumerate every plan."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.answer import Rules, settle
from airground_drake.gatekeeper.solution import Solution
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.run.trace import PROBLEM_ARRAYS, PROBLEM_SCALARS, Trace
from airground_drake.scenarios.schema import Gatekeeper, Obstacle, Preset, Run, Scenario, Ugv
from builders.layout import decision_table
from builders.scenarios import AWAY
from builders.simulation import simulate

STAGES, STAGE_S, TERMINAL_S = 8, 0.05, 0.03

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
        terminal_weight: float = TERMINAL_S,
    ) -> None:
        rng = np.random.default_rng(seed)
        planar = np.array([1.0, 1.0, 0.0])
        self.accept = (np.array([2.0, 3.0, 0.0]) + rng.uniform(-1.0, 1.0, (STAGES, 3))) * planar
        self.refuse = (np.array([0.0, 0.5, 0.0]) + rng.uniform(-0.4, 0.4, (STAGES, 3))) * planar
        self.initial, self.reference, self.centres, self.distances = initial, reference, centres, distances
        self.error_weight, self.slack_weight, self.terminal_weight = 1.0, slack_weight, terminal_weight
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
        total = self.terminal_weight * self.error_weight * np.sum((self.reference[-1] - positions[-1]) ** 2)
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
    gate.terminal_weight_s = TERMINAL_S
    spec = Scenario(
        name="decisions", duration_s=0.5, ugvs={"ugv1": ugv(0.0), "ugv2": ugv(-3.0)}, uav=AWAY, gatekeeper=gate,
        obstacles={"rock": Obstacle([1.2, 2.4, 0.0]), "far": Obstacle([30.0, 0.0, 0.0])}, runs={"c": Run("c")},
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
    cheapest = min(ALL_PLANS, key=lambda plan: data.plan_cost(plan, along=True))
    plans = [cheapest if route == "mixed_integer" else rounded, np.ones(STAGES), np.zeros(STAGES)]
    best = min(plans, key=data.plan_cost)
    positions = data.positions(best)
    along = route != "nonlinear"
    least = min(data.plan_cost(plan, along=True) for plan in plans)
    bound = {"relaxed": optimum, "mixed_integer": least}.get(route, -1.0)
    rounds = route != "mixed_integer"
    return Solution(
        accept_first=best[0] == 1.0,
        status="optimal",
        objective=data.cost(positions),
        route_bound=bound,
        gap=(least - bound) / least if along else -1.0,
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
    base = simulate(spec, "c", lambda t: [[0.1, 0.2, 0.0], [0.5, 0.1, 0.0], [0.0, 0.0, 0.0]])
    rules = Rules(switching_margin=spec["gatekeeper"]["switching_margin"], min_dwell=0.2)
    standing, since, decisions, problems = SILENT, 0.0, [], []
    for k in range(1, 7):
        t = k * STAGE_S
        data = gate_data_at(base, t)
        found = solve_as_documented(data, route)
        throughout = data.plan_cost(np.ones(STAGES)), data.plan_cost(np.zeros(STAGES))
        accepted, reason = settle(found, throughout, standing, t - since, rules)
        answer = ACCEPT if accepted else REFUSE
        standing, since = answer, since if answer == standing else t
        decisions.append(
            {
                "t_s": t, "robot": "ugv1", "policy": "detour", "issued_s": 0.0, "reason": reason,
                "decision": "accept" if accepted else "refuse", "status": found.status, "route": route,
                "first_stage": "accept" if found.accept_first else "refuse", "objective": found.objective,
                "relaxed_first_stage": found.relaxed_first_stage, "route_bound": found.route_bound, "gap": found.gap,
                "objective_accept": found.objective_accept, "objective_refuse": found.objective_refuse,
                "accept_throughout": throughout[0], "refuse_throughout": throughout[1],
                "rounding_deviation_s": found.rounding_deviation, "predicted_clearance_m": found.clearance,
            }
        )  # fmt: skip
        arrays = (
            data.initial, data.accept, data.refuse, data.reference, data.centres, data.distances,
            found.plan, found.positions, found.relaxed, found.rounded, found.normals,
        )  # fmt: skip
        flat = [[] if array is None else array.ravel().tolist() for array in arrays]
        problems.append([STAGE_S, data.error_weight, data.slack_weight, data.terminal_weight, *flat])
    return replace(
        base,
        decisions=decision_table(decisions),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )
