"""Forgeries of a report of case B: one for each rule of the checker, concerted ones, and hostile files.

`PYTHONPATH=tests python -m check.forgeries DIR` tries them all on a report of case B and shows why each is refused.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from functools import partial
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
    attempt,
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

from airground_drake.report import metrics
from airground_drake.run.trace import load

RUNS = ("b", "c", "c_literal", "d")
"""Runs of case B."""
ROW, BETWEEN, LATE = 300, 215, 450
"""Rows of run d: while a proposal is executed, between two control samples, after all events."""


def put(part: Any, path: tuple[Any, ...], value: Any) -> None:
    """Put a value into nested ones; a function is given what is there."""
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
    """In the run's entry in report.json and in its meta.json."""

    def edit(folder: Path) -> None:
        with edited_entries(folder, run) as entries:
            for entry in entries:
                put(entry, path, value)

    return edit


def everywhere(*path: Any, value: Any) -> Edit:
    """In the scenario, wherever it is."""

    def edit(folder: Path) -> None:
        with edited_scenarios(folder) as scenarios:
            for scenario in scenarios:
                put(scenario, path, value)

    return edit


def cells(column: str, value: Any, rows: Any = ROW, table: str = "signals", run: str = RUN) -> Edit:
    """Cells of a column; a function is given what is there."""

    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            name = column if column in frame else f"{UGV}.{column}"
            old = frame.loc[rows, name]
            frame.loc[rows, name] = value(old) if callable(value) else value

    return edit


def rows(keep: Callable[[pd.DataFrame], Any], table: str = "signals", run: str = RUN) -> Edit:
    """Other rows of a table."""
    return lambda folder: write_table(folder, keep(read_table(folder, table, run)), table, run)


def file(name: str, content: bytes) -> Edit:
    return lambda folder: write(folder / name, content)


def words(name: str, old: str, new: str) -> Edit:
    """Other words in a file."""

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
    """Put a robot elsewhere at one row, with commands that lead there and back."""

    def edit(folder: Path) -> None:
        with edited_table(folder) as frame:
            dt, speed = np.diff(frame["t_s"]), f"{robot}.v{axis}_m_s"
            frame.loc[row, f"{robot}.{axis}_m"] += by_m
            frame.loc[row, speed] += by_m / dt[row - 1]
            frame.loc[row + 1, speed] -= by_m / dt[row]
            if robot == UGV:  # the decision variable that follows
                error = [frame[f"{UGV}.ref_{axis}_m"] - frame[f"{UGV}.{axis}_m"] for axis in "xyz"]
                frame[f"{UGV}.decision_variable_m"] = np.linalg.norm(error, axis=0) + frame[f"{UGV}.noise_m"]

    return edit


def noise(by_m: float, at: slice) -> Edit:
    """More noise, and the decision variable that follows."""
    return all_of(*(cells(name, lambda old: old + by_m, at) for name in ("noise_m", "decision_variable_m")))


def without_event(kind: str, run: str = RUN) -> Edit:
    """Without the first event of a kind, and one less in the counts."""

    def edit(folder: Path) -> None:
        with edited_entries(folder, run) as entries:
            for entry in entries:
                entry["events"].remove(next(event for event in entry["events"] if event["kind"] == kind))
            counts = entries[0]["metrics"]["event_counts"][UGV]
            counts[kind] -= 1
            if not counts[kind]:
                del counts[kind]

    return edit


def crash_called_safe(folder: Path) -> None:
    everywhere("runs", "b", "expected", value={})(folder)
    with edited_report(folder) as document:
        for name in ("SAFE-TRACE", "SAFE-HYP"):
            claim_of(document, name, "b").update(status="holds", expected="holds", counterexample=None)
        counts = document["overall"]["counts"]
        counts["holds"] += counts.pop("refuted")


