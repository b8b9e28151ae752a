"""Builds the Drake Diagram of a scenario: the layers of the paper's Figure 2 and the vehicles, wired by port names.

Data flows through `decision_making` (noise, DDM, trigger), `task_planning` (presets, planner, controllers),
`optimisation` (gatekeeper) and `vehicles` (commands, disturbances, plants), whose positions are fed back.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort, System
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, Multiplexer, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, ScenarioError, UnknownNameError, described, raised_as, short
from airground_drake.base.registry import METHODS, UAV_TASKS, Method, method_of
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import COMPOSITIONS, Composition
from airground_drake.model.law.task import Task
from airground_drake.scenario.links import make_links, repeats_after
from airground_drake.scenario.load import validated
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.sensing import errors_of
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.blocks import (
    AllProposals,
    DecisionVariable,
    DirectAcceptance,
    Downlink,
    EventTrigger,
    Gatekeeper,
    InterventionPlanner,
    Laws,
    Monitor,
    UavController,
    UgvController,
    Uplink,
    VelocityDisturbance,
)
from airground_drake.sim.blocks.own_controller import ControllerFactory, OwnUgvController
from airground_drake.sim.blocks.plant import OwnPlant, declared, plant_system
from airground_drake.sim.blocks.positions import positions_between
from airground_drake.sim.blocks.sensing import PositionSensing
from airground_drake.sim.blocks.signals import inputs_of, outputs_of

# Exported output ports of the diagram: the signals of a trace.
RECORDED = (
    "bodies", "team_command", "reference", "noise", "decision_variable", "status", "executing",
)  # fmt: skip
# Further exported output ports: of robots that are not where the law steers them, of users' plants that have a heading,
# of unicycles, of measured positions, and of positions that go from UGV to UGV.
OF_SOME = ("plant_signals", "own_headings", "command_share", "published", "seen_by_uav", "announced", "heard_s")

NO_PLANTS: Mapping[str, OwnPlant] = MappingProxyType({})

# Makes the block that computes the decision variables of n UGVs from their world and their presets: a System with the
# output ports `decision_variable` (n), m, and `decision_range` (2n), m, the smallest and the largest since the
# simulator's step began. Its input ports are fed by name. `sim.blocks.DecisionBlock` is a base for such blocks.
DecisionFactory = Callable[[World, Sequence[Motion]], System]


@dataclass(frozen=True)
class Model:
    """A diagram and the systems in it that a simulation reads."""

    diagram: Diagram  # the whole system; its exported output ports are RECORDED
    world: World  # all bodies, in the order of the port `bodies`
    decision_block: System  # drives the trigger
    trigger: EventTrigger  # of all UGVs
    planners: Mapping[str, InterventionPlanner]  # of each UAV, by its name
    gatekeeper: Gatekeeper | None  # of methods (c) and (d), else None
    controllers: tuple[UgvController | OwnUgvController | UavController, ...]  # of the UGVs, and of each UAV
    signals: tuple[str, ...]  # names of the columns of `plant_signals` and `own_headings`
    recorded: tuple[str, ...]  # names of the exported output ports that are the signals of a trace
    links: tuple[Downlink, Uplink] | None = None  # the channel
    answering: Gatekeeper | DirectAcceptance | None = None  # the UGVs on it


def build_diagram(
    scenario: Scenario,
    method: str | None = None,
    composition: Composition | None = None,
    plants: Mapping[str, OwnPlant] = NO_PLANTS,
    monitor: Monitor | None = None,
    decision_block: DecisionFactory = DecisionVariable,
    ugv_controller: ControllerFactory | None = None,
) -> Diagram:
    """The diagram of a scenario, for inspection, simulation or embedding.

    Args:
        scenario: from a file or made in Python.
        method: default: that of the scenario's last run.
        composition: of the UGVs' avoidance tasks; default: 'augmented', or without `method` that of the last run.
        plants: plants of your own, by robot, in place of those of the scenario.
        monitor: watches the diagram while it runs; see `make_monitor`.
        decision_block: makes the block that drives the trigger. The default, `sim.blocks.DecisionVariable`, is (15).
        ugv_controller: makes a controller of your own for all UGVs, in place of that of the scenario: a System with the
            output ports of `UgvController`, whose input ports are fed by name; see docs/extending.md.

    Returns:
        A Diagram whose default context has every robot at its start. For a simulation its context needs an accuracy:
        `context.SetAccuracy(1e-6)`. Outputs: RECORDED and, with a monitor, `violation`. Inputs: `disturbance_<robot>`
        (3), m/s, added to the robot's velocity; 0 if not connected. The scenario's seed is not part of the diagram:
        `diagram.SetRandomContext(context, RandomGenerator(seed))` gives a context the noise of a seed. pydrake never
        frees diagrams of Python systems by itself; `sim.blocks.lifetime.untie` allows it.

    Raises:
        ScenarioError: if the scenario is not valid.
        UnknownNameError: if there is no such method or composition.
        PluginError: if a policy, route, task, plant or controller of the scenario cannot be made, or the decision block
            or the controller does not have the ports of one.
    """
    valid = declared(scenario, plants, ugv_controller)
    return build_model(valid, method, composition, plants, monitor, decision_block, ugv_controller).diagram


def build_model(
    scenario: Scenario,
    method: str | None = None,
    composition: Composition | None = None,
    plants: Mapping[str, OwnPlant] = NO_PLANTS,
    monitor: Monitor | None = None,
    decision_block: DecisionFactory = DecisionVariable,
    ugv_controller: ControllerFactory | None = None,
    *,
    disturbed: bool = True,
    make_gatekeepers: components.GatekeepersFactory = components.make_gatekeepers,
) -> Model:
    """Build and wire all components of one method of a valid scenario; see `build_diagram`."""
    # `plants` and `ugv_controller` are what the scenario declares (`sim.blocks.plant.declared`). Without `disturbed`
    # the diagram has no inputs for disturbances: commands go straight to the plants. `make_gatekeepers` replaces the
    # gatekeepers; claims about decisions are about the default.
    chosen, composition = _chosen(scenario, method, composition)
    world, presets = make_world(scenario), components.make_presets(scenario)
    n = len(world.names("ugv"))
    law = components.make_law(scenario, chosen, composition)
    # first, so that the seed of its noise does not depend on what a plant may draw
    if not callable(decision_block) or (isinstance(decision_block, type) and not issubclass(decision_block, System)):
        raise PluginError(f"decision_block is {short(repr(decision_block))}; allowed: a subclass of DecisionBlock")
    block = _checked_block(n, decision_block(world, presets))
    shortest = min(scenario.control.period_s, scenario.decision.noise_period_s)
    trigger = EventTrigger(n, components.make_trigger(scenario), shortest)
    decision = _decision_making(scenario, n, block, trigger)
    made = {body.name: plant_system(body, scenario.control.period_s, plants) for body in world.moving}
    signals = (*world.signals, *(f"{name}.heading_rad" for name in _own_headings(world, made)))
    vehicles = _vehicles(world, made, disturbed=disturbed)
    channel, period = scenario.channel if chosen.intervenes else None, scenario.control.period_s
    plans = {uav: components.make_planner(scenario, chosen, uav) for uav in scenario.aerial}
    planners = {
        uav: InterventionPlanner(planner, world, period, channel=channel is not None, alone=len(plans) == 1)
        for uav, planner in plans.items()
    }
    gatekeeper, retry = None, repeats_after(scenario)
    if chosen.gated:
        gatekeeper = Gatekeeper(
            make_gatekeepers(scenario, law), world, period=scenario.gatekeeper.period_s, control=period,
            retry=retry if channel else None,
        )  # fmt: skip
    answering = gatekeeper or DirectAcceptance(n, channel_period=period if channel else None)
    answers = {
        port.get_name(): port for port in outputs_of(answering) if not (channel and port.get_name() == "reports")
    }
    own = scenario.ugv_controller
    between = positions_between(scenario, world, law)
    ugvs = OwnUgvController(own, world, law, ugv_controller) if own else between.controller
    uavs = {uav: _uav_controller(scenario, world, uav) for uav in scenario.aerial}
    # input ports of the parts for which `bodies` are positions as published, and as UAVs see them
    measured, seen = ({} if port == "bodies" else {"bodies": port} for port in (between.published, between.seen))
    views = {uav: {"bodies": between.views[uav]} if between.views else measured for uav in uavs}
    parts = {
        "decision_making": decision,
        "task_planning": _task_planning(presets, planners, ugvs, uavs, measured, seen, views),
        "optimisation": _assembled("optimisation", {"gatekeeper": answering}, answers, renamed={answering: measured}),
        "vehicles": vehicles,
    }
    links = None
    if channel:
        down, up = make_links(channel)
        start, sent = next(iter(plans.values())).start(), _named("sent", plans).values()
        links = Downlink(down, sent, start, period, retry, [*scenario.lost_s.values()]), Uplink(up, period)
        parts |= {"downlink": links[0], "uplink": links[1]}
    if errors := errors_of(scenario, world):
        parts["sensing"] = PositionSensing(errors, world, between.views)
    parts |= between.parts
    if monitor is not None:
        parts["monitor"] = monitor
    named = {port.get_name(): port for part in parts.values() for port in outputs_of(part)}
    if isinstance(ugvs, OwnUgvController):
        ugvs.require_inputs(named)
    recorded = (*RECORDED, *(name for name in (*OF_SOME, *between.views.values()) if name in named))
    exported = [*recorded, *(["violation"] if monitor is not None else [])]
    diagram = _assembled(f"{scenario.name}_method_{chosen.id}", parts, named, exported, renamed=between.renamed)
    return Model(
        diagram=diagram,
        world=world,
        decision_block=block,
        trigger=trigger,
        planners=planners,
        gatekeeper=gatekeeper,
        controllers=(ugvs, *uavs.values()),
        signals=signals,
        recorded=recorded,
        links=links,
        answering=answering,
    )


def method_drawn(scenario: Scenario) -> str:
    """Identifier of the method to draw: (c), as in the paper's Figure 2, if a run has it, else the last."""
    # The last is that with the most parts among the scenario's runs.
    methods = {run.method for run in scenario.runs.values()}
    return "c" if "c" in methods else max(methods, key=list(METHODS).index)


