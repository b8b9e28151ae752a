"""What an intervention policy sees and what it proposes: the plug-in interface of the behaviour database."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np

from airground_drake.base.arrays import LARGEST, Array, read_only
from airground_drake.geometry.motion import Motion
from airground_drake.nsbc.task import pseudoinverse

Answered = Literal["silent", "accepted", "refused"]
"""What has become of a proposal in force."""


@dataclass(frozen=True, eq=False)
class Teammate:
    """What the UAV knows of one UGV.

    Attributes:
        name: of the UGV.
        position: (3,), m, world frame.
        target: (3,), m.
        preset: its preset trajectory.
        max_speed: m/s.
        triggered: whether its trigger has it in mode INTERVENING.
        standing: whether it has stood where it is for a while (`halts.STANDS_S`).
        proposal: the one in force, or None.
        answered: what the UGV says to it.
        refusals: proposals that it has refused since its trigger, or since that of the UGV that it was asked for.
        resting: whether it has refused so recently that it gets no proposal now.
        radius: of its body, m.
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
    resting: bool = False
    radius: float = 0.0


@dataclass(frozen=True)
class Observation:
    """What the UAV knows when it plans for one UGV.

    Attributes:
        t: time, s.
        start: earliest time at which a proposal made now can act, s (messages take a period each way).
        robot: name of the UGV.
        position: its position, (3,), m, world frame.
        target: its target, (3,), m.
        preset: its preset trajectory.
        obstacles: centres of the obstacles that the UAV knows: its own map, and what answers have taught it,
            (m, 3), m.
        mapped: those of its own map alone, (k, 3), m.
        others: positions of the other robots, (n, 3), m.
        safe_distance: distance d to keep from obstacles, between surfaces, m.
        refusals: number of proposals that the UGV has refused since the trigger.
        team: every UGV, this one among them, in array order.
        robot_distance: distance that two UGVs have to keep, between surfaces, m.
        radius: of the UGV's body, m.
        obstacle_radii: of the obstacles, (m,), m, or one for all.
        mapped_radii: of those of its own map, (k,), m, or one for all.
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
    safe_distance: float
    refusals: int
    team: tuple[Teammate, ...] = ()
    robot_distance: float = 0.0
    radius: float = 0.0
    obstacle_radii: Array | float = 0.0
    mapped_radii: Array | float = 0.0

    @property
    def obstacle_distances(self) -> Array:
        """Distances to keep from the obstacles, of the UGV's centre from theirs, (m,), m."""
        return self.safe_distance + (self.radius + np.broadcast_to(self.obstacle_radii, len(self.obstacles)))

    def distance_to(self, mate: Teammate) -> float:
        """Distance that the UGV has to keep from another one, of its centre from its, m."""
        return self.robot_distance + (self.radius + mate.radius)

    def fresh(self) -> Self:
        """A copy whose arrays are its own and read-only: whatever becomes of it, nothing else changes."""
        return _fresh(self)


@dataclass(frozen=True, eq=False)
class Proposal:
    """The UAV's intervention task for one UGV, eqs (12)-(14), as data: the message that is sent.

    Attributes:
        policy: name of the policy that made it.
        issued: time of sending, s.
        motion: desired value of the task over time: where the UGV is to be.
        selection: J_int, (m, 3), directions in which the UAV intervenes (default: all).
        mapped: obstacles that the UAV knows, (k, 3), m: a UGV judges by them how useful the proposal is, and nothing
            else rests on them.
        cause: name of the UGV whose trigger it is sent for: another one's, if this UGV is asked to make way for it;
            empty: its own.
        mapped_radii: of the obstacles that the UAV knows, (k,), m, or one for all.
        party: names of all UGVs with a part in the same joint plan; empty: the proposal stands alone.
        number: identifies the proposal in the UGV's answer. It is given when the proposal is sent, see
            `planner.sent_after`; before that it is -1.
    """

    policy: str
    issued: float
    motion: Motion
    selection: Array = field(default_factory=lambda: np.eye(3))
    mapped: Array = field(default_factory=lambda: np.empty((0, 3)))
    cause: str = ""
    mapped_radii: Array | float = 0.0
    party: tuple[str, ...] = ()
    number: int = -1

    @property
    def joint(self) -> tuple[float, tuple[str, ...]]:
        """What all parts of a joint plan have in common, and nothing else: time of sending, s, and party."""
        return self.issued, self.party

    @cached_property
    def chosen(self) -> Array:
        """J_int^+ J_int, the projector onto the directions in which the UAV intervenes, (3, 3)."""
        return pseudoinverse(self.selection) @ self.selection

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


SHORTEST_LEG_S = 1e-8
"""Vertices of a proposed motion are so far apart at least, s: times of a run are rounded to 1e-13 s and more, and a leg
that is hardly longer has no velocity to speak of."""


class Policy(abc.ABC):
    """An intervention behaviour of the UAV. Subclasses take their parameters as keyword numbers.

    A policy may fail: an exception, or anything but None or motions of numbers up to `LARGEST` in size, counts as no
    intervention and is reported (see `database.py`). No policy's code runs in a UGV's control loop, and one that does
    not come with the package runs in a process of its own (see `process.py`).

    Attributes:
        counted: whether a proposal's effort is bounded in counts. Then it is not stopped after `intervention.budget_s`,
            and runs are the same on every machine.
    """

    counted: ClassVar[bool] = False

    @abc.abstractmethod
    def propose(self, seen: Observation) -> Motion | Mapping[str, Motion] | None:
        """What is proposed from `seen.start` on, or None for no intervention.

        A Motion is for the UGV that the observation is about. Motions by name are a joint plan, for any UGVs of the
        team: those that are triggered get proposals of their own, others are asked to make way for this one. Only a
        UGV that has a proposal of this very instant (`issued == seen.t`) cannot be asked again.
        """


def motions_of(proposed: object, seen: Observation) -> dict[str, Motion]:
    """A policy's answer as plain data, so that none of its code is called later; empty: nothing.

    Raises:
        TypeError: if it is neither a motion nor motions by name.
        ValueError: if it names what is no UGV of the team, asks one again that has a proposal of this instant, has
            vertices that are hardly apart in time, or numbers beyond `LARGEST`.
    """
    if proposed is None:
        return {}
    if not isinstance(proposed, Mapping):
        proposed = {seen.robot: proposed}
    known = {seen.robot, *(mate.name for mate in seen.team)}
    taken = {mate.name for mate in seen.team if mate.proposal is not None and mate.proposal.issued == seen.t}
    motions = {}
    for name, motion in list(proposed.items()):
        if not isinstance(motion, Motion):
            raise TypeError(f"a policy proposes a Motion, Motions by UGV or None, not {type(motion).__name__}")
        if not isinstance(name, str) or name not in known:
            raise ValueError(f"a policy proposes to UGVs of the team, not to {name!r}")
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
    """A copy of a dataclass, and of what is in it, with arrays of its own that are read-only."""
    if isinstance(value, np.ndarray):
        return read_only(value)
    if isinstance(value, tuple):
        return tuple(map(_fresh, value))
    if is_dataclass(value) and not isinstance(value, type):
        given = [each.name for each in fields(value) if each.init]
        return replace(value, **{name: _fresh(getattr(value, name)) for name in given})
    return value
