"""Tampering with files as such."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pandas as pd
from check.tampering.base import (
    NO_REPORT,
    RUN,
    UGV,
    claim_of,
    edited_json,
    edited_report,
    edited_table,
    edited_timings,
    middle,
    read_table,
    refused_by,
    seal,
    trace,
    write,
)


@refused_by("trace", "SHA-256 of a table")
def position_changed_digest_left(folder: Path) -> None:
    recorded = (trace(folder) / "meta.json").read_bytes()
    with edited_table(folder) as frame:
        frame.loc[middle(frame), f"{UGV}.x_m"] += 1e-3
    write(trace(folder) / "meta.json", recorded)


@refused_by("trace", "the file is a table")
def parquet_truncated(folder: Path) -> None:
    path = trace(folder) / "signals.parquet"
    write(path, path.read_bytes()[:-100])
    seal(folder)


@refused_by("trace", "the file is a table")
def parquet_is_garbage(folder: Path) -> None:
    write(trace(folder) / "decisions.parquet", b"PAR1 and nothing else")
    seal(folder)


@refused_by("trace", "the file can be read")
def signals_missing(folder: Path) -> None:
    (trace(folder) / "signals.parquet").unlink()


@refused_by("trace", "the file can be read")
def problems_missing(folder: Path) -> None:
    (trace(folder) / "problems.parquet").unlink()


@refused_by("trace", "the file can be read")
def timings_missing(folder: Path) -> None:
    (trace(folder) / "timings.json").unlink()


@refused_by("trace", "the file can be read")
def meta_missing(folder: Path) -> None:
    (trace(folder) / "meta.json").unlink()


@refused_by("report", "folders of traces", run="")
def trace_folder_missing(folder: Path) -> None:
    shutil.rmtree(trace(folder))


@refused_by("report", "folders of traces", run="")
def trace_folder_added(folder: Path) -> None:
    shutil.copytree(trace(folder), folder / "trace" / "e")


@refused_by("trace", "schema of the trace")
def trace_of_another_schema(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        meta["schema"] = "airground_drake.trace/1"


@refused_by("trace", "files of the trace")
def digest_of_a_table_removed(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        del meta["files"]["problems.parquet"]


@refused_by("GATE-TIME", "one time for each decision")
def times_are_no_list(folder: Path) -> None:
    with edited_timings(folder) as timings:
        timings["decision_times_s"] = timings["decision_times_s"][:1]


@refused_by(NO_REPORT, "the file is JSON")
def report_truncated(folder: Path) -> None:
    path = folder / "report.json"
    write(path, path.read_bytes()[:-200])


@refused_by("report", "schema", run="")
def report_of_another_schema(folder: Path) -> None:
    with edited_report(folder) as report:
        report["schema"] = "airground_drake.report/9"


@refused_by(NO_REPORT, "the file can be read")
def report_missing(folder: Path) -> None:
    (folder / "report.json").unlink()


@refused_by(NO_REPORT, "numbers are finite")
def report_with_nan(folder: Path) -> None:
    with edited_report(folder) as report:
        claim_of(report, "SAFE-TRACE")["margin"] = math.nan


@refused_by(NO_REPORT, "it is a report")
def report_is_a_list(folder: Path) -> None:
    path = folder / "report.json"
    write(path, b"[" + path.read_bytes() + b"]")


@refused_by(NO_REPORT, "a key is there once")
def report_with_a_key_twice(folder: Path) -> None:
    path = folder / "report.json"
    write(path, path.read_bytes().replace(b'"schema":', b'"schema": "airground_drake.report/1", "schema":', 1))


@refused_by("trace", "a key is there once")
def meta_with_a_key_twice(folder: Path) -> None:
    path = trace(folder) / "meta.json"
    write(path, path.read_bytes().replace(b'"run":', b'"run": "c", "run":', 1))


@refused_by("GATE-FEAS", "initial position", run="c")
def problems_with_labels(folder: Path) -> None:
    """The order of the rows is what counts, not the labels that a table may have for them."""
    path = trace(folder, "c") / "problems.parquet"
    reversed_rows = pd.read_parquet(path).iloc[::-1]
    path.unlink()
    reversed_rows.to_parquet(path, index=True)
    seal(folder, "c")


@refused_by("trace", "the signals have the column")
def column_missing(folder: Path) -> None:
    frame = read_table(folder).drop(columns="uav.vz_m_s")
    path = trace(folder, RUN) / "signals.parquet"
    path.unlink()
    frame.to_parquet(path, index=False)
    seal(folder)
