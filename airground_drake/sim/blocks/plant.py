"""The Drake systems of plants, including users' own, and of disturbances."""

import copy
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from inspect import isfunction
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    DiscreteValues,
    InputPortIndex,
    LeafSystem,
    OutputPort,
    State,
    System,
)
from pydrake.systems.primitives import LinearSystem, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, UnknownNameError, described, raised_as, short
from airground_drake.base.registry import PLANTS, Registry, misfit
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.bodies.world import Body
from airground_drake.model.plants.own import Own, OwnKeys
from airground_drake.model.plants.plant import HEADING, Plant
from airground_drake.model.plants.scripted import Scripted
from airground_drake.scenario.load import validated
from airground_drake.scenario.schema import OwnController, Scenario
from airground_drake.sim.blocks.lifetime import declare_output, weakly
from airground_drake.sim.blocks.signals import inputs_of, outputs_of

START_M = 1e-9  # a body may begin this far from its start, m: forward kinematics err by less


def first_order_plant(robot: str, start: Array) -> LinearSystem:
    """p_dot = v for one robot: input v (3,), m/s; output p (3,), m, world frame; default state `start` (3,), m."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    plant = LinearSystem(A=zero, B=eye, C=eye, D=zero)
    plant.configure_default_state(start)
    return plant


def vertices_of(body: Body) -> tuple[Array, Array]:
    """Times, (K,), s, and places, (K, 3), m, of the vertices of a script, at least two."""
    assert isinstance(body.plant, Scripted)
    times, places = body.plant.script.times, body.plant.script.positions
    if len(times) == 1:
        times, places = np.append(times, times[0] + 1.0), np.repeat(places, 2, axis=0)
    return times, places


class SteeredBody(LeafSystem):
    """The body of a robot off its steered point: see `model.plants.plant`.

    Ports (world frame):
        in  `velocity` (3) m/s, held for a control period; `base` (3) m, a first-order robot under that velocity.
        out `signals` (k), those of the plant; `heading` (1) rad, if one of them is one.
    State: the time of the last control sample, s, and the plant's memory there.
    Rate: one update per control period, from t = 0. In between all is in closed form, so that no integrator errs.
    """

    def __init__(self, plant: Plant, period_s: float) -> None:
        super().__init__()
        self._plant, self._period_s = plant, period_s
        self._velocity = self.DeclareVectorInputPort("velocity", 3)
        self._base = self.DeclareVectorInputPort("base", 3)
        self.DeclareDiscreteState(np.append(0.0, plant.memory()))
        needs = {self._velocity.ticket(), self._base.ticket(), self.xd_ticket(), self.time_ticket()}
        names = plant.signals
        declare_output(self, "signals", len(names), type(self)._signals, needs)
        if HEADING in names:
            heading = [names.index(HEADING)]
            declare_output(self, "heading", 1, lambda self, context: self._signals(context)[heading], needs)
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, 0.0, weakly(self._update))

    def _since(self, context: Context) -> tuple[float, Array]:
        """Time since the last control sample, s, and the memory there."""
        held = context.get_discrete_state(0).value()
        elapsed = context.get_time() - held[0]
        return self._period_s if abs(elapsed - self._period_s) <= SAME_S else float(elapsed), held[1:]

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        elapsed, memory = self._since(context)
        memory = self._plant.remembered(memory, self._velocity.Eval(context), elapsed)
        discrete.set_value(0, np.append(context.get_time(), memory))

    def _signals(self, context: Context) -> Array:
        elapsed, memory = self._since(context)
        return self._plant.at(memory, self._base.Eval(context), self._velocity.Eval(context), elapsed)


def steered_plant(body: Body, period_s: float) -> Diagram:
    """A robot whose body is off its steered point: the base, a `first_order_plant`, and a `SteeredBody`."""
    # Its input is `velocity` (3), m/s; its outputs are `position` (3), m, that of the base, and those of the body.
    assert body.plant is not None
    builder = DiagramBuilder()
    base = builder.AddNamedSystem("base", first_order_plant(body.name, body.start_m))
    moved = builder.AddNamedSystem("body", SteeredBody(body.plant, period_s))
    builder.ExportInput(base.get_input_port(), "velocity")
    builder.ConnectInput("velocity", moved.GetInputPort("velocity"))
    builder.Connect(base.get_output_port(), moved.GetInputPort("base"))
    builder.ExportOutput(base.get_output_port(), "position")
    for port in outputs_of(moved):
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


def name_of(make: Callable[..., Any]) -> str:
    """Its name in a scenario, `module:Class`, valid also for functions and files such as my-robots.py."""
    made_by = make if hasattr(make, "__qualname__") else type(make)
    words = [*str(made_by.__module__).split("."), made_by.__qualname__]
    *module, called = (re.sub(r"\W+|^(?=\d|$)", "_", word) for word in words)
    return f"{'.'.join(module)}:{called}"


class OwnPlant(NamedTuple):
    """A user's plant for one robot, made in Python; in a scenario file it is a class (`plant.kind`).

    Attributes:
        make: called with `start`, the place of the body, (3,), m, world frame, and the parameters: gives a Drake System
            as described in docs/extending.md.
        drift_m_s: by how much the steered point misses its command in a control period at most, per time.
        cover_m: how far the body is at most from the straight line of the steered point in a control period.
        parameters: numbers, by name.
    """

    make: Callable[..., System]
    drift_m_s: float
    cover_m: float
    parameters: Mapping[str, float] = MappingProxyType({})


def declared(
    scenario: Scenario,
    plants: Mapping[str, OwnPlant],
    ugv_controller: Callable[..., System] | None = None,
    seed: int | None = None,
) -> Scenario:
    """A valid scenario in which some robots have users' plants, by name, and the UGVs a user's controller."""
    # seed: in place of the scenario's.
    changed = copy.deepcopy(scenario) if plants or ugv_controller is not None else scenario
    for robot, code in plants.items():
        if robot not in changed.robots:
            raise UnknownNameError("robot", robot, changed.robots)
        made: Any = code
        if not isinstance(made, OwnPlant) or not callable(made.make):
            wanted = "allowed: an OwnPlant, made by a class or a function"
            raise PluginError(f"the plant of {robot} is {short(repr(made))}; {wanted}")
        given = OwnKeys(
            kind=name_of(code.make), drift_m_s=code.drift_m_s, cover_m=code.cover_m, parameters={**code.parameters}
        )
        changed.robots[robot].plant = [given]
    if ugv_controller is not None:
        other = isinstance(ugv_controller, type) and not issubclass(ugv_controller, System)
        if other or not callable(ugv_controller):
            shown = short(repr(ugv_controller))
            raise PluginError(f"ugv_controller is {shown}; allowed: a subclass of Drake's System, or a function")
        changed.ugv_controller = OwnController(kind=name_of(ugv_controller))
    return validated(changed, {} if seed is None else {"seed": seed})


class OwnCode(NamedTuple):
    """The source of a user's plant or controller: its name in the scenario, and a function in its file."""

    name: str
    function: object


