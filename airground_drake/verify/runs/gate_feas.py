"""GATE-FEAS: every gatekeeper decision of a run, its plan, its rounding and the answer given, as recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Gatekeeper
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate, travelled
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.beginnings import sensed
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.gate_record import (
    POSITION_TOLERANCE_M,
    DecisionRecord,
    Deviation,
    GateClaim,
    conclude,
    cost_tolerance,
    in_turn,
    reasons_of,
)
from airground_drake.verify.runs.instants import intervening
from airground_drake.verify.runs.pairs import preset_of
from airground_drake.verify.runs.proposals import proposals_of
from airground_drake.verify.runs.sum_up_rounding import (
    compare_rounding,
    compare_without_rounding,
    integrated_error_s,
    is_rounded,
)

SPEED_TOLERANCE = 1e-4
"""A step may be longer than the speed limit allows by this, relative."""
INSIDE_M = 1e-6
"""Closer than the safe distance by more than this, m, the avoidance inequalities may ask for more speed than that:
they ask for less than 1e-5 m/s per point before, at gains up to 10 1/s."""
NO_DIFFERENCE = 1e-6
"""Relative gain from which on a new proposal makes a difference."""


@dataclass(frozen=True)
class Compared:
    """The evidence: numbers of decisions, of comparisons and of wrong ones, and of decisions by reason."""

    decisions: int
    comparisons: int
    wrong: int
    reasons: dict[str, int]


@dataclass(frozen=True)
class ComparedPlans(Compared):
    """The evidence where plans are recorded; slack is how far a plan leads inside a safe distance."""

    without_a_plan: list[str]
    largest_slack_m: float
    plans_with_slack: int
    rounded_plans: int
    largest_rounding_error_s: float


class GateFeas(GateClaim):
    """GATE-FEAS."""

    id = "GATE-FEAS"
    summary = "Every decision was about the situation that the UGV was in, and its answer follows from its numbers."
    statement = (
        "Every gatekeeper decision was about the UGV's situation at that time, its plan satisfies (26b)-(26e) at the "
        "recorded cost, and its answer follows from the costs. Every proposal that stood for long enough was decided "
        "on. Relaxed plans were rounded by sum-up rounding, with an integrated error of at "
        "most half a stage."
    )
    formula = (
        "rho(0) = p(t); omega in {0, 1}; rho_k = rho_(k-1) + dt (omega_k a_k + (1 - omega_k) b_k); u_k = max(0, max_j "
        "d_j - ||rho_k - o_jk||); objective = dt sum_k a ||rho_rd - rho_k||^2 + b u_k^2, and the terminal "
        "cost w a ||rho_rd - rho_N||^2 (w = 0 unless the scenario says so); reference, centres, distances and weights "
        "as the scenario and the signals at t have them; answer = rules(costs, standing answer); rounded_k = 1 if "
        "D_k >= 1 - D_k else 0, D_k = sum_{r <= k} relaxed_r - sum_{r < k} rounded_r; "
        "max_k |dt sum_{r <= k} (relaxed_r - rounded_r)| <= dt / 2"
    )
    latex = (
        r"\rho_k = \rho_{k-1} + \Delta t (\omega_k a_k + (1 - \omega_k) b_k), \quad \rho_0 = p(t), \quad "
        r"\omega_k \in \{0, 1\}",
        r"u_k = \max(0, \max_j (d_j - \lVert \rho_k - o_{jk} \rVert))",
        r"J = \Delta t \sum_k (a \lVert \rho_{rd} - \rho_k \rVert^2 + b u_k^2) + w a \lVert \rho_{rd} - "
        r"\rho_N \rVert^2",
        r"\text{answer} = \text{rules}(\text{costs}, \text{standing answer})",
        r"\bar\omega_k = \begin{cases} 1 & D_k \ge 1 - D_k \\ 0 & \text{otherwise} \end{cases}, \quad "
        r"D_k = \sum_{r \le k} \tilde\omega_r - \sum_{r < k} \bar\omega_r",
        r"\max_k \left| \Delta t \sum_{r \le k} (\tilde\omega_r - \bar\omega_r) \right| \le \frac{\Delta t}{2}",
    )
    method = (
        "All numbers are computed again in numpy from the scenario, the signals and the recorded mode velocities. A "
        "sensed obstacle or robot may be missing only if no plan can come within its safe distance. The rules (no "
        "difference below a relative gain of 1e-6, switching margin, dwell; or the first stage alone) are run again "
        "over the decisions of each UGV. These must follow each other without a gap while a proposal stands, and a "
        "proposal that stands for a period of the planner and one of the gatekeeper must have a decision. No step of a "
        "constant plan is longer than the speed limit allows, unless it begins more than 1e-6 m inside a safe "
        "distance, where avoidance may demand more. A stage of another plan is held to that only if the constant plan "
        "of its mode keeps clear there. "
        "Rounding is judged stage by stage, by running sums of the recorded relaxed and rounded plans; after a deficit "
        "within 1e-9 of 1/2 either mode may follow. Method (d) solves no problem (26): there the claim is about the "
        "times of decisions, GATE-MODEL checks their outcomes, LIVE-PROG the answers. EXEC checks that answers are "
        "obeyed."
    )
    equations = "(22)-(26), (28)-(29)"
    assumptions = (
        "The mode velocities of (23) are the recorded ones, in stages of the recorded length.",
        "Other robots keep the velocity that they have at the time of the decision.",
        "The cost of the choice that lost is the recorded one.",
        "The relaxed plan recorded is the one that was rounded.",
    )
    does_not_establish = (
        "That the mode velocities are those of the closed loop, or that the run went as predicted. (26d) is soft: a "
        "feasible plan may lead inside a safe distance, at the cost of its slack (SAFE-TRACE is about safety). That "
        "the relaxed plan is optimal (GATE-OPT). The gatekeeper takes the cheapest plan it knows, which need not be "
        "the rounded one."
    )

    exercised_by = "decisions"

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Compare everything recorded with what it should be; the margin is the part of a tolerance left."""
        solved = trace.meta["method"] in ON_TOP
        rounded = [row for row in rows if is_rounded(row)] if solved else []
        compared = list(_compare_problems(trace, rows, rounded) if solved else compare_times(trace, rows))
        counts = len(rows), len(compared), sum(one.wrong for one in compared), reasons_of(trace)
        slack = [
            float(np.maximum(0.0, -row.clearance(row["positions_m"])).max()) for row in rows if solved and row.planned
        ]
        evidence = (
            Compared(*counts)
            if not solved
            else ComparedPlans(
                *counts,
                without_a_plan=[row.label for row in rows if not row.planned],
                largest_slack_m=max(slack, default=0.0),
                plans_with_slack=sum(value > 0.0 for value in slack),
                rounded_plans=len(rounded),
                largest_rounding_error_s=max(map(integrated_error_s, rounded), default=0.0),
            )
        )
        finding = Finding(
            "holds",
            margin=min((1.0 - one.off / one.allowed for one in compared if one.allowed > 0.0), default=None),
            unit="of the tolerance",
            quantity="part left of the tolerance of a recorded number",
            evidence=asdict(evidence),
            exercised=len(rows),
        )
        return conclude(finding, compared)


