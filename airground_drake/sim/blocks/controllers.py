"""Sampled NSBC controllers of the UGVs and of the UAV.

Both act on what planner and gatekeeper decide at the same instant: Drake makes all unrestricted updates of an instant
before the discrete ones. So the controllers' updates must stay discrete, and those of planner and gatekeeper
unrestricted.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem, NumericParameterIndex

from airground_drake.base.arrays import Array, read_only
from airground_drake.base.errors import PluginError, described, raised_as, short
from airground_drake.model.bodies.world import Neighbours, World
from airground_drake.model.geometry import moving, outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.task import Task
from airground_drake.model.law.tasks import FormationTask
from airground_drake.model.law.ugv_law import AcceptedMotion, UgvLaw
from airground_drake.model.plants.steering import steer_all
from airground_drake.sim.blocks.lifetime import declare_cached, declare_output, weakly
from airground_drake.sim.blocks.signals import Messages, UavGains, UgvGains, declare_bodies, declare_headings
from airground_drake.uav.messages import NOTHING, accepted_proposals
from airground_drake.uav.policy import Proposal


class _Controller(LeafSystem):
    """A sampled controller whose gains are parameters of its Context."""

    def _declare_gains(self, view: Any, gains: Sequence[float], model: Any, period_s: float) -> None:
        """Declare the gains, named as in `view`, and a cached value like `model` that `_with_gains` computes."""
        self._view, self._most = view, max(1.0 / period_s, *gains)
        index = NumericParameterIndex(self.DeclareNumericParameter(BasicVector(list(gains))))
        self._gains_ticket = self.numeric_parameter_ticket(index)
        self._cached = declare_cached(self, "law in force", model, type(self)._checked, {self._gains_ticket})

    def mutable_gains(self, context: Context) -> Any:
        """The gains in force as a named view; assigning to it changes the gains in this Context."""
        return self._view(context.get_mutable_numeric_parameter(0).get_mutable_value())

    def _with_gains(self, *gains: float) -> Any:
        raise NotImplementedError

    def _checked(self, context: Context) -> Any:
        gains = context.get_numeric_parameter(0).value().tolist()
        for name, gain in zip(self._view.get_fields(), gains, strict=True):
            if not 0.0 <= gain <= self._most:
                wanted = f"allowed: 0 to {self._most:.9g} 1/s, one over the control period"
                raise ValueError(f"{name} = {gain!r} in the Context of {self.GetSystemPathname()}; {wanted}")
        return self._with_gains(*gains)

    def _in_force(self, context: Context) -> Any:
        """The result of `_with_gains` for the gains in force."""
        return self.get_cache_entry(self._cached).Eval(context)


class UgvController(_Controller):
    """NSBC of all UGVs, see `UgvLaw`: avoidance (7)-(8), tracking (6), intervention (14), composed as (5) or (20).

    Ports (n UGVs, M bodies that move, world frame):
        in  `bodies` (3M) m; `reference` (6n): preset positions m, then velocities m/s;
            `proposals` abstract, n of Proposal or None; `answers` (2n), see `messages`. With unicycles `headings` (n),
            rad: their commands are shortened to feasible ones, see `model.plants.steering`.
        out `command` (3n) m/s; `executing` (n), number of the proposal executed, -1 without one; both held.
            With unicycles `command_share` (n), the factor by which each command was shortened, held.
            `gains`, the `UgvGains` in force, for the gatekeeper, which predicts the command.
    Parameters: `UgvGains`; by default those of the law. ValueError if one is negative, or above one over the control
    period. The sensing range is fixed at construction.
    Rate: one update per control period, from t = 0.

    Attributes:
        law: the control law, with the default gains.
        avoidance: its avoidance layer.
    """

    def __init__(self, world: World, law: UgvLaw) -> None:
        super().__init__()
        n = len(world.names("ugv"))
        self.law, self.avoidance, self._world = law, law.avoidance, world
        self._near = world.around(world.select("ugv"))
        self._bodies = declare_bodies(self, world)
        self._headings = declare_headings(self, world)
        self._reference = self.DeclareVectorInputPort("reference", 6 * n)
        self._proposals = Messages(self, "proposals", n, Proposal)
        self._answers = self.DeclareVectorInputPort("answers", 2 * n)
        command = self.DeclareDiscreteState(3 * n)
        executing = self.DeclareDiscreteState([NOTHING] * n)
        self.DeclareStateOutputPort("command", command)
        self.DeclareStateOutputPort("executing", executing)
        if self._headings is not None:
            self.DeclareStateOutputPort("command_share", self.DeclareDiscreteState(np.ones(n)))
        gains = law.avoidance.gain, law.motion_gain, law.intervention_gain
        self._declare_gains(UgvGains, gains, law, law.avoidance.period)
        declare_output(self, "gains", len(gains), type(self)._gains, {self._gains_ticket})
        self.DeclarePeriodicDiscreteUpdateEvent(law.avoidance.period, 0.0, weakly(self._update))

    def parameters(self, context: Context) -> dict[str, Any]:
        """Its parameters, see `read_back`, and whether it puts interventions above avoidance."""
        return of_ugvs(self._near, self._in_force(context), len(self._world.robots), sampling_of(self))

    def _with_gains(self, *gains: float) -> UgvLaw:
        return self.law.with_gains(*gains)

    def _gains(self, context: Context) -> list[float]:
        law: UgvLaw = self._in_force(context)
        return [law.avoidance.gain, law.motion_gain, law.intervention_gain]

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = _finite(self._bodies.Eval(context)).reshape(-1, 3)
        reference, rate = self._reference.Eval(context).reshape(2, -1, 3)
        proposals = accepted_proposals(self._proposals.Eval(context), self._answers.Eval(context))
        headings = None if self._headings is None else self._headings.Eval(context)
        law = self._in_force(context)
        velocity = self._commanded(context, context.get_time(), positions, reference, rate, proposals, headings, law)
        steering = self._world.steering
        if headings is not None and steering is not None:  # there are both, or neither
            discrete.set_value(2, steer_all(velocity, headings, steering, self.law.avoidance.period))
        discrete.set_value(0, velocity.ravel())
        discrete.set_value(1, [NOTHING if proposal is None else float(proposal.number) for proposal in proposals])

    def _commanded(self, context: Context, t: float, positions: Array, *about: Any) -> Array:
        """`velocity`; subclasses also use further ports."""
        return self.velocity(t, positions, *about)

    def velocity(
        self,
        t: float,
        positions: Array,
        reference: Array,
        rate: Array,
        accepted: Sequence[Proposal | None],
        headings: Array | None = None,
        law: UgvLaw | None = None,
    ) -> Array:
        """Commands of the law, before they are shortened. Returns commands, (n, 3), m/s."""
        # t: s; positions: (M, 3), m; reference: (n, 3), m; rate: (n, 3), m/s; headings: (n,), rad
        # law: default: the one with the default gains.
        law = self.law if law is None else law
        asked = [None if p is None else asked_at(p, t) for p in accepted]
        steering = self._world.steering
        steered = None if steering is None or headings is None else (headings, steering)
        return law.velocity(positions, self._world.at(self._near, t), reference, rate, asked, steered)


def asked_at(proposal: Proposal, t: float) -> AcceptedMotion:
    """The demand of an accepted proposal at time t, s."""
    motion = proposal.motion
    wanted, rate = moving.at(motion.times, motion.positions, motion.slopes, t)
    return AcceptedMotion(wanted, rate, proposal.chosen)


class UavController(_Controller):
    """NSBC of a UAV: obstacle avoidance (11) above a task, by default to stay over its UGVs' centroid, (9)-(10).

    Ports (n UGVs, M bodies that move, world frame):
        in  `bodies` (3M) m; `ugv_command` (3n) m/s, fed forward as the centroid's rate.
        out `command` (3) m/s, held.
    Parameters: `UavGains`, within the same limits as `UgvGains`.
    Rate: one update per control period, from t = 0.

    Attributes:
        avoidance: the set-based layer, with the default gain.
    """

    def __init__(
        self,
        world: World,
        avoidance: Avoidance,
        *,
        gain: float,
        altitude: float,
        uav: str = "",
        ugvs: Sequence[str] = (),
        task: Callable[[Array, Array, float, float], Task] = FormationTask,
    ) -> None:
        """Declare ports, state and the periodic update.

        Args:
            world: the bodies.
            avoidance: the set-based layer.
            gain: of the task, 1/s, by default.
            altitude: m.
            uav: name of the UAV; default: the first of the world.
            ugvs: names of the k UGVs that it is in charge of; default: all.
            task: makes the task of a sample from positions (k, 3), m, and velocities (k, 3), m/s, of these UGVs,
                altitude and gain; it gives the velocity of one robot, (1, 3), m/s.
        """
        super().__init__()
        self.avoidance = avoidance
        self._task = task
        self._gain = gain
        self._altitude = altitude
        row = world.robots.index(uav) if uav else world.select("uav").start
        self._world, self._own = world, slice(row, row + 1)
        some = 0 < len(ugvs) < len(world.names("ugv"))
        self._ugvs = [world.index(ugv) for ugv in ugvs] if some else world.select("ugv")
        self._near = world.around(self._own)
        self._bodies = declare_bodies(self, world)
        self._ugv_command = self.DeclareVectorInputPort("ugv_command", 3 * len(world.names("ugv")))
        command = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("command", command)
        self._declare_gains(UavGains, (avoidance.gain, gain), avoidance, avoidance.period)
        self.DeclarePeriodicDiscreteUpdateEvent(avoidance.period, 0.0, weakly(self._update))

    def parameters(self, context: Context) -> dict[str, Any]:
        """Its parameters, see `read_back`."""
        return read_back(self._near, self._in_force(context)[0], len(self._world.robots), sampling_of(self))

    def _with_gains(self, *gains: float) -> tuple[Avoidance, float]:
        return replace(self.avoidance, gain=gains[0]), gains[1]

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = _finite(self._bodies.Eval(context)).reshape(-1, 3)
        commands = self._ugv_command.Eval(context).reshape(-1, 3)
        discrete.set_value(0, self.velocity(context.get_time(), positions, commands, *self._in_force(context)))

    def velocity(
        self,
        t: float,
        positions: Array,
        ugv_commands: Array,
        avoidance: Avoidance | None = None,
        gain: float | None = None,
    ) -> Array:
        """Command of the law, (3,), m/s; `t` in s; `positions` (M, 3), m; `ugv_commands` (n, 3), m/s."""
        # avoidance: the set-based layer; default: with the default gain.
        # gain: of the task, 1/s; default: as it was built.
        avoidance = self.avoidance if avoidance is None else avoidance
        gain = self._gain if gain is None else gain
        near = self._world.at(self._near, t)
        velocity: Array = avoidance.command(self._asked(positions, ugv_commands, gain), positions, near)[0]
        return velocity

    def _asked(self, positions: Array, ugv_commands: Array, gain: float) -> Array:
        """Velocity demanded by the task, (1, 3), m/s, checked for third-party tasks."""
        ugvs, own, ugv_commands = positions[self._ugvs], positions[self._own], ugv_commands[self._ugvs]
        if self._task is FormationTask:
            return FormationTask(ugvs, ugv_commands, self._altitude, gain).velocity(own)
        name = getattr(self._task, "__name__", type(self._task).__name__)
        place = getattr(self._task, "__init__", None)
        with raised_as(lambda error: PluginError(f"the UAV's task {name} raised {described(error, place)}")):
            task = self._task(read_only(ugvs), read_only(ugv_commands), self._altitude, gain)
            asked: object = task.velocity(read_only(own))
        return _velocity_of(name, asked, own)


def sampling_of(system: LeafSystem) -> list[float]:
    """Period and offset of a sampled system, s."""
    timing = system.GetUniquePeriodicDiscreteUpdateAttribute()
    return [timing.period_sec(), timing.offset_sec()]


def of_ugvs(near: Neighbours, law: UgvLaw, robots: int, sampling_s: list[float]) -> dict[str, Any]:
    """Parameters of the UGVs' controller, see `read_back`, and whether it puts interventions above avoidance."""
    parameters = read_back(near, law.avoidance, robots, sampling_s)
    return {**parameters, "composition": law.avoidance.composition, "intervention_on_top": law.intervention_on_top}


