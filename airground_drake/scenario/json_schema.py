"""The JSON Schema (draft 2020-12) of scenario files, made by pydantic from `schema.py`, for editors, messages and docs.

It states types, units, defaults, bounds and allowed names, key by key. `validate.py` checks how values go together: it
may refuse a file that the schema accepts, never the other way round (with merge keys expanded).
"""

import ast
import functools
import inspect
import json
import textwrap
from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from itertools import pairwise
from typing import Any

from pydantic import TypeAdapter

from airground_drake.base.limits import MAX_NAME, MAX_SEED, MAX_TEXT
from airground_drake.base.registry import PLANTS, RUN_CLAIMS, Registry
from airground_drake.base.statuses import COUNTS, EXPECTATIONS, NOTHING
from airground_drake.base.values import NAME_PATTERN, WANTED
from airground_drake.scenario import schema
from airground_drake.scenario.kinds import CLAIM_PATTERN, EXPECTED, unit_of
from airground_drake.scenario.plants import KEYS, OWN

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"

NAMES = "[key]"  # pydantic's word, in the place of an error, for a name of a mapping

NULL = {"type": "null"}

_NAMES = {"anyOf": [{"type": "string", "pattern": NAME_PATTERN, "maxLength": MAX_NAME}, {"const": "<<"}]}


def text(*, installed: bool = True) -> str:
    return json.dumps(scenario_schema(installed=installed), indent=1) + "\n"


def scenario_schema(*, installed: bool = True) -> Schema:
    made = _adapted(TypeAdapter(schema.Scenario).json_schema(), installed)
    kinds = {name: _object(class_of(name), made["$defs"][name]) for name in sorted(made["$defs"])}
    top = _object(schema.Scenario, made)
    top["patternProperties"] = {"^_": {"description": "A template, for anchors and aliases."}}
    return {"$schema": DIALECT, "title": "Scenario of airground_drake", **top, "$defs": kinds}


def class_of(name: str) -> type:
    return next((keys for keys in KEYS.values() if keys.__name__ == name), None) or getattr(schema, name)


def _adapted(part: Any, installed: bool) -> Any:
    """A part of pydantic's schema with the names of registries, with merge keys among free names, without titles."""
    if isinstance(part, Registry):
        return [*part] if installed else [*part.own]
    if isinstance(part, list):
        return [kept for kept in (_adapted(item, installed) for item in part) if kept != {"enum": []}]
    if not isinstance(part, dict):
        return part
    says = {name: _adapted(of, installed) for name, of in part.items() if name != "title" or isinstance(of, dict)}
    if entries := says.get("patternProperties", {}).pop(NAME_PATTERN, None):
        del says["patternProperties"]
        says |= {"propertyNames": _NAMES, "additionalProperties": entries}
    if claims := part.get(EXPECTED):
        del says[EXPECTED]
        says |= _expectations(claims, installed)
    return says


def _expectations(claims: Registry, installed: bool) -> Schema:
    pattern = "^({0})( or ({0}))*$".format("|".join(EXPECTATIONS))
    verdict = {"anyOf": [{"enum": [*EXPECTATIONS, NOTHING]}, {"type": "string", "pattern": pattern}]}
    known: Schema = {name: {"description": claims.says(name), **verdict} for name in _adapted(claims, installed)}
    if claims is RUN_CLAIMS:
        number: Schema = {"type": "integer", "minimum": 1, "maximum": MAX_SEED}
        known |= {name: {"description": says} | number for name, says in COUNTS.items()}
    return {
        "properties": {**known, "<<": True},
        "patternProperties": {CLAIM_PATTERN: verdict},
        "additionalProperties": False,
    }


def _object(kind: type, made: Schema) -> Schema:
    """The schema of a dataclass: its keys in order, with descriptions, units and defaults."""
    properties: Schema = {}
    words = _words_of(kind)
    for field in fields(kind):
        says = dict(sorted({**made["properties"][field.name], "description": words[field.name]}.items()))
        properties[field.name] = says
        if unit := unit_of(field.name):
            says["description"] += f" [{unit}]"
        if field.default_factory is not MISSING:
            types = says.get("type"), *(choice.get("type") for choice in says.get("anyOf", ()))
            says["default"] = [] if "array" in types else {}
    return {
        "type": "object",
        "description": " ".join(made["description"].split()),
        "properties": {**properties, "<<": True},
        "required": made.get("required", []),
        "additionalProperties": False,
    }


