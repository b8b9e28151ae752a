"""The JSON Schema of scenario files: it takes what can be loaded, names what cannot, and its copy is current."""

from __future__ import annotations

import copy
import json
from dataclasses import asdict, fields
from importlib import resources
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from airground_drake.registry import METHODS, POLICIES
from airground_drake.scenarios import json_schema, schema
from airground_drake.scenarios.load import load, shipped
from airground_drake.scenarios.shipped import json_schema_file

SCHEMA = json_schema.scenario_schema(installed=False)
VALIDATOR = Draft202012Validator(SCHEMA)


def data(name: str) -> dict[str, Any]:
    """A shipped scenario as an editor sees it, aliases and merges expanded."""
    return dict(yaml.safe_load((resources.files("airground_drake.scenarios") / f"{name}.yaml").read_text()))


def test_it_is_a_schema_and_its_copy_is_current() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert json_schema_file().read_text() == json_schema.text(installed=False), "run python docs/generate.py"
    assert json.loads(json_schema.text(installed=True))["$defs"].keys() == SCHEMA["$defs"].keys()


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_names_it_and_is_valid(name: str) -> None:
    text = (resources.files("airground_drake.scenarios") / f"{name}.yaml").read_text()
    assert text.startswith("# yaml-language-server: $schema=scenario.schema.json\n")
    assert not list(VALIDATOR.iter_errors(data(name)))
    assert not list(VALIDATOR.iter_errors(asdict(load(name)[0])))


def test_every_key_is_there_and_described() -> None:
    parts = {**SCHEMA["$defs"], "Scenario": SCHEMA}
    for name, part in parts.items():
        keys = {field.name for field in fields(getattr(schema, name))}
        assert part["properties"].keys() - {"<<"} == keys
        assert all(part["properties"][key]["description"] for key in keys)


def test_what_may_be_named_is_what_is_registered() -> None:
    assert SCHEMA["$defs"]["Run"]["properties"]["method"]["enum"] == [*METHODS]
    assert SCHEMA["$defs"]["Policy"]["properties"]["name"]["anyOf"][0]["enum"] == [*POLICIES.own]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("contrl", {}),
        ("control.period", 0.1),
        ("control.period_s", -0.1),
        ("control.period_s", "fast"),
        ("seed", 1.5),
        ("seed", -1),
        ("ugvs", {}),
        ("ugvs", {f"ugv{index}": data("minimal")["ugvs"]["ugv1"] for index in range(101)}),
        ("ugvs.ugv", {"start_m": [0, 0, 0]}),
        ("ugvs.my robot", {"start_m": [0, 0, 0], "target_m": [1, 0, 0], "preset": {"waypoints_m": [[0, 0, 0]] * 2}}),
        ("uav.start_m", [0, 0]),
        ("uav.task", "hover"),
        ("gatekeeper.route", "../x.py:It"),
        ("gatekeeper.stages", 1001),
        ("runs.d.method", "e"),
        ("runs.d.expected", {"SAFE-TRACE": "fine"}),
        ("runs.d.expected", {"safe": "holds"}),
        ("claims", {"MINE": "mine"}),
        ("expected", {"SAFE-INV": "proved or"}),
        ("decision.trigger", "none"),
    ],
)
def test_what_cannot_be_loaded_key_by_key_is_not_valid(key: str, value: Any) -> None:
    changed = copy.deepcopy(data("minimal"))
    *above, last = key.split(".")
    part = changed
    for name in above:
        part = part.setdefault(name, {})
    part[last] = value
    assert list(VALIDATOR.iter_errors(changed))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("uav.task", "my.module:Task"),
        ("gatekeeper.route", "routes/mine.py:Route"),
        ("claims", {"MINE": "mine.py:Mine"}),
        ("expected", {"SAFE-INV": "proved or exercised", "MINE": "holds"}),
        ("_template", [1, 2]),
    ],
)
def test_what_is_the_scenarios_own_is_valid(key: str, value: Any) -> None:
    changed = data("minimal")
    *above, last = key.split(".")
    part = changed
    for name in above:
        part = part.setdefault(name, {})
    part[last] = value
    assert not list(VALIDATOR.iter_errors(changed))
