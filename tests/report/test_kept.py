"""The pages kept in reports/ say what the code says, but for what they say of other seeds."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest


def said(page: str) -> tuple[list[str], list[tuple[str, ...]]]:
    """The words of the tables of the first screen, below the headlines, which count seeds; and all verdicts."""
    first = page.partition('<table class="stack runs">')[2].partition("</section>")[0]
    words = re.sub(r"<[^>]+>", " ", re.sub(r'<tr><th scope="row">Other seeds\?.*', "", first)).split()
    return words, re.findall(r'<div id="(claim-[^"]+)"|<tr[^>]* data-run="(\w*)" data-status="(\w+)">', page)


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_a_kept_page_says_what_the_code_says(name: str, report: Callable[[str], Path]) -> None:
    kept = said((Path(__file__).parents[2] / "reports" / f"{name}.html").read_text(encoding="utf-8"))
    assert kept == said((report(name) / "report.html").read_text(encoding="utf-8"))
    assert len(kept[0]) > 200
    assert len(kept[1]) > 50
