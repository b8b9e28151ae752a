"""From the name or file of a scenario to a validated `Scenario`; every mistake becomes one line.

`document.py` reads YAML text as plain data with line numbers, and replaces values by those of `--set`. `filled.py`
checks the data against the dataclasses of `schema.py` and builds them. `validate.py` checks how values go together.
"""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from airground_drake.base.errors import Fault, ScenarioError, short
from airground_drake.base.exact import decimal
from airground_drake.scenario import map_file, validate
from airground_drake.scenario.document import Document, of_data, place_of, put, read, replace, simple, way
from airground_drake.scenario.filled import filled
from airground_drake.scenario.schema import SET, UNNAMED, Scenario, Vector

Overrides = Sequence[str] | Mapping[str, Any]  # `dotted.key=value` with the value in YAML, or values by dotted key


def load(name_or_path: str | Path, overrides: Overrides = ()) -> Scenario:
    """Load and validate a scenario.

    Args:
        name_or_path: name of a shipped scenario, or path to a YAML file.
        overrides: applied in order; list items are addressed by index. A key must be a key of the schema, an existing
            item of a list, or an old or new entry of a mapping with free names, such as `obstacles`.

    Raises:
        ScenarioError: if the file cannot be read or an override or the scenario is not valid.
    """
    return _build(read(name_or_path)[0], overrides)


def validated(scenario: Scenario, overrides: Overrides = ()) -> Scenario:
    """A scenario made or changed in Python, checked as strictly as a file. It may contain numbers and arrays of numpy.

    Args:
        scenario: to be checked; it is not changed.
        overrides: as in `load`.

    Returns:
        A copy whose values have the types of the schema.

    Raises:
        ScenarioError: if it is not valid; names the key, its value and what is allowed.
    """
    source = f"scenario {getattr(scenario, 'name', None) or type(scenario).__name__!r}"
    try:
        return from_data(_without_lost_choices(resolved(scenario)), source, overrides)
    except TypeError as error:
        raise ScenarioError(source, "", Fault(str(error)), "wanted: a Scenario") from None


def _without_lost_choices(data: dict[str, Any]) -> dict[str, Any]:
    """A resolved scenario, but for choices about runs that were removed in Python."""
    listed, runs = data["choices"], data["runs"]
    if isinstance(listed, list) and isinstance(runs, dict):
        parts = [place_of(str(choice.get("key"))) if isinstance(choice, dict) else [""] for choice in listed]
        data["choices"] = [
            choice
            for choice, (first, *rest) in zip(listed, parts, strict=True)
            if first != "runs" or not rest or rest[0] in runs
        ]
    return data


def from_data(data: Mapping[str, Any], source: str, overrides: Overrides = (), runs: Sequence[str] = ()) -> Scenario:
    """A scenario from nested dicts and lists, such as `resolved` gives, checked like a file.

    Args:
        data: with the keys of a scenario file.
        source: where the data come from, for messages.
        overrides: as in `load`.
        runs: to be kept, if the scenario has them all; default: all.

    Raises:
        ScenarioError: if it is not valid.
    """
    return _build(of_data(data, source), overrides, runs)


