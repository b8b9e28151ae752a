"""Figures as files, and the captions that go with them."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.commands.figures import FORMATS, STYLES
from airground_drake.report.export import figures
from airground_drake.report.model import Claim, Report

NO: dict[str, Any] = {"as_expected": None, "evidence": {}, "inputs": {}}
REPORT = Report.model_construct(
    runs={"c": None},
    claims=[
        Claim(id="SAFE-TRACE", run="c", status="holds", exercised=7, **NO),
        Claim(id="SAFE-GATE", run="", status="proved", exercised=None, **NO),
        Claim(id="LIVE-GOAL", run="c", status="holds", exercised=0, **NO),
    ],
    reproduction=[],
)


def written(folder: Path, style: str, formats: Sequence[str]) -> dict[str, bytes]:
    trace = make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)
    folder.mkdir()
    paths = list(figures.write(REPORT, make_scenario(), {"c": trace}, folder, style, formats))
    assert sorted(paths) == sorted(folder.iterdir())
    return {path.name: path.read_bytes() for path in paths}


@pytest.mark.slow
def test_each_figure_in_each_format_twice_the_same(tmp_path: Path) -> None:
    first, again = (written(tmp_path / name, "ieee", FORMATS) for name in ("one", "two"))
    assert first == again
    assert {name for name in first if name.startswith("trajectories")} == {f"trajectories.{kind}" for kind in FORMATS}
    assert all(content.startswith(b"%PDF") for name, content in first.items() if name.endswith(".pdf"))


def test_captions_say_what_was_seen_and_what_is_established(tmp_path: Path) -> None:
    files = written(tmp_path / "out", "thesis", ["svg"])
    text = files["figures.tex"].decode()
    caption = re.search(r"caption\{(.*)\}\n  \\label\{fig:distances\}", text)
    assert caption is not None
    assert caption[1].endswith("SAFE-TRACE holds in run c. SAFE-GATE is proved.")
    assert "LIVE-GOAL" not in text  # nothing tested it
    shown = re.findall(r"includegraphics\[width=0.7\\linewidth\]\{(.*?)\}", text)
    assert all(f"{name}.svg" in files for name in shown)
    assert "reproduction.tex" not in files
    assert "SAFE-GATE & proved" in files["verdicts.tex"].decode()


def test_the_command_knows_the_styles() -> None:
    assert tuple(figures.STYLES) == STYLES
