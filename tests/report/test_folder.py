"""A report is written only where nothing else is."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from airground_drake.errors import FolderError
from airground_drake.report import document, folder

OURS = f'{{\n "schema": "{document.SCHEMA}",\n "scenario": {{}}}}'


@pytest.mark.parametrize(
    "holds",
    [
        {},
        {"report.json": OURS, "notes.txt": "mine"},
        {"report.json": '{"schema": "airground_drake.report/1"}', ".git": ""},
        {"report.html": "", "diagram.svg": ""},
        {"diagram.dot": "", ".report.json.999999.abcdefgh.partial": ""},
    ],
)
def test_new_empty_and_own_folders_are_taken(holds: dict[str, str], tmp_path: Path) -> None:
    for name, text in holds.items():
        (tmp_path / name).write_text(text)
    folder.prepare(tmp_path)
    folder.prepare(tmp_path / "new" / "one")
    assert set(os.listdir(tmp_path)) == {name for name in holds if not name.endswith(".partial")} | {"new"}


@pytest.mark.parametrize(
    "holds",
    [
        {"thesis.tex": ""},
        {"report.json": "{}", "data.csv": ""},
        {"report.json": '{"schema": "other.report/1"}', "x": ""},
        {"trace": "", "x\n\u202e": ""},
    ],
)
def test_what_holds_something_else_is_left_alone(holds: dict[str, str], tmp_path: Path) -> None:
    for name, text in holds.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(FolderError, match="and no report; allowed: a folder that is new or empty") as refused:
        folder.prepare(tmp_path)
    assert str(refused.value).isprintable()
    assert {name: (tmp_path / name).read_text() for name in os.listdir(tmp_path)} == holds


def test_a_folder_that_cannot_be_had_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OSError, match="file"):
            folder.prepare(path)
