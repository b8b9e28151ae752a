"""Dataclasses filled with the data of a document by pydantic; every mistake becomes one line."""

from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.scenario import json_schema
from airground_drake.scenario.document import UNKNOWN_KEY, Document, suggestion, unknown
from airground_drake.scenario.recorded import adapter


def filled(kind: type, document: Document) -> Any:
    try:
        return adapter(kind).validate_python(document.data)
    except ValidationError as error:
        first = min(error.errors(include_url=False), key=_rank)
        raise _in_words(first, document, json_schema.schema_of(kind)) from None


_UNKNOWN = ("unexpected_keyword_argument", "invalid_key")


def _rank(error: ErrorDetails) -> int:
    """Rank of an error; the lowest is shown. An unknown key comes first: it may be a misspelt one that is missing."""
    return 0 if error["type"] in _UNKNOWN else 1 if error["type"] == "missing" else 2


def _in_words(error: ErrorDetails, document: Document, schema: json_schema.Schema) -> ScenarioError:
    """An error of pydantic as one line: place, key, value, and what is allowed."""
    kind = error["type"]
    given = error["input"]
    says = error.get("ctx", {})
    loc = [str(part) for part in error["loc"]]
    if json_schema.kinds_at(schema, *loc[:-1]):  # it is no mapping that could have a kind
        del loc[-1]
    at = _as_written(document.data, [part for part in (*loc, *says.get("at", ())) if part != json_schema.NAMES])
    of_type = kind.endswith(("_type", "missing"))  # the message names the line of the value, not of its key
    key, source = ".".join(at), document.where(*at, key=not of_type)
    if kind == "rule":
        return ScenarioError(source, key, says["value"], says["allowed"])
    if kind in _UNKNOWN:
        options, kinds = json_schema.keys_at(schema, *loc[:-1]), json_schema.kinds_at(schema, *loc[:-2])
        return _of_another_kind(source, key, loc[-2], kinds) if kinds else unknown(source, key, at[-1], options)
    place = loc[:-2] + loc[-1:] if loc[-1:] == [json_schema.NAMES] else loc
    wanted = f"wanted: {json_schema.wanted_at(schema, *place)}"
    if kind == "missing":
        wanted += f", as {'.'.join(at[:-1])} is new" if source.startswith("--set ") else ""
        return ScenarioError(source, key, Fault("missing"), wanted)
    if given is None:
        given = Fault("no value is given")
    elif isinstance(given, dict):
        given = Fault("a mapping is given" if of_type else f"{len(given)} entries")
    elif isinstance(given, list) and of_type:
        given = Fault("a list is given")
        if "mapping" in wanted and "keys" not in wanted:
            wanted += "; write NAME: {...} for each entry, without a dash"
    return ScenarioError(source, key, given, wanted)


def _of_another_kind(source: str, key: str, kind: str, kinds: dict[str, list[str]]) -> ScenarioError:
    """The error of a key that a mapping of its kind does not have; all kinds with their keys."""
    part = key.rpartition(".")[2]
    default = f"{kind}, the default" if kind == next(iter(kinds)) else kind
    others = [name for name, keys in kinds.items() if part in keys]
    hint = f"it is a key of {' and '.join(others)}; " if others else suggestion(part, kinds[kind])
    return ScenarioError(source, key, UNKNOWN_KEY, f"{hint}keys of {default}: {', '.join(kinds[kind])}")


def _as_written(data: Any, at: list[str]) -> list[str]:
    """The path to a value without pydantic's additions: kinds, and the index 0 of a mapping in place of a list."""
    written = list[str]()
    for k, part in enumerate(at):
        if isinstance(data, dict):
            if part not in data and k < len(at) - 1:
                continue
            data = data.get(part)
        elif isinstance(data, list):
            data = data[int(part)] if part.isdecimal() and int(part) < len(data) else None
        written.append(part)
    return written
