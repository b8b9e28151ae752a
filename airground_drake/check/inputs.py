"""The constants that a claim about the model must be about: those of the scenario."""

from __future__ import annotations

from .files import Json
from .scenario import disturbance_m_s, kinds_of, levels_of, threshold_m


def inputs_of(claim: str, scenario: Json) -> Json:
    """The inputs of a claim about the model."""
    match claim:
        case "SAFE-LEMMA":
            return {"pairs": _avoidance(scenario)["pairs"]}
        case "SAFE-INV":
            return _avoidance(scenario)
        case "SAFE-GATE":
            return {**_avoidance(scenario), "intervention_on_top": False}
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
            noise, control = scenario["decision"]["noise_period_s"], scenario["control"]["period_s"]
            return {**_trigger(scenario), "noise_period_s": noise, "period_s": control}
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
    return {"intervention_gain_1_s": control["intervention_gain_1_s"], "control_period_s": control["period_s"]}


def _avoidance(scenario: Json) -> Json:
    """Constants of the avoidance layer, and the pairs that it keeps apart."""
    control = scenario["control"]
    pairs = [
        {"kind": kind.name.rstrip("0123456789").rstrip("_"), "safe_m": kind.safe_m, "closing_m_s": kind.closing_m_s}
        for kind in kinds_of(scenario)
    ]
    names = ("avoidance_gain_1_s", "period_s", "sensing_range_m")
    return {**{name: control[name] for name in names}, "pairs": pairs}


def _trigger(scenario: Json) -> Json:
    levels = levels_of(scenario)
    return {"zeta_m": levels.zeta_m, "released_below_m": levels.release_m, "dwell_s": levels.dwell_s}


def _threshold(scenario: Json) -> Json:
    rule = scenario["decision"]["threshold"]
    return {name: rule[name] for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")}
