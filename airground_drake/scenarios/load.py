"""From the name or file of a scenario to a validated `Scenario`; every mistake becomes one line.

The YAML text is composed to nodes, which know their line (`document.py`); `--set` replaces nodes; the nodes are checked
against the type hints of the schema, whose dataclasses are built as they are (`typed.py`); `validate.py` checks the
meaning.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from airground_drake import files
from airground_drake.errors import Fault, ScenarioError, short
from airground_drake.scenarios import validate
from airground_drake.scenarios.document import compose, entries_of, nearest, of_data, read, simple, where, within_limits
from airground_drake.scenarios.schema import Scenario, Vector
from airground_drake.scenarios.shipped import shipped
from airground_drake.scenarios.typed import made, replaced

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
    root, source, data = read(name_or_path)
    texts = _texts(overrides)
    for override in texts:
        within_limits(root)
        root = _override(root, override)
    scenario = _build(root, source)
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
    root = of_data(data, source)
    for override in _texts(overrides):
        root = _override(root, override)
    return _build(root, source)


def resolved(scenario: Scenario) -> dict[str, Any]:
    """The scenario as nested dicts and lists, defaults filled in.

    Raises:
        TypeError: if it is none.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"{type(scenario).__name__} is no Scenario")
    return dataclasses.asdict(scenario)


def _build(root: yaml.Node, source: str) -> Scenario:
    """The scenario of a document, checked."""
    within_limits(root)
    scenario = _checked(root, source)
    for name, run in scenario.runs.items():
        if run.set:
            _as_set(root, name, source)
    return scenario


def own(scenario: Scenario, run: str) -> Scenario:
    """The scenario as a run of it has it: with the values that the run sets.

    Args:
        scenario: validated.
        run: name of one of its runs.
    """
    return (
        _as_set(of_data(resolved(scenario), scenario.name), run, scenario.name) if scenario.runs[run].set else scenario
    )


def _as_set(root: yaml.Node, run: str, source: str) -> Scenario:
    """The scenario of a document with the values that a run sets.

    Raises:
        ScenarioError: if it is not valid; names the run, too.
    """
    node = root
    for part in ("runs", run, "set"):
        node = entries_of(node, "")[part][1]
    try:
        for key, (_, value) in entries_of(node, "").items():
            root = replaced(root, Scenario, key.split("."), "", value)
        return _checked(root, source)
    except ScenarioError as error:
        allowed = f"{error.allowed} (as run {run} sets it)"
        raise ScenarioError(error.source, error.key, error.value, allowed) from None


def _checked(root: yaml.Node, source: str) -> Scenario:
    """The scenario of a document, whatever its runs set."""
    scenario: Scenario = made(root, Scenario, "", "")
    _complete(scenario)
    try:
        validate.check(scenario, source)
    except ScenarioError as error:
        raise ScenarioError(where(nearest(root, error.key)), error.key, error.value, error.allowed) from None
    return scenario


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
    while gain * period == 1.0 < validate.exactly(gain) * validate.exactly(period):
        gain = math.nextafter(gain, 0.0)
    return gain


def _over_the_targets(scenario: Scenario) -> Vector:
    """Where the UAV's task (9) leads if every UGV reaches its target: over their centroid, [x, y, z], m."""
    targets = [ugv.target_m for ugv in scenario.ugvs.values() if len(ugv.target_m) == 3]
    x, y = (sum(target[axis] for target in targets) / max(len(targets), 1) for axis in range(2))
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


def _override(root: yaml.Node, override: str) -> yaml.Node:
    """The document with one value replaced; the document itself is left as it is, as aliases may share nodes."""
    source = f"--set {short(override)}"
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise ScenarioError(source, "", override, "wanted: dotted.key=value, such as control.period_s=0.05")
    return replaced(root, Scenario, key.strip().split("."), "", compose(value, source))
