"""What Coq found about the runs, in the page: said only of what was proved, and the files stay those of the report."""

import json
from pathlib import Path
from typing import Any

import pytest
from report.cases import FINE, built

from airground_drake.base import files
from airground_drake.base.errors import ReportError
from airground_drake.check.files import names_in
from airground_drake.check.report import check_files
from airground_drake.report import document, html, proved
from airground_drake.report.model import of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim import trace
from airground_drake.sim.trace import Trace

NEAR = {"first": "ugv1", "second": "uav", "safe_distance_m": 2.0, "least_m": 0.5, "short_m": 1.5, "t_s": 13.0}
ANSWERS: dict[str, dict[str, Any]] = {
    "a": {"proved": True, "file": "run_a.v"},
    "c": {"proved": False, "file": "run_c.v", "why": "coqc took longer than 1 s & more"},
    "a_printed": {"proved": False, "file": "run_a_printed.v", "why": "-", "too_near": [NEAR, {**NEAR, "t_s": 14.0}]},
}
CHECKED = "machine-checked for this run (Coq 8.16.1)"


def proofs(folder: Path, *runs: str) -> None:
    """What `airground prove` would write of these runs."""
    metas = {run: (folder / "trace" / run / "meta.json").read_bytes() for run in runs}
    entries = {run: {"meta_sha256": files.sha256(meta), "distances": ANSWERS[run]} for run, meta in metas.items()}
    files.write_json(folder / "proofs" / "proofs.json", {"coq": "8.16.1", "runs": entries})


@pytest.fixture
def made(tmp_path: Path, scenario: Scenario, traces: dict[str, Trace]) -> Path:
    folder = tmp_path / "report"
    written = [
        f"trace/{name}/{file}" for name, of in traces.items() for file in trace.save(of, folder / "trace" / name)
    ]
    found = built(scenario, traces, FINE)
    files.write_text(folder / "report.html", html.page(of(found), ()))
    files.write_json(folder / "report.json", document.sealed(found, folder, [*written, "report.html"]))
    return folder


def rows(folder: Path) -> dict[str, str]:
    text = (folder / "report.html").read_text(encoding="utf-8")
    return dict(part.split("<!--end-->")[0].split("-->") for part in text.split("<!--Coq on ")[1:])


def consistent(folder: Path) -> None:
    recorded = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    check_files(folder, names_in(folder), recorded)


def test_each_run_has_a_line_of_its_own_and_the_files_are_still_those_of_the_report(made: Path) -> None:
    assert rows(made) == {"a": "", "c": "", "a_printed": ""}
    proofs(made, *ANSWERS)
    assert proved.write(made)
    consistent(made)
    lines = rows(made)
    assert f'<a href="proofs/run_a.v">{CHECKED}</a>' in lines["a"]
    assert "Coq did not prove this run: coqc took longer than 1 s &amp; more" in lines["c"]
    near = "pair ugv1, uav: 0.500 m at {} s, 2 m required"
    says = f"Coq refused this run: {near.format(13)}; {near.format(14)}"
    assert says in lines["a_printed"]

    proofs(made, "c")  # asked again, and about one run only: nothing is left of what was said of the others
    assert proved.write(made)
    consistent(made)
    assert {run: bool(line) for run, line in rows(made).items()} == {"a": False, "c": True, "a_printed": False}


@pytest.mark.parametrize("name", ["report.html", "trace/a/meta.json"])
def test_a_page_or_a_trace_that_is_not_the_reports_is_not_vouched_for(name: str, made: Path) -> None:
    (made / name).write_bytes((made / name).read_bytes() + b"\n")
    proofs(made, "a")
    before = (made / "report.html").read_bytes(), (made / "report.json").read_bytes()
    with pytest.raises(ReportError, match=f"{name} is not the file that report.json names"):
        proved.write(made)
    assert ((made / "report.html").read_bytes(), (made / "report.json").read_bytes()) == before


def test_traces_without_a_page_are_left_alone(made: Path) -> None:
    (made / "report.html").unlink()
    assert not proved.write(made)
