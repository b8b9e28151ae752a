"""Scenario files as JSON Schema (draft 2020-12), made from the dataclasses of `schema.py`, for editors and validators.

It has what can be said key by key: types, units, defaults, bounds, what may be named. How values must go together is
for `validate.py`: what this accepts may still be refused there, never the other way round (with merge keys expanded).
"""

from __future__ import annotations

import ast
import inspect
import json
from collections.abc import Iterable
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, get_args, get_origin

from airground_drake.arrays import LARGEST
from airground_drake.intervention.database import RANKINGS
from airground_drake.nsbc.avoidance import COMPOSITIONS
from airground_drake.registry import (
    METHODS,
    MODEL_CLAIMS,
    PLUGIN_PATTERN,
    POLICIES,
    ROUTES,
    RUN_CLAIMS,
    UAV_TASKS,
    Registry,
)
from airground_drake.scenarios import schema
from airground_drake.scenarios.schema import MAX_NAME, MAX_SEED, MAX_UGVS
from airground_drake.scenarios.validate import (
    BUDGETS,
    CLAIM_PATTERN,
    MAX_STAGES,
    MAX_TEXT,
    NAME_PATTERN,
    RULES,
    SETTABLE,
    SMALLEST,
    SOLVERS,
    SOURCES,
    THRESHOLD_RULES,
    TRIGGERS,
    unit_of,
)
from airground_drake.statuses import EXPECTATIONS

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_ONE_OF: dict[tuple[str, str], Iterable[str]] = {
    ("Run", "method"): METHODS,
    ("Run", "composition"): COMPOSITIONS,
    ("Threshold", "rule"): THRESHOLD_RULES,
    ("Decision", "trigger"): TRIGGERS,
    ("Intervention", "ranking"): RANKINGS,
    ("Gatekeeper", "budget"): BUDGETS,
    ("Gatekeeper", "rule"): RULES,
    ("Gatekeeper", "solver"): SOLVERS,
    ("Choice", "source"): SOURCES,
}
_REGISTERED = {("Uav", "task"): UAV_TASKS, ("Gatekeeper", "route"): ROUTES, ("Policy", "name"): POLICIES}
_EXPECTED = {("Run", "expected"): RUN_CLAIMS, ("Scenario", "expected"): MODEL_CLAIMS}
_MOST = {"stages": MAX_STAGES}
_MOST_ENTRIES = {"ugvs": {"maxProperties": MAX_UGVS}}
_AT_LEAST_ONE = {"ugvs", "runs", "paper"}


def text(*, installed: bool = True) -> str:
    """`scenario_schema` as a file."""
    return json.dumps(scenario_schema(installed=installed), indent=1) + "\n"


def scenario_schema(*, installed: bool = True) -> Schema:
    """The schema of a scenario file.

    Args:
        installed: whether it has the names that installed packages add through entry points, besides our own.
    """
    kinds = [kind for _, kind in inspect.getmembers(schema, inspect.isclass) if kind.__module__ == schema.__name__]
    top = _object(schema.Scenario, installed)
    top["patternProperties"] = {"^_": {"description": "A template, for anchors and aliases."}}
    return {"$schema": DIALECT, "title": "Scenario of airground_drake", **top} | {
        "$defs": {kind.__name__: _object(kind, installed) for kind in kinds if kind is not schema.Scenario}
    }


