"""All bodies of a scenario in one order, and the distances that they keep from each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.model.bodies.kinds import KINDS, ROBOTS, Kind
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.geometry import outline
from airground_drake.model.plants.budget import AT_REST, Bounds, law_distance
from airground_drake.model.plants.plant import Plant
from airground_drake.model.plants.scripted import Scripted
from airground_drake.model.plants.steering import NUMBERS


@dataclass(frozen=True, eq=False)
class Body:
    """A robot or an obstacle.

    Attributes:
        name: unique in its world.
        kind: UGVs stay in their plane.
        start_m: position of its origin at the start, of a robot that of the point that the law steers, (3,), m, world
            frame.
        shape: outlines of its convex parts about its origin, (k, W), see `model.geometry.outline`; of a robot, one
            ball.
        plant: how it moves; None: it never moves.
        max_speed_m_s: speed limit, or the speed that robots expect of an obstacle at most.
        appears_s: time from which on an obstacle is there, s.
        disappears_s: time from which on it is not there any more, s.
        error_m: of a robot, bound of the error of its measured position, m.
        may_stand: whether a robot may stand because it does not know where another one is.
        own_views: whether a robot acts on its own measurements of other robots.
    """

    name: str
    kind: Kind
    start_m: Array
    shape: Array = field(default_factory=lambda: outline.balls(np.zeros(3)))
    plant: Plant | None = None
    max_speed_m_s: float = 0.0
    appears_s: float = 0.0
    disappears_s: float = np.inf
    error_m: float = 0.0
    may_stand: bool = False
    own_views: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"body {self.name!r} is of kind {self.kind!r}; allowed: {', '.join(KINDS)}")
        if not self.max_speed_m_s >= 0.0:
            raise ValueError(f"max_speed_m_s of body {self.name!r} is {self.max_speed_m_s}; allowed: from 0")

    @property
    def mobility(self) -> Array:
        """1 in directions of possible motion, else 0, (3,)."""
        if self.plant is None:
            return np.zeros(3)
        return np.array([1.0, 1.0, 0.0]) if self.kind == "ugv" else np.ones(3)

    @property
    def bounds(self) -> Bounds:
        """How far a robot's body may be from its steered point."""
        if not (self.plant and self.kind in ROBOTS):
            return AT_REST
        return self.plant.bounds(self.max_speed_m_s)._replace(
            error_m=self.error_m, may_stand=self.may_stand, own_views=self.own_views
        )


class Neighbours(NamedTuple):
    """What k robots must avoid, as arrays for compiled code: m static convex parts, then n moving ones.

    Attributes:
        members: the robots, rows of the positions of moving bodies, (k,).
        carrier: the bodies of the P parts that move, rows of the positions of moving bodies, (P,).
        others: the parts that move around each robot, rows of `parts`, (k, n).
        still: outlines of the parts at rest, (m, W).
        parts: outlines of all parts that move, about the origins of their bodies, (P, W).
        distance: distances that the law keeps between the robot's steered point and the cores, (k, m + n), m.
        share: part of the avoidance inequality that the robot takes, (k, m + n). Below 0 it is minus how far the other
            one may be from where the robot believes it to be, m: of a UGV from its old position until it decides again
            (the law is the asynchronous one), of an obstacle that may move by the error of a measured position.
        mobility: of the robots, (k, 3), 1 where they can move, else 0.
        max_speed: of the robots, (k,), m/s.
    """

    members: Indices
    carrier: Indices
    others: Indices
    still: Array
    parts: Array
    distance: Array
    share: Array
    mobility: Array
    max_speed: Array

    @classmethod
    def at_rest(cls, still: Array, max_speed: Array) -> Self:
        """Point-like UGVs with speed limits (k,), m/s, that avoid static outlines only, (m, W), not each other."""
        count, limits = len(max_speed), np.asarray(max_speed, dtype=np.float64)
        nobody, own = np.zeros((count, 0), dtype=np.intp), np.arange(count)
        distance = np.tile(outline.keep(still, 0.0), (count, 1))
        plane = np.tile([1.0, 1.0, 0.0], (count, 1))
        return cls(own, own[:0], nobody, still, outline.stacked([]), distance, np.ones_like(distance), plane, limits)


