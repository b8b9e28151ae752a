"""Files that are made to hang a command or to fill the memory are refused in one line, or left out."""

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
from commands.conftest import Airground
from report.cases import FINE, GOING_ROUND, SUCCESS, built, make_scenario, make_trace, make_traces

from airground_drake.base import files
from airground_drake.base.errors import FolderError
from airground_drake.scenario.load import resolved
from airground_drake.sim import trace
from airground_drake.study.campaign import store
from airground_drake.verify.proofs.runs import prove_report

ROWS = 1_000_000
FILES: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "kernel": lambda path: path.symlink_to("/proc/kmsg"),  # its type is that of a regular file, and reading it waits
    "sparse": lambda path: (path.touch(), os.truncate(path, 1 << 40))[1],
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


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, scenario = tmp_path_factory.mktemp("honest"), make_scenario()
    (folder / "report.json").write_text(json.dumps(built(scenario, make_traces(scenario), FINE)))
    made = make_trace(scenario, "c", GOING_ROUND, SUCCESS)
    made.meta.update(scenario=resolved(scenario), schema=trace.SCHEMA)
    trace.save(made, folder / "trace" / "c")
    return folder


@pytest.fixture
def hostile(honest: Path, tmp_path: Path) -> Path:
    return shutil.copytree(honest, tmp_path / "reports" / "hostile")


@pytest.fixture(autouse=True)
def _ends() -> Iterator[None]:
    def over(*_: object) -> None:
        raise AssertionError("it hangs")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(120)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("kind", FILES)
def test_a_report_json(kind: str, honest: Path, hostile: Path, airground: Airground) -> None:
    (hostile / "report.json").unlink()
    FILES[kind](hostile / "report.json")
    for pair in ((honest, hostile), (hostile, honest)):
        assert "report.json is not a report" in airground("compare", *pair, code=2)
    assert "no reports" in airground("index", hostile.parent, code=2)
    assert "is not a report" in airground("replay", hostile, "-o", hostile.parent, code=2)
    (hostile / "notes.txt").touch()
    assert "and no report" in airground("report", "minimal", "-o", hostile, code=2)


