"""GATE-OPT: how good the plan of every gatekeeper decision of a run is.

A decision's problem is convex once its plan is relaxed and its distances are measured along recorded unit normals,
and convexity gives bounds that need no trust in any solver: see `convex_bounds.enclose`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.run.trace import Trace
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.convex_bounds import Enclosure, enclose
from airground_drake.verify.runs.gate_record import (
    LEAST_COST,
    POSITION_TOLERANCE_M,
    DecisionRecord,
    Deviation,
    GateClaim,
    conclude,
    cost_tolerance,
)

OVERSTATED = 1e-5
"""A recorded lower bound may be above the optimum by this, relative: a solver's primal cost errs by 1e-6 or less."""

UNDERSTATED = 1e-3
"""It may be below it by this, relative: farther below, it would not be the optimum of the relaxation."""

GAP_TOLERANCE = 1e-6
"""Recorded and recomputed gaps may differ by this."""

BLOCKS = 10
"""Blocks of stages whose plans are tried where a gap is wide; all plans of so many choices are tried in any case."""

MOST_BLOCKS = 12
"""All plans of so many blocks can be evaluated."""

PROVED_ROUTES = ("mixed_integer",)
"""Routes whose lower bound is the optimum over binary plans."""

HALF_PLANE_ROUTES = (*PROVED_ROUTES, "relaxed")
"""Routes that bound the cost with distances along recorded normals; the others know no bound."""


@dataclass(frozen=True)
class Bounds:
    """The evidence; gaps and enclosures are relative to the cheaper constant plan's cost, but for the two last ones.

    Attributes:
        first_stage_certified: plans whose first stage every plan with the other one costs more than.
        largest_gap_to_half_planes: of a plan to the route's bound, both along the half-planes, relative to the plan.
        enumerated: decisions with at most `BLOCKS` choices, for which all plans were evaluated by exact distances.
        largest_gap_to_enumeration: of such a plan to the best of all, relative to the best.
    """

    decisions: int
    without_a_plan: list[str]
    bounded: int
    without_a_bound: list[str]
    gap_too_wide_to_decide: list[str]
    largest_gap: float | None
    median_gap: float | None
    widest_enclosure: float
    first_stage_certified: int
    largest_gaps: list[dict[str, Any]]
    largest_gap_to_half_planes: float | None
    enumerated: int
    largest_gap_to_enumeration: float | None


