"""Figures as files, with captions, and tables in LaTeX."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.commands.figures import FORMATS, STYLES
from airground_drake.report.export import figures
from airground_drake.report.model import Claim, Report, ReproductionRow

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


TABLES = Report.model_construct(
    runs={"a": None, "d_2": None},
    claims=[
        Claim(id="SAFE-INV", run="", status="proved", exercised=None, **NO),
        Claim(id="ZENO-TRACE", run="a", status="holds", exercised=0, **NO),
        Claim(id="ZENO-TRACE", run="d_2", status="holds", exercised=3, **NO),
        Claim(id="SAFE-TRACE", run="a", status="refuted", exercised=4, **NO),
    ],
    reproduction=[
        ReproductionRow(id="A1", quantity="stall & 5 %", paper=[3.3, 5.1], ours=[3.36889, 5.10219], unit="m",
            status="not_reproduced"),
        ReproductionRow(id="A3", quantity="grows", paper=1.0, ours=0.0, unit="yes/no", status="calibrated"),
        ReproductionRow(id="A5", quantity="trigger", paper=14.45, ours=None, unit="s", status="not_reproduced"),
    ],
)  # fmt: skip


def rows(table: str) -> list[list[str]]:
    body = table.split("\\midrule\n")[1].split("\\bottomrule")[0]
    return [[cell.strip() for cell in re.split(r"(?<!\\)&", line.removesuffix(" \\\\"))] for line in body.splitlines()]


def test_a_row_per_claim_and_per_result_of_the_paper() -> None:
    table = figures.verdicts(TABLES)
    assert "claim & model & a & d\\_2 \\\\" in table
    assert rows(table) == [
        ["SAFE-INV", "proved", "", ""],
        ["ZENO-TRACE", "", "not tested", "holds"],
        ["SAFE-TRACE", "", "refuted", ""],
    ]
    assert rows(figures.reproduction(TABLES)) == [
        ["A1", r"stall \& 5 \%", "(3.3, 5.1) m", "(3.369, 5.102) m", "not reproduced"],
        ["A3", "grows", "yes", "no", "calibrated"],
        ["A5", "trigger", "14.45 s", "--", "not reproduced"],
    ]


@given(st.text())
def test_no_special_character_is_left(text: str) -> None:
    plain = re.sub(r"\\(text[a-z]+\{\}|ldots\{\}|[&%$#_{}])|\$\\[a-z]+\$|\$-\$", "", figures.escaped(text))
    assert not re.search(r"[\\~^<>|&%$#_{}\n]", plain)
