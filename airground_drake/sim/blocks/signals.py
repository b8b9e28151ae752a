"""Named views of vectors in ports and Contexts, and the types of messages."""

from collections.abc import Callable
from typing import Any

from pydrake.common.containers import namedview
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, InputPort, LeafSystem, OutputPort, State, System

from airground_drake.base.errors import PluginError, short
from airground_drake.model.bodies.kinds import Kind
from airground_drake.model.bodies.world import World
from airground_drake.sim.blocks.lifetime import declare_output, weakly
from airground_drake.uav.messages import Report
from airground_drake.uav.policy import Proposal

# Trigger state of one UGV: `automaton.Mode`, number of triggers, times of the last trigger and the last release (-1
# before the first).
Status = namedview("Status", ["mode", "triggers", "triggered_at_s", "released_at_s"])
# Parameters of `UgvController`: A of (8), B of (6), Lambda of (14).
UgvGains = namedview("UgvGains", ["avoidance_gain_1_s", "motion_gain_1_s", "intervention_gain_1_s"])
# Parameters of `UavController`: A of (11), C of (10).
UavGains = namedview("UavGains", ["avoidance_gain_1_s", "formation_gain_1_s"])
# Parameters of `EventTrigger`: see `model.trigger.automaton.Trigger`.
TriggerLevels = namedview("TriggerLevels", ["zeta_m", "release_m", "dwell_s"])


def inputs_of(system: System) -> list[InputPort]:
    return [system.get_input_port(i) for i in range(system.num_input_ports())]


def outputs_of(system: System) -> list[OutputPort]:
    return [system.get_output_port(i) for i in range(system.num_output_ports())]


def declare_bodies(system: LeafSystem, world: World) -> InputPort:
    """Declare the input port `bodies`: positions of all bodies of a world that move, (3 M,), m, in their order."""
    # Bodies at rest are in the `World` only, so that no tick copies them. `values.reshape(-1, 3)[world.select("ugv")]`
    # is a view of the positions of the UGVs.
    return system.DeclareVectorInputPort("bodies", 3 * len(world.moving))


def declare_headings(system: LeafSystem, world: World) -> InputPort | None:
    """Declare the input port `headings` (n), rad, of the UGVs, 0 without a heading; None without unicycles."""
    if world.steering is None:
        return None
    return system.DeclareVectorInputPort("headings", len(world.steering))


def components_of(world: World, *kinds: Kind) -> slice:
    """Slice of the ports `bodies` and `team_command` that belongs to the bodies of some kinds."""
    rows = world.select(*kinds)
    return slice(3 * rows.start, 3 * rows.stop)


def no_proposals(count: int) -> AbstractValue:
    """Model value of the port `proposals`: a tuple with a `Proposal` or None for each of `count` UGVs."""
    return Value((None,) * count)


def no_reports(count: int) -> AbstractValue:
    """Model value of the port `reports`: a tuple with a `Report` for each of `count` UGVs."""
    return Value((Report(),) * count)


def keep(state: State, index: int, value: Any) -> EventStatus:
    """Store a value in an abstract state, unless it is there."""
    held = state.get_mutable_abstract_state(index)
    if value is held.get_value():
        return EventStatus.DidNothing()
    held.set_value(value)
    return EventStatus.Succeeded()


def declare_inbox(
    system: Any, count: int, state: set[Any], held: Callable[[Any, Context], Any], *, now: bool = False
) -> InputPort:
    """Declare the ports of UGVs with a channel: in `inbox`; out `proposals` (those held) and `outbox`."""
    # now: whether messages that have just arrived are answered before the state is updated
    inbox = system.DeclareAbstractInputPort("inbox", Value(()))
    needs = {*state, inbox.ticket()}
    declare_output(system, "proposals", no_proposals(count), held, needs)
    declare_output(
        system, "outbox", Value(()), lambda self, context: self.desk(context).outbox, needs if now else state
    )
    return inbox


class Messages:
    """An input port for the messages of one kind to or from n UGVs."""

    # Drake compares the types of values where ports are connected, but in pydrake all Python objects have one type. So
    # the messages themselves are checked: when a simulator is initialised, and whenever they are read.

    def __init__(self, system: LeafSystem, name: str, count: int, kind: type[Proposal] | type[Report]) -> None:
        self.port = system.DeclareAbstractInputPort(name, no_reports(count) if kind is Report else no_proposals(count))
        self._count = count
        self._kinds = (Report,) if kind is Report else (Proposal, type(None))
        system.DeclareInitializationPublishEvent(weakly(self._check))

    def _check(self, context: Context) -> None:
        if self.port.HasValue(context):
            self.Eval(context)

    def Eval(self, context: Context) -> Any:
        """The messages, one per UGV."""
        messages = self.port.Eval(context)
        if (
            isinstance(messages, tuple | list)
            and len(messages) == self._count
            and all(isinstance(message, self._kinds) for message in messages)
        ):
            return messages
        wanted = " or ".join("None" if kind is type(None) else kind.__name__ for kind in self._kinds)
        port = f"port {self.port.get_name()} of {self.port.get_system().GetSystemPathname()}"
        raise PluginError(f"{port} is given {short(repr(messages))}; allowed: {self._count} messages, each {wanted}")