class GateOpt(GateClaim):
    """GATE-OPT."""

    largest_gap = 0.05
    """Gap that a decision may have: what a reversal needs by default (`switching_margin`) is no less."""
    widest = 1e-5
    """Width of an enclosure of the optimum, relative, up to which it decides anything."""

    id = "GATE-OPT"
    summary = "Every plan cost at most 5 % more than the best of the problem that its route solves."
    statement = (
        "Every gatekeeper decision that rests on a plan costs at most 5 % of the cheaper constant plan's cost more "
        "than the optimum of the problem that its route solves, and neither its lower bound nor its gap is recorded "
        "better than it is."
    )
    formula = (
        "L <= min J_n <= U, U - L <= 1e-5 C; route_bound <= U + 1e-5 C (relaxed), <= J_n of every binary plan tried + "
        "1e-5 C (mixed_integer); route_bound >= L - 1e-3 C; "
        "(J(plan) - L) / C <= 0.05; J(plan) <= J(0), J(1); C = min(J(0), J(1)); J is (25) and the "
        "terminal cost w a ||rho_rd - rho_N||^2 (w = 0 unless the scenario says so), J_n >= J with distances along "
        "unit normals n"
    )
    latex = (
        r"L \le \min_\omega J_n(\omega) \le U, \quad U - L \le 10^{-5} C, \quad C = \min(J(0), J(1))",
        r"\frac{J(\omega_{\text{plan}}) - L}{C} \le 0.05, \quad J(\omega_{\text{plan}}) \le C",
        r"\text{bound of the route} \le U + 10^{-5} C \text{ (relaxed)}, \quad \ge L - 10^{-3} C",
    )
    method = (
        "The half-plane relaxations of all decisions, from recorded data and normals, are stacked "
        "into one program in multiple-shooting form and solved by cvxpy and Clarabel (OSQP reaches the same only to "
        "2e-5, in three to ten times the time). No solver is trusted: its plan, evaluated, is the upper "
        "bound U; its multipliers give L by weak duality, evaluated in numpy, whatever their quality. Route "
        "'mixed_integer' says that its bound is the optimum over binary plans: the recorded plan, the constant plans "
        "and every plan that differs from the recorded one in one choice are evaluated, and none may be cheaper; with "
        "up to 12 blocks, all plans are. Other routes bound nothing, and the claim is inconclusive. If a problem has "
        "at most 10 choices, the evidence also compares the plan with the best of all by the exact distances of (26d)."
    )
    equations = "(25)-(27)"
    assumptions = (
        "The optimum is that of the recorded problem: mode velocities, and unit normals, are data. A half-plane is "
        "part of it only where some plan can come nearer than d: elsewhere (26d) asks for nothing.",
        "With `gatekeeper.blocks`, the route 'mixed_integer' chooses one mode for each block of stages.",
    )
    does_not_establish = (
        "The claim is about the route's own problem. Mode velocities and half-planes are data of that problem "
        "(GATE-MODEL says what they are worth). Not established: optimality for the exact distances of (26d) "
        "(half-planes are conservative: another choice of normals may allow a cheaper plan) but for problems that were "
        "enumerated, for another dwell, or "
        "for the nonlinear closed loop; nor that the first stage is the optimal one, unless counted as certified. A "
        "plan may cost less by exact distances than the bound; its gap is then negative. Refusals for want of a plan "
        "are only listed."
    )

    exercised_by = "decisions that rest on a plan"

    def applies(self, trace: Trace) -> bool:
        """Only method (c) solves problem (26); method (d) compares outcomes."""
        return trace.meta.get("method") == "c"

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Enclose every optimum; the margin is what is left of the largest gap allowed."""
        gate = trace.scenario.gatekeeper
        planned = [row for row in rows if row.planned]
        lacking = [row for row in planned if gate.route in HALF_PLANE_ROUTES and row.data["normals"] is None]
        if cut := [row for row in lacking if row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no normals")
        compared = [one for row in planned for one in compare_with_constant_plans(row)]
        if gate.route not in HALF_PLANE_ROUTES:
            reason = f"route {gate.route!r} has no bound that can be established again"
            open_ = Finding("inconclusive", evidence={"decisions": len(rows), "reason": reason}, exercised=len(planned))
            return conclude(open_, compared)
        bounded = bound([row for row in planned if row not in lacking], gate.blocks)
        for each in bounded:
            compared += compare_bounds(each.row, each.optimum, gate.blocks)
            if each.gap > self.largest_gap and not gate.blocks:
                compared.append(compare_with_blocks(each, self.largest_gap))
        evidence = self._bounds(rows, bounded, lacking, gate.blocks)
        undecided = not bounded or lacking or evidence.gap_too_wide_to_decide
        decided = not undecided and evidence.widest_enclosure <= self.widest
        worst = evidence.largest_gaps[0] if bounded else {}
        finding = Finding(
            "holds" if decided else "inconclusive",  # a gap that is too wide is open, not refuted
            margin=self.largest_gap - worst["gap"] if decided else None,
            unit="of the cheaper constant plan's cost",
            quantity="largest gap allowed less the largest gap",
            where={name: worst[name] for name in ("robot", "t_s") if worst},
            evidence=asdict(evidence),
            exercised=len(planned),
        )
        return conclude(finding, compared)

    def _bounds(
        self, rows: Sequence[DecisionRecord], bounded: Sequence[Bounded], lacking: Sequence[DecisionRecord], blocks: int
    ) -> Bounds:
        gaps, planned = [each.gap for each in bounded], [each.row for each in bounded]
        beside_all = [above_the_best(row, blocks) for row in planned if min(blocks or row.stages, row.stages) <= BLOCKS]
        largest = [bounded[i] for i in np.argsort(gaps)[:-6:-1]]
        return Bounds(
            decisions=len(rows),
            without_a_plan=[row.label for row in rows if not row.planned],
            bounded=len(bounded),
            without_a_bound=[row.label for row in lacking],
            gap_too_wide_to_decide=[each.row.label for each in bounded if each.gap > self.largest_gap],
            largest_gap=max(gaps, default=None),
            median_gap=float(np.median(gaps)) if gaps else None,
            widest_enclosure=max((each.width for each in bounded), default=0.0),
            first_stage_certified=sum(each.first_stage_certified for each in bounded),
            largest_gaps=[{"t_s": each.row.t_s, "robot": each.row.robot, "gap": each.gap} for each in largest],
            largest_gap_to_half_planes=max((float(row.given["gap"]) for row in planned), default=None),
            enumerated=len(beside_all),
            largest_gap_to_enumeration=max(beside_all, default=None),
        )


@dataclass(frozen=True)
class Bounded:
    """A decision with a plan, and bounds of the optimum of the problem that its route solves."""

    row: DecisionRecord
    optimum: Enclosure

    @cached_property
    def gap(self) -> float:
        """Cost of the plan by exact distances above the lower bound, in units of the row's scale."""
        return (float(self.row.cost(self.row["positions_m"])) - self.optimum.lower) / self.row.scale

    @property
    def width(self) -> float:
        """Width of the enclosure, in the same units."""
        return (self.optimum.upper - self.optimum.lower) / self.row.scale

    @property
    def first_stage_certified(self) -> bool:
        """Whether no plan with the other first stage can be as cheap as this one."""
        return self.optimum.other_first > self.optimum.lower + self.gap * self.row.scale