def _words_of(kind: type) -> dict[str, str]:
    """What is written below each field of a dataclass; pydantic would read all sources whenever a file is loaded."""
    words: dict[str, str] = {}
    for base in (base for base in reversed(kind.__mro__) if is_dataclass(base)):
        tree = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        assert isinstance(tree, ast.ClassDef)
        for line, below in pairwise(tree.body):
            if (
                isinstance(line, ast.AnnAssign)
                and isinstance(below, ast.Expr)
                and isinstance(below.value, ast.Constant)
            ):
                words[ast.unparse(line.target)] = inspect.cleandoc(str(below.value.value))
    return words


def keys_at(whole: Schema, *at: str) -> list[str]:
    """Keys of the mapping at a place in a file with this schema; `at` has the names and indices that lead there."""
    return [key for key in _at(whole, at)[0]["properties"] if key != "<<"]


def kinds_at(whole: Schema, *at: str) -> dict[str, list[str]]:
    """Keys of the mappings among which a kind chooses at a place in a file with this schema, by kind; {} elsewhere."""
    parts = [whole["$defs"][choice["$ref"].rpartition("/")[2]] for choice in _at(whole, at)[0].get("oneOf", ())]
    return {kind_of(part): [key for key in part["properties"] if key != "<<"] for part in parts}


def kind_of(part: Schema) -> str:
    """The kind of a mapping, as pydantic names it in the place of an error."""
    return str(part["properties"]["kind"].get("const", OWN))


def wanted_at(whole: Schema, *at: str) -> str:
    """The values that are allowed at a place in a file with this schema, in words."""
    says, name = _at(whole, at)
    kind, unit = says.get("type", "string"), unit_of(name, " in ")
    if WANTED in says:
        return str(says[WANTED])
    if "oneOf" in says:
        return f"a mapping with a kind, one of {', '.join(PLANTS.allowed)}, and its keys"
    if "properties" in says:
        return f"a mapping with the keys {', '.join(keys_at(whole, *at))}"
    if kind in ("array", "object"):
        what, size = ("list", "Items") if kind == "array" else ("mapping", "Properties")
        least, most = says.get(f"min{size}"), says.get(f"max{size}")
        if least == most == 3:
            return f"3 numbers{unit}: [x, y, z]"
        span = least if least == most else f"{least} to {most}" if most else f"{least} or more"
        many = f" of {span} entries" if least or most else ""
        return f"a {what}{many}{unit}"
    return {
        "number": "a number{unit} from {minimum:g} to {maximum:g}",
        "integer": "a whole number from {minimum} to {maximum}",
        "boolean": "true or false",
        "string": "a name of at most {maxLength} of a-z, A-Z, 0-9 and _, no digit first"
        if says.get("pattern") == NAME_PATTERN
        else "text of at most {maxLength} characters (in quotes where it looks like a number)",
    }[kind].format(unit=unit, **{"maxLength": MAX_TEXT, **says})


@functools.cache
def schema_of(kind: type) -> Schema:
    """The schema of the files of a dataclass; do not change it."""
    return scenario_schema() if kind is schema.Scenario else TypeAdapter(kind).json_schema()


def _at(whole: Schema, at: Sequence[str]) -> tuple[Schema, str]:
    """The schema at a place, and the name whose suffix gives the unit."""
    says, name = whole, ""
    for part in at:
        if part.isdecimal() and says.keys() & {"properties", "oneOf"}:  # one entry of a list may stand for the list
            continue
        if "oneOf" in says:
            parts = (whole["$defs"][choice["$ref"].rpartition("/")[2]] for choice in says["oneOf"])
            says = next(choice for choice in parts if kind_of(choice) == part)
            continue
        inner = says.get("properties", {}).get(part)
        if inner is not None or not unit_of(name):
            name = name if part.isdecimal() else part
        if part == NAMES:
            inner = says["propertyNames"]["anyOf"][0]
        says = inner or says.get("items") or says.get("additionalProperties") or {}
        says = given(says)
        says = whole["$defs"][says["$ref"].rpartition("/")[2]] if "$ref" in says else says
    return says, name


def given(says: Schema) -> Schema:
    """The schema of the mapping that may stand at a place, or of what may stand there besides null."""
    kinds = says.get("anyOf", ())
    mapping = next((kind for kind in kinds if kind.keys() & {"$ref", "oneOf"}), says)
    return next(kind for kind in kinds if kind != NULL) if mapping is says and NULL in kinds else mapping
