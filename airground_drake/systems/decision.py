"""The decision layer: the decision variable of (15) and the event trigger (20)."""

from __future__ import annotations

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
        size = 3 * self._count
        error = (self._reference.Eval(context)[:size] - self._position.Eval(context)[:size]).reshape(-1, 3)
        output.SetFromVector(np.sqrt(np.einsum("ij,ij->i", error, error)) + self._noise.Eval(context))


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
        self._witnesses = [self._make_witnesses(j) for j in range(count)]

    def _make_witnesses(self, j: int) -> dict[Mode, WitnessFunction]:
        def above_threshold(context: Context) -> float:
            return float(self._x.Eval(context)[j]) - self._trigger.zeta

        def above_release(context: Context) -> float:
            return float(self._x.Eval(context)[j]) - self._trigger.release

        def after_dwell(context: Context) -> float:
            return context.get_time() - self._trigger.dwell_end(_unpack(context.get_discrete_state_vector().value(), j))

        def event(transition: Mode) -> UnrestrictedUpdateEvent:
            def update(context: Context, _: UnrestrictedUpdateEvent, state: State) -> EventStatus:
                self._move(context, state, j, transition)
                return EventStatus.Succeeded()

            return UnrestrictedUpdateEvent(update)

        up, down = WitnessFunctionDirection.kNegativeThenNonNegative, WitnessFunctionDirection.kPositiveThenNonPositive
        return {
            Mode.SUPERVISING: self.MakeWitnessFunction(f"rise {j}", up, above_threshold, event(Mode.SUPERVISING)),
            Mode.INTERVENING: self.MakeWitnessFunction(f"fall {j}", down, above_release, event(Mode.INTERVENING)),
            Mode.REFRACTORY: self.MakeWitnessFunction(f"dwell {j}", up, after_dwell, event(Mode.REFRACTORY)),
        }

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        """The one event that can end each UGV's present mode."""
        modes = context.get_discrete_state_vector().value()[::FIELDS]
        return [self._witnesses[j][Mode(int(mode))] for j, mode in enumerate(modes)]

    def _start(self, context: Context, state: State) -> EventStatus:
        x = self._x.Eval(context)
        t = context.get_time()
        packed = _pack([self._trigger.start(t, float(x[j])) for j in range(self._count)])
        state.get_mutable_discrete_state().set_value(0, packed)
        return EventStatus.Succeeded()

    def _move(self, context: Context, state: State, j: int, ended: Mode) -> None:
        t = context.get_time()
        values = state.get_mutable_discrete_state().get_mutable_value(0)
        before = _unpack(values, j)
        if ended is Mode.SUPERVISING:
            after = self._trigger.rise(before, t)
        elif ended is Mode.INTERVENING:
            after = self._trigger.fall(before, t)
        else:
            after = self._trigger.recover(before, t, float(self._x.Eval(context)[j]))
        values[FIELDS * j : FIELDS * (j + 1)] = _pack([after])


def _pack(states: list[TriggerState]) -> np.ndarray:
    return np.array([[s.mode, s.triggers, s.triggered_at, s.released_at] for s in states], dtype=float).ravel()


def _unpack(values: np.ndarray, j: int) -> TriggerState:
    mode, triggers, triggered_at, released_at = values[FIELDS * j : FIELDS * (j + 1)]
    return TriggerState(Mode(int(mode)), int(triggers), float(triggered_at), float(released_at))
