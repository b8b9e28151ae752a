"""`python docs/pictures.py reports/audit`: the pictures of docs/audit.md, from what `airground report audit` wrote."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from airground_drake import files, trace
from airground_drake.report.figures import canvas, comparison, findings, zeno_refine
from airground_drake.report.figures.panels import Figure
from airground_drake.scenarios.load import load

FOLDER = Path(__file__).parent / "audit"


def main(report: Path) -> None:
    """Write the pictures."""
    document = json.loads((report / "report.json").read_text(encoding="utf-8"))
    for figure in (*findings.draw(document["audit"]), *_of_runs(document, report)):
        for name, text in pictures(figure):
            files.write_text(FOLDER / name, text)


def pictures(figure: Figure) -> Iterator[tuple[str, str]]:
    """The panels of a figure as files: audit-7.svg, or recursion-1.svg and so on where there are several."""
    for position, panel in enumerate(figure.panels):
        number = f"-{position + 1}" if len(figure.panels) > 1 else ""
        wide = re.search(r'viewBox="0 0 (\S+)', panel.svg)
        width = canvas.SCALE * float(wide[1]) if wide else 0.0
        yield f"{figure.id}{number}.svg", panel.svg.replace("<svg ", f'<svg width="{width:.0f}" ', 1) + "\n"


def _of_runs(document: dict[str, Any], report: Path) -> list[Figure]:
    """Those of findings 1 and 9, which the report draws from its runs and from ZENO-REFINE."""
    runs = {name: trace.load(report / "trace" / name) for name in document["runs"]}
    (refined,) = (claim["evidence"] for claim in document["claims"] if claim["id"] == "ZENO-REFINE")
    with canvas.style():
        drawn = comparison.draw(load("case_a")[0], runs), zeno_refine.draw(refined)
    return [figure for figure in drawn if figure is not None]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
