"""Factories: each makes one part of the diagram from a scenario."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.systems.primitives import AffineSystem, RandomSource

from airground_drake.base.arrays import Array
from airground_drake.base.errors import ScenarioError
from airground_drake.base.registry import ROUTES, Method
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance, Composition
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.trigger.automaton import Trigger
from airground_drake.model.trigger.bayes import threshold
from airground_drake.scenario.budget import budget, takes_room
from airground_drake.scenario.courses import course
from airground_drake.scenario.links import repeats_after
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.schema import Decision, Scenario, Uav
from airground_drake.scenario.world import make_world
from airground_drake.uav.database import BehaviourDatabase, make_policy
from airground_drake.uav.planner import Mover, Planner, Sender
from airground_drake.ugv.answer import Rules
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.drake_solvers import SOLVERS, lacking
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers, PaperGatekeepers
from airground_drake.ugv.outcome import Outlook
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.patience import Patience
from airground_drake.ugv.problem import Horizon
from airground_drake.ugv.routes.route import Route

# Times of vertices that are this close (s, or relative) are equal but for rounding: they are sums of quotients.
SAME_TIME = 1e-12


def make_avoidance(scenario: Scenario, composition: Composition = "augmented") -> Avoidance:
    control = scenario.control
    stands = scenario.stands
    return Avoidance(control.avoidance_gain_1_s, control.period_s, control.sensing_range_m, composition, stands)


def make_law(scenario: Scenario, method: Method, composition: Composition = "augmented") -> UgvLaw:
    control, avoidance = scenario.control, make_avoidance(scenario, composition)
    return UgvLaw(avoidance, control.motion_gain_1_s, control.intervention_gain_1_s, method.intervention_on_top)


def make_planner(scenario: Scenario, method: Method, uav: str) -> Planner:
    """The planner of a UAV with its policies (none under a method without interventions) and its map."""
    mapped, appears, disappears = make_map(scenario, scenario.aerial[uav])
    given = scenario.intervention
    policies = given.policies if method.intervenes else []
    radius, apart = _planned_apart(scenario)
    database = BehaviourDatabase(
        [(entry.name, make_policy(entry.name, entry.parameters, given.budget_s)) for entry in policies],
        retry=given.retry_s,
        ranking=given.ranking,  # type: ignore[arg-type]
        budget=given.budget_s,
        joint=not method.intervention_on_top,  # the paper's UGVs decide individually
    )
    return Planner(
        ugvs=tuple(scenario.ugvs),
        database=database,
        period=given.period_s,
        presets=tuple(make_presets(scenario)),
        targets=positions([ugv.target_m for ugv in scenario.ugvs.values()]),
        mapped=mapped,
        mapped_from=appears,
        mapped_until=disappears,
        movers=make_movers(scenario),
        coasting=scenario.gatekeeper.horizon_s,
        robot_distance=apart,
        max_speed=np.array([ugv.max_speed_m_s for ugv in scenario.ugvs.values()]),
        radius=radius,
        trails=tuple(
            plant_of(ugv, scenario.control.period_s).trails(ugv.max_speed_m_s) for ugv in scenario.ugvs.values()
        ),
        sender=Sender(uav, first=[*scenario.aerial].index(uav), step=len(scenario.aerial)),
        lead=scenario.channel.delay_s if scenario.channel else 0.0,
        retry=repeats_after(scenario),
        charge=tuple(ugv in scenario.in_charge(uav) for ugv in scenario.ugvs),
        lost_at=scenario.aerial[uav].lost_at_s or np.inf,
    )


def _planned_apart(scenario: Scenario) -> tuple[Array, float]:
    """Radii of the UGVs, (n,), and distance between them, m, for plans that keep the law's distances."""
    # A UGV whose plant costs distance is planned as a larger disc.
    more, between = dict.fromkeys(scenario.ugvs, 0.0), 0.0
    budgets = budget(scenario) if takes_room(scenario) else ()
    pairs = [pair for pair in budgets if pair.terms and pair.first in more]
    for pair in pairs:
        if pair.kind in ("obstacle", "moving"):
            more[pair.first] = max(more[pair.first], pair.gap_m - pair.promised_m)
    for pair in pairs:
        if pair.kind == "ugv":
            between = max(between, pair.gap_m - pair.promised_m - (more[pair.first] + more[pair.second]))
    between += scenario.unsure_s * max(ugv.max_speed_m_s for ugv in scenario.ugvs.values())  # see `Neighbours.share`
    radius = np.array([ugv.radius_m + more[name] for name, ugv in scenario.ugvs.items()])
    return radius, scenario.safe_distance.ugv_m + between


def make_map(scenario: Scenario, uav: Uav) -> tuple[Array, Array, Array]:
    """A UAV's map: obstacles at rest that it knows, and phantoms, which exist on the map only and have no radius."""
    # Returns outlines, (m, W), see `model.geometry.outline`, and when each appears and disappears, (m,), s.
    known = [barrier for barrier in scenario.barriers.values() if barrier.known_to_uav and not barrier.moves]
    parts = [outlines_of(scenario, obstacle) for obstacle in known]
    phantoms = outline.balls(uav.phantoms_m, gap=scenario.safe_distance.obstacle_m)
    count = [*map(len, parts), len(phantoms)]
    appears = np.repeat([*(barrier.appears_s for barrier in known), 0.0], count)
    disappears = np.repeat([*(barrier.disappears_s or np.inf for barrier in known), np.inf], count)
    return outline.joined(*parts, phantoms), appears, disappears


