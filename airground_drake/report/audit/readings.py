"""Findings about statements of the paper that its formulas or numbers do not support."""

from itertools import product
from math import dist

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.report.audit.item import Item, item
from airground_drake.scenario.schema import Scenario


def reading_findings(scenario: Scenario) -> list[Item]:
    """Items 19 to 22."""
    return [_intervention_rate(scenario), _stall(scenario), _uav_target(scenario), _indices()]


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
