"""Robots that turn and lag: their motion against the equations, the distance they take, and runs of them."""

import copy
import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from builders.edits import with_cells
from builders.worlds import beside_a_wall
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from pydrake.systems.analysis import Simulator
from scipy.integrate import solve_ivp

from airground_drake.base.arrays import Array
from airground_drake.check.plants import law_m, taken
from airground_drake.model.bodies.world import Body
from airground_drake.model.plants.budget import AT_REST, Bounds, costs, law_distance
from airground_drake.model.plants.delay import Delay
from airground_drake.model.plants.lag import Lag
from airground_drake.model.plants.plant import Recorded
from airground_drake.model.plants.steering import steer
from airground_drake.model.plants.unicycle import Unicycle
from airground_drake.scenario.load import load
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.schema import Ugv
from airground_drake.sim.blocks.plant import steered_plant
from airground_drake.sim.diagram import build_diagram, make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge
from airground_drake.verify.runs.pairs import least_gap, pairs_of

H = 0.05
UNICYCLE = "{kind: unicycle, hand_point_m: 0.3, max_turn_rad_s: 2.0, wheel_base_m: 0.4, max_wheel_speed_m_s: 1.5}"
FORWARDS = UNICYCLE.replace("}", ", backwards: false}")
LAG = "{kind: lag, time_constant_s: 0.2}"
DELAYED_LAG = "[{kind: delay, delay_s: 0.1}, {kind: lag, time_constant_s: 0.1}]"


def commands(seed: int, speed: float) -> Array:
    rng = np.random.default_rng(seed)
    turn, fast = rng.uniform(-np.pi, np.pi, 12), rng.uniform(0.0, 2.0, 12).clip(max=1.0) * speed
    return np.column_stack([fast * np.cos(turn), fast * np.sin(turn), np.zeros(12)])


@examples(40)
@given(st.integers(0, 10**6), st.floats(0.05, 0.5), st.floats(0.3, 6.0), st.floats(0.1, 1.5), st.floats(0.2, 2.0))
def test_a_unicycle_obeys_its_equations_its_limits_and_arrives(
    seed: int, hand: float, turn: float, wheel: float, speed: float
) -> None:
    """x' = v cos, y' = v sin, heading' = omega, integrated; its hand point is where the command leads, but for dips."""
    plant = Unicycle(hand, H, heading_rad=0.4, max_turn_rad_s=turn, wheel_base_m=0.3, max_wheel_m_s=wheel)
    memory, base = plant.memory(), plant.steered(np.zeros(3))
    dip = plant.bounds(speed).dip_m
    for velocity in commands(seed, speed):
        wished, heading = velocity.copy(), float(memory[0])
        share, omega = steer(velocity, heading, plant.steering, H)
        np.testing.assert_allclose(velocity, share * wished, atol=1e-15)
        begin, end = plant.at(memory, base, velocity, 0.0), plant.at(memory, base + H * velocity, velocity, H)
        arc = (end[3] - begin[3]) / H
        length = np.linalg.norm(end[:2] - begin[:2]) * (0.5 * arc * H / math.sin(0.5 * arc * H) if arc else 1.0)
        ahead = np.array([math.cos(0.5 * (begin[3] + end[3])), math.sin(0.5 * (begin[3] + end[3]))])
        v = math.copysign(length / H, (end[:2] - begin[:2]) @ ahead)
        assert abs(arc - omega) < 1e-9
        assert abs(omega) <= turn + 1e-9
        assert abs(v) + 0.15 * abs(omega) <= wheel + 1e-9
        due = solve_ivp(
            lambda _, y, v=v, arc=arc: [v * math.cos(y[2]), v * math.sin(y[2]), arc], (0.0, H), [*begin[:2], begin[3]],
            rtol=1e-11, atol=1e-13, t_eval=np.linspace(0.0, H, 5),
        ).y.T  # fmt: skip
        for part, there in zip(np.linspace(0.0, 1.0, 5), due, strict=True):
            found = plant.at(memory, base + part * H * velocity, velocity, part * H)
            np.testing.assert_allclose(found[[0, 1, 3]], there, atol=1e-9)
            point = found[:2] + hand * np.array([math.cos(found[3]), math.sin(found[3])])
            off = np.linalg.norm(point - (base + part * H * velocity)[:2])
            assert off <= (dip + 1e-12 if 0.0 < part < 1.0 else 1e-12)
        memory, base = plant.remembered(memory, velocity, H), base + H * velocity
        assert memory[0] == end[3]


