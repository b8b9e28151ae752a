"""Processes die, and their items are done."""

import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from builders.dying import asleep, process, times, work

from airground_drake.base.errors import AirgroundError
from airground_drake.study.campaign.pool import _result, cluster, local


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
def test_an_item_that_has_killed_its_workers_is_given_up() -> None:
    distributed = pytest.importorskip("distributed")

    class Future:
        def result(self) -> None:
            raise distributed.scheduler.KilledWorker("item-5", None, 3)

    assert _result(distributed, Future()) is None


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