def crash_left_undecided(folder: Path) -> None:
    everywhere("runs", "b", "expected", "SAFE-TRACE", value="inconclusive")(folder)
    claim("SAFE-TRACE", "b", status="inconclusive", expected="inconclusive", counterexample=None)(folder)
    report("overall", "counts", value=lambda old: old | {"refuted": old["refuted"] - 1, "inconclusive": 1})(folder)


def added_claim_about_the_model_only(folder: Path) -> None:
    """Although the scenario expects a verdict of it on a run, too."""
    everywhere("claims", value={"MINE": "m:M"})(folder)
    everywhere("runs", RUN, "expected", value=lambda old: old | {"MINE": "holds"})(folder)
    report("claims", value=lambda old: [*old, old[-1] | {"id": "MINE", "run": ""}])(folder)


def trigger_late(folder: Path) -> None:
    """The row of the trigger is left out, and the event put to the next one."""
    frame = read_table(folder)
    row = int(np.flatnonzero(np.diff(frame[f"{UGV}.mode"]) == 1.0)[0])
    late = float(frame["t_s"].iloc[row + 1])
    triggered = f"{UGV}.triggered_at_s"
    frame.loc[frame[triggered] >= 0.0, triggered] = late
    write_table(folder, frame.drop(index=row))
    both("events", 0, "t_s", value=late)(folder)


def unnamed(name: str) -> Edit:
    """A file outside the folder, in the list of files."""

    def edit(folder: Path) -> None:
        (folder.parent / name).write_bytes(b"")
        report("files", f"../{name}", value=hashlib.sha256(b"").hexdigest())(folder)

    return edit


