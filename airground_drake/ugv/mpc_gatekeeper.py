"""One sample of the UGVs' gatekeepers: sense, predict, decide, answer; under method (c) by problem (26)."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import thread_time
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.base.errors import PluginError, described, raised_as, short
from airground_drake.base.history import History, Immutable
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.uav.messages import (
    ACCEPT,
    REFUSE,
    SILENT,
    Proposals,
    Report,
    Reports,
    Sighting,
    answer_to,
    sightings,
)
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import Basis, GatekeeperDecision, Rules, in_words, settle
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.desk import Desk
from airground_drake.ugv.patience import Commitment
from airground_drake.ugv.problem import Horizon, Problem, predicted_problem
from airground_drake.ugv.rollout import View
from airground_drake.ugv.routes.route import Route
from airground_drake.ugv.solution import ConstantPlans, Solution, after_failure


@dataclass(frozen=True, eq=False)
class GatekeeperState(Immutable):
    """The memory of the gatekeepers of n UGVs between samples."""

    answers: tuple[float, ...]  # in force, (2n,), see `messages`
    since: tuple[float, ...]  # time of each UGV's last change of answer, (n,), s
    reports: Reports  # each UGV's last message to the UAV about its proposal
    sent: int = 0  # answers sent so far
    desk: Desk | None = None  # messages read and answered over a channel
    decisions: tuple[GatekeeperDecision, ...] = ()  # those of the last sample with proposals, or of its repetition
    commitments: tuple[Commitment, ...] = ()  # under method (d), each UGV's tries and rests
    # under method (d), which outlines at rest each UGV has sensed and not seen to be gone, (n, m)
    sensed: Flags = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    # outlines that need no report when they come into range: the UAV knows them, or the UGV has no proposal
    quiet: Flags = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    # all decisions of the run so far
    made: History[GatekeeperDecision] = field(default_factory=History)

    @classmethod
    def empty(cls, count: int, *, channel: bool = False) -> GatekeeperState:
        held = (Commitment(),) * count
        desk = Desk.empty(count) if channel else None
        return cls((SILENT, -1.0) * count, (0.0,) * count, (Report(),) * count, commitments=held, desk=desk)


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs at a sample."""

    t: float  # time, s
    proposals: Proposals  # in force, one entry per UGV
    positions: Array  # of all bodies that move, (M, 3), m
    velocities: Array  # of these, (M, 3), m/s
    law: UgvLaw  # the UGVs' control law, with the gains in force
    headings: Array | None = None  # of the UGVs, (n,), rad; None if no UGV is a unicycle


