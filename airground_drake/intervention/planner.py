"""What the UAV plans for a team: which UGV needs a proposal, on which map, and what came of the last one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from airground_drake.arrays import Array
from airground_drake.intervention.database import BehaviourDatabase, Desk, Fault
from airground_drake.intervention.messages import REFUSE, Point, Proposals, Reports, answer_to
from airground_drake.intervention.policy import Observation, Proposal
from airground_drake.nsbc.motion import Motion


@dataclass(frozen=True)
class PlannerMemory:
    """What the UAV remembers: per UGV what is on the desk, what refusals have taught, all sent and gone wrong so far.

    Attributes:
        desks: one per UGV.
        learnt: obstacles that came with refusals and were not on the map.
        sent: (UGV, proposal), in order.
        faults: of policies, in order.
    """

    desks: tuple[Desk, ...]
    learnt: tuple[Point, ...] = ()
    sent: tuple[tuple[int, Proposal], ...] = ()
    faults: tuple[Fault, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self

    @property
    def proposals(self) -> Proposals:
        """In force, one entry per UGV."""
        return tuple(desk.proposal for desk in self.desks)


@dataclass(frozen=True, eq=False)
class Planner:
    """The UAV's planner, on its own map, which may miss obstacles.

    A refusal moves it to the next behaviour; the obstacles that the UGV senses come with it, and the UAV knows them
    from then on.

    Attributes:
        ugvs: names.
        database: policies, in the order in which they are tried.
        period: planning period, s; a proposal can act one period after it is made.
        presets: preset trajectories of the UGVs.
        targets: (n, 3), m.
        mapped: obstacles on the UAV's map, (m, 3), m.
        safe_distance: d to obstacles, m.
    """

    ugvs: tuple[str, ...]
    database: BehaviourDatabase
    period: float
    presets: tuple[Motion, ...]
    targets: Array
    mapped: Array
    safe_distance: float

    def start(self) -> PlannerMemory:
        """What is remembered at the beginning: nothing."""
        return PlannerMemory((Desk(),) * len(self.ugvs))

    def plan(
        self,
        memory: PlannerMemory,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        reports: Reports,
    ) -> PlannerMemory:
        """One planning period.

        Args:
            memory: before.
            t: time, s.
            positions: of all robots, (n + 1, 3), m, world frame.
            intervening: per UGV, whether the trigger has it in mode INTERVENING.
            answers: of the UGVs, (2n,), see `messages`.
            reports: what they sensed, see `messages`.
        """
        refused = [answer_to(desk.proposal, answers, i) == REFUSE for i, desk in enumerate(memory.desks)]
        reported = {point for i, report in enumerate(reports) if refused[i] for point in report.sensed}
        fresh = tuple(sorted(reported - set(memory.learnt) - set(map(tuple, self.mapped.tolist()))))
        learnt = memory.learnt + fresh
        obstacles = np.concatenate([self.mapped, np.array(learnt).reshape(-1, 3)])
        desks, sent, faults = list(memory.desks), list(memory.sent), list(memory.faults)
        for i, robot in enumerate(self.ugvs):
            if not intervening[i]:
                desks[i] = Desk()
                continue
            seen = Observation(
                t=t,
                start=t + self.period,
                robot=robot,
                position=positions[i].copy(),
                target=self.targets[i],
                preset=self.presets[i],
                obstacles=obstacles,
                mapped=self.mapped,
                others=np.delete(positions, i, axis=0),
                safe_distance=self.safe_distance,
                refusals=desks[i].refusals,
            )
            desk, failed = self.database.plan(desks[i], seen, refused=refused[i], learnt=bool(fresh))
            faults += failed
            if desk.proposal is not None and desk.proposal is not desks[i].proposal:
                sent.append((i, desk.proposal))
            desks[i] = desk
        return PlannerMemory(tuple(desks), learnt, tuple(sent), tuple(faults))
