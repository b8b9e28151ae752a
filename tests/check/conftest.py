"""The report that the tests of the checker share."""

from __future__ import annotations

from pathlib import Path

import pytest

from airground_drake.report.__main__ import main as write


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of case B, proofs and all; nobody writes into it."""
    folder = tmp_path_factory.mktemp("checked") / "report"
    assert write(["case_b", "-o", str(folder), "--format", "json"]) in (0, 1)  # 1: a slow machine misses GATE-TIME
    return folder
