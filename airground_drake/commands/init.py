"""`airground init FILE`: write a small scenario to start from."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from airground_drake import files

EXIT_USAGE = 2
MODEL = "minimal"
"""The shipped scenario that is copied."""


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = argparse.ArgumentParser(
        prog="airground init", description="Write a small scenario that runs: a UGV, an obstacle in its way, a UAV."
    )
    parser.add_argument("file", type=Path, nargs="?", default=Path("scenario.yaml"), help="default: %(default)s")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the file; one that is there is left alone.

    Returns:
        Exit code: 0, or 2 if the file exists or cannot be written.
    """
    path: Path = parser().parse_args(arguments).file
    if path.exists():
        print(f"error: {path} exists; name a file that does not", file=sys.stderr)
        return EXIT_USAGE
    text = (resources.files("airground_drake.scenarios") / f"{MODEL}.yaml").read_text(encoding="utf-8")
    name = re.sub(r"^[\W\d_]+|[\W_]+$", "", re.sub(r"\W+", "_", path.stem, flags=re.ASCII)) or MODEL
    _, _, text = text.partition("\n")  # what the first line says is so of the shipped file only
    try:
        files.write_text(path, text.replace(f"name: {MODEL}", f'name: "{name}"', 1))
    except OSError as error:
        print(f"error: {path} cannot be written: {error.strerror or error}", file=sys.stderr)
        return EXIT_USAGE
    print(f"{path}\nnext: airground report {path}")
    return 0
