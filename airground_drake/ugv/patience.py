"""The limits of following a UAV: the automaton of tries and rests, one per UGV.

    ON ITS OWN  -- a proposal is accepted, tries < most -------------> EXECUTING    (a try)
    ON ITS OWN  -- on its own for `rest` s --------------------------> ON ITS OWN   (tries = 0)
    EXECUTING   -- withdrawn, over, or not worth it any more --------> ON ITS OWN

A try lasts no longer than `longest` s. With all tries used the UGV is exhausted: it refuses everything until it has
been on its own for `rest` s. So between two rests no UAV, whatever it sends, keeps the UGV from its own task for longer
than `most * longest` s plus one sampling period per try, in which the UGV notices the end.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Commitment:
    """A UGV's state of the automaton.

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
    """

    most: int
    rest: float
    longest: float

    def rested(self, now: Commitment, t: float) -> Commitment:
        """The state at time t, s: after a rest, tries are reset."""
        if now.tries and not now.executing and t >= now.since + self.rest:
            return replace(now, tries=0)
        return now

    def exhausted(self, now: Commitment) -> bool:
        """Whether the UGV accepts nothing before the next rest."""
        return now.tries >= self.most

    def accept(self, now: Commitment, t: float, end: float) -> Commitment:
        """The state after accepting, at time t, s, a motion that ends at `end`, s (on its own, not exhausted)."""
        return replace(now, executing=True, tries=now.tries + 1, since=t, until=min(t + self.longest, end))

    def stop(self, now: Commitment, t: float) -> Commitment:
        """The state after a proposal ends at time t, s: the UGV is on its own."""
        return replace(now, executing=False, since=t)

    def over(self, now: Commitment, t: float) -> bool:
        """Whether the time of the executed proposal is over at time t, s."""
        return t >= now.until
