"""A mutant: one edit of one file of the package, and the runs and tests that may catch it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGE = "airground_drake"


class DoesNotApplyError(Exception):
    """The text that an edit replaces is not there once: the code has changed, and the mutant must change too."""


@dataclass(frozen=True)
class Mutant:
    """One edit.

    Attributes:
        name: what is broken, in words; unique.
        path: file, below the package.
        function: function, method or class in which the text is looked for, such as `Body.mobility`; '': in the file.
        old: text that is there exactly once.
        new: what takes its place.
        runs: short runs that are judged, in this order, until one catches it; see `probe.PROBES`.
        tests: what pytest runs if no run catches it.
    """

    name: str
    path: str
    function: str
    old: str
    new: str
    runs: tuple[str, ...] = ("crowd d", "crowd c", "case_b d")
    tests: tuple[str, ...] = ()

    def edited(self, text: str) -> str:
        """The text of the file with the edit.

        Raises:
            DoesNotApplyError: if there is no such function, or `old` is not there once.
        """
        begin, end = 0, len(text)
        if self.function:
            found = dict(_places(ast.parse(text), text)).get(self.function)
            if found is None:
                raise DoesNotApplyError(f"{self.name}: {self.path} has no {self.function}")
            begin, end = found
        if text.count(self.old, begin, end) != 1:
            count = text.count(self.old, begin, end)
            raise DoesNotApplyError(f"{self.name}: {count} times in {self.path}, {self.function}: {self.old!r}")
        return text[:begin] + text[begin:end].replace(self.old, self.new) + text[end:]

    def apply(self, root: Path) -> None:
        """Edit the copy of the package below `root`.

        Raises:
            DoesNotApplyError: as `edited`.
        """
        file = root / PACKAGE / self.path
        file.write_text(self.edited(file.read_text(encoding="utf-8")), encoding="utf-8")

    def compiled(self, root: Path) -> bool:
        """Whether numba compiles functions of the file: its cache of their callers is out of date after an edit."""
        return "@njit" in (root / PACKAGE / self.path).read_text(encoding="utf-8")


def _places(node: ast.AST, text: str, above: str = "") -> Iterator[tuple[str, tuple[int, int]]]:
    """The functions and classes of a file by their dotted names, with where their text begins and ends."""
    lines = text.splitlines(keepends=True)
    for child in ast.iter_child_nodes(node):
        name = above
        if isinstance(child, (ast.FunctionDef, ast.ClassDef)):
            name = f"{above}.{child.name}".strip(".")
            ends = child.end_lineno or child.lineno
            yield name, (sum(map(len, lines[: child.lineno - 1])), sum(map(len, lines[:ends])))
        yield from _places(child, text, name)
