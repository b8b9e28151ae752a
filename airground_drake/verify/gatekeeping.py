"""GATE-FEAS, GATE-SUR and GATE-OPT: every gatekeeper decision of a run, judged from the data that it recorded.

The formulas (23), (25), (26) and (28)-(29) are written again here in plain numpy; N is the number of stages, m of
the points to keep away from. A decision's problem is convex once its plan is relaxed and its distances are measured
along recorded unit normals, and convexity gives bounds that need no trust in any solver: see `enclose`.
"""

from __future__ import annotations

import abc
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from airground_drake.errors import TraceError
from airground_drake.nsbc.task import Array
from airground_drake.trace import PROBLEM_ARRAYS, PROBLEM_SCALARS, Trace
from airground_drake.verify.geometry import interpolate, travelled
from airground_drake.verify.outcome import GATED_METHODS
from airground_drake.verify.verdict import TIME_TOLERANCE_S, Finding, Status, TraceClaim

POSITION_TOLERANCE_M = 1e-9
"""Recorded and recomputed positions may differ by this, m: rounding of N additions errs by 1e-13 m."""
COST_TOLERANCE = 1e-9
"""Recorded and recomputed costs may differ by this, relative: rounding of 3 N additions errs by 1e-13."""
SPEED_TOLERANCE = 1e-4
"""A step may be longer than the speed limit allows by this, relative."""
INSIDE_M = 1e-6
"""Closer than the safe distance by more than this, m, the avoidance inequalities may ask for more speed than that:
they ask for less than 1e-5 m/s per point before, at gains up to 10 1/s."""
TIE = 1e-9
"""Accumulated deficits of sum-up rounding closer to 1/2 than this are a tie: either mode may follow."""
LEAST_COST = 1e-6
"""Costs are compared relative to the cheaper constant plan's, but to no less than this: 1 mm of error for 1 s."""
NO_DIFFERENCE = 1e-6
"""Relative gain from which on a new proposal makes a difference."""
OVERSTATED = 1e-5
"""A recorded lower bound may be above the optimum by this, relative: a solver's primal cost errs by 1e-6 or less."""
UNDERSTATED = 1e-3
"""It may be below it by this, relative: farther below, it would not be the optimum of the relaxation."""
GAP_TOLERANCE = 1e-6
"""Recorded and recomputed gaps may differ by this."""
ROUNDED_ROUTES = ("relaxed", "nonlinear")
"""Routes that solve (27) and round by (28)-(29)."""
OPTIONAL = ("plan", "positions_m", "relaxed", "rounded", "normals")
"""What a decision need not have."""
BLOCKS = 10
"""Routes with a minimum dwell choose a mode for each of so many blocks of stages."""
DWELL_ROUTES = ("enumeration", "branch_and_bound")
"""Those routes."""
HALF_PLANE_ROUTES = ("relaxed", "branch_and_bound")
"""Routes that bound the cost with distances along recorded normals; the others know no bound, or an exact one."""


@dataclass(frozen=True, eq=False)
class Row:
    """One decision and its problem: a row of `Trace.decisions` and of `Trace.problems`, arrays in shape.

    Attributes:
        given: the columns of `Trace.decisions`.
        dt: length of a stage, s.
        error_weight: a of (25), 1/(m^2 s).
        slack_weight: b of (25), 1/(m^2 s).
        data: arrays of `Trace.problems` by name, in the shapes that are stated there; None where empty.
    """

    given: dict[str, Any]
    dt: float
    error_weight: float
    slack_weight: float
    data: dict[str, Array | None]

    def __getitem__(self, name: str) -> Array:
        """An array that must be there.

        Raises:
            TraceError: if it is not.
        """
        found = self.data[name]
        if found is None:
            raise TraceError(f"{self.label}: the problem has no {name!r}")
        return found

    @property
    def label(self) -> str:
        """Which decision."""
        return f"decision of {self.given['robot']} at t = {self.given['t_s']} s"

    @property
    def planned(self) -> bool:
        """Whether it rests on a plan; otherwise it is a refusal for want of one."""
        return self.data["plan"] is not None

    def positions(self, omega: Array) -> Array:
        """(23): omega (..., N) to positions at the ends of the stages, (..., N, 3), m."""
        velocity = self["refuse_m_s"] + omega[..., None] * (self["accept_m_s"] - self["refuse_m_s"])
        return self["initial_m"] + self.dt * np.cumsum(velocity, axis=-2)

    def lines(self, route: str) -> Array | None:
        """Normals (N, m, 3) that the route measures distances along; None where it takes exact distances."""
        return self["normals"] if route in HALF_PLANE_ROUTES else None

    def clearance(self, positions: Array, normals: Array | None = None) -> Array:
        """Least distance minus d at the end of each stage, (..., N), m; along unit normals (N, m, 3) if given."""
        away = positions[..., None, :] - self["centres_m"]
        reach = np.linalg.norm(away, axis=-1) if normals is None else np.einsum("...kmi,kmi->...km", away, normals)
        return (reach - self["distances_m"]).min(axis=-1, initial=np.inf)

    def cost(self, positions: Array, normals: Array | None = None) -> Any:
        """(25) by the right-hand rectangle rule, slack being max(0, d - distance); (...)."""
        error = np.square(positions - self["reference_m"]).sum(axis=(-1, -2))
        slack = np.square(np.minimum(0.0, self.clearance(positions, normals))).sum(axis=-1)
        return self.dt * (self.error_weight * error + self.slack_weight * slack)

    @cached_property
    def constant(self) -> Array:
        """Positions of the plans that refuse and that accept throughout, (2, N, 3), m."""
        return self.positions(np.array([[0.0], [1.0]]) * np.ones(len(self["reference_m"])))

    @cached_property
    def scale(self) -> float:
        """What differences of cost are compared with."""
        return max(LEAST_COST, float(self.cost(self.constant).min()))


