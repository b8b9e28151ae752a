"""Tables in LaTeX."""

import re
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from airground_drake.report.export import figures
from airground_drake.report.model import Claim, Report, ReproductionRow

NO: dict[str, Any] = {"as_expected": None, "evidence": {}, "inputs": {}}
REPORT = Report.model_construct(
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
    table = figures.verdicts(REPORT)
    assert "claim & model & a & d\\_2 \\\\" in table
    assert rows(table) == [
        ["SAFE-INV", "proved", "", ""],
        ["ZENO-TRACE", "", "not tested", "holds"],
        ["SAFE-TRACE", "", "refuted", ""],
    ]
    assert rows(figures.reproduction(REPORT)) == [
        ["A1", r"stall \& 5 \%", "(3.3, 5.1) m", "(3.369, 5.102) m", "not reproduced"],
        ["A3", "grows", "yes", "no", "calibrated"],
        ["A5", "trigger", "14.45 s", "--", "not reproduced"],
    ]


@given(st.text())
def test_no_special_character_is_left(text: str) -> None:
    plain = re.sub(r"\\(text[a-z]+\{\}|ldots\{\}|[&%$#_{}])|\$\\[a-z]+\$|\$-\$", "", figures.escaped(text))
    assert not re.search(r"[\\~^<>|&%$#_{}\n]", plain)