def resolved(scenario: Scenario) -> dict[str, Any]:
    """The scenario as nested dicts and lists, with all defaults.

    Raises:
        TypeError: if it is not a Scenario.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"{type(scenario).__name__} is no Scenario")
    return scenario.data()


def _build(document: Document, overrides: Overrides, runs: Sequence[str] = ()) -> Scenario:
    """The scenario of a document with overrides, checked; only with some runs, if it has them."""
    before = deepcopy(document.data) if _choices(document.data) else None
    if isinstance(overrides, Mapping):
        for key, value in overrides.items():
            _put(document, str(key), value)
    else:
        for override in overrides:
            replace(document, override)
    given = document.data.get("runs") if runs and isinstance(document.data, dict) else None
    if isinstance(given, dict) and {*runs} <= given.keys():
        document.data["runs"] = {name: given[name] for name in runs}
    _mark_set(document, before)
    scenario = _checked(document)
    for name, run in scenario.runs.items():
        if run.set:
            _as_set(document, name, run.set)
    return scenario


def _choices(data: Any) -> list[dict[str, Any]]:
    """The entries of `choices` in unchecked data."""
    listed = data.get("choices") if isinstance(data, dict) else None
    return [entry for entry in listed if isinstance(entry, dict)] if isinstance(listed, list) else []


def _mark_set(document: Document, before: Any) -> None:
    """Replace the reasons for values that overrides have changed, and drop choices about what they have removed."""
    for was, choice in zip(_choices(before), _choices(document.data), strict=False):
        if choice != was:  # set by an override itself
            continue
        key = str(choice.get("key"))
        old, new, depth = way(before, key), way(document.data, key), len(place_of(key))
        if len(new) < len(old):
            document.data["choices"].remove(choice)
        elif len(new) == depth and (len(old) < depth or old[-1] != new[-1]):
            value = old[-1] if len(old) == depth else None
            in_the_file = f"; the file has {json.dumps(value)}" if isinstance(value, int | float | str) else ""
            choice.update(source=SET, reason=f"set by an override{in_the_file}")


def own(scenario: Scenario, run: str) -> Scenario:
    """The scenario with the values that one of its runs sets."""
    settings = scenario.runs[run].set
    return _as_set(of_data(resolved(scenario), scenario.name), run, settings) if settings else scenario


def _as_set(document: Document, run: str, settings: Mapping[str, Any]) -> Scenario:
    changed = Document(simple(document.data), document.source, dict(document.places))
    try:
        for key, value in settings.items():
            put(changed, tuple(key.split(".")), value, document.where("runs", run, "set", key))
        return _checked(changed)
    except ScenarioError as error:
        allowed = f"{error.allowed} (as run {run} sets it)"
        raise ScenarioError(error.source, error.key, error.value, allowed) from None


def _checked(document: Document) -> Scenario:
    scenario: Scenario = filled(Scenario, document)
    _complete(scenario)
    _read_map(scenario, document)
    try:
        validate.check(scenario, document.source)
    except ScenarioError as error:
        section, *key = at = error.key.split(".")
        is_default = (
            len(key) == 1 and key[0] not in (document.data.get(section) or ()) and not isinstance(error.value, Fault)
        )
        allowed = f"{error.allowed}; {error.value!r} is the default" if is_default else error.allowed
        raise ScenarioError(document.where(*at, key=True), error.key, error.value, allowed) from None
    return scenario


def _complete(scenario: Scenario) -> None:
    """Fill in what UAVs leave out, and round gains of 1/period down so that gain * period <= 1."""
    for name, uav in scenario.uavs.items():
        uav.name = name if uav.name == UNNAMED else uav.name
    without = [uav for uav in scenario.uavs.values() if not uav.ugvs]
    if len(without) == 1:
        taken = {ugv for uav in scenario.uavs.values() for ugv in uav.ugvs}
        without[0].ugvs = [ugv for ugv in scenario.ugvs if ugv not in taken]
    for name, uav in scenario.aerial.items():
        uav.target_m = uav.target_m or _over_the_targets(scenario, name)
    control = scenario.control
    for name in validate.GAINS:
        setattr(control, name, _rounded_down(getattr(control, name), control.period_s))


def _read_map(scenario: Scenario, document: Document) -> None:
    """Fill in the cells of the map, unless they are there, in the document, too: its runs then need no file."""
    given = scenario.map
    if given is None or (given.cells and (given.cells.file, given.cells.unknown) == (given.file, given.unknown)):
        return
    starts = [robot.start_m for robot in scenario.robots.values()]
    given.cells = map_file.cells(given, Path(document.source).parent, starts, document.where("map", "file"))
    cells = dataclasses.fields(given.cells)
    document.data["map"]["cells"] = {column.name: getattr(given.cells, column.name) for column in cells}


def _rounded_down(gain: float, period: float) -> float:
    """A gain, 1/s, rounded down if it exceeds 1/period by rounding alone."""
    # Proofs read numbers as the decimals that Python prints: 3.3333333333333335 * 0.3 is 1 in floating point, but more
    # than 1 in decimals. A smaller gain only demands less.
    while gain * period == 1.0 < decimal(gain) * decimal(period):
        gain = math.nextafter(gain, 0.0)
    return gain


def _over_the_targets(scenario: Scenario, uav: str) -> Vector:
    """Where a UAV's task (9) leads when its UGVs are at their targets: over the centroid, [x, y, z], m."""
    targets = [scenario.ugvs[ugv].target_m for ugv in scenario.in_charge(uav) or scenario.ugvs]
    x, y = (sum(target[axis] for target in targets) / len(targets) for axis in range(2))
    return [x, y, scenario.aerial[uav].altitude_m]


def _put(document: Document, key: str, value: Any) -> None:
    """Change a document: put a value made in Python at a dotted key."""
    new = of_data(value, f"override {key}").data
    try:
        text = json.dumps(new, ensure_ascii=False)
    except (TypeError, ValueError) as error:
        raise ScenarioError("override", key, Fault(str(error)), "wanted: a number, text, list or dict") from None
    put(document, place_of(key), new, f"--set {short(f'{key}={text}')}")