def own_code(scenario: Scenario, plants: Mapping[str, OwnPlant]) -> dict[str, OwnCode]:
    """All users' plants in a scenario, by robot; `plants` are those of `declared`."""
    named = {robot: plant.kind for robot, given in scenario.robots.items() for plant in given.plant if plant.is_own}
    codes = {}
    for robot, name in named.items():
        codes[robot] = code_of(name, plants[robot].make if robot in plants else PLANTS.load(name, System))
    return codes


def code_of(name: str, make: Callable[..., System]) -> OwnCode:
    """The name in the scenario and a function in the file of a factory of Systems."""
    functions = filter(isfunction, vars(make).values()) if isinstance(make, type) else ()
    return OwnCode(name, next(iter(functions), make))


GROUND_M = 1e-6  # rounding tolerance of a UGV's height, m


class OwnBody(LeafSystem):
    """Passes on the outputs of a user's plant, checked to be finite.

    The position of a sampled plant, such as a discrete MultibodyPlant, jumps. It is interpolated linearly, one step of
    the plant later, because a trace is continuous.

    Ports (world frame):
        in  `position` (3) and `body` (3), m; `heading` (1), rad, if the plant has one.
        out the same position; `signals` (3), the body, m; `heading`.
    State: of a sampled plant, the time of its last step, s, -inf before the first, and what the input ports were then.
    """

    def __init__(self, name: str, *, turns: bool, on_ground: bool, step_s: float) -> None:
        """Declare the ports.

        Args:
            name: of the plant and its robot, for messages.
            turns: whether the plant has a heading.
            on_ground: whether it must stay at the height 0: a UGV.
            step_s: time between the steps of a sampled plant, s; 0 for any other.
        """
        super().__init__()
        self._name, self._on_ground, self._step_s = name, on_ground, step_s
        ports = [("position", "position", 3), ("body", "signals", 3), *([("heading", "heading", 1)] if turns else [])]
        begin = 0
        for port, output, size in ports:
            source = self.DeclareVectorInputPort(port, size)
            calc = partial(weakly(self._calc), source.get_index(), slice(1 + begin, 1 + begin + size))
            needs = {source.ticket()} | ({self.xd_ticket(), self.time_ticket()} if step_s else set())
            self.DeclareVectorOutputPort(output, size, calc, prerequisites_of_calc=needs)
            begin += size
        if step_s:
            self.DeclareDiscreteState(np.append(-np.inf, np.zeros(begin)))
            # Drake makes unrestricted updates before discrete ones: the plant has not made its step yet
            self.DeclarePeriodicUnrestrictedUpdateEvent(step_s, 0.0, weakly(self._update))

    def _update(self, context: Context, state: State) -> None:
        places = [self._now(context, InputPortIndex(k)) for k in range(self.num_input_ports())]
        held = np.concatenate([[context.get_time()], *places])
        state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(held)

    def _now(self, context: Context, index: InputPortIndex) -> Array:
        """A port's value; raises PluginError if it cannot be computed, is not finite, or is off the ground."""
        source = self.get_input_port(index)
        with raised_as(lambda error: PluginError(f"{self._name}: {described(error)}")):
            value: Array = source.Eval(context)
        wanted = ""
        if not np.isfinite(value).all():
            wanted = "allowed: finite numbers"
        elif self._on_ground and len(value) == 3 and abs(value[2]) > GROUND_M:
            wanted = f"allowed for a UGV: the height 0, to {GROUND_M:g} m"
        if wanted:
            raise PluginError(f"{self._name} has {value.tolist()} at its output {source.get_name()}; {wanted}")
        return value

    def _calc(self, index: InputPortIndex, held: slice, context: Context, output: BasicVector) -> None:
        value = self._now(context, index)
        if self._step_s:
            before = context.get_discrete_state(0).value()
            share = min((context.get_time() - before[0]) / self._step_s, 1.0)
            change = value - before[held]
            if self.get_input_port(index).get_name() == "heading":
                change = np.remainder(change + np.pi, 2.0 * np.pi) - np.pi
            value = before[held] + share * change
        output.SetFromVector(value)


