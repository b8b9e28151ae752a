"""GATE-FEAS, GATE-SUR and GATE-OPT on problems small enough to enumerate every binary plan, and on real runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest
import synthetic
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from airground_drake.arrays import Array
from airground_drake.gatekeeper.answer import Rules, settle
from airground_drake.gatekeeper.solution import Solution
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Gatekeeper, Obstacle, Preset, Run, Scenario, Ugv
from airground_drake.simulation import simulate
from airground_drake.trace import DECISION_COLUMNS, PROBLEM_ARRAYS, PROBLEM_SCALARS, Trace, save
from airground_drake.trace import load as load_trace
from airground_drake.verify import gatekeeping, optimality
from airground_drake.verify.decisions import Off, Row, rows_of
from airground_drake.verify.gatekeeping import GateFeas
from airground_drake.verify.optimality import GateOpt, GateSur, enclose
from airground_drake.verify.verdict import TraceClaim

N, DT = 8, 0.05
PLANS = np.array(list(product((0.0, 1.0), repeat=N)))
FEAS, SUR, OPT = GateFeas(), GateSur(), GateOpt()


class Data:
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
        self.accept = (np.array([2.0, 3.0, 0.0]) + rng.uniform(-1.0, 1.0, (N, 3))) * planar
        self.refuse = (np.array([0.0, 0.5, 0.0]) + rng.uniform(-0.4, 0.4, (N, 3))) * planar
        self.initial, self.reference, self.centres, self.distances = initial, reference, centres, distances
        self.error_weight, self.slack_weight = 1.0, slack_weight
        self.guide = min((self.positions(np.full(N, mode)) for mode in (0.0, 1.0)), key=self.cost)
        away = self.guide[:, None] - centres
        self.normals = away / np.linalg.norm(away, axis=2)[:, :, None]

    def positions(self, omega: Array) -> Array:
        at, path = self.initial.copy(), []
        for k in range(N):
            at = at + DT * (omega[k] * self.accept[k] + (1.0 - omega[k]) * self.refuse[k])
            path.append(at)
        return np.array(path)

    def cost(self, positions: Array, along: bool = False) -> float:
        total = 0.0
        for k, at in enumerate(positions):
            slack = 0.0
            for j, distance in enumerate(self.distances):
                away = at - self.centres[k, j]
                slack = max(slack, distance - (self.normals[k, j] @ away if along else np.linalg.norm(away)))
            total += DT * (self.error_weight * np.sum((self.reference[k] - at) ** 2) + self.slack_weight * slack**2)
        return float(total)

    def plan_cost(self, omega: Array, along: bool = False) -> float:
        return self.cost(self.positions(omega), along)

    def relaxed(self) -> tuple[Array, float]:
        """By a quasi-Newton method in a box: another method, and another form, than the checker's."""
        best = minimize(
            lambda omega: self.plan_cost(omega, along=True), np.full(N, 0.5), bounds=[(0.0, 1.0)] * N,
            method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-10, "maxfun": 100000},
        )  # fmt: skip
        return np.clip(best.x, 0.0, 1.0), float(best.fun)

    def clearance(self, positions: Array) -> float:
        return float((np.linalg.norm(positions[:, None] - self.centres, axis=2) - self.distances).min())


