"""From a scenario to a Drake Diagram: one named system per component, wired by port names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar, get_args

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import (
    AffineSystem,
    Demultiplexer,
    Integrator,
    Multiplexer,
    RandomSource,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.arrays import Array
from airground_drake.decision.bayes import optimal_threshold
from airground_drake.decision.trigger import Trigger
from airground_drake.gatekeeper.answer import Rules
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.prediction import Horizon, UgvLaw
from airground_drake.gatekeeper.routes.branch_and_bound import BranchAndBoundRoute
from airground_drake.gatekeeper.routes.closed_loop_enumeration import ClosedLoopEnumerationRoute
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute
from airground_drake.gatekeeper.routes.nonlinear import NonlinearRoute
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.gatekeeper.routes.route import Route
from airground_drake.intervention.database import BehaviourDatabase, make_policy
from airground_drake.nsbc.avoidance import Avoidance, Composition
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import (
    DecisionVariable,
    DirectAcceptance,
    EventTrigger,
    Gatekeeper,
    InterventionPlanner,
    UavController,
    UgvController,
)

Method = Literal["a", "b", "c", "d"]
"""(a) no intervention, (b) no gatekeeper, (c) the paper's gatekeeper, (d) certified: avoidance always on top."""

METHODS: tuple[Method, ...] = get_args(Method)

ROUTES: dict[str, Callable[[], Route]] = {
    "relaxed": RelaxedRoute,
    "enumeration": EnumerationRoute,
    "nonlinear": NonlinearRoute,
    "branch_and_bound": BranchAndBoundRoute,
    "rollout": ClosedLoopEnumerationRoute,
}

S = TypeVar("S", bound=System)

RECORDED = (
    "team_position", "team_command", "reference", "noise", "decision_variable", "status", "accepted",
)  # fmt: skip
"""Exported output ports of the diagram, the signals of a trace."""


@dataclass(frozen=True)
class Model:
    """A diagram and the systems in it that a simulation reads or sets.

    Attributes:
        diagram: the whole system; its exported output ports are RECORDED.
        method: which method's priorities and gatekeeper it has.
        team: names, safe distances, speed limits.
        zeta: decision threshold in force, m.
        plants: the robots' Integrators, in team order.
        starts: initial positions, (n + 1, 3), m.
        planner: the UAV's planner.
        gatekeeper: the optimising gatekeeper (methods (c), (d)), else None.
    """

    diagram: Diagram
    method: Method
    team: Team
    zeta: float
    plants: tuple[Integrator, ...]
    starts: Array
    planner: InterventionPlanner
    gatekeeper: Gatekeeper | None

    def create_context(self) -> Context:
        """A default context with the robots at their starts."""
        context = self.diagram.CreateDefaultContext()
        self.set_starts(context)
        return context

    def set_starts(self, context: Context) -> None:
        """Put the robots at their starts in a context of the diagram, or of one that contains it."""
        for plant, start in zip(self.plants, self.starts, strict=True):
            plant.set_integral_value(plant.GetMyMutableContextFromRoot(context), start)


def build_diagram(scenario: Scenario, method: Method | None = None, composition: Composition = "augmented") -> Diagram:
    """The diagram of a scenario, for inspection, simulation or embedding.

    Args:
        scenario: a validated scenario.
        method: default: that of the scenario's last run.
        composition: of the UGVs' avoidance tasks.

    Returns:
        A Diagram with the exported outputs RECORDED; robots start at the origin until their integrators are
        set (`build_model(...).create_context()` does that).
    """
    chosen = method if method is not None else next(reversed(scenario.runs.values())).method
    return build_model(scenario, chosen, composition).diagram  # type: ignore[arg-type]


