"""The pages kept in reports/ say what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from airground_drake.report import make
from airground_drake.scenarios.load import load

pytestmark = pytest.mark.slow


def said(page: str) -> tuple[list[str], list[tuple[str, ...]]]:
    """The words of the first screen, and the status of every claim on every run."""
    first = page.partition('<section class="first"')[2].partition("</section>")[0]
    row = re.compile(r'<div id="(claim-[^"]+)"|<tr[^>]* data-run="(\w*)" data-status="(\w+)">')
    return re.sub(r"<[^>]+>", " ", first).split(), row.findall(page)


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_a_kept_page_says_what_the_code_says(name: str, tmp_path: Path) -> None:
    document = make.write_report(*load(name), tmp_path / name, make.Wanted(("html",), seeds=12))
    kept = said((Path(__file__).parents[2] / "reports" / f"{name}.html").read_text(encoding="utf-8"))
    assert kept == said((tmp_path / name / "report.html").read_text(encoding="utf-8"))
    assert len(kept[1]) > len(document["claims"]) > 40
