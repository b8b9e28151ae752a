"""YAML text, or data made in Python, as plain data that knows where it comes from; every mistake becomes one line.

Scalars are read by the rules of YAML 1.2 (`1e-3` is a number, `yes` and `1:30` are text). Anchors, merge keys
(`<<`) and templates under top-level keys that begin with an underscore work as in Drake's own files.
"""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError, short
from airground_drake.scenarios.shipped import shipped, shipped_files

MAX_BYTES = 2**20
MAX_VALUES = 50_000
"""Values of a scenario with every alias and merge expanded."""
MAX_DEPTH = 100
"""Of values within values."""
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

Children = dict[str, tuple[yaml.Node, yaml.Node]]
"""Key node (for its line) and value node of each entry."""

Places = dict[tuple[str, ...], tuple[str, str]]
"""File and line, or command-line option, of key and value, by the names and indices that lead there."""


class Document(NamedTuple):
    """Plain data, and where it comes from.

    Attributes:
        data: dicts, lists and scalars; None where no value is given.
        source: where all of it comes from.
        places: where its entries and items come from.
    """

    data: Any
    source: str
    places: Places

    def where(self, *at: str, key: bool = False) -> str:
        """File and line, or option, of the entry at a place, or else of what it would be in.

        Args:
            at: names and indices that lead to it.
            key: whether the key is meant, which may be in a line before its value.
        """
        if at in self.places:
            return self.places[at][not key]
        return self.where(*at[:-1], key=key) if at else self.source


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


class _Dumper(yaml.SafeDumper):
    """Quotes text that would be read as something else, by the rules of YAML 1.1 or 1.2."""


for _name, (_pattern, _) in _SCALARS.items():
    if _pattern is not None:
        for _each in (_Loader, _Dumper):
            _each.add_implicit_resolver(TAG + _name, re.compile(rf"(?:{_pattern})\Z"), None)


def text_of(data: Mapping[str, Any]) -> str:
    """A YAML file of ours from nested dicts, lists and scalars."""
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


def read(name_or_path: str | Path) -> tuple[Document, bytes]:
    """A YAML file, or a shipped scenario; and its bytes.

    Raises:
        ScenarioError: if it cannot be read, is no YAML text, or larger than the limits.
    """
    source, data = _read_bytes(str(name_or_path))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{source}:{line}", "", Fault("not UTF-8 text"), "wanted: a YAML file") from None
    return parsed(text, source), data


def _read_bytes(name_or_path: str) -> tuple[str, bytes]:
    """Path and content of a scenario; a shipped scenario's name has precedence."""
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
        why = getattr(error, "strerror", None) or "a path has no null character"  # which a ValueError is about
        fault = Fault(f"cannot be read ({why})")
        raise ScenarioError(source, "", fault, "wanted: a readable YAML file") from None
    if len(data) > MAX_BYTES:
        raise ScenarioError(source, "", Fault("too large"), f"at most {MAX_BYTES} bytes are allowed")
    return source, data


def parsed(text: str, source: str, at: tuple[str, ...] = ()) -> Document:
    """The data of YAML text, within the limits.

    Args:
        text: the text; keys of a whole document that begin with an underscore are templates, and left out.
        source: file or command-line option, for messages.
        at: where the data belongs in a document.

    Raises:
        ScenarioError: if it is no YAML, no plain data, or larger than the limits.
    """
    root = _composed(text, source)
    _within_limits(root)
    places: Places = {at: (_where(root), _where(root))}
    return Document(_plain(root, at, places), source, places)


def _composed(text: str, source: str) -> yaml.Node:
    """Nodes of a YAML document whose marks bear the source's name."""
    try:
        loader = _Loader(text)
        loader.name = source
        root: yaml.Node | None = loader.get_single_node()
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark else text.count("\n", 0, getattr(error, "position", 0)) + 1
        problem = getattr(error, "problem", None) or getattr(error, "reason", None)
        problem = problem or "no such character"  # an escape such as "\U99999999"
        raise ScenarioError(f"{source}:{line}", "", Fault(f"not YAML: {problem}"), "wanted: YAML text") from None
    if root is None:
        raise ScenarioError(source, "", Fault("empty"), "wanted: YAML text")
    return root


def of_data(data: Any, source: str) -> Document:
    """A document of nested dicts and lists made in Python.

    Raises:
        ScenarioError: if it is nested too deeply.
    """
    try:
        return Document(simple(data), source, {})
    except RecursionError:
        raise _excess(source, deep=True) from None


