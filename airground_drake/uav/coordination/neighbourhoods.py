"""Better plans from a plan: large neighbourhood search.

Some ways are taken out and found anew, one after the other, each among all other ways. The new ways are kept if the sum
of the times at which robots are back on their presets falls. The neighbourhoods are: all robots, in the order in which
they are back; each robot alone; a late robot and those in its way; all robots in drawn orders. At last the ways are
straightened: detours are removed that only the roadmap causes.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from airground_drake.uav.coordination.roadmap import Space
from airground_drake.uav.coordination.single import Mover, OtherRobot, Way, find
from airground_drake.uav.coordination.timed import distance, straightened

ROUNDS = 2  # how often every way is straightened among the others
GAIN_S = 1e-3  # a change must lower the sum of times by more than this, s
DRAWN = 3  # number of drawn orders in which all robots are planned for anew
MOST_IN_THE_WAY = 6  # largest number of robots in the way of a late one that are planned for anew with it


class Refinement:
    """Large neighbourhood search on one plan."""

    def __init__(
        self,
        movers: Sequence[Mover],
        ways: Sequence[Way],
        alone: Sequence[Way],
        fixed: Sequence[OtherRobot],
        follow: float,
    ) -> None:
        # alone: the ways that the robots would have without each other.
        self._movers, self._alone, self._fixed, self._follow = movers, tuple(alone), tuple(fixed), follow
        self.ways = list(ways)  # one per robot; no robot is without a way
        # searches: searches for single robots so far.
        # expansions: expanded intervals so far.
        self.searches, self.expansions = 0, 0

    def run(self, searches: int, expansions: int) -> None:
        """Search within a number of searches for single robots and of expanded intervals."""
        for group in self._neighbourhoods():
            if self.searches >= searches or self.expansions >= expansions:
                return
            self._try(group, expansions)

    def _neighbourhoods(self) -> Iterator[list[int]]:
        """Robots to plan for anew, in order."""
        every = range(len(self.ways))
        yield sorted(every, key=lambda i: (self.ways[i].joined, i))
        for i in sorted(every, key=lambda i: (-self._late(i), i)):
            if self._late(i) > GAIN_S:
                yield [i]
        in_vain: set[int] = set()
        while late := [i for i in every if i not in in_vain and self._late(i) > GAIN_S]:
            first, before = max(late, key=lambda i: (self._late(i), -i)), list(self.ways)
            yield [first, *self._in_the_way(first)]
            if self.ways == before:
                in_vain.add(first)
            else:
                in_vain.clear()
        random = np.random.default_rng(0)
        for _ in range(DRAWN):
            yield random.permutation(len(self.ways)).tolist()

    def _late(self, i: int) -> float:
        """Delay of a robot's return caused by the others, s."""
        return self.ways[i].joined - self._alone[i].joined

    def _in_the_way(self, late: int) -> list[int]:
        """The robots that block a late robot's own path, the nearest to it first."""
        mover, near = self._movers[late], []
        for j, other in enumerate(self.ways):
            if j != late:
                apart = mover.space.apart + self._movers[j].task.body + mover.space.spacing
                near.append((distance(self._alone[late].motion, other.motion) - apart, j))
        return [j for far, j in sorted(near) if far < 0.0][:MOST_IN_THE_WAY]

    def _try(self, group: Sequence[int], expansions: int) -> None:
        """Plan some robots again, in this order, among all others; keep better paths."""
        changed = list(self.ways)
        taken = [*self._fixed, *(self._body(j, self.ways[j]) for j in range(len(changed)) if j not in group)]
        gain = sum(self._late(i) for i in group)  # largest possible one
        for i in group:
            latest = self._alone[i].joined + gain - GAIN_S
            budget = max(0, expansions - self.expansions)
            way, spent = find(self._movers[i], taken, self._follow, budget, latest=latest)
            self.searches += 1
            self.expansions += spent
            if way is None:
                return
            gain -= way.joined - self._alone[i].joined
            if gain < GAIN_S:
                return
            changed[i] = way
            taken.append(self._body(i, way))
        self.ways = changed

    def _body(self, i: int, way: Way) -> OtherRobot:
        return OtherRobot(way.motion, self._movers[i].task.body)


def smooth(
    spaces: Sequence[Space], ways: Sequence[Way | None], rests: Sequence[OtherRobot], fixed: Sequence[OtherRobot]
) -> list[Way | None]:
    """The paths with straight pieces where these are free."""
    # The times at which robots join their presets do not change.
    # ways: one per robot; None: the robot stays where it is.
    smoothed = list(ways)
    for _ in range(ROUNDS):
        for i, way in enumerate(smoothed):
            if way is None:
                continue
            moving = [rest if own is None else rest._replace(motion=own.motion)
                      for own, rest in zip(smoothed, rests, strict=True)]  # fmt: skip
            others = [*fixed, *moving[:i], *moving[i + 1 :]]
            smoothed[i] = _straightened(spaces[i], way, others)
    return smoothed


def _straightened(space: Space, way: Way, others: Sequence[OtherRobot]) -> Way:
    stacked = np.concatenate([np.zeros((0, 3)), *(other.motion for other in others)])
    begins = np.concatenate([[0], np.cumsum([len(other.motion) for other in others])]).astype(np.int64)
    apart = np.array([space.apart + other.radius + space.spacing for other in others])
    motion = straightened(way.motion, way.rows, space.rows, space.along, stacked, begins, apart)
    return Way(motion, way.joined, way.rows - (len(way.motion) - len(motion)))
