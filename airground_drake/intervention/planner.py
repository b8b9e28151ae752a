"""What the UAV plans for a team: which UGV needs a proposal, on which map, and what came of the last one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from airground_drake.arrays import Array
from airground_drake.intervention.database import BehaviourDatabase, Desk, Fault
from airground_drake.intervention.messages import ACCEPT, REFUSE, Disc, Proposals, Reports, answer_to
from airground_drake.intervention.policy import Answered, Observation, Proposal, Teammate
from airground_drake.nsbc.motion import Motion

OVER = "over"
"""Why a UGV gives back what it has executed to its end, which is no refusal."""


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
    learnt: tuple[Disc, ...] = ()
    sent: tuple[tuple[int, Proposal], ...] = ()
    faults: tuple[Fault, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self

    @property
    def proposals(self) -> Proposals:
        """In force, one entry per UGV."""
        return tuple(desk.proposal for desk in self.desks)


def sent_after(before: PlannerMemory, after: PlannerMemory, t: float) -> PlannerMemory:
    """Number the proposals that a planning instant has put on the desks, and note them as sent.

    Every proposal that was not there before gets the next number and the time, whatever it came with: no planner can
    send another motion under the number that a UGV has answered.

    Args:
        before: memory before the instant.
        after: what the planner has made of it.
        t: time, s.
    """
    sent, desks = list(before.sent), list(after.desks)
    for i, (old, desk) in enumerate(zip(before.desks, after.desks, strict=True)):
        if desk.proposal is not None and desk.proposal is not old.proposal:
            proposal = replace(desk.proposal, number=len(sent), issued=t)
            desks[i] = replace(desk, proposal=proposal)
            sent.append((i, proposal))
    return replace(after, desks=tuple(desks), sent=tuple(sent)) if len(sent) > len(before.sent) else after


@dataclass(frozen=True, eq=False)
class Planner:
    """The UAV's planner, on its own map, which may miss obstacles.

    A refusal moves it to the next behaviour; the obstacles that the UGV senses come with it, and the UAV knows them
    from then on. Policies are asked for UGVs that are intervened on. What they propose to others, which are to make
    way, is a proposal like any other, in force as long as the UGV that it is for is intervened on. If one UGV refuses
    its part of a joint plan, the policies are asked again for the others, whose parts stay in force if nothing better
    is found.

    Attributes:
        ugvs: names.
        database: policies, in the order in which they are tried.
        period: planning period, s; a proposal can act one period after it is made.
        presets: preset trajectories of the UGVs.
        targets: (n, 3), m.
        mapped: obstacles on the UAV's map, (m, 3), m.
        safe_distance: d to obstacles, m.
        robot_distance: d between UGVs, m.
        max_speed: of the UGVs, (n,), m/s.
        radius: of the UGVs' bodies, (n,), m, or one for all.
        mapped_radii: of the obstacles on the map, (m,), m, or one for all.
    """

    ugvs: tuple[str, ...]
    database: BehaviourDatabase
    period: float
    presets: tuple[Motion, ...]
    targets: Array
    mapped: Array
    safe_distance: float
    robot_distance: float
    max_speed: Array
    radius: Array | float = 0.0
    mapped_radii: Array | float = 0.0

    @property
    def radii(self) -> Array:
        """Radii of the UGVs' bodies, (n,), m."""
        return np.broadcast_to(self.radius, len(self.ugvs))

    def start(self) -> PlannerMemory:
        """What is remembered at the beginning: nothing."""
        return PlannerMemory((Desk(),) * len(self.ugvs))

    def idle(self, memory: PlannerMemory, intervening: Sequence[bool]) -> bool:
        """Whether a planning instant changes nothing: nobody is intervened on, and nothing is in force."""
        return not any(intervening) and not any(memory.proposals)

    def plan(
        self,
        memory: PlannerMemory,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        reports: Reports,
        standing: Sequence[bool] = (),
    ) -> PlannerMemory:
        """One planning period.

        Args:
            memory: before.
            t: time, s.
            positions: of all robots, (n + 1, 3), m, world frame.
            intervening: per UGV, whether the trigger has it in mode INTERVENING.
            answers: of the UGVs, (2n,), see `messages`.
            reports: what they sensed, see `messages`.
            standing: per UGV, whether it stands, see `halts`; default: none does.
        """
        no = [answer_to(desk.proposal, answers, i) == REFUSE for i, desk in enumerate(memory.desks)]
        reported = {disc for i, report in enumerate(reports) if no[i] for disc in report.sensed}
        refused = [no[i] and not (desk.is_due(t) and reports[i].reason == OVER) for i, desk in enumerate(memory.desks)]
        mapped = np.column_stack([self.mapped, np.broadcast_to(self.mapped_radii, len(self.mapped))])
        fresh = tuple(sorted(reported - set(memory.learnt) - set(map(tuple, mapped.tolist()))))
        learnt = memory.learnt + fresh
        discs = np.concatenate([mapped, np.array(learnt).reshape(-1, 4)])
        let_down = self._let_down(memory.desks, refused)
        desks = self._after_answers(memory.desks, t, intervening, refused, learnt=bool(fresh))
        faults = list(memory.faults)
        for i, robot in enumerate(self.ugvs):
            in_force = desks[i].proposal
            just_sent = in_force is not None and in_force.issued == t
            if not intervening[i] or just_sent or not (desks[i].is_due(t) or robot in let_down):
                continue
            seen = Observation(
                t=t,
                start=t + self.period,
                robot=robot,
                position=positions[i],
                target=self.targets[i],
                preset=self.presets[i],
                obstacles=np.ascontiguousarray(discs[:, :3]),
                mapped=self.mapped,
                others=np.delete(positions, i, axis=0),
                safe_distance=self.safe_distance,
                refusals=desks[i].refusals,
                team=self._team(t, positions, intervening, answers, desks, standing),
                robot_distance=self.robot_distance,
                radius=float(self.radii[i]),
                obstacle_radii=discs[:, 3],
                mapped_radii=mapped[:, 3],
            )
            planned = self.database.plan(desks[i], seen)
            faults += planned.faults
            for j, name in enumerate(self.ugvs):
                desks[j] = planned.desk if j == i else planned.asked.get(name, desks[j])
        return replace(memory, desks=tuple(desks), learnt=learnt, faults=tuple(faults))

    def _after_answers(
        self, desks: Sequence[Desk], t: float, intervening: Sequence[bool], refused: Sequence[bool], *, learnt: bool
    ) -> list[Desk]:
        """Desks without what is over: refused, run out, or for a UGV that is not intervened on any more."""
        called = {name for name, one in zip(self.ugvs, intervening, strict=True) if one}
        found = []
        for name, desk, no in zip(self.ugvs, desks, refused, strict=True):
            if name not in called and desk.cause not in called:
                desk = Desk()
            elif no:
                desk = self.database.after_refusal(desk, t, learnt=learnt, favour=name not in called)
            elif name not in called and desk.proposal is not None and desk.is_due(t):
                desk = replace(desk, proposal=None, party=())
            found.append(desk)
        return found

    def _let_down(self, desks: Sequence[Desk], refused: Sequence[bool]) -> set[str]:
        """Names of the UGVs with proposals of joint plans of which another UGV has refused its part."""
        found = set()
        for desk, no in zip(desks, refused, strict=True):
            if no and desk.proposal is not None:
                issued = desk.proposal.issued
                for name, other, also in zip(self.ugvs, desks, refused, strict=True):
                    same = other.proposal is not None and other.proposal.issued == issued
                    if name in desk.party and same and not also:
                        found.add(name)
        return found

    def _team(
        self,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        desks: Sequence[Desk],
        standing: Sequence[bool],
    ) -> tuple[Teammate, ...]:
        """Every UGV as it is now."""
        return tuple(
            Teammate(
                name=name,
                position=positions[i],
                target=self.targets[i],
                preset=self.presets[i],
                max_speed=float(self.max_speed[i]),
                triggered=bool(intervening[i]),
                standing=standing[i] if standing else False,
                proposal=desks[i].proposal,
                answered=_answered(desks[i].proposal, answers, i),
                refusals=desks[i].refusals,
                resting=desks[i].proposal is None and t < desks[i].retry_at,
                radius=float(self.radii[i]),
            )
            for i, name in enumerate(self.ugvs)
        )


def _answered(proposal: Proposal | None, answers: Array, robot: int) -> Answered:
    answer = answer_to(proposal, answers, robot)
    if answer == ACCEPT:
        return "accepted"
    return "refused" if answer == REFUSE else "silent"
