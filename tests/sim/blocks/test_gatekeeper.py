"""The gatekeeper in a diagram: dwell, refusals, budget by counts and by an injected clock."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders.problems import random_problem
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from sim.blocks.contexts import begun
from ugv.oracles import Enumeration

from airground_drake.base.errors import PluginError, SimulationError
from airground_drake.base.registry import METHODS, ROUTES
from airground_drake.report import metrics
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.blocks import DirectAcceptance, InterventionPlanner
from airground_drake.sim.diagram import build_model
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.study.testing.plugin import Simulations
from airground_drake.uav.messages import Report
from airground_drake.ugv import mpc_gatekeeper
from airground_drake.ugv.answer import Rules
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.routes.mixed_integer import MixedIntegerRoute
from airground_drake.ugv.solution import ConstantPlans, Solution, after_failure
from airground_drake.verify.judging import judge


@dataclass
class Alternating:
    calls: int = 0

    def solve(self, problem: Problem, budget: Budget) -> Solution:
        self.calls += 1
        throughout = ConstantPlans.of(problem)
        least = 0.1 * min(throughout.accept.objective, throughout.refuse.objective)
        return Solution(bool(self.calls % 2), "optimal", objective=least)


def under_c(case_a: Scenario, route: type, until_s: float) -> Trace:
    """A run whose gatekeepers decide by this route."""
    case_a.gatekeeper.route, case_a.duration_s = "of_the_test", until_s
    with ROUTES.adding("of_the_test", route):
        return simulate(case_a, "c")


@pytest.mark.parametrize("dwell", [0.0, 1.0])
def test_opposite_answers_of_a_run_are_a_dwell_apart(case_a: Scenario, dwell: float) -> None:
    case_a.gatekeeper.min_dwell_s = dwell
    decisions = under_c(case_a, Alternating, 20.0).decisions
    for _, of_one in decisions.groupby(["robot", "issued_s"]):
        changes = of_one["t_s"][of_one["decision"] != of_one["decision"].shift()].to_numpy()
        assert (changes[1:] - changes[:-1] >= dwell - 1e-9).all()
    assert ("dwell" in set(decisions["reason"])) == (dwell > 0.05)


class Writing:
    """A route that makes accepting look free: it writes into the problem."""

    def solve(self, problem: Problem, budget: Budget) -> Solution:
        self.write(problem)
        return MixedIntegerRoute().solve(problem, budget)

    def write(self, problem: Problem) -> None:
        problem.accept[:] = 0.0


class Unlocking(Writing):
    """Makes the arrays writable before."""

    def write(self, problem: Problem) -> None:
        problem.accept.setflags(write=True)
        super().write(problem)


class Exchanging(Writing):
    """Puts other arrays in their place, in a frozen record."""

    def write(self, problem: Problem) -> None:
        object.__setattr__(problem, "accept", np.zeros_like(problem.accept))


class Exiting(Writing):
    def write(self, problem: Problem) -> None:
        raise SystemExit(3)


@pytest.mark.parametrize("route", [Writing, Unlocking, Exiting])
def test_a_route_that_writes_into_its_problem_is_named(case_a: Scenario, route: type) -> None:
    with pytest.raises(SimulationError, match=rf"route {route.__name__} raised"):
        under_c(case_a, route, 16.0)


def test_a_route_cannot_change_the_problem_that_is_recorded(case_a: Scenario, run: Simulations) -> None:
    honest, trace = run("case_a", "c").problems, under_c(case_a, Exchanging, 16.0)
    assert any(honest["accept_m_s"][0])
    assert [*trace.problems["accept_m_s"][0]] == [*honest["accept_m_s"][0]]
    (verdict,) = judge(trace, ["GATE-PLAN"])
    assert verdict.status == "refuted"
    assert "positions are not those of (23)" in str(verdict.counterexample)


@dataclass
class FailingLater:
    """A route whose solver fails at every second call, and that returns no plan then."""

    calls: int = 0

    def __post_init__(self) -> None:
        self._route = MixedIntegerRoute(10)

    def solve(self, problem: Problem, budget: Budget) -> Solution:
        self.calls += 1
        found = self._route.solve(problem, budget)
        return found if self.calls % 2 else Solution(False, "solver_failed")


def test_a_failing_solver_withdraws_no_acceptance_and_is_recorded(case_a: Scenario, run: Simulations) -> None:
    well = run("case_a", "c").decisions
    trace = under_c(case_a, FailingLater, 17.0)
    verdicts = judge(trace, ["GATE-PLAN"])
    decisions = trace.decisions
    failed = decisions[decisions["status"] == "solver_failed"]
    assert len(failed) == len(decisions) // 2 > 10
    assert set(decisions["decision"]) == set(well["decision"]) == {"accept"}
    assert metrics.of_run(trace)["gatekeeper"]["solver_failures"] == len(failed)
    constant = failed[["accept_throughout", "refuse_throughout"]].min(axis=1)
    assert (failed["objective"] <= constant * (1.0 + 1e-9)).all()
    assert [(v.claim.id, v.status) for v in verdicts] == [("GATE-PLAN", "holds")]


def test_after_a_failure_the_rest_of_the_plan_before_counts(case_a: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is left of it after a sampling period, which is one stage; its last choice stands for the stage more."""
    solutions: list[Solution] = []
    before: list[np.ndarray | None] = []

    class Listening(FailingLater):
        def solve(self, problem: Problem, budget: Budget) -> Solution:
            solutions.append(super().solve(problem, budget))
            if solutions[-1].has_plan:
                plan = problem.evaluate(np.arange(1, problem.stages + 1) % 7 % 2.0)
                solutions[-1] = replace(solutions[-1], accept_first=True, plan=plan.omega, positions=plan.positions)
            return solutions[-1]

    def listening(problem: Problem, solution: Solution) -> Solution:
        before.append(problem.previous)
        return after_failure(problem, solution)

    monkeypatch.setattr(mpc_gatekeeper, "after_failure", listening)
    under_c(case_a, Listening, 17.0)
    plans = [solution.plan for solution in solutions if solution.plan is not None]
    assert len(before) > 10
    for plan, rest in zip(plans, before, strict=False):
        assert rest is not None
        np.testing.assert_array_equal(rest, np.append(plan[1:], plan[-1]))


