"""Gatekeeper records that several modules share."""

from __future__ import annotations

import pytest
from builders.decisions import decided_run

from airground_drake.run.trace import Trace


@pytest.fixture(scope="session")
def relaxed() -> Trace:
    return decided_run()
