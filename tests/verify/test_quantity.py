"""Every margin says what it is of, wherever it is shown."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from html import unescape
from pathlib import Path

import pytest

from airground_drake.report.junit import _outcome
from airground_drake.verify.__main__ import main


@pytest.fixture(scope="module")
def folder(report: Callable[[str], Path]) -> Path:
    return report("case_b")


def test_every_margin_in_a_report_has_a_quantity(folder: Path) -> None:
    claims = json.loads((folder / "report.json").read_text(encoding="utf-8"))["claims"]
    with_margin = [claim for claim in claims if claim["margin"] is not None]
    assert len({claim["id"] for claim in with_margin}) > 12
    assert not [claim["id"] for claim in with_margin if len(claim["quantity"].split()) < 3]
    page = unescape((folder / "report.html").read_text(encoding="utf-8"))
    assert all(claim["quantity"] in page for claim in with_margin)


def test_junit_and_the_command_line_name_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    claims = json.loads((folder / "report.json").read_text(encoding="utf-8"))["claims"]
    claim = next(each for each in claims if each["id"] == "SAFE-TRACE" and each["run"] == "d")
    case = ET.Element("testcase")
    _outcome(case, {**claim, "as_expected": False})
    assert f"m ({claim['quantity']})" in case[0].get("message", "")
    assert main([str(folder / "trace" / "d"), "SAFE-TRACE"]) == 0
    assert f"m ({claim['quantity']})" in capsys.readouterr().out
