"""Findings about the drift-diffusion model, its threshold and its trigger, (15)-(20) and Table 1; each is computed."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_banded
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import norm

from airground_drake.model.trigger.bayes import bayes_risk, decision_time, error_rate, optimal_threshold
from airground_drake.report import rules
from airground_drake.report.audit.item import Item, item, status
from airground_drake.scenario.schema import Scenario, Threshold
from airground_drake.verify import Finding

DRIFT, NOISE, C1, C2 = 1.0, 1.0, 0.5, 1.0  # a textbook case with the paper's c1 and c2: drift 1 m/s, noise 1 m/sqrt(s)
# What the paper's table says about the threshold. The table gives no drift: we assume the one for which its zeta is
# optimal.
TABLE_1 = Threshold(rule="fixed", zeta_m=3.0, c1_1_s=C1, c2=C2, drift_m_s=6.05, noise_m_sqrt_s=10.0)
ASSUMED = "Table 1, drift assumed"  # names of these numbers in item 18
REPORTED_TRIGGER_S = 14.45  # when the paper's case A triggers


def threshold_findings(scenario: Scenario, proofs: Mapping[str, Finding]) -> list[Item]:
    """Items 2 to 5, 9 and 18; `proofs` maps claims about the model to their findings."""
    return [
        _upside_down(proofs),
        _seconds(proofs),
        _optimal_drift(scenario),
        _intensity(scenario),
        _zeno(proofs),
        _one_threshold(),
    ]


def _upside_down(proofs: Mapping[str, Finding]) -> Item:
    """Item 2: the minimiser of (16), found without any derivative, against both roots of (19)."""
    least = minimize_scalar(lambda z: bayes_risk(z, DRIFT, NOISE, C1, C2), bounds=(1e-6, 5.0), options={"xatol": 1e-12})
    ours, printed = optimal_threshold(DRIFT, NOISE, C1, C2), optimal_threshold(DRIFT, NOISE, C2, C1)
    risk = {name: bayes_risk(z, DRIFT, NOISE, C1, C2) for name, z in (("ours", ours), ("printed", printed))}
    proof = status(proofs, rules.LEAST_RISK)
    shown = abs(least.x - ours) < 1e-6 and risk["printed"] > risk["ours"] and proof == "proved"
    return item(
        2, "(19)",
        "The right-hand side of (19) is inverted: the Bayes risk (16) is least where the left-hand side is c2/c1.",
        {"root_m": printed, "risk": risk["printed"]},
        {"root_m": ours, "risk": risk["ours"]},
        shown,
        {
            "drift_m_s": DRIFT, "noise_m_sqrt_s": NOISE, "c1_1_s": C1, "c2": C2,
            "minimiser_of_16_m": float(least.x), rules.LEAST_RISK: proof,
        },
    )  # fmt: skip


def _seconds(proofs: Mapping[str, Finding]) -> Item:
    """Item 3: (17) as printed with the deviation in metres, against the exact mean exit time."""
    drift, noise, zeta, deviation = 2.0, 1.0, 1.0, 0.1
    exact = _exit_time(-zeta, zeta, drift, noise, deviation)
    ours = decision_time(zeta, drift, noise, deviation)
    printed = decision_time(zeta, drift, noise, deviation * drift)  # the number taken for seconds
    biased = minimize_scalar(
        lambda z: bayes_risk(z, drift, noise, C1, C2, deviation),
        bounds=(deviation + 1e-6, 5.0),
        options={"xatol": 1e-12},
    )
    unbiased = optimal_threshold(drift, noise, C1, C2)
    return item(
        3, "(17)-(19)",
        "(17) and (18) need the initial deviation in seconds (metres over drift); with metres they are wrong. The root "
        "of (19), even with c2/c1, minimises (16) only without initial deviation.",
        {"decision_time_s": printed}, {"decision_time_s": ours},
        abs(ours - exact) < 1e-6 and abs(printed - exact) > 1e-2 and abs(biased.x - unbiased) > 1e-3,
        {
            "drift_m_s": drift, "noise_m_sqrt_s": noise, "zeta_m": zeta, "deviation_m": deviation,
            "exact_mean_exit_time_s": exact, "minimiser_with_deviation_m": float(biased.x), "root_of_19_m": unbiased,
            rules.DECISIONS: status(proofs, rules.DECISIONS),
        },
    )  # fmt: skip


def _exit_time(low: float, high: float, drift: float, noise: float, start: float, cells: int = 20_000) -> float:
    """Mean exit time from (low, high), s: drift T' + noise^2/2 T'' = -1 by finite differences, not by a formula."""
    grid = np.linspace(low, high, cells + 1)
    step = grid[1] - grid[0]
    diffusion, advection = noise**2 / (2.0 * step**2), drift / (2.0 * step)
    bands = np.zeros((3, cells - 1))
    bands[0, 1:], bands[1], bands[2, :-1] = diffusion + advection, -2.0 * diffusion, diffusion - advection
    inner = solve_banded((1, 1), bands, -np.ones(cells - 1))
    return float(np.interp(start, grid, np.concatenate([[0.0], inner, [0.0]])))


