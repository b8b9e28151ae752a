"""`airground export`: which files it writes, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from airground_drake.commands import main

TABLES = ("decisions", "events", "problems", "proposals", "signals")


@pytest.mark.parametrize(("kind", "names"), [
    ("csv", [f"{run}_{name}.csv" for run in "cd" for name in TABLES]),
    ("mcap", ["c.mcap", "d.mcap"]),
])  # fmt: skip
def test_files_of_all_runs(
    folder: Path, tmp_path: Path, kind: str, names: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["export", str(folder), "--to", kind, "-o", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == names
    assert sorted(capsys.readouterr().out.split()) == [str(out / name) for name in names]


def test_one_run(folder: Path, tmp_path: Path) -> None:
    assert main(["export", str(folder), "d", "--to", "mcap", "-o", str(tmp_path / "out")]) == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["d.mcap"]


def test_what_cannot_be_written_is_refused(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, says in (
        ([str(folder), "x"], "unknown run 'x'"),
        ([str(tmp_path / "none")], "none is no report"),
        ([str(folder), "-o", str(folder)], "is in the report"),
    ):
        assert main(["export", *arguments, "--to", "csv"]) == 2
        assert says in capsys.readouterr().err