def read_back(near: Neighbours, avoidance: Avoidance, robots: int, sampling_s: list[float]) -> dict[str, Any]:
    """The parameters with which a controller's avoidance runs, strict JSON, for the trace; `robots` move."""
    # Returns for its k robots: `members`, their indices in the order of the world; `outlines` of the m convex parts at
    # rest, without padding, one after the other; `moving_outlines`, those of obstacles that move, about their origins,
    # if there are any; `stands`, if robots stand where inequalities contradict one another; `others`, indices of the
    # bodies of the n parts that each avoids besides what is at rest, (k, n);
    # `safe_m` and `share` beside the parts at rest, then beside the others, (k, m + n); `mobility` (k, 3);
    # `max_speed_m_s` (k,). For the layer: `sampling_s`, period and offset; `gain_1_s`, `period_s`, `sensing_range_m`.
    # Arrays are flat, in C order; `safe_m` and `share` are lists of [value, number of repetitions].
    moving = [number for row in near.parts[robots:] for number in outline.as_tuple(row)]
    more: dict[str, Any] = {"moving_outlines": moving} if moving else {}
    return (
        more
        | ({"stands": True} if avoidance.stands else {})
        | {
            "members": near.members.tolist(),
            "outlines": [number for row in near.still for number in outline.as_tuple(row)],
            "others": near.carrier[near.others].ravel().tolist(),
            "safe_m": _in_runs(near.distance),
            "share": _in_runs(near.share),
            "mobility": near.mobility.ravel().tolist(),
            "max_speed_m_s": near.max_speed.tolist(),
            "sampling_s": sampling_s,
            "gain_1_s": avoidance.gain,
            "period_s": avoidance.period,
            "sensing_range_m": avoidance.sensing_range,
        }
    )