def says_of_keys() -> dict[tuple[str, str], str]:
    """What the text below each field of the dataclasses says, by class and field."""
    found = {}
    for kind in ast.parse(inspect.getsource(schema)).body:
        for field, below in zip(getattr(kind, "body", []), getattr(kind, "body", [])[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(kind, ast.ClassDef):
                found[kind.name, ast.unparse(field.target)] = str(ast.literal_eval(below.value))
    return found


def _object(kind: type, installed: bool) -> Schema:
    """A dataclass."""
    says = says_of_keys()
    properties = {}
    for field in fields(kind):
        unit = unit_of(field.name)
        described = f"{says[kind.__name__, field.name]}{f' [{unit}]' if unit else ''}"
        value = _value(kind.__name__, field, installed)
        properties[field.name] = {"description": described, **value, **_default(field)}
    return {
        "type": "object",
        "description": " ".join((kind.__doc__ or "").split()),
        "properties": {**properties, "<<": True},
        "required": [field.name for field in fields(kind) if "required" in field.metadata],
        "additionalProperties": False,
    }


def _default(field: Field[Any]) -> Schema:
    if "required" in field.metadata:
        return {}
    if field.default is not MISSING:
        return {"default": field.default}
    return {"default": [] if get_origin(field.type) is list else {}}


def _value(kind: str, field: Field[Any], installed: bool) -> Schema:
    """What may stand under a key."""
    place = (kind, field.name)
    if place in _ONE_OF:
        return {"enum": [*_ONE_OF[place]]}
    if place in _REGISTERED:
        return {"anyOf": [{"enum": _names(_REGISTERED[place], installed)}, _PLUGIN]}
    if place in _EXPECTED:
        return _expectations(_EXPECTED[place], installed)
    if place == ("Scenario", "claims"):
        return {"type": "object", "patternProperties": {CLAIM_PATTERN: _PLUGIN}, "additionalProperties": False}
    if place == ("Run", "set"):
        return {"type": "object", "propertyNames": {"pattern": _SET_KEY}, "additionalProperties": _ONE_VALUE}
    if field.type is int:
        least, most = int(field.default != 0), _MOST.get(field.name, MAX_SEED)
        return {"type": "integer", "minimum": least, "maximum": most}
    if field.type is float:
        return {"type": "number", "minimum": 0 if "from_zero" in field.metadata else SMALLEST, "maximum": LARGEST}
    if field.name == "name":
        return _NAME
    typed = _typed(field.type, field.name)
    if field.type == schema.Vector and "required" not in field.metadata:
        return typed | {"minItems": 0}
    return typed


_SET_KEY = rf"^(({'|'.join(SETTABLE)})\..+|<<)$"
_ONE_VALUE: Schema = {"type": ["number", "string", "boolean"]}
_PLUGIN: Schema = {"type": "string", "pattern": PLUGIN_PATTERN}
_NAME: Schema = {"type": "string", "pattern": NAME_PATTERN, "maxLength": MAX_NAME}
_PLAIN: dict[Any, Schema] = {
    bool: {"type": "boolean"},
    str: {"type": "string", "maxLength": MAX_TEXT},
    float: {"type": "number", "minimum": -LARGEST, "maximum": LARGEST},
}


def _typed(hint: Any, name: str) -> Schema:
    """A value of this type under a key of this name, whose unit tells points from other lists of numbers."""
    if hint in _PLAIN:
        return _PLAIN[hint]
    if is_dataclass(hint):
        return {"$ref": f"#/$defs/{getattr(hint, '__name__', '')}"}
    item = _typed(get_args(hint)[-1], name)
    some = int(name in _AT_LEAST_ONE)
    if get_origin(hint) is dict:
        entries = {"minProperties": some, **_MOST_ENTRIES.get(name, {})}
        return {"type": "object", "propertyNames": _NAME_OR_MERGE, "additionalProperties": item, **entries}
    if hint == schema.Vector and unit_of(name) == "m":
        return {"type": "array", "items": item, "minItems": 3, "maxItems": 3}
    return {"type": "array", "items": item, "minItems": 2 if name == "waypoints_m" else some}


_NAME_OR_MERGE = {"anyOf": [_NAME, {"const": "<<"}]}


def _expectations(claims: Registry, installed: bool) -> Schema:
    """Expected verdicts by claim."""
    one = "|".join(EXPECTATIONS)
    verdict = {"anyOf": [{"enum": [*EXPECTATIONS]}, {"type": "string", "pattern": f"^({one})( or ({one}))*$"}]}
    return {
        "type": "object",
        "properties": {
            **{name: {"description": claims.says(name), **verdict} for name in _names(claims, installed)},
            "<<": True,
        },
        "patternProperties": {CLAIM_PATTERN: verdict},
        "additionalProperties": False,
    }


def _names(registry: Registry, installed: bool) -> list[str]:
    return [*registry] if installed else [*registry.own]