def _optimal_drift(scenario: Scenario) -> Item:
    """Item 4: the drifts for which Table 1's zeta is the root of (19), corrected and as printed."""
    rule = TABLE_1
    zeta, noise, c1, c2 = rule.zeta_m, rule.noise_m_sqrt_s, rule.c1_1_s, rule.c2
    drifts, printed = _drifts(zeta, noise, c1, c2), _drifts(zeta, noise, c2, c1)
    gain_times_error = scenario.control.motion_gain_1_s * zeta
    own = scenario.ugvs["ugv1"].preset.speed_m_s
    by_drift = {a: optimal_threshold(a, noise, c1, c2) for a in (own, 1.0, 3.0, rule.drift_m_s, 9.0)}
    return item(
        4, "Table 1, (19)",
        f"zeta = {zeta:g} m is the root of (19) as printed (with sigma = {noise:g}) for drifts of {_listed(printed)} "
        f"m/s only, and the Bayes-optimal threshold (with c2/c1) for {_listed(drifts)} m/s only. In case A the "
        f"reference leaves the stalled UGV at {own:g} m/s, for which {by_drift[own]:.2f} m would be optimal. The paper "
        f"gives no drift. One of the four, {drifts[0]:.3f} m/s, is close to the motion gain times the task error at "
        f"the threshold, {gain_times_error:g} m/s.",
        {"zeta_m": zeta, "drift_m_s": printed}, {"drift_m_s": drifts},
        len(drifts) == len(printed) == 2
        and all(abs(optimal_threshold(a, noise, c1, c2) - zeta) < 1e-9 for a in drifts)
        and all(abs(optimal_threshold(a, noise, c2, c1) - zeta) < 1e-9 for a in printed)
        and min(drifts) > 2.0 * own,
        {
            "c1_1_s": c1, "c2": c2, "noise_m_sqrt_s": noise, "motion_gain_times_error_m_s": gain_times_error,
            "case_a_drift_m_s": own, "optimal_zeta_at_case_a_drift_m": by_drift[own],
            "optimal_zeta_by_drift_m": {f"{a:g} m/s": best for a, best in by_drift.items()},
        },
    )  # fmt: skip


def _drifts(zeta: float, noise: float, c1: float, c2: float) -> list[float]:
    """Drifts, m/s, for which `zeta`, m, is optimal; the optimum first rises with the drift, then falls."""
    grid = np.geomspace(0.01, 1e4, 2000)
    excess = np.array([optimal_threshold(drift, noise, c1, c2) - zeta for drift in grid])
    return [
        brentq(lambda a: optimal_threshold(a, noise, c1, c2) - zeta, grid[k], grid[k + 1], xtol=1e-12)
        for k in np.flatnonzero(np.diff(np.sign(excess)))
    ]


def _listed(drifts: list[float]) -> str:
    return " and ".join(f"{drift:.3f}" for drift in drifts)


