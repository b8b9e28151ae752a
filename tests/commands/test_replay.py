"""`airground replay`: pages and videos of a report's runs, and what it refuses."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from airground_drake.commands import main


def test_a_page_for_each_run(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(folder), "-o", str(tmp_path / "out")]) == 0
    written = sorted((tmp_path / "out").iterdir())
    assert [path.name for path in written] == ["replay_c.html", "replay_d.html"]
    assert capsys.readouterr().out.split() == [str(path) for path in written]
    assert all("Meshcat" in path.read_text() for path in written)


def test_one_run_in_this_folder(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["replay", str(folder), "d"]) == 0
    assert [path.name for path in tmp_path.glob("*.html")] == ["replay_d.html"]


def test_one_run_in_a_file_of_this_name(folder: Path, tmp_path: Path) -> None:
    assert main(["replay", str(folder), "d", "-o", str(tmp_path / "new" / "x.html")]) == 0
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["x.html"]
    assert (tmp_path / "new" / "x.html").is_file()


def test_a_page_is_replaced_by_its_own_report_only(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    page, place = tmp_path / "out" / "replay_d.html", ["-o", str(tmp_path / "out")]
    assert main(["replay", str(folder), "d", *place]) == 0
    before = page.read_bytes()
    capsys.readouterr()
    assert main(["replay", str(other), "d", *place]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {page} is not a replay of this run of {other}; it is left alone")
    assert error.count("\n") == 1
    assert main(["replay", str(folder), "c", "-o", str(page)]) == 2
    assert page.read_bytes() == before
    page.write_text("mine")
    assert main(["replay", str(folder), "d", *place]) == 2
    assert page.read_text() == "mine"
    page.write_bytes(before)
    assert main(["replay", str(folder), "d", *place]) == 0
    assert page.read_bytes()[-90:] == before[-90:]


def test_a_video(folder: Path, tmp_path: Path) -> None:
    assert main(["replay", str(folder), "d", "--video", str(tmp_path / "d.webp"), "--speed", "100"]) == 0
    assert (tmp_path / "d.webp").read_bytes()[8:12] == b"WEBP"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{folder}", "x"], "unknown run 'x'; allowed: c, d"),
        (["{folder}/trace"], "is no report"),
        (["{folder}/missing"], "is no report"),
        (["{folder}", "-o", "{folder}"], "is in the report"),
        (
            ["{folder}", "-o", "{folder}.txt"],
            "report.txt cannot be written: File exists; wanted: a folder for the pages",
        ),
        (["{folder}", "-o", "{folder}.html"], "report.html is one file for the runs c, d; name a RUN, or a folder"),
        (["{folder}", "d", "--video", "{folder}/trace/d.webp"], "is in the report"),
        (["{folder}", "d", "--video", "d.avi"], "allowed: names that end in .webp or .mp4"),
    ],
)
def test_what_is_refused(folder: Path, arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder.with_suffix(".txt").write_text("mine")
    before = sorted(folder.rglob("*"))
    assert main(["replay", *(each.format(folder=folder) for each in arguments)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert says in error
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    "extra",
    [
        "--video x.webp",
        "d --video x.webp --speed nan",
        "d --video x.webp --live",
        "d --video x.webp -o out",
        "--live -o .",
        "--speed 2",
    ],
)
def test_usage(folder: Path, extra: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(folder), *extra.split()])
    assert ended.value.code == 2


def test_a_report_without_runs_and_a_trace_that_was_changed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "trace" / "d" / "signals.parquet").write_bytes(b"else")
    assert main(["replay", str(folder), "d", "-o", str(folder.parent)]) == 2
    assert "SHA-256" in capsys.readouterr().err
    shutil.rmtree(folder / "trace")
    assert main(["replay", str(folder), "-o", str(folder.parent)]) == 2
    assert "has no runs to replay" in capsys.readouterr().err
