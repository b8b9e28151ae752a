"""GATE-TIME."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
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
        ([0.01] * 59 + [float("nan")], "error"),
        ([0.01] * 59 + [-1.0], "error"),
    ],
)
def test_gate_time(times: list[float], status: str) -> None:
    assert _judged(times, len(times)) == status


@pytest.mark.parametrize(("times", "status"), [([], "not_run"), ([0.2] * 59, "error"), ([0.01] * 6000, "error")])
def test_every_decision_has_one_time(times: list[float], status: str) -> None:
    assert _judged(times, 60) == status


def _judged(times: list[float], decisions: int) -> str:
    table = pd.concat([run_of("d").decisions] * 20).iloc[:decisions]
    return judge("GATE-TIME", replace(run_of("d"), decisions=table, timings={"decision_times_s": times})).status


def test_gate_time_without_data_is_not_run() -> None:
    assert judge("GATE-TIME", replace(run_of("d"), timings={})).status == "not_run"
    assert judge("GATE-TIME", replace(run_of("d"), decisions=run_of("d").decisions.iloc[:0])).status == "not_run"
