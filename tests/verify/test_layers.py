"""Who may import whom inside verify/: claims about a run share no code with what they judge, engines know no claim."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import airground_drake
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.verify.claim import TraceClaim

PACKAGE = Path(airground_drake.__file__).parent
ABOUT_RUNS = {
    RUN_CLAIMS.load(name, of=TraceClaim).__module__.removeprefix("airground_drake.") for name in RUN_CLAIMS.own
}
"""The modules of the claims about a run."""
ALLOWED: dict[str, set[str]] = {
    "engines": {
        "base.arrays", "base.interruption", "base.statuses", "model.bodies.motion", "scenario.schema",
        "verify.engines", "verify.finding",
    },
    "runs": {
        "base.arrays", "base.errors", "base.exact", "model.plants", "scenario.plants", "scenario.schema",
        "scenario.shapes", "sim.collisions", "sim.tables", "sim.trace", "verify.claim", "verify.engines",
        "verify.finding", "verify.pair_kinds", "verify.model.theorem", "verify.runs", *ABOUT_RUNS,
    },
}  # fmt: skip
"""By folder of verify/, what its modules may import of this package; claims about a run stand beside `runs`.

What a plant takes and how its body moves is asked of the plant; `check` has both again, and SAFE-HYP measures them.
"""
JUDGED = {
    "model.bodies.world", "model.geometry", "model.law", "model.trigger", "scenario.world", "sim.blocks",
    "sim.components", "sim.diagram", "sim.simulation", "uav", "ugv",
}  # fmt: skip
"""Also the pair table of the World: claims read distances and shares from the scenario."""
DATA = {"model.geometry.motion"}
"""Types of the data of a scenario, which compute nothing that is judged: the way of an obstacle that moves."""


def modules(folder: str) -> Iterator[Path]:
    yield from (PACKAGE / "verify" / folder).rglob("*.py")
    for path in (PACKAGE / "verify" / "claims").rglob("*.py"):
        about = "runs" if f"verify.claims.{path.stem}" in ABOUT_RUNS else "model"
        if about == folder:
            yield path


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
        for path in modules(folder):
            assert all(within(name, allowed) for name in imported(path)), path
    for path in (PACKAGE / "verify" / "model").rglob("*.py"):  # only `seen_in` of a claim about the model looks at runs
        assert not any(within(name, {"verify.runs", *ABOUT_RUNS}) for name in imported(path)), path


def test_what_runs_may_import_loads_nothing_that_is_judged() -> None:
    """Not even at second hand: neither claims about a run nor anything that they import."""
    todo, seen = [*modules("runs")], set[Path]()
    while todo:
        path = todo.pop()
        seen.add(path)
        for name in imported(path):
            assert not within(name, JUDGED) or within(name, DATA), f"{path} imports {name}"
            module = PACKAGE.joinpath(*name.split("."))
            files = module.with_suffix(".py"), module.parent.with_suffix(".py")
            todo += [file for file in files if file.is_file() and file not in seen]
    assert {"geometry.py", "claim.py", "trace.py", "safe_trace.py"} <= {path.name for path in seen}


def test_judging_loads_no_drake() -> None:
    """Claims can be judged again where Drake is not installed."""
    code = (
        "import sys; from airground_drake.scenario.load import load; from airground_drake.verify import judge_model; "
        "from airground_drake.base.registry import MODEL_CLAIMS; "
        "from airground_drake.verify.registry import run_claims; run_claims(); "
        "ids = [name for name in MODEL_CLAIMS if name != 'ZENO-REFINE']; "
        "judge_model(load('case_a'), claims=ids); print('pydrake' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
