"""Graphviz pictures of diagrams: `python -m airground_drake.graphviz` writes those of the shipped scenarios."""

from __future__ import annotations

import argparse
import re
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import pygraphviz
from pydrake.systems.framework import Diagram

from airground_drake import files
from airground_drake.diagram import build_diagram
from airground_drake.scenarios.load import load, shipped

_NODE = re.compile(r"\b(cluster|clusters|s|_)(\d+)(?=diagram\b|in\b|out\b|\b)")


def dot(diagram: Diagram) -> str:
    """Graphviz text of a diagram: its systems and wires, one level deep.

    Drake numbers systems in the order in which the process made them; here they are numbered from 1, so that
    the same diagram always gives the same text.
    """
    text = str(diagram.GetGraphvizString(max_depth=1))
    numbers = sorted({int(found) for _, found in _NODE.findall(text)})
    rank = {str(number): str(i) for i, number in enumerate(numbers, start=1)}
    return _NODE.sub(lambda match: match[1] + rank[match[2]], text)


def svg(dot_text: str) -> str:
    """Lay out Graphviz text as SVG; the same text gives the same bytes with the same Graphviz."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Graphviz remarks on fonts
        graph = pygraphviz.AGraph(string=dot_text)
        drawn = graph.draw(format="svg", prog="dot").decode()
    return re.sub(r"<!--.*?-->\n?", "", drawn, flags=re.DOTALL)


def pictures() -> dict[str, str]:
    """File name to content: `.dot` and `.svg` of every shipped scenario (method (d), the most complete)."""
    content = {}
    for name in shipped():
        text = dot(build_diagram(load(name)[0], method="d"))
        content[f"{name}.dot"] = text
        content[f"{name}.svg"] = svg(text)
    return content


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the pictures, or with --check only compare: exit code 1 if one is not current."""
    parser = argparse.ArgumentParser(prog="python -m airground_drake.graphviz", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("diagrams"), help="folder (default: %(default)s)")
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a file is not current")
    options = parser.parse_args(arguments)
    stale = []
    for name, content in pictures().items():
        path = options.output / name
        if path.exists() and path.read_text(encoding="utf-8") == content:
            continue
        stale.append(str(path))
        if not options.check:
            files.write_text(path, content)
    if options.check and stale:
        print(f"not current: {', '.join(stale)}; run python -m airground_drake.graphviz", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
