"""Random mutants: edits of the code that produces a run, drawn from its syntax trees.

A line is drawn first, of all lines of the code in question on which there is something to edit, then a kind of edit
that is possible there, then the edit. Docstrings, messages, strings, annotations and what is raised are left alone.
"""

from __future__ import annotations

import ast
import itertools
import random
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mutation.mutant import PACKAGE, Mutant

RUNNING = (
    "base/arrays.py", "run/events.py", "run/simulation.py",
    "scenarios/courses.py", "scenarios/outlines.py", "scenarios/shapes.py", "scenarios/world.py",
    "decision", "gatekeeper", "geometry", "intervention", "nsbc", "systems", "world",
)  # fmt: skip
"""Files and folders of the code that produces a run."""
PICTURES = "systems/graphviz.py"
"""The file in these folders that only draws diagrams."""
PROBES = ("walls d", "crowd d", "crowd c", "bodies d", "case_b d", "soft_gate c", "crowd b", "walls c")
SHAPES = ("geometry/convex.py", "geometry/outline.py", "scenarios/", "verify/", "world/")
"""Beginnings of paths whose mutants are run among walls and things that move only."""
HYPOTHESES = {
    "systems/components.py": ("test_wiring.py",),
    "systems/diagram.py": ("test_wiring.py",),
    "decision": ("test_transitions.py", "test_isolation.py"),
    "nsbc": ("test_wiring.py", "test_disturbed_runs.py"),
    "systems/controllers.py": ("test_wiring.py",),
    "systems/decision.py": ("test_isolation.py",),
    "gatekeeper/patience.py": ("test_transitions.py", "test_patience_attacks.py"),
}
"""By the beginning of the path: the tests, in tests/hypotheses, that the code there meets a theorem's hypotheses."""
FLIPPED: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">")), ast.LtE: ("<=", ("<", ">")), ast.Gt: (">", (">=", "<")), ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)), ast.NotEq: ("!=", ("==",)), ast.Is: ("is", ("is not",)), ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)), ast.NotIn: ("not in", ("in",)),
}  # fmt: skip
EXCHANGED: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "/"),
    ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.Mod: ("%", "*"), ast.Pow: ("**", "*"),
}  # fmt: skip
OPPOSITES = {"min": "max", "any": "all", "minimum": "maximum", "floor": "ceil", "zeros": "ones", "argmin": "argmax"}
OPPOSITES |= {"append": "remove", "first": "last", "bisect_left": "bisect_right"}
OPPOSITES |= {other: one for one, other in OPPOSITES.items()}
UNTOUCHED = (ast.Raise, ast.Assert, ast.Import, ast.ImportFrom, ast.JoinedStr)


@dataclass(frozen=True)
class Edit:
    """Characters `start` to `end` of a text become `new`; `kind` says how, `line` where it is (from 1)."""

    kind: str
    line: int
    start: int
    end: int
    new: str