def _compare_problems(
    trace: Trace, rows: Sequence[DecisionRecord], rounded: Sequence[DecisionRecord]
) -> Iterator[Deviation]:
    """All numbers of decisions that rest on problem (26); `rounded` are those with a rounded plan."""
    for row in rows:
        yield from compare_situation(trace, row)
        yield from compare_plan(trace, row)
    yield from compare_answers(trace, rows)
    for row in rounded:
        yield from compare_rounding(row)
    for row in rows:
        if row.planned:
            yield from compare_without_rounding(row)


def compare_times(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Deviation]:
    """The times of the decisions: the first within a period of the proposal, the others a period apart; all are due."""
    period = trace.scenario.gatekeeper.period_s
    for row, last in in_turn(trace, rows):
        early = row.given["issued_s"] if last is None else last.t_s + period
        late = early + period if last is None else early
        yield Deviation(row, "a decision is missing before this one, s", max(0.0, row.t_s - late), TIME_TOLERANCE_S)
        yield Deviation(row, "a decision too many, s", max(0.0, early - row.t_s), TIME_TOLERANCE_S)
    yield from compare_proposals(trace, rows)


def compare_proposals(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Deviation]:
    """A proposal that stands for a period of the planner and one of the gatekeeper is decided on.

    It does not stand so long if another one is sent meanwhile, if its motion is over, if neither the UGV nor its cause
    is intervened on all the time, or if the run ends.
    """
    allowed = trace.scenario.intervention.period_s + trace.scenario.gatekeeper.period_s + TIME_TOLERANCE_S
    decided = {row.given["number"] for row in rows}
    sent = proposals_of(trace)
    for one in sent:
        until = one.issued_s + allowed
        stays = np.concatenate([intervening(trace, ugv) for ugv in sorted({one.ugv, one.cause})])
        called = ((stays[:, 0] <= one.issued_s + TIME_TOLERANCE_S) & (stays[:, 1] > until)).any()
        replaced = any(other.ugv == one.ugv and one.issued_s < other.issued_s <= until for other in sent)
        if called and not replaced and one.times_s[-1] > until:
            given = dict.fromkeys(("decision", "reason", "status"), "")
            row = DecisionRecord({"t_s": one.issued_s, "robot": one.ugv, "policy": one.policy, **given})
            yield Deviation(row, "nothing is decided on a proposal", float(one.number not in decided), 0.0)