ALL = slice(None)
UNMENDED = {"page with other bytes", "file outside named"}
"""Forgeries after which the list of files is left as it is."""
RULES: dict[str, tuple[str, Edit]] = {
    # report.json
    "another schema": ("it is a report of this version", report("schema", value="airground_drake.report/2")),
    "crash called safe": ("verdict", crash_called_safe),
    "crash left undecided": ("verdict: recorded 'inconclusive'", crash_left_undecided),
    "margin": ("margin", claim("SAFE-TRACE", margin=lambda old: old + 1e-5)),
    "tests of a claim": ("how often the claim was exercised", claim("THR-TRIG", exercised=lambda old: old + 1)),
    "expectation": ("expected verdict", claim("LIVE-GOAL", expected="nothing")),
    "as expected": ("as expected", claim("LIVE-GOAL", as_expected=False)),
    "run from a cache": ("only claims about the model come from a cache", claim("EXEC", from_cache=True)),
    "claim left out": ("claims that there are", report("claims", value=lambda old: old[1:])),
    "claim twice": ("claims that there are", report("claims", value=lambda old: [*old, old[0]])),
    "added claim left out": ("claims that the scenario adds are there", everywhere("claims", value={"MINE": "m:M"})),
    "added claim left out of a run": ("claims that the scenario adds are there", added_claim_about_the_model_only),
    "run left out": ("runs", report("runs", value=lambda old: {run: old[run] for run in "cd"})),
    "trace added": (
        "folders of traces", lambda folder: shutil.copytree(trace(folder), trace(folder, "e")),
    ),
    "seed": ("seed", report("provenance", "seed", value=7)),
    "seeds left out": ("runs and seeds", report("seeds", value=[{"run": RUN, "seed": 1, "kept": True}])),
    "overall": ("verdict over all", report("overall", "as_expected", value=lambda old: old - 1)),
    # files
    "page with other bytes": ("SHA-256 of a file", words("report.html", "<title>", "<title> ")),
    "page added and named": ("a report has such a file", file("report-2.html", b"<p>All is well.</p>")),
    "notes in a trace": ("a report has such a file", file("trace/d/notes.txt", b"measured")),
    "file named like the folder of proofs": ("a report has such a file", file("proofs.html", b"<p>All is proved.")),
    "file outside named": ("a file is named if it is there", unnamed("outside")),
    # the files of a trace
    "note on a run": ("keys of meta.json", meta("note", value="on real robots")),
    "note on times": ("keys of timings.json", meta("note", value="of another machine", file="timings.json")),
    "digest left out": (
        "files of the trace", meta("files", value=lambda old: {name: old[name] for name in [*old][1:]}),
    ),
    "table with other bytes": ("SHA-256 of a table", meta("files", "states.parquet", value="0" * 64)),
    "column added": ("columns of a table", rows(lambda frame: frame.assign(true_x_m=0.0))),
    "column added to decisions": ("columns of a table", rows(lambda frame: frame.assign(by="me"), "decisions")),
    **{
        f"meta.json: {key}": ("meta.json is of the run", meta(key, value="x"))
        for key in ("schema", "run", "scenario", "method", "composition", "seed", "ugvs", "robots")
    },
    **{
        f"report.json: {key}": ("report.json is of the run", report("runs", RUN, key, value="x"))
        for key in ("method", "composition", "seed", "zeta_m", "events", "faults")
    },
    "threshold": ("threshold in force", both("zeta_m", value=3.001)),
    # signals
    "not a number": ("numbers are finite", cells("uav.z_m", np.nan)),
    "row twice": ("time increases from row to row", rows(lambda frame: frame.iloc[[0, *range(len(frame))]])),
    "end left out": ("the rows cover the run", rows(lambda frame: frame.iloc[:-20])),
    "beginning left out": ("the rows cover the run", rows(lambda frame: frame.iloc[5:])),
    "sample left out": ("a row at every control sample", rows(lambda frame: frame.drop(index=LATE))),
    "elsewhere throughout": ("start of a robot", cells("x_m", lambda old: old + 5.0, ALL, run="b")),
    "command before the start": ("command before the start", cells("vx_m_s", 1.0, 0)),
    "elsewhere in a row": ("law of motion", cells("x_m", lambda old: old + 1e-6)),
    "other preset": ("preset trajectory", cells("ref_x_m", lambda old: old + 1e-6)),
    "half executed": ("flag of an intervention", cells("accepted", 0.5)),
    # safety
    "gain": ("gain: A h <= 1", everywhere("control", "avoidance_gain_1_s", value=1e3)),
    "sensing": ("sensing range", everywhere("control", "sensing_range_m", value=2.0)),
    "smaller safe distance": ("margin", all_of(
        everywhere("safe_distance", "obstacle_m", value=1.999), claim("SAFE-TRACE", exercised=7),
    )),
    "larger obstacle": ("verdict", everywhere("obstacles", "obstacle_1", "radius_m", value=0.01)),
    "larger robot": ("safe start", everywhere("ugvs", UGV, "radius_m", value=0.01)),
    "bent way": ("straight motion", leap("uav", 1e-8, BETWEEN)),
    "too fast": ("speed limit", leap("uav", 1.0)),
    "UGV in the air": ("planar motion", leap("ugv2", 1e-8, axis="z")),
    # triggers
    "decision variable": ("decision variable", cells("decision_variable_m", lambda old: old - 1e-4, ALL)),
    "trigger late": ("triggers and releases", trigger_late),
    "mode": ("mode", cells("mode", 0.0, BETWEEN + 20)),
    "noise from elsewhere": ("noise at the start", noise(1e-7, slice(None))),
    "noise within a period": ("noise of one sample", noise(1e-7, slice(BETWEEN, BETWEEN))),
    "large sample": ("sample of the noise", noise(0.02, slice(LATE, None))),
    "time of the trigger": ("column triggered_at_s", cells("triggered_at_s", lambda old: old + 1e-3)),
    "time of the release": ("column released_at_s", cells("released_at_s", lambda old: old + 1e-3, LATE)),
    "number of triggers": ("column triggers", cells("triggers", 2.0)),
    # events
    "events reversed": ("events are in order", both("events", value=lambda old: old[::-1])),
    **{
        f"{kind} left out": ("events follow from signals and decisions", without_event(kind, run))
        for kind, run in {"trigger": RUN, "proposal": RUN, "refuse": RUN, "arrival": RUN, "collision": "b"}.items()
    },
    "place of an event": ("place of an event", both("events", 0, "position_m", 0, value=lambda old: old + 1e-6)),
    "executed at once": ("an intervention is executed after it was proposed", cells("accepted", 1.0, 5)),
    "numbers of proposals": (
        "proposals are numbered as they are sent",
        all_of(*(cells("number", lambda old: old + 1, ALL, table) for table in ("proposals", "decisions"))),
    ),
    "decision on nothing": (
        "a decision is on a proposal", cells("issued_s", lambda old: old + 1e-3, ALL, "decisions"),
    ),
    "outcome under (c)": ("an unused column is empty", cells("tries", 1.0, 3, "decisions", "c")),
    "objective under (d)": ("an unused column is empty", cells("gap", 0.0, 3, "decisions")),
    "solver under (d)": ("an unused column is empty", cells("route", "mixed_integer", 3, "decisions")),
    "outcome of a decision that is kept": (
        "an unused column is empty", cells("accept_outcome_m2_s", 5.0, 3, "decisions"),
    ),
}  # fmt: skip
"""The rule of the checker that refuses a forgery, and the forgery."""