class Gatekeepers(abc.ABC):
    """Gatekeepers of a team of UGVs, with their control law at the scenario's gains."""

    def __init__(
        self, world: World, law: UgvLaw, presets: Sequence[Motion], unreported: Collection[str] = frozenset()
    ) -> None:
        # unreported: names of obstacles that move and that the UAV sees itself
        self.law = law
        self._unreported = unreported
        self._presets = tuple(presets)
        self._world = world
        self._near = world.around(world.select("ugv"))
        self._slept: tuple[Proposals | None, GatekeeperState | None, float] = None, None, 0.0

    @property
    def judges(self) -> str:
        """Name of the class that judges proposals, for pictures."""
        return type(self).__name__

    @abc.abstractmethod
    def sample(self, now: Inputs, before: GatekeeperState) -> GatekeeperState:
        """Judge every proposal in force, with the state from the sample before."""

    def asleep_until(self, proposals: Proposals, before: GatekeeperState) -> float:
        """Time until which samples only repeat answers, s, unless `wakes`; -inf: the next sample may change one."""
        return -math.inf if any(proposals) or any(before.answers[::2]) else math.inf

    def wakes(self, t: float, positions: Array, before: GatekeeperState) -> bool:
        """Whether an outline in range at time t, s, may change an answer."""
        return False

    def kept(self, times: Sequence[float], proposals: Proposals, before: GatekeeperState) -> GatekeeperState:
        """The state after samples at some times, s, that only repeat the answers."""
        rows = [
            [
                GatekeeperDecision(
                    t, i, proposal, answer_to(proposal, before.answers, i) == ACCEPT, "kept",
                    tries=before.commitments[i].tries,
                )
                for i, proposal in enumerate(proposals) if proposal is not None
            ]
            for t in times
        ]  # fmt: skip
        if not any(rows):
            return before
        return replace(before, decisions=tuple(rows[-1]), made=before.made.plus([*itertools.chain(*rows)]))

    def repeated(
        self, t: float, proposals: Proposals, positions: Array, before: GatekeeperState
    ) -> GatekeeperState | None:
        """The state after a sample at t, s, that only repeats the answers; None if the sample must be computed."""
        if proposals is not self._slept[0] or before is not self._slept[1]:  # otherwise it is as late as before
            self._slept = proposals, before, self.asleep_until(proposals, before)
        if t >= self._slept[2] or self.wakes(t, positions, before):
            return None
        return self.kept([t], proposals, before)

    def _in_range(self, t: float, position: Array) -> Flags:
        """Which static outlines exist at time t, s, within sensing range, (m,)."""
        still, reach = self._world.at(self._near, t).still, self.law.avoidance.sensing_range
        return np.asarray(convex.within(still, position[None], reach, True)[0])

    def _beside(self, now: Inputs, i: int) -> Indices:
        """Parts that move around a UGV: of all robots, and of obstacles within sensing range; rows of `parts`."""
        near, others = self._world.at(self._near, now.t), self._near.others[i]
        if len(self._world.moving) == len(self._world.robots):
            return others
        own, reach = now.positions[i], self.law.avoidance.sensing_range
        return np.array([
            part for part in others
            if near.carrier[part] < len(self._world.robots)
            or convex.distances(near.parts[part, None], own - now.positions[near.carrier[part]], True)[0] <= reach
        ], dtype=np.intp)  # fmt: skip

    def _answered(
        self, now: Inputs, before: GatekeeperState, judged: Sequence[tuple[GatekeeperDecision, float]]
    ) -> GatekeeperState:
        """The state after the decisions of a sample, with the resulting answers."""
        n, sent = len(now.proposals), before.sent
        answers, reports, decisions = [SILENT, -1.0] * n, [Report()] * n, list[GatekeeperDecision]()
        for decision, verdict in judged:
            i, number = decision.robot, decision.proposal.number
            news = self._news(now, before, decision, verdict)
            if news is not None:
                decision, sent = replace(decision, answer=sent), sent + 1
                news = news._replace(number=decision.answer)
            reports[i] = news or before.reports[i]
            decisions.append(decision)
            answers[2 * i : 2 * i + 2] = verdict, number
        return replace(
            before, answers=tuple(answers), reports=tuple(reports), decisions=tuple(decisions), sent=sent,
            made=before.made.plus(decisions),
        )  # fmt: skip

    def _news(
        self, now: Inputs, before: GatekeeperState, decision: GatekeeperDecision, verdict: float
    ) -> Report | None:
        """The report of a changed answer, or of obstacles that the UAV does not know; else None."""
        i, reported = decision.robot, before.reports[decision.robot]
        near = self._near.still[self._in_range(decision.t, now.positions[i])]
        sensed, seen = tuple(map(outline.as_tuple, near)), self._seen(now, i)
        if verdict == answer_to(decision.proposal, before.answers, i) and seen == reported.seen:
            new = [row for row, given in zip(near, sensed, strict=True) if given not in reported.sensed]
            if not new or outline.is_among(np.array(new), decision.proposal.mapped).all():
                return None
        return Report(-1, sensed, decision.reason, in_words(decision), seen)

    def _seen(self, now: Inputs, i: int) -> tuple[Sighting, ...]:
        """The moving obstacles that a UGV senses and the UAV does not see."""
        if len(self._world.moving) == len(self._world.robots):
            return ()
        beside = {self._world.moving[body].name for body in self._near.carrier[self._beside(now, i)]}
        every = sightings(self._world, now.t, now.positions)
        return tuple(sighting for sighting in every if sighting.name in beside.difference(self._unreported))

    def _view(self, now: Inputs, i: int) -> View:
        """All static obstacles and robots around a UGV, and the moving obstacles within sensing range."""
        near, beside, m = self._world.at(self._near, now.t), self._beside(now, i), len(self._near.still)
        shown = np.append(np.ones(m, dtype=bool), np.isin(near.others[i], beside))
        turning: dict[str, Any] = {}
        if now.headings is not None and self._world.steering is not None:
            turning = {"heading": float(now.headings[i]), "steering": self._world.steering[i]}
        return View(
            t=now.t,
            position=now.positions[i].copy(),
            preset=self._presets[i],
            still=near.still,
            parts=near.parts[beside],
            places=now.positions[near.carrier[beside]],
            velocities=now.velocities[near.carrier[beside]],
            distances=near.distance[i][shown],
            shares=near.share[i][shown],
            max_speed=float(near.max_speed[i]),
            **turning,
        )


