"""The rows of one draw, whatever becomes of it."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from airground_drake.base.arrays import Array
from airground_drake.base.errors import SimulationError
from airground_drake.scenario.estimate import DEFAULT_LIMITS, Limits
from airground_drake.sim.batch import loop
from airground_drake.sim.batch.loop import Team
from airground_drake.sim.batch.run import Going
from airground_drake.sim.blocks.controllers import UavController
from airground_drake.study.campaign import work
from airground_drake.study.campaign.rows import BATCH, BOTH, CLOCK, COLUMNS, DRAKE, INVALID, JUDGED, SCREENED, STOPPED
from airground_drake.study.campaign.spec import Spec, load_spec
from airground_drake.uav.database import Asked
from airground_drake.verify import Verdict, array_judges
from airground_drake.verify.finding import Finding

CASE_A = Path(__file__).parents[3] / "benchmarks" / "campaigns" / "case_a.yaml"
TEXT = """
scenario: minimal
set: {duration_s: 2.0}
draw: {seed: {integer: [0, 1000]}}
claims: [SAFE-TRACE, ZENO-TRACE]
"""
SLOW = """
class Route:
    def solve(self, problem, budget):
        while True:
            pass
"""
IDLE = """
from airground_drake.uav import policy

class Policy(policy.Policy):
    def propose(self, seen):
        return None
