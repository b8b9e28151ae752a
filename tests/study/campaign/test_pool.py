"""Processes die, and their items are done."""

import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from builders.dying import asleep, process, times, work

from airground_drake.base.errors import AirgroundError
from airground_drake.study.campaign.pool import _on_cluster, cluster, local


def test_a_process_that_dies_loses_no_item_and_does_none_twice(tmp_path: Path) -> None:
    with local(jobs=2) as pool:
        found = list(pool(partial(work, tmp_path, 5), range(9)))
    assert sorted(found) == [(item, None if item == 5 else item * item) for item in range(9)]


def test_processes_go_on_from_one_call_to_the_next_and_end_in_the_end() -> None:
    with local(jobs=2) as pool:
        first, second = ({pid for _, pid in pool(process, range(20))} for _ in range(2))
        next(pool(asleep, [0, 600]))  # the other one is still at work
    assert len(first | second) <= 2
    assert not any(Path(f"/proc/{pid}").exists() for pid in first | second)


@pytest.mark.slow
def test_campaigns_that_share_a_cluster_get_their_own_results() -> None:
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": ":0"}
    with (
        distributed.LocalCluster(**options) as here,
        cluster(here.scheduler_address) as one,
        cluster(here.scheduler_address) as other,
    ):
        found = list(zip(one(partial(times, 3), range(40)), other(partial(times, 7), range(40)), strict=True))
    assert sorted(each for each, _ in found) == [(item, 3 * item) for item in range(40)]
    assert sorted(each for _, each in found) == [(item, 7 * item) for item in range(40)]


@pytest.mark.slow
def test_an_item_that_has_killed_its_workers_is_given_up_and_no_other_of_its_block() -> None:
    distributed = pytest.importorskip("distributed")
    sizes = []

    class Future:
        def __init__(self, call: Any, work: Any, items: Any, *, key: str, pure: bool) -> None:
            self.key, self.items, self.call = key, items, partial(call, work, items)

        def result(self) -> Any:
            sizes.append(len(self.items))
            if 500 in self.items:
                raise distributed.scheduler.KilledWorker("block", None, 3)
            return self.call()

    class Completed(list[Any]):
        update = list.extend

        def __iter__(self) -> Any:
            while self:
                yield self.pop(0)

        def count(self) -> int:
            return len(self)

    dask = SimpleNamespace(as_completed=lambda given, loop: Completed(given), scheduler=distributed.scheduler)
    client = SimpleNamespace(loop=None, nthreads=lambda: {"worker": 1}, submit=Future)
    found = sorted(_on_cluster(dask, client, partial(times, 2), range(1000)))
    assert found == [(item, None if item == 500 else 2 * item) for item in range(1000)]
    assert max(sizes) > 1


SCHEDULER = """
import distributed, time
options = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": ":0"}
with distributed.LocalCluster(protocol="tcp", **options) as here:
    print(here.scheduler_address, flush=True)
    time.sleep(1000)
"""
CLIENT = """
import itertools, os, signal, sys
from airground_drake.study.campaign.pool import cluster
from airground_drake.base.errors import AirgroundError

try:
    with cluster(sys.argv[1]) as pool:
        for _ in pool(abs, itertools.count()):
            os.kill(int(sys.argv[2]), signal.SIGKILL)
except AirgroundError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_lost_and_a_missing_scheduler_are_one_line() -> None:
    pytest.importorskip("distributed")
    command = [sys.executable, "-c"]
    with subprocess.Popen([*command, SCHEDULER], stdout=subprocess.PIPE, text=True) as scheduler:
        assert scheduler.stdout is not None
        address = scheduler.stdout.readline().strip()
        try:
            ran = subprocess.run([*command, CLIENT, address, str(scheduler.pid)], capture_output=True, text=True)
        finally:
            scheduler.kill()
    lost = r"the Dask scheduler was lost \(\w+\); --resume goes on with what is finished\n"
    assert re.fullmatch(lost, ran.stdout), ran.stderr
    assert (ran.returncode, ran.stderr) == (0, "")
    with pytest.raises(AirgroundError, match="no Dask scheduler at"), cluster("tcp://127.0.0.1:9", timeout_s=0.5):
        pass
