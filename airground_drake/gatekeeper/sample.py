"""What the UGVs do at one sample of the gatekeeper: sense, predict, solve (26), answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import thread_time
from typing import Any, Self

import numpy as np

from airground_drake.arrays import Array
from airground_drake.gatekeeper.answer import Decision, Rules, costs_throughout, settle
from airground_drake.gatekeeper.prediction import Horizon, Scene, predicted_problem
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.routes.route import Route
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT, Point, Proposals, Reports, answer_to
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team


@dataclass(frozen=True)
class Memory:
    """What the gatekeepers of n UGVs keep from sample to sample.

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

    @classmethod
    def empty(cls, count: int) -> Memory:
        """Of `count` UGVs that have answered nothing yet."""
        return cls((SILENT, -1.0) * count, (0.0,) * count, ((),) * count)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


@dataclass(frozen=True)
class Judging:
    """How proposals are judged.

    Attributes:
        route: solves (26).
        horizon: grid and weights of (25)-(27).
        rules: from the solution to the answer.
        period: between samples, s.
    """

    route: Route
    horizon: Horizon
    rules: Rules
    period: float


class Gatekeepers:
    """The UGVs of a team, as they judge proposals.

    Attributes:
        times_s: CPU time of every prediction and solution so far (what it costs, not what else the machine did
            meanwhile).
    """

    def __init__(self, team: Team, law: UgvLaw, presets: Sequence[Motion], judging: Judging) -> None:
        """Of the UGVs of a team, with their control law and preset trajectories."""
        self._law = law
        self._presets = tuple(presets)
        self._judging = judging
        self._neighbourhood = team.neighbourhood(slice(0, len(team.ugvs)))
        self._max_speed = team.max_speed
        self.times_s: list[float] = []

    def sample(self, t: float, proposals: Proposals, positions: Array, velocities: Array, memory: Memory) -> Memory:
        """Judge every proposal in force.

        Args:
            t: time, s.
            proposals: one entry per UGV.
            positions: of all robots, (n + 1, 3), m.
            velocities: of all robots, (n + 1, 3), m/s.
            memory: from the sample before.
        """
        answers: list[float] = []
        since: list[float] = []
        reports: list[tuple[Point, ...]] = []
        decisions = list(memory.decisions)
        budgets = self._judging.rules.budgets(sum(p is not None for p in proposals), self._judging.period)
        for i, proposal in enumerate(proposals):
            if proposal is None:
                answers += [SILENT, -1.0]
                since.append(t)
                reports.append(())
                continue
            started = thread_time()
            problem = self._predict(t, i, proposal, positions, velocities)
            solution = self._judging.route.solve(problem, next(budgets))
            self.times_s.append(thread_time() - started)
            standing, stood = answer_to(proposal, memory.answers, i), t - memory.since[i]
            throughout = costs_throughout(problem, solution)
            accepted, reason = settle(solution, throughout, problem.bend, standing, stood, self._judging.rules)
            decisions.append(Decision(t, i, proposal, problem, solution, throughout, accepted, reason))
            answer = ACCEPT if accepted else REFUSE
            answers += [answer, proposal.issued]
            since.append(memory.since[i] if answer == standing else t)
            reports.append(self._sensed(positions[i]))
        return Memory(tuple(answers), tuple(since), tuple(reports), tuple(decisions))

    def _sensed(self, position: Array) -> tuple[Point, ...]:
        """Obstacles within sensing range."""
        obstacles = self._neighbourhood.obstacles
        near = np.linalg.norm(obstacles - position, axis=1) <= self._law.avoidance.sensing_range
        return tuple((x, y, z) for x, y, z in obstacles[near].tolist())

    def _predict(self, t: float, i: int, proposal: Proposal, positions: Array, velocities: Array) -> Problem:
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
        return predicted_problem(scene, self._law, proposal, self._judging.horizon)
