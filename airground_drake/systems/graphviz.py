"""Graphviz pictures of diagrams: `python -m airground_drake.systems.graphviz` writes those of the shipped scenarios."""

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

from airground_drake.base import files
from airground_drake.scenarios.load import load
from airground_drake.systems import schematic
from airground_drake.systems.diagram import build_diagram, method_drawn

_PICTURE = re.compile(r'<svg width="(\d+)pt" height="(\d+)pt".*?>\s*(<g .*</g>)\s*</svg>', re.DOTALL)
_ID = re.compile(r' id="[^"]*"')


def dot(diagram: Diagram) -> str:
    """Graphviz text: the picture of the layers for a scenario's diagram, Drake's own for any other diagram.

    The text of a scenario's diagram depends on the scenario and the method only.
    """
    layered = all(diagram.HasSubsystemNamed(layer) for layer in schematic.LAYERS)
    return schematic.graph(diagram) if layered else str(diagram.GetGraphvizString(max_depth=1))


def svg(dot_text: str) -> str:
    """Lay out Graphviz text as SVG.

    The same text gives the same bytes on the same machine; box sizes depend on its fonts. The picture holds the digest
    of its text for `is_current`.
    """
    found = _PICTURE.search(re.sub(r"<!--.*?-->\n?", "", _laid_out(dot_text, "svg").decode(), flags=re.DOTALL))
    if found is None:
        raise ValueError("this version of Graphviz writes SVG of another form")
    width, height, inner = found.groups()
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
        f"<!-- {_digest(dot_text)} -->",
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}">',
        _ID.sub("", inner),
        "</svg>",
        "",
    ])  # fmt: skip


def drawn(dot_text: str, kind: str) -> bytes:
    """Graphviz text as a file of a kind that Graphviz knows: dot, svg, pdf, png and others."""
    if kind == "dot":
        return dot_text.encode()
    return svg(dot_text).encode() if kind == "svg" else _laid_out(dot_text, kind)


def _laid_out(dot_text: str, kind: str) -> bytes:
    with _silent_stderr(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Graphviz and fontconfig remark on fonts; errors still raise
        picture: bytes = pygraphviz.AGraph(string=dot_text).draw(format=kind, prog="dot")
    return picture


def is_current(name: str, content: str, found: str) -> bool:
    """Whether the file `name` with text `found` is up to date: `.dot` must equal `content`, `.svg` have its digest."""
    if name.endswith(".svg"):
        mark = re.search(r"<!-- (dot sha256 \w+) -->", content)
        return mark is not None and mark[1] in found
    return content == found


def _digest(dot_text: str) -> str:
    return f"dot sha256 {files.sha256(dot_text.encode())}"


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Discard what C libraries write to file descriptor 2."""
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
    """Contents by file name: `.dot` and `.svg` of the paper's two cases, as reports show them."""
    content = {}
    for name in ("case_a", "case_b"):
        scenario = load(name)[0]
        text = dot(build_diagram(scenario, method_drawn(scenario)))
        content[f"{name}.dot"] = text
        content[f"{name}.svg"] = svg(text)
    return content


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the pictures, or with --check only compare: exit code 1 if one is not current."""
    parser = argparse.ArgumentParser(prog="python -m airground_drake.systems.graphviz", description=__doc__)
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
        print(f"not current: {', '.join(stale)}; run python -m airground_drake.systems.graphviz", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
