"""The interface of intervention policies: what a policy sees, and what it proposes."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np

from airground_drake.base.arrays import LARGEST, Array, read_only
from airground_drake.base.history import Immutable
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.task import pseudoinverse

Answered = Literal["silent", "accepted", "refused"]
"""A UGV's answer to its proposal in force."""


@dataclass(frozen=True, eq=False)
class Teammate:
    """The UAV's knowledge of one UGV.

    Attributes:
        name: of the UGV.
        position: (3,), m, world frame.
        target: (3,), m.
        preset: its preset trajectory.
        max_speed: m/s.
        triggered: whether its trigger is in mode INTERVENING.
        standing: whether it has stood still for `halts.STANDS_S`.
        proposal: its proposal in force, or None.
        answered: its answer to that proposal.
        refusals: number of proposals that it has refused in the current intervention.
        too_fast: number of motions that its plant could not follow, by its limits or lag: it would have stalled
            on the way and refused them, or was left behind by them.
        resting: whether it gets no proposal now because it has refused one recently.
        radius: of its body, m.
        in_charge: whether the UAV that plans is in charge of it; if not, `proposal` is that of another UAV.
    """

    name: str
    position: Array
    target: Array
    preset: Motion
    max_speed: float
    triggered: bool
    standing: bool
    proposal: Proposal | None = None
    answered: Answered = "silent"
    refusals: int = 0
    too_fast: int = 0
    resting: bool = False
    radius: float = 0.0
    in_charge: bool = True


@dataclass(frozen=True, eq=False)
class MovingObstacle:
    """The UAV's knowledge of a moving obstacle.

    Attributes:
        name: of the obstacle.
        outlines: of its convex parts about its origin, (k, W), see `model.geometry.outline`.
        position: of its origin, (3,), m, world frame: as it is now, or as a UGV last reported it.
        velocity: of then, (3,), m/s.
        motion: where its origin is predicted to be.
    """

    name: str
    outlines: Array
    position: Array
    velocity: Array
    motion: Motion

    def distances(self, radius: float) -> Array:
        """Distances to keep between the centre of a UGV with this radius, m, and the cores of its parts, (k,), m."""
        return outline.keep(self.outlines, radius)


@dataclass(frozen=True)
class Observation:
    """The UAV's knowledge when it plans for one UGV.

    Attributes:
        t: time, s.
        start: earliest time at which a proposal made now can act, s; messages take a period each way.
        robot: name of the UGV.
        position: its position, (3,), m, world frame.
        target: its target, (3,), m.
        preset: its preset trajectory.
        obstacles: outlines of all obstacles at rest that the UAV knows, from its own map and from answers, (m, W); see
            `model.geometry.outline`.
        mapped: outlines of the obstacles on its own map, (k, W).
        others: positions of the other robots, (n, 3), m.
        refusals: number of proposals that the UGV has refused since the trigger.
        team: all UGVs in array order, this one among them.
        robot_distance: distance that two UGVs have to keep, between surfaces, m.
        radius: of the UGV's body, m.
        moving: obstacles that move and that the UAV knows.
    """

    t: float
    start: float
    robot: str
    position: Array
    target: Array
    preset: Motion
    obstacles: Array
    mapped: Array
    others: Array
    refusals: int
    team: tuple[Teammate, ...] = ()
    robot_distance: float = 0.0
    radius: float = 0.0
    moving: tuple[MovingObstacle, ...] = ()

    @property
    def obstacle_distances(self) -> Array:
        """Distances to keep between the centre of the UGV and the core of each obstacle, (m,), m."""
        return outline.keep(self.obstacles, self.radius)

    def distance_to(self, mate: Teammate) -> float:
        """Distance to keep between the centres of the UGV and of another one, m."""
        return self.robot_distance + (self.radius + mate.radius)

    def fresh(self) -> Self:
        """A copy with read-only arrays of its own. A policy that changes the copy changes nothing else."""
        return _fresh(self)


