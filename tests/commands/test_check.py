"""`airground check`: the checker and the claims' own code go over the files, each line says which."""

import hashlib
import json
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from check.forgeries import HOSTILE, all_of, both, everywhere
from check.forging import claim_of, copy, edited_report, judged, mend
from commands.conftest import Airground

from airground_drake.base import progress
from airground_drake.base.errors import AirgroundError
from airground_drake.base.progress import Progress
from airground_drake.check.command import LIMIT_S, verdict
from airground_drake.check.line import DISAGREES, NOT_HERE, OPEN, CheckLine
from airground_drake.commands import check, main
from airground_drake.report import rebuild, simulated
from airground_drake.report.__main__ import main as report
from airground_drake.scenario import plugins

pytestmark = pytest.mark.slow

GONE = {"name": "no_such.module:It", "parameters": {}}
"""A policy that is not there."""


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("check") / "short"
    settings = ("duration_s=3", "runs={d: {method: d}}", "reproduction=[]", "choices=[]")
    assert report(["case_a", "-o", str(folder), "-q", *(w for each in settings for w in ("--set", each))]) in (0, 1)
    return folder


@pytest.fixture(scope="module")
def checked(short: Path) -> tuple[str, str]:
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(StringIO()) as said,
        redirect_stderr(StringIO()) as told,
    ):
        patch.setattr(progress, "TOLD_S", 0.0)
        assert main(["check", "--simulate", str(short)]) == 0
    return said.getvalue(), told.getvalue()


def test_all_three_go_over_an_untouched_report_and_say_what_was_taken_as_recorded(
    short: Path, checked: tuple[str, str]
) -> None:
    said, told = checked
    *lines, _, taken = said.splitlines()
    of = {by: [line for line in lines if f"({by})" in line] for by in ("checker", "made again", "simulated again")}
    claims = {claim["id"] for claim in json.loads((short / "report.json").read_text())["claims"]}
    assert claims <= {line.split()[0] for line in of["made again"]}
    assert ["SAFE-TRACE", "d"] in [line.split()[:2] for line in of["checker"]]
    assert [line.split()[0] for line in of["simulated again"]] == ["trace", "diagram.dot", "diagram.svg"]
    assert all(line.endswith("exactly") for line in of["simulated again"])
    assert "seeds and faults" not in taken
    assert told == "checking: 1 done\nmade again: 1 done\nsimulated again: 1 done\n"


def test_what_the_checker_does_not_decide_is_refused_when_the_report_is_made_again(
    short: Path, tmp_path: Path, airground: Airground
) -> None:
    folder = copy(short, tmp_path / "copy")
    with edited_report(folder) as document:
        claim_of(document, "LIVE-GOAL")["statement"] += " They say."
    *lines, _, taken = airground("check", folder, code=1).splitlines()
    (refused,) = (line for line in lines if " DISAGREES (" in line)
    assert refused.startswith("LIVE-GOAL   d        DISAGREES (made again): ")
    assert taken.startswith("Taken as recorded: policies, seeds and faults;")


def test_foreign_files_are_not_judged_again(short: Path, tmp_path: Path, airground: Airground) -> None:
    folder = copy(short, tmp_path / "copy")
    HOSTILE["table cut off"][1](folder)
    mend(folder)
    said = airground("check", folder, "--simulate", code=1)
    for by in ("made again", "simulated again"):
        assert f"not {by}, since a check above failed" in said
        assert said.count(f"({by})") == 1


def test_another_seed_is_not_reproduced_which_is_exit_code_3(short: Path, tmp_path: Path) -> None:
    folder = copy(short, tmp_path / "copy")
    all_of(everywhere("seed", value=7), both("seed", value=7))(folder)
    lines = [CheckLine(**line, by="simulated again") for line in simulated.lines(folder)]
    (line,) = (line for line in lines if line.outcome == NOT_HERE)
    assert line.text.startswith("states, row 1, t = 0.05 s: ugv")
    assert verdict(lines) == 3


def test_third_party_code_is_simulated_only_where_it_is_allowed(short: Path, tmp_path: Path) -> None:
    folder = copy(short, tmp_path / "copy")
    everywhere("intervention", "policies", value=lambda old: [*old, GONE])(folder)
    (line,) = check.made_again(folder, [], LIMIT_S, Progress(), "simulated again", "airground_drake.report.simulated")
    assert line.outcome == OPEN
    assert "third-party code is imported and run only with --allow-plugins" in line.text
    with pytest.raises(AirgroundError, match="no_such"):
        [*simulated.lines(folder, allow_plugins=True)]


def test_claims_are_judged_again_where_drake_cannot_be_imported(short: Path) -> None:
    code = "import sys, runpy; sys.modules['pydrake'] = None; "
    code += "runpy.run_module('airground_drake.report.rebuild', run_name='__main__')"
    command = [sys.executable, "-P", "-c", code, str(short), "300"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line for line in map(json.loads, done.stdout.splitlines()) if set(line) != {"judged"}]  # but for progress
    assert len(lines) > 10
    assert {line["claim"] for line in lines if line["outcome"] != "agrees"} == {"provenance"}


def digests(folder: Path) -> dict[str, str]:
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.rglob("*") if path.is_file()}


def test_other_line_ends_in_the_page_disagree(short: Path, tmp_path: Path) -> None:
    page = copy(short, tmp_path / "copy") / "report.html"
    page.write_bytes(page.read_bytes().replace(b"\n", b"\r\n"))
    (line,) = (line for line in rebuild.lines(page.parent, judge=judged) if line["claim"] == "report.html")
    assert line["outcome"] == DISAGREES
    assert r"\r\n" in line["text"]


@pytest.mark.usefixtures("compiled_before")
def test_coq_proves_the_runs_again(short: Path, tmp_path: Path, airground: Airground) -> None:
    folder = copy(short, tmp_path / "copy")
    before = digests(folder)
    lines = json.loads(airground("check", "--json", "--coq", folder))["checks"]
    assert digests(folder) == before
    (proved,) = (line for line in lines if line["by"] == "Coq")
    assert (proved["run"], proved["outcome"]) == ("d", "agrees")
    assert proved["text"].startswith("machine-checked for this run: every distance is kept; the law is obeyed")


def test_third_party_claims_and_other_seeds_are_made_again_where_allowed(
    tmp_path: Path, airground: Airground, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent))
    settings = ("duration_s=1", "claims={MINE: 'check.foreign:Short'}")
    words = [word for each in settings for word in ("--set", each)]
    assert report(["minimal", "-o", str(tmp_path), "-q", "--seeds", "2", plugins.OPTION, *words]) in (0, 1, 3)
    said = airground("check", tmp_path, "--simulate", plugins.OPTION)
    again = [line for line in said.splitlines() if "(simulated again)" in line]
    assert {"MINE", "seeds", "trace"} <= {line.split()[0] for line in again}
    assert all(" agrees " in line for line in again)
