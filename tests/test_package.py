"""What is said of the package: citation and metadata agree with it. `.ci/package` looks at what is built."""

import tomllib
from pathlib import Path
from typing import Any

import yaml

from airground_drake.study.testing import plugin

ROOT = Path(__file__).parent.parent
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_the_citation_is_of_this_version_and_of_the_paper() -> None:
    assert (CITATION["title"], CITATION["version"]) == (PROJECT["name"], PROJECT["version"])
    assert CITATION["license"] == PROJECT["license"]
    assert [author["name"] for author in CITATION["authors"]] == [author["name"] for author in PROJECT["authors"]]
    (paper,) = CITATION["references"]
    assert PROJECT["urls"]["Paper"] == f"https://doi.org/{paper['doi']}"
    assert f"*{paper['title']}*" in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


def test_the_plugin_has_one_name_however_it_is_loaded() -> None:
    assert PROJECT["entry-points"]["pytest11"] == {plugin.__name__: plugin.__name__}


def test_what_is_listed_for_the_sdist_is_there() -> None:
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    listed = tools["hatch"]["build"]["targets"]["sdist"]["include"]
    assert [name for name in listed if not (ROOT / name.removeprefix("/")).exists()] == []
