"""`airground export`: which files it writes."""

import json
from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.sim.tables import TABLES

COMMANDS = ("export DIR c --to csv", "export DIR c --to mcap", "replay DIR c", "figures DIR", "prove DIR")
"""Commands that name files after a run."""
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


@pytest.mark.parametrize("run", ["../../elsewhere", "/tmp/elsewhere", "d"])
@pytest.mark.parametrize("words", COMMANDS)
def test_no_file_is_named_after_what_a_trace_says_of_its_run(
    words: str, run: str, folder: Path, tmp_path: Path, airground: Airground, monkeypatch: pytest.MonkeyPatch
) -> None:
    meta = folder / "trace" / "c" / "meta.json"
    meta.write_text(json.dumps(json.loads(meta.read_text()) | {"run": run}))
    before = sorted(tmp_path.rglob("*"))
    (here := tmp_path / "a" / "b").mkdir(parents=True)
    monkeypatch.chdir(here)
    said = airground(*words.replace("DIR", str(folder)).split(), code=2)
    assert f"its run is {run!r}" in said
    assert {*tmp_path.rglob("*")} - {*before} <= {here, here.parent, here / "figures"}