def rows_of(trace: Trace) -> list[Row]:
    """All decisions with their problems.

    Raises:
        TraceError: if the tables do not belong together, a shape is wrong or a number is not finite.
    """
    if len(trace.problems) != len(trace.decisions):
        raise TraceError(f"{len(trace.decisions)} decisions, but {len(trace.problems)} problems")
    records = (table.to_dict("records") for table in (trace.decisions, trace.problems))
    gate, rows = trace.scenario["gatekeeper"], []
    for given, problem in zip(*records, strict=True):
        scalars = [float(problem[name]) for name in PROBLEM_SCALARS]
        flat = {name: np.asarray(problem[name], dtype=np.float64).ravel() for name in PROBLEM_ARRAYS}
        columns = {str(name): value for name, value in given.items()}
        row = Row(columns, scalars[0], scalars[1], scalars[2], _shaped(flat, int(gate["stages"])))
        numbers = [np.array(scalars), np.array([v for v in given.values() if isinstance(v, float)]), *flat.values()]
        if not all(np.isfinite(values).all() for values in numbers):
            raise TraceError(f"{row.label}: it or its problem has numbers that are not finite")
        if given["robot"] not in trace.ugvs or given["route"] != gate["route"]:
            raise TraceError(f"{row.label}: not of a UGV of the trace, or not by the scenario's route")
        decided = given["status"] in ("optimal", "budget_spent")
        if row.planned != decided or (decided and row.data["positions_m"] is None):
            raise TraceError(f"{row.label}: a plan without positions, or not what its status {given['status']!r} says")
        rows.append(row)
    return rows


def _shaped(flat: dict[str, Array], n: int) -> dict[str, Array | None]:
    """Arrays of a problem of n stages in their shapes; None for what is empty and may be."""
    m = len(flat["distances_m"])
    shapes: dict[str, tuple[int, ...]] = {"initial_m": (3,), "distances_m": (m,), "centres_m": (n, m, 3)}
    shapes |= dict.fromkeys(("accept_m_s", "refuse_m_s", "reference_m", "positions_m"), (n, 3))
    shapes |= dict.fromkeys(("plan", "relaxed", "rounded"), (n,)) | {"normals": (n, m, 3)}
    shaped: dict[str, Array | None] = {}
    for name, values in flat.items():
        size = int(np.prod(shapes[name]))
        if name in OPTIONAL and size and not values.size:
            shaped[name] = None
        elif values.size == size:
            shaped[name] = values.reshape(shapes[name])
        else:
            raise TraceError(f"a problem's {name!r} has {values.size} numbers, not {size}")
    return shaped


@dataclass(frozen=True)
class Off:
    """How far something is from what it should be, and how far it may be; `more` goes into a counterexample."""

    row: Row
    what: str
    off: float
    allowed: float
    more: dict[str, Any]

    @property
    def wrong(self) -> bool:
        """Whether it is too far; also for a comparison that came out as no number."""
        return not self.off <= self.allowed

    def to_json(self) -> dict[str, Any]:
        """For a counterexample."""
        at = {name: self.row.given[name] for name in ("t_s", "robot", "policy", "decision", "reason", "status")}
        return {**at, "what": self.what, "off": self.off, "allowed": self.allowed, **self.more}


def off(row: Row, what: str, by: Any, allowed: float, **more: Any) -> Off:
    """An `Off` by the largest of some absolute differences."""
    return Off(row, what, float(np.max(np.abs(by), initial=0.0)), allowed, more)


