"""Tampering with several files at once, so that they agree with each other, and with what is shown to a reader."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from check.tampering.base import (
    RUN,
    claim_of,
    edited_json,
    edited_report,
    edited_scenarios,
    edited_table,
    named,
    read_table,
    tampering,
    trace,
    write,
    write_table,
)  # fmt: skip

RUNS = ("b", "c", "c_literal", "d")
"""Runs of case B."""


def _other_words(name: str, old: str, new: str) -> Callable[[Path], None]:
    """Put other words into a file."""

    def edit(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        write(folder / name, text.replace(old, new).encode())

    return edit


SHOWN = {
    "page_says_proved": ("report.html", ">refuted<", ">proved<"),
    "page_has_another_distance": ("report.html", "0.000 m from sudden", "2.000 m from sudden"),
    "page_hides_what_is_bad": ("report.html", "<style>", "<style>.bad { display: none; }"),
    "page_has_another_label_in_a_drawing": ("report.html", ">ugv1</text>", ">ugv7</text>"),
    "page_is_commented": ("report.html", "</main>", "<p>All is well.</p></main>"),
    "page_says_machine_checked": ("report.html", "<!--Coq on b-->", "<!--Coq on b-->machine-checked for this run"),
    "junit_has_no_skipped_case": ("junit.xml", "<skipped", "<properties"),
    "diagram_has_another_block": ("diagram.svg", "gatekeeper", "keeper"),
}
for _name, _words in SHOWN.items():
    tampering()(named(_name, _other_words(*_words)))


@tampering()
def drawing_moved(folder: Path) -> None:
    """A path in a figure of the page begins 0.1 units further right."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    begins = re.search(r' d="M (\d+\.\d+)', text)
    assert begins is not None
    moved = f"{text[: begins.start(1)]}{float(begins[1]) + 0.1:.2f}{text[begins.end(1) :]}"
    write(folder / "report.html", moved.encode())


@tampering()
def page_added_and_named(folder: Path) -> None:
    write(folder / "report-2.html", b"<p>All is proved.")


@tampering()
def file_added_to_a_trace_and_named(folder: Path) -> None:
    write(trace(folder) / "notes.txt", b"measured")


@tampering()
def page_added_to_proofs(folder: Path) -> None:
    (folder / "proofs").mkdir()
    write(folder / "proofs" / "index.html", b"<p>All is proved.")


@tampering()
def column_added(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame["ugv1.true_x_m"] = 0.0


@tampering()
def column_added_to_decisions(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["approved_by"] = "me"


@tampering()
def note_added_to_a_run(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        meta["note"] = "on real robots"


def claim_proofs(folder: Path, run: str, **distances: Any) -> None:
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


@tampering()
def crash_called_proved(folder: Path) -> None:
    """By proofs.json and by the page; only exact arithmetic or Coq can tell."""
    from airground_drake.report import proved

    claim_proofs(folder, "b")
    proved.write(folder)


@tampering()
def page_says_less_than_the_proofs(folder: Path) -> None:
    claim_proofs(folder, RUN)


@tampering()
def another_theorem_among_the_proofs(folder: Path) -> None:
    from airground_drake.report import proved

    claim_proofs(folder, RUN)
    proved.write(folder)
    _other_words("proofs/run_d.v", "2 <= norm", "20 <= norm")(folder)


@tampering()
def evidence_of_another_run(folder: Path) -> None:
    with edited_report(folder) as report:
        claim_of(report, "LIVE-PROG")["evidence"] = claim_of(report, "SAFE-TRACE", "c_literal")["evidence"]


@tampering()
def run_renamed_everywhere(folder: Path) -> None:
    """Run d becomes e in every name, key and folder, but not in the commands that judge it again."""
    with edited_report(folder) as report:
        text = re.sub(r'"run": "d"', '"run": "e"', json.dumps(report))
        text = text.replace('"d": {"method": "d"', '"e": {"method": "d"')
        report.clear()
        report.update(json.loads(text))
        scenario = report["scenario"]["resolved"]
    trace(folder).rename(trace(folder, "e"))
    for name in (*RUNS[:-1], "e"):
        with edited_json(trace(folder, name) / "meta.json") as meta:
            meta["scenario"] = scenario
            meta["run"] = name


@tampering()
def half_as_fast(folder: Path) -> None:
    """Times and periods twice, speeds half, in the scenario and in all signals."""
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["duration_s"] *= 2
            scenario["control"]["period_s"] *= 2
            for ugv in scenario["ugvs"].values():
                ugv["preset"]["speed_m_s"] /= 2
    for run in RUNS:
        with edited_table(folder, run=run) as frame:
            times = [name for name in frame if name == "t_s" or name.endswith("_at_s")]
            frame[times] = frame[times].where(frame[times] < 0.0, 2.0 * frame[times])
            frame[[name for name in frame if name.endswith("_m_s")]] /= 2.0


@tampering()
def world_mirrored(folder: Path) -> None:
    """x becomes -x in the scenario and in all signals."""
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            for robot in (*scenario["ugvs"].values(), scenario["uav"]):
                for place in (robot["start_m"], robot["target_m"], *robot.get("preset", {}).get("waypoints_m", ())):
                    place[0] *= -1
            for obstacle in scenario["obstacles"].values():
                obstacle["position_m"][0] *= -1
    for run in RUNS:
        with edited_table(folder, run=run) as frame:
            frame[[name for name in frame if name.endswith((".x_m", ".vx_m_s", "ref_x_m"))]] *= -1.0


@tampering()
def rows_between_samples_dropped(folder: Path) -> None:
    """Those of events; positions stay on the same lines."""
    frame = read_table(folder)
    steps = frame["t_s"] / 0.05
    between = np.abs(steps - steps.round()) > 1e-6
    assert between.any()
    write_table(folder, frame[~between])
