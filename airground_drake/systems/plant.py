"""Between commands and plants: what disturbs the motion."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from airground_drake.systems.lifetime import weakly


class VelocityDisturbance(LeafSystem):
    """Adds a disturbance to the command of each robot: p_dot = v + w, the disturbance w of SAFE-DIST.

    Ports (n UGVs, world frame):
        in  `command` (3(n+1)) m/s; `disturbance_<robot>` (3) m/s for every robot, 0 where not connected.
        out `velocity` (3(n+1)) m/s.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        """Declare the ports for robots with these names, in team order."""
        super().__init__()
        self._command = self.DeclareVectorInputPort("command", 3 * len(robots))
        self._disturbances = [self.DeclareVectorInputPort(f"disturbance_{robot}", 3) for robot in robots]
        inputs = (self._command, *self._disturbances)
        self.DeclareVectorOutputPort(
            "velocity", 3 * len(robots), weakly(self._calc), prerequisites_of_calc={port.ticket() for port in inputs}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        velocity = self._command.Eval(context).copy()
        for i, port in enumerate(self._disturbances):
            if port.HasValue(context):
                velocity[3 * i : 3 * i + 3] += port.Eval(context)
        output.SetFromVector(velocity)