class GateClaim(TraceClaim):
    """What the three claims share: they are about the decisions of an optimising gatekeeper, all of them recorded."""

    def applies(self, trace: Trace) -> bool:
        """Methods (a) and (b) optimise nothing."""
        return trace.meta.get("method") in GATED_METHODS

    def check(self, trace: Trace) -> Finding:
        """Decide the claim; without decisions it holds only if no UGV was long enough in intervention to need one."""
        if len(trace.decisions) and not len(trace.problems):
            return Finding("not_run", evidence={"reason": "the problems of the decisions were not recorded"})
        periods = trace.scenario["intervention"]["period_s"] + trace.scenario["gatekeeper"]["period_s"]
        for ugv in trace.ugvs:
            executed = (trace.column(f"{ugv}.accepted") != 0.0).any()
            needed = executed or _longest_intervention(trace, ugv) > periods
            if needed and not (trace.decisions["robot"] == ugv).any():
                reason = f"{ugv} was in mode 'intervening', but the trace has no decision of it"
                return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
        rows = rows_of(trace)
        if not rows:
            return Finding("holds", evidence={"decisions": 0, "reason": "no UGV was intervened on: nothing to decide"})
        return self.judge_rows(trace, rows)

    @abc.abstractmethod
    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Decide the claim about at least one decision."""


def _longest_intervention(trace: Trace, ugv: str) -> float:
    """Longest stay in mode 1, s; the mode of a row is in force since the row before."""
    inside = np.concatenate([[False], trace.column(f"{ugv}.mode")[1:] == 1.0, [False]])
    begins, ends = np.flatnonzero(np.diff(inside.astype(np.int8))).reshape(-1, 2).T
    return float((trace.t[ends] - trace.t[begins]).max(initial=0.0))


def _first(wrong: list[Off]) -> dict[str, Any] | None:
    """The first in time."""
    return min(wrong, key=lambda one: float(one.row.given["t_s"])).to_json() if wrong else None


class GateFeas(GateClaim):
    """GATE-FEAS."""

    id = "GATE-FEAS"
    statement = (
        "Every gatekeeper decision was about the UGV's situation at that time, its plan satisfies (26b)-(26e) at the "
        "recorded cost, and the answer given, and obeyed, is the one that follows from the costs."
    )
    formula = (
        "rho(0) = p(t); omega in {0, 1}; rho_k = rho_(k-1) + dt (omega_k a_k + (1 - omega_k) b_k); u_k = max(0, max_j "
        "d_j - ||rho_k - o_jk||); objective = dt sum_k a ||rho_rd - rho_k||^2 + b u_k^2; reference, centres and "
        "distances as the scenario and the signals at t have them; answer = rules(costs, bend, standing answer)"
    )
    method = (
        "All recomputed in numpy from the scenario, the signals and the recorded mode velocities. A sensed obstacle or "
        "robot may be missing only if no plan can come within its safe distance. The rules (no difference below a "
        "relative gain of 1e-6, bend, switching margin, dwell) are run again over the decisions of each UGV, which "
        "must follow each other without a gap while a proposal stands. Route 'rollout' predicts the nonlinear closed "
        "loop: there (23) is checked up to the first change of mode, after it that no step is longer than the speed "
        "limit allows, except where it begins more than 1e-6 m inside a safe distance: avoidance may then demand more."
    )
    equations = "(22)-(26)"
    assumptions = (
        "The mode velocities of (23) are the recorded ones, in stages of the recorded length.",
        "Other robots keep the velocity that they have at the time of the decision.",
        "The bend, and the cost of the choice that lost, are the recorded ones.",
    )
    does_not_establish = (
        "That the mode velocities are those of the closed loop, or that the run went as predicted. (26d) is soft: a "
        "feasible plan may lead inside a safe distance, at the cost of its slack; safety is SAFE-TRACE."
    )

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Compare everything recorded with what it should be; the margin is the part of a tolerance left."""
        compared = [one for row in rows for one in (*_situation(trace, row), *_plan(trace, row))]
        compared += [*_answers(trace, rows), *_obeyed(trace, rows)]
        wrong = [one for one in compared if one.wrong]
        closest = min((1.0 - one.off / one.allowed for one in compared if one.allowed > 0.0), default=None)
        planned = [row for row in rows if row.planned]
        slack = [float(np.maximum(0.0, -row.clearance(row["positions_m"])).max()) for row in planned]
        return Finding(
            "refuted" if wrong else "holds",
            margin=closest if not wrong else None,
            unit="of the tolerance",
            counterexample=_first(wrong),
            evidence={
                "decisions": len(rows),
                "without_a_plan": [row.label for row in rows if not row.planned],
                "comparisons": len(compared),
                "wrong": len(wrong),
                "reasons": {str(k): int(v) for k, v in trace.decisions["reason"].value_counts().items()},
                "largest_slack_m": max(slack, default=0.0),
                "plans_with_slack": sum(value > 0.0 for value in slack),
            },
        )


def _situation(trace: Trace, row: Row) -> Iterator[Off]:
    """The data of (26) against the scenario and the signals at the time of the decision."""
    gate, t, robot = trace.scenario["gatekeeper"], float(row.given["t_s"]), str(row.given["robot"])
    preset = trace.scenario["ugvs"][robot]["preset"]
    after = gate["horizon_s"] / gate["stages"] * np.arange(1.0, gate["stages"] + 1.0)
    yield off(row, "length of a stage, s", row.dt - after[0], TIME_TOLERANCE_S)
    yield off(row, "weight of task errors", row.error_weight - gate["error_weight_1_m2_s"], 0.0)
    yield off(row, "weight of slack", row.slack_weight - gate["slack_weight_1_m2_s"], 0.0)
    own = interpolate(trace.t, trace.position(robot), t)
    yield off(row, "initial position, m", row["initial_m"] - own, POSITION_TOLERANCE_M, position_m=own.tolist())
    reference = travelled(np.asarray(preset["waypoints_m"], dtype=np.float64), preset["speed_m_s"], t + after)
    yield off(row, "reference, m", row["reference_m"] - reference, POSITION_TOLERANCE_M)
    names, centres, distances = _sensed(trace, robot, t, own, after)
    left = list(range(len(names)))
    for j, distance in enumerate(row["distances_m"]):
        differ = [max(np.abs(centres[i] - row["centres_m"][:, j]).max(), abs(distances[i] - distance)) for i in left]
        nearest = int(np.argmin(differ)) if left else -1
        found = float(differ[nearest]) if left else np.inf
        yield off(row, f"point {j}: nothing that the UGV senses, m", min(found, 1e9), POSITION_TOLERANCE_M)
        if found <= POSITION_TOLERANCE_M:
            left.pop(nearest)
    fastest = np.linalg.norm(np.stack([row["accept_m_s"], row["refuse_m_s"]]), axis=2).max(axis=0)
    if row.given["route"] == "rollout":  # between two changes of mode a plan may be as fast as any
        fastest = np.maximum(fastest, trace.scenario["ugvs"][robot]["max_speed_m_s"])
    reach = row.dt * np.cumsum(fastest)
    for i in left:
        lacking = np.minimum(
            distances[i] + reach - np.linalg.norm(centres[i] - own, axis=1),
            distances[i] - np.abs(centres[i][:, 2] - own[2]),  # UGVs keep their height
        ).max()
        if row.planned:
            gap = distances[i] - np.linalg.norm(row["positions_m"] - centres[i], axis=1)
            lacking = max(lacking, gap.max())
        yield off(row, f"{names[i]} is left out though within reach, m", max(0.0, lacking), POSITION_TOLERANCE_M)