def _chosen(scenario: Scenario, method: str | None, composition: str | None) -> tuple[Method, Composition]:
    """The requested method and composition; without a method, those of the scenario's last run."""
    if method is None:
        last = next(reversed(scenario.runs.values()))
        method = last.method
        composition = last.composition if composition is None else composition
    composition = "augmented" if composition is None else composition
    if composition not in COMPOSITIONS:
        raise UnknownNameError("composition", composition, COMPOSITIONS)
    chosen = method_of(method)
    if scenario.asynchronous and (composition != "augmented" or (chosen.intervenes and chosen.intervention_on_top)):
        raise ScenarioError(scenario.name, "control.law", "asynchronous", "shared: avoidance is not on top in this run")
    return chosen, composition


def _decision_making(scenario: Scenario, n: int, variable: System, events: EventTrigger) -> Diagram:
    """The decision-making layer of n UGVs: noise, decision variables, trigger."""
    source, noise = components.make_noise(n, scenario.decision)
    systems = {
        "noise_source": source, "decision_noise": noise, "decision_variable": variable, "event_trigger": events,
    }  # fmt: skip
    named = {
        "noise": noise.get_output_port(),
        "decision_variable": variable.GetOutputPort("decision_variable"),
        "decision_range": variable.GetOutputPort("decision_range"),
        "status": events.GetOutputPort("status"),
    }
    exported = [name for name in named if name != "decision_range"]
    return _assembled("decision_making", systems, named, exported, [(source.get_output_port(), noise.get_input_port())])


