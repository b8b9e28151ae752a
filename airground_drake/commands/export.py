"""`airground export DIR [RUN] --to csv|mcap`: write the runs of a report as files for other programs."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, UnknownNameError
from airground_drake.base.usage import Parser, refuse
from airground_drake.commands.replay import outside_reports, runs_of

KINDS = ("csv", "mcap")


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = Parser(
        prog="airground export",
        description="Write the runs of a report as CSV tables, or as MCAP files for Foxglove.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a report")
    parser.add_argument("run", nargs="?", metavar="RUN", help="default: all runs")
    parser.add_argument("--to", choices=KINDS, required=True, help="kind of the files")
    parser.add_argument("-o", "--output", type=Path, default=Path(), metavar="FOLDER", help="default: this folder")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the files, and print their paths.

    Returns:
        Exit code: 0, or 2 if the report, the run or the output cannot be used.
    """
    options = parser().parse_args(arguments)
    try:
        runs = runs_of(options.folder)
        if options.run not in (None, *runs):
            raise UnknownNameError("run", options.run, runs)
        outside_reports(options.output, "the files")
        for name in [options.run] if options.run else runs:
            for path in _written(options.folder / "trace" / name, options.to, options.output):
                print(path)
    except (AirgroundError, OSError) as error:
        return refuse(error)
    return 0


def _written(folder: Path, kind: str, output: Path) -> Iterator[Path]:
    """The files of a saved run, as they are written."""
    from airground_drake.export import recording, tables
    from airground_drake.run import trace
    from airground_drake.scenarios.load import from_data

    saved = trace.load(folder)
    if kind == "csv":
        yield from tables.write(saved, output)
        return
    path = output / f"{saved.run}.mcap"
    files.write_bytes(path, recording.recorded(saved, from_data(saved.meta["scenario"], str(folder))))
    yield path