# ------------------------------------------------------------------------------------- concerted


def drawing_moved(folder: Path) -> None:
    """A path in a figure of the page begins 0.1 units further right."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    begins = re.search(r' d="M (\d+\.\d+)', text)
    assert begins is not None
    moved = f"{text[: begins.start(1)]}{float(begins[1]) + 0.1:.2f}{text[begins.end(1) :]}"
    write(folder / "report.html", moved.encode())


def claim_proofs(folder: Path, run: str) -> None:
    """Write what `airground prove` would write of a run, as if Coq had accepted it."""
    from airground_drake.proofs.export import distances_file, recorded
    from airground_drake.run.trace import load

    of_run = load(trace(folder, run))
    exact = recorded(of_run)
    entry = {
        "expected": "refuted" not in of_run.scenario.runs[run].expected.get("SAFE-TRACE", ""),
        "meta_sha256": hashlib.sha256((trace(folder, run) / "meta.json").read_bytes()).hexdigest(),
        "rows": len(of_run.t), "pairs": len(exact.demands),
        "distances": {"proved": True, "theorem": f"{exact.name}_keeps_its_distances", "file": f"{exact.name}.v"},
        "law": {"proved": False, "file": f"{exact.name}_law.v", "why": "it took longer than 1 s"},
    }  # fmt: skip
    (folder / "proofs").mkdir()
    found = {"schema": "airground_drake.proofs/1", "coq": "8.16.1", "theory": {}, "runs": {run: entry}}
    write(folder / "proofs" / "proofs.json", json.dumps(found).encode())
    write(folder / "proofs" / f"{exact.name}.v", distances_file(exact).encode())


def show_proofs(folder: Path) -> None:
    from airground_drake.report import proved

    proved.write(folder)


def renamed(folder: Path) -> None:
    """Run d becomes e in every name, key and folder, but not in the commands that judge it again."""
    with edited_report(folder) as document:
        text = re.sub(r'"run": "d"', '"run": "e"', json.dumps(document))
        text = text.replace('"d": {"method": "d"', '"e": {"method": "d"')
        document |= json.loads(text)
        scenario = document["scenario"]["resolved"]
    trace(folder).rename(trace(folder, "e"))
    for name in (*RUNS[:-1], "e"):
        with edited_json(trace(folder, name) / "meta.json") as about:
            about |= {"scenario": scenario, "run": name}


def refusal_forgotten(folder: Path) -> None:
    """The decisions on the first proposal are left out, with their problems, times and event."""
    issued = read_table(folder, "decisions", "c")["issued_s"]
    which = np.flatnonzero(issued != issued.iloc[0])
    for table in ("decisions", "problems"):
        write_table(folder, read_table(folder, table, "c").iloc[which], table, "c")
    with edited_json(trace(folder, "c") / "timings.json") as timings:
        timings["decision_times_s"] = [timings["decision_times_s"][k] for k in which]
    without_event("refuse", "c")(folder)


def refusal_called_acceptance(folder: Path) -> None:
    with edited_table(folder, "decisions", "c") as frame:
        frame.loc[:1, ["decision", "reason"]] = [["accept", "cheaper"], ["accept", "kept"]]
    with edited_entries(folder, "c") as entries:
        for entry in entries:
            next(event for event in entry["events"] if event["kind"] == "refuse")["kind"] = "accept"
        entries[0]["metrics"]["event_counts"][UGV].update(accept=2, refuse=0)


def seed_called_safe(folder: Path) -> None:
    """Outcomes of the report's own seed, the first of them false."""
    with edited_report(folder) as document:
        document["seeds"] = [metrics.outcome(load(trace(folder, run))) for run in RUNS]
        document["seeds"][0]["kept"] = True


