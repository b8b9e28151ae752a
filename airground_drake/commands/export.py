"""`airground export DIR [RUN] --to csv|mcap`: write the runs of a report as files for other programs."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import one_line
from airground_drake.commands.saved import outside_reports, runs_of, trace_of
from airground_drake.scenario.options import Parser, option, parser_of

KINDS = ("csv", "mcap")


def parser() -> Parser:
    return parser_of("export", "Write the runs of a report as CSV tables, or as MCAP files for Foxglove.", {
        "folder": None,
        "run": None,
        "--to": option("kind of the files", choices=KINDS, required=True),
        "-o --output": {"metavar": "FOLDER", "default": Path()},
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    runs = runs_of(options.folder, options.run)
    outside_reports(options.output, "the files")
    for name in runs:
        for path in _written(options.folder, name, options.to, options.output):
            print(one_line(str(path)))
    return 0


def _written(report: Path, run: str, kind: str, output: Path) -> Iterator[Path]:
    from airground_drake.report.export import recording

    saved, scenario = trace_of(report, run)
    if kind == "csv":
        yield from recording.write(saved, output)
    else:
        path = output / f"{saved.run}.mcap"
        files.write_bytes(path, recording.recorded(saved, scenario))
        yield path
