"""Tampering with files as such."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import pandas as pd
from check.tampering.base import (
    edited_json,
    edited_report,
    edited_timings,
    refused_as_a_whole,
    seal,
    tampering,
    trace,
    write,
)


@tampering()
def table_in_other_bytes_digest_left(folder: Path) -> None:
    """With the same rows, so that no other rule notices."""
    path = trace(folder) / "signals.parquet"
    frame = pd.read_parquet(path)
    path.unlink()
    frame.to_parquet(path, index=False, compression="gzip")


@tampering()
def parquet_truncated(folder: Path) -> None:
    path = trace(folder) / "signals.parquet"
    write(path, path.read_bytes()[:-100])
    seal(folder)


@tampering()
def parquet_is_garbage(folder: Path) -> None:
    write(trace(folder) / "decisions.parquet", b"PAR1 and nothing else")
    seal(folder)


@tampering()
def trace_folder_missing(folder: Path) -> None:
    shutil.rmtree(trace(folder))


@tampering()
def trace_folder_added(folder: Path) -> None:
    shutil.copytree(trace(folder), folder / "trace" / "e")


@tampering()
def digest_of_a_table_removed(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        del meta["files"]["problems.parquet"]


@tampering()
def times_are_no_list(folder: Path) -> None:
    with edited_timings(folder) as timings:
        timings["decision_times_s"] = timings["decision_times_s"][:1]


@refused_as_a_whole("the file is JSON")
def report_truncated(folder: Path) -> None:
    path = folder / "report.json"
    write(path, path.read_bytes()[:-200])


@refused_as_a_whole("the file can be read")
def report_missing(folder: Path) -> None:
    (folder / "report.json").unlink()


@refused_as_a_whole("it is a report")
def report_is_a_list(folder: Path) -> None:
    path = folder / "report.json"
    write(path, b"[" + path.read_bytes() + b"]")


@refused_as_a_whole("a key is there once")
def report_with_a_key_twice(folder: Path) -> None:
    path = folder / "report.json"
    write(path, path.read_bytes().replace(b'"schema":', b'"schema": "airground_drake.report/1", "schema":', 1))


@tampering()
def meta_with_a_key_twice(folder: Path) -> None:
    path = trace(folder) / "meta.json"
    write(path, path.read_bytes().replace(b'"run":', b'"run": "c", "run":', 1))


@tampering()
def problems_with_labels(folder: Path) -> None:
    """The order of the rows is what counts, not the labels that a table may have for them."""
    path = trace(folder, "c") / "problems.parquet"
    reversed_rows = pd.read_parquet(path).iloc[::-1]
    path.unlink()
    reversed_rows.to_parquet(path, index=True)
    seal(folder, "c")


@tampering(mended=False)
def page_added(folder: Path) -> None:
    write(folder / "report-2.html", b"<p>All is well.</p>")


@tampering(mended=False)
def file_outside_named(folder: Path) -> None:
    outside = folder.with_name(f"{folder.name}.outside")
    outside.write_bytes(b"")
    with edited_report(folder) as report:
        report["files"][f"../{outside.name}"] = hashlib.sha256(b"").hexdigest()


@tampering(mended=False)
def file_added_whose_name_begins_like_the_folder_of_proofs(folder: Path) -> None:
    write(folder / "proofs.html", b"<p>All is proved.")
