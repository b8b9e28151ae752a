"""A mutant: one edit of one file of the package, and the tests that notice it."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass

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
        tests: what pytest runs, in this order, until a test fails.
    """

    name: str
    path: str
    function: str
    old: str
    new: str
    tests: tuple[str, ...]

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