def _intensity(scenario: Scenario) -> Item:
    """Item 5: with sigma_j = 10 as the intensity of (15) the threshold is reached at once."""
    rule = TABLE_1
    zeta, noise = rule.zeta_m, rule.noise_m_sqrt_s
    both, exact = (zeta / noise) ** 2, _exit_time(-zeta, zeta, 0.0, noise, 0.0)
    half = (zeta / (noise * float(norm.ppf(0.75)))) ** 2  # P[passed by t] = 2 (1 - Phi(zeta / (noise sqrt t)))
    before = 2.0 * float(norm.sf(zeta / (noise * math.sqrt(REPORTED_TRIGGER_S))))
    return item(
        5, "Table 1, (15)",
        f"sigma_j = {noise:g} cannot be the noise intensity of (15). Noise alone would reach +{zeta:g} m, the "
        f"threshold of the trigger (20), within {1e3 * half:.0f} ms in half of all runs, and before the reported "
        f"{REPORTED_TRIGGER_S:g} s in {100.0 * before:.0f} % (the mean time is infinite). With the two thresholds of "
        f"(17)-(18), the mean time would be {1e3 * both:.0f} ms.",
        {"trigger_s": REPORTED_TRIGGER_S}, {"median_first_passage_s": half, "mean_of_two_thresholds_s": both},
        abs(both - exact) < 1e-6 and both < half < 0.02 * REPORTED_TRIGGER_S and before > 0.9,
        {
            "zeta_m": zeta, "noise_m_sqrt_s": noise, "by_finite_differences_s": exact,
            "passed_before_the_reported_trigger_percent": 100.0 * before,
            "scenario_intensity_m_sqrt_s": scenario.decision.noise_m_sqrt_s,
        },
        unit="s",
    )  # fmt: skip


def _zeno(proofs: Mapping[str, Finding]) -> Item:
    """Item 9: the bare threshold's triggers under refinement of the noise, and the bound of ours."""
    refined = proofs[rules.REFINEMENT].to_json()["evidence"] if rules.REFINEMENT in proofs else {}
    statuses = {name: status(proofs, name) for name in (rules.REFINEMENT, rules.DWELL)}
    shown = statuses == {rules.REFINEMENT: "supported", rules.DWELL: "proved"}
    return item(
        9, "(15), (20), section 6",
        "The paper leaves Zeno behaviour open. If the error is at the threshold, a bare threshold on (15) triggers "
        "without bound: the number of triggers grows like one over the square root of the noise step. Hysteresis and "
        "a minimum inter-event time exclude that, whatever the noise.",
        {"triggers": refined["bare"]["mean"] if shown else None},
        {"triggers": refined["automaton"]["mean"] if shown else None},
        shown,
        {**statuses, "noise_step_s": refined.get("dt_s"), "exponents": refined.get("fit")},
    )  # fmt: skip


def _one_threshold() -> Item:
    """Item 18: (17)-(18) are about two thresholds, (20) about one."""
    rule, table = TABLE_1, {}
    for name, drift, noise, zeta in (
        ("textbook", DRIFT, NOISE, optimal_threshold(DRIFT, NOISE, C1, C2)),
        (ASSUMED, rule.drift_m_s, rule.noise_m_sqrt_s, rule.zeta_m),
    ):
        far = -30.0 * noise**2 / drift  # is passed first with probability exp(-60)
        table[name] = {
            "drift_m_s": drift, "noise_m_sqrt_s": noise, "zeta_m": zeta,
            "error_rate_18": error_rate(zeta, drift, noise),
            "time_of_two_thresholds_s": _exit_time(-zeta, zeta, drift, noise, 0.0),
            "time_17_s": decision_time(zeta, drift, noise),
            "time_of_one_threshold_s": _exit_time(far, zeta, drift, noise, 0.0, 400_000),
            "zeta_over_drift_s": zeta / drift,
        }  # fmt: skip
    shown = all(
        math.isclose(row["time_of_two_thresholds_s"], row["time_17_s"], rel_tol=1e-4)
        and math.isclose(row["time_of_one_threshold_s"], row["zeta_over_drift_s"], rel_tol=1e-4)
        and row["time_17_s"] < 0.75 * row["zeta_over_drift_s"]
        for row in table.values()
    )
    ours = table[ASSUMED]
    return item(
        18, "(16)-(20)",
        "(17) and (18) are the decision time and error rate of two thresholds, +zeta and -zeta; the trigger (20) has "
        "only +zeta. While the drift is positive, such a trigger never decides wrongly; it takes zeta over drift on "
        "average. Without errors, (16) is least at zeta = 0. Besides, (20) compares a difference of positions with a "
        "number; its norm, which the trigger needs, cannot reach -zeta. "
        f"The numbers are those of Table 1. The drift of {rule.drift_m_s:g} m/s is assumed, because the table "
        f"does not give it.",
        {"time_s": ours["time_17_s"], "error_rate": ours["error_rate_18"]},
        {"time_s": ours["time_of_one_threshold_s"], "error_rate": 0.0},
        shown, table,
    )  # fmt: skip
