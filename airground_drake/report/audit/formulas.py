"""Findings about the tasks, their composition and the optimal control problem, from the paper's formulas alone."""

import math
from itertools import product
from math import dist

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry import outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.report.audit.item import Item, item
from airground_drake.report.audit.runs import PRINTED_SPEED_M_S, leaves_ball
from airground_drake.report.audit.thresholds import TABLE_1
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario


def formula_findings(scenario: Scenario) -> list[Item]:
    """Items 8, 12 to 17 and 19 to 22."""
    return [
        _task_and_configuration(),
        _feed_forward(scenario),
        _centroid(scenario),
        _grid_points(),
        _rule_three(),
        _null_space(),
        _one_speed(scenario),
        _intervention_rate(scenario),
        _stall(scenario),
        _uav_target(scenario),
        _indices(),
    ]


def _task_and_configuration() -> Item:
    """Item 8: (3) applies J^+ to the rate of the configuration, whose size does not fit."""
    near = Neighbours.at_rest(outline.balls(np.zeros((1, 3)), gap=2.0), np.ones(1))
    jacobian = Avoidance(3.0, 0.05).half_spaces(np.array([[1.0, 2.0, 0.0]]), near).normal[0]  # of (7), (1, 3)
    inverse = np.linalg.pinv(jacobian)
    fits = inverse.shape[1] == jacobian.shape[1]  # the rate of rho has a component for each column of J
    return item(
        8, "(3), (27c), caption of Figure 10",
        "(3) and (4) write rho (the configuration) where sigma (the task) is meant. For the avoidance task J^+ is 3 x "
        "1 and rho has 3 components, so the product is not defined. (27c) says {0, 1} where the text relaxes to "
        "[0, 1]; as printed, the rounding (28)-(29) has nothing to round. The caption of Figure 10 swaps methods (b) "
        "and (c): in the text of 5.2 the UGV refuses under (c).",
        "v = J^+ d(rho_d)/dt", "v = J^+ d(sigma_d)/dt",
        not fits and inverse.shape == (3, 1),
        {
            "J^+": inverse.tolist(), "shape_of_J^+": list(inverse.shape),
            "shape_of_rate_of_rho": [jacobian.shape[1]], "shape_of_rate_of_sigma": [jacobian.shape[0]],
            "product_defined": fits, "(27c) and the caption of Figure 10": "by reading",
        },
    )  # fmt: skip


def _feed_forward(scenario: Scenario) -> Item:
    """Item 12: (6) feeds the task's own rate forward, not the desired one."""
    gain, error = scenario.control.motion_gain_1_s, 1.0
    rate = scenario.ugvs["ugv1"].preset.speed_m_s
    # J = I: the task's rate is v itself. As printed v = v + B error, or 0 v = B error; corrected v = rate + B error
    velocities = {"as_printed": _solutions(0.0, gain * error), "corrected": _solutions(1.0, rate + gain * error)}
    solutions = _solutions(gain, 0.0)
    return item(
        12, "(6)",
        "(6) feeds forward the rate of the task itself, sigma_m, instead of the desired sigma_md. With J = I it reads "
        "v = v + B error. No velocity satisfies that unless the error is 0.",
        "v = J^+ (d(sigma_m)/dt + B error)", "v = J^+ (d(sigma_md)/dt + B error)",
        solutions == [0.0] and [len(values) for values in velocities.values()] == [0, 1],
        {
            "solutions_for_the_error": [f"{solution:g}" for solution in solutions], "error_m": error,
            "gain_1_s": gain, "desired_rate_m_s": rate, "velocities_m_s": velocities,
        },
    )  # fmt: skip


def _solutions(slope: float, right: float) -> list[float]:
    """The solutions x of slope * x = right; [] if the slope is 0."""
    return [right / slope] if slope else []


