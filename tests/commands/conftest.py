"""What the tests of the commands share."""

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.commands import main
from airground_drake.scenario.load import resolved
from airground_drake.sim import trace
from airground_drake.study.campaign import pool
from airground_drake.study.campaign.pool import Pool

Airground = Callable[..., str]


@pytest.fixture
def airground(capsys: pytest.CaptureFixture[str]) -> Airground:
    """`airground(*words, code=0)`: what a command prints; with code 2 or 4, the error, which is one line and alone."""

    def ran(*words: object, code: int = 0) -> str:
        capsys.readouterr()
        try:
            found: int | str | None = main([*map(str, words)])
        except SystemExit as ended:
            found = ended.code
        said = capsys.readouterr()
        assert found == code, said
        if code not in (2, 4):
            return said.out
        assert (said.out, said.err.count("\n"), said.err[:7]) == ("", 1, "error: ")
        return said.err

    return ran


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Campaigns without processes, which take seconds to begin."""

    @contextmanager
    def local(jobs: int) -> Iterator[Pool]:
        yield lambda work, items: ((item, work(item)) for item in items)

    monkeypatch.setattr(pool, "local", local)


@pytest.fixture(scope="session")
def made_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As much of a report, with the runs c and d, as `replay` and `export` look at."""
    made = make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)
    made.meta.update(scenario=resolved(make_scenario()), schema=trace.SCHEMA)
    folder = tmp_path_factory.mktemp("made") / "report"
    for run in ("c", "d"):
        trace.save(replace(made, meta={**made.meta, "run": run}), folder / "trace" / run)
    (folder / "report.json").write_text(json.dumps({"schema": "airground_drake.report/3"}))
    return folder


@pytest.fixture
def folder(made_report: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made_report, tmp_path / "report")
