"""From the name or file of a scenario to a validated `Scenario`; every mistake becomes one line.

The YAML text is composed to nodes, which know their line; `--set` replaces nodes; the nodes are checked against
the type hints of the schema, whose dataclasses are built as they are; `validate.py` checks the meaning.
Scalars are read by the rules of YAML 1.2 (`1e-3` is a number, `yes` and `1:30` are text). Anchors, merge keys
(`<<`) and templates under top-level keys that begin with an underscore work as in Drake's own files.
"""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NoReturn, get_args, get_origin

import numpy as np
import yaml

from airground_drake import files
from airground_drake.errors import Fault, ScenarioError, short
from airground_drake.scenarios import validate
from airground_drake.scenarios.schema import Scenario
from airground_drake.scenarios.shipped import shipped, shipped_files

__all__ = ["from_data", "load", "resolved", "shipped", "validated"]

MAX_BYTES = 2**20
MAX_VALUES = 50_000
"""Values of a scenario with every alias and merge expanded."""
MAX_DEPTH = 100
"""Of values within values."""
NO_LINE = -1
"""Line of what was made in Python."""

_TAG = "tag:yaml.org,2002:"
_SCALARS: dict[str, tuple[str | None, Callable[[str], object]]] = {  # tag: its plain scalars, conversion
    "null": (r"~|null|Null|NULL|", lambda _: None),
    "bool": (r"true|True|TRUE|false|False|FALSE", lambda text: text.lower() == "true"),
    "int": (r"[-+]?[0-9]+", int),
    "float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    ),
    "str": (None, lambda text: text.encode().decode()),  # refuses lone surrogates
}
_WANTED = {
    str: "text (in quotes where it looks like a number)",
    bool: "true or false",
    int: "a whole number",
    float: "a number",
}

Children = dict[str, tuple[yaml.Node, yaml.Node]]
"""Key node (for its line) and value node of each entry."""


class _Loader(yaml.BaseLoader):
    """Composes nodes whose scalars are tagged by the rules of YAML 1.2; stops when there are too many."""

    count, depth = 0, 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """A node and those within it.

        Raises:
            ScenarioError: if the document has more of them than MAX_VALUES, or deeper ones than MAX_DEPTH.
        """
        self.count, self.depth = self.count + 1, self.depth + 1
        if self.count > MAX_VALUES or self.depth > MAX_DEPTH:
            raise _excess(f"{self.name}:{self.line + 1}", deep=self.depth > MAX_DEPTH)
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node


for _name, (_pattern, _) in _SCALARS.items():
    if _pattern is not None:
        _Loader.add_implicit_resolver(_TAG + _name, re.compile(rf"(?:{_pattern})\Z"), None)


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
    source, data = _read_bytes(str(name_or_path))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{source}:{line}", "", Fault("not UTF-8 text"), "wanted: a YAML file") from None
    texts = _texts(overrides)
    root = _compose(text, source)
    for override in texts:
        _expanded(root)
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
    try:
        root = _node(data, source)
    except RecursionError:
        raise _excess(source, deep=True) from None
    for override in _texts(overrides):
        root = _override(root, override)
    return _build(root, source)


def _build(root: yaml.Node, source: str) -> Scenario:
    """The scenario of a document, checked."""
    _expanded(root)
    scenario: Scenario = _made(root, Scenario, "", "")
    try:
        validate.check(scenario, source)
    except ScenarioError as error:
        raise ScenarioError(_where(_nearest(root, error.key)), error.key, error.value, error.allowed) from None
    return scenario


def _expanded(root: yaml.Node) -> None:
    """Count the values of a document with its aliases and merges expanded, looking at each node once.

    Raises:
        ScenarioError: if there are more than MAX_VALUES or deeper ones than MAX_DEPTH; one that holds itself is.
    """
    counted: dict[int, tuple[int, int]] = {}

    def count(node: yaml.Node, above: int) -> tuple[int, int]:
        """Number of values in a node, itself among them, and of levels."""
        if id(node) not in counted and above < MAX_DEPTH:
            within = [count(child, above + 1) for child in _within(node)]
            counted[id(node)] = 1 + sum(n for n, _ in within), 1 + max((levels for _, levels in within), default=0)
        values, levels = counted.get(id(node), (1, 1))
        if values > MAX_VALUES or above + levels > MAX_DEPTH:
            raise _excess(_where(node), deep=above + levels > MAX_DEPTH)
        return values, levels

    count(root, 0)