def test_the_best_of_what_is_known_after_a_failure() -> None:
    problem, failed = random_problem(0), Solution(False, "solver_failed")
    constants = ConstantPlans.of(problem)
    best = Enumeration().solve(problem)
    assert best.plan is not None
    assert best.objective < constants.better.objective
    assert after_failure(replace(problem, previous=best.plan), failed).objective == best.objective
    for own, previous in ((failed, None), (failed, constants.better.omega)):
        assert after_failure(replace(problem, previous=previous), own).objective == constants.better.objective
    own = replace(best, status="solver_failed")
    assert after_failure(replace(problem, previous=np.ones(problem.stages)), own).objective == best.objective
    broken = replace(problem, initial=np.full(3, np.nan))
    assert after_failure(replace(broken, previous=best.plan), failed).status == "refused_not_finite"


@pytest.mark.parametrize("run", ["c", "d"])
def test_gains_changed_in_a_context_count_in_the_prediction(run: str) -> None:
    """What is decided is what a scenario with these gains decides from the beginning."""
    gains = {"avoidance_gain_1_s": 2.0, "motion_gain_1_s": 1.0, "intervention_gain_1_s": 3.0}
    decided = []
    for changed in (True, False):
        scenario = load("case_b", () if changed else [f"control.{name}={value}" for name, value in gains.items()])
        model = build_model(scenario, scenario.runs[run].method, disturbed=False)
        simulator = Simulator(model.diagram, context := begun(model.diagram, 1))
        for controller in model.controllers if changed else ():
            view = controller.mutable_gains(controller.GetMyMutableContextFromRoot(context))
            for name in set(gains) & set(view.get_fields()):
                setattr(view, name, gains[name])
        simulator.AdvanceTo(16.0)
        assert model.gatekeeper is not None
        decided.append(model.gatekeeper.decisions(model.gatekeeper.GetMyContextFromRoot(context)))
    assert len(decided[0]) > 10
    for one, other in zip(*decided, strict=True):
        assert (one.t, one.reason, one.throughout) == (other.t, other.reason, other.throughout)
        for mine, theirs in ((one.accept, other.accept), (one.refuse, other.refuse)):
            assert mine is None or mine.positions.tolist() == theirs.positions.tolist()


