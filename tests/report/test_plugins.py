"""Third-party code on the command line: it runs only where allowed; whatever it does, the exit code is right."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from builders.hostile_policies import KINDS

from airground_drake import commands
from airground_drake.report.__main__ import main
from airground_drake.scenario.shipped import shipped_files
from airground_drake.verify import __main__ as judge

Report = Callable[[str], Path]

ONE_RUN = ["--set", "reproduction=[]", "--set", "choices=[]", "--format", "json"]
IN_A_RUN = (
    "sys_exit_0", "os_exit_0", "loops_and_swallows_everything", "text_holds_lone_surrogates",
    "text_sleeps", "array_ends_the_process", "sends_garbage", "closes_every_descriptor", "patches_the_claims",
    "leaves_a_child_behind",
)  # fmt: skip
ONLY = "third-party code is imported and run only with --allow-plugins"

EVIL = """
import os
if os.environ["JUDGING"] == str(os.getpid()):
    raise AssertionError("imported in the process of the command line")
from airground_drake.uav.policy import Policy
class It(Policy):
    def propose(self, seen): return None
"""
ROUTE = "class It:\n    def solve(self, problem, budget): "
KILL = f"{ROUTE}import os, signal; os.kill(os.getppid(), signal.SIGKILL)"
CLAIM = """
import os
from airground_drake.verify.claim import Finding, TraceClaim
class It(TraceClaim):
    id = "MINE"
    statement = method = equations = does_not_establish = summary = ""
    assumptions, formula = (), "x = x"
    def applies(self, trace): os._exit(0)
    def check(self, trace): ...
"""
IN_C = [
    "case_a", "gatekeeper.route=IT", "runs={c: {method: c}}", "duration_s=4", "decision.threshold.zeta_m=0.5",
    "decision.release_m=0.2", "reproduction=[]", "choices=[]",
]  # fmt: skip
JUDGED = ["minimal", "duration_s=0.5", "claims={MINE: 'IT'}"]


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("JUDGING", str(os.getpid()))
    name = f"evil_{abs(hash(str(tmp_path)))}"

    def write(text: str) -> str:
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
    policy = re.escape("policy builders.hostile_policies:Hostile")
    assert re.fullmatch(rf"{policy}: hostile_policies\.py:\d+ SystemExit: 0 \(.*at \d+\.\d\d s\), run d", first)
    document = json.loads((tmp_path / "report.json").read_text())
    assert {c["status"] for c in document["claims"] if c["id"] in ("SAFE-TRACE", "SAFE-HYP")} == {"holds"}
    said = " ".join(fault["what"] for fault in document["runs"]["d"]["faults"])
    for words in ("SystemExit: 0", "exit code 0", "OutOfTime", "ud800", "no message", "closed its channel"):
        assert words in said
    assert said.isprintable()
    assert "detour" in {event.get("policy") for event in document["runs"]["d"]["events"]}


def test_third_party_code_is_refused_unless_it_is_allowed(
    module: Callable[[str], str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, out = module(EVIL), tmp_path / "out"
    for key in ("uav.task", "gatekeeper.route", "intervention.policies.0.name"):
        assert main(["case_a", "-o", str(out), "--set", f"{key}={name}"]) == 2
        assert capsys.readouterr().err == f"error: case_a: {key}: '{name}' is not allowed; {ONLY}\n"
    assert main(["case_a", "-o", str(out), "--set", f"claims={{MINE: '{name}'}}"]) == 2
    minimal = shipped_files()["minimal"].read_text().replace("runs:", "runs:\n  c: {method: c}")
    (tmp_path / "mine.yaml").write_text(f"{minimal}\ngatekeeper: {{route: '{name}'}}\n")
    assert commands.main(["diagram", str(tmp_path / "mine.yaml"), "-o", str(out)]) == 2
    assert capsys.readouterr().err.count("--allow-plugins") == 2
    assert not out.exists()


CRASHES = """
from airground_drake.uav.policy import Policy
class It(Policy):
    def propose(self, seen):
        print("asked")
        return self.helper()
    def helper(self):
        raise KeyError("no\x1b[31m plan")
