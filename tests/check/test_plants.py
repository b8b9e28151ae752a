"""The checker on runs with robots that turn, lag, get commands late or are measured: same verdicts, forgeries found."""

from typing import Any

import numpy as np
import pytest
from builders.edits import with_cells, with_scenario
from sim.blocks.both_programs import checked

from airground_drake.check import plants, safety
from airground_drake.check.rules import Disagreement
from airground_drake.check.run import Run, _moves_as_commanded
from airground_drake.check.scenario import pairs_of
from airground_drake.check.shapes import Part
from airground_drake.model.plants.budget import AT_REST, law_distance
from airground_drake.scenario.load import load, resolved, validated
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

FORWARDS = [f"ugvs.{name}.plant.backwards=false" for name in ("burger", "waffle", "tb4")]
CAR = ["ugvs.burger.plant={kind: ackermann, hand_point_m: 0.1, wheelbase_m: 0.1, max_steering_rad: 0.8}"]
MEASURED = ["sensing={position_error_m: 0.02, errors: adversarial}"]
RUNS = (
    ("turtlebots car", 12.0),
    ("turtlebots", 12.0),
    ("lagging", 9.0),
    ("case_a_unicycle", 10.0),
    ("turtlebots forwards", 12.0),
)


def given(name: str) -> Scenario:
    scenario, _, otherwise = name.partition(" ")
    return load(scenario, {"": [], "forwards": FORWARDS, "car": CAR, "measured": MEASURED}[otherwise])


def run_of(name: str, duration_s: float) -> tuple[Trace, Run]:
    trace = simulate(validated(given(name), [f"duration_s={duration_s}"]), "a")
    return trace, checked(trace)


@pytest.mark.parametrize(("name", "duration_s"), [*RUNS, ("swap measured", 8.0)])
def test_the_checker_comes_to_the_same_verdicts(name: str, duration_s: float) -> None:
    trace, run = run_of(name, duration_s)
    for robot in run.robots:
        _moves_as_commanded(run, robot)
    for claim, check in (
        ("SAFE-TRACE", safety.safe_trace),
        ("SAFE-OWN", safety.safe_own),
        ("SAFE-HYP", safety.safe_hyp),
    ):
        ours = check(run)
        theirs = judge(trace, [claim])
        assert bool(theirs) == (ours is not None)
        if theirs and ours is not None:
            assert ours.status == theirs[0].status
            assert (ours.margin is None) == (theirs[0].margin is None) or claim == "SAFE-HYP"
            if ours.margin is not None and theirs[0].margin is not None:
                assert ours.margin == pytest.approx(theirs[0].margin, abs=1e-9)
            if ours.exercised is not None:
                assert ours.exercised[0] <= theirs[0].exercised <= ours.exercised[1]


@pytest.mark.parametrize(
    ("name", "column", "rule"),
    [
        ("turtlebots", "burger.heading_rad", "heading"), ("turtlebots", "tb4.body_x_m", "place"),
        ("lagging", "cart1.body_vx_m_s", "velocity"), ("lagging", "cart2.body_y_m", "place"),
        ("lagging", "uav.body_z_m", "place"),
    ],
)  # fmt: skip
def test_a_forged_body_is_found(name: str, column: str, rule: str) -> None:
    trace, _ = run_of(name, 2.0)
    forged = with_cells(trace, "states", 20, column, lambda value: value + 1e-6)
    with pytest.raises(Disagreement, match=f"{rule} of a body"):
        _moves_as_commanded(checked(forged), column.partition(".")[0])


def test_an_axle_that_begins_too_near_or_rolls_back_is_found() -> None:
    trace, _ = run_of("turtlebots forwards", 2.0)
    place, barrier = ["burger.body_x_m", "burger.body_y_m"], next(iter(trace.scenario.barriers.values()))
    assert refuted_for(with_cells(trace, "states", 0, place, barrier.position_m[:2])) == "safe start of the bodies"
    heading = trace.states["burger.heading_rad"][20]
    back = 0.1 * np.array([np.cos(heading), np.sin(heading)])
    assert refuted_for(with_cells(trace, "states", 20, place, lambda at: at - back)) == "never backwards"


def test_bodies_that_begin_far_apart_are_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    trace, _ = run_of("lagging", 2.0)
    places, signed_m = list[int](), Part.signed_m
    monkeypatch.setattr(Part, "signed_m", lambda part, at_m: places.append(len(at_m)) or signed_m(part, at_m))
    safety._constants(checked(trace))
    assert sum(places) < 100


def test_a_car_that_turns_more_sharply_than_it_can_is_found() -> None:
    trace, _ = run_of("turtlebots car", 2.0)
    turned = with_cells(trace, "states", slice(20, None), "burger.heading_rad", lambda heading: heading + 0.5)
    assert refuted_for(turned) == "least turning radius"


def test_positions_that_are_measured_worse_than_declared_or_with_too_small_a_gain_are_found() -> None:
    trace, _ = run_of("swap measured", 1.0)
    far = with_cells(trace, "samples", 10, f"{trace.ugvs[0]}.seen_x_m", lambda seen: seen + 0.05)
    assert refuted_for(far) == "error of the measured position"
    assert refuted_for(with_scenario(trace, control__avoidance_gain_1_s=0.1)) == "gain for errors"


def refuted_for(trace: Trace) -> str:
    found = safety.safe_hyp(checked(trace))
    assert found.because is not None
    return found.because.rule


def test_what_plants_take_is_the_same_in_both_programs() -> None:
    for name, _ in RUNS:
        scenario = given(name)
        everything: dict[str, Any] = resolved(scenario)
        robots = {**everything["ugvs"], everything["uav"]["name"]: everything["uav"]}
        ours = {each: plants.taken(robots[each], everything["control"]) for each in scenario.robots}
        period, gain = scenario.control.period_s, scenario.control.avoidance_gain_1_s
        theirs = {name: plant_of(of, period).bounds(of.max_speed_m_s) for name, of in scenario.robots.items()}
        for one in scenario.robots:
            for other in (None, *scenario.robots):
                beside = ours[other] if other else None, theirs[other] if other else AT_REST
                for passive in (False, True) if other is None else (False,):
                    found = plants.law_m(1.3, ours[one], beside[0], passive=passive)
                    due = law_distance(1.3, theirs[one], beside[1], gain=gain, passive=passive)
                    assert found == pytest.approx(due, abs=1e-13)


def test_of_two_late_robots_the_bodies_must_be_clear_for_the_longer_delay() -> None:
    data = resolved(load("case_b"))
    for ugv, delay_s in (("ugv1", 0.1), ("ugv2", 0.2)):
        data["ugvs"][ugv]["plant"] = [{"kind": "delay", "delay_s": delay_s}]
    assert {pair.start_s for pair in pairs_of(data) if {pair.robot, pair.other} == {"ugv1", "ugv2"}} == {0.2}


def test_a_way_that_turns_is_divided_along_its_arc() -> None:
    turn, radius = 0.4, 2.0
    ends = np.array([[radius, 0.0, 0.0], [radius * np.cos(turn), radius * np.sin(turn), 0.0]])
    way = plants.Way(np.array([0.0, 1.0]), ends, heading_rad=np.array([0.5 * np.pi, 0.5 * np.pi + turn]))
    assert np.linalg.norm(way.within(0, 50), axis=1) == pytest.approx(np.full(51, radius), abs=1e-12)
    assert way.bent_m() == pytest.approx(radius * (1.0 - np.cos(0.5 * turn)), abs=1e-12)
