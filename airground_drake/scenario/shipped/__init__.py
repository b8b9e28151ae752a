"""Files and titles of the scenarios that come with the package. How scenarios are named on a command line."""

import re
import shlex
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import yaml

from airground_drake.base.errors import one_line
from airground_drake.base.limits import MAX_NAME

AUDIT = "audit"  # the argument of `airground report` that is neither a scenario nor a file


def shipped() -> list[str]:
    """Names of the scenarios that come with the package, sorted."""
    return sorted(shipped_files())


def shipped_files() -> dict[str, Traversable]:
    """The files of the scenarios that come with the package, by name."""
    entries = resources.files(__package__).iterdir()
    return {file.name.removesuffix(".yaml"): file for file in entries if file.name.endswith(".yaml")}


def argument(path: Path) -> str:
    """A scenario's path as an argument of the command line: quoted, and distinct from options and shipped names."""
    text = str(path)
    return one_line(shlex.quote(f"./{text}" if text.startswith("-") or text in (AUDIT, *shipped()) else text))


def scenario_name(text: str, instead: str) -> str:
    """A text as a name that a scenario may have: letters, digits and underscores; `instead` if nothing is left."""
    return re.sub(r"^[\W\d_]+|[\W_]+$", "", re.sub(r"\W+", "_", text, flags=re.ASCII))[:MAX_NAME] or instead


def json_schema_file() -> Traversable:
    """The file of the JSON Schema of scenario files, without installed plug-ins; see `json_schema.py`."""
    return resources.files(__package__) / "scenario.schema.json"


def title(name: str) -> str:
    """The title of a shipped scenario. The file is parsed only up to its title, which stands near the beginning."""
    depth, before = 0, ""
    with shipped_files()[name].open("rb") as stream:
        for event in yaml.parse(stream, yaml.BaseLoader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth == 1 and isinstance(event, yaml.ScalarEvent):
                if before == "title":
                    return str(event.value)
                before = event.value
    return ""
