"""The report that the tests of the checker share."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from check.forging import REMEMBERED


@pytest.fixture(scope="session", name="report")
def report_of_case_b(report: Callable[[str], Path]) -> Path:
    """A report of case B, proofs and all; nobody writes into it."""
    return report("case_b")


@pytest.fixture(scope="module", autouse=True)
def _remembered() -> Iterator[None]:
    """What was worked out of a run for one forgery is taken for the others that leave it as it is."""
    with pytest.MonkeyPatch.context() as patch:
        for (module, name), function in REMEMBERED.items():
            patch.setattr(module, name, function)
        yield
