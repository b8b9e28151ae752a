"""All bodies of a scenario in one order, and who keeps what distance from whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.world.motion import SAME_S
from airground_drake.world.plant import Plant
from airground_drake.world.shape import Ball, Shape

Kind = Literal["ugv", "uav", "obstacle"]
KINDS: tuple[Kind, ...] = get_args(Kind)
ROBOTS: tuple[Kind, ...] = ("ugv", "uav")
"""Kinds of bodies that are commanded."""
NOWHERE_M = 1e150
"""Coordinates of a body that has not appeared yet: beyond any sensing range, and its square is still finite."""


@dataclass(frozen=True, eq=False)
class Body:
    """A robot or an obstacle.

    Attributes:
        name: unique in its world.
        kind: UGVs stay in their plane.
        start_m: position of its centre at the start, (3,), m, world frame.
        shape: the room that it takes up around its centre.
        plant: how it moves; None: it never moves.
        max_speed_m_s: speed limit.
        appears_s: time from which on it is there, s; only for a body that never moves.
    """

    name: str
    kind: Kind
    start_m: Array
    shape: Shape = field(default_factory=Ball)
    plant: Plant | None = None
    max_speed_m_s: float = 0.0
    appears_s: float = 0.0

    @property
    def mobility(self) -> Array:
        """(3,): 1 in directions in which it can move, else 0."""
        if self.plant is None:
            return np.zeros(3)
        return np.array([1.0, 1.0, 0.0]) if self.kind == "ugv" else np.ones(3)


class Pair(NamedTuple):
    """Two bodies that keep apart.

    Attributes:
        first: name of a robot.
        second: name of the other body.
        distance_m: safe distance between their centres.
        shares: part of the avoidance inequality that each of them takes.
    """

    first: str
    second: str
    distance_m: float
    shares: tuple[float, float]


class Neighbours(NamedTuple):
    """The bodies that k robots keep away from, as arrays for compiled code: m at rest, then n that move.

    Attributes:
        members: the robots, rows of the positions of moving bodies, (k,).
        others: what moves around each, rows likewise, (k, n).
        still: centres of the bodies at rest, (m, 3), m.
        distance: safe distances between centres, (k, m + n), m.
        share: part of the avoidance inequality that the robot takes, (k, m + n).
        mobility: of the robots, (k, 3), 1 where they can move, else 0.
        max_speed: of the robots, (k,), m/s.
    """

    members: npt.NDArray[np.intp]
    others: npt.NDArray[np.intp]
    still: Array
    distance: Array
    share: Array
    mobility: Array
    max_speed: Array


@dataclass(frozen=True, eq=False)
class World:
    """All bodies: UGVs, UAVs, then obstacles; of each kind, bodies that move stand before bodies at rest.

    The port `bodies` of the Diagram holds the positions of the M bodies that move, (3 M,), m, in this order. Bodies at
    rest are known here and never copied: a thousand of them would cost every tick more than the control law.

    Attributes:
        bodies: in array order.
        apart_m: safe distance between the surfaces of two bodies, m, by the set of their kinds; each of two robots
            takes half of an inequality, a robot near an obstacle all of it.
    """

    bodies: tuple[Body, ...]
    apart_m: Mapping[frozenset[Kind], float]

    def __post_init__(self) -> None:
        """Check the order.

        Raises:
            ValueError: if bodies are not in the order above, a robot cannot move, or two have the same name.
        """
        if any(body.plant is None for body in self.bodies if body.kind in ROBOTS):
            raise ValueError("a robot needs a plant")
        order = [(KINDS.index(body.kind), body.plant is None) for body in self.bodies]
        if order != sorted(order):
            raise ValueError("bodies stand in the order UGVs, UAVs, obstacles that move, obstacles at rest")
        if len(set(self.names())) < len(self.bodies):
            raise ValueError("two bodies have the same name")

    def names(self, *kinds: Kind) -> tuple[str, ...]:
        """Names of the bodies of some kinds, by default of all, in order."""
        return tuple(body.name for body in self.bodies if not kinds or body.kind in kinds)

    def select(self, *kinds: Kind) -> slice:
        """Rows of the bodies of kinds that stand side by side, in arrays of bodies."""
        rows = [i for i, body in enumerate(self.bodies) if body.kind in kinds]
        return slice(rows[0], rows[-1] + 1) if rows else slice(0, 0)

    def index(self, name: str) -> int:
        """Row of a body.

        Raises:
            ValueError: if no body has that name.
        """
        return self.names().index(name)

    @cached_property
    def moving(self) -> tuple[Body, ...]:
        """The M bodies that move, those of the port `bodies`."""
        return tuple(body for body in self.bodies if body.plant is not None)

    def at(self, near: Neighbours, t: float) -> Neighbours:
        """The same neighbours at time t, s: bodies at rest that have not appeared yet are at NOWHERE_M.

        A controller that asks at its samples has a body from the first sample at or after `appears_s` on.
        """
        if t >= self._complete_s:
            return near
        return near._replace(still=np.where((self._appears <= t + SAME_S)[:, None], near.still, NOWHERE_M))

    @cached_property
    def _appears(self) -> Array:
        """When each body at rest appears, (m,), s."""
        return np.array([body.appears_s for body in self.bodies if body.plant is None], dtype=np.float64)

    @cached_property
    def _complete_s(self) -> float:
        """Time from which on all bodies are there, s."""
        return float(self._appears.max(initial=0.0)) - SAME_S

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots."""
        return self.names(*ROBOTS)

    @cached_property
    def starts(self) -> Array:
        """Positions at the start of the bodies that move, (M, 3), m."""
        return _rows([body.start_m for body in self.moving])

    @cached_property
    def radius(self) -> Array:
        """Radii of all bodies, (B,), m."""
        return np.array([body.shape.radius_m for body in self.bodies])

    def moves_straight(self, period_s: float) -> bool:
        """Whether all bodies move on straight lines while their commands are held for a period."""
        return not any(body.plant and body.plant.reach(body.max_speed_m_s, period_s) for body in self.moving)

    def apart(self, first: Kind, second: Kind) -> float:
        """Safe distance between the surfaces of bodies of two kinds, m; 0 if none is declared."""
        return self.apart_m.get(frozenset((first, second)), 0.0)

    def pair(self, first: str, second: str) -> Pair:
        """The distance and the shares of a robot and another body."""
        i, j = self.index(first), self.index(second)
        shares = float(self._share[i, j]), float(self._share[j, i]) if j < len(self._share) else 0.0
        return Pair(first, second, float(self._distance[i, j]), shares)

    @cached_property
    def _distance(self) -> Array:
        """Safe distances between the centres of moving bodies and all bodies, (M, B), m; the diagonal means nothing."""
        by_kind = np.array([[self.apart(one, other) for other in KINDS] for one in KINDS])
        code = [KINDS.index(body.kind) for body in self.bodies]
        count = len(self.moving)
        surfaces: Array = by_kind[np.ix_(code[:count], code)]
        return surfaces + (self.radius[:count, None] + self.radius)

    @cached_property
    def _share(self) -> Array:
        """Shares that moving bodies take beside all bodies, (M, B): an obstacle takes none."""
        robot = np.array([body.kind in ROBOTS for body in self.bodies])
        share: Array = np.where(robot, 0.5, 1.0) * robot[: len(self.moving), None]
        return share

    def around(self, rows: slice) -> Neighbours:
        """The bodies that the robots in some rows keep away from."""
        count = len(self.moving)
        members = np.arange(count)[rows]
        others = np.array([np.delete(np.arange(count), i) for i in members], dtype=np.intp).reshape(len(members), -1)
        still = np.arange(count, len(self.bodies))
        columns = np.concatenate([np.tile(still, (len(members), 1)), others], axis=1)
        robots = [self.bodies[i] for i in members]
        return Neighbours(
            members, others, _rows([self.bodies[k].start_m for k in still]),
            np.take_along_axis(self._distance[members], columns, axis=1),
            np.take_along_axis(self._share[members], columns, axis=1),
            _rows([robot.mobility for robot in robots]), np.array([robot.max_speed_m_s for robot in robots]),
        )  # fmt: skip


def _rows(points: Sequence[Array]) -> Array:
    """Points as rows, (n, 3), also if n is 0."""
    return np.array(points, dtype=np.float64).reshape(-1, 3)
