"""Parsers of option values, and the refusal of a command."""

import argparse
import math
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from airground_drake.base.errors import FolderError, LimitError, ScenarioError, UnknownNameError, one_line

EXIT_USAGE, EXIT_TOOL = 2, 4
# The user's errors. During long work of a command, other errors are internal.
REFUSALS = (ScenarioError, LimitError, FolderError, UnknownNameError)
N = TypeVar("N", int, float)
MOST = 1e15  # largest number that an option takes
MOST_JOBS = 1000  # most processes that a command starts at once


def refuse(why: object, code: int = EXIT_USAGE) -> int:
    """Print one line on why a command is refused, if standard error is open; returns the exit code."""
    if isinstance(why, OSError) and why.filename is not None:
        why = f"{why.filename}: {why.strerror}"
    with suppress(OSError):
        print(f"error: {one_line(str(why))}", file=sys.stderr)
    return code


def output_folder(text: str) -> Path:
    """Parse an output path, normalised: writing to `new/../b` would otherwise create `new`."""
    return Path(os.path.relpath(os.path.realpath(text)) if ".." in Path(text).parts else text)


def output_file(text: str) -> Path:
    if text.endswith("/"):
        raise argparse.ArgumentTypeError(f"{text!r} is a folder; wanted: the name of a file")
    return output_folder(text)


def _reader(read: Callable[[str], N], fits: Callable[[N], bool], wanted: str) -> Callable[[str], N]:
    """Make the parser of a number within bounds."""

    def number(text: str) -> N:
        with suppress(ValueError):
            if fits(value := read(text)):
                return value
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: {wanted}")

    return number


def whole(least: int, most: float = math.inf) -> Callable[[str], int]:
    """Make the parser of a whole number from `least` to `most`."""
    up_to = "on" if most == math.inf else f"to {most}"
    return _reader(int, lambda value: least <= value <= most, f"a whole number from {least} {up_to}")


def between(least: float, most: float) -> Callable[[str], float]:
    """Make the parser of a number from `least` to `most`."""
    return _reader(float, lambda value: least <= value <= most, f"a number from {least:g} to {most:g}")


positive = _reader(float, lambda value: 0.0 < value <= MOST, f"a number above 0, at most {MOST:g}")


def formats_of(allowed: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """Make the parser of a comma-separated list of formats."""

    def formats(text: str) -> tuple[str, ...]:
        chosen = tuple(text.split(","))
        if unknown := [name for name in chosen if name not in allowed]:
            raise argparse.ArgumentTypeError(f"{', '.join(unknown)!r} is not allowed; formats are {', '.join(allowed)}")
        return chosen

    return formats
