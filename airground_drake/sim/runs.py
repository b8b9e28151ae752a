"""Simulates the runs of a scenario in child processes; each saves its trace, which is loaded and checked here.

So third-party code cannot change the process in which verdicts are made, and the caller survives if a run's process
dies.
"""

import json
import multiprocessing
import os
import signal
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from airground_drake.base import files, interruption
from airground_drake.base.errors import AirgroundError, PluginError, ScenarioError, SimulationError, described
from airground_drake.base.parallel import forks, processes, processors, shared
from airground_drake.base.progress import SILENT, Progress
from airground_drake.model.law import kernels
from airground_drake.scenario.load import validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim import trace
from airground_drake.sim.simulation import Engine, simulate, warm_up, warm_up_beside
from airground_drake.sim.trace import Trace
from airground_drake.uav.guest.process import end_all

FAILURE = "failure.json"
TOLD_S = 0.2  # period of progress messages, s
# Wall-clock time without progress of the simulated time after which a run is ended, s. Only third-party code can hang:
# each step of the package has a bound on its work.
STANDSTILL_S = 600.0


class _Process:
    """A run in a process of its own."""

    def __init__(self, scenario: Scenario, name: str, folder: Path, engine: Engine) -> None:
        """Start the process, which writes its trace, or the reason for failing, to `folder`."""
        context = multiprocessing.get_context("fork") if forks() else multiprocessing.get_context("spawn")
        self._name, self._folder, self._what = name, folder, f"run {name} of {scenario.name}, seed {scenario.seed}"
        self._clock = context.RawValue("d")  # simulated time, s
        self._before, self._since = 0.0, time.monotonic()
        self.process = context.Process(target=_simulate, args=(scenario, name, folder, self._clock, engine))
        self.process.start()

    def advanced(self) -> float:
        """Simulated time since the last call, s."""
        by = self._clock.value - self._before
        self._before += by
        if by > 0.0:
            self._since = time.monotonic()
        elif self.process.is_alive() and time.monotonic() - self._since > STANDSTILL_S:
            raise SimulationError(self._name, self._before, f"no progress in the last {STANDSTILL_S:g} s")
        return by

    def trace(self) -> Trace:
        self.process.join()
        code = self.process.exitcode or 0
        self.process.close()
        if (self._folder / FAILURE).is_file():
            raise _noted(files.read_bytes(self._folder / FAILURE), self._what)
        if code or not (self._folder / "meta.json").is_file():
            how = interruption.ended_how(code)
            raise AirgroundError(f"{self._what}: the process that simulated it died ({how})")
        return trace.load(self._folder)


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
        meanwhile: is called once, after the first processes have started.

    Raises:
        ScenarioError: if the scenario is not valid.
        PluginError: if it names a policy, route, task, plant or solver that cannot be made.
        SimulationError: if a simulation stops before its end, or stands still.
        AirgroundError: if its process dies.
    """
    scenario = validated(scenario)
    work = [(scenario, name) for name in scenario.runs]
    traces = {trace.run: trace for trace in _simulated(work, ", ".join(scenario.runs), jobs, progress, meanwhile)}
    return {name: traces[name] for name in scenario.runs}


def simulate_seeds(
    scenario: Scenario, seeds: Iterable[int], jobs: int | None = None, progress: Progress = SILENT
) -> Iterator[Trace]:
    """Simulate every run of a scenario with some seeds, in the loop, and yield each trace when it is finished."""
    several = [validated(replace(scenario, seed=seed)) for seed in seeds]
    work = [(scenario, name) for scenario in several for name in scenario.runs]
    return _simulated(work, f"{len(several)} more seeds", jobs, progress, engine="batch")


def _simulated(
    work: Sequence[tuple[Scenario, str]],
    what: str,
    jobs: int | None,
    progress: Progress,
    meanwhile: Callable[[], object] | None = None,
    engine: Engine = "drake",
) -> Iterator[Trace]:
    """Simulate runs of validated scenarios, each in a process of its own; arguments as of `simulate_all`."""
    most = processors() if jobs is None else max(1, jobs)
    compiled, kept_in = _compiled(), kernels.avoid_one.stats.cache_path
    if not compiled:
        progress.stage("compiling, once, about half a minute")
    if forks():  # modules that each run would load itself otherwise
        with processes(1) as another:
            if kept_in and not compiled:
                another.submit(warm_up_beside)
            warm_up()
        import_module("pyarrow.parquet")
    progress.stage(f"simulating {what}", sum(scenario.duration_s for scenario, _ in work), "s")
    waiting, running = deque(enumerate(work)), dict[int, _Process]()
    with files.temporary_folder() as made, shared(), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # idle threads of numerical libraries survive a fork
        try:
            while waiting or running:
                while waiting and len(running) < most:
                    number, (scenario, name) = waiting.popleft()
                    running[number] = _Process(scenario, name, made / str(number), engine)
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                wait([worker.process.sentinel for worker in running.values()], TOLD_S)
                ended = [number for number, worker in running.items() if not worker.process.is_alive()]
                progress.advance(sum(worker.advanced() for worker in running.values()))
                for number in ended:
                    yield running.pop(number).trace()
        finally:
            _stop([worker.process for worker in running.values()])


def _simulate(scenario: Scenario, run: str, folder: Path, clock: Any, engine: Engine = "drake") -> None:
    """Simulate a run in this process and save its trace, or a note on its failure; `clock` shows simulated time."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent reacts to it
    signal.signal(signal.SIGTERM, _end)
    interruption.end_with_parent()  # by SIGKILL: code that never returns to the interpreter ignores other signals
    folder.mkdir()
    try:
        trace.save(simulate(scenario, run, watch=partial(setattr, clock, "value"), engine=engine), folder)
    except BaseException as error:
        stopped = None
        if isinstance(error, SimulationError):
            stopped = [error.run, error.t, f"{error.what} (seed {scenario.seed})"]
        plain = str(error) if isinstance(error, AirgroundError) else described(error)
        refused = isinstance(error, PluginError | ScenarioError)
        with suppress(OSError):  # a full disk: the parent reports that this process died
            files.write_json(folder / FAILURE, {"what": plain, "refused": refused, "stopped": stopped})


def _end(*_: object) -> None:
    """End this process and those of its policies at once."""
    end_all()
    os._exit(128 + signal.SIGTERM)


def _noted(note: bytes, what: str) -> AirgroundError:
    try:
        failure = json.loads(note)
        if failure["stopped"] is None:
            return (PluginError if failure["refused"] else AirgroundError)(str(failure["what"]))
        run, t, why = failure["stopped"]
        return SimulationError(str(run), float(t), str(why))
    except (ValueError, KeyError, TypeError, RecursionError):
        return AirgroundError(f"{what}: the process that simulated it left no readable note")


def _stop(processes: list[BaseProcess]) -> None:
    """End processes, by force if they ignore the request."""
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(timeout=2.0)
        process.kill()
        process.join()
        process.close()


def _compiled() -> bool:
    """Whether the cache of numba holds the compiled control law."""
    return any(Path(str(kernels.avoid_one.stats.cache_path)).glob("kernels.*.nbi"))