"""


@pytest.mark.parametrize("command", ["run", pytest.param("report", marks=pytest.mark.slow)])
def test_a_policy_that_crashes_is_told_with_its_first_traceback_and_may_be_heard(
    command: str, module: Callable[[str], str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    name = module(CRASHES)
    file = f"{name.partition(':')[0]}.py"
    shown = ["--show-policy-output", "--set", f"intervention.policies=[{{name: '{name}'}}]", "--allow-plugins"]
    report = ["report", "minimal", "-q", "--format", "json", "-o", str(tmp_path / "out")]
    words = ["run", "minimal", "d"] if command == "run" else report
    for more in (shown, shown[1:]):
        commands.main([*words, *more])
        lines = capfd.readouterr().err.splitlines()
        assert lines.count("asked") == (4 if more is shown else 0)
        said = [line for line in lines if line != "asked"]
        assert said[0].startswith(f"run d: policy {name} failed 4 times, first at 6.05 s: {file}:8 KeyError: ")
        assert said[1:3] == ["Traceback (most recent call last):", f'  File "{file}", line 6, in propose']
        assert said[-1] == r"KeyError: 'no\x1b[31m plan'"
        assert sum("Traceback" in line for line in said) == 1
        assert all(line.isprintable() for line in said)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a command has no child to work in")
@pytest.mark.parametrize(
    ("text", "scenario", "code", "said"),
    [
        (f"{ROUTE}import os; os._exit(0)", IN_C, 4, "died (exit code 0)"),
        (f"{ROUTE}raise SystemExit(0)", IN_C, 4, "SystemExit: 0"),
        (f"{ROUTE}return True", IN_C, 4, "route It returned True, of type bool; allowed: airground_drake.ugv."),
        (f"{ROUTE}raise KeyError(7)", IN_C, 4, "route It raised evil_"),
        ("import sys; sys.exit(0)", IN_C, 2, "cannot be imported: SystemExit: 0"),
        ("import os; os._exit(0)", JUDGED, 4, "the process of this command died (exit code 0)"),
        (CLAIM, JUDGED, 4, "the process of this command died (exit code 0)"),
        (KILL, IN_C, 4, "the process of this command died (signal 9)"),
    ],
)
def test_code_that_ends_a_process_is_one_line_and_no_report(
    text: str, scenario: list[str], code: int, said: str, module: Callable[[str], str], tmp_path: Path
) -> None:
    name, *settings = (part.replace("IT", module(text)) for part in scenario)
    options = [part for setting in settings for part in ("--set", setting)]
    command = [sys.executable, "-m", "airground_drake.report", name, "-q", "-o", str(tmp_path / "out"), *options]
    done = subprocess.run(
        [*command, "--format", "json", "--allow-plugins"], env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr.count("\n")) == (code, 1)
    assert said in done.stderr
    assert not (tmp_path / "out" / "report.json").exists()


@pytest.mark.slow
def test_judging_a_saved_run_imports_nothing_that_it_names(
    report: Report, tmp_path: Path, module: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    saved, name = shutil.copytree(report("case_a") / "trace" / "d", tmp_path / "d"), module(EVIL)
    meta = json.loads((saved / "meta.json").read_text())
    meta["scenario"]["intervention"]["policies"][0]["name"] = name
    meta["scenario"]["gatekeeper"]["route"] = meta["scenario"]["uav"]["task"] = name
    meta["scenario"]["claims"] = {"MINE": name}
    (saved / "meta.json").write_text(json.dumps(meta))
    capsys.readouterr()
    assert judge.main([str(saved), "SAFE-TRACE", "SAFE-GATE", "SAFE-HYP"]) == 0
    assert not [each for each in sys.modules if each.startswith("evil_")]
    assert "SAFE-GATE: proved" in capsys.readouterr().out
    for wanted in ([], ["MINE"]):
        assert judge.main([str(saved), *wanted]) == 2
        assert f"claims.MINE: {name!r} is not allowed; {ONLY}" in capsys.readouterr().err
    assert judge.main([str(saved), "MINE", "--allow-plugins"]) == 2
    assert "imported in the process of the command line" in capsys.readouterr().err
