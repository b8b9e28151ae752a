"""Using the package from Python: what is wrong is said, and a diagram is what its docstring promises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource, Integrator, LinearSystem

import airground_drake
from airground_drake import ScenarioError, UnknownNameError, build_diagram, load, simulate
from airground_drake.base.errors import PluginError
from airground_drake.nsbc.task import Array
from airground_drake.nsbc.tasks import PositionTask
from airground_drake.scenarios.load import resolved, validated
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems.plant import first_order_plant
from airground_drake.verify import verdicts_to_pandas, verify

Edit = Callable[[Scenario], Any]


def set_to(path: str, value: Any) -> Edit:
    def edit(scenario: Scenario) -> None:
        *parents, last = path.split(".")
        node: Any = scenario
        for part in parents:
            node = node[part] if isinstance(node, dict) else getattr(node, part)
        if isinstance(node, dict):
            node[last] = value
        else:
            setattr(node, last, value)

    return edit


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (set_to("control.period_s", "fast"), "control.period_s: 'fast' is not allowed; wanted: a number in s"),
        (set_to("ugvs.ugv1.start_m", None), "ugvs.ugv1.start_m: no value is given"),
        (set_to("ugvs.ugv1", 3), "ugvs.ugv1: 3 is not allowed; wanted: a mapping"),
        (set_to("obstacles", {"o": object()}), "obstacles.o"),
        (set_to("uav.start_m", {0.0, 1.0, 2.0}), "uav.start_m: .* is not allowed; wanted: 3 numbers in m"),
    ],
)
@pytest.mark.parametrize("use", [build_diagram, lambda scenario: simulate(scenario, "d"), validated])
def test_a_scenario_made_in_python_is_checked_like_a_file(
    case_a: Scenario, edit: Edit, said: str, use: Callable[[Scenario], Any]
) -> None:
    edit(case_a)
    with pytest.raises(ScenarioError, match=said):
        use(case_a)


def test_no_scenario_at_all() -> None:
    with pytest.raises(ScenarioError, match="str is no Scenario"):
        build_diagram("case_a")  # type: ignore[arg-type]


def test_numbers_of_numpy_and_tuples_may_stand_in_a_scenario(case_a: Scenario) -> None:
    before = validated(case_a)
    case_a.ugvs["ugv1"].start_m = np.array(case_a.ugvs["ugv1"].start_m)  # type: ignore[assignment]
    case_a.uav.start_m = tuple(case_a.uav.start_m)  # type: ignore[assignment]
    case_a.duration_s = np.float64(case_a.duration_s)
    case_a.seed = np.int64(case_a.seed)  # type: ignore[assignment]
    assert validated(case_a) == before
    assert resolved(validated(case_a)) == resolved(before)


def test_overrides_as_a_dict() -> None:
    changes = {"seed": 7, "decision.noise_m_sqrt_s": np.float64(0.02), "ugvs.ugv1.start_m": (1.0, 0.5, 0.0)}
    scenario, digest = load("case_a", changes)
    texts = ["seed=7", "decision.noise_m_sqrt_s=0.02", "ugvs.ugv1.start_m=[1.0, 0.5, 0.0]"]
    assert (scenario, digest) == load("case_a", texts)
    with pytest.raises(ScenarioError, match=r"decision\.nose"):
        load("case_a", {"decision.nose": 1.0})
    with pytest.raises(ScenarioError, match="not JSON serializable"):
        load("case_a", {"seed": object()})


@pytest.mark.parametrize("seed", [-1, 1.5, 2**40])
def test_a_seed_is_checked_like_that_of_a_file(case_a: Scenario, seed: Any) -> None:
    with pytest.raises(ScenarioError, match=f"seed: {seed} is not allowed"):
        simulate(case_a, "d", seed=seed)


def test_unknown_names_say_what_is_allowed(case_a: Scenario) -> None:
    with pytest.raises(UnknownNameError, match="unknown run 'z'; allowed: a, b, c, c_literal, d"):
        simulate(case_a, "z")
    with pytest.raises(UnknownNameError, match="unknown method 'z'; allowed: a, b, c, d"):
        build_diagram(case_a, method="z")
    with pytest.raises(UnknownNameError, match="unknown composition 'z'; allowed: augmented"):
        build_diagram(case_a, composition="z")  # type: ignore[arg-type]


def test_everything_in_all_is_there() -> None:
    for name in airground_drake.__all__:
        assert getattr(airground_drake, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = airground_drake.nothing


def starts(scenario: Scenario) -> Array:
    return np.array([*(ugv.start_m for ugv in scenario.ugvs.values()), scenario.uav.start_m])


@pytest.mark.parametrize("method", ["a", "b", "c", "d"])
def test_in_the_default_context_every_robot_is_at_its_start(case_a: Scenario, method: str) -> None:
    diagram = build_diagram(case_a, method)
    context = diagram.CreateDefaultContext()
    assert np.array_equal(diagram.GetOutputPort("bodies").Eval(context).reshape(-1, 3), starts(case_a))


def test_it_runs_without_the_recorder(case_a: Scenario) -> None:
    diagram = build_diagram(case_a, "d")
    simulator = Simulator(diagram)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(1.0)
    positions = diagram.GetOutputPort("bodies").Eval(simulator.get_context()).reshape(-1, 3)
    assert np.linalg.norm(positions[0] - starts(case_a)[0]) > 0.5


def test_another_simulator_goes_on_with_a_run() -> None:
    """With a clone of the context in the middle of an intervention: triggers so far, and when, are not forgotten."""
    diagram = build_diagram(load("minimal")[0], "d")
    simulator = Simulator(diagram)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(7.0)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(8.0)
    Simulator(diagram, clone).AdvanceTo(8.0)
    for port in ("status", "bodies"):
        there, here = (diagram.GetOutputPort(port).Eval(context) for context in (simulator.get_context(), clone))
        assert here == pytest.approx(there, abs=1e-12)
    assert diagram.GetOutputPort("status").Eval(clone)[1] == 1.0


def test_a_simulator_initialised_again_begins_anew_before_its_first_step_and_goes_on_after_it() -> None:
    diagram = build_diagram(load("minimal")[0], "d")
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    context.SetAccuracy(1e-6)
    plant = diagram.GetSubsystemByName("vehicles").GetSubsystemByName("ugv1_plant")
    home = plant.GetMyContextFromRoot(context).get_continuous_state_vector().CopyToVector()

    def put(away_m: float) -> None:
        plant.GetMyMutableContextFromRoot(context).SetContinuousState(home + np.array([0.0, away_m, 0.0]))
        simulator.Initialize()

    def triggers() -> float:
        return float(diagram.GetOutputPort("status").Eval(context)[1])

    put(0.0)
    assert triggers() == 0.0
    put(5.0)
    assert triggers() == 1.0
    put(0.0)
    assert triggers() == 0.0
    simulator.AdvanceTo(0.5)
    assert triggers() == 0.0
    put(5.0)
    assert triggers() == 1.0
    put(0.0)
    assert triggers() == 1.0


@pytest.mark.parametrize(
    ("asked", "built"),
    [
        ({}, ("case_a_method_a", "recursion_listed")),
        ({"method": "d"}, ("case_a_method_d", "augmented")),
        ({"composition": "augmented"}, ("case_a_method_a", "augmented")),
    ],
)
def test_what_is_not_asked_for_is_of_the_last_run(case_a: Scenario, asked: Any, built: tuple[str, str]) -> None:
    diagram = build_diagram(case_a, **asked)
    controller = diagram.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
    assert (diagram.get_name(), controller.avoidance.composition) == built


def drifted(case_a: Scenario, robot: str, drift: Array | None) -> Array:
    """Positions (n + 1, 3), m, after 1 s in a larger diagram that disturbs one robot."""
    builder = DiagramBuilder()
    inner = builder.AddNamedSystem("airground", build_diagram(case_a, "d"))
    if drift is not None:
        wind = builder.AddNamedSystem("wind", ConstantVectorSource(drift))
        builder.Connect(wind.get_output_port(), inner.GetInputPort(f"disturbance_{robot}"))
    builder.ExportOutput(inner.GetOutputPort("bodies"), "positions")
    outer = builder.Build()
    simulator = Simulator(outer)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(1.0)
    return np.array(outer.GetOutputPort("positions").Eval(simulator.get_context()).reshape(-1, 3))


def test_it_can_be_embedded_and_disturbed(case_a: Scenario) -> None:
    still, nothing = drifted(case_a, "ugv2", None), drifted(case_a, "ugv2", np.zeros(3))
    assert np.array_equal(still, nothing)
    moved = drifted(case_a, "ugv2", np.array([-0.2, 0.0, 0.0]))
    # tracking with gain B = 2 1/s holds against w up to an offset w (1 - exp(-B t)) / B
    expected = -0.2 * (1.0 - np.exp(-2.0)) / 2.0
    assert moved[1, 0] - still[1, 0] == pytest.approx(expected, rel=0.1)
    assert np.abs(moved[0] - still[0]).max() < 1e-9


def test_another_plant(case_a: Scenario) -> None:
    """UGV2's motors pass on nine tenths of what they are asked for."""

    def weak(robot: str, start: Array) -> System:
        if robot != "ugv2":
            return first_order_plant(robot, start)
        plant = LinearSystem(A=np.zeros((3, 3)), B=0.9 * np.eye(3), C=np.eye(3), D=np.zeros((3, 3)))
        plant.configure_default_state(start)
        return plant

    ends = []
    for plants in (first_order_plant, weak):
        diagram = build_diagram(case_a, "d", plants=plants)
        simulator = Simulator(diagram)
        simulator.get_mutable_context().SetAccuracy(1e-6)
        simulator.AdvanceTo(0.05)
        ends.append(diagram.GetOutputPort("bodies").Eval(simulator.get_context()).reshape(-1, 3).copy())
    steps = [end - starts(case_a) for end in ends]
    assert steps[1][1] == pytest.approx(0.9 * steps[0][1])
    assert np.array_equal(steps[0][0], steps[1][0])