def simple(value: Any) -> Any:
    """A copy in which values of numpy, and tuples, are what YAML knows."""
    if isinstance(value, Mapping):
        return {str(name): simple(each) for name, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return simple(value.tolist())
    return [simple(each) for each in value] if isinstance(value, list | tuple) else value


def replace(document: Document, override: str) -> None:
    """Put another value into a document, which is changed.

    Args:
        document: to be changed.
        override: `dotted.key=value`; items of lists by index, names that are not there yet are added.

    Raises:
        ScenarioError: if it has another form, its value is no YAML, or there is no such item.
    """
    source = f"--set {short(override)}"
    key, equals, text = override.partition("=")
    if not equals or not key.strip():
        raise ScenarioError(source, "", override, "wanted: dotted.key=value, such as control.period_s=0.05")
    at = tuple(key.strip().split("."))
    if at[::2][:2] == ("runs", "set"):  # whose keys have dots
        at = at[:3] + (".".join(at[3:]),) * (len(at) > 3)
    put(document, at, parsed(text, source, at).data, source)


def put(document: Document, at: tuple[str, ...], new: Any, source: str) -> None:
    """Put another value at a place of a document, which is changed.

    Raises:
        ScenarioError: if it leads to no such item of a list.
    """
    data = document.data
    for place in [each for each in document.places if each[: len(at)] == at]:
        del document.places[place]
    for depth, name in enumerate(at, start=1):
        options = [*data] if isinstance(data, dict) else [*map(str, range(len(data if isinstance(data, list) else ())))]
        if name not in options and not (name and isinstance(data, dict)):
            raise unknown(source, ".".join(at[:depth]), name, options)
        index: Any = int(name) if isinstance(data, list) else name
        if depth == len(at) or name not in options:
            data[index] = new if depth == len(at) else {}
            document.places[at[:depth]] = (source, source)
        data = data[index]


def _plain(node: yaml.Node, at: tuple[str, ...], places: Places) -> Any:
    """What a node stands for; the places of what is in it are added."""
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
    """Value of a scalar node, None where none is given; a `Fault` that says what it is for any other."""
    tag = node.tag.removeprefix(TAG)
    if not isinstance(node, yaml.ScalarNode) or tag not in _SCALARS:
        return Fault({"map": "a mapping is given", "seq": "a list is given"}.get(tag, f"the tag {tag} is given"))
    try:
        return _SCALARS[tag][1](node.value)
    except ValueError:
        return Fault("a value is given that cannot be read")


def _entries_of(node: yaml.Node, key: str) -> Children:
    """Entries of a mapping with what it merges, items of a list by index; none of a scalar."""
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
        for each in template.value if isinstance(template, yaml.SequenceNode) else [template]:
            if not isinstance(each, yaml.MappingNode):
                raise ScenarioError(_where(each), _dotted(key, "<<"), _value_of(each), "wanted: mappings to merge")
            parts.append(_entries_of(each, key))
        entries = dict(entry for part in reversed(parts) for entry in part.items())
    return entries


def _where(node: yaml.Node) -> str:
    """File and line of a node."""
    return f"{node.start_mark.name}:{node.start_mark.line + 1}"


def _within_limits(root: yaml.Node) -> None:
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


def _excess(source: str, *, deep: bool) -> ScenarioError:
    if deep:
        return ScenarioError(source, "", Fault("nested too deeply"), f"at most {MAX_DEPTH} levels are allowed")
    allowed = f"at most {MAX_VALUES} are allowed, with aliases and merges expanded"
    return ScenarioError(source, "", Fault("too many values"), allowed)


def suggestion(name: str, options: Iterable[str]) -> str:
    """The beginning of a message: which of the options may have been meant, if one is close to a name."""
    close = difflib.get_close_matches(name, list(options), n=1)
    return f"did you mean {close[0]}? " if close else ""


def unknown(source: str, key: str, part: str, options: Sequence[str]) -> ScenarioError:
    """The error of a key that there is not, the last part of a dotted one."""
    return ScenarioError(
        source, key, UNKNOWN_KEY, f"{suggestion(part, options)}allowed: {', '.join(options) or 'none'}"
    )


def _dotted(key: str, part: str) -> str:
    """Key of a part of what has this key ('' for the document itself)."""
    return f"{key}.{part}" if key else part
