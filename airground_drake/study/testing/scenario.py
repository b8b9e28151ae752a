"""The scenario that a test names."""

import json
import re
from pathlib import Path

from airground_drake.base import files
from airground_drake.scenario.load import Overrides, load, resolved, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.tables import SCHEMA


def chosen(scenario: str | Path | Scenario, overrides: Overrides = ()) -> Scenario:
    return validated(scenario, overrides) if isinstance(scenario, Scenario) else load(scenario, overrides)


def digest(scenario: Scenario, run: str) -> str:
    """Name of a folder for a run: readable names, and a digest of all that the simulation depends on."""
    told = re.sub(r"[^\w-]", "_", f"{scenario.name}-{run}", flags=re.ASCII)[:80]
    return f"{told}-{files.sha256(json.dumps([SCHEMA, resolved(scenario), run]).encode())[:16]}"
