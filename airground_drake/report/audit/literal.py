"""The paper's gatekeeper, (27)-(29) taken literally, and the effect of choices that the paper leaves open."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.report.audit.item import Item, item
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.components import make_horizon, make_presets, make_route, make_rules
from airground_drake.sim.simulation import Recorder
from airground_drake.sim.trace import Trace
from airground_drake.ugv.answer import GatekeeperDecision
from airground_drake.ugv.budget import COUNTED
from airground_drake.ugv.cost import plan_cost
from airground_drake.ugv.mpc_gatekeeper import PaperGatekeepers
from airground_drake.ugv.problem import Problem, predicted_loop, sensed
from airground_drake.ugv.relaxation import sum_up_rounding
from airground_drake.ugv.rollout import ACCEPTED, REFUSED, ClosedLoop, advance, workspace
from airground_drake.ugv.routes.nonlinear import NonlinearRoute
from airground_drake.ugv.solution import ConstantPlans

AS_RUN, OTHER_START, AT_THE_PLAN = "as run", "other start", "velocities at the plan"  # variants of (27): see `variants`
ITERATIONS = 200  # of the search with velocities at the plan: enough for it to end by itself
# How long the runs of finding 25 last: past the acceptance that is taken back.
DURATIONS_S = {"case_a": 18.0, "case_b": 16.0}


class Prediction(NamedTuple):
    """The basis of a decision: its problem (26), and the closed loop that gave its velocities."""

    decision: GatekeeperDecision
    problem: Problem
    loop: ClosedLoop


class Remembering(PaperGatekeepers):
    """Gatekeepers of method (c) that store their predictions."""

    def __init__(self, *parts: Any) -> None:
        super().__init__(*parts)
        self.predictions: list[Prediction] = []

    def _decide(self, now: Any, before: Any, i: int, *given: Any) -> GatekeeperDecision:
        decision = super()._decide(now, before, i, *given)
        if decision.problem is not None:
            loop = predicted_loop(sensed(self._view(now, i), now.law), now.law, decision.proposal, self._horizon)
            self.predictions.append(Prediction(decision, decision.problem, loop))
        return decision


def simulate(scenario: Scenario, run: str) -> tuple[Trace, list[Prediction]]:
    """A run of method (c), and the predictions of its decisions."""
    made: list[Remembering] = []

    def make(scenario: Scenario, law: UgvLaw) -> Remembering:
        parts = make_route(scenario), make_horizon(scenario), make_rules(scenario)
        made.append(Remembering(make_world(scenario), law, make_presets(scenario), *parts))
        return made[-1]

    return Recorder(scenario, run, make_gatekeepers=make).simulate(), made[-1].predictions


def literal_rule() -> Item:
    """Item 25: if the first stage of each rounded plan is executed, no acceptance lasts."""
    literal, ours, settings = {}, {}, {}
    table: dict[str, dict[str, dict[str, Any]]] = {}
    for name, duration_s in DURATIONS_S.items():
        scenario = load(name, {"reproduction": [], "duration_s": duration_s})
        trace, predictions = simulate(scenario, "c_literal")
        literal[name], ours[name] = taken_back(trace), taken_back(simulate(scenario, "c")[0])
        settings[name] = scenario.runs["c_literal"].set
        for change in _changes(predictions):
            table[f"{name}, {change.decision.t:.2f} s"] = variants(change.problem, change.loop)
    back = {name: taken[0] for name, taken in literal.items() if taken}
    costs = "; ".join(
        f"{name}: share {first['first_share']:.3f}, cost of accepting throughout {first['accept_throughout']:.2f}, of "
        f"refusing {first['refuse_throughout']:.2f}" for name, first in back.items()
    )  # fmt: skip
    differ = {
        variant: sum(answers[variant]["answer"] != answers[AS_RUN]["answer"] for answers in table.values())
        for variant in (OTHER_START, AT_THE_PLAN)
    }
    return item(
        25, "(27)-(29), Figures 6 and 10",
        "By the letter of (27)-(29), with two choices that the paper leaves open, the gatekeeper solves (27) by "
        "multiple shooting, rounds it, and executes the first stage of the rounded plan at every sample. It takes an "
        "acceptance back, because the first share of the relaxation falls below one half, and accepts again at the "
        f"next sample ({costs}). What ends the intervention is our UAV, which withdraws a refused proposal and rests "
        "for intervention.retry_s. The paper describes one lasting acceptance in Figures 6 and 10. Under (c) an answer "
        "changes only by a margin and after a dwell. The two choices: the search for a local optimum starts at the "
        "cheaper constant plan, and the velocities of (23) are those along the two constant plans. If the search "
        f"starts at the dearer one, {differ[OTHER_START]} of {len(table)} answers change; with velocities where the "
        f"plan leads, {differ[AT_THE_PLAN]}. The finding holds for our weights and speeds; the paper gives none.",
        {"acceptances_taken_back": [len(taken) for taken in literal.values()]},
        {"acceptances_taken_back": [len(taken) for taken in ours.values()]},
        len(back) == len(literal) and not any(ours.values()) and all(first["lasts_s"] < 0.1 for first in back.values()),
        {
            "answers_by_open_choice": {
                f"{decision}, {variant}": answer
                for decision, answers in table.items() for variant, answer in answers.items()
            }, "taken_back": back,
            "runs": "c_literal and c of case_a (18 s) and case_b (16 s)", "figures": "by reading", "literal": settings,
        },
    )  # fmt: skip


def taken_back(trace: Trace) -> list[dict[str, Any]]:
    """Acceptances followed by a refusal of the same proposal, with the costs (25) and the outcome."""
    decisions = trace.decisions.sort_values("t_s", kind="stable")
    messages = trace.messages[trace.messages["kind"] == "withdrawal"]
    taken = []
    for number, about in decisions.groupby("number"):
        rows = about.to_dict("records")
        for before, after in pairwise(rows):
            if (before["decision"], after["decision"]) != ("accept", "refuse"):
                continue
            again = [row["t_s"] for row in rows if row["t_s"] > after["t_s"] and row["decision"] == "accept"]
            taken.append({
                "t_s": after["t_s"], "first_share": after["relaxed_first_stage"],
                "accept_throughout": after["accept_throughout"], "refuse_throughout": after["refuse_throughout"],
                "lasts_s": min(again, default=np.inf) - after["t_s"],
                "withdrawn_s": messages.loc[messages["about"] == number, "sent_s"].min(),
            })  # fmt: skip
    return taken


def _changes(predictions: Sequence[Prediction]) -> list[Prediction]:
    """The first decision on each proposal, and changes of the answer, up to the first reversed acceptance."""
    changes = [*predictions[:1]]
    for before, prediction in pairwise(predictions):
        same = before.decision.proposal is prediction.decision.proposal
        if not same or before.decision.accepted != prediction.decision.accepted:
            changes.append(prediction)
        if same and before.decision.accepted and not prediction.decision.accepted:
            break
    return changes


def variants(problem: Problem, loop: ClosedLoop) -> dict[str, dict[str, Any]]:
    """Local optima of (27) for each open choice: first share, answer by (28)-(29), and cost (25)."""
    # - `as run`: the velocities of (23) are those along the two constant plans; the search starts at the cheaper one.
    # - `other start`: the search starts at the dearer one.
    # - `velocities at the plan`: those of the closed loop where the plan leads; the search starts as in the run.
    plans, route = ConstantPlans.of(problem), NonlinearRoute()
    dearer = plans.refuse if plans.better is plans.accept else plans.accept
    entries: dict[str, dict[str, Any]] = {}
    for name, start in ((AS_RUN, plans.better), (OTHER_START, dearer)):
        omega, _ = route.relax(problem, start, COUNTED)
        entries[name] = {"answer": "the solver failed"}
        if omega is not None:
            entries[name] = _told(omega, problem.evaluate(omega).objective)
    omega = at_the_plan(problem, loop, plans.better.omega)
    return entries | {AT_THE_PLAN: _told(omega, cost_at_the_plan(problem, loop, omega))}


def _told(omega: Array, cost: float) -> dict[str, Any]:
    answer = "accept" if sum_up_rounding(omega)[0] == 1.0 else "refuse"
    return {"first_share": round(float(omega[0]), 6), "answer": answer, "cost": round(cost, 6)}


def at_the_plan(problem: Problem, loop: ClosedLoop, start: Array) -> Array:
    """A local optimum (N,) of (27) with the velocities of (23) along the plan."""
    minimum = minimize(
        lambda omega: cost_at_the_plan(problem, loop, omega), start, method="SLSQP",
        bounds=[(0.0, 1.0)] * len(start), options={"maxiter": ITERATIONS},
    )  # fmt: skip
    return np.asarray(minimum.x).clip(0.0, 1.0)


def cost_at_the_plan(problem: Problem, loop: ClosedLoop, omega: Array) -> float:
    """(25) of a plan omega (N,) in [0, 1] with the velocities of (23) along the plan."""
    return plan_cost(problem.terms, positions_at_the_plan(loop, omega))[0]


@njit(cache=True)
def positions_at_the_plan(loop: ClosedLoop, omega: Array) -> Array:
    """Positions (N, 3), m, at the ends of the stages if a UGV mixes both velocities of (23) by omega (N,)."""
    # For constant plans they are those of `rollout.follow`. It is no unicycle.
    positions, position, work = np.empty((len(omega), 3)), loop.start.copy(), workspace(loop)
    for stage in range(len(omega)):
        for k in range(stage * loop.substeps, (stage + 1) * loop.substeps):
            accept = advance(loop, ACCEPTED, k, position.copy(), work)
            refuse = advance(loop, REFUSED, k, position.copy(), work)
            for a in range(3):
                position[a] += loop.law.layer.period * (omega[stage] * accept[a] + (1.0 - omega[stage]) * refuse[a])
        positions[stage] = position
    return positions
