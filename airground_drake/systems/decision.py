"""The decision layer: the decision variable of (15) and the event trigger (20)."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    State,
    WitnessFunction,
    WitnessFunctionDirection,
)

from airground_drake.arrays import Array
from airground_drake.decision.excursion import (
    anything_due,
    excursions,
    extremes,
    gathered,
    task_errors,
    transitions_due,
)
from airground_drake.decision.trigger import Mode, Trigger, TriggerState
from airground_drake.nsbc.motion import Motion
from airground_drake.systems.lifetime import weakly

FIELDS = 4
"""Numbers of the trigger's state per UGV: mode, triggers, triggered_at, released_at."""

NOT_BEGUN = -1.0
"""Beginning of the run and of the step, s, before there is one."""

SHORTEST_S = 1e-9
"""Steps shorter than this are not looked into, s; what is due in one happens at its end. Ticks of different periods can
be one unit in the last place apart, and Drake cannot isolate anything in such a step: it stops instead."""


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
            weakly(self._calc),
            prerequisites_of_calc={self._position.ticket(), self._reference.ticket(), self._noise.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        # Evaluated several times a step, for few UGVs: plain floats are twice as fast as arrays here.
        wanted, there = iter(self._reference.Eval(context).tolist()), iter(self._position.Eval(context).tolist())
        noise = self._noise.Eval(context).tolist()
        away = map(math.dist, zip(wanted, wanted, wanted, strict=False), zip(there, there, there, strict=False))
        output.SetFromVector(list(map(float.__add__, noise, away)))


class EventTrigger(LeafSystem):
    """The automaton of `decision.trigger` for every UGV, its events isolated by a witness function.

    The witness looks at the whole step so far, not at its end: between the simulator's steps positions, references
    and noise are linear in time (but for corners of a preset), so that the least and the largest x since the step
    began are known exactly (`decision.excursion`). It changes its sign once a transition has become due anywhere in
    the step, and cannot change it back before the step ends: a dip below the release level and back within a step is
    isolated like any other crossing, and nothing is missed. At the isolated time the step ends, and the per-step
    update makes the transition; what is due at the beginning of a run, at once. The Context needs an accuracy
    (`Context.SetAccuracy`): without it Drake stops at the first event, or with fixed steps it comes at the end of one.
    A Simulator that is initialised in the middle of a run, such as one for a clone of its Context, goes on with it; one
    that is initialised again before its first step, or for an earlier time, begins anew.

    Ports (n UGVs):
        in  `team_position` (3(n+1)) m; `reference` (6n), positions first; `noise` (n) m.
        out `status` (4n): per UGV mode (see Mode), number of triggers, time of the last trigger, s, and of
            the last release, s (-1 before the first).
    State: the status; the beginning of the step: time, s, positions and references (3n each), m, and noise (n), m;
        the beginning of the run, s.
    Rate: one update per step of the simulator.
    """

    def __init__(self, count: int, trigger: Trigger, presets: Sequence[Motion] = ()) -> None:
        """Declare ports, state and events for `count` UGVs; the presets (default: none) tell where references bend."""
        super().__init__()
        self._trigger = trigger
        self._levels = (float(trigger.zeta), float(trigger.release), float(trigger.dwell))
        self._count = count
        self._presets = tuple(presets)
        corners = [(t, j) for j, preset in enumerate(self._presets) for t in preset.times.tolist()]
        self._corners = sorted(corners)
        self._corner_times = [t for t, _ in self._corners]
        self._position = self.DeclareVectorInputPort("team_position", 3 * (count + 1))
        self._reference = self.DeclareVectorInputPort("reference", 6 * count)
        self._noise = self.DeclareVectorInputPort("noise", count)
        status = self.DeclareDiscreteState(_pack([TriggerState()] * count))
        self.DeclareDiscreteState(np.array([NOT_BEGUN, *([0.0] * 7 * count)]))
        self.DeclareDiscreteState(np.array([NOT_BEGUN]))
        self.DeclareStateOutputPort("status", status)
        self.DeclareInitializationUnrestrictedUpdateEvent(weakly(self._start))
        self.DeclarePerStepDiscreteUpdateEvent(weakly(self.update))
        direction = WitnessFunctionDirection.kPositiveThenNonPositive
        self._witness = self.MakeWitnessFunction("a transition is due", direction, weakly(self.nothing_due))

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        """The one witness."""
        return [self._witness]

    def _signals(self, context: Context) -> Array:
        """Time, s, positions and references, m, and noise, m, of the UGVs now, (1 + 7n,)."""
        position, reference = self._position.Eval(context), self._reference.Eval(context)
        return gathered(context.get_time(), position, reference, self._noise.Eval(context))

    def _start(self, context: Context, state: State) -> EventStatus:
        now, discrete = self._signals(context), state.get_mutable_discrete_state()
        before, begun, run_begun = (discrete.value(k) for k in range(3))
        if run_begun[0] < begun[0] <= now[0]:  # another simulator goes on with a run
            discrete.set_value(0, self._after(before, now, now))
        else:
            t, x = float(now[0]), _norms(now)
            discrete.set_value(0, _pack([self._trigger.start(t, float(x[j])) for j in range(self._count)]))
            discrete.set_value(2, now[:1])
        discrete.set_value(1, now)
        return EventStatus.Succeeded()

    def nothing_due(self, context: Context) -> float:
        """The witness: 1 at the beginning of a step and until a transition is due in it, then -1."""
        begun = context.get_discrete_state(1).value()
        if context.get_time() - begun[0] < SHORTEST_S:
            return 1.0
        return -1.0 if self._anything_due(context.get_discrete_state(0).value(), begun, self._signals(context)) else 1.0

    def update(self, context: Context, discrete: DiscreteValues) -> EventStatus:
        """Make the transitions that have become due in the step that ends, and begin another: the per-step update."""
        now, begun, before = self._signals(context), *(context.get_discrete_state(k).value() for k in (1, 0))
        if self._anything_due(before, begun, now):
            discrete.set_value(0, self._after(before, begun, now))
        discrete.set_value(1, now)
        return EventStatus.Succeeded()

    def _after(self, before: Array, begun: Array, now: Array) -> Array:
        """Status once the transitions that became due in a step are made."""
        least, most = self._excursions(begun, now)
        status = before.reshape(-1, FIELDS).copy()
        t, x = float(now[0]), _norms(now)
        for j in np.flatnonzero(transitions_due(before, t, least, most, self._levels)):
            status[j] = _pack([self._moved(_unpack(status[j]), t, float(x[j]), float(least[j]), float(most[j]))])
        return status.ravel()

    def _anything_due(self, status: Array, begun: Array, now: Array) -> bool:
        if self._bends(begun, now):
            return bool(transitions_due(status, now[0], *self._excursions(begun, now), self._levels).any())
        return anything_due(status, begun, now, self._levels)

    def _moved(self, before: TriggerState, t: float, x: float, least: float, most: float) -> TriggerState:
        """State at the end of a step in which a transition became due: x now, and how far it went, m."""
        seen = {Mode.SUPERVISING: most, Mode.INTERVENING: least, Mode.REFRACTORY: x}[before.mode]
        after = self._trigger.step(before, t, seen)
        return after if after.mode is before.mode else self._trigger.step(after, t, x)  # x may have come back already

    def _bends(self, begun: Array, now: Array) -> list[tuple[float, int]]:
        """When references bend in a step, s, and whose."""
        return self._corners[bisect_right(self._corner_times, begun[0]) : bisect_right(self._corner_times, now[0])]

    def _excursions(self, begun: Array, now: Array) -> tuple[Array, Array]:
        """Least and largest x since the step began, (n,) each, m."""
        least, most = excursions(begun, now)
        corners = self._bends(begun, now)
        before, after = task_errors(begun), task_errors(now)
        for j in {robot for _, robot in corners}:
            times = [t for t, robot in corners if robot == j and t < now[0]]
            share = (np.array(times) - begun[0]) / (now[0] - begun[0])
            own = slice(1 + 3 * j, 4 + 3 * j)
            position = begun[own] + share[:, None] * (now[own] - begun[own])
            noise = before[j, 3] + share * (after[j, 3] - before[j, 3])
            bends = np.column_stack([self._presets[j].sample(np.array(times)) - position, noise])
            way = np.vstack([before[j], bends, after[j]])
            low, high = extremes(way[:-1], way[1:])
            least[j], most[j] = low.min(), high.max()
        return least, most


def _norms(signals: Array) -> Array:
    """x of every UGV, (n,), m."""
    return excursions(signals, signals)[0]


def _pack(states: Sequence[TriggerState]) -> Array:
    return np.array([[s.mode, s.triggers, s.triggered_at, s.released_at] for s in states], dtype=float).ravel()


def _unpack(values: Array) -> TriggerState:
    mode, triggers, triggered_at, released_at = values.tolist()
    return TriggerState(Mode(int(mode)), int(triggers), triggered_at, released_at)
