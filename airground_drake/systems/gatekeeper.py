"""The UGVs' side of an intervention: accept or refuse (methods (c), (d)), or always accept (method (b))."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, predicted_problem
from airground_drake.gatekeeper.problem import Decision, Problem
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.task import Array
from airground_drake.nsbc.team import Team
from airground_drake.systems.messages import ACCEPT, REFUSE, SILENT, Point, Reports, answer_to

USELESS = 1e-6
"""Relative gain below which an intervention makes no difference: ten times the solver's tolerance."""


class Route(Protocol):
    """A way to solve (26): any object with this method."""

    def decide(self, problem: Problem) -> Decision:
        """Accept or refuse; never raises."""


@dataclass(frozen=True)
class Ruling:
    """One decision on one proposal: when (s), for which UGV, on what, the route's decision, and what came of it."""

    t: float
    robot: int
    proposal: Proposal
    decision: Decision
    accepted: bool


@dataclass(frozen=True)
class GatekeeperMemory:
    """Abstract state: the answers in force, (2n,), what was sensed with them, and every ruling so far."""

    answers: tuple[float, ...]
    reports: Reports
    rulings: tuple[Ruling, ...] = ()

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
        switching_margin: float,
    ) -> None:
        """Declare ports, state and the periodic update; period in s, margin relative (see `settle`)."""
        super().__init__()
        n = len(team.ugvs)
        self._law = law
        self._presets = tuple(presets)
        self._route = route
        self._horizon = horizon
        self._switching_margin = switching_margin
        self._neighbourhood = team.neighbourhood(slice(0, n))
        self._max_speed = team.max_speed
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._ugv_command = self.DeclareVectorInputPort("ugv_command", 3 * n)
        self._uav_command = self.DeclareVectorInputPort("uav_command", 3)
        self._proposals = self.DeclareAbstractInputPort("proposals", Value(object()))
        self._memory = self.DeclareAbstractState(Value(GatekeeperMemory((SILENT, -1.0) * n, ((),) * n)))
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

    def rulings(self, context: Context) -> tuple[Ruling, ...]:
        """Every decision up to the context's time."""
        memory: GatekeeperMemory = context.get_abstract_state(int(self._memory)).get_value()
        return memory.rulings

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
        answers: list[float] = []
        reports: list[tuple[Point, ...]] = []
        rulings = list(memory.rulings)
        for i, proposal in enumerate(proposals):
            if proposal is None:
                answers += [SILENT, -1.0]
                reports.append(())
                continue
            started = time.thread_time()
            decision = self._route.decide(self._problem(context.get_time(), i, proposal, positions, velocities))
            self.decision_times_s.append(time.thread_time() - started)
            standing = answer_to(proposal, memory.answers, i)
            accepted = settle(decision, standing, self._switching_margin)
            rulings.append(Ruling(context.get_time(), i, proposal, decision, accepted))
            answers += [ACCEPT if accepted else REFUSE, proposal.issued]
            reports.append(self._sensed(positions[i]))
        new = GatekeeperMemory(tuple(answers), tuple(reports), tuple(rulings))
        state.get_mutable_abstract_state(int(self._memory)).set_value(new)
        return EventStatus.Succeeded()

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


def settle(decision: Decision, standing: float, margin: float) -> bool:
    """Whether the proposal is accepted, given the answer that stands.

    A standing answer is reversed only if the other choice is cheaper by the relative margin: two choices of
    nearly equal cost must not alternate at every sample. A new proposal that changes nothing (one that the
    avoidance inequalities would block entirely) is refused, and so is every one without an optimum.
    """
    if decision.status != "optimal":
        return False
    if standing == SILENT:
        return decision.accept and decision.objective_accept < (1.0 - USELESS) * decision.objective_refuse
    kept, other = decision.objective_accept, decision.objective_refuse
    if standing == REFUSE:
        kept, other = other, kept
    reverse = other < (1.0 - margin) * kept
    return (standing == ACCEPT) != reverse


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
