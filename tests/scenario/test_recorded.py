"""The scenario in the metadata of a run, typed again."""

from dataclasses import replace
from typing import Any

import pytest
from builders.runs import run_of
from scenario.cases import edit

from airground_drake.base.errors import TraceError
from airground_drake.scenario.load import from_data
from airground_drake.verify import judge


def test_a_trace_has_the_scenario_that_its_metadata_hold_and_makes_it_once() -> None:
    trace = run_of("d")
    assert trace.scenario == from_data(trace.meta["scenario"], "metadata")
    assert trace.scenario is trace.scenario


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("control.period_s", "fast", "control.period_s: "),
        ("runs.d", {"method": "d", "set": {"decision.no_key": 1.0}}, "no_key: "),
    ],
)
def test_metadata_that_hold_no_scenario_are_refused_in_one_line(key: str, value: Any, says: str) -> None:
    trace = run_of("d")
    broken = replace(trace, meta=trace.meta | {"scenario": edit(trace.meta["scenario"], key, value)})
    with pytest.raises(TraceError, match=f"^run d: the scenario in its metadata: .*{says}[^\n]*$"):
        _ = broken.scenario
    assert {each.status for each in judge(broken)} == {"error"}
