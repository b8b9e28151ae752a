"""Tampering with files as such."""

from __future__ import annotations

import hashlib
import math
import shutil
from pathlib import Path

import pandas as pd
from check.tampering.base import (
    NO_REPORT,
    RUN,
    UGV,
    claim_of,
    edited_claim,
    edited_json,
    edited_report,
    edited_table,
    edited_timings,
    ignored,
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


@refused_by("metrics", "one time for each decision")
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


@refused_by("files", "SHA-256 of a file", run="")
def page_changed(folder: Path) -> None:
    page = folder / "report.html"
    write(page, page.read_bytes().replace(b"As expected", b"As we wanted"))


@refused_by("files", "SHA-256 of a file", run="")
def junit_changed(folder: Path) -> None:
    path = folder / "junit.xml"
    write(path, path.read_bytes().replace(b"<testcase", b"<!-- --><testcase", 1))


@refused_by("files", "SHA-256 of a file", run="")
def diagram_changed(folder: Path) -> None:
    write(folder / "diagram.svg", b"<svg/>")


@refused_by("files", "SHA-256 of a file", run="")
def meta_changed(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        meta["note"] = "added"


@refused_by("files", "a file that is named is there", run="")
def page_missing(folder: Path) -> None:
    (folder / "report.html").unlink()


@refused_by("files", "a file that is there is named", run="")
def page_added(folder: Path) -> None:
    write(folder / "report-2.html", b"<p>All is well.</p>")


@refused_by("files", "a file that is there is named", run="")
def digest_of_the_page_removed(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["files"]["report.html"]


@refused_by("files", "a file that is named is there", run="")
def file_of_the_system_named(folder: Path) -> None:
    with edited_report(folder) as report:
        report["files"]["/etc/passwd"] = hashlib.sha256(Path("/etc/passwd").read_bytes()).hexdigest()


@refused_by("files", "a file that is named is there", run="")
def file_outside_named(folder: Path) -> None:
    outside = folder.with_name(f"{folder.name}.outside")
    outside.write_bytes(b"")
    with edited_report(folder) as report:
        report["files"][f"../{outside.name}"] = hashlib.sha256(b"").hexdigest()


@refused_by(NO_REPORT, "'files' is missing")
def list_of_files_removed(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["files"]


@ignored("proofs of other solvers may be added to a report later; nothing is taken from them")
def proofs_added(folder: Path) -> None:
    (folder / "proofs").mkdir()
    write(folder / "proofs" / "index.json", b"[]")


@refused_by("SAFE-TRACE", "only what is about the model comes from a cache")
def distances_from_the_cache(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim["from_cache"] = True


@refused_by("SAFE-INV", "only what is about the model comes from a cache", run="")
def from_the_cache_in_words(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["from_cache"] = "yes"


@ignored("a finding that was kept is judged like any other: where it comes from is said, and decides nothing")
def a_proof_from_the_cache(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["from_cache"] = not claim["from_cache"]
