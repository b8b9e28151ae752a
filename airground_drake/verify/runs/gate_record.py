"""Recorded gatekeeper decisions, and code shared by claims about them.

The paper's formulas are written independently in numpy; N is the number of stages, m of the points to avoid.
"""

import abc
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.sim.tables import PROBLEM_ARRAYS, PROBLEM_SCALARS
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.proposals import GATED_METHODS, talk_is_due, unreached, without_proposals

# Recorded and recomputed positions may differ by this, m: rounding of N additions errs by 1e-13 m.
POSITION_TOLERANCE_M = 1e-9
# Costs are compared relative to the cheaper constant plan's, but to no less than this: 1 mm of error for 1 s.
LEAST_COST = 1e-6
# Arrays of a problem that a route may leave out.
MAY_BE_EMPTY = ("plan", "positions_m", "relaxed", "rounded", "normals")


@dataclass(frozen=True, eq=False)
class DecisionRecord:
    """One decision, and its problem if it has one: a row of `Trace.decisions` and of `Trace.problems`."""

    given: dict[str, Any]  # the columns of `Trace.decisions`
    dt: float = -1.0  # length of a stage, s
    error_weight: float = -1.0  # a of (25), 1/(m^2 s)
    slack_weight: float = -1.0  # b of (25), 1/(m^2 s)
    terminal_weight: float = -1.0  # w of the terminal cost w a ||rho_rd - rho_N||^2 that is added to (25), s
    # Arrays of `Trace.problems` by name, in the shapes that are stated there; None where empty.
    data: dict[str, Array | None] = field(default_factory=dict)

    @property
    def t_s(self) -> float:
        return float(self.given["t_s"])

    @property
    def robot(self) -> str:
        return str(self.given["robot"])

    @property
    def number(self) -> int:
        return int(self.given["number"])

    def __getitem__(self, name: str) -> Array:
        array = self.data[name]
        if array is None:
            raise TraceError(f"{self.label}: the problem has no {name!r}")
        return array

    @property
    def label(self) -> str:
        return f"decision of {self.robot} at t = {self.given['t_s']} s"

    @property
    def planned(self) -> bool:
        """Whether it rests on a plan; otherwise it is a refusal without a plan."""
        return self.data["plan"] is not None

    @property
    def stages(self) -> int:
        return len(self["reference_m"])

    def positions(self, omega: Array) -> Array:
        """(23): omega (..., N) to positions at the ends of the stages, (..., N, 3), m."""
        velocity = self["refuse_m_s"] + omega[..., None] * (self["accept_m_s"] - self["refuse_m_s"])
        return self["initial_m"] + self.dt * np.cumsum(velocity, axis=-2)

    def gaps(self, positions: Array, normals: Array | None = None) -> Array:
        """Distances minus d at the end of each stage, (..., N, m), m; along normals (N, m, 3) if given."""
        # Normals are unit vectors, or 0 where no half-plane applies: the gap there is 0.
        away = positions[..., None, :] - self["centres_m"]
        if normals is None:
            return np.linalg.norm(away, axis=-1) - self["distances_m"]
        reach = np.einsum("...kmi,kmi->...km", away, normals)
        return np.where(normals.any(axis=-1), reach - self["distances_m"], 0.0)

    @property
    def unit_normals(self) -> bool:
        """Whether unit normals were recorded, along which the optimum can be bounded."""
        if self.data["normals"] is None:
            return False
        return bool((np.abs(np.linalg.norm(self["normals"], axis=2) - 1.0) <= POSITION_TOLERANCE_M).all())

    @cached_property
    def half_planes(self) -> Array:
        """Normals of the half-planes in place of (26d), (N, m, 3): 0 where no plan can come nearer than d."""
        # At the end of a stage plans are between the sums of the smaller and of the larger velocities so far.
        low, high = (
            self["initial_m"] + self.dt * np.cumsum(bound(self["accept_m_s"], self["refuse_m_s"]), axis=0)[:, None]
            for bound in (np.minimum, np.maximum)
        )
        away = np.clip(self["centres_m"], low, high) - self["centres_m"]
        near = np.linalg.norm(away, axis=-1) < self["distances_m"]
        return near[..., None] * self["normals"]

    def clearance(self, positions: Array, normals: Array | None = None) -> Array:
        """The least of the `gaps` of each stage, (..., N), m; infinite without points."""
        return self.gaps(positions, normals).min(axis=-1, initial=np.inf)

    @cached_property
    def lasting(self) -> Array:
        """Weight of the task error at the end of each stage, (N,), s: its length, plus w at the last one."""
        return np.append(np.full(self.stages - 1, self.dt), self.dt + self.terminal_weight)

    def cost(self, positions: Array, normals: Array | None = None) -> Any:
        """(25) by the right-hand rectangle rule, slack being max(0, d - distance), and the terminal cost; (...)."""
        error = np.square(positions - self["reference_m"]).sum(axis=-1) @ self.lasting
        slack = np.square(np.minimum(0.0, self.clearance(positions, normals))).sum(axis=-1)
        return self.error_weight * error + self.dt * self.slack_weight * slack

    @cached_property
    def constant(self) -> Array:
        """Positions of the plans that refuse and that accept throughout, (2, N, 3), m."""
        return self.positions(np.array([[0.0], [1.0]]) * np.ones(self.stages))

    @cached_property
    def scale(self) -> float:
        """The reference cost for relative differences."""
        return max(LEAST_COST, float(self.cost(self.constant).min()))


