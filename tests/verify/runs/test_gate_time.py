"""GATE-TIME."""

from __future__ import annotations

from dataclasses import replace

import pytest
from builders.runs import run_of
from verify.judging import judge


@pytest.mark.parametrize(
    ("times", "status"),
    [
        ([0.01] * 200, "holds"),
        ([0.01] * 199 + [0.2], "holds"),
        ([0.01] * 197 + [0.2] * 3, "refuted"),
        ([0.05] * 60, "refuted"),
        ([0.01] * 59 + [0.06], "refuted"),
        ([], "not_run"),
        ([0.01] * 10, "error"),
        ([0.01] * 59 + [float("nan")], "error"),
        ([0.01] * 59 + [-1.0], "error"),
    ],
)
def test_gate_time(times: list[float], status: str) -> None:
    assert judge("GATE-TIME", replace(run_of("d"), timings={"decision_times_s": times})).status == status


def test_gate_time_without_data_is_not_run() -> None:
    assert judge("GATE-TIME", replace(run_of("d"), timings={})).status == "not_run"
    assert judge("GATE-TIME", replace(run_of("d"), decisions=run_of("d").decisions.iloc[:0])).status == "not_run"
