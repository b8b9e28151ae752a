"""GATE-FEAS and GATE-OPT on runs of the simulator."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from verify.judging import FEAS, OPT

from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load

Simulated = Callable[[str, str, str], Trace]


@pytest.fixture(scope="session")
def record_of(run: Callable[[str, str], Trace]) -> Simulated:
    """`record_of(scenario, run, route)`; runs by the scenario's own route are those that all tests share."""

    def get(name: str, run_name: str, route: str) -> Trace:
        described = load(name)[0]
        if described.gatekeeper.route == route:
            return run(name, run_name)
        described.gatekeeper.route = route
        return simulate(described, run_name)

    return get


@pytest.mark.parametrize("route", ["mixed_integer", "relaxed"])
@pytest.mark.parametrize(("name", "run_name"), [("case_b", "c"), ("case_a", "c"), ("soft_gate", "c")])
def test_real_runs_pass(record_of: Simulated, name: str, run_name: str, route: str) -> None:
    trace = record_of(name, run_name, route)
    assert len(trace.decisions) > 5
    for claim in (FEAS, OPT):
        finding = claim.judge(trace)
        assert finding.status == "holds", finding


def test_a_local_optimum_bounds_nothing(record_of: Simulated) -> None:
    trace = record_of("case_b", "c", "nonlinear")
    assert FEAS.judge(trace).status == "holds"
    assert OPT.judge(trace).status == "inconclusive"
    assert FEAS.judge(trace).evidence["rounded_plans"] > 0
