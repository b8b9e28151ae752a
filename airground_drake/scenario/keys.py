"""Every key of a scenario file, what is allowed there and what it means, from the JSON Schema."""

import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from airground_drake.base.arrays import LARGEST
from airground_drake.base.registry import PLUGIN
from airground_drake.scenario.json_schema import Schema, given, kind_of

MOST = {"exclusiveMaximum": "below", "maximum": "at most"}


class Entry(NamedTuple):
    """A key: its name in its section, what may stand there with the default, and its meaning."""

    key: str
    allowed: str
    says: str


class Section(NamedTuple):
    """A mapping of the file: its dotted key (NAME for a free name, N for an index), its meaning, and its keys."""

    path: str
    says: str
    entries: list[Entry]
    kind: str = ""  # of mappings of several kinds: which of them

    @property
    def title(self) -> str:
        return f"{self.path}: {self.kind}" if self.kind else self.path


def sections(schema: Schema) -> Iterator[Section]:
    """The sections of a file with this schema (see `json_schema.scenario_schema`), those within others after them."""
    yield from _sections(schema, schema, "")


def _sections(schema: Schema, part: Schema, path: str, kind: str = "") -> Iterator[Section]:
    keys = [(key, says) for key, says in part["properties"].items() if key != "<<"]
    entries = [Entry(key, _allowed(key, part), says["description"]) for key, says in keys]
    yield Section(path, part["description"], entries, kind)
    for key, says in keys:
        for where, below in (
            ("", given(says)),
            (".NAME", says.get("additionalProperties") or {}),
            (".N", says.get("items") or {}),
        ):
            if key == "uavs":  # with the keys of `uav`
                continue
            for choice in below.get("oneOf", [below] if "$ref" in below else []):
                inner = schema["$defs"][choice["$ref"].rpartition("/")[2]]
                of = kind_of(inner) if "oneOf" in below else ""
                yield from _sections(schema, inner, f"{path}.{key}{where}".lstrip("."), of)


def _allowed(key: str, part: Schema) -> str:
    """What may stand under a key, and its default."""
    says = part["properties"][key] | given(part["properties"][key])
    words = [_kind(says)]
    if says.get("type") == "number":
        words += ["0 or more"] if says["minimum"] == 0.0 else ["above 0"] if says["minimum"] > 0.0 else []
        words += [
            f"{most} {says[name]:g}"
            for name, most in MOST.items()
            if 0.0 <= says["minimum"] < says.get(name, LARGEST) < LARGEST
        ]
    if says.get("type") == "integer":
        words.append(f"{says['minimum']} to {says['maximum']}")
    if "default" in says and says["default"] not in ({}, [], "", None):
        words.append(f"default {json.dumps(says['default'])}")
    elif key in part["required"]:
        words.append("needed")
    return ", ".join(words)


def _kind(says: dict[str, Any]) -> str:
    says = given(says)
    if "anyOf" in says:
        return ", ".join([*(_kind(choice) for choice in says["anyOf"] if "enum" in choice), PLUGIN])
    if "enum" in says:
        return "one of " + ", ".join(f"`{name}`" for name in says["enum"])
    if "const" in says:
        return f"`{says['const']}`"
    if says.keys() & {"$ref", "oneOf"}:
        return "a mapping, see below"
    if says["type"] == "array":
        plural = re.sub(r"^(?:a |)((?:whole )?\w+)", r"\1s", _kind(says["items"]))
        return "a point, [x, y, z]" if says.get("maxItems") == 3 else f"a list of {plural}"
    if says["type"] == "object":
        return "a mapping by name"
    return {"number": "a number", "integer": "a whole number", "boolean": "true or false", "string": "text"}[
        says["type"]
    ]
