"""One draw: its rows, whatever comes of it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest

from airground_drake.base.errors import SimulationError
from airground_drake.campaign import work
from airground_drake.campaign.rows import COLUMNS, INVALID, JUDGED, STOPPED
from airground_drake.campaign.spec import Spec, load_spec
from airground_drake.scenarios.estimate import DEFAULT_LIMITS, Limits

TEXT = """
scenario: minimal
set: {duration_s: 2.0}
draw: {seed: {integer: [0, 1000]}}
claims: [SAFE-TRACE, ZENO-TRACE]
"""


@pytest.fixture
def spec(tmp_path: Path) -> Spec:
    path = tmp_path / "mine.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return load_spec(path)


def test_a_row_for_each_run_and_claim(spec: Spec) -> None:
    rows = work.rows_of(spec, 5, DEFAULT_LIMITS)
    assert {row["claim"] for row in rows} == {"SAFE-TRACE", "ZENO-TRACE"}
    for row in rows:
        assert row.keys() == COLUMNS.keys()
        assert (row["ended"], row["index"], row["status"]) == (JUDGED, 5, "holds")
        assert json.loads(row["drawn"]) == spec.values(5)
        assert row["wall_s"] > 0.0
    safe = next(row for row in rows if row["claim"] == "SAFE-TRACE")
    assert safe["margin"] >= 0.0
    assert math.isnan(safe["first_trigger_s"])


def test_a_draw_that_makes_no_scenario_is_counted_as_such(spec: Spec) -> None:
    (row,) = work.rows_of(replace(spec, fixed={"duration_s": -1.0}), 5, DEFAULT_LIMITS)
    assert (row["ended"], row["claim"]) == (INVALID, "")
    assert "duration_s" in row["what"]
    (row,) = work.rows_of(spec, 5, Limits(work=1.0))
    assert row["ended"] == INVALID


def test_numbers_that_are_none_and_runs_that_are_not_there_make_no_scenario_either(spec: Spec) -> None:
    (row,) = work.rows_at(spec, {"decision.noise_m_sqrt_s": float("nan")}, 5, DEFAULT_LIMITS)
    assert (row["ended"], row["drawn"]) == (INVALID, '{"decision.noise_m_sqrt_s": "nan"}')
    without = replace(spec, runs=("d",))
    (row,) = work.rows_at(without, {"runs": {"b": {"method": "b"}}}, 5, DEFAULT_LIMITS)
    assert (row["ended"], "runs: 'd' is not allowed" in row["what"]) == (INVALID, True)


def test_code_of_others_is_not_imported(spec: Spec) -> None:
    own = replace(spec, fixed={"intervention.policies": [{"name": "no_such_module:Policy"}]})
    (row,) = work.rows_of(own, 0, DEFAULT_LIMITS)
    assert (row["ended"], "third-party code" in row["what"]) == (INVALID, True)


def test_a_run_that_stops_is_a_row(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object) -> None:
        raise SimulationError("d", 1.5, "t0 < ti")

    monkeypatch.setattr(work, "simulate", stop)
    rows = work.rows_of(spec, 5, DEFAULT_LIMITS)
    assert [row["ended"] for row in rows] == [STOPPED] * len(spec.draw(5).runs)
    assert "t0 < ti" in rows[0]["what"]


SLOW = """
    class Route:
        def solve(self, problem, budget):
            while True:
                pass
"""


def test_a_draw_that_never_ends_is_stopped(spec: Spec, tmp_path: Path) -> None:
    """By third-party code that is found beside the spec."""
    (tmp_path / "slow.py").write_text(dedent(SLOW), encoding="utf-8")
    changes = {
        "gatekeeper.route": "slow.py:Route",
        "runs": {"c": {"method": "c"}},
        "decision.threshold.zeta_m": 0.5,
        "decision.release_m": 0.2,
    }
    hangs = replace(spec, fixed=changes)
    (row,) = work.rows_of(hangs, 0, Limits(time=0.5, plugins=True))
    assert (row["ended"], row["what"]) == (STOPPED, "not done after 0.5 s")
    assert work.trace_of(hangs, hangs.draw(0), Limits(time=0.5, plugins=True)) is None


IDLE = """
    class Policy:
        def propose(self, seen):
            return None
"""


def test_what_is_made_small_is_simulated_with_code_beside_the_spec(spec: Spec, tmp_path: Path) -> None:
    (tmp_path / "idle.py").write_text(dedent(IDLE), encoding="utf-8")
    own = replace(spec, fixed={"intervention.policies": [{"name": "idle.py:Policy"}]})
    trace = work.trace_of(own, own.draw(0), Limits(plugins=True))
    assert trace is not None
    assert trace.run == next(iter(own.draw(0).runs))
    assert work.trace_of(own, own.draw(0), DEFAULT_LIMITS) is None
