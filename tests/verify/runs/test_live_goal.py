"""LIVE-GOAL."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from builders.edits import moved, with_scenario
from builders.runs import run_of
from verify.judging import counterexample, judge

from airground_drake.run.trace import Trace


def stall(y: float) -> dict[str, list[float]]:
    return {"ugv1": [3.35, y, 0.0]}


OUTCOMES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "UGV off target": ("d", lambda trace: with_scenario(trace, ugvs__ugv2__target_m=[-1.3, 13.2, 0.0])),
    "UAV off target": ("d", lambda trace: with_scenario(trace, uav__target_m=[1.0, 13.0, 2.2])),
    "late jump off target": ("d", lambda trace: moved(trace, "ugv1", len(trace.t) - 1, [0.0, 0.11, 0.0])),
    "no stall where one is declared": ("d", lambda trace: with_scenario(trace, runs__d__stalls_m=stall(5.1))),
    "arrives where a stall is declared": ("d", lambda trace: with_scenario(trace, runs__d__stalls_m=stall(12.95))),
    "stalls elsewhere": ("a", lambda trace: with_scenario(trace, runs__a__stalls_m=stall(5.3))),
    "stalls undeclared": ("a", lambda trace: with_scenario(trace, runs__a__stalls_m={})),
    "still moving": ("a", lambda trace: moved(trace, "ugv1", len(trace.t) - 20, [0.0, -2e-3, 0.0])),
    "UAV not over the centroid": ("a", lambda trace: moved(trace, "uav", len(trace.t) - 1, [0.2, 0.0, 0.0])),
}  # fmt: skip


@pytest.mark.parametrize("name", OUTCOMES)
def test_live_goal_mutants(name: str) -> None:
    method, mutate = OUTCOMES[name]
    assert counterexample("LIVE-GOAL", mutate(run_of(method)))["margin_m"] < 0.0


def test_live_goal_unknown_stall_is_an_error() -> None:
    assert judge("LIVE-GOAL", with_scenario(run_of("a"), runs__a__stalls_m={"ugv9": [0.0] * 3})).status == "error"
