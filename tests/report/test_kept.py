"""The pages kept in reports/ say what the code says."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from airground_drake.report import make
from airground_drake.report.audit import of_runs
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify import Verdict

pytestmark = pytest.mark.slow


def said(page: str) -> tuple[list[str], list[tuple[str, ...]]]:
    first = page.partition('<section class="first"')[2].partition("</section>")[0]
    row = re.compile(r'<div id="(claim-[^"]+)"|<tr[^>]* data-run="(\w*)" data-status="(\w+)">')
    return re.sub(r"<[^>]+>", " ", first).split(), row.findall(page)


def found(scenario: Scenario, traces: Mapping[str, Trace], _: Sequence[Verdict]) -> list[dict[str, Any]]:
    return of_runs(scenario, traces)


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_a_kept_page_says_what_the_code_says(name: str, tmp_path: Path) -> None:
    document = make.write_report(load(name), tmp_path / name, make.Wanted(("html",), audit=found, seeds=12))
    kept = said((Path(__file__).parents[2] / "reports" / f"{name}.html").read_text(encoding="utf-8"))
    assert kept == said((tmp_path / name / "report.html").read_text(encoding="utf-8"))
    assert len(kept[1]) > len(document["claims"]) > 30
