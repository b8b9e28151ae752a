"""`airground init FILE`: write a small scenario to start from."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from airground_drake import files
from airground_drake.scenarios.shipped import json_schema_file, shipped_files
from airground_drake.usage import Parser

EXIT_USAGE = 2
MODEL = "minimal"
"""The shipped scenario that is copied."""


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = Parser(
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
    text = shipped_files()[MODEL].read_text(encoding="utf-8")
    name = re.sub(r"^[\W\d_]+|[\W_]+$", "", re.sub(r"\W+", "_", path.stem, flags=re.ASCII)) or MODEL
    text = text[text.index("name:") :]  # what stands before is so of the shipped file only
    schema = f"# yaml-language-server: $schema={json_schema_file()}\n"
    try:
        files.write_text(path, schema + text.replace(f"name: {MODEL}", f'name: "{name}"', 1))
    except OSError as error:
        print(f"error: {path} cannot be written: {error.strerror or error}", file=sys.stderr)
        return EXIT_USAGE
    print(f"{path}\nnext: airground report {path}")
    return 0