"""


@pytest.fixture
def spec(tmp_path: Path) -> Spec:
    for name, text in (("mine.yaml", TEXT), ("slow.py", SLOW), ("idle.py", IDLE)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return load_spec(tmp_path / "mine.yaml")


@pytest.mark.parametrize(("more", "first"), [
    ("sensing: {position_error_m: 0.02}, faults: {}", ""),
    ("sensing: {position_error_m: 0.02}, faults: {position_error_m: 0.02}", "error of the measured position, ugv1 at "),
    ("channel.ugvs.delay_s: 0.02, faults: {}", ""),
    ("channel.ugvs.delay_s: 0.02, faults: {late: 0.2}", "announced position, ugv1 at "),
])  # fmt: skip
def test_a_row_says_which_hypothesis_broke_first(more: str, first: str, tmp_path: Path) -> None:
    text = TEXT.replace("duration_s: 2.0", f"duration_s: 4.0, control.avoidance_gain_1_s: 10.0, {more}")
    (tmp_path / "mine.yaml").write_text(text.replace("ZENO-TRACE", "SAFE-HYP"), encoding="utf-8")
    of = {row["claim"]: row for row in work.rows_of(load_spec(tmp_path / "mine.yaml"), 5, DEFAULT_LIMITS)}
    assert of["SAFE-TRACE"]["what"] == ""
    assert first or of["SAFE-TRACE"]["status"] == "holds"
    assert of["SAFE-HYP"]["status"] == ("refuted" if first else "holds")
    assert of["SAFE-HYP"]["what"].startswith(first)
    assert of["SAFE-HYP"]["what"].endswith(" s") == bool(first)


def test_a_row_for_each_run_and_claim(spec: Spec) -> None:
    rows = work.rows_of(spec, 5, DEFAULT_LIMITS)
    assert {row["claim"] for row in rows} == {"SAFE-TRACE", "ZENO-TRACE"}
    for row in rows:
        assert row.keys() == COLUMNS.keys()
        assert (row["ended"], row["index"], row["status"]) == (JUDGED, 5, "holds")
        assert (json.loads(row["drawn"]), row["wall_s"] > 0.0) == (spec.values(5), True)
    safe = next(row for row in rows if row["claim"] == "SAFE-TRACE")
    assert safe["margin"] >= 0.0
    assert math.isnan(safe["first_trigger_s"])


def test_a_gap_to_an_optimum_is_no_margin_and_what_is_declared_not_to_be_judged_has_no_row(
    spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    plans, following = work.run_claims(["GATE-PLAN", "LIVE-HYP"])
    given = [(plans, "holds", "holds"), (following, "not_run", "not_run"), (following, "not_run", "holds")]
    verdicts = [Verdict.of(claim, "a", Finding(status, margin=0.5), expected) for claim, status, expected in given]
    monkeypatch.setattr(work, "_judged", lambda *_: work._Judged(verdicts, {}, DRAKE))
    rows = work.rows_of(replace(spec, runs=("a",)), 0, DEFAULT_LIMITS)
    assert [(row["claim"], row["as_expected"]) for row in rows] == [("GATE-PLAN", True), ("LIVE-HYP", False)]
    assert [row["margin"] for row in rows] == pytest.approx([math.nan, 0.5], nan_ok=True)


@pytest.mark.parametrize(
    ("changes", "values", "limits", "what"),
    [
        ({"fixed": {"duration_s": -1.0}}, {}, DEFAULT_LIMITS, "duration_s"),
        ({}, {}, Limits(work=1.0), "asks for"),
        ({}, {"decision.noise_m_sqrt_s": float("nan")}, DEFAULT_LIMITS, "decision.noise_m_sqrt_s"),
        ({"runs": ("d",)}, {"runs": {"b": {"method": "b"}}}, DEFAULT_LIMITS, "runs: 'd' is not allowed"),
        ({"fixed": {"intervention.policies": [{"name": "idle.py:Policy"}]}}, {}, DEFAULT_LIMITS, "third-party code"),
    ],
)
def test_a_draw_without_a_usable_scenario_is_invalid(
    changes: dict[str, Any], values: dict[str, Any], limits: Limits, what: str, spec: Spec
) -> None:
    (row,) = work.rows_at(replace(spec, **changes), values, 5, limits)
    assert (row["ended"], row["claim"], what in row["what"]) == (INVALID, "", True)
    assert "NaN" not in row["drawn"]


def test_a_run_that_stops_is_a_row(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object) -> None:
        raise SimulationError("d", 1.5, "t0 < ti")

    monkeypatch.setattr(work, "simulate", stop)
    rows = work.rows_of(spec, 5, DEFAULT_LIMITS, "drake")
    assert [row["ended"] for row in rows] == [STOPPED] * len(spec.draw(5).runs)
    assert "t0 < ti" in rows[0]["what"]


def test_a_draw_that_never_ends_is_stopped(spec: Spec) -> None:
    """By third-party code that is found beside the spec."""
    changes = {
        "gatekeeper.route": "slow.py:Route",
        "runs": {"c": {"method": "c"}},
        "decision.threshold.zeta_m": 0.5,
        "decision.release_m": 0.2,
    }
    hangs = replace(spec, fixed=changes)
    (row,) = work.rows_of(hangs, 0, Limits(time=0.5, plugins=True))
    assert (row["ended"], row["what"]) == (STOPPED, "not done after 0.5 s")


def test_a_scenario_that_is_made_small_is_simulated_with_code_beside_the_spec(spec: Spec) -> None:
    own = replace(spec, fixed={"intervention.policies": [{"name": "idle.py:Policy"}]})
    rows = (work.rows_of_scenario(own, own.draw(0), limits) for limits in (Limits(plugins=True), DEFAULT_LIMITS))
    assert [{row["ended"] for row in each} for each in rows] == [{JUDGED}, {INVALID}]


def test_drake_makes_a_share_of_the_loops_runs_again(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = replace(spec, claims=("ZENO-TRACE",))
    monkeypatch.setattr(work, "SHARE", 0.0)
    assert {row["engine"] for row in work.rows_of(quiet, 5, DEFAULT_LIMITS)} == {SCREENED}
    assert {row["engine"] for row in work.rows_of(quiet, 5, DEFAULT_LIMITS, "drake")} == {DRAKE}
    late = replace(quiet, fixed={"ugvs.ugv1.plant": [{"kind": "delay", "delay_s": 0.1}]})
    assert {row["engine"] for row in work.rows_of(late, 5, DEFAULT_LIMITS)} == {BATCH}
    monkeypatch.setattr(work, "SHARE", 1.0)
    assert {row["engine"] for row in work.rows_of(quiet, 5, DEFAULT_LIMITS)} == {BOTH}


def test_drake_makes_what_fails_again(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "SHARE", 0.0)
    for expected, engine in ({}, BOTH), ({"LIVE-GOAL": "refuted"}, SCREENED), ({"LIVE-GOAL": "nothing"}, SCREENED):
        runs = {"a": {"method": "a", "expected": expected}}
        rows = work.rows_of(replace(spec, claims=("LIVE-GOAL",), fixed={"runs": runs}), 5, DEFAULT_LIMITS)
        assert {(row["status"], row["engine"]) for row in rows} == {("refuted", engine)}


def bug_in_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    right = loop.advance

    def wrong(team: Team, *rest: Any) -> int:
        return right(team._replace(uav=team.uav * (1.0 + 2.0**-52)), *rest)

    monkeypatch.setattr(loop, "advance", wrong)


def bug_in_a_leaf_system(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same of the UAV's speed, in Drake's block."""
    right = UavController.velocity

    def wrong(self: UavController, *given: Any) -> Array:
        return right(self, *given) * (1.0 + 2.0**-52)

    monkeypatch.setattr(UavController, "velocity", wrong)


