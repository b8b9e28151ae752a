"""Every benchmark can be started, as far as that what it imports is there."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("name", sorted(path.stem for path in BENCHMARKS.glob("*.py")))
def test_what_it_imports_is_there(name: str) -> None:
    assert runpy.run_path(str(BENCHMARKS / f"{name}.py"))["__doc__"]
