"""Forgeries of a report are refused: by the checker, by the report made again, or by the runs simulated again."""

import ast
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.nested import places
from check import concerted
from check.concerted import FORGERIES, PROGRAMS, make, refused_by, simulating_once
from check.forgeries import HOSTILE, RULES, UNMENDED
from check.forging import attempt, edited_report, edited_table, forged, mend, read_table, write, write_table
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from sharing import once

from airground_drake import check

FREE = ("provenance", "files", "schema")
"""Parts of report.json that are not drawn: the clock, and digests that the test itself makes right."""
UNREAD = (".triggered_at_s", ".released_at_s", ".triggers", ".executing", ".ref_vx_m_s", ".ref_vy_m_s", ".ref_vz_m_s")
"""Columns of the states and samples that the checker does not read."""


@pytest.mark.parametrize("name", RULES)
def test_each_rule_of_the_checker_refuses_what_it_is_for(report: Path, name: str) -> None:
    rule, edit = RULES[name]
    code, said = attempt(report, edit, mended=name not in UNMENDED)
    assert code
    assert f": {rule}" in said


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused(report: Path, name: str) -> None:
    rule, edit = HOSTILE[name]
    code, said = attempt(report, edit, mended=False)
    assert code
    assert rule in said


@pytest.fixture(scope="module", name="whole")
def with_third_party_code(shared: Path) -> Iterator[Path]:
    """The report that is forged below; each scenario is simulated again once."""
    with pytest.MonkeyPatch.context() as patch:
        simulating_once(patch)
        yield once(shared / "whole", make)


@pytest.mark.slow
def test_a_report_with_third_party_code_is_refused_by_nobody(whole: Path) -> None:
    assert refused_by(whole) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", FORGERIES)
def test_the_programs_that_are_due_refuse_a_forgery(whole: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    due, edit = FORGERIES[name]
    if due == "iii":  # which looks at no verdict and no page
        monkeypatch.setattr(concerted, "follow", lambda _: None)
    programs = due.split(", ") if due else PROGRAMS
    assert [*refused_by(forged(whole, edit), programs)] == (programs if due else [])


def test_every_rule_of_the_checker_has_a_forgery() -> None:
    said = {rule for rule, _ in (*RULES.values(), *HOSTILE.values())}
    said |= {"way of an obstacle", "declared speed", "passive law"}  # nothing moves there: `test_moving` forges these
    said |= {f"{what} of a body" for what in ("place", "heading", "velocity")}  # these `test_plants` forges,
    said |= {"safe start of the bodies", "never backwards", "least turning radius"}  # and these
    said |= {"error of the measured position", "gain for errors"}  # and these
    said |= {"announced position", "standing without a message"}  # and these `test_positions`
    said |= {"position heard before"}  # and this `test_old_positions`
    said |= {f"{what} of a plant" for what in ("drift", "cover")}  # and these `test_own_plants`
    for path in Path(check.__file__).parent.glob("*.py"):
        for call in (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)):
            called = getattr(call.func, "id", "")
            if called in ("same", "close", "holds", "Disagreement") and isinstance(call.args[0], ast.Constant):
                assert call.args[0].value in said, path.name


def leaves(value: Any) -> list[tuple[tuple[Any, ...], Any]]:
    return [(path, part) for path, part in places(value) if not isinstance(part[path[-1]], (dict, list))]


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


@examples(20, fuzz=2000)
@given(place=SHARE)
def test_any_changed_value_of_the_report_is_refused(report: Path, place: float) -> None:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            drawn = [each for each in leaves(document) if each[0][0] not in FREE and each[0][-1] != "from_cache"]
            path, part = drawn[int(place * len(drawn))]
            part[path[-1]] = changed(part[path[-1]])

    assert attempt(report, edit)[0]


@examples(15, fuzz=1000)
@given(place=SHARE, twice=st.booleans())
def test_any_item_of_the_report_that_is_left_out_or_doubled_is_refused(report: Path, place: float, twice: bool) -> None:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            items = [each for each in places(document) if isinstance(each[1], list) and each[0][0] not in FREE]
            path, part = items[int(place * len(items))]
            if twice:
                part.insert(path[-1], part[path[-1]])
            else:
                del part[path[-1]]

    assert attempt(report, edit)[0]


@examples(20, fuzz=500)
@given(
    run=st.sampled_from("bcd"), table=st.sampled_from(["states", "samples"]), column=SHARE, row=SHARE,
    all_rows=st.booleans(),
)  # fmt: skip
def test_any_changed_cell_or_column_that_the_checker_reads_is_refused(
    report: Path, run: str, table: str, column: float, row: float, all_rows: bool
) -> None:
    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            columns = [name for name in frame if not name.endswith(UNREAD)]
            name, cell = columns[int(column * len(columns))], int(row * len(frame))
            values = frame[name].tolist()
            for k in range(len(frame)) if all_rows else [cell]:
                values[k] = changed(values[k], values)
            frame[name] = values

    assert "checker: " in attempt(report, edit)[1]


@examples(15, fuzz=500)
@given(run=st.sampled_from("bcd"), row=SHARE, how=st.sampled_from("-+xz"))
def test_any_row_of_the_states_that_is_missing_or_elsewhere_is_refused(
    report: Path, run: str, row: float, how: str
) -> None:
    """One row is left out (-), is there twice (+), changes its place with the next one (x), or all are left out (z)."""
    frame = read_table(report, run=run)
    k = int(row * (len(frame) - (how == "x")))
    rows = {
        "-": [*range(k), *range(k + 1, len(frame))], "+": [*range(k + 1), *range(k, len(frame))], "z": [],
        "x": [*range(k), *reversed(range(k, min(k + 2, len(frame)))), *range(k + 2, len(frame))],
    }[how]  # fmt: skip
    assert attempt(report, lambda folder: write_table(folder, frame.iloc[rows], run=run))[0]


@examples(8, fuzz=500)
@given(page=st.sampled_from(["report.html", "junit.xml"]), place=SHARE)
def test_any_character_that_is_inserted_into_a_page_is_refused(report: Path, page: str, place: float) -> None:
    def edit(folder: Path) -> None:
        text = (folder / page).read_text(encoding="utf-8")
        at = int(place * len(text))
        write(folder / page, f"{text[:at]}x{text[at:]}".encode())

    assert attempt(report, edit)[0]


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

    assert attempt(report, edit, mended=False)[0]


def test_numbers_that_differ_by_rounding_only_agree(report: Path) -> None:
    """Another version of numpy or of a solver gives other last digits; pages are of the report that they show."""

    def edit(folder: Path) -> None:
        for page in ("report.html", "junit.xml"):
            (folder / page).unlink()
        with edited_report(folder) as document:
            for path, part in leaves(document["claims"]):
                if isinstance(part[path[-1]], float):
                    part[path[-1]] = math.nextafter(part[path[-1]], math.inf)

    assert attempt(report, edit) == (0, "")
