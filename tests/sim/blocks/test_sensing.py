"""Errors of measured positions: robots act on what they see, claims are about what is true, and the law pays for it."""

from fractions import Fraction
from functools import cache
from typing import Any

import maps
import numpy as np
import pytest
from builders.edits import with_cells
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from sim.blocks.both_programs import broken_rules, checked, found

from airground_drake.base.errors import PluginError
from airground_drake.check import safety
from airground_drake.model.bodies.world import Body
from airground_drake.model.law import kernels
from airground_drake.model.plants.budget import Bounds, costs, kept_distance, law_distance, least_gain, of_views
from airground_drake.report.possible import impossible
from airground_drake.scenario.budget import budget
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.schema import ERRORS, Scenario
from airground_drake.scenario.sensing import errors_of
from airground_drake.scenario.world import make_world
from airground_drake.sim.diagram import make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge, judge_model
from airground_drake.verify.claims.safe_hyp import guarantees
from airground_drake.verify.runs.pairs import pair_of

ERROR_M = 0.05


PERSON = {"radius_m": 0.25, "max_speed_m_s": 1.0, "moves": {
    "waypoints_m": [[2.0, -3.0], [-0.5, 1.0], [2.0, 3.0]], "speed_m_s": 0.9, "at_end": "reverse"}}  # fmt: skip


def crossing(others: Any = (), **sensing: Any) -> Scenario:
    data = {
        "name": "crossing_of_two", "duration_s": 12.0,
        "ugvs": {
            "ugv1": maps.straight((-5.0, 0.0), (5.0, 0.0), 1.0, max_speed_m_s=2.0),
            "ugv2": maps.straight((0.0, -5.0), (0.0, 5.0), 1.0, max_speed_m_s=2.0),
        },
        "uav": {"start_m": [-2.5, -2.5, 2.0]},
        "obstacles": {"rock": {"position_m": [2.5, 0.3, 0.0], "radius_m": 0.3}, **dict(others)},
        "safe_distance": {"obstacle_m": 0.6, "ugv_m": 0.6},
        "control": {"period_s": 0.05, "avoidance_gain_1_s": 8.0},
        "decision": {"threshold": {"zeta_m": 1.2}, "release_m": 0.8, "noise_period_s": 0.05},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "runs": {"a": {"method": "a"}, "d": {"method": "d"}},
        **({"sensing": {"position_error_m": ERROR_M, **sensing}} if sensing else {}),
    }  # fmt: skip
    return from_data(data, "test")


@cache
def run(errors: str, method: str = "d") -> Trace:
    return simulate(crossing(errors=errors, uav_error_m=0.03), method)


@pytest.mark.parametrize("errors", ERRORS)
def test_distances_are_kept_and_the_theorem_covers_the_run(errors: str) -> None:
    trace = run(errors)
    verdicts = {verdict.claim.id: verdict for verdict in judge(trace)}
    assert verdicts["SAFE-HYP"].exercised
    assert {verdicts[claim].status for claim in ("SAFE-TRACE", "SAFE-HYP", "LIVE-HYP", "GATE-PLAN")} == {"holds"}
    ours = safety.safe_hyp(checked(trace))
    assert ours.status == "holds"
    assert ours.margin == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("errors", ERRORS)
def test_what_robots_act_on_is_recorded_within_its_bound(errors: str) -> None:
    trace = run(errors)
    true = np.stack([trace.position(name)[trace.sample_rows] for name in trace.robots], axis=1)
    for robot, i in zip(trace.robots, range(len(trace.robots)), strict=True):
        seen = trace.as_seen("ugv1", robot)
        off = np.linalg.norm(seen - true[:, i], axis=1)
        assert off.max() <= ERROR_M
        assert off.max() > 0.9 * ERROR_M if errors != "drawn" else off.max() > 0.4 * ERROR_M
    assert [*impossible(trace, trace.scenario)] == []  # the same again: an error depends on nothing else
    for k in (0, 7, 61):
        saw = np.array([[trace.sampled(f"{ugv}.uav_saw_{axis}_m")[k] for axis in "xyz"] for ugv in trace.ugvs])
        assert 0.0 < np.linalg.norm(saw - true[k, :2], axis=1).max() <= 0.03


