"""MovingAI's maps and scenarios: rows from the top in the file, from the bottom here; broken files."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.maps import movingai

MAP = "type octile\nheight 3\nwidth 4\nmap\n.@..\nTG..\nSOW.\n"
SCEN = "version 1\n0\troom.map\t4\t3\t0\t0\t3\t2\t5.0\n1\troom.map\t4\t3\t1\t1\t2\t0\t1.4\n"


@given(
    rows=arrays(np.dtype("U1"), st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.sampled_from(".GS@OTW"))
)
def test_a_map_is_read_with_its_lowest_row_first(rows: np.ndarray) -> None:
    lines = ["type octile", f"height {len(rows)}", f"width {rows.shape[1]}", "map", *map("".join, rows.tolist())]
    assert np.array_equal(movingai.cells("\n".join(lines), "m"), np.isin(rows[::-1], list("@OTW")))


def test_agents_are_counted_from_the_bottom_too() -> None:
    found = movingai.agents(SCEN, "s", movingai.cells(MAP, "m"))
    assert found == [((0, 2), (3, 0), 2), ((1, 1), (2, 2), 3)]
    assert movingai.map_name(SCEN) == "room.map"
    assert movingai.agents(SCEN.replace("\t", " "), "s", movingai.cells(MAP, "m")) == found


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (MAP, "", "m:1: type: missing; wanted: a map of MovingAI"),
        ("height", "hight", "m:2: height: missing"),
        ("width 4", "width 1e9", "m:3: width: '1e9' is not allowed; wanted: a whole number from 1 to"),
        ("width 4", "width 16000000", "m:2: height: 3 x 16000000 cells; at most 16000000 are allowed"),
        ("width 4", "width 5", "m:5: map: 4 characters; as many as width = 5 are wanted"),
        ("height 3", "height 4", "m:7: map: 3 rows; as many as height = 4 are wanted"),
        ("height 3", "height 2", "m:6: map: 3 rows; as many as height = 2 are wanted"),
        ("SOW.", "SO\0.", "m:7: map: '\\x00' is not allowed; allowed: . G S @ O T W"),
    ],
)
def test_a_broken_map_is_refused_with_its_line(old: str, new: str, says: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        movingai.cells(MAP.replace(old, new), "m")
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (SCEN, "", "s:1: version: missing"),
        ("\t1.4", "", "s:3: 8 columns; wanted: bucket, map"),
        ("\t4\t3\t0", "\t5\t3\t0", "s:2: width: '5' is not allowed; wanted: 4"),
        ("\t1\t1\t2", "\t-1\t1\t2", "s:3: start x: '-1' is not allowed; wanted: a whole number from 0 to 3"),
        ("\t1\t1\t2", "\tnan\t1\t2", "s:3: start x: 'nan' is not allowed"),
        ("\t1\t1\t2", "\t1\t0\t2", "s:3: start: in the way; wanted: a free cell of the map"),
        ("\t2\t0\t1.4", "\t2\t2\t1.4", "s:3: goal: in the way"),
    ],
)
def test_a_broken_scenario_is_refused_with_its_line(old: str, new: str, says: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        movingai.agents(SCEN.replace(old, new), "s", movingai.cells(MAP, "m"))
    assert says in str(caught.value)
