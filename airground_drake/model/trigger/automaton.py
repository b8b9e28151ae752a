"""The event trigger (20) as an automaton with hysteresis and a minimum inter-event time.

    SUPERVISING  -- x rises to zeta --------------------------------> INTERVENING   (a trigger)
    INTERVENING  -- x falls to release, dwell over -----------------> SUPERVISING   (a release)
    INTERVENING  -- x falls to release, dwell not over -------------> REFRACTORY    (a release)
    REFRACTORY   -- dwell over, x < zeta ---------------------------> SUPERVISING
    REFRACTORY   -- dwell over, x >= zeta --------------------------> INTERVENING   (a trigger)

The dwell is the minimum inter-event time since the last trigger, so two triggers are never closer than it,
for any noise. The paper's bare threshold is the same automaton with release = zeta and no dwell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum


class Mode(IntEnum):
    """What the UAV does for one UGV."""

    SUPERVISING = 0
    INTERVENING = 1
    REFRACTORY = 2


@dataclass(frozen=True)
class TriggerState:
    """State of the automaton for one UGV; times are -1 s before the first trigger or release."""

    mode: Mode = Mode.SUPERVISING
    triggers: int = 0
    triggered_at: float = -1.0
    released_at: float = -1.0


@dataclass(frozen=True)
class Trigger:
    """The automaton's parameters and transitions.

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

    @classmethod
    def bare(cls, zeta: float) -> Trigger:
        """The paper's trigger (20): intervening exactly while x >= zeta."""
        return cls(zeta=zeta, release=zeta, dwell=0.0)

    def start(self, t: float, x: float) -> TriggerState:
        """State at the initial time: already at or above the threshold triggers at once."""
        return self.rise(TriggerState(), t) if x >= self.zeta else TriggerState()

    def step(self, state: TriggerState, t: float, x: float) -> TriggerState:
        """State after an event at time t, s, with the decision variable x, m: the transition that is due, if any."""
        if state.mode is Mode.SUPERVISING and x >= self.zeta:
            return self.rise(state, t)
        if state.mode is Mode.INTERVENING and x <= self.release and x < self.zeta:  # bare: while x >= zeta
            return self.fall(state, t)
        if state.mode is Mode.REFRACTORY and t >= self.dwell_end(state):
            return self.recover(state, t, x)
        return state

    def rise(self, state: TriggerState, t: float) -> TriggerState:
        """x has risen to zeta at time t, s, while supervising: a trigger."""
        return replace(state, mode=Mode.INTERVENING, triggers=state.triggers + 1, triggered_at=t)

    def fall(self, state: TriggerState, t: float) -> TriggerState:
        """x has fallen to the release level at time t, s, while intervening: a release."""
        over = t >= self.dwell_end(state)
        return replace(state, mode=Mode.SUPERVISING if over else Mode.REFRACTORY, released_at=t)

    def recover(self, state: TriggerState, t: float, x: float) -> TriggerState:
        """The dwell is over at time t, s, while refractory; x, m, decides."""
        return self.rise(state, t) if x >= self.zeta else replace(state, mode=Mode.SUPERVISING)

    def dwell_end(self, state: TriggerState) -> float:
        """Earliest time of the next trigger, s."""
        return state.triggered_at + self.dwell if state.triggers else 0.0