@pytest.fixture(autouse=True)
def _scripted(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The UGVs of scripted traces do not follow their own task; those of real runs do."""
    if "real" not in request.node.name and "hides" not in request.node.name:
        monkeypatch.setattr(gatekeeping, "_own_task", lambda trace, rows: iter(()))


def rounding(relaxed: Array) -> Array:
    rounded: list[float] = []
    for k in range(N):
        deficits = relaxed[: k + 1].sum() - sum(rounded), (1.0 - relaxed[: k + 1]).sum() - (k - sum(rounded))
        rounded.append(1.0 if deficits[0] >= deficits[1] else 0.0)
    return np.array(rounded)


def scenario(route: str) -> dict[str, Any]:
    def ugv(x: float) -> Ugv:
        return Ugv([x, 0.0, 0.0], [x, 9.0, 0.0], Preset([[x, 2.0, 0.0], [x, 9.0, 0.0]], 1.0))

    gate = Gatekeeper(route=route, horizon_s=N * DT, stages=N, slack_weight_1_m2_s=10.0)
    spec = Scenario(
        duration_s=0.5, ugvs={"ugv1": ugv(0.0), "ugv2": ugv(-3.0)}, uav=synthetic.AWAY, gatekeeper=gate,
        obstacles={"rock": Obstacle([1.2, 2.4, 0.0]), "far": Obstacle([30.0, 0.0, 0.0])}, runs={"d": Run()},
    )  # fmt: skip
    return asdict(spec)


def problem_at(trace: Trace, t: float) -> Data:
    """What ugv1 senses: the rock, and ugv2, which drives at it."""
    k = int(np.argmin(np.abs(trace.t - t)))
    after = DT * np.arange(1, N + 1)[:, None]
    rock = np.tile([1.2, 2.4, 0.0], (N, 1))
    other = trace.position("ugv2")[k] + after * np.array([0.5, 0.1, 0.0])
    centres, distances = np.stack([rock, other], axis=1), np.array([2.0, 2.0])
    reference = np.array([0.0, 2.0, 0.0]) + (t + after) * np.array([0.0, 1.0, 0.0])
    return Data(round(1000 * t), trace.position("ugv1")[k], reference, centres, distances)


def solve(data: Data, route: str) -> Solution:
    """As the route's documentation has it."""
    relaxed, optimum = data.relaxed()
    rounded = rounding(relaxed)
    every = route in ("enumeration", "branch_and_bound")
    plans = [*PLANS] if every else [rounded, np.ones(N), np.zeros(N)]
    best = min(plans, key=data.plan_cost)
    positions = data.positions(best)
    along = route in ("relaxed", "branch_and_bound")
    least = min(data.plan_cost(plan, along) for plan in (best, rounded, np.ones(N), np.zeros(N)))
    bound = {"relaxed": optimum, "enumeration": least}.get(route, -1.0)
    if route == "branch_and_bound":
        bound = 0.99 * min(data.plan_cost(plan, along=True) for plan in PLANS)
        least = min(data.plan_cost(plan, along=True) for plan in (best, np.ones(N), np.zeros(N)))
    rounds, solves = route in ("relaxed", "nonlinear"), route in ("relaxed", "enumeration", "branch_and_bound")
    return Solution(
        accept_first=best[0] == 1.0,
        status="optimal",
        objective=data.cost(positions),
        lower_bound=bound,
        gap=(least - bound) / least if solves else -1.0,
        objective_accept=min(data.plan_cost(plan) for plan in plans if plan[0] == 1.0),
        objective_refuse=min(data.plan_cost(plan) for plan in plans if plan[0] == 0.0),
        relaxed_first_stage=float(relaxed[0]) if rounds else -1.0,
        rounding_deviation=float(DT * np.abs(np.cumsum(relaxed - rounded)).max()) if rounds else -1.0,
        clearance=data.clearance(positions),
        plan=best,
        positions=positions,
        relaxed=relaxed if rounds else None,
        rounded=rounded if rounds else None,
        normals=data.normals if along else None,
    )


def recorded(route: str = "relaxed") -> Trace:
    """Six decisions of ugv1 on a proposal of t = 0."""
    spec = scenario(route)
    base = synthetic.simulate(spec, "d", lambda t: [[0.1, 0.2, 0.0], [0.5, 0.1, 0.0], [0.0, 0.0, 0.0]])
    rules = Rules(switching_margin=spec["gatekeeper"]["switching_margin"], min_dwell=0.2, max_bend=0.5)
    standing, since, decisions, problems = SILENT, 0.0, [], []
    for k in range(1, 7):
        t = k * DT
        data = problem_at(base, t)
        found = solve(data, route)
        throughout = data.plan_cost(np.ones(N)), data.plan_cost(np.zeros(N))
        accepted, reason = settle(found, throughout, 0.1, standing, t - since, rules)
        answer = ACCEPT if accepted else REFUSE
        standing, since = answer, since if answer == standing else t
        decisions.append(
            {
                "t_s": t, "robot": "ugv1", "policy": "detour", "issued_s": 0.0, "reason": reason,
                "decision": "accept" if accepted else "refuse", "status": found.status, "route": route,
                "first_stage": "accept" if found.accept_first else "refuse", "objective": found.objective,
                "relaxed_first_stage": found.relaxed_first_stage, "lower_bound": found.lower_bound, "gap": found.gap,
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
        problems.append([DT, data.error_weight, data.slack_weight, *flat])
    return replace(
        base,
        decisions=pd.DataFrame(decisions, columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )


Edit = Callable[[dict[str, Any], dict[str, Any]], None]


def edited(trace: Trace, edit: Edit, row: int = 2) -> Trace:
    """A copy in which one decision, given as its columns and its problem (arrays flat), was edited."""
    decisions, problems = trace.decisions.to_dict("records"), trace.problems.to_dict("records")
    problems[row] = {k: np.array(v, dtype=float) if k in PROBLEM_ARRAYS else v for k, v in problems[row].items()}
    edit(decisions[row], problems[row])
    return replace(
        trace,
        decisions=pd.DataFrame(decisions, columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )


@pytest.fixture(scope="module")
def relaxed() -> Trace:
    return recorded()


@pytest.mark.parametrize(
    ("route", "expected"),
    [
        ("relaxed", ("holds", "holds", "holds")),
        ("nonlinear", ("holds", "holds", "inconclusive")),
        ("enumeration", ("holds", None, "holds")),
        ("branch_and_bound", ("holds", None, "holds")),
        ("rollout", ("holds", None, "inconclusive")),
    ],
)
def test_good_decisions_pass_where_there_is_something_to_check(route: str, expected: tuple[str | None, ...]) -> None:
    trace = recorded(route)
    for claim, status in zip((FEAS, SUR, OPT), expected, strict=True):
        assert claim.applies(trace) == (status is not None)
        finding = claim.judge(trace)
        if status is not None:
            assert finding.status == status, finding
        if status == "holds":
            assert finding.margin is not None
            assert finding.margin >= 0.0


def test_the_example_is_not_trivial(relaxed: Trace) -> None:
    rows = rows_of(relaxed)
    assert {0.0, 1.0} <= {float(row["plan"][0]) for row in rows} | {float(row["plan"][-1]) for row in rows}
    assert any(0.0 < value < 1.0 for row in rows for value in row["relaxed"])
    assert any(row.clearance(row.constant).min() < 0.0 for row in rows)
    evidence = OPT.judge(relaxed).evidence
    assert evidence["bounded"] == len(rows)
    assert evidence["largest_gap"] > 1e-4
    assert evidence["widest_enclosure"] < 1e-6


def flip_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["plan"] = 1.0 - problem["plan"]


def fractional_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["plan"][3] = 0.5


def shift_position(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["positions_m"][3] += 1e-6


def shift_initial(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["initial_m"][0] += 1e-6


def shift_reference(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["reference_m"][-2] -= 1e-6


def understate_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
    chosen = f"objective_{row['first_stage']}"
    row["objective"] *= 1.0 - 1e-6
    row[chosen] = row["objective"]


def inflate_loser(row: dict[str, Any], problem: dict[str, Any]) -> None:
    other = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]
    row[f"objective_{other}"] *= 10.0


def overstate_clearance(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["predicted_clearance_m"] += 1e-3


def wrong_first_stage(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["first_stage"] = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]


def without_point(index: int) -> Edit:
    def edit(row: dict[str, Any], problem: dict[str, Any]) -> None:
        keep = 1 - index
        problem["centres_m"] = problem["centres_m"].reshape(N, 2, 3)[:, keep : keep + 1].ravel()
        problem["normals"] = problem["normals"].reshape(N, 2, 3)[:, keep : keep + 1].ravel()
        problem["distances_m"] = problem["distances_m"][keep : keep + 1]

    return edit


def smaller_distance(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["distances_m"][0] = 1.9


def standing_robot(row: dict[str, Any], problem: dict[str, Any]) -> None:
    centres = problem["centres_m"].reshape(N, 2, 3)
    centres[:, 1] = centres[0, 1]


def lighter_slack(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["slack_weight_1_m2_s"] = 1.0


def too_fast(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["refuse_m_s"][:3] = [0.0, -6.1, 0.0]


def contrary_answer(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["decision"] = {"accept": "refuse", "refuse": "accept"}[row["decision"]]


def wrong_reason(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["reason"] = "dwell"


def bent(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["bend"] = 0.9


def round_otherwise(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"][4] = 1.0 - problem["rounded"][4]


def fractional_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"] = problem["relaxed"].copy()
    row["rounding_deviation_s"] = 0.0


def relaxed_outside(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["relaxed"][0] = 1.0 + 1e-6


def understate_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["rounding_deviation_s"] *= 0.5


def overstate_bound(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["lower_bound"] *= 1.001
    row["gap"] = 1.0 - (1.0 - row["gap"]) * 1.001


def understate_bound(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["lower_bound"] *= 0.99
    row["gap"] = 1.0 - (1.0 - row["gap"]) * 0.99


def understate_gap(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["gap"] *= 0.5


def long_normals(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["normals"] *= 1.01


def worst_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    """A consistent record of a plan that is worse than both constant ones."""
    accept, refuse = (problem[name].reshape(N, 3) for name in ("accept_m_s", "refuse_m_s"))
    shape = (N, len(problem["distances_m"]), 3)

    def cost(plan: Array) -> float:
        positions = problem["initial_m"] + DT * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
        gap = problem["distances_m"] - np.linalg.norm(positions[:, None] - problem["centres_m"].reshape(shape), axis=2)
        error = positions - problem["reference_m"].reshape(N, 3)
        return float(DT * (np.sum(error**2) + 10.0 * np.sum(np.maximum(0.0, gap.max(axis=1)) ** 2)))

    plan = max(PLANS, key=cost)
    problem["plan"] = plan
    problem["positions_m"] = (
        problem["initial_m"] + DT * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
    ).ravel()
    row["objective"] = cost(plan)


MUTANTS: list[tuple[TraceClaim, Edit, str]] = [
    (FEAS, flip_plan, "positions are not those of (23)"),
    (FEAS, fractional_plan, "omega is not binary"),
    (FEAS, shift_position, "positions are not those of (23)"),
    (FEAS, shift_initial, "initial position"),
    (FEAS, shift_reference, "reference"),
    (FEAS, understate_cost, "objective"),
    (FEAS, overstate_clearance, "predicted clearance"),
    (FEAS, wrong_first_stage, "first stage"),
    (FEAS, without_point(0), "rock is left out"),
    (FEAS, without_point(1), "ugv2 is left out"),
    (FEAS, smaller_distance, "nothing that the UGV senses"),
    (FEAS, standing_robot, "nothing that the UGV senses"),
    (FEAS, lighter_slack, "weight of slack"),
    (FEAS, too_fast, "faster than the speed limit"),
    (FEAS, contrary_answer, "answer or reason"),
    (FEAS, wrong_reason, "answer or reason"),
    (SUR, round_otherwise, "rounded against the rule"),
    (SUR, fractional_rounding, "rounded omega is not binary"),
    (SUR, relaxed_outside, "outside [0, 1]"),
    (SUR, understate_rounding, "recorded rounding error"),
    (OPT, overstate_bound, "lower bound overstated"),
    (OPT, understate_bound, "lower bound understated"),
    (OPT, understate_gap, "recorded gap"),
    (OPT, long_normals, "length of a normal"),
    (OPT, inflate_loser, "throughout"),
    (OPT, worst_plan, "objective above"),
]


@pytest.mark.parametrize(
    ("claim", "edit", "what"), MUTANTS, ids=[f"{m[0].id}-{m[2]}-{i}" for i, m in enumerate(MUTANTS)]
)
def test_a_mutant_is_refuted(relaxed: Trace, claim: TraceClaim, edit: Edit, what: str) -> None:
    trace = edited(relaxed, edit)
    finding = claim.judge(trace)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample["robot"] == "ugv1"
    assert finding.counterexample["t_s"] <= 0.2 + 1e-9  # the edited row, or the one that has to follow from it
    found = {one.what for one in _compared(claim, trace) if one.wrong}
    assert any(what in text for text in found), found


def _compared(claim: TraceClaim, trace: Trace) -> list[Off]:
    rows = rows_of(trace)
    if claim is SUR:
        return [one for row in rows for one in optimality._rounding(row)]
    if claim is OPT:
        pairs = zip(rows, enclose(rows), strict=True)
        return [one for row in rows for one in optimality._no_worse(row)] + [
            one for row, found in pairs for one in optimality._bounds(row, found, row["normals"])
        ]
    described = [one for row in rows for one in (*gatekeeping._situation(trace, row), *gatekeeping._plan(trace, row))]
    return [*described, *gatekeeping._answers(trace, rows)]


def test_hidden_slack_is_refuted() -> None:
    """The cost of the error alone, of a plan that leads inside the safe distance."""
    trace = recorded()

    def hide(row: dict[str, Any], problem: dict[str, Any]) -> None:
        accept = problem["accept_m_s"].reshape(N, 3)
        positions = problem["initial_m"] + DT * np.cumsum(accept, axis=0)
        problem["plan"], problem["positions_m"] = np.ones(N), positions.ravel()
        row["objective"] = float(DT * np.sum((positions - problem["reference_m"].reshape(N, 3)) ** 2))
        row["objective_accept"], row["first_stage"] = row["objective"], "accept"
        away = np.linalg.norm(positions[:, None] - problem["centres_m"].reshape(N, 2, 3), axis=2)
        row["predicted_clearance_m"] = float((away - problem["distances_m"]).min())

    mutant = edited(trace, hide)
    assert rows_of(mutant)[2].clearance(rows_of(mutant)[2]["positions_m"]).min() < 0.0
    finding = FEAS.judge(mutant)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["what"] == "objective"


def test_a_bend_that_should_have_refused_is_refuted() -> None:
    trace = recorded()
    first = edited(trace, bent, row=0)
    accepted = trace.decisions["decision"].iloc[0] == "accept"
    assert (FEAS.judge(first).status == "refuted") == accepted
    assert accepted, "the example should start with an acceptance"


def test_rollouts_may_leave_23_after_the_first_change_only() -> None:
    trace = recorded("rollout")

    def record(row: dict[str, Any], problem: dict[str, Any], shifts: dict[int, list[float]]) -> None:
        """A plan that refuses up to stage 5, and whose positions are elsewhere at some stages."""
        plan = (np.arange(N) > 5).astype(float)
        positions = problem["initial_m"] + DT * np.cumsum(problem["refuse_m_s"].reshape(N, 3), axis=0)
        for stage, shift in shifts.items():
            positions[stage] += shift
        problem["plan"], problem["positions_m"], row["first_stage"] = plan, positions.ravel(), "refuse"
        row["objective"] = row["objective_refuse"] = _cost(problem)
        row["predicted_clearance_m"] = _clearance(problem)

    def wrong(shifts: dict[int, list[float]]) -> set[str]:
        mutant = edited(trace, lambda row, problem: record(row, problem, shifts))
        return {one.what for one in _compared(FEAS, mutant) if one.wrong} - {"the other choice is cheaper"}

    accepts = {"answer or reason"} if trace.decisions["decision"].iloc[2] == "accept" else set()
    assert wrong({6: [0.1, 0.0, 0.0], 7: [0.1, 0.0, 0.0]}) <= accepts
    assert "positions are not those of (23), m" in wrong({3: [0.01, 0.0, 0.0]})
    assert "the plan: faster than the speed limit" in wrong({7: [0.0, -2.0, 0.0]})


def _cost(problem: dict[str, Any]) -> float:
    away = problem["positions_m"].reshape(N, 3)[:, None] - problem["centres_m"].reshape(N, -1, 3)
    slack = np.maximum(0.0, (problem["distances_m"] - np.linalg.norm(away, axis=2)).max(axis=1))
    return float(DT * (np.sum((problem["positions_m"] - problem["reference_m"]) ** 2) + 10.0 * np.sum(slack**2)))


def _clearance(problem: dict[str, Any]) -> float:
    away = problem["positions_m"].reshape(N, 3)[:, None] - problem["centres_m"].reshape(N, -1, 3)
    return float((np.linalg.norm(away, axis=2) - problem["distances_m"]).min())


def test_malformed_records_are_errors(relaxed: Trace) -> None:
    def nan(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["accept_m_s"][0] = np.nan

    def nan_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["objective"] = np.nan

    def cut(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["positions_m"] = problem["positions_m"][:-1]

    def planless(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["plan"] = []

    def other_route(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["route"] = "enumeration"

    for claim in (FEAS, SUR, OPT):
        for edit in (nan, nan_cost, cut, planless, other_route):
            assert claim.judge(edited(relaxed, edit)).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.iloc[1:])).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.drop(columns="plan"))).status == "error"


def test_a_complete_decision_without_its_evidence_is_an_error(relaxed: Trace) -> None:
    def without(name: str) -> Edit:
        def edit(row: dict[str, Any], problem: dict[str, Any]) -> None:
            problem[name] = []

        return edit

    assert SUR.judge(edited(relaxed, without("relaxed"))).status == "error"
    assert OPT.judge(edited(relaxed, without("normals"))).status == "error"


def test_a_decision_cut_short_by_its_budget_is_listed_and_never_passes_for_bounded(relaxed: Trace) -> None:
    def spent(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["status"] = "budget_spent"
        problem["relaxed"], problem["rounded"], problem["normals"] = [], [], []

    trace = edited(relaxed, spent)
    assert SUR.judge(trace).evidence["without_relaxation"] == ["decision of ugv1 at t = 0.15000000000000002 s"]
    finding = OPT.judge(trace)
    assert finding.status == "inconclusive"
    assert len(finding.evidence["without_a_bound"]) == 1


def refused_for_want_of_a_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row |= {"status": "refused_solver_failed", "decision": "refuse", "reason": "no_plan"}
    for name in ("plan", "positions_m", "relaxed", "rounded", "normals"):
        problem[name] = []


def test_a_refusal_without_a_plan_is_in_order_but_an_acceptance_is_not(relaxed: Trace) -> None:
    last = len(relaxed.decisions) - 1
    trace = edited(relaxed, refused_for_want_of_a_plan, row=last)
    for claim in (FEAS, SUR, OPT):
        assert claim.judge(trace).status == "holds"
    assert len(FEAS.judge(trace).evidence["without_a_plan"]) == 1

    def accepted(row: dict[str, Any], problem: dict[str, Any]) -> None:
        refused_for_want_of_a_plan(row, problem)
        row["decision"] = "accept"

    assert FEAS.judge(edited(relaxed, accepted, row=last)).status == "refuted"


def test_without_a_single_plan_nothing_is_established(relaxed: Trace) -> None:
    trace = relaxed
    for row in range(len(relaxed.decisions)):
        trace = edited(trace, refused_for_want_of_a_plan, row=row)
    assert SUR.judge(trace).status == "not_run"
    assert OPT.judge(trace).status == "inconclusive"


def test_a_decision_removed_from_both_tables_is_missed(relaxed: Trace) -> None:
    for row in (0, 2):
        gone = replace(relaxed, decisions=relaxed.decisions.drop(row), problems=relaxed.problems.drop(row))
        finding = FEAS.judge(gone)
        assert finding.status == "refuted"
        assert finding.counterexample is not None
        assert "missing" in finding.counterexample["what"]
    twice = [0, 1, 1, 2, 3, 4, 5]
    doubled = replace(relaxed, decisions=relaxed.decisions.iloc[twice], problems=relaxed.problems.iloc[twice])
    assert FEAS.judge(doubled).status == "refuted"


def test_no_row_is_exchanged_unnoticed(relaxed: Trace) -> None:
    order = [0, 2, 1, 3, 4, 5]
    assert FEAS.judge(replace(relaxed, problems=relaxed.problems.iloc[order])).status == "refuted"


def test_an_execution_needs_an_acceptance(relaxed: Trace) -> None:
    def executed(signals: pd.DataFrame) -> None:
        signals.loc[signals["t_s"] > 0.42, "ugv1.accepted"] = 1.0

    trace = synthetic.with_signals(relaxed, executed)
    finding = FEAS.judge(trace)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["what"] == "executed without an acceptance in force"
    assert (
        FEAS.judge(replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])).status
        == "not_run"
    )


def test_no_decision_at_all() -> None:
    trace = recorded()
    none = replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])

    def intervening(signals: pd.DataFrame) -> None:
        signals.loc[signals["t_s"] > 0.2, "ugv2.mode"] = 1.0

    for claim in (FEAS, SUR, OPT):
        assert claim.judge(none).status == "holds"
        assert claim.judge(synthetic.with_signals(none, intervening)).status == "not_run"
        assert claim.judge(synthetic.with_signals(trace, intervening)).status == "not_run"
        assert claim.judge(replace(trace, problems=trace.problems.iloc[:0])).status == "not_run"
        assert not claim.applies(synthetic.with_meta(trace, method="b"))


@st.composite
def problems(draw: st.DrawFn) -> Data:
    """Random problems, some without points, some with points on the way."""
    count, seed = draw(st.integers(0, 3)), draw(st.integers(0, 10**6))
    rng = np.random.default_rng(seed)
    slack_weight = draw(st.sampled_from([0.0, 10.0, 1000.0]))
    centres = np.tile(rng.uniform([-1.0, 0.0, 0.0], [2.0, 3.0, 0.0], (count, 3)), (N, 1, 1))
    reference = np.array([0.0, 1.0, 0.0]) + np.outer(DT * np.arange(1, N + 1), rng.uniform(-2.0, 2.0, 3) * [1, 1, 0])
    return Data(seed, np.zeros(3), reference, centres, rng.uniform(0.5, 2.0, count), slack_weight)


def row_of(data: Data, plan: Array) -> Row:
    arrays = {
        "initial_m": data.initial, "accept_m_s": data.accept, "refuse_m_s": data.refuse, "plan": plan,
        "reference_m": data.reference, "centres_m": data.centres, "distances_m": data.distances,
        "normals": data.normals,
    }  # fmt: skip
    return Row({"robot": "ugv1", "t_s": 0.0}, DT, data.error_weight, data.slack_weight, dict(arrays))


@settings(max_examples=25, deadline=None)
@given(st.lists(problems(), min_size=1, max_size=3))
def test_the_enclosure_contains_the_relaxed_optimum_and_is_below_every_binary_plan(several: list[Data]) -> None:
    rows = [row_of(data, np.zeros(N)) for data in several]
    for row, data, found in zip(rows, several, enclose(rows), strict=True):
        costs = row.cost(row.positions(PLANS), data.normals)
        np.testing.assert_allclose(costs[::37], [data.plan_cost(plan, along=True) for plan in PLANS[::37]], rtol=1e-12)
        assert found.lower <= costs.min() + 1e-12
        assert found.other_first <= costs[PLANS[:, 0] == 1.0].min() + 1e-12
        assert 0.0 <= found.upper - found.lower + 1e-12 <= 1e-6 * row.scale
        assert found.lower <= data.relaxed()[1] + 1e-12  # any feasible plan's cost is above
        assert found.upper <= data.relaxed()[1] + 1e-6 * row.scale


@settings(max_examples=25, deadline=None)
@given(problems(), st.integers(0, 10**6))
def test_the_bound_holds_whatever_the_solver_returns(data: Data, seed: int) -> None:
    rng = np.random.default_rng(seed)
    row = row_of(data, np.zeros(N))
    rubbish = [rng.uniform(0.0, 1.0, N)], [rng.exponential(1.0, (N, len(data.distances)))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(optimality, "_solve", lambda rows: rubbish)
        (found,) = enclose([row])
    costs = row.cost(row.positions(PLANS), data.normals)
    assert found.lower <= costs.min() + 1e-12
    assert found.other_first <= costs[PLANS[:, 0] == 1.0].min() + 1e-12
    assert found.upper >= data.relaxed()[1] - 1e-9


def test_a_bad_solution_decides_nothing(relaxed: Trace, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(rows: list[Row]) -> tuple[list[Array], list[Array]]:
        return [np.full(N, 0.5) for _ in rows], [np.zeros((N, 2)) for _ in rows]

    monkeypatch.setattr(optimality, "_solve", nothing)
    assert OPT.judge(relaxed).status != "holds"


def test_blocks_are_enumerated_exactly() -> None:
    trace = recorded("enumeration")
    for row in rows_of(trace):
        data = problem_at(trace, row.given["t_s"])
        best = min(data.plan_cost(plan) for plan in PLANS)
        assert optimality._cheapest(row, None).lower == pytest.approx(best, rel=1e-12)

    def second_best(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["lower_bound"] *= 1.01
        row["gap"] = 0.0

    assert OPT.judge(edited(trace, second_best)).status == "refuted"


@given(
    st.tuples(st.floats(0.1, 10.0), st.floats(0.1, 10.0)),
    st.tuples(st.floats(0.1, 10.0), st.floats(0.1, 10.0)),
    st.sampled_from([0.0, 0.4, 0.6]),
    st.sampled_from([SILENT, ACCEPT, REFUSE]),
    st.sampled_from([0.0, 0.1, 0.2, 0.3]),
    st.sampled_from([0.0, 0.05, 0.2]),
    st.booleans(),
    st.booleans(),
)
def test_the_rules_are_those_of_the_running_gatekeeper(
    costs: tuple[float, float],
    throughout: tuple[float, float],
    bend: float,
    standing: float,
    stood: float,
    margin: float,
    equal: bool,
    planned: bool,
) -> None:
    accept, refuse = (costs[0], costs[0]) if equal else costs
    status: Any = "optimal" if planned else "refused_not_finite"
    solution = Solution(accept <= refuse, status, objective=min(costs))
    kept = throughout
    plan = np.array([float(accept <= refuse)]) if planned else None
    given = {"objective": min(costs), "accept_throughout": kept[0], "refuse_throughout": kept[1], "bend": bend}
    row = Row(given, 1.0, 1.0, 1.0, {"plan": plan})
    gate = {"max_bend": 0.5, "switching_margin": margin, "min_dwell_s": 0.2}
    stands = {SILENT: None, ACCEPT: "accept", REFUSE: "refuse"}[standing]
    rules = Rules(switching_margin=margin, min_dwell=0.2, max_bend=0.5)
    assert gatekeeping._rule(row, stands, stood, gate) == settle(solution, kept, bend, standing, stood, rules)


def record_of(name: str, run: str, route: str = "relaxed") -> Trace:
    described = load(name)[0]
    described.gatekeeper.route = route
    return simulate(described, run)


@pytest.mark.parametrize(("name", "run"), [("case_b", "c"), ("case_a", "d"), ("soft_gate", "c"), ("soft_gate", "d")])
def test_real_runs_pass(name: str, run: str) -> None:
    trace = record_of(name, run)
    assert len(trace.decisions) > 5
    for claim in (FEAS, SUR, OPT):
        finding = claim.judge(trace)
        assert finding.status == "holds", finding


@pytest.mark.parametrize("route", ["enumeration", "branch_and_bound", "nonlinear", "rollout"])
def test_real_runs_of_other_routes(route: str) -> None:
    trace = record_of("case_b", "d", route)
    assert FEAS.judge(trace).status == "holds"
    bounded = route in ("enumeration", "branch_and_bound")
    assert OPT.judge(trace).status == ("holds" if bounded else "inconclusive")
    assert not SUR.applies(trace) or SUR.judge(trace).status == "holds"


def test_a_real_run_saved_and_broken(tmp_path: Any) -> None:
    trace = record_of("case_b", "d")
    save(trace, tmp_path)
    for claim in (FEAS, SUR, OPT):
        assert claim.judge(load_trace(tmp_path)) == claim.judge(trace)
    for claim, edit in (
        (FEAS, flip_plan), (FEAS, shift_position), (FEAS, shift_initial), (FEAS, shift_reference), (FEAS, too_fast),
        (FEAS, understate_cost), (FEAS, smaller_distance), (FEAS, overstate_clearance), (FEAS, contrary_answer),
        (SUR, round_otherwise), (SUR, understate_rounding), (OPT, overstate_bound), (OPT, understate_bound),
        (OPT, understate_gap), (OPT, long_normals), (OPT, inflate_loser),
    ):  # fmt: skip
        assert claim.judge(edited(trace, edit)).status == "refuted", edit


def test_a_run_that_hides_an_intervention_is_refuted() -> None:
    """What was executed is not the UGV's own task, whatever the `accepted` column says."""
    trace = record_of("case_b", "d")
    assert FEAS.judge(trace).status == "holds"
    hidden = replace(trace, signals=trace.signals.assign(**{"ugv1.accepted": 0.0}))
    finding = FEAS.judge(hidden)
    assert finding.status == "refuted"
    assert "own task" in str(finding.counterexample)
