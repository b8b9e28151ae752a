"""`airground export`: which files it writes."""

from __future__ import annotations

from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.run.tables import TABLES

NAMES = sorted([*TABLES, "distances", "events"])


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("--to csv", [f"{run}_{name}.csv" for run in "cd" for name in NAMES]),
        ("--to mcap", ["c.mcap", "d.mcap"]),
        ("d --to mcap", ["d.mcap"]),
    ],
)
def test_files_of_the_runs(words: str, names: list[str], folder: Path, tmp_path: Path, airground: Airground) -> None:
    out = tmp_path / "out"
    said = airground("export", folder, *words.split(), "-o", out)
    assert sorted(path.name for path in out.iterdir()) == names
    assert sorted(said.split()) == [str(out / name) for name in names]
