"""A user's own controller of all UGVs: construction, and a check of its commands."""

from collections.abc import Callable, Collection
from functools import partial
from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    InputPortIndex,
    LeafSystem,
    OutputPort,
    System,
)

from airground_drake.base.errors import PluginError, described, raised_as, short
from airground_drake.base.registry import UGV_CONTROLLERS
from airground_drake.model.bodies.world import World
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.schema import OwnController
from airground_drake.sim.blocks.controllers import sampling_of
from airground_drake.sim.blocks.lifetime import weakly
from airground_drake.sim.blocks.plant import users_system
from airground_drake.sim.blocks.signals import UgvGains, inputs_of, outputs_of
from airground_drake.uav.messages import NOTHING

# Makes a controller from the world, the package's law and parameters, as described in docs/extending.md.
ControllerFactory = Callable[..., System]

HELD = ("command", "executing", "command_share")  # outputs that change at control samples only


class CheckedCommands(LeafSystem):
    """Passes on a user's controller's outputs after checking them: finite velocities, integer proposal numbers.

    Ports: in and out, each output of the controller by its name.
    """

    def __init__(self, about: str, sizes: dict[str, int]) -> None:
        super().__init__()
        self._about = about
        for name, size in sizes.items():
            source = self.DeclareVectorInputPort(name, size)
            calc = partial(weakly(self._calc), source.get_index())
            self.DeclareVectorOutputPort(name, size, calc, prerequisites_of_calc={source.ticket()})

    def _calc(self, index: InputPortIndex, context: Context, output: BasicVector) -> None:
        source = self.get_input_port(index)
        name = source.get_name()
        with raised_as(lambda error: PluginError(f"{self._about}: {described(error)}")):
            value = source.Eval(context)
        wanted = ""
        if not np.isfinite(value).all():
            wanted = "finite numbers"
        elif name == "executing" and ((value < NOTHING) | (value % 1.0 != 0.0)).any():
            wanted = f"numbers of proposals, {NOTHING:g} for none"
        if wanted:
            raise PluginError(f"{self._about} has {short(repr(value.tolist()))} at {name}; allowed: {wanted}")
        output.SetFromVector(value)


class OwnUgvController(Diagram):
    """A user's controller behind `CheckedCommands`; its inputs are those of the user's System."""

    def __init__(self, given: OwnController, world: World, law: UgvLaw, make: ControllerFactory | None) -> None:
        """Construct it, by `make` or the class that the scenario names."""
        super().__init__()
        self._kind, period = given.kind, law.avoidance.period
        about = f"controller {given.kind!r}"
        system = users_system(about, UGV_CONTROLLERS, given.kind, make, world=world, law=law, **given.parameters)
        n = len(world.names("ugv"))
        sizes = {"command": 3 * n, "executing": n, "gains": len(UgvGains.get_fields())}
        sizes |= {"command_share": n} if world.steering is not None else {}
        outputs = _outputs(about, system, sizes)
        _require_sampled(about, system, period)
        builder = DiagramBuilder()
        try:
            builder.AddNamedSystem("own", system)
        except RuntimeError as error:  # it is part of another diagram
            raise PluginError(f"{about}: {described(error)}") from error
        checked = builder.AddNamedSystem("checked", CheckedCommands(about, sizes))
        for name, port in outputs.items():
            builder.Connect(port, checked.GetInputPort(name))
            builder.ExportOutput(checked.GetOutputPort(name), name)
        for port in inputs_of(system):
            builder.ExportInput(port, port.get_name())
        builder.BuildInto(self)

    def parameters(self, context: Context) -> dict[str, Any]:
        """Its class and sampling, for the trace."""
        return {"class": self._kind, "sampling_s": sampling_of(self)}

    def require_inputs(self, fed: Collection[str]) -> None:
        """Refuse unconnected input ports."""
        for port in inputs_of(self):
            if (name := port.get_name()) not in fed:
                allowed = f"allowed: {', '.join(sorted(fed))}"
                raise PluginError(f"controller {self._kind!r} has an input port {name!r}; {allowed}")


def _outputs(about: str, system: System, sizes: dict[str, int]) -> dict[str, OutputPort]:
    """Its output ports by name, with checked sizes; those for the plants must be held between control samples."""
    ports = outputs_of(system)
    has = {port.get_name(): port.size() for port in ports}
    if any(has.get(name) != size for name, size in sizes.items()):
        raise PluginError(f"{about} has output ports of sizes {has}; they must include {sizes}")
    named = {port.get_name(): port for port in ports if port.get_name() in sizes}
    for name in HELD:
        if name in named and system.HasDirectFeedthrough(named[name].get_index()):
            allowed = "allowed: an output of its state, such as by DeclareStateOutputPort"
            raise PluginError(f"{about} has an output port {name} that depends on its inputs at once; {allowed}")
    return named


def _require_sampled(about: str, system: System, period: float) -> None:
    """Refuse a controller that is not sampled at the control period, by discrete updates."""
    # Unrestricted updates of an instant come before discrete ones: it would not see what planner and gatekeeper decide.
    wanted = f"allowed: discrete state, and one periodic discrete update, every {period:g} s from t = 0"
    if system.num_continuous_states() or system.num_abstract_states():
        raise PluginError(f"{about} has continuous or abstract state; {wanted}")
    timing = system.GetUniquePeriodicDiscreteUpdateAttribute()
    if timing is None:
        raise PluginError(f"{about} has no discrete update of a single period; {wanted}")
    every_s, from_s = timing.period_sec(), timing.offset_sec()
    if (every_s, from_s) != (period, 0.0):
        raise PluginError(f"{about} is updated every {every_s:g} s from {from_s:g} s; {wanted}")
