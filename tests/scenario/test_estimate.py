"""What a scenario asks for is counted from its numbers: held against runs, and refused in one line."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenario.cases import SMALL_DATA, edit

from airground_drake.base.errors import LimitError
from airground_drake.scenario.estimate import DEFAULT_LIMITS, PROGRAM, Limits, estimate, within
from airground_drake.scenario.load import from_data, load
from airground_drake.scenario.schema import Obstacle, Run, Scenario
from airground_drake.sim.trace import Trace

EVENTS = 1.25
"""Rows of a run are those counted, and by events up to a quarter more."""


def small(method: str = "d") -> Scenario:
    scenario = from_data(SMALL_DATA, "small")
    return replace(scenario, runs={"one": Run(method=method)}, reproduction=[], choices=[])


@pytest.mark.parametrize(("name", "run_name"), [("case_a", "a"), ("case_a", "c"), ("case_b", "d"), ("contact", "d")])
def test_runs_keep_to_the_estimate(name: str, run_name: str, run: Callable[[str, str], Trace]) -> None:
    scenario, trace = load(name), run(name, run_name)
    asked = estimate(replace(scenario, runs={run_name: scenario.runs[run_name]}))
    assert asked.rows - 1.5 <= len(trace.t) <= EVENTS * asked.rows
    assert asked.steps == (len(trace.ugvs) + 1) * asked.rows
    assert len(trace.decisions) <= asked.decisions
    tables = sum(int(table.memory_usage(deep=True).sum()) for table in (trace.states, trace.decisions, trace.problems))
    assert PROGRAM + tables <= asked.memory


@given(
    method=st.sampled_from("abcd"),
    key=st.sampled_from(["duration_s", "obstacles", "gatekeeper.horizon_s", "gatekeeper.longest_s", "runs"]),
    factor=st.integers(2, 10**6),
)
def test_more_of_anything_never_asks_for_less(method: str, key: str, factor: int) -> None:
    one = small(method)
    more = replace(one, gatekeeper=replace(one.gatekeeper))
    if key == "obstacles":
        more.obstacles = {f"o{i}": Obstacle([0.0, 0.0, 0.0]) for i in range(min(factor, 1000))}
    elif key == "runs":
        more.runs = {f"r{i}": Run(method=method) for i in range(min(factor, 1000))}
    else:
        node = more if key == "duration_s" else more.gatekeeper
        name = key.rpartition(".")[2]
        setattr(node, name, factor * getattr(node, name))
    before, after = estimate(one), estimate(more)
    assert all(math.isfinite(value) for value in after)
    assert all(new >= old for old, new in zip(before, after, strict=True))


@pytest.mark.parametrize(
    ("key", "value", "method"),
    [
        ("duration_s", 1e8, "a"),
        ("decision.noise_period_s", 1e-9, "b"),
        ("gatekeeper.horizon_s", 1.5e6, "c"),
        ("gatekeeper.longest_s", 1e9, "d"),
        ("gatekeeper.settling_s", 1e9, "d"),
        ("obstacles", {f"o{i}": {"position_m": [1e3 + 9.0 * i, 0.0, 0.0]} for i in range(4_000)}, "b"),
    ],
)
def test_what_would_never_end_is_refused_in_one_line(key: str, value: object, method: str) -> None:
    data = edit(dataclasses.asdict(small(method)), key, value)
    scenario = from_data(edit(data, "control.avoidance_gain_1_s", 0.0), "big")
    with pytest.raises(LimitError, match=r"^small asks for about [^\n]*; allowed: 1e\+07 steps, 8 GiB$"):
        within(scenario, DEFAULT_LIMITS)
    assert within(scenario, Limits(math.inf, math.inf)) == estimate(scenario)


def test_more_seeds_are_more_work_in_the_same_memory() -> None:
    once, thrice = (within(small(), DEFAULT_LIMITS, times) for times in (1, 3))
    assert (thrice.work, thrice.memory) == (3.0 * once.work, once.memory)
    with pytest.raises(LimitError):
        within(small(), DEFAULT_LIMITS, 10**6)
