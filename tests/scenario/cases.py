"""A small valid scenario on which one thing at a time is broken, and what the tests of mistakes share."""

import copy
import functools
from collections.abc import Callable
from typing import Any

import pytest
import yaml

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.shipped import shipped_files

CASE_A = shipped_files()["case_a"]
DATA: dict[str, Any] = yaml.safe_load(CASE_A.read_text(encoding="utf-8"))
DELETE = object()

DEADLOCKS = ("pocket", "swap", "doorway", "intersection", "crossing", "warehouse", "lab")
"""Shipped scenarios in which somebody is stuck without the UAV."""


Write = Callable[[str | bytes], str]
"""Writes a file and returns its path."""

SMALL = """\
name: small
seed: 3
duration_s: 5
ugvs:
  one: {start_m: [0, 0, 0], target_m: [9, 0, 0], preset: {waypoints_m: [[0, 0, 0], [9, 0, 0]]}, max_speed_m_s: 2}
  two: {start_m: [0, 5, 0], target_m: [9, 5, 0], preset: {waypoints_m: [[0, 5, 0], [9, 5, 0]]}, max_speed_m_s: 3}
uav: {start_m: [0, 2, 2], target_m: [9, 2, 2]}
obstacles:
  rock: {position_m: [5, -5, 0]}
intervention:
  policies: [{name: detour, parameters: {speed_m_s: 3}}]
runs:
  d: {method: d, stalls_m: {one: [1, 0, 0]}, expected: {SAFE-TRACE: holds}}
reproduction: [{id: A1, quantity: q, measure: m, run: d, robot: one, paper: [1.5]}]
choices: [{key: control.period_s, source: ours, reason: r}]
"""


SMALL_DATA: dict[str, Any] = yaml.safe_load(SMALL)


def edit(data: dict[str, Any], key: str, value: object) -> dict[str, Any]:
    data = copy.deepcopy(data)
    *parents, last = key.split(".")
    node: Any = data
    for part in parents:
        node = node[int(part)] if isinstance(node, list) else node.setdefault(part, {})
    at = int(last) if isinstance(node, list) else last
    if value is DELETE:
        del node[at]
    else:
        node[at] = value
    return data


@functools.cache
def case_a() -> tuple[Scenario, str]:
    return load("case_a")


def message(name_or_path: str, overrides: list[str] | None = None) -> str:
    with pytest.raises(ScenarioError) as caught:
        load(name_or_path, overrides or [])
    text = str(caught.value)
    assert text.isprintable()
    assert len(text.splitlines()) == 1
    return text
