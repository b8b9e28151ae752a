"""The scenarios that come with the package: their files, by name, and what each is, without reading all of it."""

from __future__ import annotations

import shlex
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import yaml

from airground_drake.base.errors import one_line

AUDIT = "audit"
"""What `airground report` takes besides the name of a scenario or a file."""


def shipped() -> list[str]:
    """Names of the scenarios that come with the package, sorted."""
    return sorted(shipped_files())


def shipped_files() -> dict[str, Traversable]:
    """The files of the scenarios that come with the package, by name."""
    found = resources.files(__package__).iterdir()
    return {file.name.removesuffix(".yaml"): file for file in found if file.name.endswith(".yaml")}


def argument(path: Path) -> str:
    """The path of a scenario as the command line takes it: quoted, neither an option nor a name that is shipped."""
    text = str(path)
    return one_line(shlex.quote(f"./{text}" if text.startswith("-") or text in (AUDIT, *shipped()) else text))


def json_schema_file() -> Traversable:
    """The JSON Schema of scenario files, of what comes with the package, for editors: see `json_schema.py`."""
    return resources.files(__package__) / "scenario.schema.json"


def title(name: str) -> str:
    """The title of a shipped scenario, which stands near its beginning: no more of the file is parsed."""
    depth, before = 0, ""
    with shipped_files()[name].open("rb") as stream:
        for event in yaml.parse(stream, yaml.BaseLoader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth == 1 and isinstance(event, yaml.ScalarEvent):
                if before == "title":
                    return str(event.value)
                before = event.value
    return ""
