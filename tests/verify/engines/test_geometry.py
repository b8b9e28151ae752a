"""Exact geometry against sampling, and bounds of distances against the distances themselves."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from properties import examples

from airground_drake.verify.engines.geometry import (
    ROWS,
    Approach,
    NormSignal,
    apart_at_least,
    boxes_of,
    corner_times,
    instant_of,
    interpolate,
    travelled,
)
from airground_drake.verify.engines.outlines import closest
from airground_drake.verify.runs.pairs import CENTRE, least_of

COORDINATES = st.floats(-10.0, 10.0, allow_subnormal=False)
PATHS = st.integers(2, 6).flatmap(lambda n: st.tuples(*[arrays(np.float64, (n, 3), elements=COORDINATES)] * 2))


def closest_approach(t: np.ndarray, first: np.ndarray, second: np.ndarray) -> Approach:
    """Where two points are nearest to each other."""
    found = closest(CENTRE, first - second, planar=False)
    return Approach(found.distance, instant_of(t, found.row, found.share), found.row)


@examples(150)
@given(PATHS, st.booleans())
def test_closest_approach_against_sampling(paths: tuple[np.ndarray, np.ndarray], at_rest: bool) -> None:
    first, second = paths[0], paths[1][0] if at_rest else paths[1]
    t = np.cumsum(np.linspace(0.1, 0.5, len(first)))
    found = closest_approach(t, first, second)
    fine = np.unique(np.concatenate([np.linspace(a, b, 101) for a, b in pairwise(t)]))
    there = second if at_rest else interpolate(t, second, fine)
    sampled = np.linalg.norm(interpolate(t, first, fine) - there, axis=1).min()
    longest = np.linalg.norm(np.diff(first - second, axis=0), axis=1).max() / 100.0
    assert sampled - longest / 2.0 - 1e-9 <= found.distance_m <= sampled + 1e-9
    assert t[found.row - 1] <= found.t_s <= t[found.row]
    at = interpolate(t, first, found.t_s) - (second if at_rest else interpolate(t, second, found.t_s))
    assert np.linalg.norm(at) == pytest.approx(found.distance_m, abs=1e-9)


def test_closest_approach_of_one_row_and_of_the_earliest_of_several_times() -> None:
    t, still = np.array([0.0, 1.0, 3.0]), np.zeros((3, 3))
    assert closest_approach(t[:1], still[:1], np.ones(3)).row == 0
    assert closest_approach(t, still, np.ones(3)).t_s == 0.0


def test_travelled_holds_its_last_point() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    np.testing.assert_allclose(corner_times(corners, 0.5), [4.0, 6.0])
    np.testing.assert_allclose(travelled(corners, 0.5, np.array([2.0, 5.0, 9.0]))[:, :2], [[1, 0], [2, 0.5], [2, 1]])
    assert corner_times(corners[:1], 0.5).size == corner_times(corners, 0.0).size == 0


@examples(100)
@given(arrays(np.float64, (4, 4), elements=st.floats(-2.0, 2.0, allow_subnormal=False)), st.floats(-1.0, 3.0))
@example(np.array([[0.0] * 4, [2.4e-161, 0.0, 0.0, 0.0], [0.0] * 4, [0.0] * 4]), 0.0)  # squares are 0
def test_norm_signal_against_sampling(parts: np.ndarray, level: float) -> None:
    t = np.array([0.0, 0.3, 1.0, 1.2])
    x = NormSignal.of(t, parts)
    fine = np.linspace(0.0, 1.2, 2401)
    sampled = np.linalg.norm(interpolate(t, parts[:, :3], fine), axis=1) + np.interp(fine, t, parts[:, 3])
    np.testing.assert_allclose(x.at(fine), sampled, atol=1e-9)
    for a, b in pairwise(x.t):  # monotone between knots
        steps = np.diff(x.at(np.linspace(a, b, 20)))
        assert (steps >= -1e-9).all() or (steps <= 1e-9).all()
    for above in (True, False):
        begin = next((s for s, v in zip(fine, sampled, strict=True) if (v >= level) != above), None)
        if begin is None:
            continue
        reached = x.reaches(level, begin, above=above)
        beyond = fine[(fine > begin) & ((sampled >= level + 1e-9) if above else (sampled < level - 1e-9))]
        assert reached is not None or not beyond.size
        if reached is not None:
            assert float(x.at(reached)) == pytest.approx(level, abs=1e-8)
            assert not beyond.size or reached <= beyond[0] + 1e-9


@given(st.integers(0, 2**32 - 1), st.integers(1, 3 * ROWS), st.sampled_from([0.0, 0.01, 1.0, 10.0]))
def test_boxes_bound_distances_and_touch_what_stands(seed: int, rows: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(4, 1, 3)) * 5.0 + np.cumsum(step * rng.normal(size=(4, rows, 3)), axis=1)
    positions[1:3, :, 1:] = positions[0, :1, 1:]  # boxes of points on one line are as far apart as the points
    first, second = np.triu_indices(4, 1)
    least = apart_at_least(boxes_of(positions), first, second)
    t = np.arange(float(rows))
    exact = [closest_approach(t, positions[i], positions[j]).distance_m for i, j in zip(first, second, strict=True)]
    assert (least <= exact).all()
    if step == 0.0:
        assert least[:2] == pytest.approx(exact[:2], abs=1e-8)


@given(st.lists(st.tuples(st.floats(0.0, 9.0), st.floats(0.0, 3.0)), max_size=30), st.integers(1, 8))
def test_the_least_values_are_found_from_their_bounds(pairs: list[tuple[float, float]], most: int) -> None:
    values = [bound + more for bound, more in pairs]
    found = least_of(np.array([bound for bound, _ in pairs]), most, values.__getitem__)
    assert found == sorted(found)
    assert sorted(values[k] for k in found) == sorted(values)[:most]
