"""YAML text or data made in Python as plain data with their places of origin; every mistake becomes one line.

Scalars are read by the rules of YAML 1.2 (`1e-3` is a number, `yes` and `1:30` are text). Anchors, merge keys
(`<<`) and templates under top-level keys that begin with an underscore work as in Drake's own files.
"""

import difflib
import io
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
import yaml
from yaml.composer import Composer

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError, short
from airground_drake.scenario import hints
from airground_drake.scenario.shipped import shipped, shipped_files

MAX_BYTES = 2**20
MAX_VALUES = 50_000  # of a scenario, with every alias and merge expanded
MAX_DEPTH = 100  # of values within values
TAG = "tag:yaml.org,2002:"
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

UNKNOWN_KEY = Fault("unknown key")

Children = dict[str, tuple[yaml.Node, yaml.Node]]  # key node (for its line) and value node of each entry

# Place of each key and value (file and line, or command-line option), by the names and indices that lead there.
Places = dict[tuple[str, ...], tuple[str, str]]


class Document(NamedTuple):
    """Plain data with their places of origin."""

    data: Any  # dicts, lists and scalars; None where no value is given
    source: str  # file, option or other origin of all data
    places: Places  # places of the entries and items

    def where(self, *at: str, key: bool = False) -> str:
        """File and line, or option, of an entry; for a missing entry, of the innermost mapping or list around it."""
        # key: whether to name the line of the key, which may be before that of the value.
        if at in self.places:
            return self.places[at][not key]
        return self.where(*at[:-1], key=key) if at else self.source


class _Bounded(Composer):
    """Composes nodes, tags scalars by the rules of YAML 1.2, and refuses nodes that are too large or too deep."""

    parser: ClassVar[Any]
    peek_event: ClassVar[Any]  # of the parser

    def __init__(self, text: str, source: str) -> None:
        stream: Any = io.StringIO(text)
        stream.name = source  # which the marks have
        self.parser.__init__(self, stream)
        self.anchors: dict[str, yaml.Node] = {}
        self.depth = 0
        # Numbers of values and of levels in each node, with aliases and merges expanded.
        self.sizes: dict[int, tuple[int, int]] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node:
        event: yaml.Event = self.peek_event()
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise _excess(_where(event), deep=True)
        node: yaml.Node | None = super().compose_node(parent, index)
        assert node is not None
        self.depth -= 1
        if not isinstance(event, yaml.AliasEvent):
            inner = [self.sizes[id(child)] for child in _within(node)]
            self.sizes[id(node)] = 1 + sum(n for n, _ in inner), 1 + max((levels for _, levels in inner), default=0)
        elif id(node) not in self.sizes:  # an alias of a node around it
            raise _excess(_where(event), deep=True)
        values, levels = self.sizes[id(node)]
        if values > MAX_VALUES or self.depth + levels > MAX_DEPTH:
            raise _excess(_where(node), deep=self.depth + levels > MAX_DEPTH)
        return node


class _Loader(_Bounded, yaml.BaseLoader):
    """In Python: its errors tell more."""

    parser = yaml.BaseLoader


class _FastLoader(_Bounded, getattr(yaml, "CBaseLoader", yaml.BaseLoader)):  # type: ignore[misc]
    """By libyaml, where PyYAML is built with it."""

    parser = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


class _Dumper(yaml.SafeDumper):
    """Quotes text that YAML 1.1 or 1.2 would read as another type."""


for _name, (_pattern, _) in _SCALARS.items():
    if _pattern is not None:
        for _each in (_Loader, _FastLoader, _Dumper):
            _each.add_implicit_resolver(TAG + _name, re.compile(rf"(?:{_pattern})\Z"), None)


def text_of(data: Mapping[str, Any]) -> str:
    """Nested dicts, lists and scalars as the text of a YAML file."""
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


def read(name_or_path: str | Path) -> tuple[Document, bytes]:
    """The document and the bytes of a YAML file or a shipped scenario."""
    source, data = _read_bytes(str(name_or_path))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{source}:{line}", "", Fault("not UTF-8 text"), "wanted: a YAML file") from None
    return parsed(text, source), data