def test_of_what_is_as_near_but_for_rounding_the_first_counts() -> None:
    scenario = crossing({"twin": {"position_m": [2.5, 4.3, 0.0], "radius_m": 0.3}}, errors="away")
    errors, places = (
        errors_of(scenario, make_world(scenario)),
        np.array([[2.5, 2.3 + 1e-11, 0.0], [-9.0] * 3, [9.0] * 3]),
    )
    assert errors is not None
    assert errors.published(0.0, places)[0, 1] > 2.3 + 0.9 * ERROR_M  # away from the rock, not from its nearer twin


def test_an_adversary_changes_its_mind_at_the_sample_whatever_its_rounding() -> None:
    scenario = crossing(errors="adversarial")
    errors, places = (
        errors_of(scenario, make_world(scenario)),
        np.array([[-5.0, 0.0, 0.0], [0.0, -5.0, 0.0], [9.0] * 3]),
    )
    assert errors is not None
    for turn in 0.5 * np.arange(1.0, 9.0):
        assert np.array_equal(errors.published(np.nextafter(turn, 0.0), places), errors.published(turn, places))


def test_robots_that_measure_each_other_pay_for_different_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, claims = crossing(errors="adversarial", shared=False, seed=5), ("SAFE-TRACE", "SAFE-HYP")
    trace = simulate(scenario, "a")
    assert not np.array_equal(trace.as_seen("ugv1", "ugv2"), trace.as_seen("ugv2", "ugv2"))
    assert found(trace, *claims) == dict.fromkeys(claims, "holds")
    assert safety.safe_hyp(checked(trace)).status == "holds"
    assert [*impossible(trace, scenario)] == []
    assert not trace.as_seen("uav", "ugv1")[:, 2].any()
    pair = pair_of(trace, "ugv1", "ugv2")
    missed = max(kept.missed_m.max() for kept in guarantees(trace) if kept.pair == pair)
    assert 0.0 < missed < 0.002  # by the better view of each sample; either view alone misses more than 0.007 m
    ours = checked(trace)
    (law,) = (of.in_the_law for of in ours.pairs if {of.robot, of.other} == {"ugv1", "ugv2"})
    assert law.safe_m == pytest.approx(pair.law_m, abs=1e-12)
    rows = ours.period_rows(law.other)
    lacks = safety.measured_shortfall_m(ours, law, rows, Fraction(0.5 * 8.0 * 0.05), Fraction(1))
    assert float(lacks) == pytest.approx(missed, rel=1e-6)
    off = trace.position("ugv2")[trace.sample_rows[40], 0] + ERROR_M + 1e-6
    forged = with_cells(trace, "samples", 40, "uav.saw_ugv2_x_m", off)
    assert broken_rules(forged)[1] == "error of the measured position"
    (verdict,) = judge_model(scenario, claims=["SAFE-BUDGET"])
    assert (verdict.status, "Budget.own_views" in verdict.evidence["theorems"]) == ("proved", True)
    do_not_pay(monkeypatch, own_views=False)
    wrong = simulate(scenario, "a")
    assert safety.safe_hyp(checked(wrong)).status == found(wrong, "SAFE-HYP")["SAFE-HYP"] == "refuted"


def do_not_pay(monkeypatch: pytest.MonkeyPatch, **unpaid: Any) -> None:
    """From now on the law keeps no more than without something, such as errors."""
    right = vars(Body)["bounds"].fget
    monkeypatch.setattr(Body, "bounds", property(lambda self: right(self)._replace(**unpaid)))


def test_a_law_that_does_not_pay_for_errors_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    do_not_pay(monkeypatch, error_m=0.0)
    trace = simulate(crossing(errors="away"), "a")
    assert found(trace, "SAFE-TRACE", "SAFE-HYP") == {"SAFE-TRACE": "refuted", "SAFE-HYP": "refuted"}
    assert safety.safe_hyp(checked(trace)).status == "refuted"