@pytest.mark.parametrize(("port", "sent"), [("proposals", (Report(),)), ("reports", (None,)), ("reports", "x")])
def test_messages_of_another_kind_are_refused_before_the_run(port: str, sent: object) -> None:
    """pydrake connects these ports: to Drake, all Python objects have one type."""
    builder = DiagramBuilder()
    scenario = load("minimal")
    planner = InterventionPlanner(components.make_planner(scenario, METHODS["d"], "uav"), make_world(scenario), 0.05)
    system = builder.AddNamedSystem("mine", planner if port == "reports" else DirectAcceptance(1))
    source = builder.AddSystem(Announcing(sent))
    builder.Connect(source.get_output_port(), system.GetInputPort(port))
    with pytest.raises(PluginError, match=rf"port {port} of ::.*mine is given .*; allowed: 1 messages, each (Pro|Rep)"):
        Simulator(builder.Build()).Initialize()


class Announcing(LeafSystem):
    def __init__(self, sent: object) -> None:
        super().__init__()
        model = Value(object())
        self.DeclareAbstractOutputPort("sent", lambda: model, lambda _, output: output.set_value(sent))


@dataclass
class Clock:
    """Advances by `tick` s at each reading."""

    tick: float
    now: float = 0.0

    def __call__(self) -> float:
        self.now += self.tick
        return self.now


def timed(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    make = components.make_rules

    def made(scenario: Scenario) -> Rules:
        rules = make(scenario)
        return replace(rules, budget=replace(rules.budget, clock=clock))

    monkeypatch.setattr(components, "make_rules", made)


@pytest.mark.parametrize("kind", ["counted", "wall_clock"])
def test_a_decision_has_counts_in_simulation_and_half_the_sampling_period_in_real_time(
    case_a: Scenario, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    budgets, clock = list[Budget](), Clock(tick=0.001)

    class Watching:
        def solve(self, problem: Problem, budget: Budget) -> Solution:
            budgets.append(budget)
            return Solution(False, "refused_not_finite")

    gate = case_a.gatekeeper
    gate.budget_iterations, gate.budget = 7, kind
    if kind == "wall_clock":
        timed(monkeypatch, clock)
    under_c(case_a, Watching, 16.0)
    begins = [0.001 * (k + 1) for k in range(len(budgets))]  # read once a sample: one proposal each
    deadlines = [math.inf if kind == "counted" else begin + 0.025 for begin in begins]
    assert begins
    assert {b.iterations for b in budgets} == {7}
    assert [b.deadline_s for b in budgets] == pytest.approx(deadlines)
    assert not budgets[0].spent()
    clock.now = 10.0
    assert {b.spent() for b in budgets} == {kind == "wall_clock"}


@pytest.mark.parametrize("route", ROUTES.own)
def test_with_no_time_left_the_better_constant_plan_decides(
    case_a: Scenario, monkeypatch: pytest.MonkeyPatch, route: str
) -> None:
    """A clock that jumps a whole sampling period at each reading: no solver is ever called."""
    case_a.gatekeeper.budget, case_a.gatekeeper.route, case_a.duration_s = "wall_clock", route, 17.0
    timed(monkeypatch, Clock(tick=0.05))
    decisions = simulate(case_a, "c").decisions
    assert set(decisions["status"]) == {"budget_spent"}
    best = decisions[["accept_throughout", "refuse_throughout"]].min(axis=1)
    assert decisions["objective"].to_numpy() == pytest.approx(best.to_numpy(), rel=1e-9)
    assert set(decisions["decision"]) == {"accept"}