def make_movers(scenario: Scenario) -> tuple[Mover, ...]:
    period, until = scenario.control.period_s, scenario.duration_s
    return tuple(
        Mover(
            name, outlines_of(scenario, barrier), barrier.known_to_uav,
            course(barrier.moves, period, until) if barrier.known_motion else None,
        )
        for name, barrier in scenario.barriers.items()
        if barrier.moves
    )  # fmt: skip


def make_route(scenario: Scenario) -> Route:
    gate = scenario.gatekeeper
    chosen: dict[str, Any] = {"blocks": gate.blocks} if gate.blocks else {}
    if gate.solver != "daqp":
        if why := lacking(gate.solver):
            allowed = ", ".join(name for name in SOLVERS if not lacking(name))
            raise ScenarioError(scenario.name, "gatekeeper.solver", gate.solver, f"{why}; allowed here: {allowed}")
        chosen["solver"] = gate.solver
    return ROUTES.make(gate.route, of=Route, **chosen)


def make_presets(scenario: Scenario) -> list[Motion]:
    return [Motion.at_speed(positions(ugv.preset.waypoints_m), ugv.preset.speed_m_s) for ugv in scenario.ugvs.values()]


def make_horizon(scenario: Scenario) -> Horizon:
    gate = scenario.gatekeeper
    substeps = round(gate.horizon_s / gate.stages / scenario.control.period_s)
    weights = gate.error_weight_1_m2_s, gate.slack_weight_1_m2_s, gate.terminal_weight_s
    return Horizon(gate.stages, substeps, *weights)


def make_rules(scenario: Scenario) -> Rules:
    """How the gatekeeper's decisions become answers, and the budget of a decision."""
    gate = scenario.gatekeeper
    return Rules(
        switching_margin=gate.switching_margin,
        min_dwell=gate.min_dwell_s,
        first_stage=gate.rule == "first_stage",
        budget=Budget(gate.budget_iterations),
        allowance_s=gate.budget_share * gate.period_s if gate.budget == "wall_clock" else None,
    )


def make_outlook(scenario: Scenario) -> Outlook:
    gate = scenario.gatekeeper
    return Outlook(gate.longest_s, gate.settling_s, gate.horizon_s, scenario.arrival_tolerance_m)


def make_patience(scenario: Scenario) -> Patience:
    gate = scenario.gatekeeper
    return Patience(gate.tries, gate.rest_s, gate.longest_s)


# Makes the gatekeepers from a scenario and the law of its UGVs.
GatekeepersFactory = Callable[[Scenario, UgvLaw], Gatekeepers]


def make_gatekeepers(scenario: Scenario, law: UgvLaw) -> Gatekeepers:
    """Gatekeepers by problem (26) where interventions have priority over avoidance, else by outcomes."""
    world, presets = make_world(scenario), make_presets(scenario)
    seen = frozenset(mover.name for mover in make_movers(scenario) if mover.known)
    if law.intervention_on_top:
        rules = make_horizon(scenario), make_rules(scenario)
        return PaperGatekeepers(world, law, presets, make_route(scenario), *rules, seen)
    return OutcomeGatekeepers(world, law, presets, make_outlook(scenario), make_patience(scenario), seen)


def make_trigger(scenario: Scenario) -> Trigger:
    return Trigger(*scenario.decision.levels(threshold(**asdict(scenario.decision.threshold))))


def positions(rows: Sequence[Sequence[float]]) -> Array:
    """Points as an array, (n, 3), m; n may be 0."""
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def stack_presets(presets: list[Motion]) -> tuple[Array, Array]:
    """Times (K,), s, of the vertices of all presets together, and where all presets are then, (K, 3n), m."""
    # Vertices that only rounding keeps apart are merged: a velocity over so short a time would be a rounding error.
    times = np.unique(np.concatenate([preset.times for preset in presets]))
    kept = np.append(np.diff(times) > SAME_TIME * np.maximum(1.0, times[1:]), True)
    kept[0] = True
    times = times[kept]
    return times, np.concatenate([preset.sample(times) for preset in presets], axis=1)


def make_noise(count: int, given: Decision) -> tuple[RandomSource, AffineSystem]:
    """Source of the noise of `count` decision variables, and its integrator; to be connected."""
    source = RandomSource(RandomDistribution.kGaussian, count, given.noise_period_s)
    return source, integrated_noise(count, given.noise_m_sqrt_s, given.leak_1_s, given.noise_period_s)


def integrated_noise(count: int, intensity: float, leak: float, period: float) -> AffineSystem:
    """dn = -leak n dt + intensity dW for noise samples held over `period`: Euler-Maruyama on that grid."""
    eye, zero = np.eye(count), np.zeros(count)
    return AffineSystem(
        A=-leak * eye, B=intensity / np.sqrt(period) * eye, f0=zero, C=eye, D=0.0 * eye, y0=zero, time_period=0.0
    )
