"""Sampled NSBC controllers of the UGVs and of the UAV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from airground_drake.arrays import Array, read_only
from airground_drake.errors import PluginError, short
from airground_drake.intervention.messages import accepted_proposals
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance, limit_speed
from airground_drake.nsbc.law import Intervention, UgvLaw
from airground_drake.nsbc.task import Task
from airground_drake.nsbc.tasks import FormationTask
from airground_drake.nsbc.team import Neighbourhood, Team
from airground_drake.systems.lifetime import weakly


class UgvController(LeafSystem):
    """NSBC of all UGVs, see `UgvLaw`: avoidance (7)-(8), tracking (6), intervention (14), composed as (5) or (20).

    Ports (n UGVs, world frame):
        in  `team_position` (3(n+1)) m; `reference` (6n): preset positions m, then velocities m/s;
            `proposals` abstract, n of Proposal or None; `answers` (2n), see `messages`.
        out `command` (3n) m/s; `accepted` (n), 1 while an intervention is executed. Both held.
    Rate: one update per control period, from t = 0.

    Attributes:
        law: the control law.
        avoidance: its avoidance layer.
    """

    def __init__(self, team: Team, law: UgvLaw) -> None:
        """Declare ports, state and the periodic update."""
        super().__init__()
        n = len(team.ugvs)
        self.law, self.avoidance = law, law.avoidance
        self._neighbourhood = team.neighbourhood(slice(0, n))
        self._mobility = team.mobility[:n]
        self._max_speed = team.max_speed[:n]
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._reference = self.DeclareVectorInputPort("reference", 6 * n)
        self._proposals = self.DeclareAbstractInputPort("proposals", Value(object()))
        self._answers = self.DeclareVectorInputPort("answers", 2 * n)
        command = self.DeclareDiscreteState(3 * n)
        accepted = self.DeclareDiscreteState(n)
        self.DeclareStateOutputPort("command", command)
        self.DeclareStateOutputPort("accepted", accepted)
        self.DeclarePeriodicDiscreteUpdateEvent(law.avoidance.period, 0.0, weakly(self._update))

    def parameters(self) -> dict[str, Any]:
        """What it was built with, see `read_back`, and whether it puts interventions on top of avoidance."""
        found = read_back(self, self.avoidance, self._neighbourhood, self._mobility, self._max_speed)
        return {**found, "composition": self.avoidance.composition, "intervention_on_top": self.law.intervention_on_top}

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = _finite(self._position.Eval(context)).reshape(-1, 3)
        reference, rate = self._reference.Eval(context).reshape(2, -1, 3)
        proposals = accepted_proposals(self._proposals.Eval(context), self._answers.Eval(context))
        velocity = self.velocity(context.get_time(), positions, reference, rate, proposals)
        discrete.set_value(0, velocity.ravel())
        discrete.set_value(1, [float(proposal is not None) for proposal in proposals])

    def velocity(
        self, t: float, positions: Array, reference: Array, rate: Array, accepted: Sequence[Proposal | None]
    ) -> Array:
        """What the law commands.

        Args:
            t: time, s.
            positions: of all robots, (n + 1, 3), m.
            reference: preset positions, (n, 3), m.
            rate: preset velocities, (n, 3), m/s.
            accepted: per UGV, the accepted proposal or None.

        Returns:
            Commands, (n, 3), m/s.
        """
        asked = [None if p is None else Intervention(*p.motion.at(t), p.chosen) for p in accepted]
        return self.law.velocity(
            positions, self._neighbourhood, reference, rate, asked, self._mobility, self._max_speed
        )


class UavController(LeafSystem):
    """NSBC of the UAV: obstacle avoidance (11) above a task, by default to stay over the UGVs' centroid, (9)-(10).

    Ports (n UGVs, world frame):
        in  `team_position` (3(n+1)) m; `ugv_command` (3n) m/s, fed forward as the centroid's rate.
        out `command` (3) m/s, held.
    Rate: one update per control period, from t = 0.
    """

    def __init__(
        self,
        team: Team,
        avoidance: Avoidance,
        *,
        gain: float,
        altitude: float,
        task: Callable[[Array, Array, float, float], Task] = FormationTask,
    ) -> None:
        """Declare ports, state and the periodic update.

        Args:
            team: names, safe distances, speed limits.
            avoidance: the set-based layer.
            gain: of the task, 1/s.
            altitude: m.
            task: made at each sample from positions (n, 3), m, and velocities (n, 3), m/s, of the UGVs, altitude and
                gain; asked for the velocity of one robot, (1, 3), m/s.
        """
        super().__init__()
        n = len(team.ugvs)
        self.avoidance = avoidance
        self._task = task
        self._gain = gain
        self._altitude = altitude
        self._neighbourhood = team.neighbourhood(slice(n, n + 1))
        self._mobility = team.mobility[n:]
        self._max_speed = team.max_speed[n:]
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._ugv_command = self.DeclareVectorInputPort("ugv_command", 3 * n)
        command = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("command", command)
        self.DeclarePeriodicDiscreteUpdateEvent(avoidance.period, 0.0, weakly(self._update))

    def parameters(self) -> dict[str, Any]:
        """What it was built with, see `read_back`."""
        return read_back(self, self.avoidance, self._neighbourhood, self._mobility, self._max_speed)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = _finite(self._position.Eval(context)).reshape(-1, 3)
        commands = self._ugv_command.Eval(context).reshape(-1, 3)
        discrete.set_value(0, self.velocity(positions, commands))

    def velocity(self, positions: Array, ugv_commands: Array) -> Array:
        """What the law commands, (3,), m/s.

        Args:
            positions: of all robots, (n + 1, 3), m.
            ugv_commands: of the UGVs, at the sample before, (n, 3), m/s.

        Raises:
            PluginError: if the task asks for what is no velocity.
        """
        task = self._task(read_only(positions[:-1]), read_only(ugv_commands), self._altitude, self._gain)
        lower = limit_speed(_velocity_of(task, read_only(positions[-1:])), self._max_speed)
        spaces = self.avoidance.half_spaces(positions[-1:], self._mobility, self._neighbourhood.around(positions))
        velocity: Array = self.avoidance.apply(lower, spaces)[0]
        return velocity


def read_back(
    system: LeafSystem, avoidance: Avoidance, neighbourhood: Neighbourhood, mobility: Array, max_speed: Array
) -> dict[str, Any]:
    """The parameters of a controller's avoidance as it runs, in strict JSON, for the trace.

    Returns:
        Of its k robots: `members`, their indices in team order; `obstacles_m`, centres (m, 3); `others`, indices of the
        n robots that each avoids, (k, n); `safe_m` and `share` beside the obstacles, then beside the robots,
        (k, m + n); `mobility` (k, 3); `max_speed_m_s` (k,). Of all: `sampling_s`, period and offset; `gain_1_s`,
        `period_s`, `sensing_range_m`. Arrays in C order, `safe_m` and `share` as [value, how many] in a row.
    """
    timing = system.GetUniquePeriodicDiscreteUpdateAttribute()
    return {
        "members": neighbourhood.members.tolist(),
        "obstacles_m": neighbourhood.obstacles.ravel().tolist(),
        "others": neighbourhood.others.ravel().tolist(),
        "safe_m": _in_runs(neighbourhood.distance),
        "share": _in_runs(neighbourhood.share),
        "mobility": mobility.ravel().tolist(),
        "max_speed_m_s": max_speed.tolist(),
        "sampling_s": [timing.period_sec(), timing.offset_sec()],
        "gain_1_s": avoidance.gain,
        "period_s": avoidance.period,
        "sensing_range_m": avoidance.sensing_range,
    }


def _in_runs(array: Array) -> list[list[float]]:
    """Equal neighbours as [value, how many]: 100 robots among 1,000 obstacles have 110,000 distances, mostly alike."""
    return [[value, len(list(alike))] for value, alike in groupby(array.ravel().tolist())]


def _finite(positions: Array) -> Array:
    """Positions, as they come from the plants; what is nowhere is avoided by nobody."""
    if not np.isfinite(positions).all():
        raise PluginError(f"positions are not finite, from a plant or a disturbance: {short(repr(positions.tolist()))}")
    return positions


def _velocity_of(task: Task, position: Array) -> Array:
    asked = np.asarray(task.velocity(position))
    if asked.shape != position.shape or asked.dtype.kind not in "fiu" or not np.isfinite(asked).all():
        given, wanted = short(repr(asked.tolist())), f"wanted: {position.shape} finite numbers, m/s"
        raise PluginError(f"the UAV's task {type(task).__name__} asks for {given} as velocity; {wanted}")
    return asked.astype(np.float64, copy=False)
