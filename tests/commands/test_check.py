"""`airground check`: the checker and the claims' own code go over the files, each line says which."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from check.forgeries import HOSTILE
from check.forging import copy, mend

from airground_drake.commands import check


@pytest.fixture(scope="module", name="short")
def short_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of a run of a few seconds."""
    from airground_drake.report.__main__ import main

    folder = tmp_path_factory.mktemp("check") / "short"
    settings = ("duration_s=3", "runs={d: {method: d}}", "reproduction=[]", "choices=[]")
    assert main(["case_a", "-o", str(folder), "-q", *(word for each in settings for word in ("--set", each))]) in (0, 1)
    return folder


def test_both_go_over_an_untouched_report(short: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(["--json", str(short)]) == 0
    lines = json.loads(capsys.readouterr().out)["checks"]
    claims = {(claim["id"], claim["run"]) for claim in json.loads((short / "report.json").read_text())["claims"]}
    for by in ("checker", "judged again"):
        assert claims <= {(line["claim"], line["run"]) for line in lines if line["by"] == by}


def test_a_claim_that_the_checker_does_not_decide_is_refused_when_it_is_judged_again(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(short, tmp_path / "copy")
    document = json.loads((folder / "report.json").read_text())
    entry = next(claim for claim in document["claims"] if claim["id"] == "EXEC")
    entry["statement"] += " They say."
    (folder / "report.json").unlink()
    (folder / "report.json").write_text(json.dumps(document))
    assert check.main([str(folder)]) == 1
    refused = [line for line in capsys.readouterr().out.splitlines() if " DISAGREES (" in line]
    assert len(refused) == 1
    assert refused[0].startswith("EXEC        d        DISAGREES (judged again): ")


def test_files_that_are_not_the_reports_are_not_judged_again(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(short, tmp_path / "copy")
    HOSTILE["table cut off"][1](folder)
    mend(folder)
    assert check.main([str(folder)]) == 1
    said = capsys.readouterr().out
    assert "not judged again, since a check above failed" in said
    assert said.count("(judged again)") == 1


@pytest.mark.slow
def test_claims_are_judged_again_where_drake_cannot_be_imported(short: Path) -> None:
    code = "import sys, runpy; sys.modules['pydrake'] = None; sys.argv[1:] = sys.argv[1:]; "
    code += "runpy.run_module('airground_drake.report.rebuild', run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, str(short), "300"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count('"agrees"') == len(done.stdout.splitlines()) > 10


def test_usage_and_what_is_no_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([], [str(tmp_path)], ["--limit-s", "0", str(tmp_path)]):
        assert check.main(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("coqc") is None and not os.environ.get("CI"), reason="Coq is not installed")
def test_coq_proves_the_runs_again(short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(["--json", "--coq", str(copy(short, tmp_path / "copy"))]) == 0
    lines = json.loads(capsys.readouterr().out)["checks"]
    (proved,) = (line for line in lines if line["by"] == "Coq")
    assert (proved["run"], proved["outcome"]) == ("d", "agrees")
    assert proved["text"].startswith("machine-checked for this run: every distance is kept; the law is obeyed")
