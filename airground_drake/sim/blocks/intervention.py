"""The UAVs' planners: proposals for the UGVs that the trigger has flagged."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem, State

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.bodies.world import World
from airground_drake.model.trigger.automaton import FIELDS, INTERVENING
from airground_drake.sim.blocks.lifetime import declare_cached, declare_output, weakly
from airground_drake.sim.blocks.signals import Messages, components_of, declare_bodies, no_proposals
from airground_drake.sim.blocks.ticks import Ticks
from airground_drake.uav.channel import Transit
from airground_drake.uav.database import BehaviourDatabase
from airground_drake.uav.halts import NOT_WATCHED, room, standing, watched
from airground_drake.uav.messages import Report, Reports, sightings
from airground_drake.uav.outbox import answers_heard
from airground_drake.uav.planner import Instant, Planner, PlannerState, sent_after
from airground_drake.uav.policy import Proposal


class _Ahead(list[PlannerState | None]):
    """The result of planning ahead of an update; empty without one."""


class InterventionPlanner(LeafSystem):
    """Supervises every UGV; for those in mode INTERVENING the `Planner` makes proposals, (12)-(14).

    The system numbers the proposals: see `sent_after`. What a policy remembers is in the Context, unless it has a
    process of its own (`guest.process`) or keeps it in attributes other than `Policy.remembered`.

    Ports (n UGVs, M bodies that move):
        in  `bodies` (3M) m; `status` (4n) from EventTrigger; `answers` (2n) and `reports`
            (abstract), see `messages`. With several UAVs `proposals` of all of them (see `AllProposals`).
        out `proposals` abstract, n of Proposal or None.
        With a channel `heard`, see `Uplink`, in place of answers and reports, and `sent`, the `PlannerState`, in place
        of `proposals`; with several UAVs beside it.
    State: the last resting place of each UGV and since when, see `halts`; abstract, a `PlannerState`.
    Rate: one update per planning period, from t = 0. A proposal can act one period after it is made.
    """

    def __init__(
        self, planner: Planner, world: World, control_period: float, *, channel: bool = False, alone: bool = True
    ) -> None:
        """Declare ports, state and the periodic update; the controllers' period is in s."""
        # alone: whether there is one UAV.
        super().__init__()
        self._planner, self._world = planner, world
        n = len(planner.ugvs)
        self._ugvs = components_of(world, "ugv")
        self._robots = world.select(*ROBOTS)
        self._bodies = declare_bodies(self, world)
        self._status = self.DeclareVectorInputPort("status", FIELDS * n)
        if channel:
            self._heard = self.DeclareAbstractInputPort("heard", Value(Transit()))
        else:
            self._answers = self.DeclareVectorInputPort("answers", 2 * n)
            self._reports = Messages(self, "reports", n, Report)
        self._channel = channel
        self._others = None if alone else Messages(self, "proposals", n, Proposal)
        held = self.DeclareAbstractState(Value(planner.start()))
        self._memory = int(held)
        remembers = {self.abstract_state_ticket(held)}
        if channel:
            declare_output(self, "sent", Value(planner.start()), type(self).memory, remembers)
        if not (channel and alone):
            sent = no_proposals(n)
            declare_output(self, "proposals", sent, lambda self, context: self.memory(context).proposals, remembers)
        # Drake empties this slot of the Context when time, state or an input changes
        needs = {self.all_sources_ticket()}
        self._ahead = declare_cached(self, "planned ahead", _Ahead(), lambda *_: _Ahead(), needs)
        self._slept: tuple[PlannerState | None, tuple[Any, ...], float] = None, (), 0.0
        self._ticks = Ticks(planner.period, control_period)
        self._room = room(planner.max_speed)
        self.DeclareDiscreteState(np.tile([0.0, 0.0, 0.0, NOT_WATCHED], n))
        self.DeclarePeriodicDiscreteUpdateEvent(self._ticks.period, 0.0, weakly(self._watch))
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._ticks.period, 0.0, weakly(self._update))

    def memory(self, context: Context) -> PlannerState:
        """Proposals sent and faults met, up to the context's time."""
        memory: PlannerState = context.get_abstract_state(self._memory).get_value()
        return memory

    @property
    def database(self) -> BehaviourDatabase:
        """The policies."""
        return self._planner.database

    def _watch(self, context: Context, discrete: DiscreteValues) -> EventStatus:
        if not self._ticks.due(context.get_time()):
            return EventStatus.DidNothing()
        discrete.set_value(0, self._halts(context))
        return EventStatus.Succeeded()

    def _halts(self, context: Context) -> Array:
        before = context.get_discrete_state(0).value().copy()
        return watched(before, context.get_time(), self._bodies.Eval(context)[self._ugvs], self._room)

    def _update(self, context: Context, state: State) -> EventStatus:
        ahead: _Ahead = self.get_cache_entry(self._ahead).Eval(context)
        memory = ahead[0] if ahead else self._planned(context)
        if memory is None:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        return EventStatus.Succeeded()

    def plan_ahead(self, context: Context) -> None:
        """Plan for the instant of a context, before the update of that instant, which then takes this result."""
        # So a step-wise environment sees what the policies are asked. If it is called again, the last result counts.
        self.get_cache_entry(self._ahead).Eval(context)[:] = [self._planned(context)]

    def _answered(self, context: Context) -> tuple[Array, Reports]:
        """The UGVs' answers, (2n,), and reports that the UAV has received."""
        if not self._channel:
            return self._answers.Eval(context), self._reports.Eval(context)
        answers, reports = answers_heard(self._heard.Eval(context), range(len(self._planner.ugvs)))
        return np.array(answers), reports

    def _asleep_until(self, memory: PlannerState, *given: Any) -> float:
        """`Planner.asleep_until`, computed when an argument changes."""
        if memory is not self._slept[0] or given != self._slept[1]:
            self._slept = memory, given, self._planner.asleep_until(memory, *given)
        return self._slept[2]

    def _planned(self, context: Context) -> PlannerState | None:
        """The memory after planning at the context's time; None at other times, or if nothing changes."""
        t = context.get_time()
        if not self._ticks.due(t):
            return None
        before = self.memory(context)
        if t >= self._planner.lost_at - SAME_S:
            return self._planner.lost(before, t)
        intervening = [mode == INTERVENING for mode in self._status.Eval(context)[::FIELDS].tolist()]
        answers, reports = self._answered(context)
        if t < self._asleep_until(before, intervening, None if self._channel else answers.tolist(), reports):
            return None
        bodies = self._bodies.Eval(context).reshape(-1, 3)
        stands = standing(self._halts(context), t).tolist()  # of this instant: the state is updated after this
        moving = sightings(self._world, t, bodies)
        others = () if self._others is None else self._others.Eval(context)
        now = Instant(t, bodies[self._robots], intervening, answers, reports, stands, moving, others)
        return sent_after(before, self._planner.plan(before, now), t, self._planner.sender)


class AllProposals(LeafSystem):
    """The proposals of several UAVs, each to its own UGVs.

    Ports (n UGVs): in `proposals_<uav>`, out `proposals`, abstract, n of Proposal or None.
    """

    def __init__(self, uavs: Sequence[str], count: int) -> None:
        super().__init__()
        self._of_uavs = [Messages(self, f"proposals_{uav}", count, Proposal) for uav in uavs]
        needs = {messages.port.ticket() for messages in self._of_uavs}
        declare_output(self, "proposals", no_proposals(count), type(self)._proposals, needs)

    def _proposals(self, context: Context) -> tuple[Proposal | None, ...]:
        asked = zip(*(messages.Eval(context) for messages in self._of_uavs), strict=True)
        return tuple(next((one for one in of_ugv if one is not None), None) for of_ugv in asked)