def _sensed(trace: Trace, robot: str, t: float, own: Array, after: Array) -> tuple[list[str], list[Array], list[float]]:
    """Obstacles and other robots within sensing range: names, places (N, 3) at times `after` t, safe distances, m."""
    scenario, safe = trace.scenario, trace.scenario["safe_distance"]
    held = min(int(np.searchsorted(trace.t, t - TIME_TOLERANCE_S)), len(trace.t) - 1)
    things = [
        (name, np.array(o["position_m"]), np.zeros(3), safe["obstacle_m"]) for name, o in scenario["obstacles"].items()
    ]
    for other in trace.robots:
        if other != robot:
            distance = safe["ugv_m"] if other in trace.ugvs else safe["air_ground_m"]
            things.append((other, interpolate(trace.t, trace.position(other), t), trace.command(other)[held], distance))
    near = [one for one in things if np.linalg.norm(one[1] - own) <= scenario["control"]["sensing_range_m"]]
    places = [place + after[:, None] * velocity for _, place, velocity, _ in near]
    return [one[0] for one in near], places, [float(one[3]) for one in near]


def _plan(trace: Trace, row: Row) -> Iterator[Off]:
    """(26b)-(26e), (25) and what was recorded about the plan."""
    limit, period = trace.scenario["ugvs"][row.given["robot"]]["max_speed_m_s"], trace.scenario["control"]["period_s"]
    trajectories = {"refusing throughout": row.constant[0], "accepting throughout": row.constant[1]}
    if row.planned:
        plan, positions, given = row["plan"], row["positions_m"], row.given
        yield off(row, "omega is not binary", np.minimum(np.abs(plan), np.abs(plan - 1.0)), 0.0)
        rollout = given["route"] == "rollout"
        same = np.logical_and.accumulate(plan == plan[0]) if rollout else np.ones(len(plan), dtype=bool)
        away = positions - row.positions(plan)
        yield off(row, "positions are not those of (23), m", away[same], POSITION_TOLERANCE_M)
        trajectories["the plan"] = positions
        cost, clearance = float(row.cost(positions)), min(float(row.clearance(positions).min()), 1e9)
        first = "accept" if plan[0] == 1.0 else "refuse"
        tolerance = COST_TOLERANCE * max(cost, LEAST_COST)
        yield off(row, "objective", given["objective"] - cost, tolerance, recomputed=cost, recorded=given["objective"])
        yield off(row, "objective of its first stage", given[f"objective_{first}"] - cost, tolerance, recomputed=cost)
        other = min(given["objective_accept"], given["objective_refuse"])
        for name, trajectory in zip(("refuse", "accept"), row.constant, strict=True):
            thus = float(row.cost(trajectory))
            slack = COST_TOLERANCE * max(thus, LEAST_COST)
            yield off(row, f"{name} throughout", given[f"{name}_throughout"] - thus, slack, recomputed=thus)
        yield off(row, "the other choice is cheaper", max(0.0, given["objective"] - other), tolerance)
        yield off(row, "first stage", float(given["first_stage"] != first), 0.0, plan=first)
        shift = given["predicted_clearance_m"] - clearance
        yield off(row, "predicted clearance, m", shift, POSITION_TOLERANCE_M, recomputed_m=clearance)
    for name, positions in trajectories.items():
        step = np.linalg.norm(np.diff(positions, axis=0, prepend=row["initial_m"][None]), axis=1)
        over = (step / (limit * row.dt) - 1.0)[_clear(row, positions, period)]
        yield off(row, f"{name}: faster than the speed limit", np.maximum(0.0, over), SPEED_TOLERANCE)


def _clear(row: Row, positions: Array, period: float) -> npt.NDArray[np.bool_]:
    """Stages (N,) in which no control sample (every `period`, s) is within a safe distance by more than rounding."""
    centres = row["centres_m"]
    before = centres[0] - (centres[min(1, len(centres) - 1)] - centres[0])
    start = (np.linalg.norm(row["initial_m"] - before, axis=1) - row["distances_m"]).min(initial=np.inf)
    inside = np.concatenate([[start], row.clearance(positions)]) < -INSIDE_M
    several = row.dt > period + TIME_TOLERANCE_S  # samples within the stage: what they see is not recorded
    clear: npt.NDArray[np.bool_] = ~(inside[:-1] | (inside[1:] & several))
    return clear


