"""What the UGVs do at one sample of the gatekeeper: sense, predict, decide, answer; by (26) under method (c)."""

from __future__ import annotations

import abc
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import thread_time
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.answer import Decision, Planned, Rules, costs_throughout, in_words, settle
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.patience import Commitment
from airground_drake.gatekeeper.problem import Horizon, predicted_problem
from airground_drake.gatekeeper.rollout import Scene
from airground_drake.gatekeeper.routes.route import Route
from airground_drake.gatekeeper.solution import after_failure
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT, Disc, Proposals, Report, Reports, answer_to
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Surroundings
from airground_drake.nsbc.kernels import distances
from airground_drake.nsbc.law import UgvLaw
from airground_drake.world.world import World


@dataclass(frozen=True, eq=False)
class Memory:
    """What the gatekeepers of n UGVs keep from sample to sample.

    Attributes:
        answers: in force, (2n,), see `messages`.
        since: when each UGV's answer became what it is, (n,), s.
        reports: what came with them.
        decisions: those of the last sample at which anything was to be judged or remembered.
        commitments: under method (d), what each UGV has committed itself to.
        sensed: under method (d), which obstacles each UGV has sensed so far, (n, m).
    """

    answers: tuple[float, ...]
    since: tuple[float, ...]
    reports: Reports
    decisions: tuple[Decision, ...] = ()
    commitments: tuple[Commitment, ...] = ()
    sensed: npt.NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))

    @classmethod
    def empty(cls, count: int) -> Memory:
        """Of `count` UGVs that have answered nothing yet."""
        held = (Commitment(),) * count
        return cls((SILENT, -1.0) * count, (0.0,) * count, (Report(),) * count, commitments=held)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


@dataclass(frozen=True)
class Judging:
    """How proposals are judged under method (c).

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


@dataclass(frozen=True, eq=False)
class View:
    """What all UGVs see at a sample.

    Attributes:
        t: time, s.
        proposals: in force, one entry per UGV.
        positions: of all bodies that move, (M, 3), m.
        velocities: of these, (M, 3), m/s.
        before: memory from the sample before.
    """

    t: float
    proposals: Proposals
    positions: Array
    velocities: Array
    before: Memory


class Gatekeepers(abc.ABC):
    """The UGVs of a team, as they judge proposals.

    Attributes:
        times_s: CPU time of every prediction and decision so far (what it costs, not what else the machine did
            meanwhile).
    """

    def __init__(self, world: World, law: UgvLaw, presets: Sequence[Motion]) -> None:
        """Of the UGVs of a world, with their control law and preset trajectories."""
        self._law = law
        self._presets = tuple(presets)
        self._world = world
        self._near = world.around(world.select("ugv"))
        self._discs = np.column_stack([self._near.still, world.radius[len(world.moving) :]])
        self.times_s: list[float] = []

    @abc.abstractmethod
    def sample(self, t: float, proposals: Proposals, positions: Array, velocities: Array, memory: Memory) -> Memory:
        """Judge every proposal in force.

        Args:
            t: time, s.
            proposals: one entry per UGV.
            positions: of all bodies that move, (M, 3), m.
            velocities: of these, (M, 3), m/s.
            memory: from the sample before.
        """

    def idle(self, proposals: Proposals, positions: Array, memory: Memory) -> bool:
        """Whether a sample changes nothing: no proposal, no answer to take back, nothing new to remember."""
        return not any(proposals) and not any(memory.answers[::2])

    def _sensed(self, position: Array) -> npt.NDArray[np.bool_]:
        """Which obstacles are within sensing range, (m,)."""
        away = distances(self._near.still, position)
        return np.asarray(away <= self._law.avoidance.sensing_range)

    def _report(self, position: Array, decision: Decision) -> Report:
        """What goes with an answer."""
        near = self._sensed(position)
        discs: tuple[Disc, ...] = tuple((x, y, z, radius) for x, y, z, radius in self._discs[near].tolist())
        return Report(discs, decision.reason, in_words(decision))

    def _scene(self, seen: View, i: int) -> Scene:
        """What a UGV has around it: all obstacles and robots, whether within sensing range or not."""
        near = self._near
        return Scene(
            t=seen.t,
            position=seen.positions[i].copy(),
            preset=self._presets[i],
            centres=Surroundings.of(near, seen.positions).centre[i],
            velocities=np.concatenate([np.zeros_like(near.still), seen.velocities[near.others[i]]]),
            distances=near.distance[i],
            shares=near.share[i],
            max_speed=float(near.max_speed[i]),
        )


class PaperGatekeepers(Gatekeepers):
    """Method (c): problem (26) at every sample, and the first stage of its plan is the answer."""

    def __init__(self, world: World, law: UgvLaw, presets: Sequence[Motion], judging: Judging) -> None:
        """Of the UGVs of a world, with their control law, their preset trajectories and how they judge."""
        super().__init__(world, law, presets)
        self._judging = judging

    def sample(self, t: float, proposals: Proposals, positions: Array, velocities: Array, memory: Memory) -> Memory:
        """Judge every proposal in force by (26)."""
        seen = View(t, proposals, positions, velocities, memory)
        answers: list[float] = []
        since: list[float] = []
        reports: list[Report] = []
        decisions: list[Decision] = []
        budgets = self._judging.rules.budgets(sum(p is not None for p in proposals), self._judging.period)
        for i, proposal in enumerate(proposals):
            if proposal is None:
                answers += [SILENT, -1.0]
                since.append(t)
                reports.append(Report())
                continue
            decision = self._decide(seen, i, proposal, budgets)
            decisions.append(decision)
            answer = ACCEPT if decision.accepted else REFUSE
            answers += [answer, proposal.number]
            since.append(memory.since[i] if answer == answer_to(proposal, memory.answers, i) else t)
            reports.append(self._report(positions[i], decision))
        return replace(
            memory, answers=tuple(answers), since=tuple(since), reports=tuple(reports),
            decisions=tuple(decisions),
        )  # fmt: skip

    def _decide(self, seen: View, i: int, proposal: Proposal, budgets: Iterator[Budget]) -> Decision:
        started = thread_time()
        problem = predicted_problem(self._scene(seen, i), self._law, proposal, self._judging.horizon)
        problem = replace(problem, previous=self._rest_of_plan(seen, i, proposal))
        solution = self._judging.route.solve(problem, next(budgets))
        if solution.status == "solver_failed":
            solution = after_failure(problem, solution)
        self.times_s.append(thread_time() - started)
        standing, stood = answer_to(proposal, seen.before.answers, i), seen.t - seen.before.since[i]
        throughout = costs_throughout(problem, solution)
        accepted, reason = settle(solution, throughout, standing, stood, self._judging.rules)
        return Decision(seen.t, i, proposal, accepted, reason, Planned(problem, solution, throughout))

    def _rest_of_plan(self, seen: View, i: int, proposal: Proposal) -> Array | None:
        """What the plan that was decided on at the sample before says from now on, (N,); None if there was none.

        It ends earlier by a sampling period; its last choice stands for the rest.
        """
        for decision in reversed(seen.before.decisions):
            grounds = decision.grounds
            if decision.robot == i and decision.proposal is proposal and isinstance(grounds, Planned):
                plan = grounds.solution.plan
                if plan is None:
                    return None
                passed = round((seen.t - decision.t) / grounds.problem.dt)
                return plan[np.minimum(np.arange(len(plan)) + passed, len(plan) - 1)]
        return None
