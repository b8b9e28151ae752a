"""YAML text, or data made in Python, as nodes that know where they come from; every mistake becomes one line.

Scalars are read by the rules of YAML 1.2 (`1e-3` is a number, `yes` and `1:30` are text). Anchors, merge keys
(`<<`) and templates under top-level keys that begin with an underscore work as in Drake's own files.
"""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from airground_drake import files
from airground_drake.errors import Fault, ScenarioError
from airground_drake.scenarios import validate
from airground_drake.scenarios.shipped import shipped, shipped_files

MAX_BYTES = 2**20
MAX_VALUES = 50_000
"""Values of a scenario with every alias and merge expanded."""
MAX_DEPTH = 100
"""Of values within values."""
NO_LINE = -1
"""Line of what was made in Python."""

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


def read_data(path: Path) -> tuple[Any, str]:
    """Another YAML file of ours as nested dicts, lists and scalars, by the rules and limits of scenario files.

    Returns:
        The data, None where no value is given, and the SHA-256 of the file's bytes.

    Raises:
        ScenarioError: if it cannot be read.
    """
    root, _, data = read(path)
    within_limits(root)
    return _plain(root, ""), files.sha256(data)


def read(name_or_path: str | Path) -> tuple[yaml.Node, str, bytes]:
    """A YAML file, or a shipped scenario: its root node, where it is, and its bytes.

    Raises:
        ScenarioError: if it cannot be read, is no YAML text, or larger than the limits.
    """
    source, data = _read_bytes(str(name_or_path))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{source}:{line}", "", Fault("not UTF-8 text"), "wanted: a YAML file") from None
    return compose(text, source), source, data


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
        fault = Fault(f"cannot be read ({getattr(error, 'strerror', None) or error})")
        raise ScenarioError(source, "", fault, "wanted: a readable YAML file") from None
    if len(data) > MAX_BYTES:
        raise ScenarioError(source, "", Fault("too large"), f"at most {MAX_BYTES} bytes are allowed")
    return source, data


def compose(text: str, source: str) -> yaml.Node:
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


def of_data(data: Any, source: str) -> yaml.Node:
    """A document of nested dicts and lists made in Python.

    Raises:
        ScenarioError: if it is nested too deeply.
    """
    try:
        return _node(data, source)
    except RecursionError:
        raise _excess(source, deep=True) from None


def _node(value: Any, source: str) -> yaml.Node:
    """A value made in Python as a node of a document; what YAML has no word for is a node of its own tag."""
    mark = yaml.Mark(source, 0, NO_LINE, 0, None, 0)
    value = simple(value)
    if isinstance(value, dict):
        pairs = [(_node(name, source), _node(each, source)) for name, each in value.items()]
        return yaml.MappingNode(f"{TAG}map", pairs, mark, mark)
    if isinstance(value, list):
        return yaml.SequenceNode(f"{TAG}seq", [_node(each, source) for each in value], mark, mark)
    kinds = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
    text = repr(value).replace("inf", ".inf").replace("nan", ".nan") if isinstance(value, float) else str(value)
    return yaml.ScalarNode(TAG + kinds.get(type(value), type(value).__name__), text, mark, mark)


def simple(value: Any) -> Any:
    """Values of numpy, and tuples, as what YAML knows."""
    if isinstance(value, Mapping):
        return {name: simple(each) for name, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return simple(value.tolist())
    return [simple(each) for each in value] if isinstance(value, list | tuple) else value


def _plain(node: yaml.Node, key: str) -> Any:
    """What a node stands for."""
    if isinstance(node, yaml.ScalarNode):
        value = value_of(node)
        if isinstance(value, Fault) and node.tag != f"{TAG}null":
            raise ScenarioError(where(node), key, value, "wanted: plain YAML")
        return None if isinstance(value, Fault) else value
    entries = {name: _plain(child, validate.dotted(key, name)) for name, (_, child) in entries_of(node, key).items()}
    return list(entries.values()) if isinstance(node, yaml.SequenceNode) else entries


def value_of(node: yaml.Node) -> object:
    """Value of a scalar node; a `Fault` that says what it is for any other."""
    tag = node.tag.removeprefix(TAG)
    if not isinstance(node, yaml.ScalarNode) or tag not in _SCALARS:
        return Fault({"map": "a mapping is given", "seq": "a list is given"}.get(tag, f"the tag {tag} is given"))
    try:
        value = _SCALARS[tag][1](node.value)
    except ValueError:
        return Fault("a value is given that cannot be read")
    return Fault("no value is given") if value is None else value


def entries_of(node: yaml.Node, key: str) -> Children:
    """Entries of a mapping with what it merges, items of a list by index; none of a scalar."""
    if isinstance(node, yaml.SequenceNode):
        return {str(index): (child, child) for index, child in enumerate(node.value)}
    entries: Children = {}
    for name, child in node.value if isinstance(node, yaml.MappingNode) else ():
        if not isinstance(name, yaml.ScalarNode):
            raise ScenarioError(where(name), key, Fault("a list or mapping is given as a key"), "wanted: a name")
        if name.value in entries:
            first = where(entries[name.value][0])
            raise ScenarioError(where(name), validate.dotted(key, name.value), Fault("given twice"), f"first: {first}")
        entries[name.value] = (name, child)
    if "<<" in entries:
        _, template = entries.pop("<<")
        parts = [entries]  # by precedence
        for each in template.value if isinstance(template, yaml.SequenceNode) else [template]:
            if not isinstance(each, yaml.MappingNode):
                raise ScenarioError(
                    where(each), validate.dotted(key, "<<"), value_of(each), "wanted: mappings to merge"
                )
            parts.append(entries_of(each, key))
        entries = dict(entry for part in reversed(parts) for entry in part.items())
    return entries


def nearest(node: yaml.Node, key: str) -> yaml.Node:
    """Node where a dotted key, or else its nearest ancestor, is given."""
    found = node
    for part in key.split("."):
        children = entries_of(node, "")
        if part not in children:
            break
        found, node = children[part]
    return found


def where(node: yaml.Node) -> str:
    """File and line, or command-line option or Python object, of a node."""
    mark = node.start_mark
    return str(mark.name) if mark.line == NO_LINE or mark.name.startswith("--set ") else f"{mark.name}:{mark.line + 1}"


def within_limits(root: yaml.Node) -> None:
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
            raise _excess(where(node), deep=above + levels > MAX_DEPTH)
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
