"""Findings that follow from the paper's formulas and numbers alone; each is computed, none is quoted."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import sympy
from scipy.optimize import brentq, minimize_scalar

from airground_drake.decision.bayes import bayes_risk, decision_time, optimal_threshold
from airground_drake.nsbc.task import Array
from airground_drake.nsbc.tasks import DistanceTask
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Finding

Item = dict[str, Any]

DRIFT, NOISE, C1, C2 = 1.0, 1.0, 0.5, 1.0
"""A textbook case with the paper's c1 and c2: drift 1 m/s, noise 1 m/sqrt(s)."""


def formula_findings(scenario: Scenario, proofs: Mapping[str, Finding]) -> list[Item]:
    """Items 2 to 5, 8, 9 and 12 on; `proofs` maps claims about the model to their findings."""
    parts: tuple[Callable[[], Item], ...] = (
        lambda: _upside_down(proofs),
        lambda: _seconds(proofs),
        lambda: _optimal_drift(scenario),
        lambda: _intensity(scenario),
        _task_and_configuration,
        lambda: _zeno(proofs),
        _feed_forward,
        _centroid,
        _grid_points,
        _rule_three,
        _null_space,
        lambda: _one_speed(scenario),
    )
    return [part() for part in parts]


def _item(
    number: int, where: str, finding: str, paper: Any, ours: Any, shown: bool, evidence: Item, unit: str = ""
) -> Item:
    return {
        "id": number,
        "where": where,
        "finding": finding,
        "paper": paper,
        "ours": ours,
        "unit": unit,
        "demonstrated": bool(shown),
        "evidence": evidence,
    }


def _status(proofs: Mapping[str, Finding], claim: str) -> str:
    return proofs[claim].status if claim in proofs else "not_run"


def _upside_down(proofs: Mapping[str, Finding]) -> Item:
    """Item 2: the minimiser of (16), found without any derivative, against both roots of (19)."""
    found = minimize_scalar(lambda z: bayes_risk(z, DRIFT, NOISE, C1, C2), bounds=(1e-6, 5.0), options={"xatol": 1e-12})
    ours, printed = optimal_threshold(DRIFT, NOISE, C1, C2), optimal_threshold(DRIFT, NOISE, C2, C1)
    risk = {name: bayes_risk(z, DRIFT, NOISE, C1, C2) for name, z in (("ours", ours), ("printed", printed))}
    shown = abs(found.x - ours) < 1e-6 and risk["printed"] > risk["ours"] and _status(proofs, "THR-OPT") == "proved"
    return _item(
        2, "(19)",
        "The right-hand side of (19) is upside down: the Bayes risk (16) is least where the left-hand side is c2/c1.",
        {"equation": "... = c1/c2", "root_m": printed, "risk": risk["printed"]},
        {"equation": "... = c2/c1", "root_m": ours, "risk": risk["ours"]},
        shown,
        {
            "drift_m_s": DRIFT, "noise_m_sqrt_s": NOISE, "c1_1_s": C1, "c2": C2,
            "minimiser_of_16_m": float(found.x), "THR-OPT": _status(proofs, "THR-OPT"),
        },
    )  # fmt: skip


def _seconds(proofs: Mapping[str, Finding]) -> Item:
    """Item 3: (17) as printed with the deviation in metres, against the exact mean exit time."""
    drift, noise, zeta, deviation = 2.0, 1.0, 1.0, 0.1
    exact = _exit_time(zeta, drift, noise, deviation)
    ours = decision_time(zeta, drift, noise, deviation)
    printed = decision_time(zeta, drift, noise, deviation * drift)  # the number taken for seconds
    biased = minimize_scalar(
        lambda z: bayes_risk(z, drift, noise, C1, C2, deviation),
        bounds=(deviation + 1e-6, 5.0),
        options={"xatol": 1e-12},
    )
    unbiased = optimal_threshold(drift, noise, C1, C2)
    return _item(
        3, "(17)-(19)",
        "(17) and (18) take the initial deviation in seconds (metres over drift); in metres they are wrong. (19), with "
        "c2/c1 too, is stationary for (16) only without initial deviation.",
        {"decision_time_s": printed}, {"decision_time_s": ours},
        abs(ours - exact) < 1e-6 and abs(printed - exact) > 1e-2 and abs(biased.x - unbiased) > 1e-3,
        {
            "drift_m_s": drift, "noise_m_sqrt_s": noise, "zeta_m": zeta, "deviation_m": deviation,
            "exact_mean_exit_time_s": exact, "minimiser_with_deviation_m": float(biased.x), "root_of_19_m": unbiased,
            "THR-DDM": _status(proofs, "THR-DDM"),
        },
    )  # fmt: skip


