"""A car: it turns at a least radius, never backwards, and its body keeps the distances."""

import math

import numpy as np
from builders.worlds import beside_a_wall
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.check import safety
from airground_drake.check.run import Run, _moves_as_commanded
from airground_drake.model.plants.ackermann import Ackermann
from airground_drake.model.plants.steering import chord, steer
from airground_drake.scenario.load import load, resolved
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge, judge_model

H = 0.05
CAR = "{kind: ackermann, hand_point_m: 0.3, wheelbase_m: 0.3, max_steering_rad: 0.6}"


def passing(*more: str) -> Trace:
    given_ = [f"ugvs.ugv1.plant={CAR}", "ugvs.ugv1.max_speed_m_s=1.4", "uav.altitude_m=3", "uav.start_m=[0, 0, 3]"]
    given_ += ["uav.target_m=[10, 0, 3]", "obstacles.rock.position_m=[5.0, 1.9, 0.0]", "duration_s=15.0", *more]
    return simulate(load("minimal", given_), "d")


@examples(100)
@given(st.integers(0, 10**6), st.floats(0.1, 0.5), st.floats(0.1, 3.0), st.booleans())
def test_every_command_is_one_that_its_wheels_can_follow(seed: int, hand: float, radius: float, near: bool) -> None:
    """Under the law, beside a wall or not, whatever the task asks for: |omega| R <= v, at any speed down to 0."""
    plant = Ackermann(hand, H, backwards=False, radius_m=radius)
    command, wish, heading, _ = beside_a_wall(seed, plant, near)
    wished = command.copy()
    assert steer(command, heading, plant.steering, H)[0] == 1.0  # it can follow it in full
    assert (command == wished).all()
    cos, sin = math.cos(heading), math.sin(heading)
    v, omega = chord(command[0] * cos + command[1] * sin, command[1] * cos - command[0] * sin, hand, H)
    assert abs(omega) * radius <= v + 1e-12
    if not near and math.hypot(wish[0], wish[1]) > 0.1:
        a, b = wish[0] * cos + wish[1] * sin, wish[1] * cos - wish[0] * sin
        assert (np.linalg.norm(command) > 0.0) == (hand * abs(b) < -radius * a or a > -abs(b) * hand / radius)


def test_a_car_passes_a_rock_and_keeps_its_distance() -> None:
    trace = passing()
    assert {verdict.status for verdict in judge(trace)} == {"holds"}
    turned = np.abs(np.diff(trace.column("ugv1.heading_rad")))
    assert turned.sum() > 0.5
    run = Run("d", resolved(trace.scenario), trace.events, trace.states, trace.samples)
    _moves_as_commanded(run, "ugv1")
    assert safety.safe_hyp(run).status == safety.safe_trace(run).status == "holds"
    (proof,) = judge_model(trace.scenario, claims=["SAFE-BUDGET"])
    assert proof.status == "proved"
    assert {"Turning.car", "Plants.forwards"} <= proof.evidence["theorems"].keys()


def test_a_car_stands_where_it_would_have_to_turn_on_the_spot() -> None:
    trace = passing("ugvs.ugv1.plant.heading_rad=3.0", "duration_s=3.0")
    np.testing.assert_allclose(trace.body("ugv1") - trace.body("ugv1")[0], 0.0, atol=1e-9)
    assert {verdict.status for verdict in judge(trace, ["SAFE-TRACE", "SAFE-HYP"])} == {"holds"}


def test_a_command_outside_makes_it_stand() -> None:
    plant = Ackermann(0.3, H, backwards=False, radius_m=1.0)
    for command, stands in (([1.0, 0.29, 0.0], False), ([1.0, 0.31, 0.0], True), ([-1.0, 0.0, 0.0], True)):
        velocity = np.array(command)
        assert steer(velocity, 0.0, plant.steering, H)[0] == (0.0 if stands else 1.0)
        assert velocity.any() != stands
