"""`airground completion SHELL`: print the script that completes this command line in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

from airground_drake.base.usage import Parser, output_file, output_folder
from airground_drake.registry import SAMPLERS
from airground_drake.scenarios.shipped import shipped

SHELLS = ("bash", "zsh", "tcsh")
EPILOG = """\
for this session:  eval "$(airground completion bash)"
for good:          airground completion bash > ~/.local/share/bash-completion/completions/airground
                   airground completion zsh > a folder of $fpath/_airground
                   airground completion tcsh > /etc/profile.d/airground.completion.csh"""
SCENARIOS = ("scenario", "target")
"""Arguments that are the name of a shipped scenario, or a file."""


def parser() -> argparse.ArgumentParser:
    """Make the parser."""
    parser = Parser(
        prog="airground completion",
        description="Print what completes commands, options, scenarios and files in a shell.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS, help="whose completion")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the script."""
    shell = parser().parse_args(arguments).shell
    import shtab

    print(shtab.complete(tree(), shell))
    return 0


def tree() -> argparse.ArgumentParser:
    """Merge the parsers of all commands into one, and say for each argument how it is completed."""
    from airground_drake.commands import COMMANDS

    whole = argparse.ArgumentParser(prog="airground")
    whole.add_argument("--version", action="store_true")
    commands = whole.add_subparsers()
    for name, command in COMMANDS.items():
        of_command = import_module(command.module).parser()
        for action in of_command._actions:
            _complete(action)
        commands.add_parser(name, help=command.says, parents=[of_command], add_help=False)
    return whole


def _complete(action: argparse.Action) -> None:
    """Tell shtab how to complete an argument."""
    import shtab

    if action.dest in SCENARIOS:
        action.complete = _name_or_file("scenario", shipped())  # type: ignore[attr-defined]
    elif action.dest == "sampler":
        action.complete = _name_or_file("sampler", SAMPLERS)  # type: ignore[attr-defined]
    elif action.type in (Path, output_file, output_folder):
        action.complete = shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE  # type: ignore[attr-defined]


def _name_or_file(kind: str, allowed: Iterable[str]) -> dict[str, str | dict[str, str]]:
    """Completion by some names and by files, in the language of each shell."""
    names, function = " ".join(allowed), f"_airground_{kind}"
    bash = f'{function}() {{\n  compgen -W "{names}" -- "$1"\n  _shtab_compgen_files "$1"\n}}'
    zsh = f"{function}() {{\n  _alternative '{kind}:{kind}:({names})' 'files:file:_files'\n}}"
    return {"bash": function, "zsh": function, "tcsh": f"({names})", "preamble": {"bash": bash, "zsh": zsh, "tcsh": ""}}
