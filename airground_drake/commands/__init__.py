"""The command line `airground`, which is also `python -m airground_drake`: a table of commands, imported when used.

Enters: a command line.
Leaves: files, lines of text, an exit code.
May import: `base`, `check`, `model`, `uav`, `ugv`, `scenario`, `sim`, `verify`, `report`, `study`.
"""

import argparse
import difflib
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from typing import NamedTuple

from airground_drake.base import interruption
from airground_drake.base.errors import AirgroundError, SimulationError
from airground_drake.base.usage import EXIT_TOOL, EXIT_USAGE, refuse
from airground_drake.scenario.options import Parser


class Command(NamedTuple):
    """A command `airground NAME ...`."""

    # The module has `main`, which takes the arguments and returns the exit code, and `parser`, which makes the parser
    # of the arguments. Slow imports are inside `main`. An error that `main` raises becomes one line, see `main` below.

    module: str
    says: str


COMMANDS: dict[str, Command] = {
    "report": Command("airground_drake.report.__main__", "simulate a scenario, check its claims, write the report"),
    "run": Command("airground_drake.commands.run", "simulate one run and print its events, or watch it in Meshcat"),
    "verify": Command("airground_drake.verify.__main__", "judge claims anew, on a saved run or about a model"),
    "check": Command("airground_drake.commands.check", "check a report from its files alone"),
    "judge": Command("airground_drake.commands.judge", "judge a log of your own: which distances were kept"),
    "compare": Command("airground_drake.commands.compare", "say what has changed from one report to another"),
    "index": Command("airground_drake.commands.index", "list the reports in a folder on a page"),
    "prove": Command("airground_drake.commands.prove", "have Coq check the theorems, or prove the runs of a report"),
    "campaign": Command("airground_drake.commands.campaign", "judge many draws of a scenario"),
    "falsify": Command("airground_drake.commands.falsify", "search for a scenario that violates a claim"),
    "replay": Command("airground_drake.commands.replay", "show the runs of a report: a page each, or a video"),
    "export": Command("airground_drake.commands.export", "write the runs of a report as CSV or MCAP files"),
    "figures": Command("airground_drake.commands.figures", "write the figures of a report as PDF, with LaTeX tables"),
    "budget": Command("airground_drake.commands.budget", "say what the distances of a scenario cost, term by term"),
    "diagram": Command("airground_drake.commands.diagram", "draw the diagram of a scenario"),
    "list": Command("airground_drake.commands.listing", "list scenarios, methods, policies, routes, tasks and claims"),
    "import": Command("airground_drake.commands.importing", "make a scenario of a BARN world, a ROS map, or MovingAI"),
    "init": Command("airground_drake.commands.init", "write a small scenario to start from"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    # Returns the command's exit code; 2 if the command is unknown or refuses, 4 if a simulation stops.
    given = list(sys.argv[1:] if arguments is None else arguments)
    options, unknown = _parser().parse_known_args(given[:1])
    name = "".join(unknown) or options.command
    if name is None:
        return refuse(f"a command is needed: {', '.join(COMMANDS)}")
    if name not in COMMANDS:
        close = difflib.get_close_matches(name, COMMANDS, n=1)
        meant = f"did you mean {close[0]}? " if close else ""
        return refuse(f"{name!r} is no command: {meant}commands are {', '.join(COMMANDS)}")
    try:
        code: int = import_module(COMMANDS[name].module).main(given[1:])
    except BrokenPipeError:  # no reader of the output
        raise
    except SimulationError as error:
        return refuse(error, EXIT_TOOL)
    except AirgroundError as error:
        return refuse(error)
    except OSError as error:  # of a file that was named, or of standard output
        return refuse(error, EXIT_USAGE if error.filename else EXIT_TOOL)
    return code


def _parser() -> argparse.ArgumentParser:
    width = max(map(len, COMMANDS))
    commands = "\n".join(f"  {name:{width}}  {command.says}" for name, command in COMMANDS.items())
    parser = Parser(
        prog="airground",
        description="Event-triggered UAV-to-UGV intervention on Drake, with verification reports.",
        epilog=f"commands:\n{commands}\n\n`airground COMMAND --help` says more.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="airground COMMAND ...",
    )
    parser.add_argument("--version", action="version", version=f"airground_drake {version('airground_drake')}")
    parser.add_argument("command", metavar="COMMAND", nargs="?")
    return parser


def entry() -> None:
    interruption.begin()  # before the imports, which take seconds
    interruption.run(main)
