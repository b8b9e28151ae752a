"""Sweeps: runs as a table, and what became of them by the value of a key."""

import math
from typing import Any

import pandas as pd
import pytest
from study.campaign.test_evidence import row, stopped, table

from airground_drake import judge, load, simulate, sweep
from airground_drake.base.errors import ScenarioError, UnknownNameError
from airground_drake.study.campaign.swept import by_value, per_run

KEY = "decision.threshold.zeta_m"


def test_a_row_is_the_run_with_these_values() -> None:
    scenario = load("minimal", {"duration_s": 6.5})
    values: dict[str, list[Any]] = {KEY: [2.0, 4.0], "intervention.policies": [[], [{"name": "coordinate"}]]}
    found = sweep(scenario, values, runs=["d"], claims=["SAFE-TRACE", "THR-TRIG"])
    assert list(zip(found[KEY], found["intervention.policies"], strict=True)) == [
        (2.0, "[]"), (4.0, "[]"), (2.0, '[{"name": "coordinate"}]'), (4.0, '[{"name": "coordinate"}]'),
    ]  # fmt: skip
    for _, each in found.iterrows():
        policies = values["intervention.policies"][each["intervention.policies"] != "[]"]
        trace = simulate(load("minimal", {"duration_s": 6.5, KEY: each[KEY], "intervention.policies": policies}), "d")
        (safe,) = judge(trace, ["SAFE-TRACE"])
        triggers = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
        assert each["SAFE-TRACE margin"] == safe.margin
        assert each["triggers"] == len(triggers)
        assert triggers == [each["first_trigger_s"]] or math.isnan(each["first_trigger_s"])
    assert set(found["THR-TRIG"]) == {"holds", "not_exercised"}
    again = sweep(scenario, values, runs=["d"], claims=["SAFE-TRACE", "THR-TRIG"], jobs=2)
    pd.testing.assert_frame_equal(found, again)


def test_mistakes_are_named_and_impossible_values_have_a_row() -> None:
    scenario = load("minimal", {"duration_s": 0.5})
    with pytest.raises(ScenarioError, match="zeta_n"):
        sweep(scenario, {"decision.threshold.zeta_n": [1.0]})
    gain = "control.motion_gain_1_s"
    with pytest.raises(ScenarioError, match=f"control: it would replace {gain}, which is given before; wanted: one"):
        sweep(scenario, {gain: [1.0, 2.0], "control": [{"period_s": 0.05}]})
    with pytest.raises(UnknownNameError, match="unknown run 'z'"):
        sweep(scenario, {KEY: [1.0]}, runs=["z"])
    with pytest.raises(UnknownNameError, match="SAFE-TRAC"):
        sweep(scenario, {KEY: [1.0]}, claims=["SAFE-TRAC"])
    with pytest.raises(ValueError, match=f"no values for {KEY}"):
        sweep(scenario, {KEY: []})
    found = sweep(scenario, {"duration_s": [-1.0, 0.5]}, runs=["d"], claims=["SAFE-TRACE"])
    assert found["ended"].tolist() == ["invalid", "judged"]
    assert "duration_s" in found["what"][0]


def made() -> pd.DataFrame:
    rows = []
    for index in range(4):
        for run in "cd":
            common = {"run": run, "drawn": {"gain": float(index % 2), "kind": ["x", {"y": 1}]}, "ugvs": 2}
            if (index, run) == (3, "c"):
                rows.append(stopped(index, run) | {"drawn": '{"gain": 1.0, "kind": ["x", {"y": 1}]}'})
                continue
            late = {"arrived": 2, "arrival_s": 10.0 + index} if run == "d" else {"arrived": 1, "arrival_s": 3.0}
            refuted = "refuted" if (index, run) == (1, "c") else "holds"
            rows.append(row(index, refuted, **common, **late, margin=-0.5 if refuted == "refuted" else 0.1 * index))
            if run == "d":
                rows.append(row(index, claim="THR-TRIG", exercised=0.0, margin=math.nan, **common, **late))
    return table(rows)


def test_runs_are_counted_by_value() -> None:
    runs = per_run(made())
    assert len(runs) == 8
    assert list(runs.columns[:4]) == ["index", "gain", "kind", "run"]
    assert set(runs["kind"]) == {'["x", {"y": 1}]'}
    entries = {(each["value"], each["run"]): each for each in by_value(runs, "gain")}
    assert list(entries) == [(0.0, "c"), (0.0, "d"), (1.0, "c"), (1.0, "d")]
    c = entries[1.0, "c"]
    assert (c["runs"], c["judged"], c["arrived"], c["ugvs"], c["arrival_s"]) == (2, 1, 1, 2, None)
    assert c["claims"]["SAFE-TRACE"] == {"tested": 1, "refuted": 1, "undecided": 0, "margin": -0.5}
    d = entries[1.0, "d"]
    assert (d["judged"], d["arrived"], d["arrival_s"]) == (2, 4, 12.0)
    assert d["claims"]["SAFE-TRACE"] == {"tested": 2, "refuted": 0, "undecided": 0, "margin": pytest.approx(0.1)}
    for untested in (c, d):
        assert untested["claims"]["THR-TRIG"] == {"tested": 0, "refuted": 0, "undecided": 0, "margin": None}


def test_a_key_may_be_named_like_a_column() -> None:
    runs = per_run(table([row(k, drawn={"ugvs": {f"u{i}": 1 for i in range(k)}}, ugvs=k) for k in (1, 2)]))
    assert [(each["value"], each["ugvs"]) for each in by_value(runs, "ugvs")] == [
        ('{"u0": 1, "u1": 1}', 2), ('{"u0": 1}', 1),
    ]  # fmt: skip
