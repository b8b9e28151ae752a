"""Graphviz pictures of diagrams: `python -m airground_drake.graphviz` writes those of the shipped scenarios."""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pygraphviz
from pydrake.systems.framework import Diagram

from airground_drake import files
from airground_drake.diagram import build_diagram
from airground_drake.scenarios.load import load, shipped

_NODE = re.compile(r"\b(cluster|clusters|s|_)(\d+)(?=[a-z]*\b)")


def dot(diagram: Diagram, depth: int = 1) -> str:
    """Graphviz text of a diagram: its systems and wires, diagrams inside of it opened to so many levels.

    Drake numbers systems in the order in which the process made them, and lists wires in the order of memory
    addresses; here systems are numbered from 1 and wires sorted, so that a diagram always gives the same text.
    """
    text = str(diagram.GetGraphvizString(max_depth=depth))
    numbers = sorted({int(found) for _, found in _NODE.findall(text)})
    rank = {str(number): str(i) for i, number in enumerate(numbers, start=1)}
    lines = _NODE.sub(lambda match: match[1] + rank[match[2]], text).splitlines(keepends=True)
    wires = [i for i, line in enumerate(lines) if " -> " in line]
    for i, line in zip(wires, sorted((lines[i] for i in wires), key=_natural), strict=True):
        lines[i] = line
    return "".join(lines)


def _natural(line: str) -> list[tuple[int, str]]:
    """Sort key by which s2 comes before s10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", line)]


def svg(dot_text: str) -> str:
    """Lay out Graphviz text as SVG.

    The same text gives the same bytes on the same machine; box sizes depend on its fonts. The digest of the text
    is in the picture, so that it can be told whether a picture is current.
    """
    text = re.sub(r"<!--.*?-->\n?", "", drawn(dot_text, "svg").decode(), flags=re.DOTALL)
    return text.replace("<svg ", f"<!-- {_digest(dot_text)} -->\n<svg ", 1)


def drawn(dot_text: str, kind: str) -> bytes:
    """Lay out Graphviz text as a picture: svg, pdf, png, or what else Graphviz knows."""
    with _silent_stderr(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Graphviz and fontconfig remark on fonts; errors still raise
        picture: bytes = pygraphviz.AGraph(string=dot_text).draw(format=kind, prog="dot")
    return picture


def is_current(name: str, content: str, found: str) -> bool:
    """Whether a file's text is that of the present code: `.dot` to the letter, `.svg` by the digest inside."""
    if name.endswith(".svg"):
        mark = re.search(r"<!-- (dot sha256 \w+) -->", content)
        return mark is not None and mark[1] in found
    return content == found


def _digest(dot_text: str) -> str:
    return f"dot sha256 {files.sha256(dot_text.encode())}"


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Point file descriptor 2 at nothing: the C libraries below write there."""
    sys.stderr.flush()
    saved = os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nothing)


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
        if path.exists() and is_current(name, content, path.read_text(encoding="utf-8")):
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
