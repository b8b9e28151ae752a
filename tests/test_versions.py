"""What is pinned, locked and listed is the same, and covers what pyproject.toml asks for."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DIRECT = sorted(
    {
        (re.split(r"[>\[]", requirement)[0].lower(), extra)
        for extra, group in {"": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}.items()
        for requirement in group
        if not requirement.startswith("airground_drake")
    }
)


def versions(file: str, pattern: str) -> dict[str, str]:
    text = (ROOT / file).read_text(encoding="utf-8")
    return {name.lower().replace("_", "-"): version for name, version in re.findall(pattern, text, re.MULTILINE)}


PINNED = versions("constraints.txt", r"^([\w.-]+)==(\S+)$")
LOCKED = versions("requirements.lock", r"^([\w.-]+)==(\S+) \\$")
LISTED = versions("docs/licences.txt", r"^([\w.-]+)  (\d\S*)  .*\w.*$")


@pytest.mark.parametrize(("name", "extra"), DIRECT)
def test_direct_dependencies_are_pinned_locked_and_explained(name: str, extra: str) -> None:
    assert name in (ROOT / "docs" / "design.md").read_text(encoding="utf-8").lower()
    if extra != "bench":
        assert PINNED[name] == LOCKED[name] == LISTED[name]


def test_the_lock_has_the_pinned_versions_and_hashes() -> None:
    assert LISTED == PINNED
    assert {name: LOCKED[name] for name in PINNED} == PINNED
    entries = re.split(r"^(?=[\w.-]+==)", (ROOT / "requirements.lock").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", entry) for entry in entries[1:])
