"""What is kept in the repository of reports: the pages in reports/ and the first screen in the README."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from airground_drake.report import make, summary
from airground_drake.scenarios.load import load

ROOT = Path(__file__).parent.parent.parent
KEPT = ("case_a", "case_b")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, dict[str, Any]]]:
    """Pages and documents, made now."""
    folder = tmp_path_factory.mktemp("reports")
    found = {}
    for name in KEPT:
        document = make.write_report(*load(name), folder / name, ("html",))
        found[name] = (folder / name / "report.html").read_text(encoding="utf-8"), document
    return found


def said(page: str) -> tuple[list[str], list[tuple[str, ...]]]:
    """The words of the first screen, and the status of every claim on every run."""
    first = page.partition('<section class="first"')[2].partition("</section>")[0]
    row = re.compile(r'<div id="(claim-[^"]+)"|<tr[^>]* data-run="(\w*)" data-status="(\w+)">(.*?)</tr>', re.DOTALL)
    rows = [tuple(re.sub(r"<[^>]+>", " ", part).strip() for part in found) for found in row.findall(page)]
    return re.sub(r"<[^>]+>", " ", first).split(), [found[:3] for found in rows]


@pytest.mark.parametrize("name", KEPT)
def test_a_kept_page_says_what_the_code_says(name: str, made: dict[str, tuple[str, dict[str, Any]]]) -> None:
    kept = (ROOT / "reports" / f"{name}.html").read_text(encoding="utf-8")
    words, verdicts = said(kept)
    assert (words, verdicts) == said(made[name][0])
    assert len(verdicts) > len(made[name][1]["claims"]) > 40


def test_the_readme_shows_the_first_screen_of_case_a(made: dict[str, tuple[str, dict[str, Any]]]) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    printed = re.findall(r"```text\n(.*?)```", readme, re.DOTALL)
    assert readme.count("\n") < 120
    assert printed == [summary.text(made["case_a"][1]) + "\n"]