def test_a_command_that_can_be_done_is_not_shortened() -> None:
    plant = Unicycle(0.2, H, max_turn_rad_s=2.0, wheel_base_m=0.3, max_wheel_m_s=1.0)
    for velocity, left in (
        ([0.9, 0.0, 0.0], 1.0),
        ([-0.9, 0.0, 0.0], 1.0),
        ([0.0, 0.3, 0.0], 1.0),
        ([0.0, 0.6, 0.0], 0.6),
    ):
        share, _ = steer(np.array(velocity), 0.0, plant.steering, H)
        assert share == pytest.approx(left, abs=0.08)
        assert (share == 1.0) == (left == 1.0)


@examples(20)
@given(st.integers(0, 10**6), st.floats(0.02, 1.0), st.integers(0, 4))
def test_a_lag_and_a_delay_obey_their_equations(seed: int, lag: float, periods: int) -> None:
    """The body of a delay is where the steered point was; v' = (u - v) / tau integrated; p' = v."""
    of = Lag(lag)
    plant = Delay(periods, H, of) if periods else of
    given_ = commands(seed, 1.0)
    memory, base = plant.memory(), np.zeros(3)
    due = np.zeros(4)
    for k, velocity in enumerate(given_):
        now = given_[k - periods] if k >= periods else np.zeros(3)
        solved = solve_ivp(
            lambda _, y, now=now: [*y[2:], *((now[:2] - y[2:]) / lag)], (0.0, H), due, rtol=1e-11, atol=1e-13,
            t_eval=[0.4 * H, H],
        ).y.T  # fmt: skip
        for part, there in zip((0.4, 1.0), solved, strict=True):
            found = plant.at(memory, base + part * H * velocity, velocity, part * H)
            np.testing.assert_allclose(found[[0, 1, 3, 4]], there, atol=1e-9)
        ends = np.insert(np.stack([due, solved[-1]]), [2, 4], 0.0, axis=1)
        bent = np.linalg.norm(solved[0, :2] - 0.6 * due[:2] - 0.4 * solved[-1, :2])
        assert bent <= plant.bends_m(np.array([0.0, H]), ends)[0] + 1e-10
        due, memory, base = solved[-1], plant.remembered(memory, velocity, H), base + H * velocity


def test_drakes_plant_is_the_same_bit_by_bit() -> None:
    """Also within a period; the period is a binary fraction, so that Drake's times are exact."""
    period, rng = 0.0625, np.random.default_rng(4)
    for plant in (Unicycle(0.2, period, 1.0), Lag(0.3), Delay(2, period, Lag(0.1)), Delay(3, period)):
        body = Body("robot", "ugv", plant.steered(np.array([1.0, 2.0, 0.0])), plant=plant, max_speed_m_s=1.0)
        diagram = steered_plant(body, period)
        simulator = Simulator(diagram)
        simulator.get_mutable_integrator().set_maximum_step_size(period)
        port, signals = diagram.GetInputPort("velocity"), diagram.GetOutputPort("signals")
        context, memory, base = simulator.get_mutable_context(), plant.memory(), body.start_m
        for k, velocity in enumerate(commands(int(rng.integers(1000)), 1.0)):
            simulator.AdvanceTo(k * period) if k else simulator.Initialize()
            port.FixValue(context, velocity)
            for part in (0.25, 1.0):
                simulator.AdvanceTo((k + part) * period)
                due = plant.at(memory, context.get_continuous_state_vector().CopyToVector(), velocity, part * period)
                assert signals.Eval(context).tolist() == due.tolist()
            memory = plant.remembered(memory, velocity, period)
            base = base + period * velocity
        np.testing.assert_allclose(context.get_continuous_state_vector().CopyToVector(), base, atol=1e-14)


