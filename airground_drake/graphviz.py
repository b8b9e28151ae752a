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

from airground_drake import blocks, files
from airground_drake.diagram import build_diagram
from airground_drake.scenarios.load import load

_GAP_PT = 24.0
"""Between the graphs of a picture."""
_GRAPH = re.compile(r"^(?=digraph )", re.MULTILINE)
_PICTURE = re.compile(r'<svg width="(\d+)pt" height="(\d+)pt".*?>\s*(<g .*</g>)\s*</svg>', re.DOTALL)
_ID = re.compile(r' id="[^"]*"')


def dot(diagram: Diagram, depth: int = 1) -> str:
    """Graphviz text of a diagram: a graph of it to that depth, then one of each diagram that is closed there.

    The same diagram always gives the same text.
    """
    return "".join(blocks.overview(diagram, depth))


def svg(dot_text: str) -> str:
    """Lay out Graphviz text as SVG, its graphs below each other; a block that has a graph is a link to it.

    The same text gives the same bytes on the same machine; box sizes depend on its fonts. The digest of the text
    is in the picture, so that it can be told whether a picture is current.
    """
    width, height, groups = 0.0, 0.0, []
    for text in _GRAPH.split(dot_text)[1:]:
        found = _PICTURE.search(re.sub(r"<!--.*?-->\n?", "", _laid_out(text, "svg").decode(), flags=re.DOTALL))
        if found is None:
            raise ValueError("this version of Graphviz writes SVG of another form")
        name = re.match(r'digraph "([^"]*)"', text)
        inner = _ID.sub("", found[3])
        groups.append(f'<g id="{name[1] if name else ""}" transform="translate(0 {height:g})">\n{inner}\n</g>')
        width, height = max(width, float(found[1])), height + float(found[2]) + _GAP_PT
    size = f"{width:g} {height - _GAP_PT:g}"
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
        f"<!-- {_digest(dot_text)} -->",
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'width="{width:g}pt" height="{height - _GAP_PT:g}pt" viewBox="0 0 {size}">',
        *groups,
        "</svg>",
        "",
    ])  # fmt: skip


def drawn(dot_text: str, kind: str) -> bytes:
    """Graphviz text as a file: dot, svg (all graphs), or of the first graph a pdf, png, or what else Graphviz knows."""
    if kind == "dot":
        return dot_text.encode()
    return svg(dot_text).encode() if kind == "svg" else _laid_out(dot_text, kind)


def _laid_out(dot_text: str, kind: str) -> bytes:
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
    """File name to content: `.dot` and `.svg` of the paper's two cases under method (d), the most complete."""
    content = {}
    for name in ("case_a", "case_b"):
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
