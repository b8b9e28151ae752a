"""`airground figures DIR`: the figures of a report as files for a paper, with captions and tables in LaTeX."""

from collections.abc import Sequence
from pathlib import Path

from airground_drake.base.errors import one_line
from airground_drake.base.usage import formats_of
from airground_drake.commands.saved import outside_reports, runs_of, trace_of
from airground_drake.scenario.options import Parser, option, parser_of

# The styles are those of `export.figures`, which takes seconds to import.
FORMATS, STYLES = ("pdf", "png", "svg"), ("ieee", "thesis")


def parser() -> Parser:
    says = "Write the figures of a report as files, figures.tex with captions, and tables in LaTeX."
    return parser_of("figures", says, {
        "folder": None,
        "--style": option("fonts and widths (default: ieee)", choices=STYLES, default="ieee"),
        "--format": option(f"comma-separated: {','.join(FORMATS)} (default: pdf)", kind=formats_of(FORMATS),
                           default=("pdf",)),
        "-o --output": {"help": "default: figures", "metavar": "FOLDER", "default": Path("figures")},
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    runs = runs_of(options.folder)
    outside_reports(options.output, "the figures")
    from airground_drake.report import model
    from airground_drake.report.export import figures

    saved = {name: trace_of(options.folder, name) for name in runs}
    report = model.read(options.folder)
    traces = {name: saved[name][0] for name in report.runs if name in saved}
    scenario = saved[next(iter(traces))][1]
    for path in figures.write(report, scenario, traces, options.output, options.style, options.format):
        print(one_line(str(path)))
    return 0
