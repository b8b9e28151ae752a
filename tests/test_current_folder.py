"""Nothing in the current folder is executed, whatever it is called."""

from __future__ import annotations

import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.slow

NAMES = ("airground_drake", "cvc5", "joblib", "json", "multiprocessing", "numpy", "pandas", "pickle", "z3")
HOSTILE = "import os\nopen(os.path.join(os.path.dirname(os.path.abspath(__file__)), 'ran'), 'a').write(__name__)\n"
CAMPAIGN = {
    "name": "few", "scenario": "minimal", "set": {"duration_s": 0.2}, "claims": ["SAFE-TRACE"],
    "draw": {"seed": {"integer": [0, 9]}},
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Modules that take the place of others, and a configuration with a cache from which numba would unpickle."""
    hostile = tmp_path / "hostile"
    hostile.mkdir()
    for name in NAMES:
        (hostile / f"{name}.py").write_text(HOSTILE)
    (hostile / ".numba_config.yaml").write_text(f"cache_dir: {hostile / 'cache'}\n")
    (hostile / "few.yaml").write_text(yaml.safe_dump(CAMPAIGN))
    return hostile


@pytest.mark.parametrize(
    "command",
    [
        "verify minimal SAFE-LEMMA",
        "report minimal -o out --format json --set duration_s=0.5",
        "check REPORT",
        "campaign few.yaml -n 2 --jobs 2 -o out",
    ],
)
def test_nothing_in_the_current_folder_is_executed(
    command: str, folder: Path, report: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)  # it would take precedence
    arguments = command.replace("REPORT", str(report("case_a")) if "REPORT" in command else "").split()
    airground = Path(sysconfig.get_path("scripts")) / "airground"
    done = subprocess.run([airground, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert not (folder / "ran").exists(), (folder / "ran").read_text()
    assert not (folder / "cache").exists()
    assert done.returncode in (0, 1), done.stderr  # 1: half a second is too short to arrive
    assert done.stdout
