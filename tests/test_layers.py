"""Which module may import which."""

from __future__ import annotations

import ast
from collections import defaultdict
from graphlib import TopologicalSorter
from pathlib import Path

import airground_drake

PACKAGE = Path(airground_drake.__file__).parent
LAYERS = (
    ("base", "check"),
    ("registry",),
    ("geometry", "maps"),
    ("world",),
    ("nsbc",),
    ("decision", "intervention"),
    ("gatekeeper",),
    ("scenarios",),
    ("systems",),
    ("run", "view"),
    ("proofs",),
    ("verify",),
    ("testing",),
    ("report", "replay", "audit"),
    ("campaign", "export", "logs"),
    ("environments",),
    ("commands", "notebook", "__main__"),
)
"""Rooms: a module imports from its own layer or from those above it."""
PROGRAMS = {
    f"airground_drake.{name}"
    for name in ("report.__main__", "report.rebuild", "report.simulated", "verify.__main__", "check.__main__")
}
"""Modules that are run with `python -m`."""


def test_gatekeepers_know_of_interventions_only_what_is_sent() -> None:
    """Proposals and messages; neither planner nor policies, and those know no gatekeeper."""
    found = {
        node.module
        for path in (PACKAGE / "gatekeeper").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airground_drake.intervention")
    }
    assert found == {"airground_drake.intervention.messages", "airground_drake.intervention.policy"}


def imported() -> dict[str, set[str]]:
    """The modules of the package that each module imports anywhere: in functions and for types, too."""
    modules = {
        ".".join(("airground_drake", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): path
        for path in PACKAGE.rglob("*.py")
    }
    found = {name: set[str]() for name in modules if name != "airground_drake"}
    for name, uses in found.items():
        parents = name.split(".") if modules[name].name == "__init__.py" else name.split(".")[:-1]
        for node in ast.walk(ast.parse(modules[name].read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                base = [*parents[: len(parents) + 1 - node.level], *filter(None, [node.module])] if node.level else []
                source = ".".join(base) or str(node.module)
                uses |= {full if (full := f"{source}.{each.name}") in modules else source for each in node.names}
            elif isinstance(node, ast.Import):
                uses |= {each.name for each in node.names}
        uses &= found.keys() - {name}
    return found


def room(module: str) -> str:
    """The room of a module. Programs stand above all rooms: only the command line knows of them."""
    return "commands" if module in PROGRAMS else module.split(".")[1]


def test_data_flows_one_way_and_no_modules_and_no_rooms_import_each_other() -> None:
    rank = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    uses = imported()
    upwards = [
        (name, other) for name, others in uses.items() for other in others if rank[room(other)] > rank[room(name)]
    ]
    assert not upwards
    TopologicalSorter(uses).prepare()  # raises CycleError, which names a circle
    rooms: dict[str, set[str]] = defaultdict(set)
    for name, others in uses.items():
        rooms[room(name)] |= {room(other) for other in others} - {room(name)}
    TopologicalSorter(rooms).prepare()
    known = [(name, other) for name, others in uses.items() for other in others & PROGRAMS if name not in PROGRAMS]
    assert {room(name) for name, _ in known} <= {"commands"}
