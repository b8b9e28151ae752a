"""The plugin: importing it is cheap, and a run is simulated once."""

import subprocess
import sys
from pathlib import Path

import pytest

from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped_files
from airground_drake.sim import simulation
from airground_drake.study.testing.plugin import Simulations

SHORT = {"duration_s": 0.1}


def test_importing_it_imports_nothing_large() -> None:
    code = "import sys, airground_drake.study.testing.plugin as p; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert not {"pydrake", "numpy", "pandas", "hypothesis", "yaml"} & set(loaded)


def test_a_run_is_simulated_once_however_it_is_named(
    airground_trace: Simulations, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    first = airground_trace("minimal", "a", set=SHORT)
    monkeypatch.setattr(simulation, "simulate", None)
    file, scenario = tmp_path / "mine.yaml", load("minimal", SHORT)
    file.write_bytes(shipped_files()["minimal"].read_bytes())
    assert airground_trace("minimal", "a", set=["duration_s=0.1"]) is first
    assert airground_trace(file, "a", set=SHORT) is first
    assert airground_trace(scenario, "a") is first
    for other in (load("minimal", {**SHORT, "seed": 1}), scenario):
        scenario.duration_s = 0.05
        with pytest.raises(TypeError):  # another run would have to be simulated
            airground_trace(other, "a")