def build_model(scenario: Scenario, method: Method, composition: Composition = "augmented") -> Model:
    """Build and wire all components of one method.

    Raises:
        PolicyError: if the scenario names a policy that cannot be made.
    """
    control, decision = scenario.control, scenario.decision
    team, presets = make_team(scenario), make_presets(scenario)
    n = len(team.ugvs)
    zeta = threshold(scenario)
    ugv_avoidance = Avoidance(control.avoidance_gain_1_s, control.period_s, control.sensing_range_m, composition)
    uav_avoidance = Avoidance(control.avoidance_gain_1_s, control.period_s, control.sensing_range_m)
    law = UgvLaw(
        ugv_avoidance, control.motion_gain_1_s, control.intervention_gain_1_s, intervention_on_top=method != "d"
    )

    builder = DiagramBuilder()

    def add(name: str, system: S) -> S:
        builder.AddNamedSystem(name, system)
        return system

    plants = tuple(add(f"{robot}_plant", Integrator(3)) for robot in team.robots)
    team_position = add("team_position", Multiplexer([3] * (n + 1)))
    team_command = add("team_command", Multiplexer([3 * n, 3]))
    ugv_commands = add("ugv_commands", Demultiplexer(3 * n, 3))
    reference = add("reference", TrajectorySource(stack_presets(presets), output_derivative_order=1))
    noise_source = add("noise_source", RandomSource(RandomDistribution.kGaussian, n, decision.noise_period_s))
    noise = add(
        "decision_noise", integrated_noise(n, decision.noise_m_sqrt_s, decision.leak_1_s, decision.noise_period_s)
    )
    decision_variable = add("decision_variable", DecisionVariable(n))
    trigger = add("event_trigger", EventTrigger(n, make_trigger(scenario, zeta)))
    policies = [] if method == "a" else scenario.intervention.policies
    planner = add(
        "intervention_planner",
        InterventionPlanner(
            team.ugvs,
            BehaviourDatabase(
                [(entry.name, make_policy(entry.name, entry.parameters)) for entry in policies],
                retry=scenario.intervention.retry_s,
                ranking=scenario.intervention.ranking,  # type: ignore[arg-type]
                budget=scenario.intervention.budget_s,
            ),
            period=scenario.intervention.period_s,
            presets=presets,
            targets=np.array([ugv.target_m for ugv in scenario.ugvs.values()]),
            known_obstacles=_positions([o.position_m for o in scenario.obstacles.values() if o.known_to_uav]),
            safe_distance=team.obstacle_distance,
        ),
    )
    ugv_controller = add(
        "ugv_controller",
        UgvController(
            team,
            ugv_avoidance,
            motion_gain=law.motion_gain,
            intervention_gain=law.intervention_gain,
            intervention_on_top=law.intervention_on_top,
        ),
    )
    uav_controller = add(
        "uav_controller",
        UavController(team, uav_avoidance, formation_gain=control.formation_gain_1_s, altitude=scenario.uav.altitude_m),
    )
    gatekeeper = None
    if method in ("c", "d"):
        gatekeeper = Gatekeeper(
            team,
            law,
            presets,
            ROUTES[scenario.gatekeeper.route](),
            make_horizon(scenario),
            period=scenario.gatekeeper.period_s,
            rules=make_rules(scenario),
        )
    gate = add("gatekeeper", gatekeeper if gatekeeper is not None else DirectAcceptance(n))

    def connect(source: System, output: str, target: System, port: str) -> None:
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def only(source: System, target: System) -> None:  # primitives with one input or output
        builder.Connect(source.get_output_port(), target.get_input_port())

    for i, plant in enumerate(plants):
        builder.Connect(plant.get_output_port(), team_position.get_input_port(i))
        if i < n:
            builder.Connect(ugv_commands.get_output_port(i), plant.get_input_port())
    builder.Connect(uav_controller.GetOutputPort("command"), plants[-1].get_input_port())
    builder.Connect(ugv_controller.GetOutputPort("command"), ugv_commands.get_input_port())
    builder.Connect(ugv_controller.GetOutputPort("command"), team_command.get_input_port(0))
    builder.Connect(uav_controller.GetOutputPort("command"), team_command.get_input_port(1))
    only(noise_source, noise)
    for target in (decision_variable, ugv_controller, uav_controller, planner, gatekeeper):
        if target is not None:
            builder.Connect(team_position.get_output_port(), target.GetInputPort("team_position"))
    for target in (decision_variable, ugv_controller):
        builder.Connect(reference.get_output_port(), target.GetInputPort("reference"))
    builder.Connect(noise.get_output_port(), decision_variable.GetInputPort("noise"))
    connect(decision_variable, "decision_variable", trigger, "decision_variable")
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
    for name in RECORDED:
        builder.ExportOutput(sources[name], name)
    diagram = builder.Build()
    diagram.set_name(f"{scenario.name}_method_{method}")
    starts = _positions([*(ugv.start_m for ugv in scenario.ugvs.values()), scenario.uav.start_m])
    return Model(diagram, method, team, zeta, plants, starts, planner, gatekeeper)


