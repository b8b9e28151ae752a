"""Joint plans by prioritised planning: one robot after the other, in many orders, within a budget."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airground_drake.intervention.coordination.roadmap import RobotTask, Space, build_roadmap
from airground_drake.intervention.coordination.single import Mover, OtherRobot, Way, find
from airground_drake.intervention.coordination.smoothing import smooth
from airground_drake.intervention.coordination.timed import at_rest

MOST_ORDERS = 30
"""Largest number of orders of the robots."""
MOST_SEARCHES = 240
"""Largest number of searches for single robots: a large team gets fewer orders."""
LEAVING = 2.0
"""A robot leaves its place within the time in which it travels this many times the distance that robots keep."""
LATER_ORDERS = 3
"""Orders that are tried for a better plan after the first complete one."""


@dataclass(frozen=True)
class Effort:
    """Limits of the work on a plan, in counts, so that the plan is the same on every machine.

    Attributes:
        orders: orders of the robots.
        searches: searches for single robots, in all orders together.
        expansions: expanded intervals, in all searches together; a quarter is reserved for a partial plan.
    """

    orders: int = MOST_ORDERS
    searches: int = MOST_SEARCHES
    expansions: int = 400_000


@dataclass(frozen=True, eq=False)
class Plan:
    """A joint plan.

    Attributes:
        ways: one per robot; None: it stays where it is.
        orders: number of orders that were tried.
        expansions: number of expanded intervals.
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
    tasks: Sequence[RobotTask],
    speeds: Sequence[float],
    fixed: Sequence[OtherRobot] = (),
    *,
    follow: float = math.inf,
    effort: Effort | None = None,
) -> Plan:
    """Plan ways for some robots, which keep their distances from discs, from each other and from fixed motions.

    The robots of an order are planned for in turn, each among the ways of those before it. If a robot finds no way:
    1. The order is tried again, and every robot keeps clear of the starts of later robots until these can have left.
    2. If that fails too, the robot without a way comes first in the next order.
    3. If that order has been tried before, the next order is drawn from a fixed sequence.
    If no order gives every robot a way, robots without a way stay where they are, and the others go round them.

    Args:
        space: discs and distances for a robot without a body.
        tasks: one per robot.
        speeds: m/s, one per robot.
        fixed: other robots, with their motions from t = 0 on.
        follow: how long a robot must be able to follow its preset after it has joined it, s.
        effort: limits of the work; default: `Effort()`.
    """
    effort = effort or Effort()
    spaces = [space.of(task.body) for task in tasks]
    roadmap = build_roadmap(spaces, tasks, [other.motion[0, 1:] for other in fixed])
    least = min(each.apart for each in spaces)
    movers = [
        Mover.on(roadmap if each.apart == least else roadmap.within(each, own), each, task, speed, own)
        for each, task, speed, own in zip(spaces, tasks, speeds, roadmap.robots, strict=True)
    ]
    search = _Search(movers, tuple(fixed), follow, effort)
    ways = search.in_orders()
    if ways is None:
        ways = search.partly()
    return Plan(tuple(smooth(spaces, ways, [_resting(task) for task in tasks], fixed)), search.orders, search.spent)


def _resting(task: RobotTask) -> OtherRobot:
    """A robot that stays where it is."""
    return OtherRobot(at_rest(task.start), task.body)


class _Search:
    """One call of `plan`: its robots, its limits, and the work done so far."""

    def __init__(self, movers: list[Mover], fixed: tuple[OtherRobot, ...], follow: float, effort: Effort) -> None:
        self._movers, self._fixed, self._follow, self._effort = movers, fixed, follow, effort
        self.orders, self.searches, self.spent = 0, 0, 0
        self._limit = effort.expansions
        self._without_way: list[int] = []

    def in_orders(self) -> list[Way | None] | None:
        """The best complete plan, or None."""
        if any(math.isinf(mover.to_go[mover.own.start]) for mover in self._movers):
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
            if failed == order[0]:  # it has no way even without the other robots of the plan
                self._without_way.append(failed)
                return None
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
        """Orders of the robots: the longest way first, then random ones from a fixed seed."""
        count = len(self._movers)
        by_length = sorted(range(count), key=lambda i: (-self._movers[i].to_go[self._movers[i].own.start], i))
        yield tuple(by_length)
        random = np.random.default_rng(0)
        for _ in range(20 * self._effort.orders):
            yield tuple(random.permutation(count).tolist())

    def _in_order(
        self, order: Sequence[int], staying: Sequence[int] = (), *, considerate: bool = False
    ) -> tuple[list[Way | None], int | None]:
        """Ways of the robots in this order, and the first robot without a way, or None.

        Args:
            order: of the robots.
            staying: robots that stay where they are.
            considerate: whether robots keep clear of the starts of later robots until these can have left.
        """
        ways: list[Way | None] = [None] * len(self._movers)
        taken = [*self._fixed, *(_resting(self._movers[i].task) for i in staying)]
        for k, i in enumerate(order):
            brief = [self._leaving(j) for j in order[k + 1 :]] if considerate else []
            budget = self._limit - self.spent
            way, spent = find(self._movers[i], taken, self._follow, budget, brief)
            self.searches += 1
            self.spent += spent
            if way is None:
                return ways, i
            ways[i] = way
            taken.append(OtherRobot(way.motion, self._movers[i].task.body))
        return ways, None

    def _leaving(self, robot: int) -> OtherRobot:
        """A robot at its start, until it can have left."""
        mover = self._movers[robot]
        until = LEAVING * (mover.space.apart + mover.space.spacing) / mover.speed
        return _resting(mover.task)._replace(until=until)

    def partly(self) -> list[Way | None]:
        """A plan in which robots without a way stay. Each time a robot finds none, the others are planned anew."""
        self._limit = self._effort.expansions
        staying = self._without_way
        order = next(self._drawn())
        for _ in self._movers:
            ways, failed = self._in_order([i for i in order if i not in staying], staying)
            if failed is None:
                return ways
            staying.append(failed)
        return [None] * len(self._movers)