def _within(node: yaml.Node) -> Iterable[yaml.Node]:
    """Nodes of the items of a list, or of the keys and values of a mapping."""
    if isinstance(node, yaml.MappingNode):
        return itertools.chain.from_iterable(node.value)
    return node.value if isinstance(node, yaml.SequenceNode) else ()


def _excess(where: str, *, deep: bool) -> ScenarioError:
    if deep:
        return ScenarioError(where, "", Fault("nested too deeply"), f"at most {MAX_DEPTH} levels are allowed")
    allowed = f"at most {MAX_VALUES} are allowed, with aliases and merges expanded"
    return ScenarioError(where, "", Fault("too many values"), allowed)


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
            texts.append(f"{key}={json.dumps(_simple(value))}")
        except (TypeError, ValueError) as error:
            raise ScenarioError(
                "override", str(key), Fault(str(error)), "wanted: a number, text, list or dict"
            ) from None
    return texts


def _simple(value: Any) -> Any:
    """Values of numpy, and tuples, as what YAML knows."""
    if isinstance(value, Mapping):
        return {name: _simple(each) for name, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _simple(value.tolist())
    return [_simple(each) for each in value] if isinstance(value, list | tuple) else value


def _node(value: Any, source: str) -> yaml.Node:
    """A value made in Python as a node of a document; what YAML has no word for is a node of its own tag."""
    mark = yaml.Mark(source, 0, NO_LINE, 0, None, 0)
    value = _simple(value)
    if isinstance(value, dict):
        pairs = [(_node(name, source), _node(each, source)) for name, each in value.items()]
        return yaml.MappingNode(f"{_TAG}map", pairs, mark, mark)
    if isinstance(value, list):
        return yaml.SequenceNode(f"{_TAG}seq", [_node(each, source) for each in value], mark, mark)
    kinds = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
    text = repr(value).replace("inf", ".inf").replace("nan", ".nan") if isinstance(value, float) else str(value)
    return yaml.ScalarNode(_TAG + kinds.get(type(value), type(value).__name__), text, mark, mark)


def read_data(path: Path) -> tuple[Any, str]:
    """Another YAML file of ours as nested dicts, lists and scalars, by the rules and limits of scenario files.

    Returns:
        The data, None where no value is given, and the SHA-256 of the file's bytes.

    Raises:
        ScenarioError: if it cannot be read.
    """
    source, data = _read_bytes(str(path))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError(source, "", Fault("not UTF-8 text"), "wanted: a YAML file") from None
    root = _compose(text, source)
    _expanded(root)
    return _plain(root, ""), files.sha256(data)


def _plain(node: yaml.Node, key: str) -> Any:
    """What a node stands for."""
    if isinstance(node, yaml.ScalarNode):
        value = _value(node)
        if isinstance(value, Fault) and node.tag != f"{_TAG}null":
            raise ScenarioError(_where(node), key, value, "wanted: plain YAML")
        return None if isinstance(value, Fault) else value
    entries = {name: _plain(child, validate.dotted(key, name)) for name, (_, child) in _entries(node, key).items()}
    return list(entries.values()) if isinstance(node, yaml.SequenceNode) else entries


def resolved(scenario: Scenario) -> dict[str, Any]:
    """The scenario as nested dicts and lists, defaults filled in.

    Raises:
        TypeError: if it is none.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"{type(scenario).__name__} is no Scenario")
    return dataclasses.asdict(scenario)


def _read_bytes(name_or_path: str) -> tuple[str, bytes]:
    """Path and content of a scenario; a shipped scenario's name has precedence."""
    file: Traversable = shipped_files().get(name_or_path, Path(name_or_path))
    source = str(file)
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        close = _suggestion(name_or_path, shipped())
        wanted = f"{close}wanted: the path of a YAML file, or a shipped scenario: {', '.join(shipped())}"
        raise ScenarioError(name_or_path, "", Fault("no such scenario or file"), wanted) from None
    except (OSError, ValueError) as error:
        fault = Fault(f"cannot be read ({getattr(error, 'strerror', None) or error})")
        raise ScenarioError(source, "", fault, "wanted: a readable YAML file") from None
    if len(data) > MAX_BYTES:
        raise ScenarioError(source, "", Fault("too large"), f"at most {MAX_BYTES} bytes are allowed")
    return source, data


def _compose(text: str, source: str) -> yaml.Node:
    """Nodes of a YAML document whose marks bear the source's name."""
    try:
        loader = _Loader(text)
        loader.name = source
        root: yaml.Node | None = loader.get_single_node()
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # the latter from escapes such as "\U99999999"
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark else text.count("\n", 0, getattr(error, "position", 0)) + 1
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or error
        raise ScenarioError(f"{source}:{line}", "", Fault(f"not YAML: {problem}"), "wanted: YAML text") from None
    if root is None:
        raise ScenarioError(source, "", Fault("empty"), "wanted: YAML text")
    return root


def _override(root: yaml.Node, override: str) -> yaml.Node:
    """The document with one value replaced; the document itself is left as it is, as aliases may share nodes."""
    source = f"--set {short(override)}"
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise ScenarioError(source, "", override, "wanted: dotted.key=value, such as control.period_s=0.05")
    return _replace(root, Scenario, key.strip().split("."), "", _compose(value, source))


def _replace(node: yaml.Node | None, hint: Any, parts: list[str], key: str, new: yaml.Node) -> yaml.Node:
    if not parts:
        return new
    part, *rest = parts
    children = {} if node is None or hint in _WANTED else _children(node, hint, key, key.rpartition(".")[2])
    options = _hints(hint) if dataclasses.is_dataclass(hint) else {name: get_args(hint)[-1] for name in children}
    if part and get_origin(hint) is dict:
        options[part] = get_args(hint)[-1]  # what the entries of a mapping are called is the scenario's to choose
    if part not in options:
        _unknown(new, key, part, options)
    name, child = children.get(part, (None, None))
    if name is None or not rest:
        name = yaml.ScalarNode(f"{_TAG}str", part, new.start_mark, new.end_mark)
    children[part] = (name, _replace(child, options[part], rest, validate.dotted(key, part), new))
    marks = (node or new).start_mark, (node or new).end_mark
    if get_origin(hint) is list:
        return yaml.SequenceNode(f"{_TAG}seq", [child for _, child in children.values()], *marks)
    return yaml.MappingNode(f"{_TAG}map", list(children.values()), *marks)


def _made(node: yaml.Node, hint: Any, key: str, name: str) -> Any:
    """A node as an object of the type that the hint says; `name` is the key whose suffix gives the unit."""
    if hint in _WANTED:
        value = _value(node)
        if hint is float and type(value) is int:
            return float(value) if abs(value) < 1e300 else math.inf
        if type(value) is not hint:
            raise ScenarioError(_where(node), key, value, _wanted(hint, name))
        return value
    children = _children(node, hint, key, name)
    if not (isinstance(hint, type) and dataclasses.is_dataclass(hint)):
        item, named = get_args(hint)[-1], get_origin(hint) is dict and not validate.unit_of(name)
        data = {
            part: _made(child, item, validate.dotted(key, part), part if named else name)
            for part, (_, child) in children.items()
        }
        return data if get_origin(hint) is dict else list(data.values())
    hints = _hints(hint)
    for part, (name_node, _) in children.items():
        if part not in hints and (key or not part.startswith("_")):
            _unknown(name_node, key, part, hints)
    for part in (each.name for each in dataclasses.fields(hint) if "required" in each.metadata):
        if part not in children:
            new = f", as {key} is new" * _where(node).startswith("--set ")
            raise ScenarioError(
                _where(node), validate.dotted(key, part), Fault("missing"), _wanted(hints[part], part) + new
            )
    values = {
        part: _made(child, hints[part], validate.dotted(key, part), part)
        for part, (_, child) in children.items()
        if part in hints
    }
    return hint(**values)


def _hints(cls: Any) -> dict[str, Any]:
    return {field.name: field.type for field in dataclasses.fields(cls)}


def _value(node: yaml.Node) -> object:
    """Value of a scalar node; a `Fault` that says what it is for any other."""
    tag = node.tag.removeprefix(_TAG)
    if not isinstance(node, yaml.ScalarNode) or tag not in _SCALARS:
        return Fault({"map": "a mapping is given", "seq": "a list is given"}.get(tag, f"the tag {tag} is given"))
    try:
        value = _SCALARS[tag][1](node.value)
    except ValueError:
        return Fault("a value is given that cannot be read")
    return Fault("no value is given") if value is None else value


def _children(node: yaml.Node, hint: Any, key: str, name: str) -> Children:
    """Entries of the mapping, or items of the list, that the hint asks for."""
    kind, tag = (yaml.SequenceNode, "seq") if get_origin(hint) is list else (yaml.MappingNode, "map")
    if isinstance(node, kind) and node.tag == _TAG + tag:
        return _entries(node, key)
    raise ScenarioError(_where(node), key, _value(node), _wanted(hint, name))


def _entries(node: yaml.Node, key: str) -> Children:
    if isinstance(node, yaml.SequenceNode):
        return {str(index): (child, child) for index, child in enumerate(node.value)}
    entries: Children = {}
    for name, child in node.value if isinstance(node, yaml.MappingNode) else ():
        if not isinstance(name, yaml.ScalarNode):
            raise ScenarioError(_where(name), key, Fault("a list or mapping is given as a key"), "wanted: a name")
        if name.value in entries:
            first = _where(entries[name.value][0])
            raise ScenarioError(_where(name), validate.dotted(key, name.value), Fault("given twice"), f"first: {first}")
        entries[name.value] = (name, child)
    if "<<" in entries:
        _, template = entries.pop("<<")
        parts = [entries]  # by precedence
        for each in template.value if isinstance(template, yaml.SequenceNode) else [template]:
            if not isinstance(each, yaml.MappingNode):
                raise ScenarioError(_where(each), validate.dotted(key, "<<"), _value(each), "wanted: mappings to merge")
            parts.append(_entries(each, key))
        entries = dict(entry for part in reversed(parts) for entry in part.items())
    return entries


def _nearest(node: yaml.Node, key: str) -> yaml.Node:
    """Node where a dotted key, or else its nearest ancestor, is given."""
    found = node
    for part in key.split("."):
        children = _entries(node, "")
        if part not in children:
            break
        found, node = children[part]
    return found


def _where(node: yaml.Node) -> str:
    """File and line, or command-line option or Python object, of a node."""
    mark = node.start_mark
    return str(mark.name) if mark.line == NO_LINE or mark.name.startswith("--set ") else f"{mark.name}:{mark.line + 1}"


def _wanted(hint: Any, name: str) -> str:
    if dataclasses.is_dataclass(hint):
        return f"wanted: a mapping with the keys {', '.join(_hints(hint))}"
    if hint in _WANTED:
        return f"wanted: {_WANTED[hint]}{validate.unit_of(name, ' in ')}"
    return f"wanted: {'a mapping' if get_origin(hint) is dict else 'a list'}{validate.unit_of(name, ' in ')}"


def _suggestion(name: str, options: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, list(options), n=1)
    return f"did you mean {close[0]}? " if close else ""


def _unknown(node: yaml.Node, key: str, part: str, options: Iterable[str]) -> NoReturn:
    wanted = f"{_suggestion(part, options)}allowed: {', '.join(options) or 'none'}"
    raise ScenarioError(_where(node), validate.dotted(key, part), Fault("unknown key"), wanted)
