"""Where robots can start and end on a map."""

import heapq
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from airground_drake.scenario import map_file
from airground_drake.scenario.maps.grid import Frame, Grid
from airground_drake.scenario.maps.sites import ways

MAPS = Path(__file__).parent / "data"


def shortest(open_: np.ndarray, start: tuple[int, int], target: tuple[int, int]) -> float:
    """Number of steps over the sides of open cells: Dijkstra, by hand."""
    best, front = {start: 0}, [(0, start)]
    while front:
        steps, (row, column) = heapq.heappop(front)
        if (row, column) == target:
            return steps
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if open_[cell] and steps + 1 < best.get(cell, math.inf):
                best[cell] = steps + 1
                heapq.heappush(front, (steps + 1, cell))
    return math.inf


@pytest.mark.parametrize("name", ["turtlebot3_world", "depot"])
def test_sites_are_clear_of_obstacles_and_apart_with_a_way_that_is_not_longer_than_said(name: str) -> None:
    grid, clearance = map_file.read(MAPS / f"{name}.yaml").grid(), 0.25
    pairs, longest = ways(grid, clearance, 3)
    open_ = (grid.clearance() > clearance) & ~grid.occupied
    cells = [[tuple(cell) for cell in grid.cells(pair).tolist()] for pair in pairs]
    found = [shortest(open_, start, target) * grid.frame.cell_m for start, target in cells]
    assert longest == pytest.approx(max(found))
    occupied = grid.frame.points(np.argwhere(grid.occupied)[:, ::-1] + 0.5)
    for point in pairs.reshape(-1, 2):
        nearest = np.abs(occupied - point).max(axis=1).min() - 0.5 * grid.frame.cell_m
        assert nearest > clearance / math.sqrt(2.0)
    sites = pairs.reshape(-1, 2).tolist()
    assert min(math.dist(one, other) for one, other in itertools.combinations(sites, 2)) > 2.0 * clearance


def test_without_room_the_number_that_fits_is_said() -> None:
    cells = np.ones((3, 30), bool)
    cells[1, 1:-1] = False
    with pytest.raises(ValueError, match="room for 14, with"):
        ways(Grid(cells, Frame(1.0)), 0.2, 15)  # 28 cells
    with pytest.raises(ValueError, match="room for 0, with"):
        ways(Grid(cells, Frame(1.0)), 5.0, 1)


def test_a_bare_room_has_room_beside_its_middle() -> None:
    cells = np.ones((80, 120), bool)
    cells[1:-1, 1:-1] = False  # its middle is the only cell far from all walls
    pairs, _ = ways(Grid(cells, Frame(0.05)), 0.3, 6)
    sites = pairs.reshape(-1, 2).tolist()
    assert min(math.dist(one, other) for one, other in itertools.combinations(sites, 2)) >= 0.6 / math.sqrt(2.0)