def step_of(system: System) -> float:
    """The period, s, of a plant with synchronous discrete states only; else 0."""
    steps = {*_steps(system)}
    return steps.pop() if len(steps) == 1 and not system.num_continuous_states() else 0.0


def _steps(system: System) -> Iterator[float]:
    """Times between steps of the systems in a system, s."""
    from pydrake.multibody.plant import MultibodyPlant  # slow to import: only for users' plants

    if isinstance(system, MultibodyPlant):  # whose steps are no discrete updates if its outputs are sampled
        yield from [system.time_step()] if system.time_step() else []
    elif isinstance(system, Diagram):
        for part in system.GetSystems():
            yield from _steps(part)
    elif (timing := system.GetUniquePeriodicDiscreteUpdateAttribute()) is not None:
        yield timing.period_sec()


def users_system(
    about: str, registry: Registry, name: str, make: Callable[..., System] | None, **parameters: Any
) -> System:
    """A user's plant or controller, from a class or a function, or else from the class of a name in the scenario."""
    made = registry.load(name, System) if make is None else make

    def refused(error: BaseException) -> PluginError:
        return PluginError(f"{about}: {misfit(made, parameters) or described(error, code_of(name, made).function)}")

    with raised_as(refused):
        system: Any = made(**parameters)
    if not isinstance(system, System):
        raise PluginError(f"{about} is made by a function that returns {short(repr(system))}; allowed: a Drake System")
    return system


