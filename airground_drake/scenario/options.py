"""Command-line options: a table of shared options, and the parser of a command."""

import argparse
import difflib
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, NoReturn

from airground_drake.base.usage import MOST_JOBS, output_folder, positive, refuse, whole
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS


class Parser(argparse.ArgumentParser):
    """Refuses a bad command line in one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message, and exit with 2; for arguments that are too many, with those that the command takes."""
        words = message.removeprefix("unrecognized arguments: ").split()
        if words != message.split():
            options = [option for option in self._option_string_actions if option.startswith("--")]
            close = difflib.get_close_matches(words[0].partition("=")[0], options, n=1) if words[0][0] == "-" else []
            takes = [action.metavar or action.dest for action in self._actions if not action.option_strings]
            message += f"; did you mean {close[0]}?" if close else f"; wanted: {' '.join(map(str, takes)) or 'options'}"
        raise SystemExit(refuse(f"{message}; see {self.prog} --help"))


Option = dict[str, Any]  # argparse's arguments for an option or argument


def option(says: str, metavar: str | None = None, kind: Callable[[str], Any] | None = None, **more: Any) -> Option:
    """An option's help, the name of its value, and its parser; without the last two it is a flag."""
    return {"help": says, **{key: value for key, value in (("metavar", metavar), ("type", kind)) if value}, **more}


# Shared options by all their names. A command may override their entries.
OPTIONS: dict[str, Option] = {
    "scenario": option("name of a shipped scenario, or path to a YAML file"),
    "folder": option("folder of a report", "DIR", Path),
    "spec": option("YAML file of a campaign", kind=Path),
    "run": option("default: all runs", "RUN", nargs="?"),
    "-n --number": option("", "N", whole(1)),
    "-o --output": option("default: this folder", "DIR", output_folder),
    "-q --quiet": option("no progress"),
    "--engine": option("batch: a compiled loop, and Drake repeats a sample; drake: Drake alone (default: %(default)s)",
                       choices=("batch", "drake"), default="batch"),
    "--jobs": option("processes (default: one for each processor)", "N", whole(1, MOST_JOBS)),
    "--json": option("print everything as JSON"),
    "--limit-steps": option("", "N", positive, default=DEFAULT_LIMITS.work),
    "--seed": option("seed of the decision noise", "N", int),
    "--set": option("override a key of the scenario", "KEY=VALUE", action="append", default=[]),
    plugins.OPTION: option("import and run third-party code (module:Class or file.py:Class), also from the folder "
                           "of the scenario or spec"),
    plugins.SHOW: option("print the output of third-party policies on standard error"),
}  # fmt: skip


def parser_of(
    name: str,
    description: str,
    takes: Mapping[str, Option | str | None],
    epilog: str | None = None,
    exclusive: Collection[str] = (),
) -> Parser:
    # takes: its options and arguments, each with overrides of the table's entry, or None.
    # exclusive: options that exclude each other.
    form = argparse.RawDescriptionHelpFormatter if "\n" in (epilog or "") else argparse.HelpFormatter
    parser = Parser(prog=f"airground {name}", description=description, epilog=epilog, formatter_class=form)
    group = parser.add_mutually_exclusive_group() if exclusive else parser
    for names, own in takes.items():
        settings = OPTIONS.get(names, {}) | ({"help": own} if isinstance(own, str) else own or {})
        if names.startswith("-") and not settings.keys() & {"metavar", "type", "choices", "action"}:
            settings["action"] = "store_true"
        (group if names in exclusive else parser).add_argument(*names.split(), **settings)
    return parser
