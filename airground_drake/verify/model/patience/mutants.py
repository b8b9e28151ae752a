"""Patience that is broken, each in its way: LIVE-WAIT must refute it."""

from __future__ import annotations

from dataclasses import replace

from airground_drake.gatekeeper.patience import Patience, Turn
from airground_drake.verify.claim import Mutant
from airground_drake.verify.model.patience.live_wait import judge


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


MUTANTS: tuple[Mutant, ...] = tuple(
    Mutant("LIVE-WAIT", says, lambda inputs, kind=kind: judge(kind, inputs))  # type: ignore[misc]
    for says, kind in (
        ("one try more than all", NeverExhausted),
        ("tries count anew without a rest", RestsAtOnce),
        ("a try lasts as long as its motion", Endless),
        ("acceptances are not counted", DoesNotCount),
        ("what is executed is never over", NeverOver),
        ("progress is not watched", NeverLate),
    )
)
"""Broken automata, each to be refuted by a state from which a transition leads out of the invariant."""