def compare_situation(trace: Trace, row: DecisionRecord) -> Iterator[Deviation]:
    """The data of (26) against the scenario and the signals at the time of the decision."""
    gate = trace.scenario.gatekeeper
    t, robot = row.t_s, row.robot
    after = gate.horizon_s / gate.stages * np.arange(1.0, gate.stages + 1.0)
    yield Deviation(row, "length of a stage, s", row.dt - after[0], TIME_TOLERANCE_S)
    yield Deviation(row, "weight of task errors", row.error_weight - gate.error_weight_1_m2_s, 0.0)
    yield Deviation(row, "weight of slack", row.slack_weight - gate.slack_weight_1_m2_s, 0.0)
    yield Deviation(row, "weight of the terminal cost", row.terminal_weight - gate.terminal_weight_s, 0.0)
    own = interpolate(trace.t, trace.position(robot), t)
    yield Deviation(row, "initial position, m", row["initial_m"] - own, POSITION_TOLERANCE_M, position_m=own.tolist())
    reference = travelled(*preset_of(trace, robot), t + after)
    yield Deviation(row, "reference, m", row["reference_m"] - reference, POSITION_TOLERANCE_M)
    left = [(one.name, one.places, one.pair.safe_m) for one in sensed(trace, robot, t, after)]
    for j, distance in enumerate(row["distances_m"]):
        differ = [max(np.abs(at - row["centres_m"][:, j]).max(), abs(safe - distance)) for _, at, safe in left]
        nearest = int(np.argmin(differ)) if left else -1
        found = float(differ[nearest]) if left else np.inf
        yield Deviation(row, f"point {j}: nothing that the UGV senses, m", min(found, 1e9), POSITION_TOLERANCE_M)
        if found <= POSITION_TOLERANCE_M:
            left.pop(nearest)
    fastest = np.linalg.norm(np.stack([row["accept_m_s"], row["refuse_m_s"]]), axis=2).max(axis=0)
    reach = row.dt * np.cumsum(fastest)
    for name, at, safe in left:
        lacking = np.minimum(
            safe + reach - np.linalg.norm(at - own, axis=1),
            safe - np.abs(at[:, 2] - own[2]),  # UGVs keep their height
        ).max()
        if row.planned:
            lacking = max(lacking, (safe - np.linalg.norm(row["positions_m"] - at, axis=1)).max())
        yield Deviation(row, f"{name} is left out though within reach, m", max(0.0, lacking), POSITION_TOLERANCE_M)