def test_the_distance_in_the_law() -> None:
    """The table of losses: a lag of 0.1 s at 1 m/s costs 8.3 mm from a wall, two lags of 0.1 and 0.3 s 0.11 m."""
    slow = Bounds(lag_s=0.1, speed_m_s=0.5)
    assert law_distance(0.6, Bounds(), gain=3.0) == 0.6
    assert law_distance(0.6, Bounds(lag_s=0.1, speed_m_s=1.0), gain=3.0) == pytest.approx(math.hypot(0.6, 0.1))
    assert law_distance(0.6, slow, slow, gain=3.0) == pytest.approx(math.hypot(0.6, 0.1))
    unequal = law_distance(0.6, slow, slow._replace(lag_s=0.3), gain=3.0)
    assert unequal == pytest.approx(0.1 + math.hypot(0.6, 0.1))
    late = Bounds(delay_s=0.15, speed_m_s=0.5)
    assert law_distance(0.6, late, late, gain=3.0) == 0.6 == law_distance(0.6, late, AT_REST, gain=3.0)
    assert law_distance(0.6, late, late._replace(delay_s=0.05), gain=3.0) == pytest.approx(0.65)
    turning = Bounds(cover_m=0.3, dip_m=0.01, drift_m_s=0.3)
    assert law_distance(0.6, turning, turning, gain=3.0) == pytest.approx(0.6 + 2 * (0.3 + 0.01 + 0.1))
    assert law_distance(0.6, slow, gain=3.0, passive=True) == pytest.approx(0.65)
    drawn = Bounds(cover_m=0.8, dip_m=0.01, speed_m_s=1.0, drawn=True)
    assert law_distance(0.6, drawn, gain=3.0) == pytest.approx(1.01)
    assert sum(each.metres for each in costs(0.6, drawn, gain=3.0)) == pytest.approx(0.41)
    assert law_distance(0.6, drawn, gain=3.0, passive=True) == pytest.approx(1.41)  # as beside another robot
    assert law_distance(0.6, drawn, Bounds(speed_m_s=0.5), gain=3.0) == pytest.approx(1.41)
    both = costs(0.6, turning, slow, gain=3.0)
    assert 0.6 + sum(each.metres for each in both) == pytest.approx(law_distance(0.6, turning, slow, gain=3.0))


@examples(100)
@given(
    st.lists(st.sampled_from([UNICYCLE, FORWARDS, LAG, DELAYED_LAG, "{kind: first_order}"]), min_size=2, max_size=2),
    st.lists(st.floats(0.2, 3.0), min_size=2, max_size=2), st.floats(0.1, 2.0), st.booleans(),
)  # fmt: skip
def test_the_checker_has_the_same_distances_in_other_words(
    kinds: list[str], speeds: list[float], distance: float, alone: bool
) -> None:
    scenario = load("swap", [f"ugvs.ugv{k + 1}.plant={kind}" for k, kind in enumerate(kinds)] + ["uav.altitude_m=3"])
    ugvs: list[Ugv] = [replace(ugv, max_speed_m_s=v) for ugv, v in zip(scenario.ugvs.values(), speeds, strict=True)]
    period = scenario.control.period_s
    plants = [plant_of(ugv, period).bounds(ugv.max_speed_m_s) for ugv in ugvs]
    rooms = [taken(asdict(ugv), asdict(scenario.control)) for ugv in ugvs]
    for passive in (False, True) if alone else (False,):
        due = law_distance(distance, plants[0], AT_REST if alone else plants[1], gain=3.0, passive=passive)
        assert law_m(distance, rooms[0], None if alone else rooms[1], passive=passive) == pytest.approx(due, abs=1e-13)


def run_of(plant: str, *more: str) -> Trace:
    given_ = [f"ugvs.ugv1.plant={plant}", "ugvs.ugv1.max_speed_m_s=1.4", "uav.altitude_m=3", "uav.start_m=[0, 0, 3]"]
    return simulate(load("minimal", [*given_, "uav.target_m=[10, 0, 3]", "duration_s=12.0", *more]), "d")