def _centroid(scenario: Scenario) -> Item:
    """Item 13: the task value (9) does not depend on the UAV."""
    targets = {robot: scenario.ugvs[robot].target_m[0] for robot in ("ugv1", "ugv2")}
    uav_x = np.array([-2.0, 0.0, 2.0, 4.0])
    centroid = np.full(len(uav_x), sum(targets.values()) / 2.0)
    values = {"as_printed_m": centroid, "corrected_m": uav_x - centroid}
    printed, ours = (np.ptp(value) / np.ptp(uav_x) for value in values.values())  # linear: the Jacobian is the slope
    return item(
        13, "(9)-(10)",
        "The task value (9) is the centroid of the UGVs, which does not depend on the UAV's position. So its Jacobian "
        "is 0, and so is the velocity (10). The UAV would never move.",
        {"task": "centroid of the UGVs", "jacobian": int(printed)},
        {"task": "own position minus the centroid", "jacobian": int(ours)},
        printed == 0 and ours == 1,
        {
            "pseudo_inverse_of_0": float(np.linalg.pinv(np.zeros((1, 1)))[0, 0]), "ugvs_at_x_m": targets,
            "task_values": {"uav_x_m": uav_x.tolist()} | {name: value.tolist() for name, value in values.items()},
        },
    )  # fmt: skip


def _grid_points() -> Item:
    """Item 14: (27a) sums N + 1 points and forgets the stage's length."""
    horizon, stages = 3.0, 60
    printed, ours = sum(1.0 for _ in range(stages + 1)), sum(horizon / stages for _ in range(stages))
    return item(
        14, "(27a)",
        "(27a) replaces the integral (25) over N intervals by a sum over k = 0..N. That has N + 1 terms, and lacks "
        "the length of an interval. For the integrand 1 it gives 61; the integral is 3 s.",
        printed, ours,
        not math.isclose(printed, horizon) and math.isclose(ours, horizon),
        {"integrand": 1.0, "horizon_s": horizon, "stages": stages, "integral_s": horizon},
    )  # fmt: skip


def _rule_three() -> Item:
    """Item 15: rule (3) of section 3.1.3 says the opposite of its own reason."""
    n, others, lowest = 3, 2, 2  # dimensions: velocity, all tasks but the lowest, the lowest
    smaller = [others + m > n for m in range(n + 1) if m > n - others]
    return item(
        15, "section 3.1.3, rule (3)",
        "Rule (3) lets the lowest task's dimension exceed what the higher ones leave, 'so that n is ensured to be "
        "greater than the total dimension'. Then n is smaller. Besides, the introduction to section 3 says that an "
        "intervention is triggered when the threshold is *not* reached. That contradicts (20).",
        "m_r > n - sum of the others, so that n > the total", "m_r > n - sum of the others means n < the total",
        lowest > n - others and not n > others + lowest and all(smaller),
        {"n": n, "higher_tasks": others, "lowest_task": lowest, "total": others + lowest, "rest": "by reading"},
    )  # fmt: skip


def _null_space() -> Item:
    """Item 16: under a position intervention nothing of the UGV's own task is left."""
    left, partly = (np.eye(3) - np.linalg.pinv(jacobian) @ jacobian for jacobian in (np.eye(3), np.eye(3)[1:2]))
    return item(
        16, "(20), (23)",
        "If the intervention is a position (J_int = I), (20) executes nothing of the UGV's own task, nor avoidance. "
        "The text says that the own task is partly executed. The paper does not define J_int. We use the identity, "
        "so UGV1 crashes in our case B, method (b). An intervention in one direction leaves part of the own task.",
        {"rank_of_the_null_space": int(np.linalg.matrix_rank(left))},
        {"rank_for_an_intervention_in_one_direction": int(np.linalg.matrix_rank(partly))},
        not left.any() and bool(partly.any()),
        {"projector": left.tolist(), "projector_for_one_direction": partly.tolist()},
    )  # fmt: skip


