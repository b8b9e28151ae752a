"""Maps in the world: their frame, and what robots can reach."""

import cmath
import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.scenario.maps.grid import Frame, Grid
from airground_drake.scenario.maps.rectangles import Cells, covering

SMALL = st.floats(-50.0, 50.0)
GRIDS = st.builds(
    Grid,
    arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 7))),
    st.builds(Frame, st.floats(0.01, 5.0), st.tuples(SMALL, SMALL, st.floats(-7.0, 7.0))),
)


def middle(grid: Grid, row: float, column: float) -> complex:
    x, y, heading = grid.frame.origin
    return complex(x, y) + grid.frame.cell_m * complex(column + 0.5, row + 0.5) * cmath.exp(1j * heading)


@given(grid=GRIDS)
def test_a_cells_middle_is_inside_rectangles_exactly_if_it_is_occupied(grid: Grid) -> None:
    corners = grid.frame.corners(covering(grid.occupied)) @ (1.0, 1j)
    for (row, column), occupied in np.ndenumerate(grid.occupied):
        point = middle(grid, row, column)
        assert grid.cells(np.array([[point.real, point.imag]])).tolist() == [[row, column]]
        # to the left of every side: the corners are counter-clockwise
        sides = [
            [((b - a).conjugate() * (point - a)).imag for a, b in zip(each, np.roll(each, -1), strict=True)]
            for each in corners
        ]
        assert any(min(each) > 0.0 for each in sides) == occupied


def test_without_a_heading_coordinates_are_short_decimals() -> None:
    grid = Grid(np.ones((3, 4), bool), Frame(0.05, (-10.0, 2.0, 0.0)))
    expected = [[-9.95, 2.0], [-9.8, 2.0], [-9.8, 2.15], [-9.95, 2.15]]
    assert grid.frame.corners(np.array([[0, 3, 1, 4]])).tolist() == [expected]


def reached(free: Cells, robots: list[tuple[int, int]]) -> Cells:
    """The cells that robots reach from theirs through free ones; around the map all is free. By hand."""
    rows, columns = free.shape
    seen = set[tuple[int, int]]()
    front = [cell for cell in robots if not (0 <= cell[0] < rows and 0 <= cell[1] < columns) or free[cell]]
    front = [(min(max(row, -1), rows), min(max(column, -1), columns)) for row, column in front]
    while front:
        row, column = front.pop()
        inside = 0 <= row < rows and 0 <= column < columns
        if (row, column) in seen or not (-1 <= row <= rows and -1 <= column <= columns):
            continue
        if inside and not free[row, column]:
            continue
        seen.add((row, column))
        front += [(row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)]
    return np.array([[(row, column) in seen for column in range(columns)] for row in range(rows)], bool)


@given(grid=GRIDS, robots=st.lists(st.tuples(st.integers(-3, 9), st.integers(-3, 9)), min_size=1, max_size=3))
def test_free_cells_that_no_robot_reaches_are_filled(grid: Grid, robots: list[tuple[int, int]]) -> None:
    rows, columns = grid.occupied.shape
    theirs = reached(~grid.occupied, robots)
    at_home = [
        not (0 <= row < rows and 0 <= column < columns) or not grid.occupied[row, column] for row, column in robots
    ]
    expected = ~theirs if any(at_home) else grid.occupied
    points = [middle(grid, *cell) for cell in robots]
    filled = grid.filled([(point.real, point.imag) for point in points])
    assert np.array_equal(filled.occupied, expected)
    assert filled[1:] == grid[1:]


@given(grid=GRIDS)
def test_clearance_is_at_most_the_distance_from_the_nearest_occupied_cell(grid: Grid) -> None:
    found = grid.clearance()
    for row, column in itertools.product(*map(range, grid.occupied.shape)):
        gaps = [
            grid.frame.cell_m * np.hypot(max(abs(row - i) - 0.5, 0.0), max(abs(column - j) - 0.5, 0.0))
            for i, j in np.argwhere(grid.occupied)
        ]
        if not grid.occupied[row, column]:
            least = min(gaps, default=np.inf)
            assert found[row, column] <= least + 1e-9
            assert found[row, column] >= least - (np.sqrt(0.5) - 0.5) * grid.frame.cell_m - 1e-9
