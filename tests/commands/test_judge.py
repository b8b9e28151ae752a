"""`airground judge`: positions that come from elsewhere."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from airground_drake.commands import judge
from airground_drake.run.trace import Trace

Run = Callable[[str, str], Trace]


def sampled(trace: Trace) -> pd.DataFrame:
    """Where the robots of a run were at its control samples."""
    period = trace.scenario.control.period_s
    t = period * np.arange(round(trace.t[-1] / period) + 1)
    rows = np.searchsorted(trace.t, t - 1e-9)
    tables = [
        pd.DataFrame(dict(zip(("x_m", "y_m", "z_m"), trace.position(robot)[rows].T, strict=True))).assign(
            t_s=trace.t[rows], body=robot
        )
        for robot in trace.robots
    ]
    return pd.concat(tables, ignore_index=True)


def judged(table: pd.DataFrame, folder: Path, scenario: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    table.to_csv(folder / "positions.csv", index=False)
    code = judge.main([str(folder / "positions.csv"), "--scenario", scenario, "--json"])
    said = capsys.readouterr()
    return code, said.out or said.err


def test_a_run_that_obeyed_the_law_is_promised_its_distances(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = judged(sampled(run("case_a", "d")), tmp_path, "case_a", capsys)
    pairs = json.loads(said)["pairs"]
    assert code == 0
    assert len(pairs) == 12
    assert max(pair["missed_m"] for pair in pairs) <= 1e-12
    assert all(pair["guarantee_m"] == pytest.approx(pair["safe_m"], abs=1e-9) for pair in pairs)


def test_a_run_that_hits_an_obstacle_is_exit_code_1(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = judged(sampled(run("case_b", "b")), tmp_path, "case_b", capsys)
    worst = json.loads(said)["pairs"][0]
    assert code == 1
    assert (worst["first"], worst["second"], worst["kept"]) == ("ugv1", "sudden", False)
    assert worst["missed_m"] > 0.1


def test_of_irregular_samples_only_distances_are_judged(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = sampled(run("case_a", "d"))
    table = table[~np.isclose(table["t_s"], 3.0)]
    code, said = judged(table, tmp_path, "case_a", capsys)
    assert code == 0
    assert {pair["missed_m"] for pair in json.loads(said)["pairs"]} == {None}


def test_parquet_and_the_text_for_people(run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sampled(run("case_a", "d")).to_parquet(tmp_path / "positions.parquet")
    assert judge.main([str(tmp_path / "positions.parquet"), "--scenario", "case_a"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("12 of 12 distances were kept.")
    assert "Not judged: how bodies moved between samples: motion is taken as straight." in said


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda table: table.drop(columns="z_m"), "its columns are"),
        (lambda table: table.assign(body=table["body"].replace("ugv1", "car")), "body 'car' is not a robot"),
        (lambda table: table[table["body"] != "ugv2"], "ugv2 has 0 rows"),
        (
            lambda table: table.assign(x_m=table["x_m"].where(table.index != 7)),
            "row 7 has a value that is not a finite number",
        ),
        (lambda table: table.iloc[::-1], "does not come after the row before"),
        (lambda table: table.drop(index=3), "are not sampled at the same times"),
        (lambda table: table.rename(columns={"z_m": "z" * 100_000}), "its columns are"),
    ],
)
def test_a_table_that_cannot_be_used_is_one_line(
    run: Run,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    edit: Callable[[pd.DataFrame], pd.DataFrame],
    says: str,
) -> None:
    code, said = judged(edit(sampled(run("case_a", "d"))), tmp_path, "case_a", capsys)
    assert code == 2
    assert says in said
    assert said.count("\n") == 1
    assert len(said) < 1000


@pytest.mark.parametrize("name", ["nowhere.csv", "positions.txt"])
def test_a_file_that_is_no_table_is_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "positions.txt").write_bytes(b"\xff\x00\x01")
    assert judge.main([str(tmp_path / name), "--scenario", "case_a"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
