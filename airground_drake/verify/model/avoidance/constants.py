"""What the proofs about avoidance are about: the constants of the running team and layer, and its kinds of pairs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from airground_drake.components import make_team
from airground_drake.diagram import build_model
from airground_drake.nsbc.avoidance import Avoidance, Composition
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.engines.obligation import rational

Inputs = dict[str, Any]


def constants(scenario: Scenario) -> Inputs:
    """Constants of the running team and avoidance layer, strict JSON: what the claims about avoidance are about.

    Raises:
        ValueError: if the controllers of the built diagram run with other constants than the scenario's.
    """
    team, control = make_team(scenario), scenario.control
    diagram = build_model(scenario, "d").diagram
    wanted = (control.avoidance_gain_1_s, control.period_s, control.sensing_range_m)
    for name in ("ugv_controller", "uav_controller"):
        layer = diagram.GetSubsystemByName(name).avoidance
        running = (layer.gain, layer.period, layer.sensing_range)
        if running != wanted:
            raise ValueError(f"{name} runs with gain, period, range {running}, the scenario says {wanted}")
    points = [p for ugv in scenario.ugvs.values() for p in (ugv.start_m, ugv.target_m, *ugv.preset.waypoints_m)]
    points += [scenario.uav.start_m, *(obstacle.position_m for obstacle in scenario.obstacles.values())]
    listed = {name: np.asarray(getattr(team, name)).tolist() for name in ("ugvs", "obstacles", "max_speed")}
    travelled = float(team.max_speed.max()) * scenario.duration_s
    return {
        "avoidance_gain_1_s": control.avoidance_gain_1_s,
        "period_s": control.period_s,
        "sensing_range_m": control.sensing_range_m,
        "motion_gain_1_s": control.motion_gain_1_s,
        "intervention_gain_1_s": control.intervention_gain_1_s,
        "duration_s": scenario.duration_s,
        "extent_m": max(abs(c) for point in points for c in point) + travelled,
        "team": asdict(team) | listed,
    }


@dataclass(frozen=True)
class Kind:
    """A kind of pair: safe distance m, largest closing speed m/s, share of the inequality that each robot takes."""

    name: str
    safe: float
    closing: float
    share: float


def kinds(inputs: Inputs) -> list[Kind]:
    """The kinds of pairs in a team, each with its fastest members; shares are those of the running code."""
    team = running_team(inputs)
    ugvs = sorted(team.max_speed[:-1].tolist(), reverse=True)
    share = team.neighbourhood(slice(None)).share[0]
    uav, m = float(team.max_speed[-1]), len(team.obstacles)
    found = [Kind("uav_ugv", team.air_ground_distance, uav + ugvs[0], float(share[m]))]
    if m:
        found.insert(0, Kind("obstacle", team.obstacle_distance, max(uav, ugvs[0]), float(share[0])))
    if len(ugvs) > 1:
        found.append(Kind("ugv_ugv", team.ugv_distance, ugvs[0] + ugvs[1], float(share[m])))
    return found


def range_spare(inputs: Inputs, kind: Kind) -> Fraction:
    """R - d - c h, m."""
    reach, closing = rational(inputs["sensing_range_m"]), rational(kind.closing)
    return Fraction(reach) - Fraction(rational(kind.safe)) - Fraction(closing) * Fraction(rational(inputs["period_s"]))


def running_team(inputs: Inputs, ugvs: int | None = None) -> Team:
    """The team of the inputs, or its first so many UGVs and the UAV."""
    given = inputs["team"]
    count = len(given["ugvs"]) if ugvs is None else min(ugvs, len(given["ugvs"]))
    speed = np.array([*given["max_speed"][:count], given["max_speed"][-1]])
    obstacles = np.array(given["obstacles"], dtype=np.float64).reshape(-1, 3)
    changed = {"ugvs": tuple(given["ugvs"][:count]), "obstacles": obstacles, "max_speed": speed}
    return Team(**(given | changed))


def running_avoidance(inputs: Inputs, composition: Composition = "augmented") -> Avoidance:
    """The avoidance layer with the constants of the inputs."""
    return Avoidance(inputs["avoidance_gain_1_s"], inputs["period_s"], inputs["sensing_range_m"], composition)
