"""The figures of a report as files for a paper, with captions and tables in LaTeX."""

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.statuses import NOT_EXERCISED, PASSING, outcome
from airground_drake.report import rules
from airground_drake.report.figures import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.report.model import Report
from airground_drake.report.sentences import as_text, grouped
from airground_drake.report.view import canvas
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

# Settings of matplotlib by style: serif type for two columns, sans serif for one.
STYLES: dict[str, dict[str, Any]] = {
    "ieee": {"font.family": "serif", "font.serif": ["STIXGeneral", "Times"], "mathtext.fontset": "stix"},
    "thesis": {"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"]},
}
WIDTHS = {"ieee": r"\columnwidth", "thesis": r"0.7\linewidth"}  # width of a figure in the text

# Metadata without a date, by format, so that the same run gives the same file.
UNDATED: dict[str, dict[str, None]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
_COMMON = {"savefig.dpi": 300, "pdf.fonttype": 42}
_SPECIAL = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", **{character: f"\\{character}" for character in "&%$#_{}"},
    "○": r"$\circ$", "●": r"$\bullet$", "\N{MULTIPLICATION SIGN}": r"$\times$", "✖": r"$\times$", "□": r"$\square$",
    "◆": r"$\blacklozenge$", "▲": r"$\blacktriangle$", "▼": r"$\blacktriangledown$", "…": r"\ldots{}",
    "\N{MINUS SIGN}": "$-$", "\N{EN DASH}": "--",
}  # fmt: skip


def write(
    report: Report, scenario: Scenario, traces: Mapping[str, Trace], folder: Path, style: str, formats: Sequence[str]
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
    tables = {"verdicts.tex": verdicts(report)}
    if report.reproduction:
        tables["reproduction.tex"] = reproduction(report)
    for name, text in {"figures.tex": "\n".join(texts), **tables}.items():
        files.write_text(folder / name, text)
        yield folder / name


def _environment(figure: Figure, names: Sequence[str], width: str, report: Report) -> str:
    """A figure in LaTeX: its panels, narrow ones side by side, and a caption that says what is established."""
    across, width = ("figure*", r"\textwidth") if figure.look == "wide" else ("figure", width)
    panels = [rf"  \includegraphics[width={width}]{{{name}}}\\" for name in names]
    caption = escaped(" ".join([figure.caption, *_established(rules.CAPTIONS.get(figure.id, ()), report)]))
    lines = [
        rf"\begin{{{across}}}",
        r"  \centering",
        *panels,
        rf"  \caption{{{caption}}}",
        rf"  \label{{fig:{figure.id}}}",
    ]
    return "\n".join([*lines, rf"\end{{{across}}}", ""])


def _established(claims: Sequence[str], report: Report) -> Iterator[str]:
    """A sentence per claim: proved, refuted, or the runs in which it holds."""
    for name in claims:
        found = grouped((outcome(claim.status, claim.exercised), claim.run) for claim in report.about(name))
        for status, runs in found.items():
            if status not in (*PASSING, "refuted"):
                continue
            noun = "runs" if len(runs) > 1 else "run"
            where = f" in {noun} {', '.join(runs)}" if any(runs) else ""
            yield f"{name} {status if status == 'holds' else f'is {status}'}{where}."


def escaped(text: str) -> str:
    """Text escaped for LaTeX with the packages amssymb and booktabs; a line break becomes a space."""
    return "".join(_SPECIAL.get(character, character) for character in " ".join(text.split()))


def verdicts(report: Report) -> str:
    # "not tested" stands for a verdict that nothing could have refuted.
    statuses_by_claim: dict[str, dict[str, str]] = {}
    for claim in report.claims:
        status = outcome(claim.status, claim.exercised)
        shown = "not tested" if status == NOT_EXERCISED else status
        statuses_by_claim.setdefault(claim.id, {})[claim.run] = shown
    runs = list(report.runs)
    rows = [[name, *(statuses.get(run, "") for run in ("", *runs))] for name, statuses in statuses_by_claim.items()]
    return _table(["claim", "model", *runs], "l" * (2 + len(runs)), rows)


def reproduction(report: Report) -> str:
    rows = [
        [row.id, row.quantity, as_text(row.paper, row.unit), as_text(row.ours, row.unit), row.status.replace("_", " ")]
        for row in report.reproduction
    ]
    return _table(["", "quantity", "paper", "ours", ""], r"lp{0.45\linewidth}lll", rows)


def _table(head: Sequence[str], columns: str, rows: Sequence[Sequence[str]]) -> str:
    lines = [" & ".join(map(escaped, row)) + r" \\" for row in (head, *rows)]
    body = "\n".join(lines[1:])
    return (
        f"\\begin{{tabular}}{{{columns}}}\n\\toprule\n{lines[0]}\n\\midrule\n{body}\n\\bottomrule\n\\end{{tabular}}\n"
    )