def make_team(scenario: Scenario) -> Team:
    """Names, safe distances and speed limits of the scenario's robots."""
    speeds = [ugv.max_speed_m_s for ugv in scenario.ugvs.values()]
    return Team(
        ugvs=tuple(scenario.ugvs),
        uav=scenario.uav.name,
        obstacles=_positions([obstacle.position_m for obstacle in scenario.obstacles.values()]),
        obstacle_distance=scenario.safe_distance.obstacle_m,
        ugv_distance=scenario.safe_distance.ugv_m,
        air_ground_distance=scenario.safe_distance.air_ground_m,
        max_speed=np.array([*speeds, scenario.uav.max_speed_m_s]),
    )


def make_presets(scenario: Scenario) -> list[Motion]:
    """Preset trajectories of the UGVs."""
    return [Motion.at_speed(_positions(ugv.preset.waypoints_m), ugv.preset.speed_m_s) for ugv in scenario.ugvs.values()]


def make_horizon(scenario: Scenario) -> Horizon:
    """The gatekeeper's grid and weights."""
    gate = scenario.gatekeeper
    substeps = round(gate.horizon_s / gate.stages / scenario.control.period_s)
    return Horizon(gate.stages, substeps, gate.error_weight_1_m2_s, gate.slack_weight_1_m2_s)


def make_rules(scenario: Scenario) -> Rules:
    """When the gatekeeper's decisions become answers, and what they may cost."""
    gate = scenario.gatekeeper
    return Rules(
        switching_margin=gate.switching_margin,
        min_dwell=gate.min_dwell_s,
        max_bend=gate.max_bend,
        budget=Budget(gate.budget_iterations, gate.budget_nodes),
        budget_share=gate.budget_share if gate.budget == "wall_clock" else None,
    )


def make_trigger(scenario: Scenario, zeta: float) -> Trigger:
    """The trigger automaton with threshold zeta, m."""
    if scenario.decision.trigger == "bare":
        return Trigger.bare(zeta)
    return Trigger(zeta, scenario.decision.release_m, scenario.decision.min_inter_event_s)


def threshold(scenario: Scenario) -> float:
    """Decision threshold zeta, m: the fixed one, or the minimiser of the Bayes risk (16)."""
    rule = scenario.decision.threshold
    if rule.rule == "bayes":
        return optimal_threshold(rule.drift_m_s, rule.noise_m_sqrt_s, rule.c1_1_s, rule.c2)
    return rule.zeta_m


def _positions(rows: list[list[float]]) -> Array:
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def stack_presets(presets: list[Motion]) -> PiecewisePolynomial:
    """All presets as one trajectory of 3n components over the union of their vertices."""
    times = np.unique(np.concatenate([preset.times for preset in presets]))
    samples = np.concatenate([preset.sample(times) for preset in presets], axis=1)
    return PiecewisePolynomial.FirstOrderHold(times, samples.T)


def integrated_noise(count: int, intensity: float, leak: float, period: float) -> AffineSystem:
    """dn = -leak n dt + intensity dW for noise samples held over `period`: Euler-Maruyama on that grid."""
    eye, zero = np.eye(count), np.zeros(count)
    return AffineSystem(
        A=-leak * eye, B=intensity / np.sqrt(period) * eye, f0=zero, C=eye, D=0.0 * eye, y0=zero, time_period=0.0
    )