@pytest.mark.parametrize("errors", ["away", "sideways"])
def test_beside_a_person_robots_only_go_where_they_surely_get_no_nearer(
    errors: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, claims = crossing({"person": PERSON}.items(), errors=errors), ("SAFE-OWN", "SAFE-HYP")
    trace = simulate(scenario, "a")  # sideways, one step meets the passive law only as measured
    verdicts = {verdict.claim.id: verdict for verdict in judge(trace)}
    assert {verdicts[claim].status for claim in claims} == {"holds"}
    rows = verdicts["SAFE-HYP"].evidence["beside_moving"]
    assert sum(row["kept_periods"] for row in rows) > 20 or errors == "away"
    assert sum(row["passive_periods"] for row in rows) > 5 or errors == "sideways"
    for ours in (safety.safe_own(checked(trace)), safety.safe_hyp(checked(trace))):
        assert getattr(ours, "status", "") == "holds"
    assert [*impossible(trace, scenario)] == []
    do_not_pay(monkeypatch, error_m=0.0)
    wrong = simulate(scenario, "a")
    assert safety.safe_hyp(checked(wrong)).status == found(wrong, "SAFE-HYP")["SAFE-HYP"] == "refuted"


def test_measured_positions_beyond_their_bound_are_found() -> None:
    trace = run("away")
    off = trace.position("ugv1")[trace.sample_rows[40], 0] + ERROR_M + 1e-6
    assert broken_rules(with_cells(trace, "samples", 40, "ugv1.seen_x_m", off))[1] == "error of the measured position"


def test_the_model_says_what_the_budget_needs() -> None:
    scenario = crossing(errors="away")
    (verdict,) = judge_model(scenario, claims=["SAFE-BUDGET"])
    assert verdict.status == "proved"
    assert "Budget.one_stands" in verdict.evidence["theorems"]
    terms = {pair.kind: (pair.gap_m - pair.promised_m, [term.key for term in pair.terms]) for pair in budget(scenario)}
    assert terms["ugv"] == (pytest.approx(0.1083, abs=5e-5), ["position_error_m"])
    assert terms["obstacle"] == (pytest.approx(0.0514, abs=5e-5), ["position_error_m"])


def test_without_the_key_nothing_is_written_of_it_and_the_loop_makes_the_run() -> None:
    assert "sensing" not in resolved(load("minimal"))
    measured = crossing(errors="drawn")
    drake, loop = (simulate(measured, "a", engine=engine) for engine in ("drake", "batch"))  # Drake makes both
    assert drake.samples.equals(loop.samples)
    with pytest.raises(PluginError, match="a monitor sees true positions"):
        make_monitor(measured)


@pytest.mark.parametrize(
    ("y", "bound", "limit", "velocity"),
    [(0.0, -0.1, np.inf, [0.1, 0.5]), (0.0, 0.1, np.inf, []), (0.1, 0.1, 1.1, [0.0, 1.0]), (0.1, 0.1, 0.9, [])],
)
def test_a_robot_stands_where_inequalities_contradict_each_other_or_ask_for_more_than_its_speed_limit(
    y: float, bound: float, limit: float, velocity: list[float]
) -> None:
    """Both ask for 0.1 m/s to opposite sides, which y = 0.1 allows from 1 m/s along y on; [] stands for standing."""
    wish, normal = np.array([0.5, 0.5, 0.0]), np.array([[1.0, y, 0.0], [-1.0, y, 0.0]])
    found = kernels.avoid_one(wish, normal, np.full(2, bound), kernels.STANDING, limit)
    assert found[:2].tolist() == pytest.approx(velocity) if velocity else not found.any()


def any_bounds() -> st.SearchStrategy[Bounds]:
    numbers = st.tuples(*[st.floats(0.0, 0.3)] * 4, st.floats(0.5, 2.0), st.floats(0.001, 0.3), st.booleans())
    return numbers.map(lambda given: Bounds(*given[:4], speed_m_s=given[4], error_m=given[5], own_views=given[6]))


@examples(60)
@given(st.floats(0.1, 3.0), any_bounds(), any_bounds() | st.just(Bounds()))
def test_the_law_keeps_what_the_theorem_asks_for(distance: float, one: Bounds, other: Bounds) -> None:
    """d_law >= err + loss / A' + sqrt(m^2 + err^2), with what the bodies take before errors; and back again."""
    # With views of their own, 2 V err / (sqrt(m^2 + err^2) - err) is part of the loss.
    gain, part = 5.0, 1.0 if other == Bounds() else 0.5
    law = float(law_distance(distance, one, other, gain=gain))
    error, loss = one.error_m + other.error_m, one.drift_m_s + other.drift_m_s
    without = [bounds._replace(error_m=0.0, drift_m_s=0.0, own_views=False) for bounds in (one, other)]
    before = float(law_distance(distance, *without, gain=gain))
    if one.own_views and other.own_views:
        loss += 2.0 * max(one.speed_m_s, other.speed_m_s) * error / (np.hypot(before, error) - error)
    assert law == pytest.approx(error + loss / (gain * part) + np.hypot(before, error), rel=1e-12)
    points = law - float(of_views(distance, one, other, gain=gain))
    assert distance * (1.0 - 1e-9) <= kept_distance(points, one, other, gain=gain) + 1e-9 <= distance + 2e-9
    total = distance + sum(cost.metres for cost in costs(distance, one, other, gain=gain))
    assert total == pytest.approx(law, rel=1e-12)
    least = least_gain(distance, one, other)
    kept = law - error - loss / (gain * part)
    assert error * (1.0 - part * least) == pytest.approx(part * least * kept, rel=1e-9)


def orbited(error: float, gain_share: float, distance: float = 0.6, period: float = 0.05) -> float:
    """The least distance, m, at which a robot goes round a point that it always sees the worst way: abreast of it."""
    share = gain_share * least_gain(distance, Bounds(error_m=error))
    law = float(law_distance(distance, Bounds(error_m=error), gain=share / period))
    place, nearest = np.array([law, 0.0, 0.0]), law
    for _ in range(200):
        apart = float(np.linalg.norm(place))
        if apart <= error:
            return 0.0
        seen, turn = np.sqrt(apart**2 - error**2), np.arctan2(place[1], place[0]) + np.arcsin(error / apart)
        normal = np.array([[np.cos(turn), np.sin(turn), 0.0]])
        bound = share / period * (law - seen) if seen <= law else -(law - seen) / period
        wish = error / period * np.array([-normal[0, 1], normal[0, 0], 0.0])
        step = period * kernels.avoid_one(wish, normal, np.array([bound]), kernels.STANDING, np.inf)
        along = float(np.clip(-(place @ step) / max(step @ step, 1e-12), 0.0, 1.0))
        nearest = min(nearest, float(np.linalg.norm(place + along * step)))
        place = place + step
    return nearest


@pytest.mark.parametrize("error", [0.02, 0.05, 0.25])
def test_the_condition_on_the_gain_is_needed(error: float) -> None:
    """Directions that are wrong in each period add up, unless the gain makes up for them."""
    assert orbited(error, 1.0) >= 0.6
    assert orbited(error, 0.2) < 0.6 - 0.1 * error


def circled(angle: float, *, own_views: bool, error: float = 0.08, distance: float = 0.6) -> float:
    """The least distance, m, of two robots that circle each other, each as fast as it may along what it sees."""
    gain, speed, period = 6.0, 1.0, 0.05
    body = Bounds(error_m=0.5 * error, speed_m_s=speed, own_views=own_views)
    law = float(law_distance(distance, body, body, gain=gain))
    apart, nearest = np.array([law, 0.0]), law
    turned = np.array([[0.0, -1.0], [1.0, 0.0]])
    for _ in range(400):
        away = apart / np.linalg.norm(apart)
        step = np.zeros(2)
        for side in (1.0, -1.0):  # both see the pair farther apart, each turned to its side
            seen = apart + error * (np.cos(angle) * away + side * np.sin(angle) * (turned @ away))
            length = float(np.linalg.norm(seen))
            normal, lacks = seen / length, law - length
            rate = 0.5 * (gain * lacks if lacks >= 0.0 else lacks / period)
            step += period * (rate * normal + side * np.sqrt(max(speed**2 - rate**2, 0.0)) * (turned @ normal))
        share = float(np.clip(-(apart @ step) / max(step @ step, 1e-12), 0.0, 1.0))
        nearest = min(nearest, float(np.linalg.norm(apart + share * step)))
        apart = apart + step
    return nearest


def test_different_directions_cost_distance() -> None:
    angles = np.linspace(0.1, 1.5, 8)
    assert min(circled(angle, own_views=True) for angle in angles) >= 0.6
    assert min(circled(angle, own_views=False) for angle in angles) < 0.597