def _exit_time(zeta: float, drift: float, noise: float, start: float, cells: int = 20_000) -> float:
    """Mean exit time from (-zeta, zeta), s: drift T' + noise^2/2 T'' = -1 by finite differences, not by a formula."""
    from scipy.linalg import solve_banded

    grid = np.linspace(-zeta, zeta, cells + 1)
    step = grid[1] - grid[0]
    diffusion, advection = noise**2 / (2.0 * step**2), drift / (2.0 * step)
    bands = np.zeros((3, cells - 1))
    bands[0, 1:], bands[1], bands[2, :-1] = diffusion + advection, -2.0 * diffusion, diffusion - advection
    inner = solve_banded((1, 1), bands, -np.ones(cells - 1))
    return float(np.interp(start, grid, np.concatenate([[0.0], inner, [0.0]])))


def _optimal_drift(scenario: Scenario) -> Item:
    """Item 4: the drifts for which Table 1's zeta is the Bayes-optimal one; the optimum first rises, then falls."""
    rule = scenario.decision.threshold
    zeta, noise, c1, c2 = rule.zeta_m, rule.noise_m_sqrt_s, rule.c1_1_s, rule.c2
    grid = np.geomspace(0.01, 1e4, 2000)
    excess = np.array([optimal_threshold(drift, noise, c1, c2) - zeta for drift in grid])
    drifts = [
        brentq(lambda a: optimal_threshold(a, noise, c1, c2) - zeta, grid[k], grid[k + 1], xtol=1e-12)
        for k in np.flatnonzero(np.diff(np.sign(excess)))
    ]
    fastest = max(ugv.max_speed_m_s for ugv in scenario.ugvs.values())
    gain_times_error = scenario.control.motion_gain_1_s * zeta
    return _item(
        4, "Table 1",
        f"zeta = {zeta:g} m is Bayes-optimal (with c2/c1 and sigma = {noise:g}) for drifts of "
        f"{' and '.join(f'{drift:.3f}' for drift in drifts)} m/s only. The first is about the motion gain times the "
        f"task error at the threshold, {gain_times_error:g} m/s; in case A the reference leaves the stalled UGV at "
        f"{scenario.ugvs['ugv1'].preset.speed_m_s:g} m/s.",
        {"zeta_m": zeta}, {"drift_m_s": drifts},
        bool(drifts) and all(abs(optimal_threshold(a, noise, c1, c2) - zeta) < 1e-9 for a in drifts),
        {
            "c1_1_s": c1, "c2": c2, "noise_m_sqrt_s": noise, "motion_gain_times_error_m_s": gain_times_error,
            "fastest_ugv_m_s": fastest,
            "optimal_zeta_by_drift_m": {
                f"{a:g} m/s": optimal_threshold(a, noise, c1, c2) for a in (0.5606, 1.0, 3.0, 6.05, 9.0)
            },
        },
    )  # fmt: skip


def _intensity(scenario: Scenario) -> Item:
    """Item 5: with sigma_j = 10 as the intensity of (15) the threshold is reached at once."""
    rule = scenario.decision.threshold
    driftless = (rule.zeta_m / rule.noise_m_sqrt_s) ** 2
    exact = _exit_time(rule.zeta_m, 0.0, rule.noise_m_sqrt_s, 0.0)
    return _item(
        5, "Table 1, (15)",
        f"sigma_j = {rule.noise_m_sqrt_s:g} cannot be the noise intensity of (15): noise alone would reach "
        f"{rule.zeta_m:g} m in {1e3 * driftless:.0f} ms on average, and the paper triggers at 14.45 s.",
        {"trigger_s": 14.45}, {"mean_first_passage_s": driftless},
        abs(driftless - exact) < 1e-6 and driftless < 0.01 * 14.45,
        {
            "zeta_m": rule.zeta_m, "noise_m_sqrt_s": rule.noise_m_sqrt_s, "by_finite_differences_s": exact,
            "scenario_intensity_m_sqrt_s": scenario.decision.noise_m_sqrt_s,
        },
        unit="s",
    )  # fmt: skip


