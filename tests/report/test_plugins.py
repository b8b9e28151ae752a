"""Third-party code on the command line: only where it is allowed, and whatever it does, the exit code is right."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import pytest
from builders.hostile_policies import KINDS

from airground_drake import commands, scenarios
from airground_drake.report import after_runs, make
from airground_drake.report.__main__ import main
from airground_drake.verify import __main__ as judge

Report = Callable[[str], Path]

ONE_RUN = ["--set", "reproduction=[]", "--set", "choices=[]", "--format", "json"]
IN_A_RUN = (
    "sys_exit_0", "os_exit_0", "os_exit_in_a_thread", "loops_and_swallows_everything", "text_holds_lone_surrogates",
    "text_sleeps", "array_ends_the_process", "sends_garbage", "closes_every_descriptor", "patches_the_claims",
    "patches_the_avoidance_layer", "leaves_a_child_behind",
)  # fmt: skip

EVIL = """
import os
if os.environ["JUDGING"] == str(os.getpid()):
    raise AssertionError("imported in the process of the command line")
from airground_drake.intervention.policy import Policy
class It(Policy):
    def propose(self, seen): return None
"""
ROUTES = {
    "class It:\n    def solve(self, problem, budget):\n        import os; os._exit(0)": (4, "died (exit code 0)"),
    "class It:\n    def solve(self, problem, budget):\n        raise SystemExit(0)": (4, "SystemExit: 0"),
    "class It:\n    def __init__(self):\n        raise SystemExit(0)\n    def solve(self): ...": (2, "SystemExit: 0"),
    "import sys; sys.exit(0)": (2, "cannot be imported: SystemExit: 0"),
    "import os; os._exit(0)": (4, "died (exit code 0)"),
}


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    """Write a module of its own name and give `name:It`."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("JUDGING", str(os.getpid()))

    def write(text: str) -> str:
        name = f"evil_{abs(hash(str(tmp_path)))}"
        (tmp_path / f"{name}.py").write_text(text)
        return f"{name}:It"

    return write


