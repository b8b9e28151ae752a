"""Users' plants: Drake Systems with a declared drift and cover, which each run measures."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.edits import with_cells
from pydrake.systems.framework import BasicVector, Diagram, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import LinearSystem
from sim.blocks.both_programs import checked, found

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, ScenarioError, SimulationError
from airground_drake.check import safety
from airground_drake.check.rules import Disagreement
from airground_drake.check.run import _moves_as_commanded
from airground_drake.model.plants.budget import Bounds, law_distance
from airground_drake.scenario import plugins
from airground_drake.scenario.load import load
from airground_drake.sim.blocks.plant import OwnPlant
from airground_drake.sim.diagram import build_diagram
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge, judge_model

SETTINGS = {"duration_s": 12.0, "control.sensing_range_m": 6.0}
LAG_S = 0.1


class Robot(LeafSystem):
    """p_dot = s u + w at first, and then what a test wants; here it does as it is told."""

    def __init__(self, start: Array, share: float = 1.0, wind_m_s: float = 0.0) -> None:
        super().__init__()
        self._share, self._wind = share, wind_m_s
        self._velocity = self.DeclareVectorInputPort("velocity", 3)
        self.DeclareStateOutputPort("position", self.DeclareContinuousState(BasicVector(start)))

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        derivatives.SetFromVector(self._share * self._velocity.Eval(context) + [self._wind, 0.0, 0.0])


class Raises(Robot):
    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        if context.get_time() > 0.5:
            raise ValueError("motor on fire")
        super().DoCalcTimeDerivatives(context, derivatives)


class Nowhere(Robot):
    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        derivatives.SetFromVector(np.full(3, np.nan if context.get_time() > 0.5 else 0.0))


class Flies(Robot):
    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        derivatives.SetFromVector([*self._velocity.Eval(context)[:2], 0.2])


class RaisesAtItsOutput(LeafSystem):
    def __init__(self, start: Array) -> None:
        super().__init__()
        self.DeclareVectorInputPort("velocity", 3)
        self.DeclareVectorOutputPort("position", 3, self._calc)
        self._start = start

    def _calc(self, context: Any, output: Any) -> None:
        if context.get_time() > 0.5:
            raise RuntimeError("no encoder")
        output.SetFromVector(self._start)


def taken() -> Diagram:
    builder = DiagramBuilder()
    builder.AddNamedSystem("taken", Robot(np.zeros(3)))
    return builder.Build()


TAKEN = taken()


class Elsewhere(Robot):
    def __init__(self, start: Array) -> None:
        super().__init__(start + np.array([0.0, 1e-3, 0.0]))


class Flat(LeafSystem):
    def __init__(self, start: Array) -> None:
        super().__init__()
        self.DeclareVectorInputPort("velocity", 2)


class NoBattery(Robot):
    def __init__(self, start: Array) -> None:
        raise RuntimeError("no battery")


def lagging(start: Array) -> LinearSystem:
    """Motors that lag, steered by p + tau v: outputs p + tau v and, in a Diagram, the body p."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    a, b = np.block([[zero, eye], [zero, -eye / LAG_S]]), np.vstack([zero, eye / LAG_S])
    plant = LinearSystem(A=a, B=b, C=np.block([[eye, LAG_S * eye], [eye, zero]]), D=np.zeros((6, 3)))
    plant.configure_default_state(np.concatenate([start, np.zeros(3)]))
    return plant


class Lagging(Diagram):
    def __init__(self, start: Array) -> None:
        from pydrake.systems.primitives import Demultiplexer

        super().__init__()
        builder = DiagramBuilder()
        motors, apart = builder.AddSystem(lagging(start)), builder.AddSystem(Demultiplexer(6, 3))
        builder.Connect(motors.get_output_port(), apart.get_input_port())
        builder.ExportInput(motors.get_input_port(), "velocity")
        builder.ExportOutput(apart.get_output_port(0), "position")
        builder.ExportOutput(apart.get_output_port(1), "body")
        builder.BuildInto(self)


@cache
def of(make: Callable[..., System], drift_m_s: float = 0.0, cover_m: float = 0.0, **parameters: float) -> Trace:
    """A run of `minimal` in which the UGV has a user's plant."""
    return simulate(load("minimal", SETTINGS), "d", plants={"ugv1": OwnPlant(make, drift_m_s, cover_m, parameters)})


def broken(trace: Trace) -> str:
    """The hypothesis of SAFE-HYP that a run breaks."""
    (verdict,) = judge(trace, ["SAFE-HYP"])
    return str((verdict.counterexample or {}).get("hypothesis", ""))


def test_a_robot_that_obeys_runs_as_one_of_first_order() -> None:
    own, plain = of(Robot), simulate(load("minimal", SETTINGS), "d")
    at = np.searchsorted(own.t, plain.t - 1e-9)
    assert np.abs(own.position("ugv1")[at] - plain.position("ugv1")).max() < 1e-6  # as events are isolated
    assert [event["kind"] for event in own.events] == [event["kind"] for event in plain.events]
    assert set(found(own).values()) == {"holds"}
    assert own.sampled("ugv1.drift_m_s").max() < 1e-9
    assert own.sampled("ugv1.cover_m").max() < 1e-9


