"""The channel between UAVs and their UGVs, as two LeafSystems.

A link's output is computed from its state, its input and the time; the update at each control period stores the same.
So a link without delay and loss adds no delay, not even a period.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import nan

from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from airground_drake.base.history import History, Immutable
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.sim.blocks.lifetime import declare_cached, declare_output, weakly
from airground_drake.sim.blocks.signals import keep
from airground_drake.uav.channel import Link, Transit
from airground_drake.uav.outbox import Outbox, posted, repeated
from airground_drake.uav.planner import PlannerState


@dataclass(frozen=True)
class Down(Immutable):
    """The state of the link from UAVs."""

    box: Outbox = field(default_factory=Outbox)
    transit: Transit = field(default_factory=Transit)
    # when its UAV read each answer that arrived, s, in the order of arrival; NaN: never
    read_s: History[float] = field(default_factory=History)


class Downlink(LeafSystem):
    """The link from UAVs to their UGVs, with repetition of messages until an answer shows that they were read.

    Ports: in `sent`, the planner's memory, with several UAVs one of each, `sent_<uav>`; `heard`, see `Uplink`, used by
    updates only; out `inbox`, all deliveries so far, in the order of arrival.
    State: abstract, a `Down`.
    Rate: one update per control period, from t = 0.
    """

    def __init__(
        self, link: Link, sent: Iterable[str], start: PlannerState, period: float, retry: float, lost: Sequence[float]
    ) -> None:
        """Declare the ports; `sent` names those of the UAVs; a message is repeated after `retry`, s."""
        # lost: per UGV, from when on its UAV is lost, s; infinite: never
        super().__init__()
        self._link, self._retry, self._lost = link, retry, lost
        self._sent = [self.DeclareAbstractInputPort(name, Value(start)) for name in sent]
        self._heard = self.DeclareAbstractInputPort("heard", Value(Transit()))
        held = self.DeclareAbstractState(Value(Down()))
        self._state = int(held)
        needs = {self.abstract_state_ticket(held), *(port.ticket() for port in self._sent), self.time_ticket()}
        self._now = declare_cached(self, "now", Down(), type(self)._arrived, needs)
        declare_output(self, "inbox", Value(()), lambda self, context: self.now(context).transit.arrived, needs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, weakly(self._update))

    def now(self, context: Context) -> Down:
        """The link at the time of this Context."""
        state: Down = self.get_cache_entry(self._now).Eval(context)
        return state

    def _arrived(self, context: Context) -> Down:
        before: Down = context.get_abstract_state(self._state).get_value()
        box = posted(before.box, [port.Eval(context) for port in self._sent])
        return self._carried(before, box, context.get_time())

    def _carried(self, before: Down, box: Outbox, t: float) -> Down:
        transit = self._link.carry(before.transit, box.messages, t)
        if box is before.box and transit is before.transit:
            return before
        return replace(before, box=box, transit=transit)

    def _update(self, context: Context, state: State) -> EventStatus:
        t = context.get_time()
        now, heard = self.now(context), self._heard.Eval(context)
        left = {ugv for ugv, lost_s in enumerate(self._lost) if t >= lost_s - SAME_S}
        after = self._carried(now, repeated(now.box, heard, t, self._retry, left), t)
        unread = heard.arrived[len(now.read_s) :]
        if unread:
            read_s = [nan if delivery.message.ugv in left else t for delivery in unread]
            after = replace(after, read_s=now.read_s.plus(read_s))
        return keep(state, self._state, after)


class Uplink(LeafSystem):
    """The link from UGVs to their UAVs.

    Ports: in `outbox`, all answers sent so far; out `heard`, the state of the link.
    State: abstract, a `Transit`.
    Rate: one update per control period, from t = 0.
    """

    def __init__(self, link: Link, period: float) -> None:
        super().__init__()
        self._link = link
        self._outbox = self.DeclareAbstractInputPort("outbox", Value(()))
        held = self.DeclareAbstractState(Value(Transit()))
        self._state, needs = int(held), {self.abstract_state_ticket(held), self._outbox.ticket(), self.time_ticket()}
        self._heard = declare_output(self, "heard", Value(Transit()), type(self)._arrived, needs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, weakly(self._update))

    def now(self, context: Context) -> Transit:
        """The link at the time of this Context."""
        state: Transit = self._heard.Eval(context)
        return state

    def _arrived(self, context: Context) -> Transit:
        before: Transit = context.get_abstract_state(self._state).get_value()
        return self._link.carry(before, self._outbox.Eval(context), context.get_time())

    def _update(self, context: Context, state: State) -> EventStatus:
        return keep(state, self._state, self.now(context))
