"""The problems of the gatekeeper's benchmark: those that a run solves; under method (d) there are none."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="module")
def benchmark_of() -> dict[str, Any]:
    """What the script defines; by its path, as `gatekeeper` is a folder of the tests."""
    return runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "gatekeeper.py"))


@pytest.mark.slow
def test_a_run_with_method_c_gives_problems(benchmark_of: dict[str, Any]) -> None:
    samples = benchmark_of["recorded"]("case_a", "c", 5)
    assert 1 < len(samples) <= 5
    assert all(problem.loop is None and problem.stages == 60 for (problem,) in samples)


def test_a_run_with_method_d_gives_none(benchmark_of: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="case_a, run d: no problem"):
        benchmark_of["recorded"]("case_a", "d", 5)