# Output ports of a user's plant, and their sizes; only the first is needed, and may have another name.
OUTPUTS = {"position": 3, "body": 3, "heading": 1}


def own_plant(body: Body, make: Callable[..., System] | None) -> Diagram:
    """A user's plant behind an `OwnBody`."""
    # make: in place of the class that the plant names.
    assert isinstance(body.plant, Own)
    about = f"plant {body.plant.name!r} of {body.name}"
    start = body.start_m.copy()
    system = users_system(about, PLANTS, body.plant.name, make, **body.plant.parameters, start=start)
    inputs, ports = [port.size() for port in inputs_of(system)], outputs_of(system)
    outputs = {"position": ports[0]} if ports else {}
    outputs |= {port.get_name(): port for port in ports[1:] if port.get_name() in OUTPUTS}
    if inputs[:1] != [3] or not outputs or any(port.size() != OUTPUTS[name] for name, port in outputs.items()):
        sizes = {port.get_name(): port.size() for port in ports}
        wanted = (
            "allowed: velocity (3) first among its inputs, position (3) first among its outputs, and outputs named "
            "body (3) and heading (1)"
        )
        raise PluginError(f"{about} has inputs of sizes {inputs}, outputs of sizes {sizes}; {wanted}")
    try:
        own = OwnBody(about, turns="heading" in outputs, on_ground=body.kind == "ugv", step_s=step_of(system))
        diagram = _checked(system, outputs, own)
    except RuntimeError as error:  # it is part of another diagram
        raise PluginError(f"{about}: {described(error)}") from error
    _begins_at(diagram, body.start_m, about)
    return diagram


def _checked(system: System, outputs: Mapping[str, OutputPort], checked: OwnBody) -> Diagram:
    """A user's plant with its outputs, by name, behind an `OwnBody`."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("own", system)
    builder.AddNamedSystem("checked", checked)
    for port in inputs_of(checked):
        builder.Connect(outputs.get(port.get_name(), outputs["position"]), port)
    builder.ExportInput(system.get_input_port(0), "velocity")
    for port in outputs_of(checked):
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


def _begins_at(diagram: Diagram, start_m: Array, about: str) -> None:
    """Refuse a plant whose body is not at its start, (3,), m, in the default context."""
    with raised_as(lambda error: PluginError(f"{about}: {described(error)}")):
        context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, np.zeros(3))
    begins = diagram.GetOutputPort("signals").Eval(context)
    if np.abs(begins - start_m).max() > START_M:
        raise PluginError(f"{about} begins at {begins.tolist()} m; allowed: at its start, {start_m.tolist()} m")


def plant_system(body: Body, period_s: float, own: Mapping[str, OwnPlant] = MappingProxyType({})) -> System:
    """The Drake system of a body that moves."""
    if isinstance(body.plant, Own):
        return own_plant(body, own[body.name].make if body.name in own else None)
    if isinstance(body.plant, Scripted):
        times, places = vertices_of(body)
        return TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, places.T))
    if body.plant is None or not body.plant.signals:
        return first_order_plant(body.name, body.start_m)
    return steered_plant(body, period_s)


class VelocityDisturbance(LeafSystem):
    """Adds a disturbance w to the command v of each robot, p_dot = v + w.

    Ports (r robots, world frame):
        in  `command` (3r) m/s; `disturbance_<robot>` (3) m/s for every robot, 0 where not connected.
        out `velocity` (3r) m/s.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        """Declare the ports for robots with these names, in the order of the world."""
        super().__init__()
        self._command = self.DeclareVectorInputPort("command", 3 * len(robots))
        self._disturbances = [self.DeclareVectorInputPort(f"disturbance_{robot}", 3) for robot in robots]
        needs = {port.ticket() for port in (self._command, *self._disturbances)}
        declare_output(self, "velocity", 3 * len(robots), type(self)._velocity, needs)

    def _velocity(self, context: Context) -> Array:
        velocity: Array = self._command.Eval(context).copy()
        for i, port in enumerate(self._disturbances):
            if port.HasValue(context):
                velocity[3 * i : 3 * i + 3] += port.Eval(context)
        return velocity
