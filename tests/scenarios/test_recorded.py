"""The scenario in the metadata of a run, typed again."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import pytest
from builders.runs import run_of

from airground_drake.base.errors import TraceError
from airground_drake.scenarios.load import from_data
from airground_drake.verify import verify


def test_a_trace_has_the_scenario_that_its_metadata_hold_and_makes_it_once() -> None:
    trace = run_of("d")
    assert trace.scenario == from_data(trace.meta["scenario"], "metadata")
    assert trace.scenario is trace.scenario


@pytest.mark.parametrize(
    ("section", "key", "value", "says"),
    [
        ("control", "period_s", "fast", "control.period_s: "),
        ("decision", "no_key", 1.0, "decision.no_key: "),
        ("runs", "d", {"method": "d", "set": {"decision.no_key": 1.0}}, "no_key: "),
    ],
)
def test_metadata_that_hold_no_scenario_are_refused_in_one_line(section: str, key: str, value: Any, says: str) -> None:
    trace = run_of("d")
    scenario = copy.deepcopy(trace.meta["scenario"])
    scenario[section][key] = value
    broken = replace(trace, meta=trace.meta | {"scenario": scenario})
    with pytest.raises(TraceError, match=f"^run d: the scenario in its metadata: .*{says}[^\n]*$"):
        _ = broken.scenario
    assert {each.finding.status for each in verify(broken)} == {"error"}
