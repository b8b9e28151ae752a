"""Joint plans: robots one after the other, in many orders (prioritised planning), as far as a budget goes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airground_drake.intervention.coordination.roadmap import Errand, Space, weave
from airground_drake.intervention.coordination.single import Body, Mover, Way, find
from airground_drake.intervention.coordination.smoothing import smooth
from airground_drake.intervention.coordination.timed import at_rest

MOST_ORDERS = 30
"""Orders of the robots that are tried at most."""
MOST_SEARCHES = 240
"""Ways of single robots that are looked for at most: fewer orders of a large team."""
LEAVING = 2.0
"""A robot may need its place for as long as it travels this many times the distance that robots keep."""
LATER_ORDERS = 3
"""Orders that are tried after one in which every robot finds a way, for a better one."""


@dataclass(frozen=True)
class Effort:
    """What a plan may cost, in counts, so that it is the same on every machine.

    Attributes:
        orders: of the robots.
        searches: of single robots, in all orders together.
        expansions: of safe intervals, in all searches together; a quarter of them is kept for a partial plan.
    """

    orders: int = MOST_ORDERS
    searches: int = MOST_SEARCHES
    expansions: int = 400_000


@dataclass(frozen=True, eq=False)
class Plan:
    """A joint plan.

    Attributes:
        ways: one per robot; None: it stays where it is.
        orders: that were tried.
        expansions: that were made.
    """

    ways: tuple[Way | None, ...]
    orders: int
    expansions: int

    @property
    def complete(self) -> bool:
        """Whether every robot has a way."""
        return None not in self.ways


def plan(
    space: Space,
    errands: Sequence[Errand],
    speeds: Sequence[float],
    fixed: Sequence[Body] = (),
    *,
    follow: float = math.inf,
    effort: Effort | None = None,
) -> Plan:
    """Ways for some robots that keep away from discs, from each other, and from others whose motions are fixed.

    Each robot is planned for among those before it. Where one finds no way, those before it are made to leave the
    later ones' places alone until these can have left them; then the one that found none comes first in the next
    order, and where that has been tried, the orders are drawn (always the same ones). If no order serves, the robots
    that find none stay where they are, and the others go round them.

    Args:
        space: what a robot without a body keeps away from.
        errands: one per robot.
        speeds: m/s, one per robot.
        fixed: others, with their motions from t = 0 on.
        follow: for how long a robot must be able to follow its preset after it has joined it, s.
        effort: None: the default.
    """
    effort = effort or Effort()
    spaces = [space.of(errand.body) for errand in errands]
    roadmap = weave(spaces, errands, [other.motion[0, 1:] for other in fixed])
    least = min(each.apart for each in spaces)
    movers = [
        Mover.on(roadmap if each.apart == least else roadmap.within(each, own), each, errand, speed, own)
        for each, errand, speed, own in zip(spaces, errands, speeds, roadmap.woven, strict=True)
    ]
    task = _Search(movers, tuple(fixed), follow, effort)
    ways = task.in_orders()
    if ways is None:
        ways = task.partly()
    return Plan(tuple(smooth(spaces, ways, [_resting(e) for e in errands], fixed)), task.orders, task.spent)


def _resting(errand: Errand) -> Body:
    """A robot that stays where it is."""
    return Body(at_rest(errand.start), errand.body)


class _Search:
    """One call of `plan`: what it is about, and what it has spent."""

    def __init__(self, movers: list[Mover], fixed: tuple[Body, ...], follow: float, effort: Effort) -> None:
        self._movers, self._fixed, self._follow, self._effort = movers, fixed, follow, effort
        self.orders, self.searches, self.spent = 0, 0, 0
        self._limit = effort.expansions

    def in_orders(self) -> list[Way | None] | None:
        """The best of the complete plans found; None without any."""
        if any(math.isinf(mover.to_go[mover.woven.start]) for mover in self._movers):
            return None
        best: list[Way | None] | None = None
        least, left = math.inf, self._effort.orders
        tried = set()
        self._limit = self._effort.expansions * 3 // 4
        drawn = self._drawn()
        order = next(drawn)
        while left > 0 and self.spent < self._limit and self.searches < self._effort.searches:
            tried.add(order)
            self.orders += 1
            left -= 1
            ways, failed = self._in_order(order)
            if failed is not None:
                ways, failed = self._in_order(order, considerate=True)
            if failed is None:
                cost = sum(way.joined for way in ways if way is not None)
                if cost < least - 1e-9:
                    best, least = ways, cost
                left = min(left, LATER_ORDERS)
            first = (failed, *(i for i in order if i != failed)) if failed is not None else order
            order = first if first not in tried else next((other for other in drawn if other not in tried), order)
            if order in tried:
                break
        return best

    def _drawn(self) -> Iterator[tuple[int, ...]]:
        """Orders: those with the longest way first, then drawn ones."""
        count = len(self._movers)
        by_length = sorted(range(count), key=lambda i: (-self._movers[i].to_go[self._movers[i].woven.start], i))
        yield tuple(by_length)
        random = np.random.default_rng(0)
        for _ in range(20 * self._effort.orders):
            yield tuple(random.permutation(count).tolist())

    def _in_order(
        self, order: Sequence[int], staying: Sequence[int] = (), *, considerate: bool = False
    ) -> tuple[list[Way | None], int | None]:
        """Ways of the robots, planned for in this order, and the first that has none."""
        ways: list[Way | None] = [None] * len(self._movers)
        taken = [*self._fixed, *(_resting(self._movers[i].errand) for i in staying)]
        for k, i in enumerate(order):
            brief = [self._leaving(j) for j in order[k + 1 :]] if considerate else []
            budget = self._limit - self.spent
            way, spent = find(self._movers[i], taken, self._follow, budget, brief)
            self.searches += 1
            self.spent += spent
            if way is None:
                return ways, i
            ways[i] = way
            taken.append(Body(way.motion, self._movers[i].errand.body))
        return ways, None

    def _leaving(self, robot: int) -> Body:
        """A robot at its place, until when it may need it."""
        mover = self._movers[robot]
        until = LEAVING * (mover.space.apart + mover.space.spacing) / mover.speed
        return _resting(mover.errand)._replace(until=until)

    def partly(self) -> list[Way | None]:
        """Ways of as many robots as find one while the others stay, dropped one by one."""
        self._limit = self._effort.expansions
        staying: list[int] = []
        order = next(self._drawn())
        for _ in self._movers:
            ways, failed = self._in_order([i for i in order if i not in staying], staying)
            if failed is None:
                return ways
            staying.append(failed)
        return [None] * len(self._movers)
