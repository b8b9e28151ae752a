"""`airground campaign`, from outside."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from airground_drake.campaign.store import JOURNAL, read
from airground_drake.commands.campaign import main
from airground_drake.scenarios.load import load

SPEC = """
name: small
scenario: minimal
set: {duration_s: 1.0}
draw:
  seed: {integer: [0, 1000]}
  control.motion_gain_1_s: {uniform: [1.0, 3.0]}
claims: [SAFE-TRACE, THR-TRIG]
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SPEC, encoding="utf-8")
    return path


def test_it_runs_goes_on_and_says_what_it_found(spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "out")
    assert main([str(spec), "-n", "2", "-o", out, "--jobs", "1"]) == 0
    assert main([str(spec), "-n", "2", "-o", out]) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([str(spec), "-n", "4", "-o", out, "--resume", "--limit-time", "9"]) == 2
    assert "another campaign (limits)" in capsys.readouterr().err
    assert main([str(spec), "-n", "4", "-o", out, "--jobs", "1", "--resume"]) == 0
    found = json.loads((tmp_path / "out" / "evidence.json").read_text())
    assert (found["draws"], found["ended"]) == (4, {"judged": 4})
    assert "small: 4 draws (4 judged)" in capsys.readouterr().out
    assert (tmp_path / "out" / "campaign.html").stat().st_size > 5000
    spec.write_text(SPEC.replace("3.0", "2.0"), encoding="utf-8")
    assert main([str(spec), "-n", "5", "-o", out, "--resume"]) == 2
    assert "another campaign" in capsys.readouterr().err


def test_one_draw_alone_is_the_same_draw_and_a_scenario(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(spec), "--only", "1", "-o", str(tmp_path / "one.yaml")]) == 0
    assert "SAFE-TRACE" in capsys.readouterr().out
    scenario = load(tmp_path / "one.yaml")[0]
    assert scenario.name == "small_1"
    assert scenario.duration_s == 1.0
    assert main([str(spec), "--only", "1", "-o", str(tmp_path / "one.yaml")]) == 0, "the same file again"