def _one_speed(scenario: Scenario) -> Item:
    """Item 17: the times of cases A and B need two speeds of the same preset trajectory, or three."""
    stall, preset = between_obstacles(scenario)[1].tolist(), scenario.ugvs["ugv1"].preset
    travelled = leaves_ball(preset, stall, TABLE_1.zeta_m) or math.nan
    reported_s, late_s = {"case_a": 14.45, "case_b": 10.6}, 18.1
    needed, third = {name: travelled / time_s for name, time_s in reported_s.items()}, travelled / late_s
    here = {name: load(name).ugvs["ugv1"].preset.speed_m_s for name in reported_s}
    return item(
        17, "Table 1, section 5, Figure 10",
        f"Table 1 has one speed for both cases. Without noise UGV1's reference is zeta away after {travelled:.3f} m "
        f"(as in finding 6), so triggers at 14.45 s and 10.6 s need {needed['case_a']:.4f} and {needed['case_b']:.4f} "
        f"m/s. The caption of Figure 10 mentions wrong interventions 'after {late_s:g} s' in one method and at 10.6 s "
        f"in the other. If the first begin at {late_s:g} s, that needs a third speed, {third:.4f} m/s, although the "
        f"methods of a case do not differ before the trigger. The caption may only mean that they still last at "
        f"{late_s:g} s. Scenario case_b has {here['case_b']:g} m/s, so that its UAV sends, and its UGV answers, at "
        "about 10.6 s.",
        {"trigger_s": reported_s, "speed_m_s": PRINTED_SPEED_M_S}, {"speed_m_s": needed},
        abs(needed["case_a"] - needed["case_b"]) > 0.1,
        {
            "reference_travelled_at_the_trigger_m": travelled, "caption_of_figure_10_s": late_s,
            "speed_if_it_begins_there_m_s": third, "speed_in_the_scenarios_m_s": here,
        },
    )  # fmt: skip


def _intervention_rate(scenario: Scenario) -> Item:
    """Item 19: with (13), (14) has a solution only if the error is 0, and then it has many."""
    gain, error = scenario.control.intervention_gain_1_s, 1.0
    tasks = {"J = I": np.eye(3), "J = one row": np.array([[0.0, 1.0, 0.0]])}
    by_task = {}
    for name, jacobian in tasks.items():
        inverse = np.linalg.pinv(jacobian)
        left = np.eye(3) - inverse @ jacobian  # v = J^+ (J v + gain e), so (I - J^+ J) v = gain J^+ e
        right = gain * inverse @ np.full(len(jacobian), error)
        best = np.linalg.lstsq(left, right, rcond=None)[0]
        by_task[name] = {
            "least_residual_m_s": float(np.linalg.norm(left @ best - right)),
            "free_dimensions_without_error": int(3 - np.linalg.matrix_rank(left)),
        }
    return item(
        19, "(12)-(14)",
        "(13) gives the rate of the intervention task as J_int v_int, which contains the velocity that (14) defines. "
        "(14) then reads v = J^+ (J v + gain error). No velocity solves it unless the error is 0; then every velocity "
        "along the task does. Besides, (12) makes the desired task a function of the UGV's own position, so the error "
        "is 0. The paper must mean a desired position with its own rate.",
        "v_int = J^+ (J v_int + gain error)", "v_int = J^+ (d(sigma_d)/dt + gain error)",
        all(row["least_residual_m_s"] > 0.1 and row["free_dimensions_without_error"] > 0 for row in by_task.values()),
        {"gain_1_s": gain, "error_m": error, "by_task": by_task, "(12)": "by reading"},
    )  # fmt: skip


