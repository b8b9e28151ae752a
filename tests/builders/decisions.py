"""Problem (26) of a decision with few stages, written down for tests: loops instead of the claims' broadcasting."""

from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from scipy.optimize import minimize

from airground_drake.base.arrays import Array
from airground_drake.verify.runs.gate_record import DecisionRecord

STAGES = 8
ALL_PLANS = np.array(list(product((0.0, 1.0), repeat=STAGES)))
ARRAYS = ("initial_m", "accept_m_s", "refuse_m_s", "reference_m", "centres_m", "distances_m", "normals")
WEIGHTS = ("dt", "error_weight", "slack_weight", "terminal_weight")


@dataclass
class GateData:
    initial_m: Array
    accept_m_s: Array
    refuse_m_s: Array
    reference_m: Array
    centres_m: Array
    distances_m: Array
    normals: Array
    dt: float
    error_weight: float
    slack_weight: float
    terminal_weight: float

    @classmethod
    def of(cls, row: DecisionRecord) -> Self:
        """The problem of a recorded decision, with the half-planes that ask for something."""
        return cls(*(row[name] for name in ARRAYS[:-1]), row.half_planes, *(getattr(row, name) for name in WEIGHTS))

    def row(self, plan: Array) -> DecisionRecord:
        arrays: dict[str, Array | None] = {name: getattr(self, name) for name in ARRAYS}
        return DecisionRecord(
            {"robot": "ugv1", "t_s": 0.0}, *(getattr(self, name) for name in WEIGHTS), arrays | {"plan": plan}
        )

    def positions(self, omega: Array) -> Array:
        at, path = self.initial_m.copy(), []
        for k in range(STAGES):
            at = at + self.dt * (omega[k] * self.accept_m_s[k] + (1.0 - omega[k]) * self.refuse_m_s[k])
            path.append(at)
        return np.array(path)

    def plan_cost(self, omega: Array, along: bool = False) -> float:
        positions = self.positions(omega)
        total = self.terminal_weight * self.error_weight * np.sum((self.reference_m[-1] - positions[-1]) ** 2)
        for k, at in enumerate(positions):
            slack = 0.0
            for j, distance in enumerate(self.distances_m):
                away = at - self.centres_m[k, j]
                if along and not self.normals[k, j].any():
                    continue
                slack = max(slack, distance - (self.normals[k, j] @ away if along else np.linalg.norm(away)))
            error = np.sum((self.reference_m[k] - at) ** 2)
            total += self.dt * (self.error_weight * error + self.slack_weight * slack**2)
        return float(total)

    def relaxed_optimum(self) -> float:
        """By a quasi-Newton method in a box: another method, and another form, than the claim's."""
        found = minimize(
            lambda omega: self.plan_cost(omega, along=True), np.full(STAGES, 0.5), bounds=[(0.0, 1.0)] * STAGES,
            method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-10, "maxfun": 100000},
        )  # fmt: skip
        return float(found.fun)