def _task_and_configuration() -> Item:
    """Item 8: (3) applies J^+ to the rate of the configuration, whose size does not fit."""
    jacobian = _avoidance_jacobian()
    pseudo_inverse = np.linalg.pinv(jacobian)
    rate = np.ones(jacobian.shape[1])
    try:
        np.matmul(pseudo_inverse, rate)
        fits = True
    except ValueError:
        fits = False
    return _item(
        8, "(3), (27c), caption of Figure 10",
        "(3) and (4) write rho (the configuration) where sigma (the task) is meant: for the avoidance task J^+ is 3 x "
        "1 and rho has 3 components. Besides, (27c) still says {0, 1} where the text relaxes to [0, 1] (as printed the "
        "rounding (28)-(29) would have nothing to round: see item 11), and the caption of Figure 10 names methods (b) "
        "and (c) the wrong way round: the text of 5.2 has the refusal under (c).",
        "v = J^+ d(rho_d)/dt", "v = J^+ d(sigma_d)/dt",
        not fits and pseudo_inverse.shape == (3, 1),
        {
            "shape_of_J^+": list(pseudo_inverse.shape), "shape_of_rate_of_rho": list(rate.shape),
            "product_defined": fits, "(27c) and the caption of Figure 10": "by reading",
        },
    )  # fmt: skip


def _avoidance_jacobian() -> Array:
    """Jacobian (1, 3) of the avoidance task (7) at some position."""
    return DistanceTask(np.zeros(3), 2.0, 3.0).jacobian(np.array([[1.0, 2.0, 0.0]]))[0]


def _zeno(proofs: Mapping[str, Finding]) -> Item:
    """Item 9: the bare threshold's triggers under refinement of the noise, and the bound of ours."""
    refined = proofs["ZENO-REFINE"].evidence if "ZENO-REFINE" in proofs else {}
    status = {name: _status(proofs, name) for name in ("ZENO-REFINE", "ZENO-PROOF")}
    shown = status == {"ZENO-REFINE": "supported", "ZENO-PROOF": "proved"}
    return _item(
        9, "(15), (20), section 6",
        "Zeno behaviour, the paper's open question: with the error at the threshold, a bare threshold on (15) triggers "
        "like one over the square root of the noise step, without bound. Hysteresis and a minimum inter-event time "
        "exclude that, whatever the noise.",
        {"triggers": refined["bare"]["mean"] if shown else None},
        {"triggers": refined["automaton"]["mean"] if shown else None},
        shown,
        {**status, "noise_step_s": refined.get("dt_s"), "exponents": refined.get("fit")},
    )  # fmt: skip


def _feed_forward() -> Item:
    """Item 12: (6) feeds the task's own rate forward, not the desired one."""
    v, gain, error = sympy.symbols("v B sigma_error", real=True)
    solutions = sympy.solve(sympy.Eq(v, v + gain * error), error)  # J = I: the task's rate is v itself
    return _item(
        12, "(6)",
        "(6) feeds forward the rate of the task itself, sigma_m, instead of the desired sigma_md. With J = I it reads "
        "v = v + B error, which no velocity satisfies unless the error is 0.",
        "v = J^+ (d(sigma_m)/dt + B error)", "v = J^+ (d(sigma_md)/dt + B error)",
        solutions == [0],
        {"solutions_for_the_error": [str(solution) for solution in solutions]},
    )  # fmt: skip


def _centroid() -> Item:
    """Item 13: the task value (9) does not depend on the UAV."""
    uav, one, two = sympy.symbols("uav_x ugv1_x ugv2_x", real=True)
    printed = sympy.diff((one + two) / 2, uav)
    ours = sympy.diff(uav - (one + two) / 2, uav)
    return _item(
        13, "(9)-(10)",
        "The task value (9) is the centroid of the UGVs, which does not depend on the UAV's position: its Jacobian is "
        "0, and so is the velocity (10). The UAV would never move.",
        {"task": "centroid of the UGVs", "jacobian": int(printed)},
        {"task": "own position minus the centroid", "jacobian": int(ours)},
        printed == 0 and ours == 1,
        {"pseudo_inverse_of_0": float(np.linalg.pinv(np.zeros((1, 1)))[0, 0])},
    )  # fmt: skip


