"""Every tampering with a report is refused: by the checker, or when its claims are judged again."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check.tampering import TAMPERINGS, attempt
from check.tampering.base import copy, edited_table, read_json, read_table, write
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

FREE = ("provenance", "files", "schema")
"""Parts of report.json that are not drawn: the clock, and digests that the test itself makes right."""
TABLES = ("signals", "decisions", "problems", "proposals")


@pytest.mark.parametrize("name", TAMPERINGS)
def test_a_tampered_report_is_refused(report: Path, name: str) -> None:
    tampering = TAMPERINGS[name]
    outcome = attempt(report, tampering.edit, mended=tampering.mended)
    assert outcome.is_of(tampering), (outcome.code, outcome.refused, outcome.error)
    assert all(line["rule"] and line["text"] for line in outcome.refused)


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of every value of a JSON document that has no parts."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        yield from leaves(part, (*path, key)) if isinstance(part, (dict, list)) else [(*path, key)]


def changed(value: Any) -> Any:
    """Another value of the same kind, farther away than any tolerance."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1 if isinstance(value, int) else value * 1.01 + 1e-3
    return f"{value}, they say"


@examples(60, fuzz=2000)
@given(place=st.floats(0.0, 1.0, exclude_max=True))
def test_any_changed_value_of_the_report_is_refused(report: Path, place: float) -> None:
    def edit(folder: Path) -> None:
        document = read_json(folder / "report.json")
        places = [path for path in leaves(document) if path[0] not in FREE and path[-1] != "from_cache"]
        path = places[int(place * len(places))]
        part = document
        for key in path[:-1]:
            part = part[key]
        part[path[-1]] = changed(part[path[-1]])
        write(folder / "report.json", json.dumps(document).encode())

    assert attempt(report, edit).code


@examples(12, fuzz=500)
@given(
    run=st.sampled_from("bcd"), table=st.sampled_from(TABLES), column=st.floats(0, 1, exclude_max=True),
    row=st.floats(0, 1, exclude_max=True),
)  # fmt: skip
def test_any_changed_cell_of_a_trace_is_refused(report: Path, run: str, table: str, column: float, row: float) -> None:
    if not len(read_table(report, table, run)):
        return

    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            name, k = frame.columns[int(column * frame.shape[1])], int(row * len(frame))
            cell = frame[name].iloc[k]
            if isinstance(cell, np.ndarray):
                new: Any = np.append(cell * 1.01, 1.0) if not len(cell) else cell * 1.01 + 1e-3
            else:
                new = changed(cell.item() if isinstance(cell, np.generic) else cell)
            column_of = frame[name].astype(object) if isinstance(new, (str, np.ndarray)) else frame[name].copy()
            column_of.iloc[k] = new
            frame[name] = column_of

    assert attempt(report, edit).code


def test_numbers_that_differ_by_rounding_only_agree(report: Path) -> None:
    """Another version of numpy or of a solver gives other last digits."""

    def edit(folder: Path) -> None:
        document = read_json(folder / "report.json")
        for path in leaves(document["claims"]):
            part = document["claims"]
            for key in path[:-1]:
                part = part[key]
            if isinstance(part[path[-1]], float):
                part[path[-1]] = math.nextafter(part[path[-1]], math.inf)
        write(folder / "report.json", json.dumps(document).encode())

    assert attempt(report, edit).code == 0


def test_a_copy_that_was_tampered_with_is_mended(report: Path, tmp_path: Path) -> None:
    folder = copy(report, tmp_path)
    TAMPERINGS["position_changed"].edit(folder)
    TAMPERINGS["trace_folder_added"].edit(folder)
    TAMPERINGS["timings_missing"].edit(folder)
    copy(report, folder)
    kept = {path.relative_to(folder): path for path in folder.rglob("*")}
    assert set(kept) == {path.relative_to(report) for path in report.rglob("*")}
    assert all(path.is_dir() or path.samefile(report / name) for name, path in kept.items())
