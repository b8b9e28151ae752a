"""Edits of a report of case B: a forgery for each rule of the checker, and hostile files."""

import hashlib
import io
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from check.forging import (
    RUN,
    UGV,
    Edit,
    claim_of,
    edited_entries,
    edited_json,
    edited_report,
    edited_scenarios,
    edited_table,
    read_table,
    seal,
    trace,
    write,
    write_table,
)

RUNS = ("b", "c", "c_literal", "d")
"""Runs of case B."""
ROW, BETWEEN, LATE = 300, 215, 450
"""Rows of run d: while a proposal is executed, between two control samples, after all events."""


def put(part: Any, path: tuple[Any, ...], value: Any) -> None:
    *above, last = path
    for key in above:
        part = part[key]
    part[last] = value(part[last]) if callable(value) else value


def report(*path: Any, value: Any) -> Edit:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            put(document, path, value)

    return edit


def claim(name: str, run: str = RUN, **values: Any) -> Edit:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            for key, value in values.items():
                put(claim_of(document, name, run), (key,), value)

    return edit


def meta(*path: Any, value: Any, file: str = "meta.json") -> Edit:
    def edit(folder: Path) -> None:
        with edited_json(trace(folder) / file) as document:
            put(document, path, value)

    return edit


def both(*path: Any, value: Any, run: str = RUN) -> Edit:
    def edit(folder: Path) -> None:
        with edited_entries(folder, run) as entries:
            for entry in entries:
                put(entry, path, value)

    return edit


def everywhere(*path: Any, value: Any) -> Edit:
    def edit(folder: Path) -> None:
        with edited_scenarios(folder) as scenarios:
            for scenario in scenarios:
                put(scenario, path, value)

    return edit


def cells(column: str, value: Any, rows: Any = ROW, table: str = "states", run: str = RUN) -> Edit:
    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            name = column if column in frame else f"{UGV}.{column}"
            old = frame.loc[rows, name]
            frame.loc[rows, name] = value(old) if callable(value) else value

    return edit


def rows(keep: Callable[[pd.DataFrame], Any], table: str = "states", run: str = RUN) -> Edit:
    return lambda folder: write_table(folder, keep(read_table(folder, table, run)), table, run)


def file(name: str, content: bytes) -> Edit:
    return lambda folder: write(folder / name, content)


