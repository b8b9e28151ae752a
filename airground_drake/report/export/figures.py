"""The figures of a report as files for a paper, with captions and tables in LaTeX."""

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.statuses import PASSING, outcome
from airground_drake.report import rules
from airground_drake.report.export import latex
from airground_drake.report.figures import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.report.model import Report
from airground_drake.report.view import canvas
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

FORMATS = ("pdf", "png", "svg")
# Settings of matplotlib by style: serif type for two columns, sans serif for one.
STYLES: dict[str, dict[str, Any]] = {
    "ieee": {"font.family": "serif", "font.serif": ["STIXGeneral", "Times"], "mathtext.fontset": "stix"},
    "thesis": {"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"]},
}
WIDTHS = {"ieee": r"\columnwidth", "thesis": r"0.7\linewidth"}  # width of a figure in the text

# Metadata without a date, by format, so that the same run gives the same file.
UNDATED: dict[str, dict[str, None]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
_COMMON = {"savefig.dpi": 300, "pdf.fonttype": 42}


def write(
    report: Report,
    scenario: Scenario,
    traces: Mapping[str, Trace],
    folder: Path,
    style: str = "ieee",
    formats: Sequence[str] = ("pdf",),
) -> Iterator[Path]:
    """Write the figures of a report, `figures.tex` with their captions, `verdicts.tex` and `reproduction.tex`."""
    # folder: where the files go; it must exist.
    texts, settings = [], {**_COMMON, **STYLES[style]}
    for figure in draw.draw(scenario, traces, settings):
        names = []
        for number, panel in enumerate(figure.panels, start=1):
            names.append(f"{figure.id}_{number}" if len(figure.panels) > 1 else figure.id)
            for kind in formats:
                buffer = io.BytesIO()
                with canvas.style(settings):
                    panel.drawing.savefig(buffer, format=kind, metadata=UNDATED.get(kind, {}))
                files.write_bytes(folder / f"{names[-1]}.{kind}", buffer.getvalue())
                yield folder / f"{names[-1]}.{kind}"
        texts.append(_environment(figure, names, WIDTHS[style], report))
    tables = {"verdicts.tex": latex.verdicts(report)}
    if report.reproduction:
        tables["reproduction.tex"] = latex.reproduction(report)
    for name, text in {"figures.tex": "\n".join(texts), **tables}.items():
        files.write_text(folder / name, text)
        yield folder / name


def _environment(figure: Figure, names: Sequence[str], width: str, report: Report) -> str:
    """A figure in LaTeX: its panels, narrow ones side by side, and a caption that says what is established."""
    across, width = ("figure*", r"\textwidth") if figure.look == "wide" else ("figure", width)
    panels = [rf"  \includegraphics[width={width}]{{{name}}}\\" for name in names]
    caption = latex.escaped(" ".join([figure.caption, *_established(rules.CAPTIONS.get(figure.id, ()), report)]))
    lines = [
        rf"\begin{{{across}}}",
        r"  \centering",
        *panels,
        rf"  \caption{{{caption}}}",
        rf"  \label{{fig:{figure.id}}}",
    ]
    return "\n".join([*lines, rf"\end{{{across}}}", ""])


def _established(claims: Sequence[str], report: Report) -> Iterator[str]:
    """A sentence per claim: what was proved, what holds in which runs, what is refuted."""
    for name in claims:
        runs_by_status: dict[str, list[str]] = {}
        for claim in report.claims:
            status = outcome(claim.status, claim.exercised)
            if claim.id == name and status in (*PASSING, "refuted"):
                runs_by_status.setdefault(status, []).append(claim.run)
        for status, runs in runs_by_status.items():
            noun = "runs" if len(runs) > 1 else "run"
            where = f" in {noun} {', '.join(runs)}" if any(runs) else ""
            yield f"{name} {status if status == 'holds' else f'is {status}'}{where}."
