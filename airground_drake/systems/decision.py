"""The decision layer: the decision variable of (15) and the event trigger (20)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    LeafSystem,
    State,
    UnrestrictedUpdateEvent,
    WitnessFunction,
    WitnessFunctionDirection,
)

from airground_drake.decision.trigger import Mode, Trigger, TriggerState

FIELDS = 4
"""Numbers of the trigger's state per UGV: mode, triggers, triggered_at, released_at."""


class DecisionVariable(LeafSystem):
    """x_j = ||rho_rd,j - rho_j|| + n_j, the solution of (15) with integrated noise n_j.

    Ports (n UGVs):
        in  `team_position` (3(n+1)) m; `reference` (6n), positions first; `noise` (n) m.
        out `decision_variable` (n) m, continuous in time.
    """

    def __init__(self, count: int) -> None:
        """Declare ports for `count` UGVs."""
        super().__init__()
        self._count = count
        self._position = self.DeclareVectorInputPort("team_position", 3 * (count + 1))
        self._reference = self.DeclareVectorInputPort("reference", 6 * count)
        self._noise = self.DeclareVectorInputPort("noise", count)
        self.DeclareVectorOutputPort(
            "decision_variable",
            count,
            self._calc,
            prerequisites_of_calc={self._position.ticket(), self._reference.ticket(), self._noise.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        # Evaluated several times a step, for few UGVs: plain floats are twice as fast as arrays here.
        reference, position = self._reference.Eval(context).tolist(), self._position.Eval(context).tolist()
        noise = self._noise.Eval(context).tolist()
        for j in range(self._count):
            axes = slice(3 * j, 3 * j + 3)
            output[j] = math.dist(reference[axes], position[axes]) + noise[j]


class EventTrigger(LeafSystem):
    """The automaton of `decision.trigger` for every UGV, its events isolated by witness functions.

    Between the simulator's steps positions, references and noise are linear in time, so x is convex there: it
    cannot rise above the threshold and fall back within a step, and no trigger is missed. The initial time is
    an event of its own: a UGV that starts at or above the threshold triggers at once. The Context needs an
    accuracy (`Context.SetAccuracy`), or events come at the ends of steps.

    Ports (n UGVs):
        in  `decision_variable` (n) m.
        out `status` (4n): per UGV mode (see Mode), number of triggers, time of the last trigger, s, and of
            the last release, s (-1 before the first).
    """

    def __init__(self, count: int, trigger: Trigger) -> None:
        """Declare ports, state and events for `count` UGVs."""
        super().__init__()
        self._trigger = trigger
        self._count = count
        self._x = self.DeclareVectorInputPort("decision_variable", count)
        status = self.DeclareDiscreteState(_pack([TriggerState()] * count))
        self.DeclareStateOutputPort("status", status)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._start)
        self._witnesses = self._make_witnesses()

    def _make_witnesses(self) -> dict[Mode, WitnessFunction]:
        """One witness per mode, over all UGVs in it: the first of them to leave it."""

        def below_threshold(context: Context) -> float:
            return self._trigger.zeta - max(self._in_mode(context, Mode.SUPERVISING))

        def above_release(context: Context) -> float:
            return min(self._in_mode(context, Mode.INTERVENING)) - self._trigger.release

        def before_dwell_end(context: Context) -> float:
            values = context.get_discrete_state_vector().value()
            states = [_unpack(values, j) for j in range(self._count)]
            ends = [self._trigger.dwell_end(state) for state in states if state.mode is Mode.REFRACTORY]
            return min(ends) - context.get_time()

        def make(mode: Mode, calc: Callable[[Context], float]) -> WitnessFunction:
            def update(context: Context, _: UnrestrictedUpdateEvent, state: State) -> EventStatus:
                self._leave(mode, context, state)
                return EventStatus.Succeeded()

            direction = WitnessFunctionDirection.kPositiveThenNonPositive
            return self.MakeWitnessFunction(f"leaves {mode.name}", direction, calc, UnrestrictedUpdateEvent(update))

        return {
            Mode.SUPERVISING: make(Mode.SUPERVISING, below_threshold),
            Mode.INTERVENING: make(Mode.INTERVENING, above_release),
            Mode.REFRACTORY: make(Mode.REFRACTORY, before_dwell_end),
        }

    def _in_mode(self, context: Context, mode: Mode) -> list[float]:
        """Decision variables of the UGVs in a mode, m."""
        status, x = context.get_discrete_state_vector().value().tolist(), self._x.Eval(context).tolist()
        return [x[j] for j in range(self._count) if status[FIELDS * j] == mode]

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        """The witnesses of the modes that some UGV is in."""
        modes = context.get_discrete_state_vector().value()[::FIELDS].tolist()
        return [witness for mode, witness in self._witnesses.items() if mode in modes]

    def _start(self, context: Context, state: State) -> EventStatus:
        x = self._x.Eval(context)
        t = context.get_time()
        packed = _pack([self._trigger.start(t, float(x[j])) for j in range(self._count)])
        state.get_mutable_discrete_state().set_value(0, packed)
        return EventStatus.Succeeded()

    def _leave(self, mode: Mode, context: Context, state: State) -> None:
        """Move every UGV whose time in the mode is over at this event; its witness has just crossed zero."""
        t, x = context.get_time(), self._x.Eval(context)
        values = state.get_mutable_discrete_state().get_mutable_value(0)
        for j in range(self._count):
            before = _unpack(values, j)
            if before.mode is mode:
                values[FIELDS * j : FIELDS * (j + 1)] = _pack([self._trigger.step(before, t, float(x[j]))])


def _pack(states: list[TriggerState]) -> np.ndarray:
    return np.array([[s.mode, s.triggers, s.triggered_at, s.released_at] for s in states], dtype=float).ravel()


def _unpack(values: np.ndarray, j: int) -> TriggerState:
    mode, triggers, triggered_at, released_at = values[FIELDS * j : FIELDS * (j + 1)]
    return TriggerState(Mode(int(mode)), int(triggers), float(triggered_at), float(released_at))