class Source:
    """A file's text and its tree, with places as numbers of characters."""

    def __init__(self, text: str) -> None:
        """Parse."""
        self.text, self.tree = text, ast.parse(text)
        lines = text.splitlines(keepends=True)
        self._bytes = [line.encode() for line in lines]
        self._begins = [0, *itertools.accumulate(map(len, lines))]

    def span(self, node: ast.expr | ast.stmt | ast.keyword) -> tuple[int, int]:
        """Where a node is."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._place(node.lineno, node.col_offset), self._place(node.end_lineno, node.end_col_offset)

    def _place(self, line: int, column: int) -> int:
        return self._begins[line - 1] + len(self._bytes[line - 1][:column].decode())

    def of(self, node: ast.expr | ast.stmt) -> str:
        """The text of a node."""
        start, end = self.span(node)
        return self.text[start:end]

    def edits(self) -> Iterator[Edit]:
        """Every edit; after some the file does not compile."""
        return self._below(self.tree, {})

    def compiles_with(self, edit: Edit) -> bool:
        """Whether the file still does after an edit."""
        try:
            compile(self.text[: edit.start] + edit.new + self.text[edit.end :], "drawn", "exec")
        except (SyntaxError, ValueError):
            return False
        return True

    def _below(self, node: ast.AST, local: Mapping[str, str]) -> Iterator[Edit]:
        """Edits of a node and of the nodes in it; `local` has the names of the surrounding function, with types."""
        if isinstance(node, UNTOUCHED):
            return
        if isinstance(node, ast.FunctionDef):
            local = _local_names(node)
        if isinstance(node, (ast.expr, ast.stmt)):
            yield from self._edits_of(node, local)
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "returns", "decorator_list"):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        yield from self._below(child, local)

    def _edits_of(self, node: ast.expr | ast.stmt, local: Mapping[str, str]) -> Iterator[Edit]:
        match node:
            case ast.Compare() | ast.BinOp() | ast.BoolOp() | ast.UnaryOp():
                yield from self._edits_of_operator(node)
            case ast.Constant():
                yield from (self._instead("constant", node, new) for new in _other_constants(node.value))
            case ast.Name(ctx=ast.Load()) if node.id in local:
                alike = (name for name, kind in local.items() if kind == local[node.id] and name != node.id)
                yield from (self._instead("name", node, other) for other in alike)
            case ast.Call():
                yield from self._edits_of_call(node)
            case ast.If() | ast.While() | ast.IfExp():
                yield self._instead("condition", node.test, f"not ({self.of(node.test)})")
            case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Continue() | ast.Break():
                yield self._instead("statement", node, "pass")
            case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                yield self._instead("statement", node, "pass")
            case _:
                pass

    def _instead(self, kind: str, node: ast.expr | ast.stmt, new: str) -> Edit:
        """`new` in the place of a node."""
        return Edit(kind, node.lineno, *self.span(node), new)

    def _edits_of_operator(self, node: ast.expr) -> Iterator[Edit]:
        match node:
            case ast.Compare(ops=[op]):
                old, others = FLIPPED[type(op)]
                for new in others:
                    yield from self._between("comparison", node.left, node.comparators[0], old, new)
            case ast.BinOp(op=op) if type(op) in EXCHANGED:
                yield from self._between("operator", node.left, node.right, *EXCHANGED[type(op)])
            case ast.BoolOp():
                old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
                if len(node.values) == 2:  # of more than two, one joint alone would bind differently
                    yield from self._between("operator", node.values[0], node.values[1], old, new)
                for one, other in itertools.pairwise(node.values):
                    yield Edit("part dropped", node.lineno, self.span(one)[0], self.span(other)[0], "")
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                yield self._instead("sign", node, self.of(node.operand))
            case _:
                pass

    def _edits_of_call(self, node: ast.Call) -> Iterator[Edit]:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in OPPOSITES:
            _, end = self.span(node.func)
            yield Edit("function", node.lineno, end - len(name), end, OPPOSITES[name])
        for one, other in itertools.pairwise(node.args):
            (start, _), (_, end) = self.span(one), self.span(other)
            joint = self.text[self.span(one)[1] : self.span(other)[0]]
            if type(one) is type(other) and self.of(one) != self.of(other):
                yield Edit("arguments", one.lineno, start, end, self.of(other) + joint + self.of(one))
        for keyword in node.keywords:
            start, end = self.span(keyword)
            after = re.compile(r",?\s*").match(self.text, end)
            assert after is not None
            yield Edit("argument dropped", keyword.lineno, start, after.end(), "")

    def _between(self, kind: str, left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator[Edit]:
        """`old`, which is between two nodes, becomes `new`."""
        start, end = self.span(left)[1], self.span(right)[0]
        at = self.text.index(old, start, end)
        yield Edit(kind, left.end_lineno or left.lineno, at, at + len(old), new)


def _other_constants(value: object) -> tuple[str, ...]:
    """Replacements of a constant; none for a text."""
    if isinstance(value, bool):
        return (str(not value),)
    if isinstance(value, int):
        return str(value + 1), str(value - 1)
    if isinstance(value, float):
        return str(1.1 * value if value else 1.0), str(0.0 if value else -1.0)
    return ()


def _local_names(function: ast.FunctionDef) -> dict[str, str]:
    """Arguments of a function, with their annotations, and its variables, with none."""
    arguments = (each for each in ast.walk(function.args) if isinstance(each, ast.arg) and each.arg != "self")
    stored = (each for each in ast.walk(function) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store))
    names = {each.id: "" for each in stored}
    return names | {each.arg: ast.unparse(each.annotation) if each.annotation else "" for each in arguments}


def files(root: Path, only: Sequence[str] = ()) -> list[str]:
    """Paths below the package of the running code that have one of the words of `only` in them, if there are any.

    A word that is the path of a file below the package stands for that file, whatever it does.
    """
    package = root / PACKAGE
    found = [
        file for name in RUNNING for file in ((package / name).rglob("*.py") if "." not in name else [package / name])
    ]
    paths = sorted(file.relative_to(package).as_posix() for file in found)
    running = [path for path in paths if path != PICTURES]
    running += [word for word in only if word not in running and word.endswith(".py") and (package / word).exists()]
    return [path for path in running if not only or any(word in path for word in only)]


def draw(root: Path, count: int, seed: int, only: Sequence[str] = ()) -> list[Mutant]:
    """Different mutants of the package below `root`, by a seed; fewer if there are no more."""
    places: dict[tuple[str, int], dict[str, list[Edit]]] = {}
    sources = {path: Source((root / PACKAGE / path).read_text(encoding="utf-8")) for path in files(root, only)}
    for path, source in sources.items():
        for edit in source.edits():
            places.setdefault((path, edit.line), defaultdict(list))[edit.kind].append(edit)
    rng, mutants = random.Random(seed), list[Mutant]()
    while places and len(mutants) < count:
        place = path, _ = rng.choice(list(places))
        kind = rng.choice(list(places[place]))
        edits = places[place][kind]
        edit = edits.pop(rng.randrange(len(edits)))
        if sources[path].compiles_with(edit):
            mutants.append(mutant(root, path, sources[path].text, edit))
        if not edits:
            del places[place][kind]
        if not places[place]:
            del places[place]
    return mutants


def _tests(root: Path, path: str) -> list[str]:
    """The test file that is named like a file of the package, and others beside it that import the file.

    The whole folder of tests, if none has the name.
    """
    folder, name = Path("tests", path).parent, Path(path).stem
    while not (root / folder).exists():  # tests of a nested folder may lie one above
        folder = folder.parent
    if folder == Path("tests"):
        return ["tests/test_simulation.py", "tests/test_diagram.py"]
    named = folder / f"test_{name}.py"
    if not (root / named).exists():
        return [str(folder)]
    package = re.escape(f"{PACKAGE}.{Path(path).parent.as_posix().replace('/', '.')}")
    imports = re.compile(rf"^from {package}(\.{name} import | import .*\b{name}\b)", flags=re.MULTILINE)
    beside = (each.relative_to(root) for each in sorted((root / folder).glob("test_*.py")))
    return [
        str(named),
        *(str(each) for each in beside if each != named and imports.search((root / each).read_text("utf-8"))),
    ]


def mutant(root: Path, path: str, text: str, edit: Edit) -> Mutant:
    """An edit of a file as a mutant: with whole lines, as many as are there once."""
    first, last = text.rfind("\n", 0, edit.start) + 1, text.find("\n", edit.end)
    while text.count(text[first:last]) > 1:
        first = text.rfind("\n", 0, max(first - 1, 0)) + 1
    old, new = text[first:last], text[first : edit.start] + edit.new + text[edit.end : last]
    was = " ".join(text[edit.start : edit.end].split())
    ours = next((names for beginning, names in HYPOTHESES.items() if path.startswith(beginning)), ())
    tests = [*(f"tests/hypotheses/{name}" for name in ours), *_tests(root, path)]
    what = f"{path}:{edit.line}:{edit.start - first}: {edit.kind}: {was[:60]!r} becomes {edit.new[:60]!r}"
    probes = tuple(name for name in PROBES if name.startswith("walls")) if path.startswith(SHAPES) else PROBES
    return Mutant(what, path, "", old, new, probes, tuple(tests))