def _task_planning(
    presets: Sequence[Motion],
    planners: Mapping[str, InterventionPlanner],
    ugvs: UgvController | OwnUgvController,
    uavs: Mapping[str, UavController],
    measured: Mapping[str, str],
    seen: Mapping[str, str],
    views: Mapping[str, Mapping[str, str]],
) -> Diagram:
    """The task planning layer: preset trajectories, planners, controllers."""
    times, places = components.stack_presets(list(presets))
    reference = TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, places.T), output_derivative_order=1)
    systems: dict[str, System] = {"reference": reference}
    systems |= {name: planners[uav] for uav, name in _named("intervention_planner", planners).items()}
    systems |= {"ugv_controller": ugvs}
    systems |= {name: uavs[uav] for uav, name in _named("uav_controller", uavs).items()}
    asks: System
    flies: System
    wires = []
    if len(uavs) == 1:
        (asks,), (flies,) = planners.values(), uavs.values()
    else:
        asks, flies = AllProposals([*uavs], len(presets)), Multiplexer([3] * len(uavs))
        systems |= {"all_proposals": asks, "uav_command": flies}
        for k, uav in enumerate(uavs):
            wires.append((planners[uav].GetOutputPort("proposals"), asks.GetInputPort(f"proposals_{uav}")))
            wires.append((asks.GetOutputPort("proposals"), planners[uav].GetInputPort("proposals")))
            wires.append((uavs[uav].GetOutputPort("command"), flies.get_input_port(k)))
    sent = {
        name: planners[uav].GetOutputPort("sent")
        for uav, name in _named("sent", planners).items() if planners[uav].HasOutputPort("sent")
    }  # fmt: skip
    named = {
        "reference": reference.get_output_port(),
        **(sent or {"proposals": asks.GetOutputPort("proposals")}),
        "ugv_command": ugvs.GetOutputPort("command"),
        "executing": ugvs.GetOutputPort("executing"),
        **({"command_share": ugvs.GetOutputPort("command_share")} if ugvs.HasOutputPort("command_share") else {}),
        "gains": ugvs.GetOutputPort("gains"),
        "uav_command": flies.get_output_port(0),
    }
    renamed: dict[System, Mapping[str, str]] = {ugvs: measured, **{uavs[uav]: view for uav, view in views.items()}}
    renamed |= dict.fromkeys(planners.values(), seen)
    return _assembled("task_planning", systems, named, None, wires, renamed=renamed)


