"""Occupied cells as few rectangles."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.scenario import map_file
from airground_drake.scenario.maps.rectangles import Cells, covering

MAPS = Path(__file__).parent / "data"
GRIDS = st.one_of(
    arrays(bool, st.tuples(st.integers(0, 8), st.integers(0, 8))),
    st.lists(st.tuples(*4 * [st.integers(0, 20)]), max_size=8).map(lambda boxes: drawn(boxes, (20, 20))),
)
"""Cells at random, and boxes one over the other."""


def drawn(boxes: list[tuple[int, int, int, int]], shape: tuple[int, int]) -> Cells:
    """The cells in boxes: first and last row, first and last column."""
    cells = np.zeros(shape, bool)
    for top, bottom, left, right in boxes:
        cells[top:bottom, left:right] = True
    return cells


def merged_runs(cells: Cells) -> int:
    runs: list[set[tuple[int, int]]] = [set()]
    for row in cells.tolist():
        text = "".join(".#"[cell] for cell in row) + "."
        ends = [i for i in range(len(text)) if text[i] != (text[i - 1] if i else ".")]
        runs.append(set(zip(ends[::2], ends[1::2], strict=True)))
    return sum(len(own - before) for before, own in itertools.pairwise(runs))


@given(cells=GRIDS)
def test_the_union_of_the_rectangles_is_what_is_occupied_and_each_is_needed(cells: Cells) -> None:
    found = covering(cells)
    assert len(found) <= merged_runs(cells)
    boxes = [tuple(map(int, each)) for each in found]
    assert all(0 <= top < bottom <= len(cells) and 0 <= left < right for top, bottom, left, right in boxes)
    assert np.array_equal(drawn(boxes, cells.shape), cells)
    for index in range(len(boxes)):
        assert not np.array_equal(drawn(boxes[:index] + boxes[index + 1 :], cells.shape), cells)


def test_walls_that_cross_are_two_rectangles() -> None:
    assert covering(drawn([(0, 9, 4, 5), (4, 5, 0, 9)], (9, 9))).tolist() == [[0, 9, 4, 5], [4, 5, 0, 9]]


@pytest.mark.parametrize(
    ("name", "start", "runs", "runs_filled", "covered", "covered_filled"),
    [("turtlebot3_world", (-2.0, -0.5), 162, 156, 152, 147), ("depot", (15.0, 7.0), 1101, 676, 958, 573)],
)
def test_real_maps_become_fewer_rectangles_than_their_merged_runs(
    name: str, start: tuple[float, float], runs: int, runs_filled: int, covered: int, covered_filled: int
) -> None:
    grid = map_file.read(MAPS / f"{name}.yaml").grid()
    filled = grid.filled([start])
    assert (merged_runs(grid.occupied), merged_runs(filled.occupied)) == (runs, runs_filled)
    assert (len(covering(grid.occupied)), len(covering(filled.occupied))) == (covered, covered_filled)