def test_a_plant_with_other_ports_is_refused(case_a: Scenario) -> None:
    with pytest.raises(PluginError, match=r"the plant of ugv1 has inputs of sizes \[2\].*velocity \(3\) first"):
        build_diagram(case_a, plants=lambda robot, start: Integrator(2))


class Hold(PositionTask):
    """The UAV stays where it is at (0, 0), at its altitude."""

    def __init__(self, ugv_positions: Array, ugv_velocities: Array, altitude: float, gain: float) -> None:
        super().__init__(np.array([[0.0, 0.0, altitude]]), np.zeros((1, 3)), gain)


def test_another_task_of_the_uav(case_a: Scenario) -> None:
    case_a.uav.task = f"{__name__}:Hold"
    case_a.duration_s = 5.0
    assert np.abs(simulate(case_a, "a").position("uav")[-1] - [0.0, 0.0, 2.0]).max() < 1e-3


def test_a_table_that_changed_is_judged_anew(case_a: Scenario) -> None:
    case_a.duration_s = 1.0
    trace = simulate(case_a, "d")
    assert verify(trace, claims=["SAFE-TRACE"])[0].finding.status == "holds"
    trace.signals["ugv1.x_m"] += 0.1 * trace.signals["t_s"]  # a robot that does not do what it was told
    assert verify(trace, claims=["SAFE-TRACE"])[0].finding.status == "error"


