"""Forge copies of a report of case B, and check them; digests are made right afterwards, as a forger would."""

import contextlib
import hashlib
import io
import json
import os
import pickle
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from airground_drake.base.errors import AirgroundError
from airground_drake.check import command as checker
from airground_drake.check import report as checks
from airground_drake.check.line import AGREES, RECORDED, CheckLine
from airground_drake.check.run import Run
from airground_drake.report import document, rebuild
from airground_drake.report.figures import draw as drawing
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify import Verdict, judge_all, judging

RUN, UGV = "d", "ugv1"
"""The run and the UGV that are forged unless others are named."""
Edit = Callable[[Path], None]
"""Forges a copy of a report in place."""


def write(path: Path, content: bytes) -> None:
    path.unlink(missing_ok=True)
    path.write_bytes(content)


def trace(folder: Path, run: str = RUN) -> Path:
    return folder / "trace" / run


@contextlib.contextmanager
def edited_json(path: Path) -> Iterator[Any]:
    value = json.loads(path.read_bytes())
    yield value
    write(path, json.dumps(value, ensure_ascii=False).encode())


def edited_report(folder: Path) -> contextlib.AbstractContextManager[Any]:
    return edited_json(folder / "report.json")


@contextlib.contextmanager
def edited_entries(folder: Path, run: str = RUN) -> Iterator[list[Any]]:
    with edited_report(folder) as report, edited_json(trace(folder, run) / "meta.json") as meta:
        yield [report["runs"][run], meta]


@contextlib.contextmanager
def edited_scenarios(folder: Path) -> Iterator[list[Any]]:
    with contextlib.ExitStack() as stack:
        report = stack.enter_context(edited_report(folder))
        metas = [stack.enter_context(edited_json(path)) for path in sorted(folder.glob("trace/*/meta.json"))]
        yield [report["scenario"]["resolved"], *(meta["scenario"] for meta in metas)]
        text = json.dumps(report["scenario"]["resolved"], separators=(",", ":"))
        report["scenario"]["sha256"] = hashlib.sha256(text.encode()).hexdigest()


def claim_of(report: Any, claim: str, run: str = RUN) -> Any:
    return next(entry for entry in report["claims"] if (entry["id"], entry["run"]) == (claim, run))


def read_table(folder: Path, table: str = "states", run: str = RUN) -> pd.DataFrame:
    return pd.read_parquet(trace(folder, run) / f"{table}.parquet")


def write_table(folder: Path, frame: pd.DataFrame, table: str = "states", run: str = RUN) -> None:
    buffer = io.BytesIO()
    frame.to_parquet(buffer, index=False)
    write(trace(folder, run) / f"{table}.parquet", buffer.getvalue())
    seal(folder, run)


@contextlib.contextmanager
def edited_table(folder: Path, table: str = "states", run: str = RUN) -> Iterator[pd.DataFrame]:
    frame = read_table(folder, table, run)
    yield frame
    write_table(folder, frame, table, run)


def seal(folder: Path, run: str = RUN) -> None:
    with edited_json(trace(folder, run) / "meta.json") as meta:
        for name in meta["files"]:
            meta["files"][name] = hashlib.sha256((trace(folder, run) / name).read_bytes()).hexdigest()


def copy(report: Path, folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    return Path(shutil.copytree(report, folder))


def mend(folder: Path) -> None:
    if not (folder / "report.json").is_file():  # nobody reads a pipe to its end
        return
    with contextlib.suppress(OSError, ValueError, TypeError, RecursionError), edited_report(folder) as report:
        files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
        report["files"] = {
            name: hashlib.sha256(path.read_bytes()).hexdigest()
            for name, path in files.items()
            if name != "report.json" and not name.startswith("proofs/")  # those are added later
        }


@contextlib.contextmanager
def remembering() -> Iterator[None]:
    """The checker, and making a report again, remember what they have worked out of a run."""
    with pytest.MonkeyPatch.context() as patch:
        for (module, name), function in REMEMBERED.items():
            patch.setattr(module, name, function)
        yield


@remembering()
def attempt(report: Path, edit: Edit, *, mended: bool = True) -> tuple[int, str]:
    """Forge a copy of a report, beside it, and check it: the exit code, and a line for each check that fails.

    The report is made again from its traces only if the checker agrees.
    """
    folder = forged(report, edit, mended=mended)
    try:
        found = checker.checked(folder, checker.LIMIT_S)
        if all(line.outcome == AGREES for line in found):
            found = [CheckLine(**line, by="made again") for line in rebuild.lines(folder, judge=judged)]
    except checker.UsageError as error:
        return 2, str(error)
    except AirgroundError as error:
        return 1, str(error)
    refused = [line for line in found if line.outcome not in (AGREES, RECORDED)]
    assert all(line.rule and line.text for line in refused)
    return int(bool(refused)), "\n".join(f"{line.by}: {line.claim}: {line.text}" for line in refused)


def forged(report: Path, edit: Edit, *, mended: bool = True) -> Path:
    """A forged copy of a report, beside it; arguments as of `attempt`."""
    folder = copy(report, report.with_name(f"forged_{os.getpid()}"))
    edit(folder)
    if mended:
        mend(folder)
    return folder


def refusals(report: Path, edit: Edit) -> dict[str, str]:
    """What the checker says against a forged copy, by claim."""
    found = checker.checked(forged(report, edit), checker.LIMIT_S)
    return {line.claim: line.text for line in found if line.outcome != AGREES}


def no_constants(text: str) -> None:
    """Of `json.loads`, for strict JSON."""
    raise AssertionError(f"{text} is no strict JSON")


def _parts(value: Any) -> Any:
    """What a value is made of."""
    if isinstance(value, dict):
        return [(key, _parts(part)) for key, part in value.items()]
    if isinstance(value, (list, tuple)):
        return [*map(_parts, value)]
    if isinstance(value, (Trace, Run, Scenario)):
        return [getattr(value, field.name) for field in fields(value)]
    return value


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """As the function, but equal work is done once: most forgeries leave most runs as they are."""
    made: dict[bytes, Any] = {}

    def once(*given: Any, progress: Any = None, **named: Any) -> Any:
        key = hashlib.sha256(pickle.dumps(_parts((given, named)))).digest()
        if key not in made:
            made[key] = function(*given, **named)
        return made[key]

    return once


_done = remembered(lambda work, *given, **named: work(*given, **named))
REMEMBERED = {
    (checks, "DECIDED"): {claim: remembered(of_run) for claim, of_run in checks.DECIDED.items()},
    (document, "_run"): remembered(document._run),
    (drawing, "draw"): remembered(drawing.draw),
}


def judged(scenario: Scenario, traces: Sequence[Trace]) -> list[Verdict]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            judging,
            "run_parallel",
            lambda pieces, **_: [_done(piece.func, *piece.args, **piece.keywords) for piece in pieces],
        )
        return judge_all(scenario, traces)
