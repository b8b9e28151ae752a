"""`airground campaign`, from outside."""

import contextlib
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.scenario.load import load
from airground_drake.study.campaign.store import JOURNAL, read

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
    (tmp_path / "small.yaml").write_text(SPEC, encoding="utf-8")
    return tmp_path / "small.yaml"


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_it_runs_goes_on_and_says_what_it_found(spec: Path, tmp_path: Path, airground: Airground) -> None:
    out = tmp_path / "out"
    airground("campaign", spec, "-n", 2, "-o", out)
    for words, says in (
        (("-n", 2), "--resume"),
        (("-n", 4, "--resume", "--limit-time", 9), "another campaign (limits)"),
        (("-n", 1, "--resume"), f"{out} has draw 1; allowed: -n 2 or more"),
    ):
        assert says in airground("campaign", spec, *words, "-o", out, code=2)
    assert "small: 4 draws (4 judged)" in airground("campaign", spec, "-n", 4, "-o", out, "--resume")
    found = json.loads((out / "evidence.json").read_text())
    assert (found["draws"], found["ended"]) == (4, {"judged": 4})
    assert (out / "campaign.html").stat().st_size > 5000
    spec.write_text(SPEC.replace("3.0", "2.0"), encoding="utf-8")
    assert "another campaign (spec_sha256)" in airground("campaign", spec, "-n", 5, "-o", out, "--resume", code=2)


@pytest.mark.usefixtures("in_this_process")
def test_a_grid_has_a_table_and_a_plot_for_each_key(spec: Path, tmp_path: Path, airground: Airground) -> None:
    grids = "draw: {duration_s: {grid: [0.5, 1.0]}, control.motion_gain_1_s: {grid: [2.0, 3.0]}}"
    spec.write_text(f"scenario: minimal\nruns: [d]\nclaims: [SAFE-TRACE]\n{grids}\n", encoding="utf-8")
    said = airground("campaign", spec, "-o", tmp_path / "out")
    assert "  by duration_s:\n    0.5        d          0 of 2 arrived\n    1.0 " in said
    found = json.loads((tmp_path / "out" / "evidence.json").read_text())
    assert [(each["key"], [e["value"] for e in each["entries"]]) for each in found["swept"]] == [
        ("duration_s", [0.5, 1.0]), ("control.motion_gain_1_s", [2.0, 3.0]),
    ]  # fmt: skip
    text = (tmp_path / "out" / "campaign.html").read_text()
    assert text.count("What became of the runs, by ") >= 2


def test_one_draw_alone_is_the_same_draw_and_a_scenario(spec: Path, tmp_path: Path, airground: Airground) -> None:
    for _ in range(2):  # the same file again
        assert "SAFE-TRACE" in airground("campaign", spec, "--only", 1, "-o", tmp_path / "one.yaml")
    scenario = load(tmp_path / "one.yaml")
    assert (scenario.name, scenario.duration_s) == ("small_1", 1.0)
    assert "THR-TRIG     not tested" in airground("campaign", spec, "--only", 1, "-o", tmp_path / "one.yaml")


def test_more_combinations_than_memory_holds_are_refused(spec: Path, tmp_path: Path, airground: Airground) -> None:
    grid = f"{{grid: [{', '.join(map(str, range(400)))}]}}"
    grids = "".join(f"  obstacles.o{k}.radius_m: {grid}\n" for k in range(120))
    spec.write_text(f"scenario: minimal\nclaims: [SAFE-HYP]\ndraw:\n{grids}", encoding="utf-8")
    said = airground("campaign", spec, "-o", tmp_path / "out", code=2)
    assert "small asks for about 1.77e+312 draws (3.53e+312 rows); allowed: 4e+06 rows" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("given", "code", "says", "alone"),
    [
        ("set: {duration_s: 1.0, runs: {a: {method: a, expected: {LIVE-GOAL: holds}}}}", 1, "2 not as expected", 1),
        (
            "set: {duration_s: 1.0, runs: {a: {method: a, expected: {LIVE-GOAL: refuted, THR-TRIG: exercised}}}}", 3,
            "undecided: THR-TRIG in run a: the", 3,
        ),
        ("draw: {duration_s: {grid: [-1.0, -2.0]}}", 3, "first that was not judged: draw 0, invalid: ", 2),
    ],
)  # fmt: skip
def test_exit_code_1_is_a_claim_that_differs_and_3_an_open_one(
    given: str, code: int, says: str, alone: int, tmp_path: Path, airground: Airground
) -> None:
    path = tmp_path / "2024-my.team.yaml"  # no identifier, as names of scenarios are
    drawn = "" if "draw" in given else "draw: {seed: {grid: [1, 2]}}\n"
    path.write_text(f"scenario: minimal\nclaims: [LIVE-GOAL, THR-TRIG]\n{given}\n{drawn}", encoding="utf-8")
    assert says in airground("campaign", path, "-o", tmp_path / "out", code=code)
    said = airground("campaign", path, "-o", tmp_path / "one.yaml", "--only", 0, code=alone)
    assert ("undecided: THR-TRIG in run a" in said) == (alone == 3)


@pytest.mark.parametrize(
    "given",
    ["set: {uav.task: 'mine:Task'}", "draw:\n  intervention.policies: {choice: [[], [{name: 'mine:Mine'}]]}"],
)
def test_third_party_code_is_refused_before_anything_is_drawn(
    given: str, spec: Path, tmp_path: Path, airground: Airground
) -> None:
    spec.write_text(f"scenario: minimal\n{given}\n", encoding="utf-8")
    for words in (("-n", 2), ("--only", 0)):
        error = airground("campaign", spec, *words, "-o", tmp_path / "out", code=2)
        assert "mine:" in error
        assert "--allow-plugins" in error
    assert not (tmp_path / "out").exists()


def _in_session(leader: int) -> int:
    count = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            state, _, _, session = stat.read_text(errors="replace").rpartition(")")[2].split()[:4]
            count += int(session) == leader and state not in "ZX"
    return count


@pytest.mark.slow
def test_killed_in_the_midst_it_loses_nothing_that_was_finished(
    spec: Path, tmp_path: Path, airground: Airground
) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "airground_drake", "campaign", str(spec), "-n", "400", "-o", str(out)]
    process = subprocess.Popen([*command, "--jobs", "1"], start_new_session=True, stderr=subprocess.DEVNULL)
    try:
        while process.poll() is None and not ((out / JOURNAL).exists() and b"\n" in (out / JOURNAL).read_bytes()):
            time.sleep(0.05)
    finally:
        process.kill()
        process.wait()
    until = time.monotonic() + 30.0
    while _in_session(process.pid) and time.monotonic() < until:  # its processes end with it, busy or not
        time.sleep(0.1)
    assert not _in_session(process.pid)
    before = read(out)[1]
    assert len(before)
    airground("campaign", spec, "-n", before["index"].max() + 2, "-o", out, "--jobs", 1, "--resume")
    after = read(out)[1]
    same = after[after["index"].isin(set(before["index"]))].reset_index(drop=True)
    assert same.drop(columns="wall_s").equals(before.drop(columns="wall_s"))
    assert not after.duplicated(["index", "run", "claim"]).any()