def _answers(trace: Trace, rows: Sequence[Row]) -> Iterator[Off]:
    """The answers against the rules, decision by decision, and the times of the decisions."""
    gate = trace.scenario["gatekeeper"]
    for ugv in trace.ugvs:
        last: Row | None = None
        since = 0.0
        for row in (row for row in rows if row.given["robot"] == ugv):
            given, t, period = row.given, float(row.given["t_s"]), gate["period_s"]
            if last is not None and last.given["issued_s"] != given["issued_s"]:
                last = None
            standing = None if last is None else str(last.given["decision"])
            early = given["issued_s"] if last is None else last.given["t_s"] + period
            late = given["issued_s"] + period if last is None else early
            yield off(row, "a decision is missing before this one, s", max(0.0, t - late), TIME_TOLERANCE_S)
            yield off(row, "a decision too many, s", max(0.0, early - t), TIME_TOLERANCE_S)
            accept, reason = _rule(row, standing, t - since, gate)
            ours, theirs = ("accept" if accept else "refuse", reason), (given["decision"], given["reason"])
            yield off(row, "answer or reason", float(ours != theirs), 0.0, recomputed=list(ours), standing=standing)
            since = since if given["decision"] == standing else t
            last = row


def _rule(row: Row, standing: str | None, stood: float, gate: dict[str, Any]) -> tuple[bool, str]:
    """Whether a proposal is accepted and why, from the recorded costs and bend.

    Args:
        row: the decision.
        standing: the answer to this proposal so far, or None.
        stood: for how long it has been that, s.
        gate: the scenario's margins.
    """
    kept = {"accept": row.given["accept_throughout"], "refuse": row.given["refuse_throughout"]}
    bent, keep = row.given["bend"] > gate["max_bend"], 1.0 - gate["switching_margin"]
    if not row.planned:
        return False, "no_plan"
    if standing is None:
        if row["plan"][0] != 1.0:
            return False, "not_cheaper"
        if row.given["objective"] >= (1.0 - NO_DIFFERENCE) * kept["refuse"]:
            return False, "no_difference"
        return not bent, "bent" if bent else "cheaper"
    accepted = standing == "accept"
    cheaper = (row["plan"][0] == 1.0) != accepted and row.given["objective"] < keep * kept[standing]
    if not ((cheaper or bent) if accepted else (cheaper and not bent)):
        return accepted, "kept"
    if stood < gate["min_dwell_s"] - TIME_TOLERANCE_S:
        return accepted, "dwell"
    return not accepted, "reversed"


def _obeyed(trace: Trace, rows: Sequence[Row]) -> Iterator[Off]:
    """Interventions executed, by the signals, without an acceptance in force."""
    control, gate = trace.scenario["control"]["period_s"], trace.scenario["gatekeeper"]["period_s"]
    # a row has what the last control sample before it has set, by the answer given up to then
    sample = control * (np.ceil(trace.t / control - 1e-6) - 1.0)
    for ugv in trace.ugvs:
        own = [row for row in rows if row.given["robot"] == ugv]  # not empty if anything was executed: see `check`
        times = np.array([row.given["t_s"] for row in own])
        accepted = np.array([row.given["decision"] == "accept" for row in own])
        for k in np.flatnonzero(trace.column(f"{ugv}.accepted") == 1.0):
            last = int(np.searchsorted(times, sample[k] + TIME_TOLERANCE_S)) - 1
            age = sample[k] - times[last] if last >= 0 and accepted[last] else np.inf
            if age > gate + TIME_TOLERANCE_S:
                yield off(
                    own[max(last, 0)], "executed without an acceptance in force", 1.0, 0.0, row_t_s=float(trace.t[k])
                )