def compare_plan(trace: Trace, row: DecisionRecord) -> Iterator[Deviation]:
    """(26b)-(26e), (25) and what was recorded about the plan."""
    limit = trace.scenario.ugvs[row.robot].max_speed_m_s
    period = trace.scenario.control.period_s
    refusing, accepting = row.constant
    clear_refusing, clear_accepting = _clear(row, refusing, period), _clear(row, accepting, period)
    ways = [("refusing throughout", refusing, clear_refusing), ("accepting throughout", accepting, clear_accepting)]
    if row.planned:
        plan = row["plan"]
        positions = row["positions_m"]
        given = row.given
        yield Deviation(row, "omega is not binary", np.minimum(np.abs(plan), np.abs(plan - 1.0)), 0.0)
        away = positions - row.positions(plan)
        yield Deviation(row, "positions are not those of (23), m", away, POSITION_TOLERANCE_M)
        # by (23) a mode's velocity is that of its own way, wherever the plan is
        ways.append(("the plan", positions, np.where(plan == 1.0, clear_accepting, clear_refusing)))
        cost = float(row.cost(positions))
        clearance = min(float(row.clearance(positions).min()), 1e9)
        first = "accept" if plan[0] == 1.0 else "refuse"
        tolerance = cost_tolerance(cost)
        yield Deviation(
            row, "objective", given["objective"] - cost, tolerance, recomputed=cost, recorded=given["objective"]
        )
        yield Deviation(
            row, "objective of its first stage", given[f"objective_{first}"] - cost, tolerance, recomputed=cost
        )
        other = min(given["objective_accept"], given["objective_refuse"])
        for name, trajectory in zip(("refuse", "accept"), row.constant, strict=True):
            thus = float(row.cost(trajectory))
            shift = given[f"{name}_throughout"] - thus
            yield Deviation(row, f"{name} throughout", shift, cost_tolerance(thus), recomputed=thus)
        yield Deviation(row, "the other choice is cheaper", max(0.0, given["objective"] - other), tolerance)
        yield Deviation(row, "first stage", float(given["first_stage"] != first), 0.0, plan=first)
        shift = given["predicted_clearance_m"] - clearance
        yield Deviation(row, "predicted clearance, m", shift, POSITION_TOLERANCE_M, recomputed_m=clearance)
    for name, positions, clear in ways:
        step = np.linalg.norm(np.diff(positions, axis=0, prepend=row["initial_m"][None]), axis=1)
        over = (step / (limit * row.dt) - 1.0)[clear]
        yield Deviation(row, f"{name}: faster than the speed limit", np.maximum(0.0, over), SPEED_TOLERANCE)


def _clear(row: DecisionRecord, positions: Array, period: float) -> npt.NDArray[np.bool_]:
    """Stages (N,) in which no control sample (every `period`, s) is within a safe distance by more than rounding."""
    centres = row["centres_m"]
    before = centres[0] - (centres[min(1, len(centres) - 1)] - centres[0])
    start = (np.linalg.norm(row["initial_m"] - before, axis=1) - row["distances_m"]).min(initial=np.inf)
    inside = np.concatenate([[start], row.clearance(positions)]) < -INSIDE_M
    several = row.dt > period + TIME_TOLERANCE_S  # samples within the stage: what they see is not recorded
    return ~(inside[:-1] | (inside[1:] & several))


def compare_answers(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Deviation]:
    """The answers against the rules, decision by decision, and the times of the decisions."""
    gate = trace.scenario.gatekeeper
    yield from compare_times(trace, rows)
    since = 0.0
    for row, last in in_turn(trace, rows):
        standing = None if last is None else str(last.given["decision"])
        accept, reason = rule(row, standing, row.t_s - since, gate, literal=gate.rule == "first_stage")
        ours, theirs = ("accept" if accept else "refuse", reason), (row.given["decision"], row.given["reason"])
        yield Deviation(row, "answer or reason", float(ours != theirs), 0.0, recomputed=list(ours), standing=standing)
        since = since if row.given["decision"] == standing else row.t_s


def rule(
    row: DecisionRecord, standing: str | None, stood: float, gate: Gatekeeper, *, literal: bool = False
) -> tuple[bool, str]:
    """Whether a proposal is accepted and why, from the recorded costs.

    Args:
        row: the decision.
        standing: the answer to this proposal so far, or None.
        stood: for how long it has been that, s.
        gate: the scenario's margins.
        literal: the first stage of the rounded plan is the answer, whatever stands; of the plan if none was rounded.
    """
    given = row.given
    if not row.planned:
        return False, "no_plan"
    if literal:
        plan = row["plan"] if row.data["rounded"] is None else row["rounded"]
        return bool(plan[0] == 1.0), "first_stage"
    if standing is None:
        gains = given["objective"] < (1.0 - NO_DIFFERENCE) * given["refuse_throughout"]
        if row["plan"][0] != 1.0:
            return False, "waits" if gains else "not_cheaper"
        return gains, "cheaper" if gains else "no_difference"
    accepted = standing == "accept"
    enough = (1.0 - gate.switching_margin) * given[f"{standing}_throughout"]
    cheaper = (row["plan"][0] == 1.0) != accepted and given["objective"] < enough
    if not cheaper:
        return accepted, "kept"
    if stood < gate.min_dwell_s - TIME_TOLERANCE_S:
        return accepted, "dwell"
    return not accepted, "reversed"