def _named(block: str, uavs: Iterable[str]) -> dict[str, str]:
    """Names of a block or port of each UAV, with the UAV's name if there are several."""
    names = [*uavs]
    return {uav: block if len(names) == 1 else f"{block}_{uav}" for uav in names}


def _vehicles(world: World, plants: Mapping[str, System], *, disturbed: bool) -> Diagram:
    """The vehicles: commands, disturbances, plants, positions."""
    builder = DiagramBuilder()
    sizes = [3 * len(world.names(kind)) for kind in ROBOTS]
    team_command = builder.AddNamedSystem("team_command", Multiplexer(sizes))
    commanded = team_command.get_output_port()
    if disturbed:
        disturbance = builder.AddNamedSystem("velocity_disturbance", VelocityDisturbance(world.robots))
        builder.Connect(commanded, disturbance.GetInputPort("command"))
        commanded = disturbance.GetOutputPort("velocity")
    velocities = builder.AddNamedSystem("team_velocity", Demultiplexer(sum(sizes), 3))
    for body, plant in plants.items():
        builder.AddNamedSystem(f"{body}_plant", plant)
    bodies = together(builder, "bodies", [plant.get_output_port(0) for plant in plants.values()])
    for i, robot in enumerate(world.robots):
        builder.Connect(velocities.get_output_port(i), plants[robot].get_input_port(0))
    builder.Connect(commanded, velocities.get_input_port())
    for i, kind in enumerate(ROBOTS):
        builder.ExportInput(team_command.get_input_port(i), f"{kind}_command")
    for robot in world.robots if disturbed else ():
        builder.ExportInput(disturbance.GetInputPort(f"disturbance_{robot}"), f"disturbance_{robot}")
    builder.ExportOutput(bodies, "bodies")
    builder.ExportOutput(team_command.get_output_port(), "team_command")
    signals = [port for plant in plants.values() for port in outputs_of(plant) if port.get_name() == "signals"]
    if signals:
        builder.ExportOutput(together(builder, "plant_signals", signals), "plant_signals")
    if own := _own_headings(world, plants):
        builder.ExportOutput(together(builder, "own_headings", [*own.values()]), "own_headings")
    if world.steering is not None:
        of_ugvs = [{port.get_name(): port for port in outputs_of(plants[name])} for name in world.names("ugv")]
        none = builder.AddNamedSystem("no_heading", ConstantVectorSource([0.0])).get_output_port()
        headings = [ports.get("heading", none) for ports in of_ugvs]
        builder.ExportOutput(together(builder, "headings", headings), "headings")
    return _built("vehicles", builder)


def together(builder: DiagramBuilder, name: str, ports: Sequence[OutputPort]) -> OutputPort:
    """One output port that stacks the values of several."""
    multiplexer = builder.AddNamedSystem(name, Multiplexer([port.size() for port in ports]))
    for i, port in enumerate(ports):
        builder.Connect(port, multiplexer.get_input_port(i))
    return multiplexer.get_output_port()