class GateSur(GateClaim):
    """GATE-SUR."""

    id = "GATE-SUR"
    statement = "Every relaxed plan was rounded by sum-up rounding, with an integrated error of at most half a stage."
    formula = (
        "rounded_k = 1 if D_k >= 1 - D_k else 0, D_k = sum_{r <= k} relaxed_r - sum_{r < k} rounded_r; "
        "max_k |dt sum_{r <= k} (relaxed_r - rounded_r)| <= dt / 2"
    )
    method = (
        "Running sums of the recorded relaxed and rounded plans. Each stage is judged by the deficits that the "
        "recorded rounding before it leaves, so that one wrong stage does not blur the next; deficits within 1e-9 of "
        "1/2 are a tie, where either mode may follow (exact ties should accept). Each error is judged against its own "
        "bound as well, so that the verdict does not rest on the theorem that follows from the rule."
    )
    equations = "(28)-(29)"
    assumptions = ("The relaxed plan recorded is the one that was rounded.",)
    does_not_establish = (
        "That the relaxed plan is optimal (GATE-OPT), or that the rounded one was taken: the cheapest plan known was. "
        "A small integrated error bounds positions, not costs."
    )

    def applies(self, trace: Trace) -> bool:
        """Only some routes round; a trace without a scenario is for `judge` to reject."""
        gate = trace.meta.get("scenario", {}).get("gatekeeper", {})
        return super().applies(trace) and gate.get("route", ROUNDED_ROUTES[0]) in ROUNDED_ROUTES

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Round again, and sum up; the margin is what is left of dt/2."""
        without = [row for row in rows if row.data["relaxed"] is None]
        if cut := [row for row in without if row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no relaxation")
        rounded = [row for row in rows if row.data["relaxed"] is not None]
        skipped = {"decisions": len(rows), "without_relaxation": [row.label for row in without]}
        if not rounded:
            return Finding("not_run", evidence={"reason": "no decision has a relaxation", **skipped})
        compared = [one for row in rounded for one in _rounding(row)]
        wrong = [one for one in compared if one.wrong]
        margins = [(row.dt / 2.0 - _deviation(row), i) for i, row in enumerate(rounded)]
        margin, worst = min(margins)
        return Finding(
            "refuted" if wrong else "holds",
            margin=None if wrong else max(0.0, margin),
            unit="s",
            where={"robot": rounded[worst].given["robot"], "t_s": rounded[worst].given["t_s"]},
            counterexample=_first(wrong),
            evidence={**skipped, "largest_error_s": _deviation(rounded[worst]), "bound_s": rounded[worst].dt / 2.0},
        )


def _deviation(row: Row) -> float:
    """Largest integrated difference of the relaxed and the rounded plan, s."""
    return float(row.dt * np.abs(np.cumsum(row["relaxed"] - row["rounded"])).max())


def _rounding(row: Row) -> Iterator[Off]:
    """(28)-(29) and what was recorded about it."""
    relaxed, rounded, given = row["relaxed"], row["rounded"], row.given
    yield off(row, "relaxed omega is outside [0, 1]", np.maximum(0.0, np.abs(relaxed - 0.5) - 0.5), 0.0)
    yield off(row, "rounded omega is not binary", np.minimum(np.abs(rounded), np.abs(rounded - 1.0)), 0.0)
    deficit = np.cumsum(relaxed) - np.concatenate([[0.0], np.cumsum(rounded)[:-1]])
    against = np.where(rounded == 1.0, 0.5 - deficit, deficit - 0.5)  # positive: the other mode lacks more
    yield off(row, "rounded against the rule", np.maximum(0.0, against), TIE, stage=int(np.argmax(against)))
    deviation = _deviation(row)
    yield off(row, "integrated rounding error, s", deviation, (0.5 + TIE) * row.dt)
    yield off(row, "recorded rounding error, s", given["rounding_deviation_s"] - deviation, TIE, recomputed_s=deviation)
    yield off(row, "recorded relaxed first stage", given["relaxed_first_stage"] - relaxed[0], TIE)


class GateOpt(GateClaim):
    """GATE-OPT."""

    largest_gap = 0.05
    """Gap that a decision may have: what a reversal needs by default (`switching_margin`) is no less."""
    widest = 1e-5
    """Width of an enclosure of the optimum, relative, up to which it decides anything."""

    id = "GATE-OPT"
    statement = (
        "Every gatekeeper decision that rests on a plan is within 5 % of the optimum of the problem that its route "
        "solves, and neither its lower bound nor its gap is recorded better than it is."
    )
    formula = (
        "L <= min J_n <= U, U - L <= 1e-5 C; lower_bound <= U + 1e-5 C; lower_bound >= L - 1e-3 C (relaxed); "
        "(J(plan) - L) / C <= 0.05; J(plan) <= J(0), J(1); C = min(J(0), J(1)); J is (25), J_n >= J with distances "
        "along unit normals n"
    )
    method = (
        "Route 'relaxed': the half-plane relaxations of all decisions, from recorded data and normals, are stacked "
        "into one program in multiple-shooting form and solved by cvxpy and Clarabel (OSQP reaches the same only to "
        "2e-5, in three to ten times the time). No solver is trusted: its plan, evaluated, is the upper "
        "bound U; its multipliers give L by weak duality, evaluated in numpy, whatever their quality. Routes "
        "'enumeration' and 'branch_and_bound': all plans of 10 blocks are evaluated. Other routes bound nothing, "
        "and the claim is inconclusive."
    )
    equations = "(25)-(27)"
    assumptions = (
        "The optimum is that of the recorded problem: mode velocities, and unit normals, are data.",
        "Route 'enumeration' and 'branch_and_bound' choose one mode for each of 10 blocks of stages.",
    )
    does_not_establish = (
        "Optimality for the exact distances of (26d) (half-planes are conservative: another choice of normals may "
        "allow a cheaper plan), for another dwell, or for the nonlinear closed loop; nor that the first stage is the "
        "optimal one, unless counted as certified. Where the plan is the better by exact distances, it may cost less "
        "than the bound, and the gap is negative. Refusals for want of a plan are only listed."
    )

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Enclose every optimum; the margin is what is left of the largest gap allowed."""
        route, planned = trace.scenario["gatekeeper"]["route"], [row for row in rows if row.planned]
        convexified = route in HALF_PLANE_ROUTES
        bounded = [row for row in planned if row.data["normals"] is not None] if convexified else planned
        if cut := [row for row in planned if row not in bounded and row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no normals")
        if route not in HALF_PLANE_ROUTES + DWELL_ROUTES:
            wrong = [one for row in planned for one in _no_worse(row) if one.wrong]
            reason = f"route {route!r} has no bound that can be established again"
            status: Status = "refuted" if wrong else "inconclusive"
            return Finding(status, counterexample=_first(wrong), evidence={"decisions": len(rows), "reason": reason})
        lacking = [row.label for row in planned if row not in bounded]
        dwelling = route in DWELL_ROUTES
        enclosures = [_cheapest(row, row.lines(route)) for row in bounded] if dwelling else enclose(bounded)
        judged = list(zip(bounded, enclosures, strict=True))
        gaps = [(float(row.cost(row["positions_m"])) - one.lower) / row.scale for row, one in judged]
        width = max(((one.upper - one.lower) / row.scale for row, one in judged), default=0.0)
        compared = [one for row in planned for one in _no_worse(row)]
        for (row, found), gap in zip(judged, gaps, strict=True):
            compared += [*_bounds(row, found, row.lines(route)), off(row, "gap", max(0.0, gap), self.largest_gap)]
        wrong = [one for one in compared if one.wrong]
        undecided = bool(lacking) or not bounded or width > self.widest
        worst = [
            {"t_s": bounded[i].given["t_s"], "robot": bounded[i].given["robot"], "gap": float(gaps[i])}
            for i in np.argsort(gaps)[:-6:-1]
        ]
        return Finding(
            "refuted" if wrong else "inconclusive" if undecided else "holds",
            margin=None if wrong or undecided else self.largest_gap - worst[0]["gap"],
            unit="of the cheaper constant plan's cost",
            where={name: worst[0][name] for name in ("robot", "t_s")} if worst else {},
            counterexample=_first(wrong),
            evidence={
                "decisions": len(rows),
                "bounded": len(bounded),
                "without_a_bound": lacking,
                "without_a_plan": [row.label for row in rows if not row.planned],
                "largest_gap": worst[0]["gap"] if worst else None,
                "median_gap": float(np.median(gaps)) if gaps else None,
                "widest_enclosure": float(width),
                "first_stage_certified": sum(
                    bool(one.other_first > one.lower + gap * row.scale)
                    for (row, one), gap in zip(judged, gaps, strict=True)
                ),
                "largest_gaps": worst,
            },
        )


@dataclass(frozen=True)
class Enclosure:
    """Bounds of the optimum of one decision's problem, and a lower one for plans with the other first stage."""

    lower: float
    upper: float
    other_first: float = -np.inf


def _no_worse(row: Row) -> Iterator[Off]:
    """The plan against the constant ones, by the exact cost; each choice against the constant plan that makes it."""
    refuse, accept = row.cost(row.constant).tolist()
    for name, constant in (("refuse", refuse), ("accept", accept)):
        tolerance = COST_TOLERANCE * max(constant, LEAST_COST)
        for column in ("objective", f"objective_{name}"):
            excess = row.given[column] - constant
            yield off(row, f"{column} above {name} throughout", max(0.0, excess), tolerance, constant_plan=constant)


def _bounds(row: Row, found: Enclosure, normals: Array | None) -> Iterator[Off]:
    """The recorded normals, lower bound and gap."""
    given, bound, scale = row.given, float(row.given["lower_bound"]), row.scale
    own = float(row.cost(row["positions_m"], normals))
    known = [*row.constant, *([row.positions(row["rounded"])] if row.data["rounded"] is not None else [])]
    # the losing choice's plan is not recorded, but along normals it costs no less than by exact distances
    best = min(
        own, max(given["objective_accept"], given["objective_refuse"]), *(float(row.cost(p, normals)) for p in known)
    )
    if normals is not None:
        yield off(row, "length of a normal, minus 1", np.linalg.norm(normals, axis=2) - 1.0, POSITION_TOLERANCE_M)
    more = {"lower_bound": bound, "optimum_at_least": found.lower, "optimum_at_most": found.upper}
    yield off(row, "lower bound above the plan's cost", max(0.0, bound - own) / scale, OVERSTATED, cost=own)
    yield off(row, "lower bound overstated", max(0.0, bound - found.upper) / scale, OVERSTATED, **more)
    if given["status"] == "optimal" and given["route"] != "branch_and_bound":
        yield off(row, "lower bound understated", max(0.0, found.lower - bound) / scale, UNDERSTATED, **more)
    least, most = ((cost - bound) / max(cost, 1e-12) for cost in (best, own))
    beyond = max(0.0, least - given["gap"], given["gap"] - most)
    yield off(row, "recorded gap", beyond, GAP_TOLERANCE, recorded=given["gap"], at_least=least, at_most=most)


def _cheapest(row: Row, normals: Array | None) -> Enclosure:
    """The cheapest of all plans that are constant on blocks, by evaluating each."""
    stages = len(row["reference_m"])
    blocks = min(BLOCKS, stages)
    modes = (np.arange(2**blocks)[:, None] >> np.arange(blocks)) % 2
    omega = modes[:, np.arange(stages) * blocks // stages].astype(np.float64)
    cost = row.cost(row.positions(omega), normals)
    least = float(cost.min())
    return Enclosure(least, least, float(cost[omega[:, 0] != row["plan"][0]].min()))


def enclose(rows: Sequence[Row]) -> list[Enclosure]:
    """Bounds of the optimum over omega in [0, 1]^N of the cost with distances along the normals.

    For any multipliers l_kj >= 0 of u_k >= d_j - n_kj.(rho_k - o_kj), minimising the Lagrangian over u leaves
    q(omega) - sum_k (sum_j l_kj)^2 / (4 dt b), q convex and quadratic, of which the tangent at any omega* is below
    it everywhere, and least at a corner of the box. Both l and omega* are the solver's; neither need be good.
    """
    if not rows:
        return []
    shares, multipliers = _solve(rows)
    found = []
    for row, omega, solved in zip(rows, shares, multipliers, strict=True):
        dt, error, slack, normals = row.dt, row.error_weight, row.slack_weight, row["normals"]
        multiplier = solved * row.scale if slack > 0.0 else 0.0 * solved
        positions = row.positions(omega)
        away = positions - row["reference_m"]
        reach = np.einsum("kmi,kmi->km", normals, positions[:, None] - row["centres_m"])
        value = dt * error * np.square(away).sum() + (multiplier * (row["distances_m"] - reach)).sum()
        value -= np.square(multiplier.sum(axis=1)).sum() / (4.0 * dt * slack) if slack > 0.0 else 0.0
        by_position = 2.0 * dt * error * away - np.einsum("km,kmi->ki", multiplier, normals)
        change = dt * (row["accept_m_s"] - row["refuse_m_s"])
        slope = np.einsum("ki,ki->k", change, np.cumsum(by_position[::-1], axis=0)[::-1])
        corner = np.minimum(-slope * omega, slope * (1.0 - omega))
        first = 1.0 - row["plan"][0]
        other = value + corner[1:].sum() + slope[0] * (first - omega[0])
        found.append(Enclosure(float(value + corner.sum()), float(row.cost(positions, normals)), float(other)))
    return found


def _solve(rows: Sequence[Row]) -> tuple[list[Array], list[Array]]:
    """Relaxed plans (N,) and multipliers (N, m) >= 0, costs relative to `Row.scale`, of all rows as one program.

    Variables, stage by stage of row by row: task errors e = rho - reference, omega and u.

    Raises:
        TraceError: if the solver gives no solution at all.
    """
    import cvxpy  # takes a second, which other claims need not wait for

    cp: Any = cvxpy  # its types are incomplete
    stages = len(rows[0]["reference_m"])
    total = stages * len(rows)
    change = np.concatenate([row.dt * (row["accept_m_s"] - row["refuse_m_s"]) for row in rows])
    before = [np.vstack([row["initial_m"], row["reference_m"][:-1]]) - row["reference_m"] for row in rows]
    drift = np.concatenate([row.dt * row["refuse_m_s"] + shift for row, shift in zip(rows, before, strict=True)])
    follows = np.arange(3, 3 * total) // 3 % stages != 0
    dynamics = sparse.eye(3 * total) - sparse.diags(follows.astype(float), -3)
    index = np.arange(3 * total)
    steering = sparse.csr_matrix((change.ravel(), (index, index // 3)), shape=(3 * total, total))
    stage, normal, least = [], [], []
    for i, row in enumerate(rows):
        stage.append(i * stages + np.repeat(np.arange(stages), len(row["distances_m"])))
        normal.append(row["normals"].reshape(-1, 3))
        shift = row["centres_m"] - row["reference_m"][:, None]
        least.append((row["distances_m"] + np.einsum("kmi,kmi->km", row["normals"], shift)).ravel())
    at, along = np.concatenate(stage), np.concatenate(normal)
    count, place = len(at), np.arange(len(at))
    facing = sparse.csr_matrix(
        (along.ravel(), (np.repeat(place, 3), (3 * at[:, None] + np.arange(3)).ravel())), shape=(count, 3 * total)
    )
    picks = sparse.csr_matrix((np.ones(count), (place, at)), shape=(count, total))

    def weights(name: str, times: int) -> Array:
        return np.repeat([np.sqrt(row.dt * getattr(row, name) / row.scale) for row in rows], times * stages)

    e, omega, u = cp.Variable(3 * total), cp.Variable(total), cp.Variable(total)
    constraints = [dynamics @ e - steering @ omega == drift.ravel(), omega >= 0.0, omega <= 1.0, u >= 0.0]
    constraints += [facing @ e + picks @ u >= np.concatenate(least)] if count else []
    error = cp.sum_squares(cp.multiply(weights("error_weight", 3), e))
    slack = cp.sum_squares(cp.multiply(weights("slack_weight", 1), u))
    cp.Problem(cp.Minimize(error + slack), constraints).solve(solver=cp.CLARABEL)
    if omega.value is None:
        raise TraceError("the independent solver gave no solution")
    shares = [np.clip(part, 0.0, 1.0) for part in np.split(omega.value, len(rows))]
    dual = np.maximum(0.0, constraints[-1].dual_value) if count else np.empty(0)
    parts = np.split(dual, np.cumsum([len(one) for one in stage])[:-1])
    return shares, [part.reshape(stages, -1) if part.size else np.zeros((stages, 0)) for part in parts]
