"""Gatekeeper records that several modules share."""

from __future__ import annotations

import pytest
from builders.decisions import decided_run

from airground_drake.trace import Trace
from airground_drake.verify.runs import gate_feas


@pytest.fixture
def scripted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The UGVs of scripted traces do not follow their own task."""
    monkeypatch.setattr(gate_feas, "compare_own_task", lambda trace, rows: iter(()))


@pytest.fixture(scope="session")
def relaxed() -> Trace:
    return decided_run()
