"""What tests share: simulations, reports and proofs that take long are made once per session, whatever its workers."""

import itertools
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from sharing import once
from verify.runs.cases import BLOCKS, EIGHT, SYNTHETIC

from airground_drake.report.__main__ import main as write_report
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.ugv import mpc_gatekeeper, outcome_gatekeeper
from airground_drake.verify.proofs import THEOREMS, coq
from airground_drake.verify.proofs.record import file_of

if TYPE_CHECKING:
    from airground_drake.study.testing.plugin import Simulations


# also where the package is not installed with its entry points
pytest_plugins = ["airground_drake.study.testing.plugin"]

# The first call compiles, and nothing here asserts on time: no deadlines, no complaints of slowness. The default
# profile draws the same examples each time, so that a green suite stays green; `pytest --hypothesis-profile=fuzz` looks
# for new ones.
settings.register_profile(
    "suite", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("fuzz", deadline=None, max_examples=5000, suppress_health_check=list(HealthCheck))
settings.load_profile("suite")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for what a shell runs in the background, and its children
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whoever looks at the report of a shipped scenario is slow: one takes seconds, and its first one a minute."""
    for item in items:
        if "report" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of this session that all its workers share."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session", autouse=True)
def _cache(shared: Path) -> Iterator[None]:
    """Findings are kept in a folder of the session, not in the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AIRGROUND_DRAKE_CACHE", str(shared / "kept"))
        yield


@pytest.fixture(scope="session", autouse=True)
def _steady_clock() -> Iterator[None]:
    """Every decision of a gatekeeper takes 1/1024 s by the clock: no verdict depends on what else the machine does."""
    ticks = itertools.count()
    with pytest.MonkeyPatch.context() as patch:
        for module in (mpc_gatekeeper, outcome_gatekeeper):
            patch.setattr(module, "thread_time", lambda: next(ticks) / 1024)
        yield


@pytest.fixture(scope="session", autouse=True)
def _no_constants_of_modules() -> Iterator[None]:
    """The same examples whatever was imported before: Hypothesis also draws constants of loaded modules."""
    with pytest.MonkeyPatch.context() as patch:
        if settings.default.derandomize and hasattr(providers, "_get_local_constants"):
            nothing = providers.Constants()
            patch.setattr(providers, "_get_local_constants", lambda: nothing)
        yield


@pytest.fixture(scope="session")
def run(airground_trace: "Simulations") -> "Simulations":
    """`run(scenario, name)`: one simulation of a shipped scenario, made once per session."""
    return airground_trace


@pytest.fixture(scope="session")
def base(run: "Simulations") -> Callable[[str], Trace]:
    """`base(name)`: an honest run: synthetic, shipped, or of method (c) with few stages, by route."""

    def get(name: str) -> Trace:
        if name in SYNTHETIC:
            return SYNTHETIC[name]()
        if name == BLOCKS:
            return run("soft_gate", "c", set=[*EIGHT, "gatekeeper.route=mixed_integer", "gatekeeper.blocks=4"])
        if " " not in name:
            return run("soft_gate", "c", set=[*EIGHT, f"gatekeeper.route={name}"])
        return run(*name.split())

    return get


@pytest.fixture(scope="session")
def report(shared: Path) -> Callable[[str], Path]:
    """`report(scenario)`: folder of the report of a shipped scenario, made once per session; not to be changed.

    One is made after the other, on all processors: the second one takes proofs that the first one has kept.
    """

    def make(scenario: str, folder: Path) -> None:
        with FileLock(shared / "reports.lock"):
            assert write_report([scenario, "-o", str(folder)]) == 0

    return lambda scenario: once(shared / f"report-{scenario}", lambda folder: make(scenario, folder))


@pytest.fixture(scope="session")
def coq_version() -> str:
    """The installed Coq; without one a test is skipped, but in continuous integration it fails."""
    if shutil.which("coqc") is None and not os.environ.get("CI"):
        pytest.skip("Coq is not installed")
    return coq.version()


@pytest.fixture(scope="session")
def compiled(shared: Path, coq_version: str) -> Path:
    """All theories, which take a minute."""

    def make(folder: Path) -> None:
        folder.mkdir()
        coq.install(dict.fromkeys(map(file_of, THEOREMS)), folder)

    return once(shared / "theories", make)


@pytest.fixture
def compiled_before(compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`coqc` of this and other processes takes what the session has compiled of the same file."""
    wrapper = tmp_path / "bin" / "coqc"
    wrapper.parent.mkdir()
    wrapper.write_text(
        f'#!/bin/sh\nfor file; do :; done\nif cmp -s "$file" "{compiled}/$file"; then\n'
        f'  cp "{compiled}/${{file%.v}}".vo* .\nelse\n  exec "{shutil.which("coqc")}" "$@"\nfi\n'
    )
    wrapper.chmod(0o755)
    monkeypatch.setenv("PATH", f"{wrapper.parent}{os.pathsep}{os.environ['PATH']}")


@pytest.fixture
def case_a() -> Scenario:
    return load("case_a")
