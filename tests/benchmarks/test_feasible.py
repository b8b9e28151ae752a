"""The benchmark's own planners on cases with a known answer, and against the package's shortest paths."""

import re
from pathlib import Path

import feasible
import numpy as np
import pytest
from feasible import JointPlan, joint_plan, shortest_length
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry.outline import balls
from airground_drake.model.geometry.paths import NoPath, shortest_path

START, TARGET = np.array([0.0, 0.0]), np.array([20.0, 0.0])


def test_it_does_not_use_the_package_that_it_judges() -> None:
    assert not re.search(r"(import|from) airground_drake", Path(feasible.__file__).read_text(encoding="utf-8"))


@given(seed=st.integers(0, 10**6), count=st.integers(0, 12))
@examples(25)
def test_lengths_are_those_of_the_packages_shortest_paths(seed: int, count: int) -> None:
    """Two programs that share no code."""
    centres = np.random.default_rng(seed).uniform([2.0, -5.0], [18.0, 5.0], (count, 2))
    ours = shortest_length(START, TARGET, centres, 1.5)
    try:
        discs = balls(np.column_stack([centres, np.zeros(count)]))
        theirs = shortest_path(START, TARGET, discs, np.full(count, 1.5)).length_m
    except NoPath:
        theirs = np.inf
    assert ours == pytest.approx(theirs, abs=1e-6)
    assert ours == pytest.approx(shortest_length(TARGET, START, centres, 1.5), abs=1e-9)
    assert ours <= shortest_length(START, TARGET, centres, 1.6) + 1e-9


def plan(starts: np.ndarray, targets: np.ndarray, centres: np.ndarray, duration: float = 40.0) -> JointPlan | None:
    return joint_plan(starts, targets, centres, obstacle_m=1.0, ugv_m=1.0, speed_m_s=1.0, duration_s=duration)


def test_two_exchange_places() -> None:
    ends = np.array([[-4.0, 0.0], [4.0, 0.3]])
    found = plan(ends, ends[::-1], np.array([[0.0, 0.0]]))
    assert found is not None
    assert found.least_between() >= 1.0
    assert found.least_to(np.array([[0.0, 0.0]])) >= 1.0
    assert found.top_speed() <= 1.0 + 1e-9
    assert np.array_equal(found.positions[:, 0], ends)
    assert np.array_equal(found.positions[:, -1], ends[::-1])


def test_no_plan_where_nobody_can_pass_or_arrive_in_time() -> None:
    along = np.arange(-6.0, 6.1, 1.0)
    tube = np.concatenate([np.column_stack([along, np.full(13, y)]) for y in (-1.4, 1.4)] + [[[-6.0, 0.0], [6.0, 0.0]]])
    ends = np.array([[-4.0, 0.0], [4.0, 0.0]])
    assert plan(ends, ends[::-1], tube) is None
    assert plan(ends[:1], ends[1:], tube) is not None
    assert plan(ends[:1], ends[1:], tube, duration=6.0) is None


def test_distances_of_a_plan_are_those_in_between() -> None:
    """Two robots that change places in one step are apart at both ends and meet in the middle."""
    meeting = JointPlan(np.array([0.0, 1.0]), np.array([[[0.0, 0.0], [2.0, 0.0]], [[2.0, 0.0], [0.0, 0.0]]]))
    assert meeting.least_between() == 0.0
    assert meeting.least_to(np.array([[1.0, 0.5]])) == 0.5
    assert meeting.top_speed() == 2.0
