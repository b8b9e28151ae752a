"""SAFE-TRACE."""

from __future__ import annotations

import numpy as np
import pytest
from builders.edits import moved, with_scenario
from builders.runs import passing_by, run_of
from verify.judging import counterexample, judge


@pytest.mark.parametrize(
    ("offset", "status"), [(-1e-6, "refuted"), (-2e-9, "refuted"), (-5e-10, "holds"), (1e-6, "holds")]
)
def test_safe_trace_sees_a_dip_between_two_rows(offset: float, status: str) -> None:
    trace = passing_by(offset)
    at_rows = np.linalg.norm(trace.position("ugv1"), axis=1).min()
    finding = judge("SAFE-TRACE", trace)
    assert at_rows > 2.0  # no row shows it
    assert finding.status == status
    assert finding.margin == pytest.approx(offset, abs=1e-12)
    assert finding.where["t_s"] == pytest.approx(0.5125, abs=1e-9)
    if status == "refuted":
        seen = counterexample("SAFE-TRACE", trace)
        np.testing.assert_allclose(seen["positions_m"]["ugv1"], [0.0, 2.0 + offset, 0.0], atol=1e-9)


@pytest.mark.parametrize("robot", ["ugv1", "ugv2", "uav"])
def test_safe_trace_sees_every_robot_in_every_pair(robot: str) -> None:
    trace = run_of("d")
    for entry in judge("SAFE-TRACE", trace).evidence["pairs"]:
        if robot not in (entry["first"], entry["second"]):
            continue
        other = entry["second"] if robot == entry["first"] else entry["first"]
        row = int(np.searchsorted(trace.t, 9.0))
        obstacles = trace.scenario.obstacles
        there = np.array(obstacles[other].position_m) if other in obstacles else trace.position(other)[row]
        offset = there + np.array([0.0, 0.0, entry["safe_distance_m"] - 1e-6]) - trace.position(robot)[row]
        finding = judge("SAFE-TRACE", moved(trace, robot, row, offset.tolist()))
        assert finding.status == "refuted", other


def test_safe_trace_has_every_pair_with_its_distance() -> None:
    pairs = judge("SAFE-TRACE", run_of("d")).evidence["pairs"]
    listed = {(entry["first"], entry["second"]): entry["safe_distance_m"] for entry in pairs}
    robots = {("ugv1", "ugv2"): 2.0, ("ugv1", "uav"): 1.0, ("ugv2", "uav"): 1.0}
    assert listed == robots | {(r, f"obstacle_{i}"): 2.0 for r in ("ugv1", "ugv2", "uav") for i in (1, 2, 3)}


def test_safe_trace_does_not_care_what_the_uav_knows() -> None:
    unknown = with_scenario(passing_by(-1e-6), obstacles__o__known_to_uav=False)
    assert judge("SAFE-TRACE", unknown).status == "refuted"
