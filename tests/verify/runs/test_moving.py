"""Claims beside obstacles that move: whose doing it was, which distances are promised, and what was declared."""

from dataclasses import replace

import numpy as np
import pandas as pd
import persons
import pytest
from builders.edits import with_scenario, with_table
from oracles.control_law import retreats
from persons import RADII, D, H
from verify.judging import decided

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify import TRACE_CLAIMS, judge
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.claims.safe_hyp import DECLARED, PASSIVE
from airground_drake.verify.judging import judge_all
from airground_drake.verify.pair_kinds import SHARES, kind_of
from airground_drake.verify.runs import encounters as encounters_module
from airground_drake.verify.runs.control_law import least_speeds
from airground_drake.verify.runs.encounters import steps_of
from airground_drake.verify.runs.pairs import gap_over_time, least_gap, pair_of
from airground_drake.verify.runs.passive import periods_of


def of_person(trace: Trace) -> Array:
    away = trace.position("ugv1") - trace.position("person")
    return np.linalg.norm(away, axis=1) - RADII


def placed(trace: Trace, places: Array) -> Trace:
    def edit(states: pd.DataFrame) -> None:
        for k, axis in enumerate("xyz"):
            states[f"person.{axis}_m"] = places[:, k]

    return with_table(trace, "states", edit)