@pytest.mark.parametrize(
    ("name", "kind"),
    [("meta.json", "pipe"), ("timings.json", "device"), *(("states.parquet", kind) for kind in FILES)],
)
def test_a_file_of_a_trace(name: str, kind: str, hostile: Path, airground: Airground) -> None:
    run = hostile / "trace" / "c"
    (run / name).unlink()
    FILES[kind](run / name)
    airground("verify", run, "SAFE-TRACE", code=2)
    airground("replay", hostile, "c", "-o", hostile.parent, code=2)
    airground("index", hostile.parent)
    assert "no trace" in (hostile.parent / "index.html").read_text()


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_that_is_small_until_it_is_read(
    kind: str, hostile: Path, airground: Airground, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "MOST_UNPACKED", 100 * ROWS)
    run = hostile / "trace" / "c"
    path, meta = run / "decisions.parquet", json.loads((run / "meta.json").read_text())
    pq.write_table(TABLES[kind](), path, compression="zstd", store_schema=False)
    meta["files"][path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    (run / "meta.json").write_text(json.dumps(meta))
    assert "no table that can be used" in airground("verify", run, "SAFE-TRACE", code=2)


def test_a_trace_is_of_its_own_files(hostile: Path, airground: Airground) -> None:
    path = hostile / "trace" / "c" / "meta.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"files": {"/dev/zero": ""}}))
    assert "states.parquet" in airground("verify", path.parent, "SAFE-TRACE", code=2)


@pytest.mark.parametrize("kind", FILES)
def test_a_page_in_the_place_of_a_list(kind: str, hostile: Path, airground: Airground) -> None:
    FILES[kind](hostile.parent / "index.html")
    said = airground("index", hostile.parent, code=0 if kind == "itself" else 2)  # a link to itself is not a file
    assert "index.html" in said


def test_a_pipe_as_a_scenario_is_empty_unless_somebody_writes(tmp_path: Path, airground: Airground) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert "empty" in airground("verify", tmp_path / "pipe", code=2)
    reader, writer = os.pipe()
    os.write(writer, b"version: 3\n")
    os.close(writer)
    assert "version" in airground("verify", f"/dev/fd/{reader}", code=2)
    os.close(reader)


@pytest.mark.parametrize("kind", [*FILES, "link"])
@pytest.mark.parametrize("name", [store.JOURNAL, store.MANIFEST, "parts/part-000000.parquet"])
def test_a_campaign_is_resumed_from_its_own_files_only(kind: str, name: str, tmp_path: Path) -> None:
    """Nothing of it waits, and a link in it is not followed: its target stays as it is."""
    folder, path = tmp_path / "campaign", tmp_path / "campaign" / name
    store.Store(folder, {"name": "x"}, resume=False).close()
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_text("torn line")
    (FILES | {"link": lambda path: path.symlink_to(elsewhere)})[kind](path)
    for reading in (lambda: store.Store(folder, {"name": "x"}, resume=True), lambda: store.read(folder)):
        with pytest.raises(FolderError):
            reading()
    assert elsewhere.read_text() == "torn line"


def test_a_folder_of_a_campaign_or_of_proofs_is_no_link(hostile: Path, tmp_path: Path) -> None:
    store.Store(tmp_path / "campaign", {"name": "x"}, resume=False).close()
    (tmp_path / "campaign" / store.PARTS).symlink_to(tmp_path)
    with pytest.raises(FolderError, match="parts is a link"):
        store.Store(tmp_path / "campaign", {"name": "x"}, resume=True)
    (hostile / "proofs").symlink_to(tmp_path)
    with pytest.raises(FolderError, match="proofs is a link"):
        next(prove_report(hostile))


@pytest.mark.parametrize("part", ["trace", "trace/c"])
def test_no_command_reads_a_run_through_a_link(part: str, hostile: Path, tmp_path: Path, airground: Airground) -> None:
    elsewhere = (hostile / part).rename(tmp_path / "elsewhere")
    (hostile / part).symlink_to(elsewhere)
    for command in (["replay"], ["export", "--to", "csv"], ["export", "--to", "mcap"], ["figures"]):
        assert "is a link" in airground(*command, hostile, "-o", tmp_path / "out", code=2)
    with pytest.raises(FolderError, match="is a link"):
        next(prove_report(hostile))
    assert "is a link" in airground("index", hostile.parent, code=2)
    assert "a report has regular files and folders only" in airground("check", hostile, code=2)
    assert not [*tmp_path.glob("out/*")]


def test_names_of_files_control_no_terminal(honest: Path, tmp_path: Path, airground: Airground) -> None:
    reports = tmp_path / "re\x1b[2Jports\u202e"
    shutil.copytree(honest, reports / "a")
    for command in (["replay"], ["export", "--to", "csv"]):
        said = airground(*command, honest, "-o", reports / "out")
        assert "re\\x1b[2Jports\\u202e" in said
        assert all(line.isprintable() for line in said.splitlines())
    assert airground("index", reports).strip().isprintable()
    rows = [f"{t},{name},{t},0,9" for t in range(3) for name in ("ugv1", "\x1b[31m", "\x9b31m")]
    (tmp_path / "log.csv").write_text("\n".join(["t,body,x,y,\x1b[2J", *rows]))
    said = airground("judge", tmp_path / "log.csv", "--scenario", "minimal")
    assert all(line.isprintable() for line in said.splitlines())


def test_nothing_is_written_through_a_link_or_over_a_pipe(honest: Path, hostile: Path, airground: Airground) -> None:
    elsewhere = (hostile / "trace").rename(hostile.parent / "elsewhere")
    (hostile / "trace").symlink_to(elsewhere)
    assert "'trace', which is in the way" in airground("report", "minimal", "-o", hostile, code=2)
    assert (elsewhere / "c" / "meta.json").exists()
    os.mkfifo(hostile / "page")
    airground("compare", honest, honest, "--html", hostile / "page", code=2)
    assert (hostile / "page").is_fifo()