@pytest.mark.slow
def test_a_run_with_hostile_policies_is_reported_as_it_was(
    report: Report, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report("case_a")  # whose proofs are those of this scenario
    kinds = [list(KINDS).index(name) for name in IN_A_RUN]
    hostile = [{"name": "builders.hostile_policies:Hostile", "parameters": {"kind": kind}} for kind in kinds]
    policies = [*hostile, {"name": "detour", "parameters": {"speed_m_s": 2.8}}]
    changes = {"policies": policies, "ranking": "listed", "budget_s": 0.3, "period_s": 0.05, "retry_s": 1.0}
    arguments = ["--set", f"intervention={json.dumps(changes)}", "--set", "runs={d: {method: d}}", *ONE_RUN]
    capsys.readouterr()
    assert main(["case_a", "-o", str(tmp_path), *arguments, "--allow-plugins"]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert re.fullmatch(r"hostile_policies\.py:\d+ SystemExit: 0 \(.*at \d+\.\d\d s\), run d", first)
    document = json.loads((tmp_path / "report.json").read_text())
    assert {c["status"] for c in document["claims"] if c["id"] in ("SAFE-TRACE", "SAFE-HYP", "EXEC")} == {"holds"}
    said = " ".join(fault["what"] for fault in document["runs"]["d"]["faults"])
    for words in ("SystemExit: 0", "exit code 0", "OutOfTime", "ud800", "no message", "closed its channel"):
        assert words in said
    assert said.isprintable()
    assert "detour" in {event.get("policy") for event in document["runs"]["d"]["events"]}


def test_code_of_others_is_refused_unless_it_is_allowed(
    module: Callable[[str], str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = module(EVIL)
    keys = ("uav.task", "gatekeeper.route", "intervention.policies.0.name", "claims.MINE")
    for key in keys[:3]:
        assert main(["case_a", "-o", str(tmp_path / "out"), "--set", f"{key}={name}"]) == 2
        error = capsys.readouterr().err
        assert error == f"error: case_a: {key}: '{name}' is not allowed; {_only()}\n"
    for key in keys:
        change = [f"{key}={name}"] if key != "claims.MINE" else [f"claims={{MINE: '{name}'}}"]
        assert main(["case_a", "-o", str(tmp_path / "out"), "--set", *change]) == 2
        assert "--allow-plugins" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_diagram_is_drawn_without_code_of_others(
    module: Callable[[str], str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.yaml").write_text(
        resources.files(scenarios).joinpath("minimal.yaml").read_text() + f"\ngatekeeper: {{route: '{module(EVIL)}'}}\n"
    )
    assert commands.main(["diagram", str(tmp_path / "mine.yaml"), "-o", str(tmp_path / "out")]) == 2
    assert "--allow-plugins" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def _only() -> str:
    return "third-party code is imported and run only with --allow-plugins"


@pytest.mark.parametrize("name", ["..:x", ".a:x", "a.:x", "a b:x", "a:x:y", "a/b:x", ":x", "a:", "a:x()", "1:2"])
def test_names_of_no_module_are_one_line(name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    change = f"intervention.policies.0.name={json.dumps(name)}"
    assert main(["case_a", "-o", str(tmp_path / "out"), "--allow-plugins", "--set", change]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize("text", ROUTES)
def test_a_simulation_that_ends_its_process_is_no_report(
    text: str, module: Callable[[str], str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = ROUTES[text]
    changes = [f"gatekeeper.route={module(text)}", "runs={c: {method: c}}", "duration_s=16"]
    settings = [part for change in changes for part in ("--set", change)]
    assert main(["case_a", "-o", str(tmp_path / "out"), *settings, *ONE_RUN, "--allow-plugins"]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out" / "report.json").exists()


CLAIM = """
import os
from airground_drake.verify.claim import Finding, TraceClaim
class It(TraceClaim):
    id = "MINE"
    statement = formula = method = equations = does_not_establish = summary = ""
    assumptions = latex = ()
    def applies(self, trace): os._exit(0)
    def check(self, trace): ...
"""
CLAIMS = {"on import": "import os; os._exit(0)", "when asked": CLAIM}


LIMITS = """
import os, resource
from airground_drake.intervention.policy import Policy
class It(Policy):
    def __init__(self, *, above):
        pid = os.getpid()
        for _ in range(int(above)):
            with open(f"/proc/{pid}/stat") as file:
                pid = int(file.read().rpartition(")")[2].split()[1])
        resource.prlimit(pid, resource.RLIMIT_CPU, (0, 0))
    def propose(self, seen): return None
"""


def ended(folder: Path, *settings: str) -> tuple[int, list[str]]:
    """Exit code of a report in `folder`, and what is said on standard error; its process ends, so not in this one."""
    options = ["--format", "json", "--set", "duration_s=0.5", "--allow-plugins"]
    options += [part for setting in settings for part in ("--set", setting)]
    command = [sys.executable, "-m", "airground_drake.report", "minimal", "-o", str(folder / "out"), *options]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(folder)}, capture_output=True, text=True, check=False
    )
    assert not (folder / "out" / "report.json").exists()
    return done.returncode, done.stderr.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("when", CLAIMS)
def test_a_claim_that_ends_its_process_is_no_report(when: str, module: Callable[[str], str], tmp_path: Path) -> None:
    said = ended(tmp_path, f"claims={{MINE: '{module(CLAIMS[when])}'}}")
    assert said == (4, ["error: the process of this command died (exit code 0)"])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="`prlimit` is of Linux")
@pytest.mark.parametrize(("above", "who"), [(1, "that simulated it"), (2, "of this command")])
def test_a_policy_that_takes_time_away_from_another_process_is_one_line(
    above: int, who: str, module: Callable[[str], str], tmp_path: Path
) -> None:
    policy = f"{{name: '{module(LIMITS)}', parameters: {{above: {above}}}}}"
    code, said = ended(tmp_path, f"intervention.policies=[{policy}]")
    assert (code, len(said)) == (4, 1)
    assert said[0].endswith(f"the process {who} died (signal 9)")


@pytest.fixture
def saved(report: Report, tmp_path: Path, module: Callable[[str], str]) -> Path:
    """A saved run whose scenario names a module for everything."""
    folder = shutil.copytree(report("case_a") / "trace" / "d", tmp_path / "d")
    meta = json.loads((folder / "meta.json").read_text())
    name = module(EVIL)
    meta["scenario"]["intervention"]["policies"][0]["name"] = name
    meta["scenario"]["gatekeeper"]["route"] = meta["scenario"]["uav"]["task"] = name
    meta["scenario"]["claims"] = {"MINE": name}
    (folder / "meta.json").write_text(json.dumps(meta))
    return folder


@pytest.mark.slow
def test_judging_a_saved_run_imports_nothing_that_it_names(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert judge.main([str(saved), "SAFE-TRACE", "SAFE-GATE", "EXEC"]) == 0
    assert not [name for name in sys.modules if name.startswith("evil_")]
    assert "SAFE-GATE: proved" in capsys.readouterr().out
    for wanted in ([], ["MINE"]):
        assert judge.main([str(saved), *wanted]) == 2
        assert f"claims.MINE: {_named(saved)!r} is not allowed; {_only()}" in capsys.readouterr().err
    assert judge.main([str(saved), "MINE", "--allow-plugins"]) == 2
    assert "imported in the process of the command line" in capsys.readouterr().err


def _named(saved: Path) -> str:
    return str(json.loads((saved / "meta.json").read_text())["scenario"]["claims"]["MINE"])


def test_a_report_that_is_not_what_was_written_is_exit_code_4(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def half(scenario: object, digest: str, folder: Path, *_: object) -> dict[str, object]:
        (folder / "report.json").write_text('{"overall": ')
        return {"overall": {"status": "as_expected", "exit_code": 0, "why": ""}}

    monkeypatch.setattr(make, "simulate_all", lambda *_, **__: {})
    monkeypatch.setattr(after_runs, "judge", lambda *_, **__: None)
    monkeypatch.setattr(after_runs, "write", half)
    assert main(["case_a", "-o", str(tmp_path / "out"), "--format", "json"]) == 4
    assert "is not what was written" in capsys.readouterr().err