def test_a_person_who_walks_through_a_robot_is_named_and_the_robot_is_not() -> None:
    trace = persons.run("standing")
    true, own, met = (decided(claim, trace) for claim in ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP"))
    assert true.status == "refuted"
    assert true.counterexample is not None
    assert true.margin == pytest.approx(of_person(trace).min() - D, abs=0.01)
    why = "person came to 0.00 m by its own motion; ugv1 retreated at its limit, 1.00 m/s"
    assert true.counterexample["why"] == why
    assert own.status == met.status == "holds"
    assert own.exercised
    (came,) = true.evidence["encounters"]
    assert (came["first"], came["second"], came["doing"], came["collided"]) == ("ugv1", "person", "other", True)


def test_nobody_retreats_at_a_speed_of_nought() -> None:
    assert [encounters_module._reaction(speed, speed, 1.0) for speed in (0.0049, 0.0051)] == ["stood", "retreated"]


def test_a_robot_that_leaves_its_straight_line_gets_farther_from_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    trace = persons.run("fork")
    straight = steps_of(trace, "ugv1")
    monkeypatch.setattr(encounters_module, "off_m_of", lambda *_: 0.1)
    np.testing.assert_allclose(steps_of(replace(trace), "ugv1"), straight + 0.1, rtol=1e-12)


def test_a_robot_that_has_nowhere_to_retreat_stands_and_the_wall_is_named() -> None:
    trace = persons.run("squeezed")
    true, own = decided("SAFE-TRACE", trace), decided("SAFE-OWN", trace)
    assert true.counterexample is not None
    assert true.counterexample["why"].endswith("ugv1 stood, blocked by back")
    (came,) = true.evidence["encounters"]
    assert own.status == decided("SAFE-HYP", trace).status == "holds"
    assert came["blocked_by"] == ("back",)
    begin, end = came["caught_s"]
    gap = of_person(trace)
    samples = trace.sample_rows
    assert begin == pytest.approx(trace.t[samples][np.argmax(gap[samples] < D - 1e-9)])
    assert end == pytest.approx(trace.t[np.argmax(gap <= 0.05)])
    assert least_gap(trace, pair_of(trace, "ugv1", "back")).margin_m > -1e-9


def test_periods_are_counted_by_what_was_promised_in_them() -> None:
    """Of a ball: kept from d + V h on, passive below."""
    for name in ("standing", "squeezed", "on the goal"):
        trace = persons.run(name)
        samples, speed = trace.sample_rows, trace.scenario.barriers["person"].expected_speed_m_s
        gap, commands = of_person(trace)[samples], trace.chosen("ugv1")
        passive = gap < D + speed * H
        rows = decided("SAFE-HYP", trace).evidence["beside_moving"]
        row = next(each for each in rows if each["first"] == "ugv1")
        assert row["periods"] == len(samples)
        assert row["passive_periods"] == passive.sum()
        assert row["kept_periods"] == (~passive).sum()
        assert row["standing_periods"] == (passive & (np.abs(commands).max(axis=1) < 1e-9)).sum()


def test_the_declared_speed_is_part_of_what_a_robot_must_not_do_itself() -> None:
    """Beside one who may walk faster it would have had to stop earlier; a claim that forgets V would not notice."""
    for speed, status in ((1.2, "holds"), (2.4, "refuted")):
        trace = with_scenario(persons.run("on the goal"), obstacles__person__max_speed_m_s=speed)
        assert decided("SAFE-OWN", trace).status == status
        missed = periods_of(trace, pair_of(trace, "ugv1", "person")).missed_m
        assert missed.max() == pytest.approx(0.0 if status == "holds" else 0.6 * H, abs=1e-9)


def test_a_robot_that_follows_at_the_heels_brings_itself_too_near_though_the_distance_stays() -> None:
    """A claim that looked at the body where it has gone to would not notice."""
    trace = persons.run("leaving")
    ahead = trace.position("ugv1") + np.array([RADII + D + 0.01, 0.0, 0.0])
    chased = placed(with_scenario(trace, obstacles__person__disappears_s=0.0), ahead)
    assert decided("SAFE-TRACE", chased).status == "holds"
    own = decided("SAFE-OWN", chased)
    assert own.status == "refuted"
    fastest = np.abs(chased.chosen("ugv1")).max()
    assert own.margin == pytest.approx(-fastest * H, rel=1e-6)
    found = decided("SAFE-HYP", chased)
    assert found.status == "refuted"
    assert PASSIVE in str(found.counterexample)


def test_a_person_is_judged_only_while_there() -> None:
    """The robot passes where the person stood; had it stayed, the robot would have run it over."""
    trace = persons.run("leaving")
    for claim in ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP"):
        assert decided(claim, trace).status == "holds", claim
    gap, gone = gap_over_time(trace, pair_of(trace, "ugv1", "person")), trace.t > 6.0 + 1e-9
    assert np.isnan(gap[gone]).all()
    np.testing.assert_allclose(gap[~gone], of_person(trace)[~gone], atol=1e-12)
    assert least_gap(trace, pair_of(trace, "ugv1", "person")).gap_m == pytest.approx(of_person(trace)[~gone].min())
    stays = with_scenario(trace, obstacles__person__disappears_s=0.0)
    assert decided("SAFE-TRACE", stays).status == decided("SAFE-OWN", stays).status == "refuted"


def test_a_person_faster_than_declared_is_told_with_its_speed() -> None:
    trace = persons.run("too fast", "d")
    found = decided("SAFE-HYP", trace)
    assert found.status == "refuted"
    assert found.counterexample is not None
    assert found.counterexample["hypothesis"] == DECLARED
    assert found.counterexample["also_broken"] == []
    assert found.counterexample["why"] == "person moved at 1.18 m/s at 0.00 s, declared 0.60"
    assert decided("SAFE-OWN", trace).status == decided("SAFE-TRACE", trace).status == "holds"
    row = found.evidence["beside_moving"][0]
    still = np.diff(trace.position("person")[trace.sample_rows], axis=0).any(axis=1)
    assert row["kept_periods"] == len(trace.sample_rows) - still.sum()


def test_gaps_from_a_polygon_that_moves_are_those_of_many_points_at_many_times() -> None:
    trace = persons.run("fork")
    pair = pair_of(trace, "ugv1", "fork")
    shares = np.linspace(0.0, 1.0, 41)[:, None, None]
    own, origin = (p[:-1] + shares * np.diff(p, axis=0) for p in (trace.position("ugv1"), trace.position("fork")))
    beyond = np.abs((own - origin)[..., :2]) - [0.5, 1.0]
    apart = np.hypot(*np.maximum(beyond, 0.0).transpose(2, 0, 1)) + np.minimum(beyond.max(axis=2), 0.0) - 0.2
    least = least_gap(trace, pair)
    assert apart.min() - 1e-3 <= least.gap_m <= apart.min() + 1e-12
    np.testing.assert_allclose(gap_over_time(trace, pair)[:-1], apart[0], atol=1e-9)
    assert decided("SAFE-OWN", trace).status == "holds"


def test_the_law_beside_what_may_move_never_asks_for_speed_away_and_retreats_as_a_task() -> None:
    control = persons.scenario("standing").control
    distance, safe, share = np.array([0.2, 0.7, 0.76, 0.8, 9.0]), np.full(5, 0.7), np.ones(5)
    bound = least_speeds(distance, safe, share, control, 1.2)
    np.testing.assert_allclose(bound, [0.0, 0.0, 0.0, -0.8, -np.inf], atol=1e-9)
    assert least_speeds(distance, safe, share, control)[0] > 0.0
    asked = retreats(distance, safe, np.full(5, 1.2), H)
    np.testing.assert_allclose(asked, [11.2, 1.2, 0.0, 0.0, 0.0], atol=1e-9)
    assert not retreats(distance, safe, np.zeros(5), H).any()


def test_no_claim_about_own_doing_without_anything_that_may_move() -> None:
    trace = persons.run("standing")
    scenario = {**trace.meta["scenario"], "obstacles": {"rock": trace.meta["scenario"]["obstacles"]["person"] | {
        "moves": None, "position_m": [5.0, 5.0, 0.0]}}}  # fmt: skip
    alone = replace(trace, meta=trace.meta | {"scenario": scenario})
    assert "SAFE-OWN" in [each.claim.id for each in judge(trace)]
    assert "SAFE-OWN" not in [each.claim.id for each in judge(alone)]
    assert len(judge(alone)) == len([each for each in TRACE_CLAIMS if each.applies(alone)])


def test_theorems_are_about_bodies_at_rest_and_robots() -> None:
    """A person is in no table of theorems, and in the constants of no theorem."""
    scenario = persons.scenario("two kinds")
    kinds = {other: kind_of(scenario, "ugv1", other) for other in ("person", "post", "uav")}
    assert kinds == {"person": "moving", "post": "obstacle", "uav": "uav_ugv"}
    assert kinds["person"] not in SHARES
    verdicts = judge_all(scenario, [persons.run("two kinds", "d")])
    for each in verdicts:
        if isinstance(each.claim, ModelClaim) and "pairs" in each.inputs:
            distances = {pair["distance_m"] for pair in each.inputs["pairs"] if pair["kind"] == "obstacle"}
            assert distances <= {D, D + 0.2}, each.claim.id
            assert each.status == "proved"


def test_safe_dist_counts_retreats_at_the_disturbance_and_at_that_and_the_persons_speed() -> None:
    trace = persons.run("squeezed")
    (found,) = judge_all(trace.scenario, [trace], claims=["SAFE-DIST"])
    gap, normal = of_person(trace)[trace.sample_rows], trace.position("ugv1") - trace.position("person")
    normal = (normal / np.linalg.norm(normal, axis=1)[:, None])[trace.sample_rows]
    away = (normal * trace.chosen("ugv1")).sum(axis=1)[gap < D + H]
    w = found.inputs["disturbance_m_s"]
    counts = (
        found.evidence["passive_periods"],
        found.evidence["passive_periods_w_h_once"],
        found.evidence["passive_periods_kept"],
    )
    assert counts == (len(away), (away >= w).sum(), (away >= w + 1.0).sum())
    assert 0 < counts[1] < counts[0]
