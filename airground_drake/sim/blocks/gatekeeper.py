"""The UGVs' side of an intervention: accept or refuse (methods (c), (d)), or always accept (method (b))."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import World
from airground_drake.sim.blocks.lifetime import declare_output, weakly
from airground_drake.sim.blocks.signals import (
    Messages,
    UgvGains,
    declare_bodies,
    declare_headings,
    declare_inbox,
    keep,
    no_reports,
)
from airground_drake.sim.blocks.ticks import Ticks
from airground_drake.uav.messages import Report
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import GatekeeperDecision
from airground_drake.ugv.desk import Desk, Obeying, obeyed, read, replied
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers, GatekeeperState, Inputs


class Gatekeeper(LeafSystem):
    """Decides at every sample about the proposal in force for each UGV, (21)-(29).

    Under method (c) each UGV predicts its own closed loop under both choices from what it senses (23), solves (26)
    through a route and answers by the first stage of the plan: see `ugv.mpc_gatekeeper`. Under (d) it judges the
    outcome and watches the progress: see `ugv.outcome_gatekeeper`. The answer goes to the UGV's controller and
    back to the UAV.

    Ports (n UGVs, r robots, M bodies that move):
        in  `bodies` (3M) m; `team_command` (3r) m/s, for the predicted motion of the other robots; `gains`, the
            `UgvGains` that the controllers run with; `proposals` abstract, n of Proposal or None. With unicycles
            `headings` (n), rad.
        out `answers` (2n) and `reports` (abstract), see `messages`; held.
        With a channel `inbox`, see `Downlink`, in place of `proposals`, which is an output for the controllers then;
        and an output `outbox`, all answers sent so far.
    State: abstract, a `GatekeeperState`, with all decisions of the run so far.
    Fixed at construction: horizon and weights of (25), margins, dwell, budget and patience; the gains are inputs.
    Rate: one update per gatekeeper period, from t = 0.
    """

    def __init__(
        self, gatekeepers: Gatekeepers, world: World, *, period: float, control: float, retry: float | None = None
    ) -> None:
        """Declare ports, state and the update every `period`, s; the controllers' period is `control`, s."""
        # retry: with a channel, after how long a refusal is repeated, s
        super().__init__()
        n = len(world.names("ugv"))
        self._gatekeepers, self._world = gatekeepers, world
        self._bodies, self._headings = declare_bodies(self, world), declare_headings(self, world)
        self._command = self.DeclareVectorInputPort("team_command", 3 * len(world.robots))
        self._gains = self.DeclareVectorInputPort("gains", len(UgvGains.get_fields()))
        self._retry = retry
        state = self.DeclareAbstractState(Value(GatekeeperState.empty(n, channel=retry is not None)))
        self._state = int(state)
        held = {self.abstract_state_ticket(state)}
        if retry is None:
            self._proposals = Messages(self, "proposals", n, Proposal)
        else:
            self._inbox = declare_inbox(self, n, held, lambda self, context: self._now(context).held)
        declare_output(self, "answers", 2 * n, lambda self, context: self._memory(context).answers, held)
        declare_output(self, "reports", no_reports(n), lambda self, context: self._memory(context).reports, held)
        self._ticks = Ticks(period, control)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._ticks.period, 0.0, weakly(self._update))

    @property
    def judges(self) -> str:
        """Name of the class that judges the proposals."""
        return self._gatekeepers.judges

    def decisions(self, context: Context) -> Sequence[GatekeeperDecision]:
        """All decisions up to the time of this Context."""
        return self._memory(context).made

    def _memory(self, context: Context) -> GatekeeperState:
        memory: GatekeeperState = context.get_abstract_state(self._state).get_value()
        return memory

    def desk(self, context: Context) -> Desk:
        """With a channel, what was read and answered up to the last sample."""
        return self._memory(context).desk or Desk.empty(0)

    def _now(self, context: Context) -> Desk:
        """The desk after reading all messages that have arrived."""
        return read(self.desk(context), self._inbox.Eval(context), context.get_time())

    def _update(self, context: Context, state: State) -> EventStatus:
        if not self._ticks.due(context.get_time()):
            return EventStatus.DidNothing()
        before = self._memory(context)
        desk = None if self._retry is None else self._now(context)
        proposals = self._proposals.Eval(context) if desk is None else desk.held
        positions = self._bodies.Eval(context).reshape(-1, 3)
        t = context.get_time()
        after = self._gatekeepers.repeated(t, proposals, positions, before)
        if after is before and desk is before.desk:
            return EventStatus.DidNothing()
        if after is None:
            velocities = self._world.velocities(t, self._command.Eval(context).reshape(-1, 3))
            law = self._gatekeepers.law.with_gains(*self._gains.Eval(context).tolist())
            headings = None if self._headings is None else self._headings.Eval(context)
            after = self._gatekeepers.sample(Inputs(t, proposals, positions, velocities, law, headings), before)
        if desk is not None and self._retry is not None:
            new = self._inbox.Eval(context)[len(self.desk(context).read_s) :]
            asked = {delivery.message.ugv for delivery in new}
            desk, sent = replied(desk, asked, after.answers, after.reports, after.sent, t, self._retry)
            after = replace(after, desk=desk, sent=sent)
        state.get_mutable_abstract_state(self._state).set_value(after)
        return EventStatus.Succeeded()


class DirectAcceptance(LeafSystem):
    """Method (b): every proposal is accepted at once.

    Ports (n UGVs): in `proposals` abstract; out `answers` (2n) and `reports` (abstract, always empty), see
    `messages`. With a channel as `Gatekeeper`.
    State: with a channel, an `Obeying`, updated every control period.
    """

    def __init__(self, count: int, *, channel_period: float | None = None) -> None:
        """Declare the ports for `count` UGVs; with a channel, `channel_period` is the controllers' period, s."""
        super().__init__()
        self._channel = channel_period is not None
        if channel_period is None:
            self._proposals = Messages(self, "proposals", count, Proposal)
            needs = {self._proposals.port.ticket()}
        else:
            state = self.DeclareAbstractState(Value(Obeying.empty(count)))
            self._state, held = int(state), {self.abstract_state_ticket(state)}
            self._inbox = declare_inbox(self, count, held, lambda self, context: self.desk(context).held, now=True)
            needs = {*held, self._inbox.ticket()}
            self.DeclarePeriodicUnrestrictedUpdateEvent(channel_period, 0.0, weakly(self._update))
        declare_output(self, "answers", 2 * count, type(self)._answers, needs)
        nothing = {self.nothing_ticket()}
        declare_output(self, "reports", no_reports(count), lambda self, context: (Report(),) * count, nothing)

    def desk(self, context: Context) -> Desk:
        """With a channel, what was read and answered up to the time of this Context."""
        return self._now(context).desk

    def _now(self, context: Context) -> Obeying:
        before: Obeying = context.get_abstract_state(self._state).get_value()
        return before.after(self._inbox.Eval(context))

    def _answers(self, context: Context) -> Array:
        held = self.desk(context).held if self._channel else self._proposals.Eval(context)
        return np.array(obeyed(held), dtype=np.float64)

    def _update(self, context: Context, state: State) -> EventStatus:
        return keep(state, self._state, self._now(context))