def words(name: str, old: str, new: str) -> Edit:
    def edit(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        write(folder / name, text.replace(old, new, 1).encode())

    return edit


def all_of(*edits: Edit) -> Edit:
    def edit(folder: Path) -> None:
        for each in edits:
            each(folder)

    return edit


def leap(robot: str, by_m: float, row: int = ROW, axis: str = "x") -> Edit:
    """Ahead and back between three rows at control samples; a row below 0 counts from the end."""

    def edit(folder: Path) -> None:
        with edited_table(folder) as frame:
            t = frame["t_s"].to_numpy()
            at = range(len(t))[row]
            frame.loc[at, f"{robot}.{axis}_m"] += by_m
            place = frame.loc[at, [f"{robot}.{axis}_m" for axis in "xyz"]].to_numpy(float)
        with edited_table(folder, "samples") as samples:
            k = int(np.searchsorted(samples["t_s"], t[at]))
            assert samples["t_s"][[k - 1, k]].tolist() == t[[at - 1, at]].tolist()
            samples.loc[k - 1, f"{robot}.v{axis}_m_s"] += by_m / (t[at] - t[at - 1])
            samples.loc[k, f"{robot}.v{axis}_m_s"] -= by_m / (t[at + 1] - t[at])
        if robot == UGV:  # the decision variable that follows
            preset = samples.loc[k, [f"{UGV}.ref_{axis}_m" for axis in "xyz"]].to_numpy(float)
            with edited_table(folder) as frame:
                x = np.linalg.norm(preset - place) + frame.loc[at, f"{UGV}.noise_m"]
                frame.loc[at, f"{UGV}.decision_variable_m"] = x

    return edit


def noise(by_m: float, at: slice) -> Edit:
    return all_of(*(cells(name, lambda old: old + by_m, at) for name in ("noise_m", "decision_variable_m")))


def without_event(kind: str, run: str = RUN) -> Edit:
    def edit(folder: Path) -> None:
        with edited_entries(folder, run) as entries:
            for entry in entries:
                entry["events"].remove(next(event for event in entry["events"] if event["kind"] == kind))
            counts = entries[0]["metrics"]["event_counts"][UGV]
            counts[kind] -= 1
            if not counts[kind]:
                del counts[kind]

    return edit


def trigger_late(folder: Path) -> None:
    frame = read_table(folder)
    row = int(np.flatnonzero(np.diff(frame[f"{UGV}.mode"]) == 1.0)[0])
    late = float(frame["t_s"].iloc[row + 1])
    triggered = f"{UGV}.triggered_at_s"
    frame.loc[frame[triggered] >= 0.0, triggered] = late
    write_table(folder, frame.drop(index=row))
    both("events", 0, "t_s", value=late)(folder)


def unnamed(name: str) -> Edit:
    def edit(folder: Path) -> None:
        (folder.parent / name).write_bytes(b"")
        report("files", f"../{name}", value=hashlib.sha256(b"").hexdigest())(folder)

    return edit


def another_map(folder: Path) -> None:
    (folder / "map").mkdir()
    write(folder / "map" / "lab.yaml", b"image: lab.pgm")
    everywhere("map", value={"cells": {"sha256": {}, "rectangles": []}})(folder)


ALL = slice(None)
UNMENDED = {"page with other bytes", "file outside named"}
"""Forgeries after which the list of files is left as it is."""
RULES: dict[str, tuple[str, Edit]] = {
    # report.json
    "another digest": ("SHA-256 of the scenario", report("scenario", "sha256", value="0" * 64)),
    "another schema": ("it is a report of this version", report("schema", value="airground_drake.report/2")),
    "crash called safe": ("verdict", claim("SAFE-TRACE", "b", status="holds", counterexample=None)),
    "margin": ("margin", claim("SAFE-TRACE", margin=lambda old: old + 1e-5)),
    "tests of a claim": ("how often the claim was exercised", claim("THR-TRIG", exercised=lambda old: old + 1)),
    "claim left out": ("claims that there are", report("claims", value=lambda old: old[1:])),
    "claim twice": ("claims that there are", report("claims", value=lambda old: [*old, old[0]])),
    # files
    "page with other bytes": ("SHA-256 of a file", words("report.html", "<title>", "<title> ")),
    "page added and named": ("a report has such a file", file("report-2.html", b"<p>All is well.</p>")),
    "notes in a trace": ("a report has such a file", file("trace/d/notes.txt", b"measured")),
    "trace added": ("a report has such a file", lambda folder: shutil.copytree(trace(folder), trace(folder, "e"))),
    "file named like the folder of proofs": ("a report has such a file", file("proofs.html", b"<p>All is proved.")),
    "another map": ("the map was read from this file", another_map),
    "file outside named": ("a file is named if it is there", unnamed("outside")),
    # a trace and its run
    "table with other bytes": ("SHA-256 of a table", meta("files", "states.parquet", value="0" * 64)),
    **{
        f"meta.json: {key}": ("meta.json is of the run", meta(key, value="x"))
        for key in ("schema", "run", "scenario", "method", "composition", "seed", "ugvs", "robots")
    },
    **{
        f"report.json: {key}": ("report.json is of the run", report("runs", RUN, key, value="x"))
        for key in ("method", "composition", "seed", "zeta_m", "events", "faults")
    },
    "threshold": ("threshold in force", both("zeta_m", value=3.001)),
    # motion
    "column left out": ("columns of a table", rows(lambda frame: frame.drop(columns="uav.vz_m_s"), "samples")),
    "not a number": ("numbers are finite", cells("uav.z_m", np.nan)),
    "row twice": ("time increases from row to row", rows(lambda frame: frame.iloc[[0, *range(len(frame))]])),
    "end left out": ("the rows cover the run", rows(lambda frame: frame.iloc[:-20])),
    "beginning left out": ("the rows cover the run", rows(lambda frame: frame.iloc[5:])),
    "row of a sample left out": ("a row at every control sample", rows(lambda frame: frame.drop(index=LATE))),
    "sample left out": ("a row at every control sample", rows(lambda frame: frame.drop(index=LATE), "samples")),
    "sample at another time": ("a row at every control sample", cells("t_s", lambda old: old + 1e-6, LATE, "samples")),
    "elsewhere throughout": ("start of a robot", cells("x_m", lambda old: old + 5.0, ALL, run="b")),
    "elsewhere in a row": ("law of motion", cells("x_m", lambda old: old + 1e-6)),
    "other preset": ("preset trajectory", cells("ref_x_m", lambda old: old + 1e-6, table="samples")),
    "other command": ("law of motion", cells("vx_m_s", lambda old: old + 1e-4, table="samples")),
    # safety
    "gain": ("gain: A h <= 1", everywhere("control", "avoidance_gain_1_s", value=1e3)),
    "sensing": ("sensing range", everywhere("control", "sensing_range_m", value=2.0)),
    "smaller safe distance": ("margin", all_of(
        everywhere("safe_distance", "obstacle_m", value=1.999), claim("SAFE-TRACE", exercised=7),
    )),
    "larger robot": ("safe start", everywhere("ugvs", UGV, "radius_m", value=0.01)),
    "bent way": ("law of motion", cells("uav.x_m", lambda old: old + 1e-8, BETWEEN)),
    "too fast": ("speed limit", leap("uav", 1.0)),
    "UGV in the air": ("planar motion", leap("ugv2", 1e-8, axis="z")),
    # triggers
    "decision variable": ("decision variable", cells("decision_variable_m", lambda old: old - 1e-4, ALL)),
    "trigger late": ("triggers and releases", trigger_late),
    "mode": ("mode", cells("mode", 0.0, BETWEEN + 20)),
    "noise from elsewhere": ("noise at the start", noise(1e-7, slice(None))),
    "noise within a period": ("noise of one sample", noise(1e-7, slice(BETWEEN, BETWEEN))),
    "large sample": ("sample of the noise", noise(0.012, slice(LATE, None))),
    # arrivals and collisions
    "arrival left out": ("arrivals and collisions follow from positions", without_event("arrival")),
    "collision left out": ("arrivals and collisions follow from positions", without_event("collision", "b")),
    "place of an event": ("place of an event", both("events", 0, "position_m", 0, value=lambda old: old + 1e-6)),
}  # fmt: skip
"""The rule of the checker that refuses a forgery, and the forgery."""


# ------------------------------------------------------------------------------------- hostile files


def special(name: str, make: Callable[[Path], Any]) -> Edit:
    def edit(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        make(folder / name)

    return edit


def margin(text: bytes) -> Edit:
    def edit(folder: Path) -> None:
        claim("SAFE-TRACE", margin="MARGIN")(folder)
        words_in = (folder / "report.json").read_bytes()
        write(folder / "report.json", words_in.replace(b'"MARGIN"', text))

    return edit


def raw(name: str, change: Callable[[bytes], bytes]) -> Edit:
    def edit(folder: Path) -> None:
        write(folder / name, change((folder / name).read_bytes()))
        if name.endswith(".parquet"):
            seal(folder, Path(name).parent.name)

    return edit


def states(change: Callable[[pa.Table], pa.Table]) -> Edit:
    def edit(folder: Path) -> None:
        table, buffer = pa.Table.from_pandas(read_table(folder)), io.BytesIO()
        pq.write_table(change(table), buffer)
        write(trace(folder) / "states.parquet", buffer.getvalue())
        seal(folder)

    return edit


def times(values: list[Any], kind: pa.DataType | None = None) -> Edit:
    return states(lambda table: table.set_column(0, "t_s", pa.array(values * len(table), kind)))


STONE = {"position_m": [0.0, 0.0, 0.0], "radius_m": 0.0, "known_to_uav": True}
HOSTILE: dict[str, tuple[str, Edit]] = {
    "fifo added": ("regular files", special("trace/pipe", os.mkfifo)),
    "states are a fifo": ("regular files", special("trace/d/states.parquet", os.mkfifo)),
    "page is a device": ("regular files", special("report.html", lambda path: path.symlink_to("/dev/zero"))),
    "folder leads to itself": ("regular files", special("trace/more", lambda path: path.symlink_to(path.parent))),
    "report is a fifo": ("the file can be read", special("report.json", os.mkfifo)),
    "report is a device": ("the file can be read", special("report.json", lambda path: path.symlink_to("/dev/zero"))),
    "report is missing": ("the file can be read", special("report.json", lambda _: None)),
    "report cut off": ("the file is JSON", raw("report.json", lambda content: content[:-200])),
    "report is a list": ("it is a report", raw("report.json", lambda content: b"[" + content + b"]")),
    **{
        f"{key} = {value}": ("it is a report", report(key, value=value))
        for keys, values in ((("scenario", "provenance", "overall", "runs", "files"), (None, [])),
                             (("claims", "audit", "choices"), ({}, [1])))
        for key in keys for value in values
    },
    "a key twice": ("a key is there once", raw("report.json", lambda old: old.replace(b'"id":', b'"id":1,"id":'))),
    "a key twice in a trace": (
        "a key is there once", raw("trace/d/meta.json", lambda old: old.replace(b'"run":', b'"run": "c", "run":', 1)),
    ),
    "run outside": ("the name of a run", everywhere("runs", "../../d", value={})),
    "claim outside": ("the name of a run", claim("SAFE-INV", "", id="../SAFE-INV")),
    "claim of two lines": ("the name of a run", claim("SAFE-INV", "", id="SAFE-INV\nSAFE-GATE   -   agrees\n")),
    "claim of half a character": (
        "the name of a run", raw("report.json", lambda old: old.replace(b'"id": "SAFE-INV"', b'"id": "\\ud800"')),
    ),
    "infinite margin": ("numbers are finite", margin(b"Infinity")),
    "margin beyond all": ("numbers are finite", margin(b"1e999")),
    "margin of many digits": ("numbers are finite", margin(b"9" * 5000)),
    "margin in many brackets": ("nested", margin(b"[" * 70 + b"1" + b"]" * 70)),
    "margin in too many brackets": ("the file is JSON", margin(b"[" * 200_000 + b"1" + b"]" * 200_000)),
    "margin of no characters": ("the file is JSON", margin(b'"\xff\xfe"')),
    "UGVs are a number": ("the files are well formed", everywhere("ugvs", value=3)),
    "obstacles without end": (
        "the scenario is of a size", everywhere("obstacles", value={f"o{k}": STONE for k in range(3000)}),
    ),
    "corners without end": (
        "the scenario is of a size", everywhere("obstacles", value={"o": STONE | {"polygon_m": [[0.0, 0.0]] * 3000}}),
    ),
    "duration of many digits": ("the rows cover the run", everywhere("duration_s", value="1e1000000000")),
    **{
        f"{'.'.join(path)} = {value:g}": ("the scenario is of a size", everywhere(*path, value=value))
        for *path, value in (
            ("control", "period_s", 0.0), ("control", "period_s", 1e-9), ("intervention", "period_s", 1e-12),
            ("duration_s", 1e9), ("duration_s", 1e300), ("gatekeeper", "horizon_s", 1e11),
            ("gatekeeper", "stages", 10**9),
        )
    },
    "table cut off": ("the file is a table", raw("trace/d/states.parquet", lambda content: content[:-100])),
    "times are texts": ("the files are well formed", times(["x"])),
    "times are lists": ("the files are well formed", times([[0.0]])),
    "times are structures": ("the file is a table", times([{"a": {"b": 1}}])),
    "times are lists of texts": ("the file is a table", times([["x"]])),
    "times are bytes": ("the file is a table", times([b"x"])),
    "times are dates": ("the file is a table", times([0], pa.timestamp("ns"))),
    "a column twice": ("the file is a table", states(lambda table: table.append_column("t_s", table.column(0)))),
    "sixty million cells": (
        "the file is a table", states(lambda _: pa.table({f"c{k}": pa.nulls(6_000_000) for k in range(10)})),
    ),
    "no columns": ("columns of a table", states(lambda table: table.select([]))),
    "no rows": ("the rows cover the run", states(lambda table: table.slice(0, 0))),
}  # fmt: skip
"""Files that are made to crash, to hang or to mislead the checker, and the rule that refuses each."""
