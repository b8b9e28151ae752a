"""`airground judge`: positions from any source."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands.conftest import Airground

from airground_drake.run.trace import Trace

Run = Callable[[str, str], Trace]


def sampled(trace: Trace) -> pd.DataFrame:
    """Where the robots of a run were at its control samples."""
    period = trace.scenario.control.period_s
    rows = np.searchsorted(trace.t, period * np.arange(round(trace.t[-1] / period) + 1) - 1e-9)
    tables = [
        pd.DataFrame(trace.position(robot)[rows], columns=["x_m", "y_m", "z_m"]).assign(t_s=trace.t[rows], body=robot)
        for robot in trace.robots
    ]
    return pd.concat(tables, ignore_index=True)


@pytest.fixture
def judged(tmp_path: Path, airground: Airground) -> Callable[..., str]:
    def judge(table: pd.DataFrame, scenario: str, code: int = 0) -> str:
        table.to_csv(tmp_path / "positions.csv", index=False)
        return airground("judge", tmp_path / "positions.csv", "--scenario", scenario, "--json", code=code)

    return judge


def test_a_run_that_obeyed_the_law_is_promised_its_distances(run: Run, judged: Callable[..., str]) -> None:
    table = sampled(run("case_a", "d"))
    pairs: list[dict[str, Any]] = json.loads(judged(table, "case_a"))["pairs"]
    assert len(pairs) == 12
    assert max(pair["missed_m"] for pair in pairs) <= 1e-12
    assert all(pair["guarantee_m"] == pytest.approx(pair["safe_m"], abs=1e-9) for pair in pairs)
    irregular = table[~np.isclose(table["t_s"], 3.0)]  # the law is about equal periods
    assert {pair["missed_m"] for pair in json.loads(judged(irregular, "case_a"))["pairs"]} == {None}


def test_a_run_that_hits_an_obstacle_is_exit_code_1(run: Run, judged: Callable[..., str]) -> None:
    worst = json.loads(judged(sampled(run("case_b", "b")), "case_b", code=1))["pairs"][0]
    assert (worst["first"], worst["second"], worst["kept"]) == ("ugv1", "sudden", False)
    assert worst["missed_m"] > 0.1


def test_stamps_since_1970_are_judged_like_those_from_zero_and_the_text_says_what_they_cover(
    run: Run, tmp_path: Path, airground: Airground
) -> None:
    table = sampled(run("case_a", "d"))
    table["t_s"] = [f"{t + 1311875572.406161:.6f}" for t in table["t_s"]]
    said = []
    for name, rows in (("whole", table), ("second", table[table["t_s"].astype(float) < 1311875573.4])):
        rows.to_csv(tmp_path / name, index=False)
        said.append(airground("judge", tmp_path / name, "--scenario", "case_a"))
    assert "not equally spaced" not in said[0]
    assert "misses the law by e = 0 m per period, which promises 2 m" in said[0]
    assert said[1].startswith("The samples cover 0.95 s, from t = 1311875572 s; the scenario lasts 30 s.")


def test_no_distance_below_zero_is_promised(run: Run, tmp_path: Path, airground: Airground) -> None:
    sampled(run("case_b", "b")).to_csv(tmp_path / "positions.csv", index=False)
    said = airground("judge", tmp_path / "positions.csv", "--scenario", "case_b", "--set",
                     "control.avoidance_gain_1_s=1", code=1)  # fmt: skip
    assert "promises no distance" in said
    assert "promises -" not in said


def test_parquet_and_the_text_for_people(run: Run, tmp_path: Path, airground: Airground) -> None:
    sampled(run("case_a", "d")).to_parquet(tmp_path / "positions.parquet")
    said = airground("judge", tmp_path / "positions.parquet", "--scenario", "case_a")
    assert said.startswith(
        "The samples cover 30 s, from t = 0 s; the scenario lasts 30 s.\n12 of 12 distances were kept."
    )
    assert "Not judged: how bodies moved between samples: motion is taken as straight." in said


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda table: table.drop(columns="z_m"), "its columns are"),
        (lambda table: table.rename(columns={"z_m": "z" * 100_000}), "its columns are"),
        (lambda table: table.assign(body=table["body"].replace("ugv1", "car")), "body 'car' is not a robot"),
        (lambda table: table[table["body"] != "ugv2"], "ugv2 has 0 rows"),
        (
            lambda table: table.assign(x_m=table["x_m"].where(table.index != 7)),
            "row 7 has a value that is not a finite",
        ),
        (lambda table: table.assign(x_m=table["x_m"] * 1e155), "has a value beyond 1e+12; wanted: seconds and metres"),
        (lambda table: table.iloc[::-1], "does not come after the row before"),
        (lambda table: table.drop(index=3), "are not sampled at the same times"),
    ],
)
def test_a_bad_table_is_refused(
    edit: Callable[[pd.DataFrame], pd.DataFrame], says: str, run: Run, judged: Callable[..., str]
) -> None:
    said = judged(edit(sampled(run("case_a", "d"))), "case_a", code=2)
    assert says in said
    assert len(said) < 1000