def _grid_points() -> Item:
    """Item 14: (27a) sums N + 1 points and forgets the stage's length."""
    horizon, stages = 3.0, 60
    printed = sum(1.0 for _ in range(stages + 1))
    ours = sum(horizon / stages for _ in range(stages))
    return _item(
        14, "(27a)",
        "(27a) discretises the integral (25) over N intervals by a sum over k = 0..N, N + 1 terms, without the "
        "interval's length: for the integrand 1 it gives 61 where the integral is 3 s.",
        printed, ours, not math.isclose(printed, horizon) and math.isclose(ours, horizon),
        {"integrand": 1.0, "horizon_s": horizon, "stages": stages, "integral_s": horizon},
    )  # fmt: skip


def _rule_three() -> Item:
    """Item 15: rule (3) of section 3.1.3 says the opposite of its own reason."""
    n, others, lowest = 3, 2, 2  # dimensions: velocity, all tasks but the lowest, the lowest
    return _item(
        15, "section 3.1.3, rule (3)",
        "Rule (3) lets the lowest task's dimension exceed what the higher ones leave, 'so that n is ensured to be "
        "greater than the total dimension': it then is smaller. And the introduction to section 3 says that an "
        "intervention is triggered when the threshold is *not* reached, against (20).",
        "m_r > n - sum of the others, so that n > the total", "m_r > n - sum of the others means n < the total",
        lowest > n - others and not n > others + lowest,
        {"n": n, "higher_tasks": others, "lowest_task": lowest, "total": others + lowest, "rest": "by reading"},
    )  # fmt: skip


def _null_space() -> Item:
    """Item 16: under a position intervention nothing of the UGV's own task is left."""
    jacobian = np.eye(3)
    left = np.eye(3) - np.linalg.pinv(jacobian) @ jacobian
    one_axis = np.array([[0.0, 1.0, 0.0]])
    partly = np.eye(3) - np.linalg.pinv(one_axis) @ one_axis
    return _item(
        16, "(20), (23)",
        "Where the intervention is a position, J_int = I, (20) executes nothing of the UGV's own task, avoidance "
        "included, although the text says that it is partly executed. That is why UGV1 crashes in case B, method (b).",
        {"rank_of_the_null_space": int(np.linalg.matrix_rank(left))},
        {"rank_for_an_intervention_in_one_direction": int(np.linalg.matrix_rank(partly))},
        not left.any() and bool(partly.any()),
        {"projector": left.tolist()},
    )  # fmt: skip


def _one_speed(scenario: Scenario) -> Item:
    """Item 17: the times of cases A and B need two speeds of the same preset trajectory."""
    speed = {name: load(name)[0].ugvs["ugv1"].preset.speed_m_s for name in ("case_a", "case_b")}
    travelled = {name: speed[name] * time for name, time in (("case_a", 14.45), ("case_b", 10.6))}
    crossed = {"case_a": travelled["case_a"] / speed["case_b"], "case_b": travelled["case_b"] / speed["case_a"]}
    return _item(
        17, "Table 1, section 5",
        f"One Table 1 serves both cases, but triggers at 14.45 s and at 10.6 s need reference speeds of "
        f"{speed['case_a']:g} and {speed['case_b']:g} m/s: with the other case's speed case A would trigger about "
        f"{crossed['case_a']:.1f} s, case B about {crossed['case_b']:.1f} s.",
        {"trigger_s": {"case_a": 14.45, "case_b": 10.6}, "speed_m_s": 1.0}, {"speed_m_s": speed},
        abs(travelled["case_a"] - travelled["case_b"]) < 0.1 and abs(speed["case_a"] - speed["case_b"]) > 0.1,
        {"reference_travelled_at_the_trigger_m": travelled, "trigger_with_the_other_speed_s": crossed},
    )  # fmt: skip