def test_a_file_that_is_something_else_is_not_replaced_by_a_draw(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text("mine", encoding="utf-8")
    assert main([str(spec), "--only", "1", "-o", str(mine)]) == 2
    assert f"{mine} exists" in capsys.readouterr().err
    assert mine.read_text(encoding="utf-8") == "mine"


def test_more_draws_than_memory_holds_are_refused_before_anything_is_written(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    allowed = "allowed: 4e+06 rows, one for each draw, run and claim\n"
    assert main([str(spec), "-n", "10000000000", "-o", out]) == 2
    assert capsys.readouterr().err == f"error: small asks for about 1e+10 draws (4e+10 rows); {allowed}"
    values = ", ".join(map(str, range(5000)))
    grids = "".join(f"  {key}: {{grid: [{values}]}}\n" for key in ("seed", "duration_s", "control.motion_gain_1_s"))
    spec.write_text(f"scenario: minimal\nclaims: [EXEC]\ndraw:\n{grids}", encoding="utf-8")
    assert main([str(spec), "-o", out]) == 2
    assert capsys.readouterr().err == f"error: small asks for about 1.25e+11 draws (2.5e+11 rows); {allowed}"
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_with_draws_beyond_the_number_is_refused(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    assert main([str(spec), "-n", "3", "-o", out]) == 0
    assert main([str(spec), "-n", "2", "-o", out, "--resume"]) == 2
    assert f"{out} has draw 2; allowed: -n 3 or more" in capsys.readouterr().err


@pytest.mark.parametrize("more", [["-n", "1", "--jobs", "1"], ["--only", "0"]])
def test_what_cannot_be_written(
    spec: Path, tmp_path: Path, more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine")
    output = tmp_path / "file" / "one.yaml" if "--only" in more else tmp_path / "file"
    assert main([str(spec), "-o", str(output), *more]) == 2
    said = capsys.readouterr().err
    assert "cannot be written: " in said
    assert said.count("\n") == 1


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("changes", "code", "says"),
    [
        ("runs: {a: {method: a, expected: {LIVE-GOAL: holds}}}", 1, "2 not as expected"),
        (
            "runs: {a: {method: a, expected: {LIVE-GOAL: refuted, THR-TRIG: exercised}}}",
            3,
            "undecided: THR-TRIG in run a: the",
        ),
        ("", 3, "first that was not judged: draw 0, invalid: "),
    ],
)
def test_what_is_not_as_expected_is_exit_code_1_and_what_is_open_3(
    changes: str, code: int, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "2024-my.team.yaml"  # no identifier, as names of scenarios are
    set_ = f"set: {{duration_s: 1.0, {changes}}}" if changes else "set: {}"
    drawn = "draw:\n  seed: {grid: [1, 2]}\n" if changes else "draw:\n  duration_s: {grid: [-1.0, -2.0]}\n"
    path.write_text(f"scenario: minimal\nclaims: [LIVE-GOAL, THR-TRIG]\n{set_}\n{drawn}", encoding="utf-8")
    assert main([str(path), "-o", str(tmp_path / "out"), "--jobs", "1"]) == code
    assert says in capsys.readouterr().out
    assert main([str(path), "-o", str(tmp_path / "one.yaml"), "--only", "0"]) == (code if changes else 2)
    assert ("undecided: THR-TRIG in run a" in capsys.readouterr().out) == (bool(changes) and code == 3)


@pytest.mark.parametrize(
    "given",
    ["set: {uav.task: 'mine:Task'}", "draw:\n  intervention.policies: {choice: [[], [{name: 'mine:Mine'}]]}"],
)
def test_code_of_others_is_refused_before_anything_is_drawn(
    given: str, spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(f"scenario: minimal\n{given}\n", encoding="utf-8")
    for arguments in (["-n", "2", "-o", str(tmp_path / "out")], ["--only", "0", "-o", str(tmp_path / "one.yaml")]):
        assert main([str(spec), *arguments]) == 2
        error = capsys.readouterr().err
        assert "--allow-plugins" in error
        assert "mine:" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("rule", ["x", "SAFE-TRACE < e", "SAFE-TRACE < 2"])
def test_a_rule_that_is_none(rule: str, spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(spec), "--stop-when", rule]) == 2
    assert "wanted: CLAIM < PROBABILITY" in capsys.readouterr().err


def _session(stat: Path) -> int:
    with contextlib.suppress(OSError):  # it has ended
        state, _, _, session = stat.read_text(errors="replace").rpartition(")")[2].split()[:4]
        return int(session) if state not in "ZX" else 0
    return 0


@pytest.mark.slow
def test_killed_in_the_midst_it_loses_nothing_that_was_finished(spec: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "airground_drake",
        "campaign",
        str(spec),
        "-n",
        "400",
        "-o",
        str(out),
        "--jobs",
        "1",
    ]
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
    try:
        while process.poll() is None and (
            not (out / JOURNAL).exists() or not (out / JOURNAL).read_bytes().count(b"\n")
        ):
            time.sleep(0.05)
    finally:
        process.kill()
        process.wait()
    left, waited = 1, 0.0
    while left and waited < 30.0:  # its processes end with it, busy or not
        left = sum(_session(stat) == process.pid for stat in Path("/proc").glob("[0-9]*/stat"))
        time.sleep(0.1)
        waited += 0.1
    assert not left
    before = read(out)[1]
    assert len(before)
    assert main([str(spec), "-n", str(before["index"].max() + 2), "-o", str(out), "--jobs", "1", "--resume"]) == 0
    after = read(out)[1]
    same = after[after["index"].isin(set(before["index"]))].reset_index(drop=True)
    assert same.drop(columns="wall_s").equals(before.drop(columns="wall_s"))
    assert not after.duplicated(["index", "run", "claim"]).any()
