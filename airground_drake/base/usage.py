"""Parsers of command lines, the values that their options take, and how a command refuses."""

from __future__ import annotations

import argparse
import difflib
import math
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from airground_drake.base.errors import FolderError, LimitError, ScenarioError, UnknownNameError, one_line

EXIT_USAGE, EXIT_TOOL = 2, 4
# Mistakes of the user. Where a command does long work, other errors are faults of the tool.
REFUSALS = (ScenarioError, LimitError, FolderError, UnknownNameError)
MOST = 1e15  # largest number that an option takes
MOST_JOBS = 1000  # most processes that a command starts at once


def refuse(why: object, code: int = EXIT_USAGE) -> int:
    """Print in one line why a command is not done, if standard error takes it; returns the exit code."""
    if isinstance(why, OSError) and why.filename is not None:
        why = f"{why.filename}: {why.strerror}"
    with suppress(OSError):
        print(f"error: {one_line(str(why))}", file=sys.stderr)
    return code


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


def output_folder(text: str) -> Path:
    """Parse the path of an output; `new/../b` becomes `b`: else writing would create `new` on the way."""
    return Path(os.path.relpath(os.path.realpath(text)) if ".." in Path(text).parts else text)


def output_file(text: str) -> Path:
    """Parse the path of an output that is one file."""
    if text.endswith("/"):
        raise argparse.ArgumentTypeError(f"{text!r} is a folder; wanted: the name of a file")
    return output_folder(text)


def whole(least: int, most: float = math.inf) -> Callable[[str], int]:
    """Make the parser of a whole number; `least` and `most` are allowed."""
    up_to = "on" if most == math.inf else f"to {most}"

    def number(text: str) -> int:
        with suppress(ValueError):
            if least <= (value := int(text)) <= most:
                return value
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a whole number from {least} {up_to}")

    return number


def between(least: float, most: float) -> Callable[[str], float]:
    """Make the parser of a number; `least` and `most` are allowed."""

    def number(text: str) -> float:
        with suppress(ValueError):
            if least <= (value := float(text)) <= most:
                return value
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number from {least:g} to {most:g}")

    return number


def positive(text: str) -> float:
    """Parse a number above 0, at most MOST."""
    with suppress(ValueError):
        if 0.0 < (value := float(text)) <= MOST:
            return value
    raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number above 0, at most {MOST:g}")


def formats_of(allowed: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """Make the parser of a comma-separated list of formats."""

    def formats(text: str) -> tuple[str, ...]:
        chosen = tuple(text.split(","))
        if unknown := [name for name in chosen if name not in allowed]:
            raise argparse.ArgumentTypeError(f"{', '.join(unknown)!r} is not allowed; formats are {', '.join(allowed)}")
        return chosen

    return formats
