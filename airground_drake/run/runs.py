"""The runs of a scenario, each simulated in a child process; what comes back is a saved trace, read with its checks.

So nothing that a scenario's routes and tasks do to the process that they run in reaches the one in which verdicts are
made; and a run that ends its process is a failure that the caller survives.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
import warnings
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from airground_drake.base import files, interruption
from airground_drake.base.errors import AirgroundError, PluginError, ScenarioError, SimulationError, described, one_line
from airground_drake.base.parallel import forks, processors
from airground_drake.base.progress import SILENT, Progress
from airground_drake.intervention.guest.process import end_all
from airground_drake.nsbc import kernels
from airground_drake.run import trace
from airground_drake.run.simulation import simulate, warm_up
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import validated
from airground_drake.scenarios.schema import Scenario

FAILURE = "failure.json"
TOLD_S = 0.2
"""Period of progress messages, s."""
STANDSTILL_S = 600.0
"""A run ends when its simulated time has stood still for so long by the clock, s. Only third-party code can hang: every
step of the package is bounded in counts."""


def simulate_all(
    scenario: Scenario,
    jobs: int | None = None,
    progress: Progress = SILENT,
    meanwhile: Callable[[], object] | None = None,
) -> dict[str, Trace]:
    """Simulate every run of a scenario, in its order, each in a process of its own.

    Args:
        scenario: from a file or made in Python.
        jobs: number of processes at a time; default: one for each processor that this process may use.
        progress: is told the simulated time.
        meanwhile: is called once, when the first processes have begun.

    Raises:
        ScenarioError: if the scenario is not valid.
        PluginError: if it names a policy, route, task or solver that cannot be made.
        SimulationError: if a simulation stops before its end, or comes no further.
        AirgroundError: if its process dies.
    """
    scenario = validated(scenario)
    most = processors() if jobs is None else max(1, jobs)
    context = multiprocessing.get_context("fork") if forks() else multiprocessing.get_context("spawn")
    if not _compiled():
        progress.stage("compiling, once, about half a minute")
    if forks():
        warm_up()
    progress.stage(f"simulating {', '.join(scenario.runs)}", scenario.duration_s * len(scenario.runs), "s")
    clocks = {name: context.RawValue("d") for name in scenario.runs}
    waiting, running = deque(scenario.runs), dict[str, BaseProcess]()
    traces: dict[str, Trace] = {}
    since = dict[str, tuple[float, float]]()  # simulated time of each run, and since when it is that
    reached = 0.0
    with files.temporary_folder() as made, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # idle threads of numerical libraries survive a fork
        try:
            while waiting or running:
                while waiting and len(running) < most:
                    name = waiting.popleft()
                    running[name] = context.Process(target=_simulate, args=(scenario, name, made / name, clocks[name]))
                    running[name].start()
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                wait([process.sentinel for process in running.values()], TOLD_S)
                reached, before = sum(clock.value for clock in clocks.values()), reached
                progress.advance(reached - before)
                for name, process in list(running.items()):
                    if not process.is_alive():
                        traces[name] = _result(made / name, running.pop(name), f"run {name} of {scenario.name}")
                    elif name not in since or clocks[name].value > since[name][0]:
                        since[name] = clocks[name].value, time.monotonic()
                    elif time.monotonic() - since[name][1] > STANDSTILL_S:
                        raise SimulationError(name, since[name][0], f"no further after {STANDSTILL_S:g} s of waiting")
        finally:
            _stop(list(running.values()))
    return {name: traces[name] for name in scenario.runs}


def _simulate(scenario: Scenario, run: str, folder: Path, clock: Any) -> None:
    """Simulate a run in this process and save it, or what has kept it from being simulated; the clock goes with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's to heed
    signal.signal(signal.SIGTERM, _end)
    interruption.end_with_parent()  # at once: code that never returns to the interpreter heeds no other signal
    folder.mkdir()
    try:
        trace.save(simulate(scenario, run, watch=partial(setattr, clock, "value")), folder)
    except BaseException as error:
        stopped = [error.run, error.t, error.what] if isinstance(error, SimulationError) else None
        plain = str(error) if isinstance(error, AirgroundError) else described(error)
        refused = isinstance(error, PluginError | ScenarioError)
        with suppress(OSError):  # a full disk; the parent says that this process died
            files.write_json(folder / FAILURE, {"what": plain, "refused": refused, "stopped": stopped})


def _end(*_: object) -> None:
    """End this process and those of its policies at once."""
    end_all()
    os._exit(128 + signal.SIGTERM)


def _result(folder: Path, process: BaseProcess, what: str) -> Trace:
    """The trace that a process has left behind.

    Raises:
        PluginError, SimulationError: as the process has noted.
        AirgroundError: if it has noted something else, or died.
        TraceError: if the trace cannot be used.
    """
    process.join()
    code = process.exitcode or 0
    process.close()
    if (folder / FAILURE).is_file():
        raise _noted((folder / FAILURE).read_bytes(), what)
    if code or not (folder / "meta.json").is_file():
        how = interruption.ended_how(code)
        raise AirgroundError(one_line(f"{what}: the process that simulated it died ({how})"))
    return trace.load(folder)


def _noted(note: bytes, what: str) -> AirgroundError:
    """The error that a process has noted."""
    try:
        failure = json.loads(note)
        if failure["stopped"] is None:
            return (PluginError if failure["refused"] else AirgroundError)(one_line(str(failure["what"])))
        run, t, why = failure["stopped"]
        return SimulationError(str(run), float(t), str(why))
    except (ValueError, KeyError, TypeError, RecursionError):
        return AirgroundError(one_line(f"{what}: the process that simulated it left no readable note"))


def _stop(processes: list[BaseProcess]) -> None:
    """End processes, those that do not heed the request by force."""
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(timeout=2.0)
        process.kill()
        process.join()
        process.close()


def _compiled() -> bool:
    """Whether numba has kept what it has compiled of the control law."""
    return any(Path(str(kernels.avoid_one.stats.cache_path)).glob("kernels.*.nbi"))
