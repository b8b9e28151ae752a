"""`airground replay`: pages and videos of a report's runs."""

import shutil
from pathlib import Path

import pytest
from commands.conftest import Airground


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("report -o out", ["out/replay_c.html", "out/replay_d.html"]),
        ("report d", ["replay_d.html"]),
        ("report d -o new/x.html", ["new/x.html"]),
    ],
)
def test_pages(
    words: str, names: list[str], folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, airground: Airground
) -> None:
    monkeypatch.chdir(tmp_path)
    assert airground("replay", *words.split()).split() == names
    assert sorted(map(str, Path().glob("*/*.html"))) + sorted(map(str, Path().glob("*.html"))) == names
    assert all("Meshcat" in Path(name).read_text() for name in names)


def test_a_page_is_replaced_by_its_own_report_only(folder: Path, tmp_path: Path, airground: Airground) -> None:
    other = shutil.copytree(folder, tmp_path / "other")
    page, place = tmp_path / "out" / "replay_d.html", ("-o", tmp_path / "out")
    airground("replay", folder, "d", *place)
    before = page.read_bytes()
    why = f"error: {page} is not a replay of this run of {other}; it is left alone"
    assert airground("replay", other, "d", *place, code=2).startswith(why)
    airground("replay", folder, "c", "-o", page, code=2)
    assert page.read_bytes() == before
    page.write_text("mine")
    airground("replay", folder, "d", *place, code=2)
    assert page.read_text() == "mine"
    page.write_bytes(before)
    airground("replay", folder, "d", *place)
    assert page.read_bytes()[-90:] == before[-90:]


def test_a_video(folder: Path, tmp_path: Path, airground: Airground) -> None:
    airground("replay", folder, "d", "--video", tmp_path / "d.webp", "--speed", 100)
    assert (tmp_path / "d.webp").read_bytes()[8:12] == b"WEBP"


def test_a_report_without_runs_and_a_changed_trace_are_refused(folder: Path, airground: Airground) -> None:
    (folder / "trace" / "d" / "states.parquet").write_bytes(b"else")
    assert "SHA-256" in airground("replay", folder, "d", "-o", folder.parent, code=2)
    shutil.rmtree(folder / "trace")
    assert "has no runs to replay" in airground("replay", folder, "-o", folder.parent, code=2)
