"""Joint plans: prioritised planning where that succeeds, a search over joint steps where it does not."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from airground_drake.model.geometry.paths import NoPath, shortest_path
from airground_drake.uav.coordination.first_plan import first_plan
from airground_drake.uav.coordination.neighbourhoods import Refinement, smooth
from airground_drake.uav.coordination.roadmap import RobotTask, Space, build_roadmap
from airground_drake.uav.coordination.single import Mover, OtherRobot, Way, find, sum_of_times
from airground_drake.uav.coordination.timed import at_rest, speed

# No further order of the robots is tried after this many searches for single robots, or a tenth of the effort.
# Where another order of few robots succeeds, its plan is better than one from joint steps.
REORDERED, REORDERED_SHARE = 40, 10
# If a plan by an order takes this many times as long as the robots would alone, a plan by joint steps is made, too,
# within a thirtieth of the candidates; the better one is taken. Not among known motions: there, steps of one duration
# cost more time than an order.
LATE, LATE_SHARE = 1.4, 30
# A plan by joint steps is improved beside one by an order only if it does not take longer than this many times that
# one: improving it takes most of the time.
WORTH = 1.1
# Improving a plan by joint steps may take this many times the expansions of a whole plan. For 64 robots in a jam this
# shortens the plan from 73 s to 51 s; the orders tried before had used up the effort.
IMPROVING = 2
# A robot leaves its place within the time in which it travels this many times the distance that robots keep.
LEAVING = 2.0

# A plan for all; none exists; none on the roadmaps, all searched to the end; none within the effort.
Outcome = Literal["complete", "no plan exists", "exhausted", "effort spent"]


@dataclass(frozen=True)
class Effort:
    """Limits of the work on a plan, in counts, so that the plan is the same on every machine."""

    # Expanded intervals in all searches for single robots, times the number of robots by 20 if there are more; a
    # quarter is reserved for a partial plan. Twice as many may improve a plan by joint steps.
    expansions: int = 400_000
    candidates: int = 3_000_000  # moves that the search over joint steps considers; 0: no such search
    # Searches for single robots that improve a complete plan, times the number of robots, at least 20.
    searches: int = 4


@dataclass(frozen=True, eq=False)
class Plan:
    """A joint plan."""

    ways: tuple[Way | None, ...]  # one per robot; None: it stays where it is
    outcome: Outcome  # whether every robot has a way; if not, why
    separated: tuple[int, ...] = ()  # robots whose starts and targets lie in different components of their free space
    expansions: int = 0  # number of expanded intervals
    candidates: int = 0  # moves that the search over joint steps considered

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
    """Plan paths for robots that keep their distances from obstacles, each other and fixed motions."""
    # 1. The robots are planned for in turn, the longest way first, each among the ways of those before it. If a robot
    # finds no way, every robot keeps clear of the starts of later robots until these can have left. 2. If that fails,
    # robots without a way even alone are left where they are, and the others are planned for again. 3. If that fails
    # too, further orders are tried for a short while: the robot without a way comes first in the next order. 4. If
    # these fail, joint steps of the robots are searched on coarse roadmaps (`first_plan`). 5. A plan for all of them is
    # improved (`neighbourhoods`). If it is by an order and takes much longer than the robots would alone, joint steps
    # are searched for a short while, too, and the better plan is taken. 6. Without one, robots that find no way stay
    # where they are, and the others go round them. follow: how long a robot must be able to follow its preset after it
    # has joined it, s. effort: limits of the work; default: `Effort()`.
    effort = effort or Effort()
    spaces = [space.of(task.body) for task in tasks]
    roadmap = build_roadmap(spaces, tasks, [other.motion[0, 1:] for other in fixed])
    least = min(space.apart for space in spaces)
    movers = [
        Mover.on(roadmap if space.apart == least else roadmap.within(space, own), space, task, speed, own)
        for space, task, speed, own in zip(spaces, tasks, speeds, roadmap.robots, strict=True)
    ]
    search = _Search(movers, tuple(fixed), follow, effort)
    ways = search.complete()
    if ways is None:
        ways = search.partly()
    outcome = search.outcome
    separated = () if outcome == "complete" else _separated(spaces, tasks, ways)
    return Plan(
        tuple(smooth(spaces, ways, [_resting(task) for task in tasks], fixed)),
        "no plan exists" if separated else outcome,
        separated,
        search.spent,
        search.candidates,
    )


def _separated(spaces: Sequence[Space], tasks: Sequence[RobotTask], ways: Sequence[Way | None]) -> tuple[int, ...]:
    """Robots that are separated from their targets on any roadmap, ignoring clearances."""
    apart = []
    for i, (space, task, way) in enumerate(zip(spaces, tasks, ways, strict=True)):
        if way is None:
            try:
                shortest_path(task.start, task.preset[-1, 1:], space.rows, space.keep)
            except NoPath:
                apart.append(i)
    return tuple(apart)


def _resting(task: RobotTask) -> OtherRobot:
    return OtherRobot(at_rest(task.start), task.body)


class _Search:
    """One call of `plan`: its robots, its limits, and the work done so far."""

    def __init__(self, movers: list[Mover], fixed: tuple[OtherRobot, ...], follow: float, effort: Effort) -> None:
        self._movers, self._fixed, self._follow, self._effort = movers, fixed, follow, effort
        self._resting = [_resting(mover.task) for mover in movers]  # made once: movers store what a motion blocks
        self.spent, self._searches, self.candidates = 0, 0, 0
        self.outcome: Outcome = "effort spent"
        self._most = effort.expansions * max(20, len(movers)) // 20
        self._limit = self._most * 3 // 4
        self._without_way = [i for i, mover in enumerate(movers) if math.isinf(mover.to_go[mover.own.start])]

    def complete(self) -> list[Way | None] | None:
        """A plan for all robots that have a path alone, or None."""
        ways, failed = self._in_either_way(self._by_length(self._without_way))
        if failed is not None:
            before = len(self._without_way)
            self._alone()
            if len(self._without_way) > before:
                ways, failed = self._in_either_way(self._by_length(self._without_way))
        able = [i for i in range(len(self._movers)) if i not in self._without_way]
        if failed is not None and len(able) > 1:
            ways, failed = self._in_other_orders(failed)
        complete = ways if failed is None else None
        if len(able) > 1:
            complete = self._improved(complete, able)
        if complete is not None:
            self.outcome = "exhausted" if self._without_way else "complete"
        return complete

    def _improved(self, ways: list[Way | None] | None, able: Sequence[int]) -> list[Way | None] | None:
        """The prioritised plan improved, or a plan by joint steps if there is none; None without either."""
        candidates = self._effort.candidates
        if ways is not None:
            alone = self._refine(ways, able)
            among_motions = any(speed(other.motion) > 0.0 for other in self._fixed)
            if among_motions or not alone or sum_of_times(ways) <= LATE * sum_of_times(alone):
                return ways
            candidates //= LATE_SHARE
        others = self._joint_steps(able, candidates)
        if others is None or (ways is not None and sum_of_times(others) > WORTH * sum_of_times(ways)):
            return ways
        self._limit = max(self._limit, self.spent + IMPROVING * self._most)
        self._refine(others, able)
        return others if ways is None else min(ways, others, key=sum_of_times)

    def _alone(self) -> list[Way | None]:
        """The robots' paths without each other; records robots without a path."""
        ways: list[Way | None] = []
        taken = self._taken()
        for i, mover in enumerate(self._movers):
            if i in self._without_way:
                ways.append(None)
                continue
            budget = self._left()
            way, spent = find(mover, taken, self._follow, budget)
            self.spent += spent
            ways.append(way)
            if way is None and spent < budget:
                self._without_way.append(i)
        return ways

    def _left(self) -> int:
        return max(0, self._limit - self.spent)

    def _taken(self) -> list[OtherRobot]:
        """The fixed motions: of other robots, and of robots without a path."""
        return [*self._fixed, *(self._resting[i] for i in self._without_way)]

    def _in_either_way(self, order: Sequence[int]) -> tuple[list[Way | None], int | None]:
        """Plan in one order, first ignoring and then considering later robots; also the first robot without a path."""
        ways, failed = self._in_order(order, self._without_way)
        if failed is not None and failed != order[0]:
            ways, failed = self._in_order(order, self._without_way, considerate=True)
        return ways, failed

    def _in_other_orders(self, failed: int) -> tuple[list[Way | None], int | None]:
        """Plan in more orders like `_in_either_way`: a robot without a path comes first in the next one."""
        ways: list[Way | None] = [None] * len(self._movers)
        first = failed
        order, tried = self._by_length(self._without_way), set()
        most, limit = self._searches + REORDERED, self.spent + self._most // REORDERED_SHARE
        while self._searches < most and self.spent < limit:
            tried.add(tuple(order))
            order = [first, *(i for i in order if i != first)]
            if tuple(order) in tried:
                break
            ways, now = self._in_either_way(order)
            if now is None:
                return ways, None
            first = now
        return ways, first

    def _by_length(self, but: Sequence[int]) -> list[int]:
        """The robots, the longest way first, without some."""
        order = [i for i in range(len(self._movers)) if i not in but]
        return sorted(order, key=lambda i: (-self._movers[i].to_go[self._movers[i].own.start], i))

    def _in_order(
        self, order: Sequence[int], staying: Sequence[int], *, considerate: bool = False
    ) -> tuple[list[Way | None], int | None]:
        """Paths of the robots in this order, and the first robot without one, or None."""
        ways: list[Way | None] = [None] * len(self._movers)
        taken = [*self._fixed, *(self._resting[i] for i in staying)]
        for k, i in enumerate(order):
            brief = [self._leaving(j) for j in order[k + 1 :]] if considerate else []
            way, spent = find(self._movers[i], taken, self._follow, self._left(), brief)
            self._searches += 1
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
        return self._resting[robot]._replace(until=until)

    def _joint_steps(self, able: Sequence[int], candidates: int) -> list[Way | None] | None:
        movers = [self._movers[i] for i in able]
        if not all(mover.own.usable[-1] for mover in movers):
            return None  # a target is too near to an obstacle
        first = first_plan(movers, self._taken(), candidates)
        self.candidates += first.candidates
        if first.outcome != "found":
            self.outcome = first.outcome
            return None
        ways: list[Way | None] = [None] * len(self._movers)
        for i, way in zip(able, first.ways, strict=True):
            ways[i] = way
        return ways

    def _refine(self, ways: list[Way | None], able: Sequence[int]) -> list[Way]:
        """Improve the ways of some robots, in place; the ways that they would have alone, if all are known."""
        alone = self._alone()
        known = [(self._movers[i], ways[i], alone[i]) for i in able]
        movers, own, free = zip(*known, strict=True)
        if None in free or None in own:
            return []
        better = Refinement(movers, own, free, self._taken(), self._follow)
        better.run(self._effort.searches * max(20, len(able)), self._left())
        self.spent += better.expansions
        for i, way in zip(able, better.ways, strict=True):
            ways[i] = way
        return list(free)

    def partly(self) -> list[Way | None]:
        """A plan in which robots without a path stay; whenever one has no path, the others are planned again."""
        self._limit = max(self.spent, self._most * 3 // 4) + self._most // 4
        staying = list(self._without_way)
        for _ in self._movers:
            ways, failed = self._in_order(self._by_length(staying), staying)
            if failed is None:
                return ways
            staying.append(failed)
        return [None] * len(self._movers)
