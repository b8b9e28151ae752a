"""Bands, grids and cameras."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.base.arrays import Array
from airground_drake.report.view import geometry

coordinates = st.floats(-50.0, 50.0)
boxes = arrays(np.float64, (2, 3), elements=coordinates)


def area(mesh: geometry.Mesh) -> float:
    a, b, c = (mesh.vertices[:, mesh.faces[k]] for k in range(3))
    return float(np.abs(np.cross((b - a).T, (c - a).T)[:, 2]).sum() / 2.0)


def test_a_band_has_the_area_of_its_path_and_dashes_half_of_it() -> None:
    path = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 5.0, 1.0]])
    assert area(geometry.ribbon(path, 0.1)) == pytest.approx(0.1 * (3.1 + 5.1))
    assert area(geometry.ribbon(path, 0.1, dash_m=1.0)) == pytest.approx(0.1 * 4.0)
    for dash_m in (None, 0.5):
        assert geometry.ribbon(np.ones((3, 3)), 0.1, dash_m).faces.size == 0
    assert geometry.ribbon(np.array([[0.0, 0.0, 0.0], [1e9, 0.0, 0.0]]), 0.1, 0.5).faces.shape[1] < 5000


@given(boxes, st.floats(0.1, 1.5), st.floats(0.2, 2.0))
def test_the_camera_sees_the_whole_box(box: Array, elevation: float, opening: float) -> None:
    low, high = box.min(axis=0), box.max(axis=0) + 1.0
    place, target = geometry.camera(low, high, elevation, opening)
    ahead = (target - place) / np.linalg.norm(target - place)
    up = np.array([0.0, np.sin(elevation), np.cos(elevation)])
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    depth = (corners - place) @ ahead
    for axis in (up, np.array([1.0, 0.0, 0.0])):
        assert (np.abs((corners - place) @ axis) <= np.tan(opening / 2.0) * depth + 1e-6).all()


@given(boxes)
def test_a_grid_covers_its_rectangle(box: Array) -> None:
    low, high = box.min(axis=0)[:2], box.max(axis=0)[:2] + 0.1
    start, end = geometry.grid(low, high)
    assert start.shape == end.shape
    assert start.shape[1] <= 2 * (geometry.MOST_LINES + 4)
    every = np.concatenate([start, end], axis=1)
    assert (every[:2].min(axis=1) <= low + 1e-9).all()
    assert (every[:2].max(axis=1) >= high - 1e-9).all()


SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])


def test_prisms_have_the_area_of_their_tops_and_sides() -> None:
    triangle = np.array([[5.0, 0.0], [8.0, 0.0], [5.0, 4.0]])
    mesh = geometry.prisms([SQUARE, triangle], 1.5, lower=0.25)
    assert area(mesh) == pytest.approx(4.0 + 6.0)
    a, b, c = (mesh.vertices[:, mesh.faces[k]] for k in range(3))
    normals = np.cross((b - a).T, (c - a).T) / 2.0
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(10.0 + 8.0 * 1.5 + 12.0 * 1.25)
    assert normals[:3, 2].min() > 0.0  # tops come first, and look upwards
    middle = (a + b + c).T / 3.0 - np.where((a[0] < 4.0)[:, None], [1.0, 1.0, 0.0], [6.0, 1.3, 0.0])
    assert ((normals * middle)[3:, :2].sum(axis=1) > 0.0).all()  # sides look outwards