def _in_runs(array: Array) -> list[list[float]]:
    """Runs of equal values as [value, length]: 100 robots and 1,000 obstacles have 110,000 distances, mostly equal."""
    return [[value, len(list(alike))] for value, alike in groupby(array.ravel().tolist())]


def _finite(positions: Array) -> Array:
    """The positions, checked to be finite."""
    # PluginError if one is not finite, because no robot could avoid such a body.
    if not math.isfinite(positions @ positions) and not np.isfinite(positions).all():  # quickly, then exactly
        raise PluginError(f"positions are not finite, from a plant or a disturbance: {short(repr(positions.tolist()))}")
    return positions


def _velocity_of(task: str, answer: object, position: Array) -> Array:
    """The velocity demanded by a task, checked; `task` is its name, for messages."""
    try:
        asked = np.asarray(answer)
    except ValueError as error:  # rows of different lengths
        raise PluginError(f"the UAV's task {task} asks for a velocity that is no array: {described(error)}") from error
    if asked.shape != position.shape or asked.dtype.kind not in "fiu" or not np.isfinite(asked).all():
        given, wanted = short(repr(asked.tolist())), f"wanted: {position.shape} finite numbers, m/s"
        raise PluginError(f"the UAV's task {task} asks for {given} as velocity; {wanted}")
    return asked.astype(np.float64, copy=False)
