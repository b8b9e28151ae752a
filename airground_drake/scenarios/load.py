"""From the name or file of a scenario to a validated `Scenario`; every mistake becomes one line.

YAML text becomes plain data that knows its lines, in which `--set` replaces values (`document.py`). pydantic checks the
data against the dataclasses of `schema.py` and builds them. `validate.py` checks how values go together.
"""

from __future__ import annotations

import copy
import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.base.exact import decimal
from airground_drake.scenarios import json_schema, validate
from airground_drake.scenarios.document import Document, of_data, put, read, replace, simple, unknown
from airground_drake.scenarios.recorded import adapter
from airground_drake.scenarios.schema import RETIRED_KEYS, Scenario, Vector
from airground_drake.scenarios.shipped import shipped

__all__ = ["from_data", "load", "own", "resolved", "shipped", "validated"]

Overrides = Sequence[str] | Mapping[str, Any]
"""`dotted.key=value` with the value in YAML, or values by dotted key."""


def load(name_or_path: str | Path, overrides: Overrides = ()) -> tuple[Scenario, str]:
    """Load and validate a scenario.

    Args:
        name_or_path: name of a shipped scenario, or path to a YAML file.
        overrides: applied in order; list items are addressed by index. A key must be one of the schema, an item
            that exists, or an entry, which may be new, of a mapping whose names are free, such as `obstacles`.

    Returns:
        The scenario, and the SHA-256 of the file's bytes followed by a NUL byte and the text of each override.

    Raises:
        ScenarioError: if the file cannot be read or an override or the scenario is not valid.
    """
    document, data = read(name_or_path)
    texts = _texts(overrides)
    scenario = _build(document, texts)
    digest = files.sha256(b"\0".join([data, *(override.encode() for override in texts)]))
    return scenario, digest


def validated(scenario: Scenario, overrides: Overrides = ()) -> Scenario:
    """A scenario made or changed in Python, checked as strictly as a file; numpy's numbers and arrays may be in it.

    Args:
        scenario: left as it is.
        overrides: as of `load`.

    Returns:
        A copy whose values have the types of the schema.

    Raises:
        ScenarioError: if it is not valid; names the key, its value and what is allowed.
    """
    source = f"scenario {getattr(scenario, 'name', None) or type(scenario).__name__!r}"
    try:
        return from_data(resolved(scenario), source, overrides)
    except TypeError as error:
        raise ScenarioError(source, "", Fault(str(error)), "wanted: a Scenario") from None


def from_data(data: Mapping[str, Any], source: str, overrides: Overrides = ()) -> Scenario:
    """A scenario from nested dicts and lists, such as `resolved` gives, checked like a file.

    Args:
        data: with the keys of a scenario file.
        source: where it comes from, for messages.
        overrides: as of `load`.

    Raises:
        ScenarioError: if it is not valid.
    """
    return _build(of_data(data, source), _texts(overrides))