def _stall(scenario: Scenario) -> Item:
    """Item 20: the printed point of the stall is not 2 m from the obstacles."""
    printed, d = (3.3, 5.1), scenario.safe_distance.obstacle_m
    centres, point = between_obstacles(scenario)
    away = [dist(printed, centre) for centre in centres]
    return item(
        20, "section 5.1, Figure 5",
        f"The paper says that UGV1 stalls at ({printed[0]:g}, {printed[1]:g}), at a distance 'constant at 2 m'. The "
        f"obstacles are {away[0]:.3f} and {away[1]:.3f} m from that point. The point {d:g} m from both is "
        f"({point[0]:.3f}, {point[1]:.3f}); its x would be printed as {point[0]:.1f}. 3.3 m is the x of the preset "
        f"trajectory.",
        {"stall_m": list(printed), "distances_m": away},
        {"stall_m": point.tolist(), "distances_m": [dist(point, centre) for centre in centres]},
        any(abs(gap - d) > 0.02 for gap in away) and round(float(point[0]), 1) != printed[0],
        {"obstacles_m": [centre.tolist() for centre in centres], "safe_distance_m": d},
        unit="m",
    )  # fmt: skip


def between_obstacles(scenario: Scenario) -> tuple[list[Array], Array]:
    """The two obstacles between which UGV1 stalls, and the point at the safe distance from both, [x, y], m."""
    # Of the two such points it is the one at which UGV1 arrives first.
    d = scenario.safe_distance.obstacle_m
    centres = [np.array(scenario.obstacles[name].position_m[:2]) for name in ("obstacle_1", "obstacle_2")]
    middle, between = (centres[0] + centres[1]) / 2.0, centres[1] - centres[0]
    length = float(np.linalg.norm(between))
    across = np.array([between[1], -between[0]]) / length * np.sqrt(d**2 - (length / 2.0) ** 2)
    return centres, min(middle + across, middle - across, key=lambda point: float(point[1]))


def _uav_target(scenario: Scenario) -> Item:
    """Item 21: the UAV's target is not over the centroid of the UGVs' targets."""
    (uav,) = scenario.aerial.values()
    target = uav.target_m[:2]
    centroid = np.mean([ugv.target_m[:2] for ugv in scenario.ugvs.values()], axis=0).tolist()
    away = dist(target, centroid)
    return item(
        21, "Table 1, (9)",
        f"Table 1 gives the UAV a target at x = {target[0]:g} m. Its formation task keeps it over the centroid of the "
        f"UGVs, which ends at {centroid[0]:g} m. No task moves the UAV to its target.",
        {"target_m": target}, {"centroid_m": centroid}, away > 1e-6, {"apart_m": away}, unit="m",
    )  # fmt: skip


def _indices() -> Item:
    """Item 22: what the indices of (5) and (22)-(29) allow, counted."""
    tasks, dimension = 2, 3
    choices = [  # omega^1 and omega^2 are pairs; (24) adds the two numbers of a pair
        (first, second)
        for first, second in product(product((0, 1), repeat=2), repeat=2)
        if sum(first) == sum(second) == 1
    ]
    two_velocities = [choice for choice in choices if choice[0] != choice[1]]
    return item(
        22, "(5), (22)-(29)",
        "The indices do not fit. (5) runs over N tasks, so it needs v^(N+1) = 0, but it sets v^(n+1) = 0, where n is "
        "the dimension of the velocity. (22)-(24) index the choice twice, by the superscript j and by the second "
        f"subscript: (24) admits {len(choices)} choices for each UGV, and {len(two_velocities)} of them give (23) two "
        "velocities at once. (28)-(29) index the choice by j alone and lack the UGV's index i; r is a stage in (28) "
        "and a choice in (29). (25) and (26) use i both as a summation index and as a free index.",
        {"choices": len(choices)}, {"choices": 2},
        len(choices) == 4 and len(two_velocities) == 2 and dimension != tasks,
        {
            "choices_by_24": [f"omega^1 = {first}, omega^2 = {second}" for first, second in choices],
            "two_velocities": len(two_velocities), "(5), N = 2 tasks, n = 3": {
                "zero_as_printed": f"v^{dimension + 1}", "zero_needed": f"v^{tasks + 1}",
            },
            "(25)-(29)": "by reading",
        },
    )  # fmt: skip