def test_a_trace_as_a_table_and_in_a_notebook() -> None:
    scenario, _ = load("case_a", {"duration_s": 15.0})
    trace = simulate(scenario, "b")
    table = trace.to_pandas()
    assert table.index.name == "t_s"
    assert table["ugv1"]["x_m"].tolist() == trace.position("ugv1")[:, 0].tolist()
    assert set(table.columns.get_level_values("robot")) == set(trace.robots)
    assert repr(trace) == f"<Trace: run 'b' of 'case_a', {len(trace.t)} rows, {len(trace.events)} events>"
    assert "<td>trigger</td>" in trace._repr_html_()
    verdicts = verify(trace, ["SAFE-TRACE"])
    assert repr(verdicts[0]) == "<Verdict: SAFE-TRACE on run 'b': holds>"
    assert "Does not establish" in verdicts[0]._repr_html_()
    found = verdicts_to_pandas(verdicts)
    assert found.loc[0, ["claim", "run", "status"]].tolist() == ["SAFE-TRACE", "b", "holds"]
    assert found.loc[0, "margin"] == verdicts[0].finding.margin


def test_a_scenario_and_a_diagram_in_a_notebook() -> None:
    scenario, _ = load("case_b")
    assert repr(scenario) == "<Scenario 'case_b': 2 UGVs, the UAV, 4 obstacles, runs b, c, c_literal, d>"
    shown = scenario._repr_html_()
    drawing = ElementTree.fromstring(shown[shown.index("<svg") : shown.index("</svg>") + 6])
    tags = [element.tag.rpartition("}")[2] for element in drawing]
    assert tags.count("circle") == 2 * len(scenario.obstacles) + len(scenario.ugvs)
    assert tags.count("polyline") == len(scenario.ugvs)
    assert all(f"run {name}: ({run.method})" in shown for name, run in scenario.runs.items())
    diagram = build_diagram(scenario)
    assert ElementTree.fromstring(diagram._repr_html_()).tag == "{http://www.w3.org/2000/svg}svg"


def test_a_trace_is_drawn_on_axes_of_ones_own() -> None:
    scenario, _ = load("case_a", {"duration_s": 1.0})
    trace, axes = simulate(scenario, "a"), Figure().subplots()
    assert trace.plot(axes) is axes
    drawn = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    assert np.array_equal(drawn["ugv1"], trace.position("ugv1")[:, :2])
    assert len(axes.patches) == 2 * len(scenario.obstacles)
