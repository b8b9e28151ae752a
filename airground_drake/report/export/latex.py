"""Tables of a report in LaTeX, with the package booktabs: its verdicts, and what it reproduces of the paper."""

from collections.abc import Sequence

from airground_drake.base.statuses import NOT_EXERCISED, outcome
from airground_drake.report.model import Report
from airground_drake.report.quantities import told

_SPECIAL = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", **{character: f"\\{character}" for character in "&%$#_{}"},
    "○": r"$\circ$", "●": r"$\bullet$", "\N{MULTIPLICATION SIGN}": r"$\times$", "✖": r"$\times$", "□": r"$\square$",
    "◆": r"$\blacklozenge$", "▲": r"$\blacktriangle$", "▼": r"$\blacktriangledown$", "…": r"\ldots{}",
    "\N{MINUS SIGN}": "$-$", "\N{EN DASH}": "--",
}  # fmt: skip


def escaped(text: str) -> str:
    """Text as LaTeX shows it, with the packages amssymb and booktabs; a line break becomes a space."""
    return "".join(_SPECIAL.get(character, character) for character in " ".join(text.split()))


def verdicts(report: Report) -> str:
    """A table with a row per claim: its verdict about the model, or about each run."""
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
    """A table with a row per result of the paper: its value there, here, and whether it was reproduced."""
    rows = [
        [row.id, row.quantity, told(row.paper, row.unit), told(row.ours, row.unit), row.status.replace("_", " ")]
        for row in report.reproduction
    ]
    return _table(["", "quantity", "paper", "ours", ""], r"lp{0.45\linewidth}lll", rows)


def _table(head: Sequence[str], columns: str, rows: Sequence[Sequence[str]]) -> str:
    lines = [" & ".join(map(escaped, row)) + r" \\" for row in (head, *rows)]
    body = "\n".join(lines[1:])
    return (
        f"\\begin{{tabular}}{{{columns}}}\n\\toprule\n{lines[0]}\n\\midrule\n{body}\n\\bottomrule\n\\end{{tabular}}\n"
    )