def bound_lowered(folder: Path) -> None:
    """A bound that is far from the best one, with the gap that follows from it."""
    with edited_table(folder, "decisions", "c") as frame:
        frame["route_bound"] *= 0.98
        frame["gap"] = 1.0 - frame["route_bound"] / frame["objective"]


def painted_over(folder: Path) -> None:
    """A drawing that covers the page, in a page whose drawings are said to come from another version of matplotlib."""
    page = folder / "report.html"
    with edited_report(folder) as document:
        drawn_by = document["provenance"]["packages"]["matplotlib"]
        document["provenance"]["packages"]["matplotlib"] = "3.10.0"
    text = page.read_text(encoding="utf-8").replace(f"matplotlib {drawn_by}", "matplotlib 3.10.0")
    over = '<path d="M -999 -9999 h 1999 v 9999 h -1999 z" fill="#ffffff" /></svg>'
    text = text.replace("</svg>", over, 1).replace("<svg ", '<svg overflow="visible" ', 1)
    write(page, text.encode())


def columns(table: str, run: str, **values: Callable[[pd.Series], list[Any]]) -> Edit:
    """Other columns of a table, from those that there are."""

    def edit(folder: Path) -> None:
        with edited_table(folder, table, run) as frame:
            for name, value in values.items():
                frame[name] = value(frame[name])

    return edit


def last(column: pd.Series) -> list[Any]:
    return [column.iloc[-1]] * len(column)