def _read_bytes(name_or_path: str) -> tuple[str, bytes]:
    """Path and content of a scenario; the name of a shipped scenario has precedence over a path."""
    file: Traversable = shipped_files().get(name_or_path, Path(name_or_path))
    source = str(file)
    try:
        with file.open("rb") if name_or_path in shipped_files() else files.open_pipe(Path(name_or_path)) as stream:
            data = stream.read(MAX_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        close = suggestion(name_or_path, shipped())
        wanted = f"{close}wanted: the path of a YAML file, or a shipped scenario: {', '.join(shipped())}"
        raise ScenarioError(name_or_path, "", Fault("no such scenario or file"), wanted) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or "a path has no null character"  # the cause of a ValueError
        fault = Fault(f"cannot be read ({why})")
        raise ScenarioError(source, "", fault, "wanted: a readable YAML file") from None
    if len(data) > MAX_BYTES:
        raise ScenarioError(source, "", Fault("too large"), f"at most {MAX_BYTES} bytes are allowed")
    return source, data


def parsed(text: str, source: str, at: tuple[str, ...] = ()) -> Document:
    """The data of YAML text, within the limits. Templates (see the module) are left out."""
    root = _composed(text, source)
    places: Places = {at: (_where(root), _where(root))}
    return Document(_plain(root, at, places), source, places)


def _composed(text: str, source: str) -> yaml.Node:
    """The root node of a YAML document; the marks of all nodes have the source's name."""
    root: yaml.Node | None
    try:
        try:
            root = _FastLoader(text, source).get_single_node()
        except (yaml.YAMLError, ValueError, OverflowError):
            root = _Loader(text, source).get_single_node()
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        if isinstance(error, yaml.MarkedYAMLError) and (slip := hints.slip(error, text)):
            raise ScenarioError(f"{source}:{slip.line}", "", Fault(f"not YAML: {slip.what}"), slip.wanted) from None
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark else text.count("\n", 0, getattr(error, "position", 0)) + 1
        problem = getattr(error, "problem", None) or getattr(error, "reason", None)
        problem = problem or "no such character"  # an escape such as "\U99999999"
        raise ScenarioError(f"{source}:{line}", "", Fault(f"not YAML: {problem}"), "wanted: YAML text") from None
    if root is None:
        raise ScenarioError(source, "", Fault("empty"), "wanted: YAML text")
    return root


def of_data(data: Any, source: str) -> Document:
    try:
        return Document(simple(data), source, {})
    except RecursionError:
        raise _excess(source, deep=True) from None


def simple(value: Any) -> Any:
    """A copy with plain numbers and lists in place of tuples and of numpy's values."""
    if isinstance(value, Mapping):
        return {str(name): simple(item) for name, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return simple(value.tolist())
    return [simple(item) for item in value] if isinstance(value, list | tuple) else value


def replace(document: Document, override: str) -> None:
    source = f"--set {short(override)}"
    key, equals, text = override.partition("=")
    if not equals or not key.strip():
        raise ScenarioError(source, "", override, "wanted: dotted.key=value, such as control.period_s=0.05")
    at = place_of(key)
    put(document, at, parsed(text, source, at).data, source)


def place_of(key: str) -> tuple[str, ...]:
    """The names and indices of a dotted key."""
    at = tuple(key.strip().split("."))
    if len(at) > 3 and at[::2][:2] == ("runs", "set"):
        return *at[:3], ".".join(at[3:])  # its keys have dots
    return at


def way(data: Any, key: str) -> list[Any]:
    """The values of a document that a dotted key leads through, as far as they are there."""
    values = []
    for part in place_of(key):
        data = _inside(data, part)
        if isinstance(data, list):
            data = dict(zip(map(str, range(len(data))), data, strict=True))
        if not isinstance(data, dict) or part not in data:
            break
        data = data[part]
        values.append(data)
    return values


def _inside(data: Any, name: str) -> Any:
    """The only item of a list that has this key: a plant may be written as a list of one plant, and is kept so."""
    return (
        data[0] if isinstance(data, list) and len(data) == 1 and isinstance(data[0], dict) and name in data[0] else data
    )


def put(document: Document, at: tuple[str, ...], new: Any, source: str) -> None:
    data = document.data
    for place in [written for written in document.places if written[: len(at)] == at]:
        del document.places[place]
    for depth, name in enumerate(at, start=1):
        data = _inside(data, name)
        options = [*data] if isinstance(data, dict) else [*map(str, range(len(data if isinstance(data, list) else ())))]
        if name not in options and not (name and isinstance(data, dict)):
            raise unknown(source, ".".join(at[:depth]), name, options)
        index: Any = int(name) if isinstance(data, list) else name
        if depth == len(at) or name not in options:
            data[index] = new if depth == len(at) else {}
            document.places[at[:depth]] = (source, source)
        data = data[index]


def _plain(node: yaml.Node, at: tuple[str, ...], places: Places) -> Any:
    """The plain value of a node; the places of its entries and items are added to `places`."""
    key = ".".join(at)
    if isinstance(node, yaml.ScalarNode):
        value = _value_of(node)
        if isinstance(value, Fault):
            raise ScenarioError(_where(node), key, value, "wanted: plain YAML")
        return value
    if node.tag not in (f"{TAG}map", f"{TAG}seq"):
        raise ScenarioError(_where(node), key, _value_of(node), "wanted: plain YAML")
    values = {}
    for name, (name_node, child) in _entries_of(node, key).items():
        if at or not name.startswith("_"):  # the others are templates
            places[*at, name] = _where(name_node), _where(child)
            values[name] = _plain(child, (*at, name), places)
    return list(values.values()) if isinstance(node, yaml.SequenceNode) else values


def _value_of(node: yaml.Node) -> object:
    """Value of a scalar node (None if it is empty), or a `Fault` that describes a node that has no plain value."""
    tag = node.tag.removeprefix(TAG)
    if not isinstance(node, yaml.ScalarNode) or tag not in _SCALARS:
        return Fault({"map": "a mapping is given", "seq": "a list is given"}.get(tag, f"the tag {tag} is given"))
    try:
        return _SCALARS[tag][1](node.value)
    except ValueError:
        return Fault("a value is given that cannot be read")


def _entries_of(node: yaml.Node, key: str) -> Children:
    """Entries of a mapping with those it merges, or items of a list by index; empty for a scalar."""
    if isinstance(node, yaml.SequenceNode):
        return {str(index): (child, child) for index, child in enumerate(node.value)}
    entries: Children = {}
    for name, child in node.value if isinstance(node, yaml.MappingNode) else ():
        if not isinstance(name, yaml.ScalarNode):
            raise ScenarioError(_where(name), key, Fault("a list or mapping is given as a key"), "wanted: a name")
        if name.value in entries:
            first = _where(entries[name.value][0])
            raise ScenarioError(_where(name), _dotted(key, name.value), Fault("given twice"), f"first: {first}")
        entries[name.value] = (name, child)
    if "<<" in entries:
        _, template = entries.pop("<<")
        parts = [entries]  # by precedence
        for part in template.value if isinstance(template, yaml.SequenceNode) else [template]:
            if not isinstance(part, yaml.MappingNode):
                raise ScenarioError(_where(part), _dotted(key, "<<"), _value_of(part), "wanted: mappings to merge")
            parts.append(_entries_of(part, key))
        entries = dict(entry for part in reversed(parts) for entry in part.items())
    return entries


def _where(node: yaml.Node | yaml.Event) -> str:
    mark: Any = node.start_mark
    return f"{mark.name}:{mark.line + 1}"


def _within(node: yaml.Node) -> Iterable[yaml.Node]:
    """Nodes of the items of a list, or of the keys and values of a mapping."""
    if isinstance(node, yaml.MappingNode):
        return itertools.chain.from_iterable(node.value)
    return node.value if isinstance(node, yaml.SequenceNode) else ()


def _excess(source: str, *, deep: bool) -> ScenarioError:
    if deep:
        return ScenarioError(source, "", Fault("nested too deeply"), f"at most {MAX_DEPTH} levels are allowed")
    allowed = f"at most {MAX_VALUES} are allowed, with aliases and merges expanded"
    return ScenarioError(source, "", Fault("too many values"), allowed)


def suggestion(name: str, options: Iterable[str]) -> str:
    """The beginning of a message: the option that is close to a name, if any."""
    close = difflib.get_close_matches(name, list(options), n=1)
    return f"did you mean {close[0]}? " if close else ""


def unknown(source: str, key: str, part: str, options: Sequence[str]) -> ScenarioError:
    """The error of an unknown key; `part` is the last part of the dotted key."""
    hint = hints.not_modelled(part) or suggestion(part, options)
    return ScenarioError(source, key, UNKNOWN_KEY, f"{hint}allowed: {', '.join(options) or 'none'}")


def _dotted(key: str, part: str) -> str:
    """Dotted key of a part of the entry with this key ('' for the document itself)."""
    return f"{key}.{part}" if key else part