@dataclass(frozen=True, eq=False)
class Proposal(Immutable):
    """The message that the UAV sends to one UGV: its intervention task, eqs (12)-(14), as data.

    Attributes:
        policy: name of the policy that made it.
        issued: time of sending, s.
        motion: desired value of the task over time: where the UGV should be.
        selection: J_int, (m, 3), directions in which the UAV intervenes (default: all).
        mapped: outlines of obstacles that the UAV knows, (k, W). The UGV uses them only to judge how useful the
            proposal is.
        cause: name of the UGV whose trigger led to the proposal. If it names another UGV, this one is asked to make
            way for it. Empty: this UGV.
        party: names of all UGVs in the same joint plan; empty: the proposal stands alone.
        beside: what the same joint plan asks of the others, by name, so that a UGV needs no other message to judge it.
        number: identifies the proposal in the UGV's answer. `planner.sent_after` gives it; before that it is -1.
        sender: name of the UAV that sends it, as `planner.sent_after` gives it.
    """

    policy: str
    issued: float
    motion: Motion
    selection: Array = field(default_factory=lambda: np.eye(3))
    mapped: Array = field(default_factory=lambda: outline.stacked([]))
    cause: str = ""
    party: tuple[str, ...] = ()
    beside: tuple[tuple[str, Motion], ...] = ()
    number: int = -1
    sender: str = ""

    @property
    def joint(self) -> tuple[float, tuple[str, ...]]:
        """Key of the joint plan that this proposal is a part of: time of sending, s, and party."""
        return self.issued, self.party

    @cached_property
    def chosen(self) -> Array:
        """J_int^+ J_int, the projector onto the directions in which the UAV intervenes, (3, 3)."""
        return pseudoinverse(self.selection) @ self.selection


SHORTEST_LEG_S = 1e-8
"""Least time between the vertices of a proposed motion, s. Times of a run are rounded to about 1e-13 s: a shorter
leg has no meaningful velocity."""


class Policy(abc.ABC):
    """An intervention behaviour of the UAV. Subclasses take their parameters as keyword numbers.

    A policy may fail: if it raises, or returns anything but None or motions of numbers up to `LARGEST`, there is no
    intervention and the failure is reported (see `database.py`). No policy's code runs in a UGV's control loop.
    Third-party policies run in processes of their own (see `guest/process.py`).

    Attributes:
        counted: whether counts bound the effort of a proposal. Then `intervention.budget_s` does not stop it, and runs
            are the same on every machine.
        reason: why the last call of `propose` left a UGV without a way, as words for the report; may be empty.
        remembered: what `propose` remembers for its next call, None at the beginning of a run. The planner keeps it in
            the Context. Assign another object to it; do not change the object.
    """

    counted: ClassVar[bool] = False
    reason: str = ""
    remembered: Any = None

    @abc.abstractmethod
    def propose(self, seen: Observation) -> Motion | Mapping[str, Motion] | None:
        """Propose a motion from `seen.start` on, motions for several UGVs, or None for no intervention.

        A Motion is for the UGV `seen.robot`. Motions by name are a joint plan for UGVs in the UAV's charge. UGVs in it
        that are triggered get proposals of their own; the others are asked to make way for `seen.robot`. A UGV that has
        got a proposal at this instant (`issued == seen.t`) cannot be in the plan.
        """


def motions_of(proposed: object, seen: Observation) -> dict[str, Motion]:
    """A policy's proposal as plain motions by UGV, so that none of its code is called later; empty: no intervention.

    Raises:
        TypeError: if it is neither a motion nor motions by name.
        ValueError: if a name is not a UGV in the UAV's charge, a UGV has got a proposal at this instant, vertices are
            less than `SHORTEST_LEG_S` apart, or a number exceeds `LARGEST`.
    """
    if proposed is None:
        return {}
    if not isinstance(proposed, Mapping):
        proposed = {seen.robot: proposed}
    known = {seen.robot, *(mate.name for mate in seen.team if mate.in_charge)}
    taken = {mate.name for mate in seen.team if mate.proposal is not None and mate.proposal.issued == seen.t}
    motions = {}
    for name, motion in list(proposed.items()):
        if not isinstance(name, str) or name not in known:
            raise ValueError(f"a policy proposes to UGVs in the UAV's charge, not to {name!r}")
        if not isinstance(motion, Motion):
            given = f"{type(motion).__name__} for {name}"
            raise TypeError(f"a policy proposes a Motion, Motions by UGV or None, not {given}")
        if name in taken:
            raise ValueError(f"{name} has a proposal of this instant already")
        plain = Motion(motion.times, motion.positions)
        if max(np.abs(plain.times).max(), np.abs(plain.positions).max()) > LARGEST:
            raise ValueError(f"the times and coordinates of a proposed motion must be at most {LARGEST:g} in size")
        if (np.diff(plain.times) < SHORTEST_LEG_S).any():
            raise ValueError(f"the vertices of a proposed motion must be {SHORTEST_LEG_S:g} s apart at least")
        motions[str(name)] = plain
    return motions


def _fresh(value: Any) -> Any:
    """A deep copy of a dataclass with read-only arrays."""
    if isinstance(value, np.ndarray):
        return read_only(value)
    if isinstance(value, tuple):
        return tuple(map(_fresh, value))
    if is_dataclass(value) and not isinstance(value, type):
        given = [parameter.name for parameter in fields(value) if parameter.init]
        return replace(value, **{name: _fresh(getattr(value, name)) for name in given})
    return value