@per_trace
def rows_of(trace: Trace) -> list[DecisionRecord]:
    """All decisions, with their problems (26); method (d) has no problems."""
    given = [{str(name): value for name, value in row.items()} for row in trace.decisions.to_dict("records")]
    due = len(given) if trace.meta["method"] in ON_TOP else 0
    if len(trace.problems) != due:
        raise TraceError(
            f"{len(given)} decisions under method ({trace.meta['method']}), but {len(trace.problems)} problems"
        )
    for ugv, times in trace.decisions.groupby("robot")["t_s"]:
        if not (np.diff(times.to_numpy(dtype=np.float64)) >= 0.0).all():
            raise TraceError(f"the decisions of {ugv} are not in order of their times")
    problems = trace.problems.to_dict("records")
    rows = [DecisionRecord(row) for row in given]
    if due:
        rows = [_solved(trace, row, problem) for row, problem in zip(given, problems, strict=True)]
    for row in rows:
        if not np.isfinite([value for value in row.given.values() if isinstance(value, float)]).all():
            raise TraceError(f"{row.label}: it has numbers that are not finite")
        if row.robot not in trace.ugvs:
            raise TraceError(f"{row.label}: not of a UGV of the trace")
    return rows


def reasons_of(trace: Trace) -> dict[str, int]:
    return {str(reason): int(count) for reason, count in trace.decisions["reason"].value_counts().items()}


def _solved(trace: Trace, given: dict[str, Any], problem: dict[Any, Any]) -> DecisionRecord:
    gate = trace.scenario.gatekeeper
    scalars = [float(problem[name]) for name in PROBLEM_SCALARS]
    dt, error, slack, terminal = scalars
    flat = {name: np.asarray(problem[name], dtype=np.float64).ravel() for name in PROBLEM_ARRAYS}
    row = DecisionRecord(given, dt, error, slack, terminal, _shaped(flat, int(gate.stages)))
    if not all(np.isfinite(values).all() for values in (np.array(scalars), *flat.values())):
        raise TraceError(f"{row.label}: its problem has numbers that are not finite")
    if given["route"] != gate.route:
        raise TraceError(f"{row.label}: not by the scenario's route")
    decided = given["status"] in ("optimal", "budget_spent", "solver_failed")
    if row.planned != decided or (decided and row.data["positions_m"] is None):
        raise TraceError(f"{row.label}: a plan without positions, or not what its status {given['status']!r} says")
    return row


