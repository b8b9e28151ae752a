"""The measured positions of robots as a LeafSystem."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from pydrake.systems.framework import Context, LeafSystem

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import World
from airground_drake.scenario.sensing import Errors
from airground_drake.sim.blocks.lifetime import declare_output
from airground_drake.sim.blocks.signals import declare_bodies


class PositionSensing(LeafSystem):
    """Measured positions of the robots, which robots and gatekeepers act on, and those that the UAV plans with.

    Ports (M bodies that move, world frame):
        in  `bodies` (3M) m.
        out `published` (3M) m and `seen_by_uav` (3M) m; with `sensing.shared: false` also `view_of_<robot>` (3M) m,
            where the robot measures all of them; of bodies that are no robots the true places.
    State: none. An error depends on the time and on true places alone.
    """

    def __init__(self, errors: Errors, world: World, views: Mapping[str, str]) -> None:
        """`views` names the output port for each robot that measures the others."""
        super().__init__()
        self._bodies = declare_bodies(self, world)
        needs, size = {self._bodies.ticket(), self.time_ticket()}, 3 * len(world.moving)
        ports: dict[str, Callable[[float, Array], Array]]
        ports = {"published": errors.published, "seen_by_uav": errors.seen_by_uav}
        ports |= {port: partial(errors.view_of, robot) for robot, port in views.items()}
        for name, measured in ports.items():
            declare_output(self, name, size, partial(type(self)._measured, measured=measured), needs)

    def _measured(self, context: Context, measured: Callable[[float, Array], Array]) -> Array:
        return measured(context.get_time(), np.asarray(self._bodies.Eval(context)).reshape(-1, 3)).ravel()
