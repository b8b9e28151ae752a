"""The JSON Schema of scenario files accepts what loads and refuses what cannot stand at a key; its copy is current."""

import json
from dataclasses import asdict, fields
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator
from scenario.bad_inputs import EDITS
from scenario.cases import SMALL_DATA, edit

from airground_drake.base.errors import ScenarioError
from airground_drake.base.registry import METHODS, POLICIES
from airground_drake.scenario import json_schema, schema
from airground_drake.scenario.document import of_data
from airground_drake.scenario.filled import filled
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import json_schema_file, shipped, shipped_files

SCHEMA = json_schema.scenario_schema(installed=False)
VALIDATOR = Draft202012Validator(SCHEMA)
BEYOND = ("nan is not", "z must be 0 m", "text without control characters", "3 numbers in m", "a new identifier")
"""Messages about rules that a JSON Schema cannot state."""


def test_it_is_a_schema_and_its_copy_is_current() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert json_schema_file().read_text() == json_schema.text(installed=False), "run python docs/generate.py"
    assert json.loads(json_schema.text(installed=True))["$defs"].keys() == SCHEMA["$defs"].keys()


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_names_it_and_is_valid(name: str) -> None:
    text = shipped_files()[name].read_text()
    assert text.startswith("# yaml-language-server: $schema=scenario.schema.json\n")
    assert not list(VALIDATOR.iter_errors(yaml.safe_load(text)))  # aliases and merges expanded, as an editor does
    assert not list(VALIDATOR.iter_errors(asdict(load(name))))


def test_every_key_is_there_and_described_with_the_registered_names() -> None:
    for name, part in {**SCHEMA["$defs"], "Scenario": SCHEMA}.items():
        keys = {field.name for field in fields(json_schema.class_of(name))}
        assert part["properties"].keys() - {"<<"} == keys
        assert all(part["properties"][key]["description"] for key in keys)
    assert SCHEMA["$defs"]["Run"]["properties"]["method"]["enum"] == [*METHODS]
    assert SCHEMA["$defs"]["Policy"]["properties"]["name"]["anyOf"][0]["enum"] == [*POLICIES.own]


OWN: list[tuple[str, Any]] = [
    ("uav.task", "my.module:Task"),
    ("gatekeeper.route", "routes/mine.py:Route"),
    ("claims", {"MINE": "mine.py:Mine"}),
    ("expected", {"SAFE-INV": "proved or exercised", "MINE": "holds"}),
]


@pytest.mark.parametrize(("key", "value"), [*EDITS, *OWN])
def test_it_refuses_what_cannot_stand_at_a_key_and_nothing_else(key: str, value: object) -> None:
    """It says what pydantic says; rules of how values go together are not in it."""
    data, refused = edit(SMALL_DATA, key, value), ""
    try:
        filled(schema.Scenario, of_data(data, "small"))
    except ScenarioError as error:
        refused = str(error)
    if not any(rule in refused for rule in BEYOND):
        assert bool(refused) == bool([*VALIDATOR.iter_errors(data)]), refused
