"""The constants that a claim about the model must be about: those of the scenario."""

from __future__ import annotations

from .files import Json
from .scenario import apart_m, disturbance_m_s, extent_m, levels_of, robots_of, threshold_m


def inputs_of(claim: str, scenario: Json) -> Json:
    """The inputs of a claim about the model."""
    match claim:
        case "SAFE-INV":
            return {**_avoidance(scenario), "scenario": _built_from(scenario)}
        case "SAFE-GATE":
            return {**_avoidance(scenario), "method_d": _method_d(scenario), "scenario": _built_from(scenario)}
        case "SAFE-DIST":
            return {**_avoidance(scenario), "disturbance_m_s": disturbance_m_s(scenario)}
        case "ZENO-PROOF":
            bound = float(scenario["decision"]["min_inter_event_s"])
            return {**_trigger(scenario), "min_inter_event_s": bound, "duration_s": float(scenario["duration_s"])}
        case "LIVE-GATE":
            return {**_patience(scenario), **_tracking(scenario)}
        case "LIVE-WAIT":
            return _patience(scenario)
        case "THR-ISO":
            return _trigger(scenario)
        case "ZENO-REFINE":
            noise = {key: scenario["decision"][key] for key in ("noise_m_sqrt_s", "leak_1_s", "noise_period_s")}
            return {**_trigger(scenario), **noise, "duration_s": float(scenario["duration_s"])}
        case "THR-ROOT" | "THR-OPT":
            rule = scenario["decision"]["threshold"]["rule"]
            return {**_threshold(scenario), "rule": rule, "zeta_m": threshold_m(scenario)}
        case "THR-DDM":
            return _threshold(scenario)
    return {}


def _patience(scenario: Json) -> Json:
    names = ("tries", "rest_s", "longest_s", "lag_m", "behind_s", "period_s")
    return {name: scenario["gatekeeper"][name] for name in names}


def _tracking(scenario: Json) -> Json:
    control = scenario["control"]
    names = ("intervention_gain_1_s", "motion_gain_1_s", "avoidance_gain_1_s", "sensing_range_m")
    return {
        **{name: control[name] for name in names},
        "control_period_s": control["period_s"],
        "max_speed_m_s": max(float(ugv["max_speed_m_s"]) for ugv in scenario["ugvs"].values()),
        "obstacle_m": _widest_m(scenario),
    }


def _widest_m(scenario: Json) -> float:
    """The largest distance that a UGV has to keep from an obstacle."""
    of_ugvs = max(float(ugv["radius_m"]) for ugv in scenario["ugvs"].values())
    of_obstacles = max((float(obstacle["radius_m"]) for obstacle in scenario["obstacles"].values()), default=0.0)
    return apart_m(scenario, "obstacle_m", {"radius_m": of_ugvs}, {"radius_m": of_obstacles})


def _avoidance(scenario: Json) -> Json:
    """Constants of the avoidance layer and of the team; the extent bounds every coordinate of the run."""
    control, safe, robots = scenario["control"], scenario["safe_distance"], robots_of(scenario)
    names = ("avoidance_gain_1_s", "period_s", "sensing_range_m")
    gains = ("motion_gain_1_s", "formation_gain_1_s", "intervention_gain_1_s")
    speeds = [float(robot["max_speed_m_s"]) for robot in robots.values()]
    return {
        **{name: control[name] for name in names + gains},
        "altitude_m": scenario["uav"]["altitude_m"],
        "duration_s": scenario["duration_s"],
        "extent_m": extent_m(scenario),
        "team": {
            "ugvs": list(scenario["ugvs"]),
            "uav": scenario["uav"]["name"],
            "obstacles": [obstacle["position_m"] for obstacle in scenario["obstacles"].values()],
            "obstacle_distance": safe["obstacle_m"],
            "ugv_distance": safe["ugv_m"],
            "air_ground_distance": safe["air_ground_m"],
            "max_speed": speeds,
            "radius": [float(robot["radius_m"]) for robot in robots.values()],
            "obstacle_radius": [float(obstacle["radius_m"]) for obstacle in scenario["obstacles"].values()],
        },
    }


def _built_from(scenario: Json) -> Json:
    """What the diagram of method (d) that is compared is built from: the scenario, without what others may add.

    Of names, texts, seed, verdicts, policies, runs and routes nothing comes into the controllers.
    """
    return {
        **scenario,
        **_WITHOUT_OTHERS,
        "uav": {**scenario["uav"], "task": "formation"},
        "intervention": {**_INTERVENTION, "period_s": scenario["intervention"]["period_s"]},
        "gatekeeper": {**scenario["gatekeeper"], "route": "relaxed"},
        "runs": {"d": {"method": "d", "composition": "augmented", "stalls_m": {}, "expected": {}}},
    }


_WITHOUT_OTHERS: Json = {
    "name": "built", "seed": 0, "title": "", "description": "",
    "claims": {}, "expected": {}, "reproduction": [], "choices": [],
}  # fmt: skip
"""What is of the scenario's own, and of no controller."""
_INTERVENTION: Json = {"retry_s": 1.0, "ranking": "predicted", "budget_s": 2.0, "policies": []}
"""An intervention where a scenario says nothing of it."""


def _method_d(scenario: Json) -> Json:
    """Method (d) never puts an intervention above the avoidance inequalities."""
    found = {run["composition"] for run in scenario["runs"].values() if run["method"] == "d"}
    return {"intervention_on_top": False, "compositions": sorted(found) or ["augmented"]}


def _trigger(scenario: Json) -> Json:
    levels = levels_of(scenario)
    return {"zeta_m": levels.zeta_m, "released_below_m": levels.release_m, "dwell_s": levels.dwell_s}


def _threshold(scenario: Json) -> Json:
    rule = scenario["decision"]["threshold"]
    return {name: rule[name] for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")}