@pytest.mark.parametrize("plant", [UNICYCLE, FORWARDS, LAG, DELAYED_LAG])
def test_a_run_keeps_its_distances_and_meets_the_hypotheses(plant: str) -> None:
    trace = run_of(plant)
    found = {verdict.claim.id: verdict for verdict in judge(trace)}
    assert {name for name, verdict in found.items() if verdict.status not in ("holds",)} <= {"LIVE-GOAL"}
    gap = least_gap(trace, pairs_of(trace)[0])
    gaps = np.linalg.norm(trace.body("ugv1") - np.array(trace.scenario.obstacles["rock"].position_m), axis=1)
    assert gap.margin_m <= gaps.min() - gap.pair.safe_m + 1e-12
    assert gap.margin_m >= gaps.min() - gap.pair.safe_m - 2e-3
    assert gap.pair.law_m > gap.pair.safe_m


@examples(60)
@given(st.integers(0, 10**6), st.floats(0.1, 0.5), st.booleans())
def test_a_unicycle_that_never_drives_backwards_does_not(seed: int, hand: float, near: bool) -> None:
    """Under the law, beside a wall or not, whatever the task asks for; it keeps what it could do, and turns."""
    plant = Unicycle(hand, H, max_turn_rad_s=3.0, backwards=False)
    command, wish, heading, left_m = beside_a_wall(seed, plant, near)
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    assert command @ ahead >= 0.0
    least = np.array([-left_m / H, 0.0])  # along x, away from the wall; and ahead
    normals, wished = np.stack([[1.0, 0.0], ahead[:2]]), wish[:2] * min(1.0, 1.0 / np.linalg.norm(wish))
    nearest = [wished, *(wished + (b - n @ wished) * n for n, b in zip(normals, least, strict=True))]
    nearest.append(np.linalg.solve(normals, least))
    allowed = [v for v in nearest if (normals @ v >= least - 1e-9).all()]
    due = min(allowed, key=lambda v: float(np.linalg.norm(v - wished)))
    np.testing.assert_allclose(command[:2], due, atol=1e-8)
    share, _ = steer(command, heading, plant.steering, H)
    assert share > 0.0
    back = -ahead  # where another task comes first, as under method (b), it stands
    assert steer(back, heading, plant.steering, H) == (0.0, 0.0)
    assert not back.any()


def test_the_gain_that_a_turning_limit_leaves_is_that_of_the_command_shortened_most() -> None:
    """Where a command is shortened, the robot turns as fast as it may: at the start, towards a target behind it."""
    slow = "{kind: unicycle, hand_point_m: 0.3, max_turn_rad_s: 0.8, heading_rad: 2.5}"
    trace = run_of(slow)
    (found,) = judge(trace, ["SAFE-HYP"])
    evidence: Any = found.evidence
    (least,) = evidence["least_shares"]
    shares = trace.sampled("ugv1.command_share")
    turned = np.diff(trace.column("ugv1.heading_rad")[trace.sample_rows]) / trace.scenario.control.period_s
    assert least == {"robot": "ugv1", "share": shares.min(), "gain_1_s": shares.min() * 3.0}
    assert 0.01 < shares.min() < 0.5
    np.testing.assert_allclose(np.abs(turned[shares[:-1] < 1.0]), 0.8, atol=1e-9)
    assert (np.abs(turned[shares[:-1] == 1.0]) < 0.8).all()


def test_its_target_straight_behind_it_stands_for_ever_but_for_a_little_aside_it_turns() -> None:
    found = []
    for heading in (math.pi, 3.1):
        given = FORWARDS.replace("}", f", heading_rad: {heading}}}")
        start = ["ugvs.ugv1.max_speed_m_s=1.5", "ugvs.ugv1.preset.speed_m_s=0.5", "obstacles={}", "duration_s=30"]
        trace = simulate(load("minimal", [f"ugvs.ugv1.plant={given}", "uav.altitude_m=3", *start]), "a")
        assert {each.status for each in judge(trace, ["SAFE-TRACE", "SAFE-HYP"])} == {"holds"}
        found.append(float(np.linalg.norm(trace.position("ugv1")[-1] - [10.0, 0.0, 0.0])))
    assert found == pytest.approx([10.3, 0.0], abs=0.02)  # half a step past its target, it may not come back