def _assembled(
    name: str,
    systems: Mapping[str, System],
    named: Mapping[str, OutputPort],
    exported: Iterable[str] | None = None,
    wires: Iterable[tuple[OutputPort, InputPort]] = (),
    renamed: Mapping[System, Mapping[str, str]] = MappingProxyType({}),
) -> Diagram:
    """A Diagram of systems by name, in which input ports are fed by name."""
    # exported: which of `named` become output ports of the diagram; default: all.
    # renamed: of some systems, what feeds an input port of a name.
    builder = DiagramBuilder()
    for key, system in systems.items():
        builder.AddNamedSystem(key, system)
    for source, target in wires:
        builder.Connect(source, target)
    inputs = set()
    for port in (port for system in systems.values() for port in inputs_of(system)):
        wanted = renamed.get(port.get_system(), {}).get(port.get_name(), port.get_name())
        if builder.IsConnectedOrExported(port):
            continue
        with raised_as(lambda error: PluginError(described(error))):  # a user's block may have ports of other sizes
            if wanted in named:
                builder.Connect(named[wanted], port)
            elif wanted in inputs:
                builder.ConnectInput(wanted, port)
            else:
                builder.ExportInput(port, wanted)
                inputs.add(wanted)
    for key in named if exported is None else exported:
        builder.ExportOutput(named[key], key)
    return _built(name, builder)


def _built(name: str, builder: DiagramBuilder) -> Diagram:
    diagram = builder.Build()
    diagram.set_name(name)
    return diagram


def make_monitor(
    scenario: Scenario, method: str | None = None, composition: Composition | None = None, *, terminate: bool = False
) -> Monitor:
    """A monitor of a diagram of the scenario, with laws made separately from it.

    Args:
        scenario: what must hold; the diagram may have been built from another one.
        method: default: that of the scenario's last run.
        composition: of the UGVs' avoidance tasks; default: as in `build_diagram`.
        terminate: end the simulation at the first violation.

    Raises:
        ScenarioError, UnknownNameError, PluginError: as `build_diagram`; also if the UGVs have a controller of the
            user's, whose law is not known, or act on measured positions or on messages about positions, which a
            monitor does not see.
    """
    scenario = validated(scenario)
    if scenario.ugv_controller is not None:
        cause = f"ugv_controller {scenario.ugv_controller.kind!r} has no law that is known here"
        raise PluginError(f"{cause}; allowed for a monitor: a scenario without one")
    if scenario.sensing is not None:
        cause = f"sensing of scenario {scenario.name!r} has errors, and a monitor sees true positions"
        raise PluginError(f"{cause}; allowed: a scenario without sensing")
    if scenario.ugv_links is not None:
        cause = f"channel.ugvs of scenario {scenario.name!r} says what UGVs know, and a monitor sees true positions"
        raise PluginError(f"{cause}; allowed: a scenario without it")
    chosen, composition = _chosen(scenario, method, composition)
    world = make_world(scenario)
    ugvs = UgvController(world, components.make_law(scenario, chosen, composition))
    uavs = [_uav_controller(scenario, world, uav) for uav in scenario.aerial]

    def of_uavs(t: float, positions: Array, commands: Array) -> Array:
        return np.stack([uav.velocity(t, positions, commands) for uav in uavs])

    return Monitor(world, components.make_avoidance(scenario), Laws(ugvs.velocity, of_uavs), terminate=terminate)


def _uav_controller(scenario: Scenario, world: World, name: str) -> UavController:
    uav = scenario.aerial[name]
    return UavController(
        world,
        components.make_avoidance(scenario),
        uav=name,
        ugvs=scenario.in_charge(name),
        task=UAV_TASKS.load(uav.task, of=Task),
        gain=scenario.control.formation_gain_1_s,
        altitude=uav.altitude_m,
    )


def _own_headings(world: World, plants: Mapping[str, System]) -> dict[str, OutputPort]:
    own = [body.name for body in world.moving if body.plant and body.plant.measured]
    return {name: plants[name].GetOutputPort("heading") for name in own if plants[name].HasOutputPort("heading")}


def _checked_block(n: int, block: System) -> System:
    if not isinstance(block, System):
        raise PluginError(f"decision_block makes {short(repr(block))}; allowed: a System such as a DecisionBlock")
    sizes = {port.get_name(): port.size() for port in outputs_of(block)}
    wanted = {"decision_variable": n, "decision_range": 2 * n}
    if any(sizes.get(name) != size for name, size in wanted.items()):
        raise PluginError(f"the decision block has output ports of sizes {sizes}; they must include {wanted}")
    return block
