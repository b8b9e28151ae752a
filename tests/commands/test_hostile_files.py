"""Files that are made to hang a command or to fill the memory are one line, or are left out."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from report.cases import FINE, GOING_ROUND, SUCCESS, built, make_scenario, make_trace, make_traces

from airground_drake.base import files
from airground_drake.commands import main
from airground_drake.run import trace
from airground_drake.scenarios.load import resolved

ROWS = 1_000_000


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report with the trace of one of its runs."""
    folder, scenario = tmp_path_factory.mktemp("honest"), make_scenario()
    document = built(scenario, make_traces(scenario), FINE)
    (folder / "report.json").write_text(json.dumps(document))
    made = make_trace(scenario, "c", GOING_ROUND, SUCCESS)
    made.meta.update(scenario=resolved(scenario), schema=trace.SCHEMA)
    trace.save(made, folder / "trace" / "c")
    return folder


@pytest.fixture(autouse=True)
def _ends() -> Iterator[None]:
    """What hangs fails."""

    def over(*_: object) -> None:
        raise AssertionError("it hangs")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(120)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(1 << 40)


FILES: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "kernel": lambda path: path.symlink_to("/proc/kmsg"),  # its type is that of a regular file, and reading it waits
    "sparse": sparse,
    "itself": lambda path: path.symlink_to(path),
}
TABLES: dict[str, Callable[[], pa.Table]] = {
    "a long text in every row": lambda: pa.table(
        {"robot": pa.DictionaryArray.from_arrays(pa.array([0] * ROWS, pa.int32()), pa.array(["x" * ROWS]))}
    ),
    "long texts": lambda: pa.table({"robot": pa.array(["x" * 30 * ROWS] * 4)}),
    "many cells": lambda: pa.table({f"c{k}": pa.nulls(50 * ROWS) for k in range(2)}),
    "structures": lambda: pa.table({"t_s": pa.array([{"a": 1}])}),
}


@pytest.fixture
def hostile(honest: Path, tmp_path: Path) -> Path:
    """To be changed."""
    return shutil.copytree(honest, tmp_path / "reports" / "hostile")


def refused(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """The one line with which a command refuses."""
    assert main([str(each) for each in arguments]) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    return said.err


@pytest.mark.parametrize("kind", FILES)
def test_a_report_json(kind: str, honest: Path, hostile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (hostile / "report.json").unlink()
    FILES[kind](hostile / "report.json")
    for pair in ((honest, hostile), (hostile, honest)):
        assert "report.json is no report" in refused(capsys, "compare", *pair)
    assert "no reports" in refused(capsys, "index", hostile.parent)
    assert "no report" in refused(capsys, "replay", hostile, "-o", hostile.parent)
    (hostile / "notes.txt").touch()
    assert "and no report" in refused(capsys, "report", "minimal", "-o", hostile)


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("name", ["meta.json", "timings.json", "signals.parquet"])
def test_a_file_of_a_trace(
    name: str, kind: str, honest: Path, hostile: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = hostile / "trace" / "c"
    (run / name).unlink()
    FILES[kind](run / name)
    refused(capsys, "verify", run, "SAFE-TRACE")
    if (run / "meta.json").exists():
        refused(capsys, "replay", hostile, "c", "-o", hostile.parent)
    assert main(["index", str(hostile.parent)]) == 0
    assert "no trace" in (hostile.parent / "index.html").read_text()
    page = hostile.parent / "changes.html"
    assert main(["compare", str(honest), str(hostile), "--html", str(page)]) == 0
    assert "Run c cannot be drawn" in page.read_text()


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_that_is_small_until_it_is_read(
    kind: str, hostile: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "MOST_UNPACKED", 100 * ROWS)
    run = hostile / "trace" / "c"
    path, meta = run / "decisions.parquet", json.loads((run / "meta.json").read_text())
    pq.write_table(TABLES[kind](), path, compression="zstd", store_schema=False)
    meta["files"][path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    (run / "meta.json").write_text(json.dumps(meta))
    assert "no table that can be used" in refused(capsys, "verify", run, "SAFE-TRACE")


def test_a_trace_is_of_its_own_files(hostile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    meta = json.loads((hostile / "trace" / "c" / "meta.json").read_text())
    meta["files"] = {"/dev/zero": ""}
    (hostile / "trace" / "c" / "meta.json").write_text(json.dumps(meta))
    assert "signals.parquet" in refused(capsys, "verify", hostile / "trace" / "c", "SAFE-TRACE")


@pytest.mark.parametrize("kind", FILES)
def test_a_page_in_the_place_of_a_list(kind: str, hostile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    FILES[kind](hostile.parent / "index.html")
    if kind == "itself":  # no file at all, and so replaced
        assert main(["index", str(hostile.parent)]) == 0
    else:
        assert "index.html" in refused(capsys, "index", hostile.parent)


def test_a_pipe_as_a_scenario_is_empty_unless_somebody_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert "empty" in refused(capsys, "verify", tmp_path / "pipe")
    reader, writer = os.pipe()
    os.write(writer, b"version: 3\n")
    os.close(writer)
    assert "version" in refused(capsys, "verify", f"/dev/fd/{reader}")
    os.close(reader)


def test_a_report_is_not_written_through_a_link(hostile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    elsewhere = (hostile / "trace").rename(hostile.parent / "elsewhere")
    (hostile / "trace").symlink_to(elsewhere)
    assert "'trace', which is in the way" in refused(capsys, "report", "minimal", "-o", hostile)
    assert (elsewhere / "c" / "meta.json").exists()


def test_a_page_does_not_take_the_place_of_a_device(honest: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "page")
    assert main(["compare", str(honest), str(honest), "--html", str(tmp_path / "page")]) == 2
    assert (tmp_path / "page").is_fifo()