def bound(rows: Sequence[DecisionRecord], blocks: int) -> list[Bounded]:
    """Bounds for each decision: of the relaxation, or of all plans if `blocks` are few (0: one per stage)."""
    optima = [cheapest_of_blocks(row, blocks) for row in rows] if 0 < blocks <= MOST_BLOCKS else enclose(rows)
    return [Bounded(*one) for one in zip(rows, optima, strict=True)]


def compare_with_blocks(each: Bounded, allowed: float) -> Deviation:
    """A gap that is too wide is wrong only if the route's problem has a cheaper plan: rounding may cost that much."""
    row = each.row
    shown = (float(row.cost(row["positions_m"])) - cheapest_of_blocks(row, BLOCKS).lower) / row.scale
    return Deviation(row, "a plan of blocks is cheaper", max(0.0, shown), allowed)


def compare_with_constant_plans(row: DecisionRecord) -> Iterator[Deviation]:
    """The plan against the constant ones, by the exact cost; each choice against the constant plan that makes it."""
    for name, constant in zip(("refuse", "accept"), row.cost(row.constant).tolist(), strict=True):
        tolerance = cost_tolerance(constant)
        for column in ("objective", f"objective_{name}"):
            excess = max(0.0, row.given[column] - constant)
            yield Deviation(row, f"{column} above {name} throughout", excess, tolerance, constant_plan=constant)


def compare_bounds(row: DecisionRecord, found: Enclosure, blocks: int) -> Iterator[Deviation]:
    """The recorded normals, lower bound and gap; `blocks`: binaries of the route, 0: one per stage."""
    given, normals = row.given, row.half_planes
    proved = given["route"] in PROVED_ROUTES
    lower, scale = float(given["route_bound"]), row.scale
    own = float(row.cost(row["positions_m"], normals))
    known = [*row.constant, *([row.positions(row["rounded"])] if row.data["rounded"] is not None else [])]
    # the losing choice's plan is not recorded, but along normals it costs no less than by exact distances
    loser = max(given["objective_accept"], given["objective_refuse"])
    best = min(own, loser, *(float(row.cost(positions, normals)) for positions in known))
    upper = found.upper
    if proved:  # the optimum may be another plan, which exact distances make no cheaper than the one recorded
        best = min(best, given["objective"])
        upper = float(row.cost(row.positions(neighbours(row["plan"], blocks)), normals).min())
    lengths = np.linalg.norm(row["normals"], axis=2)
    yield Deviation(row, "length of a normal, minus 1", lengths - 1.0, POSITION_TOLERANCE_M)
    more = {"route_bound": lower, "optimum_at_least": found.lower, "optimum_at_most": upper}
    yield Deviation(row, "lower bound above the plan's cost", max(0.0, lower - own) / scale, OVERSTATED, cost=own)
    yield Deviation(row, "lower bound overstated", max(0.0, lower - upper) / scale, OVERSTATED, **more)
    if given["status"] == "optimal":
        yield Deviation(row, "lower bound understated", max(0.0, found.lower - lower) / scale, UNDERSTATED, **more)
    if given["status"] == "optimal" and proved:
        yield Deviation(row, "optimal, but with a gap", max(0.0, given["gap"]), GAP_TOLERANCE)
    least, most = ((cost - lower) / max(cost, 1e-12) for cost in (best, own))
    beyond = max(0.0, least - given["gap"], given["gap"] - most)
    yield Deviation(row, "recorded gap", beyond, GAP_TOLERANCE, recorded=given["gap"], at_least=least, at_most=most)


def neighbours(plan: Array, blocks: int) -> Array:
    """The plan (N,), those that differ from it in one block, and the constant ones, (B + 3, N)."""
    stages = len(plan)
    count = min(blocks or stages, stages)
    turned = np.arange(stages) * count // stages == np.arange(count)[:, None]
    return np.vstack([plan, np.where(turned, 1.0 - plan, plan), np.zeros(stages), np.ones(stages)])


def cheapest_of_blocks(row: DecisionRecord, blocks: int) -> Enclosure:
    """The cheapest along the half-planes of all plans that are constant on blocks, by evaluating each."""
    omega = plans_of_blocks(row.stages, blocks)
    cost = row.cost(row.positions(omega), row.half_planes)
    least = float(cost.min())
    return Enclosure(least, least, float(cost[omega[:, 0] != row["plan"][0]].min()))


def above_the_best(row: DecisionRecord, blocks: int) -> float:
    """How much the plan costs more than the best of all plans, by exact distances, relative to the best."""
    best = float(row.cost(row.positions(plans_of_blocks(row.stages, blocks or row.stages))).min())
    return (float(row.cost(row["positions_m"])) - best) / max(best, LEAST_COST)


def plans_of_blocks(stages: int, blocks: int) -> Array:
    """All plans of so many stages that are constant on blocks, (2^B, N)."""
    blocks = min(blocks, stages)
    modes = (np.arange(2**blocks)[:, None] >> np.arange(blocks)) % 2
    return modes[:, np.arange(stages) * blocks // stages].astype(np.float64)
