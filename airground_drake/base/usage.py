"""Parsers of command lines, the numbers that they take, and how a command says that it is not done."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NoReturn

from airground_drake.base.errors import one_line

EXIT_USAGE, EXIT_TOOL = 2, 4
MOST = 1e15
"""Of numbers that an option takes."""


def refuse(why: object, code: int = EXIT_USAGE) -> int:
    """Say in one line why a command is not done, if standard error takes it; returns the exit code."""
    if isinstance(why, OSError) and why.filename is not None:
        why = f"{why.filename}: {why.strerror}"
    with suppress(OSError):
        print(f"error: {one_line(str(why))}", file=sys.stderr)
    return code


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with a command line."""

    def error(self, message: str) -> NoReturn:
        """Say so, and exit with 2."""
        raise SystemExit(refuse(f"{message}; see {self.prog} --help"))


def overridable(parser: argparse.ArgumentParser) -> None:
    """Add the option `--set`."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the scenario"
    )


def whole(least: int, most: float = math.inf) -> Callable[[str], int]:
    """What takes an argument that is a whole number, `least` and `most` included."""
    up_to = "on" if most == math.inf else f"to {most}"

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a whole number from {least} {up_to}")
        return value

    return number


def formats_of(allowed: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """What takes an argument that is a comma-separated list of formats."""

    def formats(text: str) -> tuple[str, ...]:
        chosen = tuple(text.split(","))
        unknown = [name for name in chosen if name not in allowed]
        if unknown:
            raise argparse.ArgumentTypeError(f"{', '.join(unknown)!r} is not allowed; formats are {', '.join(allowed)}")
        return chosen

    return formats


def positive(text: str) -> float:
    """An argument that is a number above 0, at most MOST."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= MOST:
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number above 0, at most {MOST:g}")
    return value
