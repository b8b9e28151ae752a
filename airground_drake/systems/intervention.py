"""The UAV's planner: proposals for the UGVs that the trigger has flagged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from airground_drake.arrays import Array
from airground_drake.decision.trigger import Mode
from airground_drake.intervention.database import BehaviourDatabase, Desk, Fault
from airground_drake.intervention.messages import REFUSE, Point, answer_to
from airground_drake.intervention.policy import Observation, Proposal
from airground_drake.nsbc.motion import Motion
from airground_drake.systems.decision import FIELDS


@dataclass(frozen=True)
class PlannerMemory:
    """Abstract state: per UGV what is on the desk, what refusals have taught, all sent and gone wrong so far."""

    desks: tuple[Desk, ...]
    learnt: tuple[Point, ...] = ()
    sent: tuple[tuple[int, Proposal], ...] = ()
    faults: tuple[Fault, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


class InterventionPlanner(LeafSystem):
    """Supervises every UGV; for those in mode INTERVENING it asks the behaviour database for proposals.

    It plans on the UAV's own map, which may miss obstacles. A refusal comes back through `answers` and moves
    it to the next behaviour; the obstacles that the UGV senses come with it through `reports`, and the UAV
    knows them from then on.

    Ports (n UGVs):
        in  `team_position` (3(n+1)) m; `status` (4n) from EventTrigger; `answers` (2n) and `reports`
            (abstract), see `messages`.
        out `proposals` abstract, n of Proposal or None.
    Rate: one update per planning period, from t = 0. A proposal can act one period after it is made.
    """

    def __init__(
        self,
        ugvs: Sequence[str],
        database: BehaviourDatabase,
        *,
        period: float,
        presets: Sequence[Motion],
        targets: Array,
        known_obstacles: Array,
        safe_distance: float,
    ) -> None:
        """Declare ports, state and the periodic update.

        Args:
            ugvs: names.
            database: policies, in the order in which they are tried.
            period: planning period, s.
            presets: preset trajectories of the UGVs.
            targets: (n, 3), m.
            known_obstacles: the UAV's map, (m, 3), m.
            safe_distance: d to obstacles, m.
        """
        super().__init__()
        self._ugvs = tuple(ugvs)
        self._database = database
        self._period = period
        self._presets = tuple(presets)
        self._targets = targets
        self._obstacles = known_obstacles
        self._safe_distance = safe_distance
        n = len(self._ugvs)
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._status = self.DeclareVectorInputPort("status", FIELDS * n)
        self._answers = self.DeclareVectorInputPort("answers", 2 * n)
        self._reports = self.DeclareAbstractInputPort("reports", Value(object()))
        self._memory = self.DeclareAbstractState(Value(PlannerMemory((Desk(),) * n)))
        self.DeclareAbstractOutputPort(
            "proposals",
            lambda: Value(object()),
            self._calc_proposals,
            prerequisites_of_calc={self.abstract_state_ticket(self._memory)},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def memory(self, context: Context) -> PlannerMemory:
        """What was sent and what went wrong, up to the context's time."""
        memory: PlannerMemory = context.get_abstract_state(int(self._memory)).get_value()
        return memory

    def _calc_proposals(self, context: Context, output: AbstractValue) -> None:
        output.set_value(tuple(desk.proposal for desk in self.memory(context).desks))

    def _update(self, context: Context, state: State) -> EventStatus:
        memory = self.memory(context)
        modes = self._status.Eval(context)[::FIELDS].tolist()
        if Mode.INTERVENING not in modes and all(desk.proposal is None for desk in memory.desks):
            return EventStatus.DidNothing()
        positions = self._position.Eval(context).reshape(-1, 3)
        answers = self._answers.Eval(context)
        t = context.get_time()
        desks, sent, faults = list(memory.desks), list(memory.sent), list(memory.faults)
        refused = [answer_to(desk.proposal, answers, i) == REFUSE for i, desk in enumerate(desks)]
        reported = {point for i, points in enumerate(self._reports.Eval(context)) if refused[i] for point in points}
        fresh = tuple(sorted(reported - set(memory.learnt) - set(map(tuple, self._obstacles.tolist()))))
        learnt = memory.learnt + fresh
        obstacles = np.concatenate([self._obstacles, np.array(learnt).reshape(-1, 3)])
        for i, robot in enumerate(self._ugvs):
            if modes[i] != Mode.INTERVENING:
                desks[i] = Desk()
                continue
            seen = Observation(
                t=t, start=t + self._period, robot=robot, position=positions[i].copy(), target=self._targets[i],
                preset=self._presets[i], obstacles=obstacles, mapped=self._obstacles,
                others=np.delete(positions, i, axis=0), safe_distance=self._safe_distance,
                refusals=desks[i].refusals,
            )  # fmt: skip
            desk, failed = self._database.plan(desks[i], seen, refused=refused[i], learnt=bool(fresh))
            faults += failed
            if desk.proposal is not None and desk.proposal is not desks[i].proposal:
                sent.append((i, desk.proposal))
            desks[i] = desk
        new = PlannerMemory(tuple(desks), learnt, tuple(sent), tuple(faults))
        state.get_mutable_abstract_state(int(self._memory)).set_value(new)
        return EventStatus.Succeeded()
