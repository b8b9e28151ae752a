"""The report that the tests of the checker share."""

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture(scope="session", name="report")
def report_of_case_b(report: Callable[[str], Path]) -> Path:
    """A report of case B, proofs and all; nobody writes into it."""
    return report("case_b")
