"""Runs in child processes: what comes back is a trace, an error in words, or that the process died."""

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from airground_drake.base.errors import AirgroundError, PluginError, SimulationError
from airground_drake.base.registry import UAV_TASKS
from airground_drake.scenario.schema import Scenario
from airground_drake.sim import runs
from airground_drake.sim.runs import simulate_all


def one_run(scenario: Scenario) -> Scenario:
    scenario.duration_s, scenario.runs = 0.5, {"a": scenario.runs["a"]}
    scenario.reproduction, scenario.choices = [], []
    scenario.uav.task = "of_the_test"
    return scenario


def task(does: Callable[[], Any]) -> type:
    class Task:
        def __init__(self, *_: Any) -> None:
            does()

        value = jacobian = desired = desired_rate = gain = task_velocity = velocity = None

    return Task


def parent_of() -> None:
    raise RuntimeError(f"simulated in {os.getpid()}")


@pytest.mark.parametrize(
    ("does", "error", "said"),
    [
        (
            lambda: os._exit(0),
            AirgroundError,
            r"run a of case_a, seed 1: the process that simulated it died \(exit code 0\)",
        ),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), AirgroundError, r"died \(signal 9\)"),
        (parent_of, SimulationError, r"run a stopped at t = 0 s: .*Task raised test_runs\.py:\d+ RuntimeError: sim"),
    ],
)
def test_one_run_alone_is_simulated_in_a_child_too(
    case_a: Scenario, monkeypatch: pytest.MonkeyPatch, does: Callable[[], Any], error: type[Exception], said: str
) -> None:
    runs.warm_up()  # it simulates with a task of the package
    monkeypatch.setattr(UAV_TASKS, "load", lambda name, of: task(does))
    with UAV_TASKS.adding("of_the_test", task(does)), pytest.raises(error, match=said) as stopped:
        simulate_all(one_run(case_a), jobs=1)
    assert type(stopped.value) is error
    assert f"simulated in {os.getpid()}" not in str(stopped.value)


def test_a_run_that_comes_no_further_is_ended(case_a: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    hangs = task(lambda: time.sleep(600.0))
    runs.warm_up()
    monkeypatch.setattr(UAV_TASKS, "load", lambda name, of: hangs)
    monkeypatch.setattr(runs, "STANDSTILL_S", 0.5)
    with UAV_TASKS.adding("of_the_test", hangs), pytest.raises(SimulationError, match=r"no progress in the last 0\.5"):
        simulate_all(one_run(case_a), jobs=1)


@pytest.mark.parametrize("note", [b"", b"[]", b'{"stopped": [1]}', b'{"stopped": ["a", "b", "c"]}', b"[" * 10**5])
def test_a_note_that_cannot_be_read_is_an_error_in_words(note: bytes) -> None:
    assert "left no readable note" in str(runs._noted(note, "run a of case_a"))


def test_a_plugin_that_cannot_be_made_is_noted_as_such() -> None:
    refused = runs._noted(b'{"stopped": null, "refused": true, "what": "no\\nsuch thing"}', "")
    assert (type(refused), str(refused)) == (PluginError, r"no\nsuch thing")


ORPHAN = """
import multiprocessing, os, sys, time
from collections import deque
from itertools import repeat
from pathlib import Path
from airground_drake.sim import runs

def spins(*_, **__):
    os.write(int(sys.argv[2]), b"%d" % os.getpid())
    deque(repeat(0), maxlen=0)  # never returns to the interpreter, which could heed a signal

runs.simulate = spins
multiprocessing.get_context("fork").Process(target=runs._simulate, args=(None, "a", Path(sys.argv[1]), None)).start()
time.sleep(600)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a process is not told that its parent has ended")
def test_a_run_that_spins_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    reader, writer = os.pipe()  # the run holds the writing end until it ends
    command = [sys.executable, "-c", ORPHAN, str(tmp_path / "a"), str(writer)]
    with subprocess.Popen(command, pass_fds=[writer]) as parent:
        os.close(writer)
        run = int(os.read(reader, 20))
        parent.kill()
    ended, _, _ = select.select([reader], [], [], 60.0)
    os.close(reader)
    if not ended:
        os.kill(run, signal.SIGKILL)
        pytest.fail("it is still there")
