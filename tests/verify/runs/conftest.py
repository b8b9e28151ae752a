"""Honest runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from verify.runs.cases import BLOCKS, EIGHT, SYNTHETIC

from airground_drake.run.trace import Trace


@pytest.fixture(scope="session")
def base(run: Any) -> Callable[[str], Trace]:
    """`base(name)`: an honest run: synthetic, shipped, or of method (c) with few stages, by route."""

    def get(name: str) -> Trace:
        if name in SYNTHETIC:
            return SYNTHETIC[name]()
        if name == BLOCKS:
            return run("soft_gate", "c", set=[*EIGHT, "gatekeeper.route=mixed_integer", "gatekeeper.blocks=4"])
        if " " not in name:
            return run("soft_gate", "c", set=[*EIGHT, f"gatekeeper.route={name}"])
        return run(*name.split())

    return get