def test_a_hand_point_dips_by_turns_on_the_spot_too() -> None:
    plant, ends = Unicycle(0.2, H), np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.3]])
    turning = Recorded(H * np.arange(2), ends, np.array([0]), np.array([1]), np.zeros(1), np.empty((1, 0)), 1.0)
    (dip,) = (premise for premise in plant.premises(turning) if premise.name == "dip of the hand point")
    assert plant.bounds(1.0).dip_m - dip.margin[0] == pytest.approx(0.2 * 0.3**2 / 8.0)


def test_a_run_that_goes_backwards_breaks_the_hypothesis_that_it_does_not() -> None:
    given = UNICYCLE.replace("}", ", heading_rad: 3.0}")
    trace = simulate(load("minimal", [f"ugvs.ugv1.plant={given}", "uav.altitude_m=3", "duration_s=2"]), "a")
    (before,) = judge(trace, ["SAFE-HYP"])
    resolved = copy.deepcopy(trace.meta["scenario"])
    resolved["ugvs"]["ugv1"]["plant"][0]["backwards"] = False
    (after,) = judge(replace(trace, meta={**trace.meta, "scenario": resolved}), ["SAFE-HYP"])
    worst = {each["hypothesis"]: each["margin"] for each in after.evidence["worst"]}  # type: ignore[index]
    assert (before.status, after.status) == ("holds", "refuted")
    assert worst["never backwards"] < -0.1


@pytest.mark.parametrize(
    ("plant", "column"),
    [
        (UNICYCLE, "ugv1.heading_rad"),
        (UNICYCLE, "ugv1.body_y_m"),
        (LAG, "ugv1.body_vx_m_s"),
        (DELAYED_LAG, "ugv1.body_x_m"),
    ],
)
def test_a_body_that_does_not_follow_its_plant_is_an_error(plant: str, column: str) -> None:
    trace = run_of(plant, "duration_s=1.0")
    (verdict,) = judge(with_cells(trace, "states", 7, column, lambda value: value + 1e-6), ["SAFE-TRACE"])
    assert verdict.status == "error"


@pytest.mark.parametrize("share", [0.0, 0.5])
@pytest.mark.parametrize(
    ("plant", "kind", "term"),
    [
        (UNICYCLE, Unicycle, "cover_m"),
        (FORWARDS, Unicycle, "cover_m"),
        (LAG, Lag, "lag_s"),
        (DELAYED_LAG, Delay, "lag_s"),
        (DELAYED_LAG, Delay, "delay_s"),
    ],
)
def test_a_law_that_leaves_out_a_term_or_half_of_it_is_found(
    monkeypatch: pytest.MonkeyPatch, plant: str, kind: type, term: str, share: float
) -> None:
    """SAFE-HYP measures how far the body is from the steered point."""
    trace = run_of(plant, "duration_s=4.0", "ugvs.ugv1.preset.speed_m_s=1.4")
    bounds = kind.bounds  # type: ignore[attr-defined]

    def less(self: Unicycle | Lag | Delay, speed: float) -> Bounds:
        found: Bounds = bounds(self, speed)
        return found._replace(**{term: share * getattr(found, term)})

    monkeypatch.setattr(kind, "bounds", less)
    (verdict,) = judge(trace, ["SAFE-HYP"])
    assert verdict.status == "refuted"


def test_a_law_that_leaves_out_the_dip_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """SAFE-HYP measures it where the robot turns; the checker's distance in the law has it."""
    trace, bounds = run_of(UNICYCLE), Unicycle.bounds
    monkeypatch.setattr(Unicycle, "bounds", lambda self, speed: bounds(self, speed)._replace(dip_m=0.0))
    (verdict,) = judge(trace, ["SAFE-HYP"])
    assert verdict.status == "refuted"


def test_a_monitor_knows_what_unicycles_can_do() -> None:
    scenario = load("case_a_unicycle")  # its first commands are shortened to a tenth
    monitor = make_monitor(scenario, "a")
    diagram = build_diagram(scenario, "a", monitor=monitor)
    simulator = Simulator(diagram)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(1.0)
    assert monitor.violation(monitor.GetMyContextFromRoot(simulator.get_context())) is None
