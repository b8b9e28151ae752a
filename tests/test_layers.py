"""Which module may import which: every room says so in its docstring."""

import ast
import re
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import airground_drake
from airground_drake.base.registry import MODEL_CLAIMS, PLANTS, RUN_CLAIMS

PACKAGE = Path(airground_drake.__file__).parent
ROOMS = ("base", "check", "model", "uav", "ugv", "scenario", "sim", "verify", "report", "study", "commands")
"""From the ground up: a room imports at most those before it."""
OUTSIDE = {"airground_drake.__main__", "airground_drake.notebook"}
"""Modules above all rooms."""
PROGRAMS = {
    f"airground_drake.{name}"
    for name in ("report.__main__", "report.rebuild", "report.simulated", "verify.__main__", "check.__main__")
}
"""Modules that are run with `python -m`."""


def test_gatekeepers_know_of_interventions_only_what_is_sent() -> None:
    """Proposals and messages; neither planner nor policies, and those know no gatekeeper."""
    found = {
        node.module
        for path in (PACKAGE / "ugv").rglob("*.py")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airground_drake.uav")
    }
    assert found == {f"airground_drake.uav.{name}" for name in ("channel", "messages", "policy")}


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported() -> dict[str, set[str]]:
    """The modules of the package that each module imports anywhere: in functions and for types, too."""
    modules = {
        ".".join(("airground_drake", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): path
        for path in PACKAGE.rglob("*.py")
    }
    found = {name: set[str]() for name in modules if name != "airground_drake"}
    for name, uses in found.items():
        parents = name.split(".") if modules[name].name == "__init__.py" else name.split(".")[:-1]
        for node in ast.walk(tree(modules[name])):
            if isinstance(node, ast.ImportFrom):
                base = [*parents[: len(parents) + 1 - node.level], *filter(None, [node.module])] if node.level else []
                source = ".".join(base) or str(node.module)
                uses |= {full if (full := f"{source}.{each.name}") in modules else source for each in node.names}
            elif isinstance(node, ast.Import):
                uses |= {each.name for each in node.names}
        uses &= found.keys() - {name}
    return found


def declared(room: str) -> set[str]:
    """The rooms that a room says it may import; it says what enters and what leaves, too."""
    says = ast.get_docstring(tree(PACKAGE / room / "__init__.py")) or ""
    lines = re.search(r"^Enters: .+\.\nLeaves: .+\.\nMay import: (.+)\.$", says, re.MULTILINE)
    assert lines, room
    return set(re.findall(r"`(\w+)`", lines[1]))


def test_rooms_import_only_what_they_say_and_nothing_runs_up() -> None:
    may = {room: declared(room) for room in ROOMS}
    assert all(may[room] <= set(ROOMS[:i]) for i, room in enumerate(ROOMS)), may
    for name, others in imported().items():
        room = name.split(".")[1]
        allowed = set(ROOMS) if name in OUTSIDE else {room, *may[room]}
        assert {other.split(".")[1] for other in others} <= allowed, name


def test_no_modules_and_no_folders_import_each_other() -> None:
    uses = imported()
    TopologicalSorter(uses).prepare()  # raises CycleError, which names a circle
    folders: dict[str, set[str]] = defaultdict(set)
    for name, others in uses.items():
        folders[folder(name)] |= {folder(other) for other in others} - {folder(name)}
    TopologicalSorter(folders).prepare()


def folder(module: str) -> str:
    """The folder of a module inside its room; the module itself if it stands in the room."""
    parts = module.split(".")
    return ".".join(parts[:3]) if PACKAGE.joinpath(*parts[1:3]).is_dir() else module


TERMS = {"model/plants/budget.py", "scenario/budget.py"}
"""Files in which `lag` and `delay` are terms of a budget."""


def test_a_plant_is_named_in_its_own_file_only() -> None:
    """Whoever asks for a kind by its name would have to be found for each new plant; the checker is apart."""
    for path in sorted({*PACKAGE.rglob("*.py")} - {*(PACKAGE / "check").rglob("*.py")}):
        file = path.relative_to(PACKAGE).as_posix()
        texts = {node.value for node in ast.walk(tree(path))
                 if isinstance(node, ast.Constant) and isinstance(node.value, str)}  # fmt: skip
        named = texts & {*PLANTS.own}
        assert named <= ({path.stem} if file.startswith("model/plants/") else set()) or file in TERMS, (file, named)


def test_claims_are_named_in_their_files_in_the_registry_and_in_the_rules_of_the_report() -> None:
    """Elsewhere only in texts of users' files: scenarios that are written, and examples in docstrings and helps."""
    named = re.compile("|".join((*RUN_CLAIMS.own, *MODEL_CLAIMS.own)))
    users = {
        "scenario/fleet.py", "scenario/imported.py", "commands/campaign.py", "study/campaign/spec.py",
        "study/testing/__init__.py", "study/testing/strategies.py",
    }  # fmt: skip
    files = {
        str(path.relative_to(PACKAGE))
        for room in ROOMS
        if room not in ("check", "verify")
        for kind in ("*.py", "*.j2")
        for path in (PACKAGE / room).rglob(kind)
        if named.search(path.read_text(encoding="utf-8"))
    }
    assert files == users | {"base/registry.py", "report/rules.py"}


def test_only_the_command_line_knows_programs() -> None:
    known = [(name, other) for name, uses in imported().items() for other in uses & PROGRAMS if name not in PROGRAMS]
    assert {name.split(".")[1] for name, _ in known} <= {"commands"}
