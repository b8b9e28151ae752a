"""Processes die; draws do not."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import pytest

from airground_drake.campaign.pool import locally, on_cluster
from airground_drake.campaign.rows import DIED, JUDGED, Row, blank
from airground_drake.errors import AirgroundError


def work(folder: Path, always: int, index: int) -> list[Row]:
    """Draw 2 kills its process the first time, one draw every time."""
    seen = folder / str(index)
    if index == always or (index == 2 and not seen.exists()):
        seen.touch()
        os._exit(1)
    return [blank() | {"index": index, "ended": JUDGED}]


def outcomes(found: list[list[Row]]) -> dict[int, str]:
    assert len(found) == len({rows[0]["index"] for rows in found})
    return {rows[0]["index"]: rows[0]["ended"] for rows in found}


def test_a_worker_that_dies_loses_no_draw_and_counts_none_twice(tmp_path: Path) -> None:
    found = outcomes(list(locally(partial(work, tmp_path, 5), range(9), jobs=2)))
    assert found == {index: DIED if index == 5 else JUDGED for index in range(9)}


def test_the_same_on_a_cluster_of_two_workers(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        found = outcomes(list(on_cluster(partial(work, tmp_path, -1), range(9), cluster.scheduler_address)))
    assert found == dict.fromkeys(range(9), JUDGED)


def test_no_scheduler_is_one_line() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(AirgroundError, match="no Dask scheduler at"):
        list(on_cluster(partial(work, Path(), -1), range(1), "tcp://127.0.0.1:9"))
