"""What the proofs about avoidance are about: the constants of a scenario, and the layer that is to run with them.

Pairs, distances, shares and limits come from the scenario (`scenario_pairs.py`), never from the code that is judged.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from airground_drake.nsbc.avoidance import Avoidance, Composition
from airground_drake.scenarios.load import resolved
from airground_drake.scenarios.schema import Intervention, Run, Scenario
from airground_drake.verify.engines.obligation import rational
from airground_drake.verify.model.avoidance.scenario_pairs import Inputs, Kind, kinds_of, team_of

__all__ = ["Inputs", "Kind", "built_from", "compositions_of", "constants", "kinds", "range_spare", "running_avoidance"]


def constants(scenario: Scenario) -> Inputs:
    """Constants of a scenario that the claims about avoidance are about, strict JSON."""
    control, team = scenario.control, team_of(scenario)
    points = [p for ugv in scenario.ugvs.values() for p in (ugv.start_m, ugv.target_m, *ugv.preset.waypoints_m)]
    points += [scenario.uav.start_m, *(obstacle.position_m for obstacle in scenario.obstacles.values())]
    travelled = max(team["max_speed"]) * scenario.duration_s
    return {
        "avoidance_gain_1_s": control.avoidance_gain_1_s,
        "period_s": control.period_s,
        "sensing_range_m": control.sensing_range_m,
        "motion_gain_1_s": control.motion_gain_1_s,
        "formation_gain_1_s": control.formation_gain_1_s,
        "intervention_gain_1_s": control.intervention_gain_1_s,
        "altitude_m": scenario.uav.altitude_m,
        "duration_s": scenario.duration_s,
        "extent_m": max(abs(c) for point in points for c in point) + travelled,
        "team": team,
    }


def compositions_of(scenario: Scenario) -> list[str]:
    """Compositions of the avoidance tasks that method (d) runs with."""
    return sorted({run.composition for run in scenario.runs.values() if run.method == "d"}) or ["augmented"]


def built_from(scenario: Scenario) -> Inputs:
    """The scenario that the diagram of method (d) is built from, strict JSON: without anything by others.

    Its name and seed are set, as no controller gets either: one proof serves all seeds. Policies, route and the UAV's
    task may be others' code; the proofs trust in none of them, and the comparison of `wiring.py` takes their place at
    the controllers' ports.
    """
    bare = replace(
        scenario,
        name="built",
        seed=0,
        title="",
        description="",
        uav=replace(scenario.uav, task="formation"),
        intervention=Intervention(period_s=scenario.intervention.period_s),
        gatekeeper=replace(scenario.gatekeeper, route="relaxed"),
        runs={"d": Run(method="d")},
        claims={},
        expected={},
        reproduction=[],
        choices=[],
    )
    return resolved(bare)


def kinds(inputs: Inputs) -> list[Kind]:
    """The kinds of pairs in the scenario."""
    return kinds_of(inputs["team"])


def range_spare(inputs: Inputs, kind: Kind) -> Fraction:
    """R - d - c h, m."""
    reach, closing = rational(inputs["sensing_range_m"]), rational(kind.closing)
    return Fraction(reach) - Fraction(rational(kind.safe)) - Fraction(closing) * Fraction(rational(inputs["period_s"]))


def running_avoidance(inputs: Inputs, composition: Composition = "augmented") -> Avoidance:
    """The avoidance layer with the constants of the inputs."""
    return Avoidance(inputs["avoidance_gain_1_s"], inputs["period_s"], inputs["sensing_range_m"], composition)