def test_drift_and_cover_are_those_of_the_motion() -> None:
    """A robot that gets on by 9/10 misses a tenth of each command, and goes straight; the trace says so."""
    trace = of(Robot, drift_m_s=0.7, share=0.9)
    assert trace.sampled("ugv1.drift_m_s") == pytest.approx(
        0.1 * np.linalg.norm(trace.chosen("ugv1"), axis=1), abs=1e-9
    )
    assert trace.sampled("ugv1.cover_m").max() < 1e-9
    assert set(found(trace).values()) == {"holds"}
    most = float(trace.sampled("ugv1.drift_m_s").max())
    assert broken(of(Robot, drift_m_s=0.9 * most, share=0.9)) == "declared drift"


def test_a_body_apart_from_the_steered_point_is_covered() -> None:
    """Steered by p + tau v, motors that lag miss no command, and the body is off by tau times its speed."""
    trace = of(Lagging, drift_m_s=1e-5, cover_m=LAG_S * 6.0)
    speed = np.linalg.norm(trace.position("ugv1") - trace.body("ugv1"), axis=1)
    assert trace.sampled("ugv1.drift_m_s").max() < 1e-6
    assert trace.sampled("ugv1.cover_m").max() == pytest.approx(speed.max(), abs=1e-9)
    assert set(found(trace).values()) == {"holds"}
    assert broken(of(Lagging, drift_m_s=1e-5, cover_m=0.05)) == "declared cover"


@pytest.mark.parametrize(("declared", "safe"), [(0.3, "holds"), (0.15, "refuted")])
def test_the_law_makes_up_for_the_drift_that_is_declared_and_no_more(declared: float, safe: str) -> None:
    """A wind of 0.3 m/s presses the robot onto the rock: it ends at the safe distance, or inside."""
    trace = simulate(
        load("minimal", SETTINGS), "a", plants={"ugv1": OwnPlant(Robot, declared, 0.0, {"wind_m_s": 0.3})}
    )  # fmt: skip
    (verdict,) = judge(trace, ["SAFE-TRACE"])
    assert verdict.status == safe
    gain, required = trace.scenario.control.avoidance_gain_1_s, trace.scenario.safe_distance.obstacle_m
    law = float(law_distance(required, Bounds(drift_m_s=declared), gain=gain))
    assert verdict.margin == pytest.approx(law - 0.3 / gain - required, abs=1e-6)  # the worst case is reached
    assert (broken(trace) == "declared drift") == (declared < 0.3)


def stepping(start: Array, step_s: float) -> LinearSystem:
    """A robot that jumps, every so often, to where its command led it."""
    eye = np.eye(3)
    plant = LinearSystem(A=eye, B=step_s * eye, C=eye, D=np.zeros((3, 3)), time_period=step_s)
    plant.configure_default_state(start)
    return plant


def test_a_plant_that_jumps_is_passed_on_as_going_straight_one_of_its_steps_later() -> None:
    """So no trigger is late, and the trace is continuous; the robot need not start at the origin."""
    scenario = load("minimal", {**SETTINGS, "ugvs.ugv1.start_m": [0.5, 0.3, 0.0]})
    trace = simulate(scenario, "d", plants={"ugv1": OwnPlant(stepping, 1.2, 0.03, {"step_s": 0.005})})
    assert set(found(trace).values()) == {"holds"}
    place, command = trace.position("ugv1"), trace.command("ugv1")
    assert place[0].tolist() == [0.5, 0.3, 0.0]
    late = trace.t - 0.005
    led = np.cumsum(np.diff(trace.t, prepend=0.0)[:, None] * command, axis=0) + place[0]
    due = np.stack([np.interp(late, trace.t, axis) for axis in led.T], axis=1)
    assert np.abs(place - due).max() < 1e-9


PERSON = {"radius_m": 0.3, "moves": {"waypoints_m": [[12.0, 0.0], [-6.0, 0.0]], "speed_m_s": 0.8}}


@pytest.mark.parametrize(("declared", "wind"), [(0.3, 0.3), (0.1, 0.3), (0.3, -0.3)])
def test_beside_somebody_who_walks_both_programs_say_the_same(declared: float, wind: float) -> None:
    """The robot retreats, with the wind or against it, and comes no nearer by its own doing than it declares."""
    settings = {**SETTINGS, "obstacles.rock": PERSON, "safe_distance.moving_m": 1.0, "ugvs.ugv1.max_speed_m_s": 2.0}
    plants = {"ugv1": OwnPlant(Robot, declared, 0.0, {"wind_m_s": wind})}
    trace = simulate(load("minimal", settings), "a", plants=plants)
    theirs = found(trace, "SAFE-TRACE", "SAFE-OWN", "SAFE-HYP")
    promised = "holds" if declared >= 0.3 else "refuted"
    assert theirs == {"SAFE-TRACE": "holds", "SAFE-OWN": promised, "SAFE-HYP": promised}
    run = checked(trace)
    ours = (safety.safe_trace(run), safety.safe_own(run), safety.safe_hyp(run))
    assert [each.status for each in ours if each] == [*theirs.values()]
    (own,) = judge(trace, ["SAFE-OWN"])
    assert ours[1] is not None
    assert (ours[1].margin or 0.0) == pytest.approx(own.margin or 0.0, abs=1e-9)
    assert own.exercised


