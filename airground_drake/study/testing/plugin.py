"""The pytest plugin with the fixture `airground_trace`: each simulation is made once per session for all workers.

Every session of pytest loads it where the package is installed. It imports Drake only when the fixture is called.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from airground_drake.scenario.load import Overrides
    from airground_drake.scenario.schema import Scenario
    from airground_drake.sim.trace import Trace


class Simulations(Protocol):
    """The type of the fixture `airground_trace`."""

    def __call__(self, scenario: str | Path | Scenario, run: str, *, set: Overrides = ()) -> Trace:
        """The trace of one run; do not change it, as other tests get the same object.

        Args:
            scenario: name of a shipped scenario, path, or object.
            run: name of one of its runs.
            set: values by dotted key, or texts as after `--set`.

        Raises:
            ScenarioError: if the scenario or an override is not valid.
            UnknownNameError: if it has no such run.
            PluginError: if it names a policy, route, task or plant that cannot be made.
            SimulationError: if the simulation stops.
        """


@pytest.fixture(scope="session")
def airground_trace(tmp_path_factory: pytest.TempPathFactory) -> Simulations:
    """`airground_trace("case_a", "d", set={"seed": 7})`: a run, simulated once per session, scenario and overrides.

    Traces are kept as files in a folder of the session (below pytest's `--basetemp`), which the workers of pytest-xdist
    share: the first one that wants a run makes it while the others wait.
    """
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "airground_traces"
    folder.mkdir(exist_ok=True)
    read: dict[str, Trace] = {}

    def get(scenario: str | Path | Scenario, run: str, *, set: Overrides = ()) -> Trace:
        from airground_drake.base import files
        from airground_drake.scenario.load import resolved
        from airground_drake.sim import trace
        from airground_drake.sim.simulation import simulate
        from airground_drake.sim.tables import SCHEMA
        from airground_drake.study.testing.assertions import chosen

        wanted = chosen(scenario, set)
        # readable names, and a digest of all that the simulation depends on
        key = re.sub(r"[^\w-]", "_", f"{wanted.name}-{run}", flags=re.ASCII)[:80]
        key += f"-{files.sha256(json.dumps([SCHEMA, resolved(wanted), run]).encode())[:16]}"
        if key not in read:
            place = folder / key
            with (folder / f"{key}.lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)  # other workers wait
                if not (place / "meta.json").exists():  # which is written last
                    trace.save(simulate(wanted, run), place)
            read[key] = trace.load(place)
        return read[key]

    return get
