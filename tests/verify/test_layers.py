"""Who may import whom inside verify/: claims about a run share no code with what they judge, engines know no claim."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import airground_drake

PACKAGE = Path(airground_drake.__file__).parent
ALLOWED: dict[str, set[str]] = {
    "engines": {
        "base.arrays", "base.interruption", "base.statuses", "scenarios.schema", "verify.engines", "verify.finding",
        "world.motion",
    },
    "runs": {
        "base.arrays", "base.errors", "base.exact", "run.collisions", "run.tables", "run.trace", "scenarios.plants",
        "scenarios.schema", "scenarios.shapes", "verify.engines", "verify.runs", "verify.claim", "verify.finding",
        "verify.model.theorem",
    },
}  # fmt: skip
"""By folder of verify/, what its modules may import of this package."""
JUDGED = {
    "geometry", "nsbc", "gatekeeper", "systems", "decision", "run.simulation", "intervention", "world.world",
    "scenarios.world",
}  # fmt: skip
"""Also the pair table of the World: claims read distances and shares from the scenario."""
DATA = {"geometry.motion"}
"""Types of the data of a scenario, which compute nothing that is judged: the way of an obstacle that moves."""


def imported(path: Path) -> Iterator[str]:
    """Modules of this package that a file imports, wherever in it, without the package's name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, (ast.Import, ast.ImportFrom)) else []
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{name}" for name in names]
        yield from (name.removeprefix("airground_drake.") for name in names if name.startswith("airground_drake."))


def within(name: str, places: set[str]) -> bool:
    return any(f"{name}.".startswith(f"{place}.") for place in places)


def test_a_folder_imports_only_what_it_may() -> None:
    for folder, allowed in ALLOWED.items():
        for path in (PACKAGE / "verify" / folder).rglob("*.py"):
            assert all(within(name, allowed) for name in imported(path)), path
    for path in (PACKAGE / "verify" / "model").rglob("*.py"):  # claims about the model look at no run
        assert not any(within(name, {"verify.runs"}) for name in imported(path)), path


def test_what_runs_may_import_loads_nothing_that_is_judged() -> None:
    """Not even at second hand: neither `runs` nor anything that it imports."""
    todo, seen = [*(PACKAGE / "verify" / "runs").rglob("*.py")], set[Path]()
    while todo:
        path = todo.pop()
        seen.add(path)
        for name in imported(path):
            assert not within(name, JUDGED) or within(name, DATA), f"{path} imports {name}"
            module = PACKAGE.joinpath(*name.split("."))
            files = module.with_suffix(".py"), module.parent.with_suffix(".py")
            todo += [file for file in files if file.is_file() and file not in seen]
    assert {"geometry.py", "claim.py", "trace.py"} <= {path.name for path in seen}


def test_judging_loads_no_drake() -> None:
    """Claims can be judged again where Drake is not installed."""
    code = (
        "import sys; from airground_drake.scenarios.load import load; from airground_drake.verify import judge_model; "
        "from airground_drake.registry import MODEL_CLAIMS; "
        "from airground_drake.verify.registry import run_claims; run_claims(); "
        "ids = [name for name in MODEL_CLAIMS if name != 'ZENO-REFINE']; "
        "judge_model(load('case_a'), claims=ids); print('pydrake' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
