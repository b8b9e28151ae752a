"""`airground figures DIR`: the figures of a report as files for a paper, with captions and tables in LaTeX."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from airground_drake.base.errors import AirgroundError
from airground_drake.base.usage import Parser, formats_of, refuse
from airground_drake.commands.replay import outside_reports, runs_of

FORMATS, STYLES = ("pdf", "png", "svg"), ("ieee", "thesis")
"""As in `export.figures`, which takes seconds to import."""


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = Parser(
        prog="airground figures",
        description="Write the figures of a report as files, figures.tex with captions, and tables in LaTeX.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a report")
    parser.add_argument("--style", choices=STYLES, default="ieee", help="type and width (default: ieee)")
    parser.add_argument(
        "--format",
        type=formats_of(FORMATS),
        default=("pdf",),
        help=f"comma-separated: {','.join(FORMATS)} (default: pdf)",
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("figures"), metavar="FOLDER", help="default: figures")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the files, and print their paths.

    Returns:
        Exit code: 0, or 2 if the report or the output cannot be used.
    """
    options = parser().parse_args(arguments)
    try:
        runs = runs_of(options.folder)
        outside_reports(options.output, "the figures")
        from airground_drake.export import figures
        from airground_drake.report.compare import read
        from airground_drake.run import trace
        from airground_drake.scenarios.load import from_data

        traces = {name: trace.load(options.folder / "trace" / name) for name in runs}
        document = read(options.folder)
        traces = {name: traces[name] for name in document["runs"] if name in traces}
        scenario = from_data(next(iter(traces.values())).meta["scenario"], str(options.folder))
        for path in figures.write(document, scenario, traces, options.output, options.style, options.format):
            print(path)
    except (AirgroundError, OSError) as error:
        return refuse(error)
    return 0
