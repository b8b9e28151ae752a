"""The checker shares no code with what it checks, and needs only numpy, pandas and pyarrow."""

import ast
import subprocess
import sys
from pathlib import Path

from airground_drake import check

MODULES = sorted(Path(check.__file__).parent.glob("*.py"))
PRELUDE = """
import runpy, sys

ALLOWED = "airground_drake.check"

class Refuses:
    def find_spec(self, name, path=None, target=None):
        other = name.startswith("airground_drake.") and name != ALLOWED and not name.startswith(ALLOWED + ".")
        if name.split(".")[0] in ("pydrake", "scipy", "cvxpy", "numba", "matplotlib", "yaml") or other:
            raise ModuleNotFoundError(f"{name} is not installed here")

sys.meta_path.insert(0, Refuses())
sys.argv = ["check", sys.argv[1]]
runpy.run_module(ALLOWED, run_name="__main__")
"""


def test_it_imports_only_itself_the_standard_library_and_readers_of_tables() -> None:
    allowed = {*sys.stdlib_module_names, "numpy", "pandas", "pyarrow"}
    for module in MODULES:
        for node in ast.walk(ast.parse(module.read_text())):
            if isinstance(node, ast.Import):
                assert {alias.name.split(".")[0] for alias in node.names} <= allowed
            if isinstance(node, ast.ImportFrom):
                own = node.level == 1 and f"{node.module}.py" in {path.name for path in MODULES}
                assert own or (not node.level and (node.module or "").split(".")[0] in allowed)


def test_it_runs_where_no_drake_no_solver_and_nothing_else_of_the_package_is_installed(report: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PRELUDE, str(report)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " checks: " in done.stdout