@dataclass(frozen=True, eq=False)
class World:
    """All bodies: UGVs, UAVs, then obstacles; of each kind, bodies that move stand before bodies at rest.

    The port `bodies` of the Diagram holds the positions of the M bodies that move, (3 M,), m, in this order. Bodies at
    rest are known here and never copied: a thousand of them would cost every tick more than the control law.

    Attributes:
        bodies: in array order.
        apart_m: safe distance between the surfaces of two robots, m, by the set of their kinds. An obstacle's outlines
            say what distance to keep from it. Each of two robots takes half of an inequality, a robot beside an
            obstacle all of it.
        gain_1_s: gain A of the law, which makes up for drift: see `model.plants.budget`.
        unsure_s: how long a UGV has to reckon with any motion of another one, s; 0: they share inequalities.
    """

    bodies: tuple[Body, ...]
    apart_m: Mapping[frozenset[Kind], float]
    gain_1_s: float = 0.0
    unsure_s: float = 0.0

    def __post_init__(self) -> None:
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
        """Rows of the bodies of some adjacent kinds, in arrays of bodies."""
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
        """The neighbours at time t, s: obstacles that do not exist then are moved far away.

        A controller that asks at its samples has an obstacle from the first sample at or after `appears_s` on.
        """
        if self._always:
            return near
        still, moving = self.there(t, self.resting)[self.owner], self.there(t, self.moving)[near.carrier]
        return near._replace(still=outline.where(still, near.still), parts=outline.where(moving, near.parts))

    def there(self, t: float, bodies: Sequence[Body]) -> Flags:
        """Which bodies exist at time t, s."""
        return np.array([body.appears_s <= t + SAME_S < body.disappears_s for body in bodies], dtype=np.bool_)

    @cached_property
    def still(self) -> Array:
        """Outlines of the convex parts of all bodies at rest, (m, W), world frame."""
        resting = [outline.moved(body.shape, body.start_m) for body in self.resting]
        return outline.joined(*resting) if resting else outline.stacked([])

    @cached_property
    def owner(self) -> Indices:
        """The body of each row of `still`, (m,), as an index in `resting`."""
        return np.repeat(np.arange(len(self.resting)), [len(body.shape) for body in self.resting])

    @cached_property
    def resting(self) -> tuple[Body, ...]:
        """The bodies that never move."""
        return tuple(body for body in self.bodies if body.plant is None)

    @cached_property
    def _always(self) -> bool:
        """Whether all bodies are always there."""
        return all(body.appears_s == 0.0 and body.disappears_s == np.inf for body in self.bodies)

    def velocities(self, t: float, commands: Array) -> Array:
        """Velocities of bodies that move at time t, s, (M, 3), m/s: commands of the robots, (r, 3), and scripts."""
        scripts = [body.plant.script.at(t)[1] for body in self.moving if isinstance(body.plant, Scripted)]
        return np.concatenate([commands, scripts]) if scripts else commands

    @cached_property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots."""
        return self.names(*ROBOTS)

    @cached_property
    def starts(self) -> Array:
        """Positions at the start of the bodies that move, of robots those of their steered points, (M, 3), m."""
        return _rows([body.start_m for body in self.moving])

    @cached_property
    def steering(self) -> Array | None:
        """The UGVs' steering parameters, (n, 6), see `model.plants.steering`; None if no UGV limits its commands."""
        of_ugvs = [body.plant.steering if body.plant else None for body in self.bodies[self.select("ugv")]]
        if all(numbers is None for numbers in of_ugvs):
            return None
        return np.array([np.zeros(NUMBERS) if numbers is None else numbers for numbers in of_ugvs])

    @cached_property
    def signals(self) -> tuple[str, ...]:
        """Names of the recorded signals of robots off their steered points, in the order of the world."""
        robots = [body for body in self.moving if body.kind in ROBOTS and body.plant is not None]
        return tuple(f"{body.name}.{name}" for body in robots if body.plant for name in body.plant.signals)

    @cached_property
    def radius(self) -> Array:
        """Radii of the robots, in the order of the world, m."""
        return np.array([float(body.shape[0, outline.RADIUS]) for body in self.bodies if body.kind in ROBOTS])

    def apart(self, first: Kind, second: Kind) -> float:
        """Safe distance between the surfaces of bodies of two kinds, m; 0 if none is declared."""
        return self.apart_m.get(frozenset((first, second)), 0.0)

    def around(self, rows: slice) -> Neighbours:
        """The bodies that the robots in some rows keep away from."""
        members = np.arange(len(self.moving))[rows]
        parts = outline.joined(*(body.shape for body in self.moving))
        carrier = np.repeat(np.arange(len(self.moving)), [len(body.shape) for body in self.moving])
        others = np.array([np.flatnonzero(carrier != i) for i in members], dtype=np.intp).reshape(len(members), -1)
        robots = [self.bodies[i] for i in members]
        distance = [
            np.concatenate([self.keep(i, self.still), self._beside(robot, radius)[other]])
            for i, robot, radius, other in zip(members, robots, self.radius[members], others, strict=True)
        ]
        share = np.array([
            [self._share(robot, body) for body in (self.moving[j] for j in carrier[other])]
            for robot, other in zip(robots, others, strict=True)
        ]).reshape(others.shape)  # fmt: skip
        return Neighbours(
            members, carrier, others, self.still, parts, np.array(distance).reshape(len(members), -1),
            np.hstack([np.reshape([self.shares(i, self.still) for i in members], (len(members), -1)), share]),
            _rows([robot.mobility for robot in robots]), np.array([robot.max_speed_m_s for robot in robots]),
        )  # fmt: skip

    def _share(self, robot: Body, other: Body) -> float:
        """The share of the inequality that a robot takes beside a moving body; negative as in `Neighbours`."""
        if other.kind not in ROBOTS:
            return float(self.shares(self.index(robot.name), other.shape[:1])[0])
        unsure_m = self.unsure_s * other.max_speed_m_s if robot.kind == other.kind == "ugv" else 0.0
        return -unsure_m or 0.5

    def shares(self, robot: int, rows: Array) -> Array:
        """The parts of inequalities that a robot takes beside obstacles (m, W): (m,)."""
        return np.where(rows[:, outline.SPEED] > 0.0, -self.bodies[robot].error_m or 1.0, 1.0)

    def keep(self, robot: int, rows: Array) -> Array:
        """Distances that the law keeps between a robot's steered point and the cores of obstacles (m, W): (m,), m."""
        keep, bounds = outline.keep(rows, float(self.radius[robot])), self.bodies[robot].bounds
        if bounds.exact:
            return keep
        at_rest = law_distance(keep, bounds, gain=self.gain_1_s)
        return np.where(
            rows[:, outline.SPEED] > 0.0, law_distance(keep, bounds, gain=self.gain_1_s, passive=True), at_rest
        )

    def _beside(self, robot: Body, radius: float) -> Array:
        """Distances that the law keeps from the parts that move, of obstacles and of other robots, (P,), m."""
        return np.concatenate([
            law_distance(
                self.apart(robot.kind, body.kind) + (radius + body.shape[:, outline.RADIUS]), robot.bounds, body.bounds,
                gain=self.gain_1_s,
            ) if body.kind in ROBOTS
            else self.keep(self.index(robot.name), body.shape)
            for body in self.moving
        ])  # fmt: skip


def _rows(points: Sequence[Array]) -> Array:
    """Points as rows, (n, 3), also if n is 0."""
    return np.array(points, dtype=np.float64).reshape(-1, 3)
