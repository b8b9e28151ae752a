"""`airground judge`: the log of an experiment, judged on the command line."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from builders import logs
from commands.conftest import Airground

from airground_drake.report.export import recording
from airground_drake.report.view.plane import Frame
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.study.logs import judging, page

Run = Callable[[str, str], Trace]
BETWEEN_M = 5e-4
"""By how much a body on wheels leaves the straight line between two samples here, at most."""


def sampled(trace: Trace) -> pd.DataFrame:
    period = trace.scenario.control.period_s
    rows = np.searchsorted(trace.t, period * np.arange(round(trace.t[-1] / period) + 1) - 1e-9)
    found = [
        pd.DataFrame(trace.position(robot)[rows], columns=["x_m", "y_m", "z_m"]).assign(t_s=trace.t[rows], body=robot)
        for robot in trace.robots
    ]
    return pd.concat(found, ignore_index=True)


@pytest.fixture
def judged(tmp_path: Path, airground: Airground) -> Callable[..., dict[str, Any]]:
    def judge(table: pd.DataFrame, scenario: str, *more: str, code: int = 0) -> dict[str, Any]:
        table.to_csv(tmp_path / "positions.csv", index=False)
        said = airground("judge", tmp_path / "positions.csv", "--scenario", scenario, "--json", *more, code=code)
        found: dict[str, Any] = json.loads(said)
        return found

    return judge


def test_a_run_that_obeyed_the_law_is_promised_its_distances(run: Run, judged: Callable[..., dict[str, Any]]) -> None:
    table = sampled(run("case_a", "d"))
    for rows in (table, table[~np.isclose(table["t_s"], 3.0)]):  # intervals need not be equal
        found = judged(rows, "case_a")
        assert len(found["pairs"]) == 12
        assert max(pair["missed_m"] for pair in found["pairs"]) <= 1e-12
        assert all(pair["promised_m"] == pytest.approx(pair["safe_m"], abs=1e-9) for pair in found["pairs"])
        assert all(all(pair["hypotheses"].values()) for pair in found["pairs"])
        assert (found["status"], found["covered"]["all"]) == ("kept", True)


def test_what_a_log_lacks_to_judge_old_positions_is_said(run: Run, judged: Callable[..., dict[str, Any]]) -> None:
    table = sampled(run("swap", "d"))
    given = "channel={ugvs: {}}", "control.law=asynchronous", "runs={a: {method: a}}"
    changes = [word for change in given for word in ("--set", change)]
    told = [judged(table, "swap", *more)["not_judged"] for more in ((), changes)]
    assert [entry for entry in told[1] if entry not in told[0]] == [judging.NOT_JUDGED_OF_OLD]


def test_a_run_that_hits_an_obstacle_is_exit_code_1(run: Run, judged: Callable[..., dict[str, Any]]) -> None:
    worst = judged(sampled(run("case_b", "b")), "case_b", code=1)["pairs"][0]
    assert (worst["first"], worst["second"], worst["status"]) == ("ugv1", "sudden", "NOT KEPT")
    assert worst["missed_m"] > 0.1
    assert worst["hypotheses"]["obeys the avoidance law in every interval"] is False
    assert worst["came_m"]["ugv1"] > 0.1
    assert worst["came_m"]["sudden"] == 0.0


@pytest.mark.parametrize("kind", ["csv", "mcap"])
@pytest.mark.parametrize("name", [pytest.param("forklift", marks=pytest.mark.slow), "unicycle"])
def test_what_the_package_exports_is_judged_like_the_run(
    kind: str, name: str, run: Run, tmp_path: Path, airground: Airground
) -> None:
    """Distances between surfaces, as the package itself tells them: beside what moves, and of a body on wheels."""
    trace, judged_by = run("forklift", "d") if name == "forklift" else None, "forklift"
    if trace is None:
        given = logs.scenario()
        given["safe_distance"]["ugv_m"] = 0.1
        # Names of robots that occur in names of columns: x.y_m, x.body_x_m.
        given["ugvs"] = {"x": given["ugvs"]["tb_0"], "body": given["ugvs"]["tb_1"]}
        given["ugvs"]["x"]["plant"], given["uav"]["name"] = {"kind": "unicycle", "hand_point_m": 0.1}, "y"
        judged_by = (tmp_path / "lab.yaml").as_posix()
        (tmp_path / "lab.yaml").write_text(yaml.safe_dump(given))
        trace = simulate(load(judged_by), "a")
    *_, least = recording.write(trace, tmp_path)
    if kind == "csv":
        path = tmp_path / f"{trace.run}_states.csv"
    else:
        path = tmp_path / "run.mcap"
        path.write_bytes(recording.recorded(trace, trace.scenario))
    said = airground("judge", path, "--scenario", judged_by, "--json")
    pairs = {(pair["first"], pair["second"]): pair["least_m"] for pair in json.loads(said)["pairs"]}
    expected = {(row.first, row.second): row.min_distance_m for row in pd.read_csv(least).itertuples()}
    assert {frozenset(pair) for pair in pairs} == {frozenset(pair) for pair in expected}
    assert len(pairs) > 2
    for (one, two), least_m in pairs.items():
        assert least_m == pytest.approx(expected.get((one, two), expected.get((two, one))), abs=BETWEEN_M)


def test_stamps_since_1970_are_judged_like_those_from_zero_and_the_text_says_what_they_cover(
    run: Run, tmp_path: Path, airground: Airground
) -> None:
    table = sampled(run("case_a", "d"))
    table["t_s"] = [f"{t + 1311875572.406161:.6f}" for t in table["t_s"]]
    said = []
    for name, rows in (("whole", table), ("second", table[table["t_s"].astype(float) < 1311875573.4])):
        rows.to_csv(tmp_path / name, index=False)
        said.append(airground("judge", tmp_path / name, "--scenario", "case_a"))
    first, second, *_ = said[0].splitlines()
    assert first == "Every distance was kept, with straight motion between samples."
    assert second == "12 of 12 distances were kept. The log has 30 of the scenario's 30 s, without gaps."
    assert "the law held in all 600 intervals: the safety theorem promises 2 m" in said[0]
    assert "Time 0 is 1311875572.406161 s since 1970." in said[0]
    assert said[1].startswith("No distance was broken where the log covers it.\n")
    assert "The log has 0.95 of the scenario's 30 s" in said[1]


def test_no_distance_below_zero_is_promised(run: Run, tmp_path: Path, airground: Airground) -> None:
    sampled(run("case_b", "b")).to_csv(tmp_path / "positions.csv", index=False)
    said = airground("judge", tmp_path / "positions.csv", "--scenario", "case_b", "--set",
                     "control.avoidance_gain_1_s=1", code=1)  # fmt: skip
    assert "promises no distance" in said
    assert "promises -" not in said
    assert said.startswith("NOT KEPT (ugv1, sudden): overlap by ") or "below it" in said.splitlines()[0]


@pytest.fixture
def log(tmp_path: Path) -> list[Path | str]:
    path = tmp_path / "run.csv"
    path.write_text(logs.text(logs.long(logs.motion())))
    return [path, "--scenario", logs.write_scenario(tmp_path).as_posix()]


def test_the_verdict_comes_first_with_margin_time_and_whose_doing_it_was(
    log: list[Path | str], airground: Airground
) -> None:
    first, second, third, *_ = airground("judge", *log, code=1).splitlines()
    least_m, at_s = logs.least_gaps(logs.motion())[logs.BROKEN]
    assert first.startswith(f"NOT KEPT (tb_0, tb_1): {least_m:.4f} m at {at_s:.3f} s, required 0.3 m, below it 2.")
    assert re.fullmatch(r"  tb_0, tb_1: in the second before, tb_1 came 0\.11\d m nearer, tb_0 .*", second)
    assert third == "5 of 6 distances were kept. The log has 6 of the scenario's 6 s, without gaps."


def test_json_has_all_remarks(log: list[Path | str], airground: Airground) -> None:
    printed = json.loads(airground("judge", *log, "--json", "--set", "ugvs.tb_0.start_m=[-1.5,0,0]", code=1))
    assert printed["said"][-1].startswith("robots do not start as in the scenario: tb_0 by 0.5 m; if the log is in")


def test_a_position_error_that_decides_is_exit_code_1(log: list[Path | str], airground: Airground) -> None:
    said = airground("judge", *log, "--position-error", "0.01", "--position-error", "uav=0", code=1)
    assert said.startswith("NOT ESTABLISHED (tb_0, tb_1): 0.28")
    assert "± 0.02 m at" in said.splitlines()[0]
    assert "the position error decides" in said.splitlines()[0]


def test_the_page_has_the_verdict_the_map_and_a_replay(
    log: list[Path | str], tmp_path: Path, airground: Airground
) -> None:
    said = airground("judge", *log, "-o", tmp_path / "judged", code=1)
    page, replay = ((tmp_path / "judged" / name).read_text() for name in ("judged.html", "replay.html"))
    assert said.splitlines()[0].replace("'", "&#39;") in page
    assert page.count("<svg") >= 2
    for words in ("tb_1 came 0.11", "Every pair", "Not judged", 'href="replay.html"', "run.csv", "--position-error"):
        assert words in page
    assert "too near, tb_0, tb_1" in replay
    assert "<script" not in page


def test_the_page_of_a_log_with_gaps_draws_none_of_them(tmp_path: Path, airground: Airground) -> None:
    head, *rows = logs.long(logs.motion())
    rows = [row for row in rows if not (row[1] == "tb_1" and 2.4 < float(row[0]) < 3.6)]
    (tmp_path / "gap.csv").write_text(logs.text([head, *rows]))
    airground("judge", tmp_path / "gap.csv", "--scenario", logs.write_scenario(tmp_path), "-o", tmp_path / "judged")
    page, replay = ((tmp_path / "judged" / name).read_text() for name in ("judged.html", "replay.html"))
    assert "distances were kept where a body was not recorded" in page
    assert "not 2.400 to 3.600 s" in page
    assert "No distance was broken where the log covers it." in page
    assert "not recorded, tb_1, for 1.20 s" in replay
    assert "UGV: own task" not in replay  # a log does not say so


def test_a_map_is_as_wide_as_others_and_its_ways_cut_no_corners(tmp_path: Path, airground: Airground) -> None:
    t_s = np.arange(0.0, 6000.0, 0.5)  # 200 laps
    laps = 2.0 * np.stack([np.cos(0.21 * t_s), np.sin(0.21 * t_s)], axis=1)
    drawn = page._drawn(laps, Frame(-2.0, 2.0, -2.0, 2.0))
    assert np.nanmax(np.hypot(*np.diff(drawn, axis=0).T)) < 0.25
    assert np.nanmin(np.hypot(*drawn.T)) > 1.99
    assert len(drawn) < 0.5 * len(laps)
    t_s = np.arange(0.0, 60.0, 0.5)
    corridor = {
        name: (t_s, np.stack([0.0 * t_s + x, t_s + 5e6, 0.0 * t_s], axis=1))
        for name, x in (("tb_0", 0.0), ("tb_1", 2.0))
    }
    (tmp_path / "corridor.csv").write_text(logs.text(logs.long(corridor)))
    scenario = logs.write_scenario(tmp_path, obstacles={})
    airground("judge", tmp_path / "corridor.csv", "--scenario", scenario, "-o", tmp_path / "judged")
    assert [path.name for path in (tmp_path / "judged").iterdir()] == ["judged.html"]  # no replay far from the scenario
    assert '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 432 ' in (tmp_path / "judged/judged.html").read_text()


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--rename", "x"], "'x' is not allowed; wanted: NAME=BODY"),
        (["--map-columns", "time=a"], "'time=a' is not allowed; wanted: t=NAME"),
        (["--map-columns", "t=a"], "--map-columns t=a: there is no such column; there are t_s, body, x_m"),
        (["--position-error", "-1"], "'-1' is not allowed"),
        (["--position-error", "tb_9=0.1"], "the scenario has no tb_9; it has tb_0, tb_1, uav"),
        (["--without", "tb_9"], "the scenario has no tb_9"),
        (["--uav", "tb_0"], "--uav tb_0: the scenario has it already"),
        (["--gap", "-1"], "'-1' is not allowed"),
    ],
)
def test_a_wrong_option_is_refused(more: list[str], says: str, log: list[Path | str], airground: Airground) -> None:
    assert says in airground("judge", *log, *more, code=2)


def test_a_missing_file_and_an_empty_folder_are_named(tmp_path: Path, airground: Airground) -> None:
    scenario = logs.write_scenario(tmp_path)
    (tmp_path / "empty").mkdir()
    assert "no such file" in airground("judge", tmp_path / "a", "--scenario", scenario, code=2).lower()
    assert "has no files" in airground("judge", tmp_path / "empty", "--scenario", scenario, code=2)


def test_the_page_about_logs_shows_what_is_printed(
    tmp_path: Path, airground: Airground, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "logs.md").read_text(encoding="utf-8")
    for name, content in re.findall(r"```\w+\n(?=# file: (\S+)\n)(.*?)```", page, re.DOTALL):
        (tmp_path / name).write_text(content)
    monkeypatch.chdir(tmp_path)
    (command,) = re.findall(r"```bash\nairground (.*?)\n```", page)
    *_, shown = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    *said, replay, judged = airground(*command.split(), code=1).splitlines()
    assert " ".join(shown.split()) == " ".join("\n".join(said).split())
    assert (replay, judged) == ("judged/replay.html", "judged/judged.html")