def test_the_theorem_is_about_the_declared_numbers() -> None:
    (verdict,) = judge_model(of(Robot, drift_m_s=0.3, cover_m=0.1).scenario, claims=["SAFE-BUDGET"])
    assert verdict.status == "proved"
    assert "Mixed.drifting" in verdict.evidence["theorems"]


def test_the_checker_comes_to_the_same_verdicts() -> None:
    for trace in (of(Robot, drift_m_s=0.7, share=0.9), of(Lagging, drift_m_s=1e-5, cover_m=0.05)):
        run = checked(trace)
        _moves_as_commanded(run, "ugv1")
        for claim, check in (("SAFE-TRACE", safety.safe_trace), ("SAFE-HYP", safety.safe_hyp)):
            (theirs,), ours = judge(trace, [claim]), check(run)
            assert ours is not None
            assert ours.status == theirs.status
            if claim == "SAFE-TRACE":
                assert ours.margin == pytest.approx(theirs.margin, abs=1e-9)


@pytest.mark.parametrize(
    ("table", "column"), [("samples", "drift_m_s"), ("samples", "cover_m"), ("states", "body_x_m")]
)
def test_a_forged_record_is_found(table: str, column: str) -> None:
    trace = of(Lagging, drift_m_s=1e-5, cover_m=LAG_S * 6.0)
    by = 1.0 if table == "states" else -1e-6
    forged = with_cells(trace, table, 60, f"ugv1.{column}", lambda value: value + by)
    assert found(forged, "SAFE-TRACE") == {"SAFE-TRACE": "error"}
    with pytest.raises(Disagreement, match=r"(drift|cover) of a plant"):
        _moves_as_commanded(checked(forged), "ugv1")


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (Raises, SimulationError, r"test_own_plants\.py:\d+ ValueError: motor on fire .*Raises of ugv1"),
        (Nowhere, SimulationError, r"Nowhere' of ugv1 has \[nan, nan, nan\] at its output position; allowed: finite"),
        (RaisesAtItsOutput, SimulationError, r"RaisesAtItsOutput' of ugv1: RuntimeError: no encoder"),
        (Flies, SimulationError, r"Flies' of ugv1 has .* at its output position; allowed for a UGV: the height 0"),
        (Elsewhere, PluginError, r"Elsewhere' of ugv1 begins at \[0\.0, 0\.001, 0\.0\] m; allowed: at its start"),
        (Flat, PluginError, r"of ugv1 has inputs of sizes \[2\].*velocity \(3\) first .*body \(3\) and heading"),
        (NoBattery, PluginError, "NoBattery' of ugv1: .*RuntimeError: no battery"),
        (lambda start: None, PluginError, "is made by a function that returns None; allowed: a Drake System"),
        (lambda start: TAKEN.GetSubsystemByName("taken"), PluginError, "already been built into a different Diagram"),
        ("Robot", PluginError, "the plant of ugv1 is .*; allowed: an OwnPlant, made by a class or a function"),
    ],
)
def test_a_plant_that_fails_says_which_and_why(make: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        of(make)


def test_a_class_in_a_scenario_needs_leave_and_takes_numbers(tmp_path: Path) -> None:
    """The same as from Python; the file is found beside the scenario, and its digest is told."""
    text = f"from {__name__} import Robot\nclass Weak(Robot):\n    pass\n"
    (tmp_path / "weak.py").write_text(text)
    given = "{kind: weak.py:Weak, drift_m_s: 0.7, parameters: {share: 0.9}}"
    scenario = load("minimal", [*(f"{key}={value}" for key, value in SETTINGS.items()), f"ugvs.ugv1.plant={given}"])
    source = str(tmp_path / "mine.yaml")
    Path(source).write_text("")
    with pytest.raises(ScenarioError, match=r"ugvs\.ugv1\.plant\.kind: 'weak\.py:Weak'.*--allow-plugins"):
        plugins.refuse(scenario, source)
    with plugins.admitted(scenario, source, allow=True):
        trace = simulate(scenario, "d")
        assert [*plugins.digests(scenario)] == ["weak.py:Weak"]
    again = of(Robot, drift_m_s=0.7, share=0.9)
    assert np.array_equal(trace.position("ugv1"), again.position("ugv1"))
    assert trace.samples.equals(again.samples)
    build_diagram(plugins.without(scenario))  # imports nothing