class PaperGatekeepers(Gatekeepers):
    """Method (c): problem (26) at every sample, and the first stage of its plan is the answer."""

    def __init__(
        self, world: World, law: UgvLaw, presets: Sequence[Motion], route: Route, horizon: Horizon, rules: Rules,
        unreported: Collection[str] = frozenset(),
    ) -> None:  # fmt: skip
        """The route solves (26) over the horizon, and the rules lead to the answer."""
        super().__init__(world, law, presets, unreported)
        self._route, self._horizon, self._rules = route, horizon, rules

    @property
    def judges(self) -> str:
        return type(self._route).__name__

    def sample(self, now: Inputs, before: GatekeeperState) -> GatekeeperState:
        since: list[float] = []
        judged: list[tuple[GatekeeperDecision, float]] = []
        budgets = self._rules.budgets(sum(p is not None for p in now.proposals))
        for i, proposal in enumerate(now.proposals):
            if proposal is None:
                since.append(now.t)
                continue
            decision = self._decide(now, before, i, proposal, budgets)
            verdict = ACCEPT if decision.accepted else REFUSE
            judged.append((decision, verdict))
            since.append(before.since[i] if verdict == answer_to(proposal, before.answers, i) else now.t)
        return replace(self._answered(now, before, judged), since=tuple(since))

    def _decide(
        self, now: Inputs, before: GatekeeperState, i: int, proposal: Proposal, budgets: Iterator[Budget]
    ) -> GatekeeperDecision:
        started = thread_time()
        problem = predicted_problem(self._view(now, i), now.law, proposal, self._horizon)
        problem = replace(problem, previous=_rest_of_plan(before, now.t, i, proposal))
        solution = self._solved(problem, next(budgets))
        if solution.status == "solver_failed":
            solution = after_failure(problem, solution)
        cpu_s = thread_time() - started
        standing, stood = answer_to(proposal, before.answers, i), now.t - before.since[i]
        constants = ConstantPlans.of(problem)
        throughout = (constants.accept.objective, constants.refuse.objective) if solution.has_plan else (-1.0, -1.0)
        accepted, reason = settle(solution, throughout, standing, stood, self._rules)
        basis = Basis(tuple(np.flatnonzero(self._in_range(now.t, now.positions[i])).tolist()))
        evidence = (problem, solution, throughout)
        return GatekeeperDecision(now.t, i, proposal, accepted, reason, *evidence, basis=basis, cpu_s=cpu_s)

    def _solved(self, problem: Problem, budget: Budget) -> Solution:
        """The route's solution; the route gets a copy of the `Problem`, so that it cannot change the record."""
        kind = type(self._route)
        with raised_as(lambda error: PluginError(f"route {kind.__qualname__} raised {described(error, kind.solve)}")):
            solution: object = self._route.solve(replace(problem), budget)
        if not isinstance(solution, Solution):
            returned = f"{short(repr(solution))}, of type {type(solution).__qualname__}"
            allowed = f"{Solution.__module__}.{Solution.__qualname__}"
            raise PluginError(f"route {kind.__qualname__} returned {returned}; allowed: {allowed}")
        return solution


def _rest_of_plan(before: GatekeeperState, t: float, i: int, proposal: Proposal) -> Array | None:
    """The rest of the last sample's plan from time t, s, on, (N,), its last choice repeated; None without a plan."""
    for decision in before.decisions:
        if decision.robot == i and decision.proposal is proposal and decision.problem and decision.solution:
            plan = decision.solution.plan
            if plan is None:
                return None
            passed = round((t - decision.t) / decision.problem.dt)
            return plan[np.minimum(np.arange(len(plan)) + passed, len(plan) - 1)]
    return None
