"""Nodes of a document as objects of a schema: each is checked against a type hint and built; one can be replaced."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any, NoReturn, get_args, get_origin

import yaml

from airground_drake.errors import Fault, ScenarioError
from airground_drake.scenarios import validate
from airground_drake.scenarios.document import TAG, Children, entries_of, suggestion, value_of, where

_WANTED = {
    str: "text (in quotes where it looks like a number)",
    bool: "true or false",
    int: "a whole number",
    float: "a number",
}


def made(node: yaml.Node, hint: Any, key: str, name: str) -> Any:
    """A node as an object of the type that the hint says; `name` is the key whose suffix gives the unit."""
    if hint in _WANTED:
        value = value_of(node)
        if hint is float and type(value) is int:
            return float(value) if abs(value) < 1e300 else math.inf
        if type(value) is not hint:
            raise ScenarioError(where(node), key, value, _wanted(hint, name))
        return value
    if hint is Any:
        if isinstance(value := value_of(node), Fault):
            raise ScenarioError(where(node), key, value, "wanted: one value: a number, a text, true or false")
        return value
    children = _children(node, hint, key, name)
    if not (isinstance(hint, type) and dataclasses.is_dataclass(hint)):
        item, named = get_args(hint)[-1], get_origin(hint) is dict and not validate.unit_of(name)
        data = {
            part: made(child, item, validate.dotted(key, part), part if named else name)
            for part, (_, child) in children.items()
        }
        return data if get_origin(hint) is dict else list(data.values())
    hints = _hints(hint)
    for part, (name_node, _) in children.items():
        if part not in hints and (key or not part.startswith("_")):
            _unknown(name_node, key, part, hints)
    for part in (each.name for each in dataclasses.fields(hint) if "required" in each.metadata):
        if part not in children:
            new = f", as {key} is new" * where(node).startswith("--set ")
            raise ScenarioError(
                where(node), validate.dotted(key, part), Fault("missing"), _wanted(hints[part], part) + new
            )
    values = {
        part: made(child, hints[part], validate.dotted(key, part), part)
        for part, (_, child) in children.items()
        if part in hints
    }
    return hint(**values)


def replaced(node: yaml.Node | None, hint: Any, parts: list[str], key: str, new: yaml.Node) -> yaml.Node:
    """A node in which another stands at the place of the dotted parts below `key`; the node itself is left as it is."""
    if not parts:
        return new
    part, *rest = parts if hint != dict[str, Any] else [".".join(parts)]  # whose keys have dots
    children = {} if node is None or hint in _WANTED else _children(node, hint, key, key.rpartition(".")[2])
    options = _hints(hint) if dataclasses.is_dataclass(hint) else {name: get_args(hint)[-1] for name in children}
    if part and get_origin(hint) is dict:
        options[part] = get_args(hint)[-1]  # what the entries of a mapping are called is the scenario's to choose
    if part not in options:
        _unknown(new, key, part, options)
    name, child = children.get(part, (None, None))
    if name is None or not rest:
        name = yaml.ScalarNode(f"{TAG}str", part, new.start_mark, new.end_mark)
    children[part] = (name, replaced(child, options[part], rest, validate.dotted(key, part), new))
    marks = (node or new).start_mark, (node or new).end_mark
    if get_origin(hint) is list:
        return yaml.SequenceNode(f"{TAG}seq", [child for _, child in children.values()], *marks)
    return yaml.MappingNode(f"{TAG}map", list(children.values()), *marks)


def _children(node: yaml.Node, hint: Any, key: str, name: str) -> Children:
    """Entries of the mapping, or items of the list, that the hint asks for."""
    kind, tag = (yaml.SequenceNode, "seq") if get_origin(hint) is list else (yaml.MappingNode, "map")
    if isinstance(node, kind) and node.tag == TAG + tag:
        return entries_of(node, key)
    raise ScenarioError(where(node), key, value_of(node), _wanted(hint, name))


def _hints(cls: Any) -> dict[str, Any]:
    return {field.name: field.type for field in dataclasses.fields(cls)}


def _wanted(hint: Any, name: str) -> str:
    if dataclasses.is_dataclass(hint):
        return f"wanted: a mapping with the keys {', '.join(_hints(hint))}"
    if hint in _WANTED:
        return f"wanted: {_WANTED[hint]}{validate.unit_of(name, ' in ')}"
    return f"wanted: {'a mapping' if get_origin(hint) is dict else 'a list'}{validate.unit_of(name, ' in ')}"


def _unknown(node: yaml.Node, key: str, part: str, options: Iterable[str]) -> NoReturn:
    if validate.dotted(key, part) in validate.RETIRED_KEYS:
        raise ScenarioError(
            where(node), validate.dotted(key, part), Fault("no longer a key"), validate.RETIRED_KEYS[f"{key}.{part}"]
        )
    wanted = f"{suggestion(part, options)}allowed: {', '.join(options) or 'none'}"
    raise ScenarioError(where(node), validate.dotted(key, part), Fault("unknown key"), wanted)
