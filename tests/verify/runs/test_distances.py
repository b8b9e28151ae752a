"""SAFE-TRACE and SAFE-HYP: distances between rows, of every pair, and what follows from a shortfall."""

from itertools import product

import numpy as np
import pytest
from builders.edits import moved, with_scenario
from builders.runs import beside_a_rock, passing_by, run_of
from builders.scenarios import case_a
from builders.simulation import simulate
from builders.worlds import among_points
from verify.judging import decided

from airground_drake.base.arrays import Array
from airground_drake.model.law.avoidance import Avoidance


@pytest.mark.parametrize(
    ("offset", "status"), [(-1e-6, "refuted"), (-2e-9, "refuted"), (-5e-10, "holds"), (1e-6, "holds")]
)
def test_a_dip_between_two_rows_is_seen(offset: float, status: str) -> None:
    trace = passing_by(offset)
    assert np.linalg.norm(trace.position("ugv1"), axis=1).min() > 2.0  # no row shows it
    finding = decided("SAFE-TRACE", trace)
    assert finding.status == status
    assert finding.margin == pytest.approx(offset, abs=1e-12)
    assert finding.where["t_s"] == pytest.approx(0.5125, abs=1e-9)
    if finding.counterexample:
        place = finding.counterexample["positions_m"]["ugv1"]
        np.testing.assert_allclose(place, [0.0, 2.0 + offset, 0.0], atol=1e-9)


def test_every_pair_is_listed_with_its_distance_and_seen() -> None:
    trace = run_of("d")
    pairs = decided("SAFE-TRACE", trace).evidence["pairs"]
    robots = {("ugv1", "ugv2"): 2.0, ("ugv1", "uav"): 1.0, ("ugv2", "uav"): 1.0}
    wanted = robots | {(r, f"obstacle_{i}"): 2.0 for r in ("ugv1", "ugv2", "uav") for i in (1, 2, 3)}
    assert {(each["first"], each["second"]): each["safe_distance_m"] for each in pairs} == wanted
    row, obstacles = int(np.searchsorted(trace.t, 9.0)), trace.scenario.obstacles
    for (robot, other), distance in wanted.items():
        there = np.array(obstacles[other].position_m) if other in obstacles else trace.position(other)[row]
        offset = there + np.array([0.0, 0.0, distance - 1e-6]) - trace.position(robot)[row]
        assert decided("SAFE-TRACE", moved(trace, robot, row, offset.tolist())).status == "refuted", (robot, other)


def test_what_the_uav_knows_does_not_matter() -> None:
    assert decided("SAFE-TRACE", with_scenario(passing_by(-1e-6), obstacles__o__known_to_uav=False)).status == "refuted"


@pytest.mark.parametrize("seed", range(4))
def test_what_is_missed_is_what_the_controllers_inequalities_lack(seed: int) -> None:
    """Robots move at random inside safe distances: `nsbc` and the exact check agree for every pair."""
    rng, h = np.random.default_rng(seed), 0.025
    start = rng.uniform([-0.5, 2.0, 0.0], [3.0, 6.0, 0.0], (3, 3))
    start[2, 2] = 1.5
    starts = {f"{name}.start_m": s.tolist() for name, s in zip(("ugvs.ugv1", "ugvs.ugv2", "uav"), start, strict=True)}
    velocity = rng.normal(0.0, 1.5, (20, 3, 3)) * [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    trace = simulate(case_a(starts | {"duration_s": 0.5}), drive=lambda t: velocity[round(t / h)].tolist())
    found = {(entry["first"], entry["second"]): entry for entry in decided("SAFE-HYP", trace).evidence["pairs"]}
    avoidance = Avoidance(gain=3.0, period=h, sensing_range=100.0)
    ticks = np.flatnonzero(np.abs(trace.t / h - np.round(trace.t / h)) < 1e-6)
    still = {name: np.array([o.position_m] * len(ticks)) for name, o in trace.scenario.obstacles.items()}
    place = {name: trace.position(name)[ticks] for name in trace.robots} | still
    step = {name: np.diff(each, axis=0) for name, each in place.items()}

    def lack(robot: str, other: str, safe: float, share: float) -> Array:
        column = np.ones((len(ticks) - 1, 1))
        mobility = np.tile([1.0, 1.0, float(robot == "uav")], (len(ticks) - 1, 1))
        beside = place[robot][:-1], place[other][:-1, None]
        spaces = avoidance.half_spaces(*among_points(*beside, safe * column, share * column, mobility))
        return np.maximum(-h * spaces.slack(step[robot] / h)[:, 0], 0.0)

    compared = 0
    for first, second in product(trace.robots, place):
        if first == second or (second in trace.robots[: trace.robots.index(first)]):
            continue
        safe = 2.0 if second in still or "uav" not in (first, second) else 1.0
        both = lack(first, second, safe, 0.5) + lack(second, first, safe, 0.5) if second not in still else None
        missed = lack(first, second, safe, 1.0) if both is None else both
        apart = np.linalg.norm((place[first] - place[second])[:-1], axis=1)
        missed[apart >= safe + sum(np.linalg.norm(step[name], axis=1) for name in (first, second))] = 0.0
        entry = found.get((first, second), {"e_m": 0.0, "guarantee_m": safe})
        assert entry["e_m"] == pytest.approx(missed.max(), abs=1e-12)
        starts_short = max(missed.max() / (3.0 * h), safe - apart[0], 0.0)
        assert entry["guarantee_m"] == pytest.approx(safe - starts_short, abs=1e-10)
        compared += missed.max() > 0.0
    assert compared > 0


def test_hypotheses_may_be_broken_although_the_distance_is_kept() -> None:
    assert decided("SAFE-HYP", passing_by(1e-6)).status == "refuted"
    assert decided("SAFE-TRACE", passing_by(1e-6)).status == "holds"


def test_a_shortfall_costs_what_the_theorem_says() -> None:
    finding = decided("SAFE-HYP", beside_a_rock(0.015))  # A h = 0.075
    (pair,) = finding.evidence["pairs"]
    assert (pair["first"], pair["second"], pair["t_s"]) == ("ugv1", "o", pytest.approx(0.175))
    assert (pair["e_m"], pair["guarantee_m"]) == (pytest.approx(0.015, abs=1e-15), pytest.approx(1.8, abs=1e-12))
    assert finding.margin == pytest.approx(-0.2, abs=1e-12)
    kept = decided("SAFE-HYP", beside_a_rock())
    assert (kept.status, kept.margin, kept.evidence["e_m"], kept.evidence["guarantee_m"]) == ("holds", 0.0, 0.0, 2.0)


def test_without_a_gain_all_samples_count() -> None:
    trace = with_scenario(beside_a_rock(2.0**-10), control__avoidance_gain_1_s=0.0)
    (pair,) = decided("SAFE-HYP", trace).evidence["pairs"]
    assert pair["guarantee_m"] == pytest.approx(2.0 - round(3.0 / 0.025) * 2.0**-10, abs=1e-12)
