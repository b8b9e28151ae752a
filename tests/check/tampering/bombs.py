"""Files that are made to crash, to hang or to lead out of the folder whoever reads them."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from check.tampering.base import (
    claim_of,
    edited_claim,
    edited_report,
    edited_scenarios,
    named,
    read_table,
    refused_as_a_whole,
    seal,
    set_everywhere,
    tampering,
    trace,
    write,
)


@refused_as_a_whole("regular files")
def fifo_added(folder: Path) -> None:
    os.mkfifo(folder / "trace" / "pipe")


@refused_as_a_whole("regular files")
def signals_are_a_fifo(folder: Path) -> None:
    (trace(folder) / "signals.parquet").unlink()
    os.mkfifo(trace(folder) / "signals.parquet")


@refused_as_a_whole("regular files")
def page_is_a_device(folder: Path) -> None:
    (folder / "report.html").unlink()
    (folder / "report.html").symlink_to("/dev/zero")


@refused_as_a_whole("regular files")
def meta_is_elsewhere(folder: Path) -> None:
    elsewhere = folder.with_name(f"{folder.name}.meta")
    elsewhere.write_bytes((trace(folder) / "meta.json").read_bytes())
    (trace(folder) / "meta.json").unlink()
    (trace(folder) / "meta.json").symlink_to(elsewhere)


@refused_as_a_whole("regular files")
def folder_leads_to_itself(folder: Path) -> None:
    (folder / "trace" / "more").symlink_to(folder)


@refused_as_a_whole("the file can be read")
def report_is_a_fifo(folder: Path) -> None:
    (folder / "report.json").unlink()
    os.mkfifo(folder / "report.json")


@refused_as_a_whole("the file can be read")
def report_is_a_device(folder: Path) -> None:
    (folder / "report.json").unlink()
    (folder / "report.json").symlink_to("/dev/zero")


@refused_as_a_whole("the file can be read")
def report_is_a_folder(folder: Path) -> None:
    (folder / "report.json").unlink()
    (folder / "report.json").mkdir()


@refused_as_a_whole("no name of a run")
def run_is_outside(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"]["../../d"] = scenario["runs"]["d"]


@refused_as_a_whole("no name of a run")
def claim_is_outside(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["id"] = "../SAFE-INV"


@refused_as_a_whole("no name of a run")
def claim_of_two_lines(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["id"] = "SAFE-INV\nSAFE-GATE    -        agrees: proved\n"


@refused_as_a_whole("no name of a run")
def claim_of_half_a_character(folder: Path) -> None:
    path = folder / "report.json"
    write(path, path.read_bytes().replace(b'"id": "SAFE-INV"', b'"id": "\\ud800"', 1))


def _margin(text: bytes) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        with edited_report(folder) as report:
            claim_of(report, "SAFE-TRACE")["margin"] = "MARGIN"
        path = folder / "report.json"
        write(path, path.read_bytes().replace(b'"MARGIN"', text))

    return edit


MARGINS = {
    "infinite_margin": ("numbers are finite", b"Infinity"),
    "margin_beyond_all": ("numbers are finite", b"1e999"),
    "margin_of_many_digits": ("numbers are finite", b"9" * 5000),
    "margin_of_a_thousand_digits": ("numbers are finite", b"9" * 1000),
    "margin_in_many_brackets": ("nested", b"[" * 70 + b"1" + b"]" * 70),
    "margin_in_too_many_brackets": ("the file is JSON", b"[" * 200_000 + b"1" + b"]" * 200_000),
    "margin_of_no_characters": ("the file is JSON", b'"\xff\xfe"'),
}
for _name, (_rule, _content) in MARGINS.items():
    refused_as_a_whole(_rule)(named(_name, _margin(_content)))


STONE = {"position_m": [0.0, 0.0, 0.0], "radius_m": 0.0, "known_to_uav": True}
SIZES: dict[str, tuple[Any, ...]] = {
    "obstacles_without_end": ({f"o{k}": STONE for k in range(3000)}, "obstacles"),
    "period_of_nothing": (0.0, "control", "period_s"),
    "period_of_a_nanosecond": (1e-9, "control", "period_s"),
    "proposals_without_end": (1e-12, "intervention", "period_s"),
    "duration_of_an_age": (1e9, "duration_s"),
    "duration_beyond_all": (1e300, "duration_s"),
    "horizon_of_an_age": (1e11, "gatekeeper", "horizon_s"),
    "stages_without_end": (10**9, "gatekeeper", "stages"),
}
for _name, (_value, *_path) in SIZES.items():
    refused_as_a_whole("the scenario is of a size")(named(_name, set_everywhere(*_path, value=_value)))
tampering()(named("duration_of_a_billion_digits", set_everywhere("duration_s", value="1e1000000000")))


def _signals(change: Callable[[pa.Table], pa.Table]) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        table, buffer = pa.Table.from_pandas(read_table(folder)), io.BytesIO()
        pq.write_table(change(table), buffer)
        write(trace(folder) / "signals.parquet", buffer.getvalue())
        seal(folder)

    return edit


def _with(values: Callable[[int], pa.Array]) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.set_column(0, table.column_names[0], values(len(table)))


TABLES = {
    "times_are_texts": ("the files are well formed", _with(lambda rows: pa.array(["x"] * rows))),
    "times_are_lists": ("the files are well formed", _with(lambda rows: pa.array([[0.0]] * rows))),
    "times_are_structures": ("the file is a table", _with(lambda rows: pa.array([{"a": {"b": 1}}] * rows))),
    "times_are_lists_of_lists": ("the file is a table", _with(lambda rows: pa.array([[[0.0]]] * rows))),
    "times_are_lists_of_texts": ("the file is a table", _with(lambda rows: pa.array([["x"]] * rows))),
    "times_are_bytes": ("the file is a table", _with(lambda rows: pa.array([b"x"] * rows))),
    "times_are_dates": ("the file is a table", _with(lambda rows: pa.array([0] * rows, pa.timestamp("ns")))),
    "times_are_nothing": ("numbers are finite", _with(pa.nulls)),
    "a_column_twice": ("the file is a table", lambda table: table.append_column("t_s", table.column(0))),
    "sixty_million_cells": (
        "the file is a table",
        lambda _: pa.table({f"c{k}": pa.nulls(6_000_000) for k in range(10)}),
    ),
    "no_columns": ("the signals have the column", lambda table: table.select([])),
    "no_rows": ("the rows cover the run", lambda table: table.slice(0, 0)),
}
for _name, (_rule, _change) in TABLES.items():
    tampering()(named(_name, _signals(_change)))