def bug_in_an_array_judge(monkeypatch: pytest.MonkeyPatch) -> None:
    right = array_judges.least_of_pairs
    monkeypatch.setattr(array_judges, "least_of_pairs", lambda *given: right(*given) + 1e-6)


@pytest.mark.parametrize(
    ("plant", "told"),
    [
        (bug_in_the_loop, r"uav.* is .* by Drake and .* by the loop"),
        (bug_in_a_leaf_system, r"uav.* is .* by Drake and .* by the loop"),
        (bug_in_an_array_judge, r"SAFE-TRACE is holds, margin .* by the trace and holds, margin .* by the array judge"),
    ],
)
def test_one_difference_ends_a_campaign(
    plant: Callable[[pytest.MonkeyPatch], None], told: str, spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(work, "SHARE", 1.0)
    plant(monkeypatch)
    with pytest.raises(work.DifferenceError, match=told):
        work.rows_of(spec, 5, DEFAULT_LIMITS)


def test_what_array_judges_cannot_tell_is_judged_by_the_trace(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "SHARE", 0.0)
    assert {row["engine"] for row in work.rows_of(spec, 5, DEFAULT_LIMITS)} == {SCREENED}
    more = replace(spec, claims=(*spec.claims, "SAFE-HYP"))
    assert {row["engine"] for row in work.rows_of(more, 5, DEFAULT_LIMITS)} == {BATCH}
    monkeypatch.setattr(array_judges.ArrayJudges, "findings", lambda *_: {})
    rows = work.rows_of(spec, 5, DEFAULT_LIMITS)
    assert {(row["engine"], row["status"]) for row in rows} == {(BATCH, "holds")}


def test_a_run_in_which_a_policy_met_the_clock_is_listed(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not compared: Drake's run need not have met it."""
    late = Asked(0.0, "ugv1", "detour", what="OutOfTime: not done after 2 s")
    monkeypatch.setattr(Going, "memory", property(lambda self: replace(self._memory, asked=(late,))))
    for share in (0.0, 1.0):
        monkeypatch.setattr(work, "SHARE", share)
        assert {row["engine"] for row in work.rows_of(spec, 5, DEFAULT_LIMITS)} == {CLOCK}


def test_a_screened_row_is_that_of_the_judge_of_traces(monkeypatch: pytest.MonkeyPatch) -> None:
    of_case_a = replace(load_spec(CASE_A), claims=("SAFE-TRACE", "THR-TRIG"), runs=("d",), fixed={"duration_s": 17.0})
    monkeypatch.setattr(work, "SHARE", 0.0)
    screened = work.rows_of(of_case_a, 5, DEFAULT_LIMITS)
    monkeypatch.setattr(work, "SHARE", 1.0)
    compared = work.rows_of(of_case_a, 5, DEFAULT_LIMITS)
    assert [row["engine"] for row in (*screened, *compared)] == [SCREENED] * 2 + [BOTH] * 2
    for ours, theirs in zip(screened, compared, strict=True):
        for name in COLUMNS.keys() - {"engine", "wall_s"}:
            assert ours[name] == pytest.approx(theirs[name], abs=1e-8, nan_ok=True), name
