"""From a scenario to a Drake Diagram: one named system per component, wired by port names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from pydrake.common import RandomDistribution
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import Demultiplexer, Multiplexer, RandomSource, TrajectorySource

from airground_drake import components
from airground_drake.arrays import Array
from airground_drake.errors import PluginError, UnknownNameError
from airground_drake.nsbc.avoidance import COMPOSITIONS, Composition
from airground_drake.nsbc.task import Task
from airground_drake.nsbc.team import Team
from airground_drake.registry import UAV_TASKS, Method, method_of
from airground_drake.scenarios.load import validated
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import (
    DecisionVariable,
    DirectAcceptance,
    EventTrigger,
    Gatekeeper,
    InterventionPlanner,
    Laws,
    Monitor,
    UavController,
    UgvController,
    VelocityDisturbance,
)

S = TypeVar("S", bound=System)

RECORDED = (
    "team_position", "team_command", "reference", "noise", "decision_variable", "status", "accepted",
)  # fmt: skip
"""Exported output ports of the diagram, the signals of a trace."""

PlantFactory = Callable[[str, Array], System]
"""Makes the plant of a robot from its name and its start (3,), m: a System with one input, the velocity (3,), m/s, and
one output, the position (3,), m, both in the world frame, whose default state has the robot at its start."""


@dataclass(frozen=True)
class Model:
    """A diagram and the systems in it that a simulation reads.

    Attributes:
        diagram: the whole system; its exported output ports are RECORDED.
        method: which method's priorities and gatekeeper it has.
        team: names, safe distances, speed limits.
        zeta: decision threshold in force, m.
        planner: the UAV's planner.
        gatekeeper: the optimising gatekeeper (methods (c), (d)), else None.
    """

    diagram: Diagram
    method: Method
    team: Team
    zeta: float
    planner: InterventionPlanner
    gatekeeper: Gatekeeper | None


def build_diagram(
    scenario: Scenario,
    method: str | None = None,
    composition: Composition = "augmented",
    plants: PlantFactory = components.first_order_plant,
    monitor: Monitor | None = None,
) -> Diagram:
    """The diagram of a scenario, for inspection, simulation or embedding.

    Args:
        scenario: from a file or made in Python.
        method: default: that of the scenario's last run.
        composition: of the UGVs' avoidance tasks.
        plants: makes the plant of each robot. The claims are about the default, `first_order_plant`.
        monitor: watches the diagram while it runs; see `make_monitor`.

    Returns:
        A Diagram whose default context has every robot at its start. Outputs: RECORDED. Inputs:
        `disturbance_<robot>` (3), m/s, added to the robot's velocity; 0 where not connected. With a monitor, its
        output `violation`, too.

    Raises:
        ScenarioError: if the scenario is not valid.
        UnknownNameError: if there is no such method or composition.
        PluginError: if it names a policy, route or task that cannot be made, or a plant has other ports.
    """
    return build_model(scenario, method, composition, plants, monitor).diagram


def build_model(
    scenario: Scenario,
    method: str | None = None,
    composition: Composition = "augmented",
    plants: PlantFactory = components.first_order_plant,
    monitor: Monitor | None = None,
) -> Model:
    """Build and wire all components of one method; arguments and errors are those of `build_diagram`."""
    scenario = validated(scenario)
    chosen = method_of(next(reversed(scenario.runs.values())).method if method is None else method)
    if composition not in COMPOSITIONS:
        raise UnknownNameError("composition", composition, COMPOSITIONS)
    team, presets = components.make_team(scenario), components.make_presets(scenario)
    n = len(team.ugvs)
    zeta = components.threshold(scenario)
    law = components.make_law(scenario, chosen, composition)
    decision = scenario.decision

    builder = DiagramBuilder()

    def add(name: str, system: S) -> S:
        builder.AddNamedSystem(name, system)
        return system

    # first, so that its seed does not depend on what a plant may draw
    noise_source = add("noise_source", RandomSource(RandomDistribution.kGaussian, n, decision.noise_period_s))
    starts = components.make_starts(scenario)
    bodies = [
        add(f"{robot}_plant", _checked(robot, plants(robot, start)))
        for robot, start in zip(team.robots, starts, strict=True)
    ]
    team_position = add("team_position", Multiplexer([3] * (n + 1)))
    team_command = add("team_command", Multiplexer([3 * n, 3]))
    disturbance = add("velocity_disturbance", VelocityDisturbance(team.robots))
    velocities = add("team_velocity", Demultiplexer(3 * (n + 1), 3))
    reference = add("reference", TrajectorySource(components.stack_presets(presets), output_derivative_order=1))
    noise = add(
        "decision_noise",
        components.integrated_noise(n, decision.noise_m_sqrt_s, decision.leak_1_s, decision.noise_period_s),
    )
    decision_variable = add("decision_variable", DecisionVariable(n))
    trigger = add("event_trigger", EventTrigger(n, components.make_trigger(scenario, zeta), presets))
    planning = components.make_planner(scenario, chosen)
    planner = add("intervention_planner", InterventionPlanner(planning, scenario.control.period_s))
    ugv_controller = add("ugv_controller", UgvController(team, law))
    uav_controller = add("uav_controller", _uav_controller(scenario, team))
    gatekeeper = None
    if chosen.gated:
        gatekeepers = components.make_gatekeepers(scenario, law)
        gatekeeper = Gatekeeper(gatekeepers, n, period=scenario.gatekeeper.period_s, control=scenario.control.period_s)
    gate = add("gatekeeper", gatekeeper if gatekeeper is not None else DirectAcceptance(n))

    def connect(source: System, output: str, target: System, port: str) -> None:
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    for i, plant in enumerate(bodies):
        builder.Connect(plant.get_output_port(0), team_position.get_input_port(i))
        builder.Connect(velocities.get_output_port(i), plant.get_input_port(0))
    builder.Connect(ugv_controller.GetOutputPort("command"), team_command.get_input_port(0))
    builder.Connect(uav_controller.GetOutputPort("command"), team_command.get_input_port(1))
    builder.Connect(team_command.get_output_port(), disturbance.GetInputPort("command"))
    builder.Connect(disturbance.GetOutputPort("velocity"), velocities.get_input_port())
    builder.Connect(noise_source.get_output_port(), noise.get_input_port())
    for target in (decision_variable, trigger, ugv_controller, uav_controller, planner, gatekeeper):
        if target is not None:
            builder.Connect(team_position.get_output_port(), target.GetInputPort("team_position"))
    for target in (decision_variable, trigger, ugv_controller):
        builder.Connect(reference.get_output_port(), target.GetInputPort("reference"))
    for target in (decision_variable, trigger):
        builder.Connect(noise.get_output_port(), target.GetInputPort("noise"))
    connect(trigger, "status", planner, "status")
    connect(planner, "proposals", ugv_controller, "proposals")
    connect(planner, "proposals", gate, "proposals")
    connect(gate, "answers", ugv_controller, "answers")
    connect(gate, "answers", planner, "answers")
    connect(gate, "reports", planner, "reports")
    connect(ugv_controller, "command", uav_controller, "ugv_command")
    if gatekeeper is not None:
        connect(ugv_controller, "command", gatekeeper, "ugv_command")
        connect(uav_controller, "command", gatekeeper, "uav_command")

    sources = {
        "team_position": team_position.get_output_port(),
        "team_command": team_command.get_output_port(),
        "reference": reference.get_output_port(),
        "noise": noise.get_output_port(),
        "decision_variable": decision_variable.GetOutputPort("decision_variable"),
        "status": trigger.GetOutputPort("status"),
        "accepted": ugv_controller.GetOutputPort("accepted"),
    }
    if monitor is not None:
        add("monitor", monitor)
        for name in ("team_position", "team_command", "reference"):
            builder.Connect(sources[name], monitor.GetInputPort(name))
        connect(planner, "proposals", monitor, "proposals")
        connect(gate, "answers", monitor, "answers")
        builder.ExportOutput(monitor.GetOutputPort("violation"), "violation")
    for name in RECORDED:
        builder.ExportOutput(sources[name], name)
    for robot in team.robots:
        builder.ExportInput(disturbance.GetInputPort(f"disturbance_{robot}"), f"disturbance_{robot}")
    diagram = builder.Build()
    diagram.set_name(f"{scenario.name}_method_{chosen.id}")
    return Model(diagram, chosen, team, zeta, planner, gatekeeper)


def make_monitor(
    scenario: Scenario, method: str | None = None, composition: Composition = "augmented", *, terminate: bool = False
) -> Monitor:
    """A monitor of a diagram of the scenario, with laws of its own.

    Args:
        scenario: what is to hold, whatever the diagram was built from.
        method: default: that of the scenario's last run.
        composition: of the UGVs' avoidance tasks.
        terminate: end the simulation at the first violation.

    Raises:
        ScenarioError, UnknownNameError, PluginError: as `build_diagram`.
    """
    scenario = validated(scenario)
    chosen = method_of(next(reversed(scenario.runs.values())).method if method is None else method)
    team = components.make_team(scenario)
    ugvs = UgvController(team, components.make_law(scenario, chosen, composition))
    laws = Laws(ugvs.velocity, _uav_controller(scenario, team).velocity)
    return Monitor(team, components.make_avoidance(scenario), laws, terminate=terminate)


def _uav_controller(scenario: Scenario, team: Team) -> UavController:
    return UavController(
        team,
        components.make_avoidance(scenario),
        task=UAV_TASKS.load(scenario.uav.task, of=Task),
        gain=scenario.control.formation_gain_1_s,
        altitude=scenario.uav.altitude_m,
    )


def _checked(robot: str, plant: System) -> System:
    """The plant of a robot, if it has the ports of one.

    Raises:
        PluginError: if not.
    """
    ports = [plant.get_input_port(i).size() for i in range(plant.num_input_ports())]
    outputs = [plant.get_output_port(i).size() for i in range(plant.num_output_ports())]
    if ports[:1] != [3] or outputs[:1] != [3]:
        wanted = "allowed: velocity (3) first among its inputs, position (3) first among its outputs"
        raise PluginError(f"the plant of {robot} has inputs of sizes {ports}, outputs of sizes {outputs}; {wanted}")
    return plant
