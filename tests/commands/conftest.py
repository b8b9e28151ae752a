"""What the tests of the commands share."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.campaign import pool
from airground_drake.campaign.pool import Pool
from airground_drake.run import trace
from airground_drake.scenarios.load import resolved


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No processes, each of which takes seconds to begin, for what is not about them."""

    @contextmanager
    def local(jobs: int) -> Iterator[Pool]:
        yield lambda work, items: ((item, work(item)) for item in items)

    monkeypatch.setattr(pool, "local", local)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """As much of a report, with the runs c and d, as `replay` and `export` look at."""
    made = make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)
    made.meta["scenario"] = resolved(make_scenario())
    made.meta["schema"] = trace.SCHEMA
    for run in ("c", "d"):
        trace.save(replace(made, meta={**made.meta, "run": run}), tmp_path / "report" / "trace" / run)
    (tmp_path / "report" / "report.json").write_text(json.dumps({"schema": "airground_drake.report/2"}))
    return tmp_path / "report"
