"""Who may import whom inside verify/: claims about a run share no code with what they judge, engines know no claim."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import airground_drake

PACKAGE = Path(airground_drake.__file__).parent
ALLOWED: dict[str, set[str]] = {
    "engines": {
        "base.arrays", "base.interruption", "base.statuses", "verify.engines", "verify.finding", "world.motion",
    },
    "runs": {
        "base.arrays", "base.errors", "base.exact", "run.trace", "scenarios.plants", "scenarios.schema",
        "verify.engines", "verify.runs", "verify.claim", "verify.finding",
    },
}  # fmt: skip
"""By folder of verify/, beginnings of what its modules may import of this package."""
JUDGED = {
    "geometry", "nsbc", "gatekeeper", "systems", "decision", "run.simulation", "intervention", "world.world",
    "scenarios.world",
}  # fmt: skip
"""Also the pair table of the World: claims read distances and shares from the scenario."""


def imported(path: Path) -> Iterator[str]:
    """Modules of this package that a file imports, wherever in it, without the package's name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        found: list[str] = []
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, path
            found = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in found:
            head, _, tail = name.partition(".")
            if head == "airground_drake":
                yield tail


def within(name: str, places: set[str]) -> bool:
    return any(name == place or name.startswith(f"{place}.") for place in places)


@pytest.mark.parametrize("folder", ALLOWED)
def test_a_folder_imports_only_what_it_may(folder: str) -> None:
    paths = sorted((PACKAGE / "verify" / folder).rglob("*.py"))
    assert len(paths) > 2
    for path in paths:
        strangers = [name for name in imported(path) if not within(name, ALLOWED[folder])]
        assert not strangers, f"{path.name} imports {strangers}"


def test_what_runs_may_import_loads_nothing_that_is_judged() -> None:
    """Not even at second hand: neither `runs` nor anything that it imports."""
    todo, seen = sorted((PACKAGE / "verify" / "runs").rglob("*.py")), set[Path]()
    while todo:
        path = todo.pop()
        seen.add(path)
        for name in imported(path):
            assert not within(name, JUDGED), f"{path} imports {name}"
            module = PACKAGE.joinpath(*name.split("."))
            for found in (module.with_suffix(".py"), module.parent.with_suffix(".py")):
                if found.is_file() and found not in seen:
                    todo.append(found)
    assert {"geometry.py", "claim.py", "trace.py"} <= {path.name for path in seen}


def test_claims_about_the_model_look_at_no_run() -> None:
    for path in (PACKAGE / "verify" / "model").rglob("*.py"):
        assert not [name for name in imported(path) if within(name, {"verify.runs"})], path


def test_judging_loads_no_drake() -> None:
    """Claims can be judged again where Drake is not installed."""
    code = (
        "import sys; from airground_drake.scenarios.load import load; from airground_drake.verify import verify_model; "
        "from airground_drake.registry import MODEL_CLAIMS, RUN_CLAIMS; "
        "from airground_drake.verify.registry import run_claims; run_claims(); "
        "ids = [name for name in MODEL_CLAIMS if name != 'ZENO-REFINE']; "
        "verify_model(load('case_a')[0], claims=ids); print('pydrake' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