MAP = ("mapped_m", "mapped_radius_m")
CONCERTED: dict[str, Edit] = {
    # the scenario, in all its places
    "other gain": everywhere("control", "avoidance_gain_1_s", value=5.0),
    "other drift": everywhere("decision", "threshold", "drift_m_s", value=5.0),
    "a stall where none was": everywhere("runs", RUN, "stalls_m", value={UGV: [3.3, 13.0, 0.0]}),
    "a refutation by no rule": all_of(
        everywhere("runs", RUN, "expected", "GATE-PLAN", value="refuted"),
        claim("GATE-PLAN", status="refuted", expected="refuted", counterexample={"t_s": 1.0}, margin=None),
        report("overall", "counts", value=lambda old: old | {"holds": old["holds"] - 1, "refuted": old["refuted"] + 1}),
    ),
    "renamed": renamed,
    "crash with the report's own seed called safe": seed_called_safe,
    # pages
    "diagram of the page": words("diagram.svg", "gatekeeper", "keeper"),
    "label of a drawing": words("report.html", ">ugv1</text>", ">ugv7</text>"),
    "drawing moved": drawing_moved,
    "crash called proved": all_of(partial(claim_proofs, run="b"), show_proofs),
    "page says less than the proofs": partial(claim_proofs, run=RUN),
    "another theorem": all_of(
        partial(claim_proofs, run=RUN), show_proofs, words("proofs/run_d.v", "2 <= norm", "20 <= norm")
    ),
    # signals
    "elsewhere, and back": leap(UGV, 1e-3),
    "the UAV elsewhere, and back": leap("uav", 1e-4, 100),
    "rows between samples left out": rows(lambda f: f[np.abs(f["t_s"] / 0.05 - (f["t_s"] / 0.05).round()) < 1e-6]),
    "intervention over early": cells("accepted", 0.0, slice(ROW, None)),
    # messages and decisions
    "refusal forgotten": refusal_forgotten,
    "refusal called acceptance": refusal_called_acceptance,
    "bound lowered": bound_lowered,
    "relaxation": columns("problems", "c", **dict.fromkeys(("relaxed", "rounded"), lambda f: [np.ones(60)] * len(f))),
    "obstacles left out of a problem": columns(
        "problems", "c", **dict.fromkeys(("centres_m", "normals", "distances_m"), lambda f: [np.empty(0)] * len(f))
    ),
    "fewer directions": columns("proposals", RUN, selection=lambda column: [value[:3] for value in column]),
    "obstacle known before it was told": columns("proposals", RUN, **dict.fromkeys(MAP, last)),
    "obstacle forgotten": columns("proposals", RUN, **dict.fromkeys(MAP, lambda column: last(column[::-1]))),
    "large obstacle out of the way of a point": columns(
        "proposals", RUN,
        mapped_m=lambda column: [np.append(points, [9.5, 9.0, 0.0]) for points in column],
        mapped_radius_m=lambda column: [np.append(radii, 5.0) for radii in column],
    ),
    "decision after its proposal was taken back": cells("t_s", lambda old: old + 1.0, 1, "decisions"),
    "drawing over the page": painted_over,
    "decision times": meta("decision_times_s", value=lambda old: [0.1 * each for each in old], file="timings.json"),
}  # fmt: skip
"""Several values that are changed together, or in a way that no property draws; only judging again shows them."""


# ------------------------------------------------------------------------------------- hostile files


def special(name: str, make: Callable[[Path], Any]) -> Edit:
    """What is no regular file in the place of a file."""

    def edit(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        make(folder / name)

    return edit


def margin(text: bytes) -> Edit:
    """Raw text in the place of a number."""

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


def signals(change: Callable[[pa.Table], pa.Table]) -> Edit:
    def edit(folder: Path) -> None:
        table, buffer = pa.Table.from_pandas(read_table(folder)), io.BytesIO()
        pq.write_table(change(table), buffer)
        write(trace(folder) / "states.parquet", buffer.getvalue())
        seal(folder)

    return edit


def times(values: list[Any], kind: pa.DataType | None = None) -> Edit:
    """Other times in the signals: the values, again and again."""
    return signals(lambda table: table.set_column(0, "t_s", pa.array(values * len(table), kind)))


STONE = {"position_m": [0.0, 0.0, 0.0], "radius_m": 0.0, "known_to_uav": True}
HOSTILE: dict[str, tuple[str, Edit]] = {
    "fifo added": ("regular files", special("trace/pipe", os.mkfifo)),
    "signals are a fifo": ("regular files", special("trace/d/states.parquet", os.mkfifo)),
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
    "a column twice": ("the file is a table", signals(lambda table: table.append_column("t_s", table.column(0)))),
    "sixty million cells": (
        "the file is a table", signals(lambda _: pa.table({f"c{k}": pa.nulls(6_000_000) for k in range(10)})),
    ),
    "no columns": ("columns of a table", signals(lambda table: table.select([]))),
    "no rows": ("the rows cover the run", signals(lambda table: table.slice(0, 0))),
}  # fmt: skip
"""Files that are made to crash, to hang or to mislead the checker, and the rule that refuses each."""


if __name__ == "__main__":
    made = {**RULES, **{name: ("judged again", edit) for name, edit in CONCERTED.items()}, **HOSTILE}
    for of, (rule, forge) in made.items():
        code, said = attempt(Path(sys.argv[1]), forge, mended=of not in UNMENDED | {*HOSTILE})
        print(f"{of:<45} {'' if code and rule in said else 'NOT AS DUE: '}{rule} | {said[:200]!r}", flush=True)
