"""Completion: what the shells are given knows every command, its options, the scenarios and files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from airground_drake.commands import COMMANDS, main
from airground_drake.commands.completion import SHELLS, tree

COMPLETE = """
source "$1"
COMP_WORDS=("${@:2}")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
$(complete -p airground | sed 's/.*-F \\([^ ]*\\) .*/\\1/') airground "${COMP_WORDS[$COMP_CWORD]}"
echo "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "airground"
    command = [sys.executable, "-m", "airground_drake", "completion", "bash"]
    path.write_bytes(subprocess.run(command, capture_output=True, check=True).stdout)
    return path


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["re"], "report replay"),
        (["report", "case_b"], "case_b"),
        (["report", "case_a", "--allow"], "--allow-plugins"),
        (["verify", "minim"], "minimal"),
        (["list", "po"], "policies"),
        (["compare", "fol"], "folder"),
        (["diagram", "mi"], "minimal mine.yaml"),
        (["diagram", "minimal", "--method", ""], "a b c d"),
        (["falsify", "--sampler", "h"], "halton"),
        (["falsify", "--sampler", "m"], "mine.yaml"),
    ],
)
def test_bash_is_offered_what_fits(typed: list[str], offered: str, script: Path, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "mine.yaml").touch()
    command = ["bash", "-c", COMPLETE, "bash", str(script), "airground", *typed]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    assert set(ran.stdout.split()) <= set(offered.split())
    assert offered.split()[0] in ran.stdout.split()


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_is_in_it(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in COMMANDS)
    assert "warehouse" in said


def test_the_parsers_as_one_take_what_each_takes() -> None:
    options = tree().parse_args(["report", "case_a", "--seed", "3", "-o", "out"])
    assert (options.scenario, options.seed, options.output) == ("case_a", 3, Path("out"))
