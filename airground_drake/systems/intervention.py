"""The UAV's planner: proposals for the UGVs that the trigger has flagged."""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from airground_drake.decision.excursion import INTERVENING
from airground_drake.intervention.planner import Planner, PlannerMemory, sent_after
from airground_drake.systems.decision import FIELDS
from airground_drake.systems.lifetime import weakly
from airground_drake.systems.ticks import Ticks


class InterventionPlanner(LeafSystem):
    """Supervises every UGV; for those in mode INTERVENING the `Planner` makes proposals, (12)-(14).

    The system numbers the proposals itself, see `sent_after`.

    Ports (n UGVs):
        in  `team_position` (3(n+1)) m; `status` (4n) from EventTrigger; `answers` (2n) and `reports`
            (abstract), see `messages`.
        out `proposals` abstract, n of Proposal or None.
    Rate: one update per planning period, from t = 0. A proposal can act one period after it is made.
    """

    def __init__(self, planner: Planner, control_period: float | None = None) -> None:
        """Declare ports, state and the periodic update; the controllers' period in s (default: the planner's)."""
        super().__init__()
        self._planner = planner
        n = len(planner.ugvs)
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._status = self.DeclareVectorInputPort("status", FIELDS * n)
        self._answers = self.DeclareVectorInputPort("answers", 2 * n)
        self._reports = self.DeclareAbstractInputPort("reports", Value(object()))
        held = self.DeclareAbstractState(Value(planner.start()))
        self._memory = int(held)
        self.DeclareAbstractOutputPort(
            "proposals",
            lambda: Value(object()),
            weakly(self._calc_proposals),
            prerequisites_of_calc={self.abstract_state_ticket(held)},
        )
        self._ticks = Ticks(planner.period, planner.period if control_period is None else control_period)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._ticks.period, 0.0, weakly(self._update))

    def memory(self, context: Context) -> PlannerMemory:
        """What was sent and what went wrong, up to the context's time."""
        memory: PlannerMemory = context.get_abstract_state(self._memory).get_value()
        return memory

    def close(self) -> None:
        """End the processes of policies that have one; the next run starts them anew."""
        self._planner.database.close()

    def _calc_proposals(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.memory(context).proposals)

    def _update(self, context: Context, state: State) -> EventStatus:
        if not self._ticks.due(context.get_time()):
            return EventStatus.DidNothing()
        before, positions = self.memory(context), self._position.Eval(context).reshape(-1, 3)
        memory = self._planner.watch(before, context.get_time(), positions)
        intervening = [mode == INTERVENING for mode in self._status.Eval(context)[::FIELDS].tolist()]
        if any(intervening) or any(memory.proposals):
            answers, reports = self._answers.Eval(context), self._reports.Eval(context)
            memory = self._planner.plan(memory, context.get_time(), positions, intervening, answers, reports)
        if memory is before:
            return EventStatus.DidNothing()
        memory = sent_after(before, memory, context.get_time())
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        return EventStatus.Succeeded()
