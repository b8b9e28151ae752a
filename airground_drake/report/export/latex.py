"""Tables of a report in LaTeX, with the package booktabs: its verdicts, and what it reproduces of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from airground_drake.base.statuses import outcome
from airground_drake.report.model import Report

_SPECIAL = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", **{each: f"\\{each}" for each in "&%$#_{}"},
    "○": r"$\circ$", "●": r"$\bullet$", "\N{MULTIPLICATION SIGN}": r"$\times$", "✖": r"$\times$", "□": r"$\square$",
    "◆": r"$\blacklozenge$", "▲": r"$\blacktriangle$", "▼": r"$\blacktriangledown$", "…": r"\ldots{}",
}  # fmt: skip


def escaped(text: str) -> str:
    """Text as LaTeX shows it, with the packages amssymb and booktabs; a line break becomes a space."""
    return "".join(_SPECIAL.get(each, each) for each in " ".join(text.split()))


def verdicts(report: Report) -> str:
    """A table with a row per claim: its verdict about the model, or about each run."""
    # "not tested" stands for a verdict that nothing could have refuted.
    found: dict[str, dict[str, str]] = {}
    for claim in report.claims:
        status = outcome(claim.status, claim.exercised)
        found.setdefault(claim.id, {})[claim.run] = {"not_exercised": "not tested"}.get(status, status)
    runs = list(report.runs)
    rows = [[name, *(statuses.get(run, "") for run in ("", *runs))] for name, statuses in found.items()]
    return _table(["claim", "model", *runs], "l" * (2 + len(runs)), rows)


def reproduction(report: Report) -> str:
    """A table with a row per result of the paper: its value there, here, and whether it was reproduced."""
    rows = [
        [row.id, row.quantity, _value(row.paper, row.unit), _value(row.ours, row.unit), row.status.replace("_", " ")]
        for row in report.reproduction
    ]
    return _table(["", "quantity", "paper", "ours", ""], r"lp{0.45\linewidth}lll", rows)


def _value(value: Any, unit: str) -> str:
    """A value of the reproduction with its unit."""
    if value is None:
        return "none"
    if unit == "yes/no":
        return "yes" if value else "no"
    numbers = ", ".join(f"{number:.4g}" for number in (value if isinstance(value, list) else [value]))
    return f"({numbers}) {unit}" if isinstance(value, list) else f"{numbers} {unit}"


def _table(head: Sequence[str], columns: str, rows: Sequence[Sequence[str]]) -> str:
    lines = [" & ".join(map(escaped, row)) + r" \\" for row in (head, *rows)]
    body = "\n".join(lines[1:])
    return (
        f"\\begin{{tabular}}{{{columns}}}\n\\toprule\n{lines[0]}\n\\midrule\n{body}\n\\bottomrule\n\\end{{tabular}}\n"
    )
