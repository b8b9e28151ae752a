"""The monitor: silent on honest runs, and where SAFE-HYP finds its first violation it finds the same."""

from collections.abc import Callable

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from sim.blocks.contexts import begun

from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.blocks import Monitor, Rule, Violation
from airground_drake.sim.diagram import build_diagram, make_monitor
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge


def watched(
    scenario: Scenario, method: str, honest: Scenario | None = None, *, terminate: bool = False
) -> tuple[Violation | None, SimulatorStatus]:
    monitor = make_monitor(honest or scenario, method, terminate=terminate)
    diagram = build_diagram(scenario, method, monitor=monitor)
    simulator = Simulator(diagram, context := begun(diagram, scenario.seed))
    simulator.Initialize()
    status = simulator.AdvanceTo(scenario.duration_s)
    found = monitor.violation(monitor.GetMyContextFromRoot(context))
    port = diagram.GetOutputPort("violation").Eval(context)
    assert port.tolist() == ([0.0, -1.0, -1.0, -1.0, -1.0] if found is None else [1.0, *map(float, found)])
    return found, status


@pytest.mark.parametrize(("name", "method"), [("case_a", "a"), ("case_b", "c"), ("case_b", "d")])
def test_it_is_silent_on_honest_runs(name: str, method: str) -> None:
    assert watched(load(name), method)[0] is None


@pytest.mark.parametrize(("name", "method"), [("case_b", "b"), ("soft_gate", "c")])
def test_it_finds_what_safe_hyp_finds_and_can_end_the_simulation_there(
    run: Callable[[str, str], Trace], name: str, method: str
) -> None:
    scenario = load(name)
    found, status = watched(scenario, method, terminate=True)
    finding = judge(run(name, method), ["SAFE-HYP"])[0]
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert found is not None
    assert found.rule == Rule.AVOIDANCE
    assert found.t_s == pytest.approx(finding.counterexample["t_s"], abs=1e-9)
    assert run(name, method).robots[found.robot] == finding.counterexample["first"]
    lost = found.amount_m_s / scenario.control.avoidance_gain_1_s  # e / (A h), times h, of an obstacle
    assert -lost == pytest.approx(finding.counterexample["margin"], abs=1e-9)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert status.return_time() == pytest.approx(found.t_s + scenario.control.period_s)
    assert "ugv1 breaks AVOIDANCE" in status.message()


@pytest.mark.parametrize(
    ("part", "key", "factor", "expected"),
    [
        ("control", "motion_gain_1_s", 0.9, (Rule.LAW, 0)),
        ("control", "formation_gain_1_s", 0.5, (Rule.LAW, 2)),
        ("control", "intervention_gain_1_s", 1.2, (Rule.LAW, 0)),
        ("safe_distance", "obstacle_m", 0.9, (Rule.AVOIDANCE, 0)),
    ],
)
def test_another_parameter_than_the_scenarios_is_a_violation(
    part: str, key: str, factor: float, expected: tuple[Rule, int]
) -> None:
    honest, built = load("case_b"), load("case_b")
    setattr(getattr(built, part), key, factor * getattr(getattr(built, part), key))
    found, _ = watched(built, "d", honest)
    assert found is not None
    assert (found.rule, found.robot) == expected


@pytest.mark.parametrize(
    ("command", "rule", "robot"),
    [
        ([0, 0, 0, 0, 0, 0, 0, 0, 0], None, -1),
        ([9, 0, 0, 0, 0, 0, 0, 0, 0], Rule.SPEED_LIMIT, 0),
        ([0, 0, 0, 0, 0, 0.1, 0, 0, 0], Rule.PLANAR_MOTION, 1),
        ([0, 0, 0, 0, 0, 0, 0, np.nan, 0], Rule.AVOIDANCE, 2),
    ],
)
def test_it_can_be_wired_into_any_diagram(command: list[float], rule: Rule | None, robot: int) -> None:
    """Without laws, with only positions and commands connected."""
    scenario = load("case_a")
    builder = DiagramBuilder()
    world = make_world(scenario)
    monitor = builder.AddSystem(Monitor(world, components.make_avoidance(scenario)))
    for name, values in (("bodies", world.starts.ravel()), ("team_command", command)):
        source = builder.AddSystem(ConstantVectorSource(np.array(values, dtype=float)))
        builder.Connect(source.get_output_port(), monitor.GetInputPort(name))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.2)
    found = monitor.violation(monitor.GetMyContextFromRoot(simulator.get_context()))
    assert (None if found is None else found.rule) == rule
    assert found is None or (found.t_s, found.robot) == (0.0, robot)
