"""The event trigger (20) as an automaton with hysteresis and a minimum inter-event time.

    SUPERVISING  -- x rises to zeta --------------------------------> INTERVENING   (a trigger)
    INTERVENING  -- x falls to release, dwell over -----------------> SUPERVISING   (a release)
    INTERVENING  -- x falls to release, dwell not over -------------> REFRACTORY    (a release)
    REFRACTORY   -- dwell over, x < zeta ---------------------------> SUPERVISING
    REFRACTORY   -- dwell over, x >= zeta --------------------------> INTERVENING   (a trigger)

The dwell is the minimum inter-event time since the last trigger, so two triggers are never closer than it,
for any noise. The paper's bare threshold is the same automaton with release = zeta and no dwell.

Compiled, and written once: on a `Status` of four numbers per UGV and on the levels (zeta, m, release, m, dwell, s).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit

SUPERVISING, INTERVENING, REFRACTORY = 0, 1, 2  # modes, as numba takes them
# Entries of a status: the mode, the number of triggers, the times of the last trigger and of the last release, s, -1
# before the first.
MODE, TRIGGERS, TRIGGERED, RELEASED = 0, 1, 2, 3
FIELDS = 4
NEW = (0.0, 0.0, -1.0, -1.0)  # a status before the first event


@njit(cache=True)
def rise(status: Array, t: float) -> None:
    """A trigger at time t, s; `status` (4,), in place."""
    status[MODE], status[TRIGGERS], status[TRIGGERED] = INTERVENING, status[TRIGGERS] + 1.0, t


@njit(cache=True)
def begin(status: Array, t: float, x: Array, levels: Array) -> None:
    """Initialise at a time, s: UGVs at or above the threshold trigger at once; `status` (4n,), in place."""
    for j in range(len(x)):
        if x[j] >= levels[0]:
            rise(status[FIELDS * j : FIELDS * (j + 1)], t)


@njit(cache=True)
def step(status: Array, t: float, x: float, levels: Array) -> None:
    """The transition that is due at time t, s, with decision variable x, m, if any; `status` (4,), in place."""
    zeta, release, dwell = levels[0], levels[1], levels[2]
    over = t >= (status[TRIGGERED] + dwell if status[TRIGGERS] else 0.0)
    if status[MODE] == SUPERVISING:
        if x >= zeta:
            rise(status, t)
    elif status[MODE] == INTERVENING:
        if x <= release and x < zeta:  # bare: while x >= zeta
            status[MODE], status[RELEASED] = SUPERVISING if over else REFRACTORY, t
    elif over:
        if x >= zeta:
            rise(status, t)
        else:
            status[MODE] = SUPERVISING


@njit(cache=True)
def transitions_due(status: Array, t: float, spans: Array, levels: Array) -> Flags:
    """UGVs with a due transition, (n,), from the range of x since the step began: least, then largest, (2n,), m."""
    zeta, release, dwell = levels[0], levels[1], levels[2]
    n = len(spans) // 2
    due = np.zeros(n, dtype=np.bool_)
    for j in range(n):
        mode, triggers, triggered = status[FIELDS * j], status[FIELDS * j + 1], status[FIELDS * j + 2]
        if mode == SUPERVISING:
            due[j] = spans[n + j] >= zeta
        elif mode == INTERVENING:
            due[j] = spans[j] <= release and spans[j] < zeta
        else:
            due[j] = t >= (triggered + dwell if triggers else 0.0)
    return due


@njit(cache=True)
def are_numbers(spans: Array) -> bool:
    """Whether no entry is NaN; comparisons with a level would ignore NaN."""
    return not np.isnan(spans).any()


@njit(cache=True)
def anything_due(status: Array, t: float, spans: Array, levels: Array) -> bool:
    """Whether a transition is due for any UGV, see `transitions_due`."""
    return bool(transitions_due(status, t, spans, levels).any())


@njit(cache=True)
def advance(status: Array, t: float, x: Array, spans: Array, levels: Array) -> None:
    """Make the transitions that became due in a step which ends at time t, s, with x (n,), m; `status` in place."""
    n = len(x)
    due = transitions_due(status, t, spans, levels)
    for j in range(n):
        if not due[j]:
            continue
        own = status[FIELDS * j : FIELDS * (j + 1)]
        before = own[MODE]
        seen = spans[n + j] if before == SUPERVISING else spans[j] if before == INTERVENING else x[j]
        step(own, t, seen, levels)
        if own[MODE] != before:  # x may have crossed back already
            step(own, t, x[j], levels)


class Mode(IntEnum):
    """What the UAV does for one UGV."""

    SUPERVISING = SUPERVISING
    INTERVENING = INTERVENING
    REFRACTORY = REFRACTORY


@dataclass(frozen=True)
class TriggerState:
    """State of the automaton for one UGV; times are -1 s before the first trigger or release."""

    mode: Mode = Mode.SUPERVISING
    triggers: int = 0
    triggered_at: float = -1.0
    released_at: float = -1.0

    @classmethod
    def of(cls, status: Array) -> Self:
        """The state of a compiled status, (4,)."""
        mode, triggers, *times = status.tolist()
        return cls(Mode(int(mode)), int(triggers), *times)

    @property
    def status(self) -> Array:
        """The compiled status, (4,)."""
        return np.array([self.mode, self.triggers, self.triggered_at, self.released_at], dtype=np.float64)


@dataclass(frozen=True)
class Trigger:
    """The automaton's parameters, and its transitions for one UGV.

    With release = zeta and no dwell it is the paper's trigger (20), which intervenes exactly while x >= zeta.

    Attributes:
        zeta: decision threshold, m.
        release: level at which an intervention ends, m, at most zeta.
        dwell: minimum inter-event time, s.
    """

    zeta: float
    release: float
    dwell: float

    def __post_init__(self) -> None:
        if not (self.zeta > 0.0 and self.release <= self.zeta and self.dwell >= 0.0):
            raise ValueError(f"a trigger needs zeta > 0, release <= zeta and dwell >= 0, got {self}")

    @property
    def levels(self) -> Array:
        """The levels for the compiled automaton, (3,)."""
        return np.array([self.zeta, self.release, self.dwell], dtype=np.float64)

    def start(self, t: float, x: float) -> TriggerState:
        """State at the initial time: already at or above the threshold triggers at once."""
        status = np.array(NEW)
        begin(status, t, np.array([x], dtype=np.float64), self.levels)
        return TriggerState.of(status)

    def step(self, state: TriggerState, t: float, x: float) -> TriggerState:
        """State after an event at time t, s, with the decision variable x, m: the transition that is due, if any."""
        status = state.status
        step(status, t, x, self.levels)
        return TriggerState.of(status)

    def dwell_end(self, state: TriggerState) -> float:
        """Earliest time of the next trigger, s."""
        return state.triggered_at + self.dwell if state.triggers else 0.0
