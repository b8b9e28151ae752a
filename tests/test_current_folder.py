"""Nothing in the current folder is executed, whatever it is called."""

import subprocess
import sysconfig
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

NAMES = ("airground_drake", "cvc5", "joblib", "json", "multiprocessing", "numpy", "pandas", "pickle", "z3")
HOSTILE = "import os\nopen(os.path.join(os.path.dirname(os.path.abspath(__file__)), 'ran'), 'a').write(__name__)\n"
CAMPAIGN = "scenario: minimal\nset: {duration_s: 0.2}\nclaims: [SAFE-TRACE]\ndraw: {seed: {integer: [0, 9]}}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Modules with the names of well-known ones, and a configuration with a cache that numba would unpickle."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(HOSTILE)
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path / 'cache'}\n")
    (tmp_path / "few.yaml").write_text(CAMPAIGN)
    return tmp_path


@pytest.mark.parametrize(
    "commands",
    [
        ["verify minimal SAFE-INV"],
        ["report minimal -o made --format json --set duration_s=0.5", "check made"],
        ["campaign few.yaml -n 2 --jobs 2 -o out"],
    ],
)
def test_nothing_in_the_current_folder_is_executed(
    commands: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)  # it would take precedence
    for command in commands:
        airground = [Path(sysconfig.get_path("scripts")) / "airground", *command.split()]
        done = subprocess.run(airground, cwd=folder, capture_output=True, text=True, check=False)
        assert not (folder / "ran").exists(), (folder / "ran").read_text()
        assert not (folder / "cache").exists()
        assert done.returncode in (0, 1), done.stderr  # 1: half a second is too short to arrive
        assert done.stdout
