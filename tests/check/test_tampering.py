"""Every tampering with a report is refused: by the checker, or when its claims are judged again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check.tampering import TAMPERINGS, attempt
from check.tampering.base import copy, edited_entries, edited_report, edited_table, mend, read_table, write, write_table
from hypothesis import example, given
from hypothesis import strategies as st
from properties import examples

FREE = ("provenance", "files", "schema")
"""Parts of report.json that are not drawn: the clock, and digests that the test itself makes right."""
UNKNOWN = [("scenario", "sha256")]
"""Not drawn: the digest of the scenario's file, which is not in the report."""
EQUIVALENT = ["selection"]
"""Not drawn: another basis of the same directions is the same proposal. That there are fewer is a named tampering."""
TABLES = ("signals", "decisions", "problems", "proposals")


@pytest.mark.slow
@pytest.mark.parametrize("name", TAMPERINGS)
def test_a_tampered_report_is_refused(report: Path, name: str) -> None:
    tampering = TAMPERINGS[name]
    outcome = attempt(report, tampering.edit, mended=tampering.mended)
    assert outcome.is_of(tampering), (outcome.code, outcome.refused, outcome.error)
    assert all(line["rule"] and line["text"] for line in outcome.refused)


@pytest.mark.parametrize(
    ("name", "rule"),
    [("position_changed", "law of motion"), ("table_in_other_bytes_digest_left", "SHA-256 of a table")],
    ids=["position_changed", "table_in_other_bytes_digest_left"],
)
def test_the_checker_itself_names_the_broken_rule(report: Path, name: str, rule: str) -> None:
    refused = attempt(report, TAMPERINGS[name].edit).refused
    assert ("checker", rule) in [(line["by"], line["rule"]) for line in refused]


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of every value of a JSON document that has no parts."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        yield from leaves(part, (*path, key)) if isinstance(part, (dict, list)) else [(*path, key)]


