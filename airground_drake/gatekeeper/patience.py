"""How long a UGV goes along with a UAV: the automaton of tries, progress and rest, one per UGV.

    ON ITS OWN  -- a proposal is accepted, tries < most -------------> EXECUTING    (a try)
    ON ITS OWN  -- on its own for `rest` s --------------------------> ON ITS OWN   (tries = 0)
    EXECUTING   -- withdrawn, over, or behind for too long ----------> ON ITS OWN

A try lasts no longer than `longest` s. With all tries used the UGV is exhausted: it refuses everything until it has
been on its own for `rest` s. So between two rests no UAV keeps it from its own task for longer than `most * longest` s
and what noticing the end of each try takes, whatever it sends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Turn:
    """State of the automaton for one UGV.

    Attributes:
        executing: whether an accepted proposal is executed.
        tries: acceptances since the last rest.
        since: when the UGV was last on its own, or began to be, s.
        until: when the accepted proposal is over, s.
    """

    executing: bool = False
    tries: int = 0
    since: float = 0.0
    until: float = 0.0


@dataclass(frozen=True)
class Patience:
    """The automaton's parameters and transitions.

    Attributes:
        most: tries between two rests.
        rest: time on its own after which the tries count anew, s.
        longest: time that a try may last, s.
        lag: by which the UGV may be farther from where it is to be than predicted, m.
        behind: time for which it may be more than that, s.
    """

    most: int
    rest: float
    longest: float
    lag: float
    behind: float

    def __post_init__(self) -> None:
        """Check the parameters.

        Raises:
            ValueError: if there is no try, or a time or the lag is not positive.
        """
        if not (self.most >= 1 and self.rest > 0.0 and self.longest > 0.0 and self.lag > 0.0 and self.behind > 0.0):
            raise ValueError(f"patience needs at least one try, and positive times and lag, got {self}")

    def rested(self, turn: Turn, t: float) -> Turn:
        """At time t, s: the tries count anew after a rest."""
        if not turn.executing and t >= turn.since + self.rest:
            return replace(turn, tries=0)
        return turn

    def exhausted(self, turn: Turn) -> bool:
        """Whether nothing is accepted before the next rest."""
        return turn.tries >= self.most

    def accept(self, turn: Turn, t: float, end: float) -> Turn:
        """At time t, s: a motion that ends at `end`, s, is accepted, by a UGV on its own that is not exhausted."""
        until = end if end <= t + self.longest else t + self.longest
        return replace(turn, executing=True, tries=turn.tries + 1, since=t, until=until)

    def stop(self, turn: Turn, t: float) -> Turn:
        """At time t, s: the UGV is on its own again."""
        return replace(turn, executing=False, since=t)

    def late(self, on_time: float, t: float) -> bool:
        """Whether a UGV that was last on time then, s, has been behind for too long at time t, s."""
        return t - on_time > self.behind

    def over(self, turn: Turn, t: float) -> bool:
        """Whether the time of what is executed is over at time t, s."""
        return t >= turn.until
