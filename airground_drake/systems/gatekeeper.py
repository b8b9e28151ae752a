"""The UGVs' side of an intervention: accept or refuse (methods (c), (d)), or always accept (method (b))."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, Self

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from airground_drake.arrays import Array
from airground_drake.gatekeeper.budget import Budget, Clock
from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, predicted_problem
from airground_drake.gatekeeper.problem import DECIDED, Problem, Solution
from airground_drake.gatekeeper.solution import ConstantPlans
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT, Point, Reports, answer_to
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team

USELESS = 1e-6
"""Relative gain below which an intervention makes no difference: ten times the solver's tolerance."""


class Route(Protocol):
    """A way to solve (26): any object with this method."""

    def solve(self, problem: Problem, budget: Budget, /) -> Solution:
        """Accept or refuse, within the budget; never raises."""


@dataclass(frozen=True)
class Rules:
    """When a decision becomes an answer, and what it may cost.

    Attributes:
        switching_margin: relative gain that a reversal needs over keeping the answer throughout.
        min_dwell: least time between opposite answers to a proposal, s.
        max_bend: largest share of its motion by which a proposal may be bent by the avoidance inequalities.
        budget: of one decision, in counts.
        budget_share: of the sampling period that all decisions of a sample may take by the clock; None: no limit.
        clock: what that is measured with.
    """

    switching_margin: float = 0.0
    min_dwell: float = 0.0
    max_bend: float = np.inf
    budget: Budget = field(default_factory=Budget)
    budget_share: float | None = None
    clock: Clock = time.monotonic


Reason = Literal["cheaper", "not_cheaper", "no_difference", "bent", "kept", "dwell", "reversed", "no_plan"]
"""Why an answer is what it is: see `settle`."""


@dataclass(frozen=True)
class Decision:
    """One decision on one proposal.

    Attributes:
        t: when, s.
        robot: for which UGV.
        proposal: on what.
        problem: (26) as predicted.
        solution: the route's.
        throughout: costs (25) of accepting and of refusing throughout; -1 without a plan.
        accepted: the answer.
        reason: why.
    """

    t: float
    robot: int
    proposal: Proposal
    problem: Problem
    solution: Solution
    throughout: tuple[float, float]
    accepted: bool
    reason: Reason


