"""The UAV's planner: it finds the UGVs that need a proposal, asks the policies, and takes answers into account."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.database import BehaviourDatabase, Fault, Negotiation
from airground_drake.intervention.messages import (
    ACCEPT,
    DONE,
    REFUSE,
    SILENT,
    Disc,
    Proposals,
    Reports,
    answer_to,
)
from airground_drake.intervention.policy import Answered, Observation, Proposal, Teammate


@dataclass(frozen=True)
class PlannerState:
    """What the UAV remembers.

    Attributes:
        talks: where it stands with each UGV.
        learnt: obstacles that came with answers and were not on the map.
        sent: (UGV, proposal), in order.
        faults: of policies, in order.
    """

    talks: tuple[Negotiation, ...]
    learnt: tuple[Disc, ...] = ()
    sent: tuple[tuple[int, Proposal], ...] = ()
    faults: tuple[Fault, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self

    @property
    def proposals(self) -> Proposals:
        """In force, one entry per UGV."""
        return tuple(talk.proposal for talk in self.talks)


def sent_after(before: PlannerState, after: PlannerState, t: float) -> PlannerState:
    """Number the proposals that a planning instant has brought, and note them as sent.

    Every proposal that was not there before gets the next number and the time, whatever it came with: no planner can
    send another motion under the number that a UGV has answered.

    Args:
        before: memory before the instant.
        after: what the planner has made of it.
        t: time, s.
    """
    sent, talks = list(before.sent), list(after.talks)
    for i, (old, talk) in enumerate(zip(before.talks, after.talks, strict=True)):
        if talk.proposal is not None and talk.proposal is not old.proposal:
            proposal = replace(talk.proposal, number=len(sent), issued=t)
            talks[i] = replace(talk, proposal=proposal)
            sent.append((i, proposal))
    return replace(after, talks=tuple(talks), sent=tuple(sent)) if len(sent) > len(before.sent) else after


@dataclass(frozen=True, eq=False)
class Planner:
    """The UAV's planner, on its own map, which may miss obstacles.

    Policies are asked for UGVs that are intervened on. What they propose to others, which are to make way, is a
    proposal like any other, in force as long as the UGV that it is for is intervened on. A refusal withdraws the
    proposal, and all other parts of its joint plan; the next behaviour is tried after a rest. The obstacles that the
    UGV senses come with every answer, and the UAV knows them from then on. See docs/design.md.

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

    def start(self) -> PlannerState:
        """What is remembered at the beginning: nothing."""
        return PlannerState((Negotiation(),) * len(self.ugvs))

    def idle(self, memory: PlannerState, intervening: Sequence[bool]) -> bool:
        """Whether a planning instant changes nothing: nobody is intervened on, and nothing of it is remembered."""
        return not any(intervening) and memory.talks == self.start().talks

    def plan(
        self,
        memory: PlannerState,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        reports: Reports,
        standing: Sequence[bool] = (),
    ) -> PlannerState:
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
        said = [answer_to(talk.proposal, answers, i) for i, talk in enumerate(memory.talks)]
        heard = [report for report, answer in zip(reports, said, strict=True) if answer != SILENT]
        reported = {disc for report in heard for disc in report.sensed}
        mapped = np.column_stack([self.mapped, np.broadcast_to(self.mapped_radii, len(self.mapped))])
        fresh = tuple(sorted(reported - set(memory.learnt) - set(map(tuple, mapped.tolist()))))
        learnt = memory.learnt + fresh
        discs = np.concatenate([mapped, np.array(learnt).reshape(-1, 4)])
        talks = self._after_answers(memory.talks, t, intervening, said, learnt=bool(fresh))
        faults = list(memory.faults)
        for i, robot in enumerate(self.ugvs):
            if not (intervening[i] and talks[i].is_due(t)):
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
                refusals=talks[i].refusals,
                team=self._team(t, positions, intervening, answers, talks, standing),
                robot_distance=self.robot_distance,
                radius=float(self.radii[i]),
                obstacle_radii=discs[:, 3],
                mapped_radii=mapped[:, 3],
            )
            changed, wrong = self.database.plan(talks[i], seen)
            faults += wrong
            talks = [changed.get(name, talk) for name, talk in zip(self.ugvs, talks, strict=True)]
        return replace(memory, talks=tuple(talks), learnt=learnt, faults=tuple(faults))

    def _after_answers(
        self,
        talks: Sequence[Negotiation],
        t: float,
        intervening: Sequence[bool],
        said: Sequence[float],
        *,
        learnt: bool,
    ) -> list[Negotiation]:
        """Negotiations without what is withdrawn: refused in any part, run out, or for a UGV without a trigger now."""
        called = {name for name, one in zip(self.ugvs, intervening, strict=True) if one}
        refused = {talk.proposal.joint for talk, no in zip(talks, said, strict=True) if talk.proposal and no == REFUSE}
        found = []
        for name, talk, answer in zip(self.ugvs, talks, said, strict=True):
            proposal = talk.proposal
            party_refused = proposal is not None and bool(proposal.party) and proposal.joint in refused
            if name not in called and talk.cause not in called:
                talk = Negotiation()
            elif answer == REFUSE:
                talk = self.database.after_refusal(talk, t, learnt=learnt)
            elif proposal is not None and (party_refused or answer == DONE or t >= proposal.motion.end):
                talk = replace(talk, proposal=None)
            found.append(talk)
        return found

    def _team(
        self,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        talks: Sequence[Negotiation],
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
                proposal=talks[i].proposal,
                answered=_answered(talks[i].proposal, answers, i),
                refusals=talks[i].refusals,
                resting=talks[i].refused_lately(t),
                radius=float(self.radii[i]),
            )
            for i, name in enumerate(self.ugvs)
        )


def _answered(proposal: Proposal | None, answers: Array, robot: int) -> Answered:
    answer = answer_to(proposal, answers, robot)
    if answer == ACCEPT:
        return "accepted"
    return "refused" if answer == REFUSE else "silent"