def items(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of every item of a list in a JSON document."""
    for key, part in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        if isinstance(value, list):
            yield (*path, key)
        yield from items(part, (*path, key))


def container(value: Any, path: tuple[Any, ...]) -> Any:
    """What holds the value at a place."""
    for key in path[:-1]:
        value = value[key]
    return value


def changed(value: Any, others: Sequence[Any] = ()) -> Any:
    """Another value of the same kind, farther away than any tolerance; a text becomes one of the others, if any."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1 if isinstance(value, int) else value * 1.01 + 1e-3
    if isinstance(value, np.ndarray):
        return np.append(value, 1.0) if not len(value) else value * 1.01 + 1e-3
    return next((other for other in others if other != value), f"{value}, they say")


SHARE = st.floats(0.0, 1.0, exclude_max=True)
"""Which of several, as a share of their number."""


@examples(40, fuzz=2000)
@given(place=SHARE)
def test_any_changed_value_of_the_report_is_refused(report: Path, place: float) -> None:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            places = [
                path
                for path in leaves(document)
                if path[0] not in FREE and path not in UNKNOWN and path[-1] != "from_cache"
            ]
            path = places[int(place * len(places))]
            part = container(document, path)
            part[path[-1]] = changed(part[path[-1]])

    assert attempt(report, edit).code


@pytest.mark.slow
@examples(15, fuzz=1000)
@given(place=SHARE, twice=st.booleans())
def test_any_item_of_the_report_that_is_left_out_or_doubled_is_refused(report: Path, place: float, twice: bool) -> None:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            places = [path for path in items(document) if path[0] not in FREE]
            path = places[int(place * len(places))]
            part = container(document, path)
            if twice:
                part.insert(path[-1], part[path[-1]])
            else:
                del part[path[-1]]

    assert attempt(report, edit).code


@pytest.mark.slow
@examples(15, fuzz=1000)
@given(run=st.sampled_from("bcd"), place=SHARE)
def test_any_value_of_a_run_that_is_changed_in_both_its_places_is_refused(report: Path, run: str, place: float) -> None:
    """In meta.json, and where report.json says the same."""

    def edit(folder: Path) -> None:
        with edited_entries(folder, run) as (entry, meta):
            places = [path for path in leaves(meta) if path[0] not in (*FREE, "scenario")]
            path = places[int(place * len(places))]
            here = container(meta, path)
            if path[0] in entry:
                container(entry, path)[path[-1]] = changed(here[path[-1]])
            here[path[-1]] = changed(here[path[-1]])

    assert attempt(report, edit).code


@examples(30, fuzz=500)
@given(run=st.sampled_from("bcd"), table=st.sampled_from(TABLES), column=SHARE, row=SHARE, all_rows=st.booleans())
@example(run="b", table="proposals", column=0.0, row=0.0, all_rows=False)  # its number, which no decision refers to
def test_any_changed_cell_or_column_of_a_trace_is_refused(
    report: Path, run: str, table: str, column: float, row: float, all_rows: bool
) -> None:
    if not len(read_table(report, table, run)):
        return

    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            columns = frame.columns.drop(EQUIVALENT, errors="ignore")
            name, cell = columns[int(column * len(columns))], int(row * len(frame))
            values = frame[name].tolist()
            for k in range(len(frame)) if all_rows else [cell]:
                values[k] = changed(values[k], values)
            frame[name] = values

    assert attempt(report, edit).code


@pytest.mark.slow
@examples(15, fuzz=500)
@given(run=st.sampled_from("bcd"), table=st.sampled_from(TABLES), row=SHARE, how=st.sampled_from("-+xz"))
def test_any_row_of_a_trace_that_is_missing_or_elsewhere_is_refused(
    report: Path, run: str, table: str, row: float, how: str
) -> None:
    """One row is left out (-), is there twice (+), changes its place with the next one (x), or all are left out (z)."""
    frame = read_table(report, table, run)
    if len(frame) < (2 if how == "x" else 1):
        return
    k = int(row * (len(frame) - (how == "x")))
    rows = {
        "-": [*range(k), *range(k + 1, len(frame))], "+": [*range(k + 1), *range(k, len(frame))], "z": [],
        "x": [*range(k), *reversed(range(k, min(k + 2, len(frame)))), *range(k + 2, len(frame))],
    }[how]  # fmt: skip
    assert attempt(report, lambda folder: write_table(folder, frame.iloc[rows], table, run)).code


@examples(8, fuzz=500)
@given(file=SHARE, missing=st.booleans())
def test_any_file_that_is_missing_or_has_other_bytes_is_refused(report: Path, file: float, missing: bool) -> None:
    """The list of files has what was there; of a file of a run that is missing, it is made right."""

    def edit(folder: Path) -> None:
        files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "report.json")
        path = files[int(file * len(files))]
        if missing:
            path.unlink()
        else:
            write(path, path.read_bytes() + b" ")
        if missing and "trace" in path.parts:
            mend(folder)

    assert attempt(report, edit, mended=False).code


def test_numbers_that_differ_by_rounding_only_agree(report: Path) -> None:
    """Another version of numpy or of a solver gives other last digits; pages are of the report that they show."""

    def edit(folder: Path) -> None:
        for page in ("report.html", "junit.xml"):
            (folder / page).unlink()
        with edited_report(folder) as document:
            for path in leaves(document["claims"]):
                part = container(document["claims"], path)
                if isinstance(part[path[-1]], float):
                    part[path[-1]] = math.nextafter(part[path[-1]], math.inf)

    assert attempt(report, edit).code == 0


def test_a_copy_that_was_tampered_with_is_mended(report: Path, tmp_path: Path) -> None:
    folder = copy(report, tmp_path)
    TAMPERINGS["position_changed"].edit(folder)
    TAMPERINGS["trace_folder_added"].edit(folder)
    (folder / "trace" / "d" / "timings.json").unlink()
    copy(report, folder)
    kept = {path.relative_to(folder): path for path in folder.rglob("*")}
    assert set(kept) == {path.relative_to(report) for path in report.rglob("*")}
    assert all(path.is_dir() or path.samefile(report / name) for name, path in kept.items())
