"""Patience and tracking that are broken, each in its way: LIVE-WAIT and LIVE-GATE must refute them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from airground_drake.gatekeeper.patience import Patience, Turn
from airground_drake.verify.claim import Mutant
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.patience.live_gate import judge as judge_tracking
from airground_drake.verify.model.patience.live_wait import judge
from airground_drake.verify.model.patience.tracking_obligations import Tracking


class NeverExhausted(Patience):
    """One try more than all."""

    def exhausted(self, turn: Turn) -> bool:
        """Only above."""
        return turn.tries > self.most


class RestsAtOnce(Patience):
    """Tries count anew as soon as the UGV is on its own."""

    def rested(self, turn: Turn, t: float) -> Turn:
        """Whatever the time."""
        return turn if turn.executing else replace(turn, tries=0)


class Endless(Patience):
    """A try lasts as long as its motion."""

    def accept(self, turn: Turn, t: float, end: float) -> Turn:
        """To the end."""
        return replace(super().accept(turn, t, end), until=end)


class DoesNotCount(Patience):
    """Acceptances are not counted."""

    def accept(self, turn: Turn, t: float, end: float) -> Turn:
        """Without counting."""
        return replace(super().accept(turn, t, end), tries=turn.tries)


class NeverOver(Patience):
    """What is executed is never over."""

    def over(self, turn: Turn, t: float) -> bool:
        """Never."""
        return False


class NeverLate(Patience):
    """Progress is not watched."""

    def late(self, on_time: float, t: float) -> bool:
        """Never."""
        return False


class LateAtOnce(Patience):
    """Late whenever it is asked."""

    def late(self, on_time: float, t: float) -> bool:
        """However short the time."""
        return t - on_time > -self.behind


def _waiting(kind: type[Patience]) -> Callable[[dict[str, Any]], Finding]:
    return lambda inputs: judge(kind, inputs)


def _tracking(kind: type[Patience] = Patience, **changes: str) -> Callable[[dict[str, Any]], Finding]:
    return lambda inputs: judge_tracking(Tracking(**changes), kind, inputs)


MUTANTS: tuple[Mutant, ...] = (
    Mutant("LIVE-GATE", "a disturbance twice as large", _tracking(disturbance="2*g*r")),
    Mutant("LIVE-GATE", "differences do not contract", _tracking(contraction="1")),
    Mutant("LIVE-GATE", "a direction left to an own task of half the gain", _tracking(contraction="1 - g*h/2")),
    Mutant("LIVE-GATE", "no room for the lag", _tracking(room="v*h")),
    Mutant("LIVE-GATE", "no room to stop", _tracking(room="r")),
    Mutant("LIVE-GATE", "late at once", _tracking(LateAtOnce)),
    Mutant("LIVE-WAIT", "one try more than all", _waiting(NeverExhausted)),
    Mutant("LIVE-WAIT", "tries count anew without a rest", _waiting(RestsAtOnce)),
    Mutant("LIVE-WAIT", "a try lasts as long as its motion", _waiting(Endless)),
    Mutant("LIVE-WAIT", "acceptances are not counted", _waiting(DoesNotCount)),
    Mutant("LIVE-WAIT", "what is executed is never over", _waiting(NeverOver)),
    Mutant("LIVE-WAIT", "progress is not watched", _waiting(NeverLate)),
)
"""Each to be refuted by a state from which a step leads out of the invariant."""
