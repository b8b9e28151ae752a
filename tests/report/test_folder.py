"""A report is written only where nothing else is."""

import subprocess
import sys
from pathlib import Path

import pytest

from airground_drake.base.errors import FolderError
from airground_drake.report import folder, model

OURS = f'{{\n "schema": "{model.SCHEMA}",\n "scenario": {{}}}}'


def fill(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def content(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "holds",
    [
        {},
        {"report.json": OURS, "notes.txt": "mine", "trace/notes.txt": "mine"},
        {"report.html": "", "diagram.svg": "", "trace/d/meta.json": "", "proofs/proofs.json": ""},
        {"diagram.dot": "", ".report.json.999999.abcdefgh.partial": ""},
    ],
)
def test_new_empty_and_own_folders_are_taken(holds: dict[str, str], tmp_path: Path) -> None:
    fill(tmp_path, holds)
    folder.prepare(tmp_path)
    assert content(tmp_path) == {name: text for name, text in holds.items() if not name.endswith(".partial")}
    folder.prepare(tmp_path / "new" / "one")
    assert (tmp_path / "new" / "one").is_dir()


@pytest.mark.parametrize(
    ("holds", "why"),
    [
        ({"thesis.tex": ""}, "and no report"),
        ({"report.json": '{"schema": "other.report/1"}', "x": ""}, "and no report"),
        ({"diagram.svg": "", "x\n\u202e": ""}, "and no report"),
        ({"trace/d/states.parquet": "", "trace/d/notes.txt": "mine"}, "and no report"),
        ({"proofs/notes.txt": "mine"}, "and no report"),
        ({"report.json": OURS, "trace": ""}, "in the way"),
        ({"report.json": OURS, "diagram.svg/x": ""}, "in the way"),
    ],
)
def test_a_folder_that_holds_something_else_is_left_alone(holds: dict[str, str], why: str, tmp_path: Path) -> None:
    fill(tmp_path, holds)
    with pytest.raises(FolderError, match=f"{why}; it must be new, empty") as refused:
        folder.prepare(tmp_path)
    assert str(refused.value).isprintable()
    assert content(tmp_path) == holds


def test_a_link_to_a_folder_elsewhere_is_in_the_way(tmp_path: Path) -> None:
    fill(tmp_path, {"elsewhere/d/meta.json": "mine", "out/report.json": OURS})
    (tmp_path / "out" / "trace").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FolderError, match="in the way"):
        folder.prepare(tmp_path / "out")


def test_nothing_stays_of_an_old_report_and_everything_else_does(tmp_path: Path) -> None:
    old = (
        "report.html", "report.json", "junit.xml", "diagram.svg", "trace/d/meta.json", "trace/killed/states.parquet",
        "proofs/proofs.json", "proofs/run_d.v",
    )  # fmt: skip
    mine = {"notes.txt": "a", "trace/d/notes.txt": "b", "certificates/ssl/key.pem": "c", "report.html.bak": "d"}
    fill(tmp_path, {**dict.fromkeys(old, ""), **mine})
    folder.clear(tmp_path)
    assert content(tmp_path) == mine
    assert not (tmp_path / "proofs").exists()


def test_two_reports_at_once_do_not_mix_and_a_killed_one_leaves_the_folder_to_others(tmp_path: Path) -> None:
    program = "import sys, time; from pathlib import Path; from airground_drake.report import folder\n"
    program += "with folder.held(Path(sys.argv[1])): print(flush=True); time.sleep(600)"
    process = subprocess.Popen([sys.executable, "-c", program, tmp_path / "out"], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        with pytest.raises(FolderError, match="out is in use by another report"), folder.held(tmp_path / "out"):
            pass
        with folder.held(tmp_path / "other"):
            assert list((tmp_path / "out").iterdir()) == []
    finally:
        process.kill()
        process.communicate()
    with folder.held(tmp_path / "out"):
        pass


def test_a_folder_that_cannot_be_had_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(FolderError, match=r"file.* cannot be written: .*; wanted: a folder"):
            folder.prepare(path)