@dataclass(frozen=True)
class GatekeeperMemory:
    """Abstract state.

    Attributes:
        answers: in force, (2n,), see `messages`.
        since: when each UGV's answer became what it is, (n,), s.
        reports: what was sensed with them.
        decisions: every one so far.
    """

    answers: tuple[float, ...]
    since: tuple[float, ...]
    reports: Reports
    decisions: tuple[Decision, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


class Gatekeeper(LeafSystem):
    """Decides at every sample about the proposal in force for each UGV: (21)-(29).

    Each UGV predicts its own closed loop under both choices from what it senses, solves (26) through `route`
    and takes the first stage of the plan. The answer goes to its controller and back to the UAV.

    Ports (n UGVs):
        in  `team_position` (3(n+1)) m; `ugv_command` (3n) and `uav_command` (3) m/s, for the predicted motion
            of the other robots; `proposals` abstract, n of Proposal or None.
        out `answers` (2n) and `reports` (abstract), see `messages`; held.
    Rate: one update per gatekeeper period, from t = 0.

    Attributes:
        decision_times_s: CPU time of every decision since construction or `reset_timing` (what it costs, not
            what else the machine did meanwhile). Kept outside the Context because it differs between
            identical runs.
    """

    def __init__(
        self,
        team: Team,
        law: UgvLaw,
        presets: Sequence[Motion],
        route: Route,
        horizon: Horizon,
        *,
        period: float,
        rules: Rules,
    ) -> None:
        """Declare ports, state and the periodic update; period in s."""
        super().__init__()
        n = len(team.ugvs)
        self._law = law
        self._presets = tuple(presets)
        self._route = route
        self._horizon = horizon
        self._rules = rules
        self._allowance = None if rules.budget_share is None else rules.budget_share * period
        self._neighbourhood = team.neighbourhood(slice(0, n))
        self._max_speed = team.max_speed
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._ugv_command = self.DeclareVectorInputPort("ugv_command", 3 * n)
        self._uav_command = self.DeclareVectorInputPort("uav_command", 3)
        self._proposals = self.DeclareAbstractInputPort("proposals", Value(object()))
        self._memory = self.DeclareAbstractState(Value(GatekeeperMemory((SILENT, -1.0) * n, (0.0,) * n, ((),) * n)))
        self.DeclareVectorOutputPort(
            "answers", 2 * n, self._calc_answers, prerequisites_of_calc={self.abstract_state_ticket(self._memory)}
        )
        self.DeclareAbstractOutputPort(
            "reports",
            lambda: Value(object()),
            self._calc_reports,
            prerequisites_of_calc={self.abstract_state_ticket(self._memory)},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.decision_times_s: list[float] = []

    def decisions(self, context: Context) -> tuple[Decision, ...]:
        """Every decision up to the context's time."""
        memory: GatekeeperMemory = context.get_abstract_state(int(self._memory)).get_value()
        return memory.decisions

    def reset_timing(self) -> None:
        """Forget the measured decision times."""
        self.decision_times_s = []

    def _calc_answers(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_abstract_state(int(self._memory)).get_value().answers)

    def _calc_reports(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(int(self._memory)).get_value().reports)

    def _update(self, context: Context, state: State) -> EventStatus:
        proposals = self._proposals.Eval(context)
        memory: GatekeeperMemory = context.get_abstract_state(int(self._memory)).get_value()
        if not any(proposals) and not any(memory.answers[::2]):
            return EventStatus.DidNothing()
        positions = self._position.Eval(context).reshape(-1, 3)
        velocities = np.concatenate([self._ugv_command.Eval(context), self._uav_command.Eval(context)]).reshape(-1, 3)
        t = context.get_time()
        answers: list[float] = []
        since: list[float] = []
        reports: list[tuple[Point, ...]] = []
        decisions = list(memory.decisions)
        deadlines = self._deadlines(sum(proposal is not None for proposal in proposals))
        for i, proposal in enumerate(proposals):
            if proposal is None:
                answers += [SILENT, -1.0]
                since.append(t)
                reports.append(())
                continue
            started = time.thread_time()
            problem = self._problem(t, i, proposal, positions, velocities)
            solution = self._route.solve(problem, next(deadlines))
            self.decision_times_s.append(time.thread_time() - started)
            standing = answer_to(proposal, memory.answers, i)
            throughout = _throughout(problem, solution)
            accepted, reason = settle(solution, throughout, problem.bend, standing, t - memory.since[i], self._rules)
            decisions.append(Decision(t, i, proposal, problem, solution, throughout, accepted, reason))
            answer = ACCEPT if accepted else REFUSE
            answers += [answer, proposal.issued]
            since.append(memory.since[i] if answer == standing else t)
            reports.append(self._sensed(positions[i]))
        new = GatekeeperMemory(tuple(answers), tuple(since), tuple(reports), tuple(decisions))
        state.get_mutable_abstract_state(int(self._memory)).set_value(new)
        return EventStatus.Succeeded()

    def _deadlines(self, count: int) -> Iterator[Budget]:
        """The budget of each of `count` decisions of this sample, which begins now."""
        if self._allowance is None:
            yield from [self._rules.budget] * count
            return
        begin, clock = self._rules.clock(), self._rules.clock
        for i in range(count):
            deadline = begin + self._allowance * (i + 1) / count
            yield replace(self._rules.budget, deadline_s=deadline, clock=clock)

    def _sensed(self, position: Array) -> tuple[Point, ...]:
        """Obstacles within sensing range."""
        obstacles = self._neighbourhood.obstacles
        near = np.linalg.norm(obstacles - position, axis=1) <= self._law.avoidance.sensing_range
        return tuple((x, y, z) for x, y, z in obstacles[near].tolist())

    def _problem(self, t: float, i: int, proposal: Proposal, positions: Array, velocities: Array) -> Problem:
        around = self._neighbourhood
        scene = Scene(
            t=t,
            position=positions[i].copy(),
            preset=self._presets[i],
            centres=around.around(positions).centre[i],
            velocities=np.concatenate([np.zeros_like(around.obstacles), velocities[around.others[i]]]),
            distances=around.distance[i],
            shares=around.share[i],
            max_speed=float(self._max_speed[i]),
        )
        return predicted_problem(scene, self._law, proposal, self._horizon)


def _throughout(problem: Problem, solution: Solution) -> tuple[float, float]:
    """Costs (25) of the two constant plans; mode velocities are exact for them."""
    if solution.status not in DECIDED:
        return -1.0, -1.0
    constants = ConstantPlans.of(problem)
    return constants.accept.objective, constants.refuse.objective


def settle(
    solution: Solution, throughout: tuple[float, float], bend: float, standing: float, stood: float, rules: Rules
) -> tuple[bool, Reason]:
    """Whether the proposal is accepted, and why.

    Without a plan it is refused, whatever stands. A new proposal is accepted if the best plan starts by accepting
    it, unless it makes no difference (one that the avoidance inequalities block entirely) or they would bend it
    too much. A standing answer is reversed only if the best plan starts with the other choice and is cheaper, by
    the switching margin, than to keep the answer throughout; or if an accepted proposal has come to be bent too
    much; and not before the dwell is over. (The best plan that keeps the answer for one more stage and then
    changes it costs nearly the same as the one that changes it now: that comparison would decide nothing.)

    Args:
        solution: the route's.
        throughout: costs (25) of accepting and of refusing throughout the horizon.
        bend: see `Problem.bend`.
        standing: ACCEPT, REFUSE or SILENT.
        stood: for how long that has been the answer, s.
        rules: margins and limits.
    """
    if solution.status not in DECIDED:
        return False, "no_plan"
    accept, refuse = throughout
    bent = bend > rules.max_bend
    if standing == SILENT:
        if not solution.accept_first:
            return False, "not_cheaper"
        if not solution.objective < (1.0 - USELESS) * refuse:
            return False, "no_difference"
        return (False, "bent") if bent else (True, "cheaper")
    kept = accept if standing == ACCEPT else refuse
    better = (
        solution.accept_first != (standing == ACCEPT) and solution.objective < (1.0 - rules.switching_margin) * kept
    )
    if not ((better or bent) if standing == ACCEPT else (better and not bent)):
        return standing == ACCEPT, "kept"
    if stood < rules.min_dwell - 1e-9:
        return standing == ACCEPT, "dwell"
    return standing != ACCEPT, "reversed"


class DirectAcceptance(LeafSystem):
    """Method (b): every proposal is accepted at once.

    Ports (n UGVs): in `proposals` abstract; out `answers` (2n) and `reports` (abstract, always empty), see
    `messages`.
    """

    def __init__(self, count: int) -> None:
        """Declare ports for `count` UGVs."""
        super().__init__()
        self._proposals = self.DeclareAbstractInputPort("proposals", Value(object()))
        self.DeclareVectorOutputPort(
            "answers", 2 * count, self._calc_answers, prerequisites_of_calc={self._proposals.ticket()}
        )
        self.DeclareAbstractOutputPort(
            "reports",
            lambda: Value(object()),
            lambda context, output: output.set_value(((),) * count),
            prerequisites_of_calc={self.nothing_ticket()},
        )

    def _calc_answers(self, context: Context, output: BasicVector) -> None:
        answers = [(SILENT, -1.0) if p is None else (ACCEPT, p.issued) for p in self._proposals.Eval(context)]
        output.SetFromVector(np.array(answers).ravel())