def _shaped(flat: dict[str, Array], n: int) -> dict[str, Array | None]:
    """Arrays of a problem of n stages in their shapes; None for what is empty and may be."""
    m = len(flat["distances_m"])
    shapes: dict[str, tuple[int, ...]] = {"initial_m": (3,), "distances_m": (m,)}
    shapes |= dict.fromkeys(("centres_m", "normals"), (n, m, 3)) | dict.fromkeys(("plan", "relaxed", "rounded"), (n,))
    shapes |= dict.fromkeys(("accept_m_s", "refuse_m_s", "reference_m", "positions_m"), (n, 3))
    shaped: dict[str, Array | None] = {}
    for name, values in flat.items():
        shape = shapes[name]
        size = int(np.prod(shape))
        if values.size != size and (values.size or name not in MAY_BE_EMPTY):
            raise TraceError(f"a problem's {name!r} has {values.size} numbers, not {size}")
        shaped[name] = values.reshape(shape) if values.size == size else None
    return shaped


class Deviation:
    """A comparison: the difference of a recorded value from the expected one, and its tolerance."""

    def __init__(self, row: DecisionRecord, what: str, by: Any, allowed: float, **more: Any) -> None:
        # by: differences, of any shape; the largest absolute one counts.
        self.row = row
        self.what = what
        self.allowed = allowed
        self.more = more
        self.off = float(np.abs(by).max(initial=0.0))

    @property
    def wrong(self) -> bool:
        """Whether the difference is too large or NaN."""
        return not self.off <= self.allowed

    def to_json(self) -> dict[str, Any]:
        at = {name: self.row.given[name] for name in ("t_s", "robot", "policy", "decision", "reason", "status")}
        return {**at, "what": self.what, "off": self.off, "allowed": self.allowed, **self.more}


def cost_tolerance(cost: float) -> float:
    """Tolerance between recorded and recomputed costs: rounding of 3 N additions causes 1e-13, relative."""
    return 1e-9 * max(cost, LEAST_COST)


def conclude(finding: Finding, compared: Iterable[Deviation]) -> Finding:
    """The finding, or a refutation by the first wrong comparison in time."""
    wrong = (deviation for deviation in compared if deviation.wrong)
    first = min(wrong, key=lambda deviation: deviation.row.t_s, default=None)
    if first is None:
        return finding
    return replace(finding, status="refuted", margin=None, counterexample=first.to_json())


def without_decisions(trace: Trace) -> list[str]:
    """UGVs without a decision that executed a proposal, or had one during a long enough intervention."""
    # This is no refutation: their proposals may have been withdrawn at once.
    left_out = {*without_proposals(trace), *unreached(trace)}
    asked = [ugv for ugv in trace.ugvs if talk_is_due(trace, ugv) and ugv not in left_out]
    called = [ugv for ugv in trace.ugvs if (trace.executing(ugv) >= 0).any() or ugv in asked]
    return [ugv for ugv in called if not (trace.decisions["robot"] == ugv).any()]


class GateClaim(TraceClaim):
    """A claim about the decisions of a gatekeeper, which predicts with the package's law."""

    about_the_law = True

    def applies(self, trace: Trace) -> bool:
        """Methods (a) and (b) optimise nothing."""
        return trace.meta.get("method") in GATED_METHODS

    def check(self, trace: Trace) -> Finding:
        """Decide the claim; without decisions it holds only if no UGV had to decide for long enough."""
        if len(trace.decisions) and not len(trace.problems) and trace.meta["method"] in ON_TOP:
            return Finding("not_run", evidence={"reason": "the problems of the decisions were not recorded"})
        without = without_decisions(trace)
        if without and not len(trace.decisions):
            reason = f"{', '.join(without)}: in mode 'intervening', but the trace has no decision"
            return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
        rows = rows_of(trace)
        if not rows:
            reason = "no UGV had a proposal for long enough: nothing to decide"
            return Finding("holds", evidence={"decisions": 0, "reason": reason}, exercised=0)
        finding = self.judge_rows(trace, rows)
        return replace(finding, evidence={**finding.evidence, "without_decisions": without})

    @abc.abstractmethod
    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Decide the claim about at least one decision."""
