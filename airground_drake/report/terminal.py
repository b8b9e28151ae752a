"""The first screen of a report as text for a terminal."""

from collections.abc import Sequence
from textwrap import wrap

from airground_drake.base.errors import one_line
from airground_drake.report.model import Report
from airground_drake.report.screen import Cell, first_screen
from airground_drake.report.sentences import MARKS, unbroken

WIDTH = 100  # characters of a line
# Widths of the columns of runs, and of questions and answers; two blanks are between columns.
COLUMNS, ANSWERS = (20, 29, 23, 22), (18, 80)


def text(report: Report) -> str:
    screen = first_screen(report)
    lines = []
    for mark, told in screen.headline:
        lines += wrap(one_line(f"[{MARKS[mark].icon}] {told}"), WIDTH, subsequent_indent="    ")
    titles = ("Run", "Safe? (nearest approach)", f"Arrived? ({screen.within})", "UAV proposals")
    runs = [[Cell("", [title]) for title in titles]]
    runs += [[Cell("", [f"{row.run}: {row.says}"]), row.safe, row.arrived, row.uav] for row in screen.rows]
    below = [(check.question, Cell(check.mark, [check.told])) for check in screen.checks]
    below += [("Do not conclude", Cell("", [f"that {warning}" for warning in screen.beware]))]
    below += [("As declared?", screen.declared)]
    asked = [question for question, _ in below]
    first = [question if question not in asked[:k] else "" for k, question in enumerate(asked)]
    answers = [[Cell("", [question]), cell] for question, (_, cell) in zip(first, below, strict=True)]
    return "\n".join([*lines, "", *_table(runs, COLUMNS), "", *_table(answers, ANSWERS)])


def _table(rows: Sequence[Sequence[Cell]], widths: Sequence[int]) -> list[str]:
    """Columns of these widths; cells are wrapped, and stand under the text of their first line, after the mark."""
    told = []
    for row in rows:
        cells = [_wrapped(cell, width) for cell, width in zip(row, widths, strict=True)]
        for k in range(max(map(len, cells))):
            parts = ((cell[k] if k < len(cell) else "").ljust(width) for cell, width in zip(cells, widths, strict=True))
            told.append("  ".join(parts).rstrip())
    return told


def _wrapped(cell: Cell, width: int) -> list[str]:
    indent = "  " if cell.mark else ""
    lines = []
    for k, line in enumerate(cell.lines):
        begin = f"{MARKS[cell.mark].icon} " if cell.mark and not k else indent
        lines += wrap(unbroken(one_line(line)), width, initial_indent=begin, subsequent_indent=f"{indent}  ")
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]
