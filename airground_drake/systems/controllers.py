"""Sampled NSBC controllers of the UGVs and of the UAV."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from airground_drake.arrays import Array
from airground_drake.intervention.messages import accepted_proposals
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, limit_speed
from airground_drake.nsbc.tasks import FormationTask, PositionTask
from airground_drake.nsbc.team import Team


class UgvController(LeafSystem):
    """NSBC of all UGVs: avoidance (7)-(8), tracking (6), intervention (14), composed as (5) or (20).

    Without an accepted intervention: tracking below avoidance. With one: `intervention_on_top` puts it above
    that composite, as (20) does (methods (b), (c)); otherwise it is the task below avoidance, and tracking
    fills its null space (method (d)), so that no intervention can break an avoidance inequality.

    Ports (n UGVs, world frame):
        in  `team_position` (3(n+1)) m; `reference` (6n): preset positions m, then velocities m/s;
            `proposals` abstract, n of Proposal or None; `answers` (2n), see `messages`.
        out `command` (3n) m/s; `accepted` (n), 1 while an intervention is executed. Both held.
    Rate: one update per control period, from t = 0.
    """

    def __init__(
        self,
        team: Team,
        avoidance: Avoidance,
        *,
        motion_gain: float,
        intervention_gain: float,
        intervention_on_top: bool,
    ) -> None:
        """Declare ports, state and the periodic update."""
        super().__init__()
        n = len(team.ugvs)
        self._count = n
        self.avoidance = avoidance
        self._motion_gain = motion_gain
        self._intervention_gain = intervention_gain
        self.intervention_on_top = intervention_on_top
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
        self.DeclarePeriodicDiscreteUpdateEvent(avoidance.period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = self._position.Eval(context).reshape(-1, 3)
        reference = self._reference.Eval(context).reshape(2, -1, 3)
        proposals = accepted_proposals(self._proposals.Eval(context), self._answers.Eval(context))
        velocity = self.velocity(context.get_time(), positions, reference[0], reference[1], proposals)
        discrete.set_value(0, velocity.ravel())
        discrete.set_value(1, [float(proposal is not None) for proposal in proposals])

    def velocity(
        self, t: float, positions: Array, reference: Array, rate: Array, accepted: list[Proposal | None]
    ) -> Array:
        """The control law.

        Args:
            t: time, s.
            positions: of all robots, (n + 1, 3), m.
            reference: preset positions, (n, 3), m.
            rate: preset velocities, (n, 3), m/s.
            accepted: per UGV, the accepted proposal or None.

        Returns:
            Commands, (n, 3), m/s.
        """
        own = positions[: self._count]
        spaces = self.avoidance.half_spaces(own, self._mobility, self._neighbourhood.around(positions))
        tracking = PositionTask(reference, rate, self._motion_gain).velocity(own) * self._mobility
        lower = limit_speed(tracking, self._max_speed)
        velocity = self.avoidance.apply(lower, spaces)
        for i, proposal in enumerate(accepted):
            if proposal is not None:
                velocity[i] = self._intervened(t, proposal, i, own, lower[i], velocity[i], spaces)
        return velocity

    def _intervened(
        self, t: float, proposal: Proposal, i: int, own: Array, lower: Array, composite: Array, spaces: HalfSpaces
    ) -> Array:
        """Eq (20): v_int + (I - J_int^+ J_int) v, with v_int of (14), for one UGV; (3,), m/s.

        Whatever the proposal selects, a UGV stays in its plane.
        """
        wanted, rate = proposal.motion.at(t)
        asked = self._mobility[i] * (rate + self._intervention_gain * (wanted - own[i]))
        below = composite if self.intervention_on_top else lower
        task = self._mobility[i] * (below + proposal.chosen @ (asked - below))
        if not np.isfinite(task).all():  # the planner sends no such thing; nothing to follow then
            return composite
        row = slice(i, i + 1)
        velocity = limit_speed(task[None], self._max_speed[row])
        if self.intervention_on_top:
            return velocity[0]
        return self.avoidance.apply(velocity, HalfSpaces(spaces.normal[row], spaces.bound[row]))[0]


class UavController(LeafSystem):
    """NSBC of the UAV: obstacle avoidance (11) above staying over the centroid of the UGVs, (9)-(10).

    Ports (n UGVs, world frame):
        in  `team_position` (3(n+1)) m; `ugv_command` (3n) m/s, fed forward as the centroid's rate.
        out `command` (3) m/s, held.
    Rate: one update per control period, from t = 0.
    """

    def __init__(self, team: Team, avoidance: Avoidance, *, formation_gain: float, altitude: float) -> None:
        """Declare ports, state and the periodic update; altitude in m over the centroid."""
        super().__init__()
        n = len(team.ugvs)
        self.avoidance = avoidance
        self._gain = formation_gain
        self._altitude = altitude
        self._neighbourhood = team.neighbourhood(slice(n, n + 1))
        self._mobility = team.mobility[n:]
        self._max_speed = team.max_speed[n:]
        self._position = self.DeclareVectorInputPort("team_position", 3 * (n + 1))
        self._ugv_command = self.DeclareVectorInputPort("ugv_command", 3 * n)
        command = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("command", command)
        self.DeclarePeriodicDiscreteUpdateEvent(avoidance.period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        positions = self._position.Eval(context).reshape(-1, 3)
        commands = self._ugv_command.Eval(context).reshape(-1, 3)
        task = FormationTask(positions[:-1], commands, self._altitude, self._gain)
        lower = limit_speed(task.velocity(positions[-1:]), self._max_speed)
        spaces = self.avoidance.half_spaces(positions[-1:], self._mobility, self._neighbourhood.around(positions))
        discrete.set_value(0, self.avoidance.apply(lower, spaces)[0])