def resolved(scenario: Scenario) -> dict[str, Any]:
    """The scenario as nested dicts and lists, defaults filled in.

    Raises:
        TypeError: if it is something else.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"{type(scenario).__name__} is no Scenario")
    return dataclasses.asdict(scenario)


def _build(document: Document, overrides: Sequence[str]) -> Scenario:
    """The scenario of a document with overrides, checked."""
    for override in overrides:
        replace(document, override)
    scenario = _checked(document)
    for name, run in scenario.runs.items():
        if run.set:
            _as_set(document, name, run.set)
    return scenario


def own(scenario: Scenario, run: str) -> Scenario:
    """The scenario as a run of it has it: with the values that the run sets.

    Args:
        scenario: validated.
        run: name of one of its runs.
    """
    settings = scenario.runs[run].set
    return _as_set(of_data(resolved(scenario), scenario.name), run, settings) if settings else scenario


def _as_set(document: Document, run: str, settings: Mapping[str, Any]) -> Scenario:
    """The scenario of a document with the values that a run sets.

    Raises:
        ScenarioError: if it is not valid; names the run, too.
    """
    changed = Document(copy.deepcopy(document.data), document.source, dict(document.places))
    try:
        for key, value in settings.items():
            put(changed, tuple(key.split(".")), value, document.where("runs", run, "set", key))
        return _checked(changed)
    except ScenarioError as error:
        allowed = f"{error.allowed} (as run {run} sets it)"
        raise ScenarioError(error.source, error.key, error.value, allowed) from None


def _checked(document: Document) -> Scenario:
    """The scenario of a document, without what its runs set."""
    scenario: Scenario = filled(Scenario, document)
    _complete(scenario)
    try:
        validate.check(scenario, document.source)
    except ScenarioError as error:
        place = document.where(*error.key.split("."), key=True)
        raise ScenarioError(place, error.key, error.value, error.allowed) from None
    return scenario


def filled(kind: type, document: Document) -> Any:
    """A dataclass with the data of a document, checked by pydantic.

    Raises:
        ScenarioError: if a key or value is not what the dataclass says.
    """
    try:
        return adapter(kind).validate_python(document.data)
    except ValidationError as error:
        first = min(error.errors(include_url=False), key=_rank)
        raise _in_words(first, document, json_schema.schema_of(kind)) from None


_UNKNOWN = ("unexpected_keyword_argument", "invalid_key")


def _rank(error: ErrorDetails) -> int:
    """Of several errors one is shown: a key that is not known may be why another is missing."""
    return 0 if error["type"] in _UNKNOWN else 1 if error["type"] == "missing" else 2


def _in_words(error: ErrorDetails, document: Document, schema: json_schema.Schema) -> ScenarioError:
    """What pydantic says of a value, in one line: where it is, its key, the value, and what is allowed."""
    kind, given, says = error["type"], error["input"], error.get("ctx", {})
    loc = [str(part) for part in error["loc"]]
    at = [part for part in (*loc, *says.get("at", ())) if part != json_schema.NAMES]
    of_type = kind.endswith(("_type", "missing"))  # then the line of the value is named, not that of its key
    key, source = ".".join(at), document.where(*at, key=not of_type)
    if kind == "rule":
        return ScenarioError(source, key, says["value"], says["allowed"])
    general = ".".join(["runs", "NAME", *at[2:]]) if at[:1] == ["runs"] else key
    if general in RETIRED_KEYS:
        return ScenarioError(source, key, Fault("no longer a key"), RETIRED_KEYS[general])
    if kind in _UNKNOWN:
        return unknown(source, key, at[-1], json_schema.keys_at(schema, *at[:-1]))
    place = loc[:-2] + loc[-1:] if loc[-1:] == [json_schema.NAMES] else at
    wanted = f"wanted: {json_schema.wanted_at(schema, *place)}"
    if kind == "missing":
        new = f", as {'.'.join(at[:-1])} is new" * source.startswith("--set ")
        return ScenarioError(source, key, Fault("missing"), wanted + new)
    if given is None:
        given = Fault("no value is given")
    elif isinstance(given, dict):
        given = Fault("a mapping is given" if of_type else f"{len(given)} entries")
    elif isinstance(given, list) and of_type:
        given = Fault("a list is given")
    return ScenarioError(source, key, given, wanted)


def _complete(scenario: Scenario) -> None:
    """Fill in what follows from other keys, and round a gain of 1/period down to where gain * period <= 1 exactly."""
    if not scenario.uav.target_m:
        scenario.uav.target_m = _over_the_targets(scenario)
    control = scenario.control
    for name in validate.GAINS:
        setattr(control, name, _rounded_down(getattr(control, name), control.period_s))


def _rounded_down(gain: float, period: float) -> float:
    """A gain, 1/s; the largest number below it that proofs admit if it is 1/period but for rounding.

    Proofs take numbers as the decimals that they print as: 3.3333333333333335 * 0.3 is 1 in floating point, and more
    than 1 there. A smaller gain only demands less.
    """
    while gain * period == 1.0 < decimal(gain) * decimal(period):
        gain = math.nextafter(gain, 0.0)
    return gain


def _over_the_targets(scenario: Scenario) -> Vector:
    """Where the UAV's task (9) leads if every UGV reaches its target: over their centroid, [x, y, z], m."""
    targets = [ugv.target_m for ugv in scenario.ugvs.values()]
    x, y = (sum(target[axis] for target in targets) / len(targets) for axis in range(2))
    return [x, y, scenario.uav.altitude_m]


def _texts(overrides: Overrides) -> list[str]:
    """Overrides as on the command line.

    Raises:
        ScenarioError: if a value has no text in YAML.
    """
    if not isinstance(overrides, Mapping):
        return list(overrides)
    texts = []
    for key, value in overrides.items():
        try:
            texts.append(f"{key}={_yaml_of(json.dumps(simple(value), ensure_ascii=False))}")
        except (TypeError, ValueError) as error:
            raise ScenarioError(
                "override", str(key), Fault(str(error)), "wanted: a number, text, list or dict"
            ) from None
    return texts


def _yaml_of(text: str) -> str:
    """JSON as YAML: any character as it is, where YAML takes the pairs of escapes that JSON has for halves."""
    return "".join(each if " " <= each <= "~" else f"\\U{ord(each):08x}" for each in text)
