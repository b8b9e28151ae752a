"""Completion: what the shells are given knows every command, its options, the scenarios and files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.commands import COMMANDS
from airground_drake.commands.completion import SHELLS

COMPLETE = """
source "$1"
COMP_WORDS=("${@:2}")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
$(complete -p airground | sed 's/.*-F \\([^ ]*\\) .*/\\1/') airground "${COMP_WORDS[$COMP_CWORD]}"
echo "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("re", {"report", "replay"}),
        ("report case_b", {"case_b"}),
        ("report case_a --allow", {"--allow-plugins"}),
        ("list po", {"policies"}),
        ("compare fol", {"folder"}),
        ("report minimal -o fol", {"folder"}),
        ("diagram mi", {"minimal", "mine.yaml"}),
        ("diagram minimal --method ", {"a", "b", "c", "d"}),
        ("falsify --sampler h", {"halton"}),
        ("falsify --sampler m", {"mine.yaml"}),
    ],
)
def test_bash_is_offered_what_fits(typed: str, offered: set[str], tmp_path: Path, airground: Airground) -> None:
    (tmp_path / "script").write_text(airground("completion", "bash"))
    (tmp_path / "folder").mkdir()
    (tmp_path / "mine.yaml").touch()
    command = ["bash", "-c", COMPLETE, "bash", "./script", "airground", *typed.split(" ")]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    assert set(ran.stdout.split()) == offered


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_is_in_it(shell: str, airground: Airground) -> None:
    said = airground("completion", shell)
    assert all(name in said for name in [*COMMANDS, "warehouse"])
