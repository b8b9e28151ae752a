"""Evidence as tables."""

import json

from hypothesis import given
from hypothesis import strategies as st

from airground_drake.report import html

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=30,
)


def test_values_records_and_records_by_name() -> None:
    found = html.tables(
        {
            "tolerance_m": 0.125,
            "agrees": True,
            "point_m": [1.0, 2.0],
            "pairs": [{"first": "a", "gap_m": 0.5}, {"first": "b", "row": 3}],
            "robots": {"ugv_1": {"count": 2}},
        },
        "X",
    )
    assert [table.caption for table in found] == ["X", "X: pairs", "X: robots"]
    assert found[0].rows == (("tolerance, m", "0.125"), ("agrees", "yes"), ("point, m", "(1, 2)"))
    assert found[1].columns == ("", "first", "gap, m", "row")
    assert found[1].rows == (("1", "a", "0.5", ""), ("2", "b", "", "3"))
    assert found[2].rows == (("ugv_1", "2"),)


def test_long_tables_and_long_cells_are_cut() -> None:
    rows, cell = html.tables({"rows": [{"x": k} for k in range(90)], "y": "y" * 500}, "X")[::-1]
    assert len(rows.rows) == html.MAX_ROWS
    assert "50 more rows" in rows.caption
    assert cell.rows[0][1].endswith("…")


@given(st.dictionaries(st.text(), JSON, max_size=5))
def test_any_json_is_shown(found: dict[str, object]) -> None:
    for table in html.tables(json.loads(json.dumps(found)), "X"):
        assert all(len(row) == len(table.columns) for row in table.rows)
        assert all(isinstance(cell, str) for row in table.rows for cell in row)
