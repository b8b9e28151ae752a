"""Watches commands for violations while a run is simulated."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from airground_drake.base.arrays import Array
from airground_drake.base.history import Immutable
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.world import World
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.plants.steering import steer_all
from airground_drake.sim.blocks.lifetime import declare_output, weakly
from airground_drake.sim.blocks.signals import Messages, declare_bodies, declare_headings
from airground_drake.uav.messages import accepted_proposals
from airground_drake.uav.policy import Proposal

INEQUALITY_TOLERANCE_M_S = 1e-9
"""Tolerance of inequalities and limits, m/s, as in reports: rounding errors are about 1e-13 m/s."""
LAW_TOLERANCE_M_S = 1e-6
"""Tolerance of the difference between a command and the law, m/s: rounding of two algorithms at the same
positions."""


class Rule(IntEnum):
    """Rules that commands must keep."""

    AVOIDANCE = 0
    SPEED_LIMIT = 1
    PLANAR_MOTION = 2
    LAW = 3


class Violation(NamedTuple):
    """The first violation of a run.

    Attributes:
        t_s: control sample at which the command was chosen.
        robot: index in the order of the world.
        rule: the broken rule.
        amount_m_s: size of the violation.
    """

    t_s: float
    robot: int
    rule: Rule
    amount_m_s: float


@dataclass(frozen=True, eq=False)
class Sample:
    """Inputs of the controllers at a control sample."""

    t: float
    positions: Array
    reference: Array | None
    commands_before: Array
    headings: Array | None = None


@dataclass(frozen=True)
class Memory(Immutable):
    """Memory of the monitor."""

    sample: Sample | None = None
    violation: Violation | None = None


@dataclass(frozen=True)
class Laws:
    """Laws that commands are compared with, made separately from those of the diagram.

    Attributes:
        ugvs: commands (n, 3), m/s, from the time, positions (M, 3), preset positions and velocities (n, 3) each, the
            accepted proposal or None of each UGV, and with unicycles the headings (n,), rad.
        uav: commands of u UAVs, (u, 3), m/s, from the time, positions (M, 3), m, and the UGVs' commands (n, 3), m/s,
            one sample earlier.
    """

    ugvs: Callable[[float, Array, Array, Array, Sequence[Proposal | None], Array | None], Array]
    uav: Callable[[float, Array, Array], Array]


class Monitor(LeafSystem):
    """Finds the first command of a diagram that violates the safety theorem's hypotheses or (6)-(11), (14), (20).

    It checks the avoidance inequalities, speed limits and planar motion of all robots. Given laws, it also compares the
    commands with them, as far as their inputs are connected.

    Ports (n UGVs, r robots, M bodies that move, world frame):
        in  `bodies` (3M) m; `team_command` (3r) m/s; for the laws: `reference` (6n): preset positions m,
            then velocities m/s; `proposals` abstract, n of Proposal or None; `answers` (2n), see `messages`. With
            unicycles `headings` (n), rad: their commands are compared with the law's as these can do them.
        out `violation` (5): 1 from the first violation on, else 0; then its control sample, s, the robot's index in
            the order of the world, the `Rule`, the amount, m/s (-1 each before a violation).
    State: abstract, a `Memory`.
    Rate: one update per control period, from t = 0. A command chosen at one tick is visible, and judged, at the next;
    so the last command of a simulation is not judged.

    It shares the compiled kernels with the controllers, so it finds wrong parameters, wiring, timing and composition.
    Claims that share nothing with the controllers judge the trace afterwards.
    """

    def __init__(
        self, world: World, avoidance: Avoidance, laws: Laws | None = None, *, terminate: bool = False
    ) -> None:
        """Declare ports, state and the periodic update.

        Args:
            world: the bodies that the commands are judged in.
            avoidance: the set-based layer.
            laws: None: inequalities and limits only.
            terminate: end the simulation at the first violation.
        """
        super().__init__()
        n = len(world.names("ugv"))
        self._world, self._robots, self._ugvs, self._uav = world, world.robots, world.select("ugv"), world.select("uav")
        self._near = world.around(world.select(*ROBOTS))
        self._avoidance, self._laws, self._terminate = avoidance, laws, terminate
        self._bodies, self._headings = declare_bodies(self, world), declare_headings(self, world)
        self._command = self.DeclareVectorInputPort("team_command", 3 * len(world.robots))
        self._reference = self.DeclareVectorInputPort("reference", 6 * n)
        self._proposals = Messages(self, "proposals", n, Proposal)
        self._answers = self.DeclareVectorInputPort("answers", 2 * n)
        self._memory = self.DeclareAbstractState(Value(Memory()))
        declare_output(self, "violation", 5, type(self)._violation, {self.abstract_state_ticket(self._memory)})
        self.DeclarePeriodicUnrestrictedUpdateEvent(avoidance.period, 0.0, weakly(self._update))

    def violation(self, context: Context) -> Violation | None:
        """The first violation up to the context's time."""
        return self._remembered(context).violation

    def _remembered(self, context: Context) -> Memory:
        memory: Memory = context.get_abstract_state(int(self._memory)).get_value()
        return memory

    def _violation(self, context: Context) -> list[float]:
        violation = self.violation(context)
        return [0.0, -1.0, -1.0, -1.0, -1.0] if violation is None else [1.0, *map(float, violation)]

    def _update(self, context: Context, state: State) -> EventStatus:
        memory = self._remembered(context)
        if memory.violation is not None:
            return EventStatus.DidNothing()
        violation = None if memory.sample is None else self._first(context, memory.sample)
        reference = self._reference.Eval(context).copy() if self._reference.HasValue(context) else None
        positions, commands = (port.Eval(context).reshape(-1, 3).copy() for port in (self._bodies, self._command))
        headings = None if self._headings is None else self._headings.Eval(context).copy()
        sample = Sample(context.get_time(), positions, reference, commands, headings)
        state.get_mutable_abstract_state(int(self._memory)).set_value(Memory(sample, violation))
        if violation is not None and self._terminate:
            what = f"{self._robots[violation.robot]} breaks {violation.rule.name} by {violation.amount_m_s:.3g} m/s"
            return EventStatus.ReachedTermination(self, f"{what} at t = {violation.t_s:.9g} s")
        return EventStatus.Succeeded()

    def _first(self, context: Context, sample: Sample) -> Violation | None:
        """The largest violation by the commands that were chosen at `sample` and are held until now."""
        commands = self._command.Eval(context).reshape(-1, 3)
        near = self._world.at(self._near, sample.t)
        spaces = self._avoidance.half_spaces(sample.positions, near)
        speed = np.linalg.norm(commands, axis=1)
        missed: dict[Rule, Array] = {
            Rule.AVOIDANCE: -spaces.slack(commands).min(axis=1, initial=np.inf),
            Rule.SPEED_LIMIT: speed - near.max_speed,
            Rule.PLANAR_MOTION: np.where(near.mobility[:, 2] == 0.0, np.abs(commands[:, 2]), 0.0),
        }
        for rule, amount in missed.items():
            robot = int(np.argmax(amount))
            if not amount[robot] <= INEQUALITY_TOLERANCE_M_S:
                return Violation(sample.t, robot, rule, float(amount[robot]))
        if self._laws is None:
            return None
        away = np.linalg.norm(commands - self._by_the_laws(context, sample, self._laws, commands), axis=1)
        robot = int(np.argmax(away))
        return Violation(sample.t, robot, Rule.LAW, float(away[robot])) if away[robot] > LAW_TOLERANCE_M_S else None

    def _by_the_laws(self, context: Context, sample: Sample, laws: Laws, commands: Array) -> Array:
        """Commands by the laws, (r, 3), m/s; for UGVs the actual ones if the inputs are not connected."""
        # Before the updates of this tick, proposals and answers are still those that the controllers saw at the last
        # one.
        due = commands.copy()
        ports = (self._reference, self._proposals.port, self._answers)
        if sample.reference is not None and all(port.HasValue(context) for port in ports):
            accepted = accepted_proposals(self._proposals.Eval(context), self._answers.Eval(context))
            reference, rate = sample.reference.reshape(2, -1, 3)
            wished = laws.ugvs(sample.t, sample.positions, reference, rate, accepted, sample.headings)
            if sample.headings is not None and self._world.steering is not None:
                steer_all(wished, sample.headings, self._world.steering, self._avoidance.period)
            due[self._ugvs] = wished
        due[self._uav] = laws.uav(sample.t, sample.positions, sample.commands_before[self._ugvs])
        return due
