"""Using the package from Python: mistakes are named, and a diagram does what its docstring promises."""

import sys
from collections.abc import Callable
from importlib import import_module, reload
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Integrator

import airground_drake
from airground_drake import ScenarioError, UnknownNameError, build_diagram, load, notebook, plot, simulate
from airground_drake.base.errors import PluginError
from airground_drake.model.law.task import Array
from airground_drake.model.law.tasks import PositionTask
from airground_drake.scenario.load import resolved, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.blocks.plant import OwnPlant
from airground_drake.verify import judge, verdicts_to_pandas


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda s: setattr(s.control, "period_s", "fast"), "control.period_s: 'fast' is not allowed; wanted: a number"),
        (lambda s: setattr(s.ugvs["ugv1"], "start_m", None), "ugvs.ugv1.start_m: no value is given"),
        (lambda s: s.ugvs.update(ugv1=3), "ugvs.ugv1: 3 is not allowed; wanted: a mapping"),
        (lambda s: s.obstacles.update(o=object()), "obstacles.o"),
        (
            lambda s: setattr(s.uav, "start_m", {0.0, 1.0, 2.0}),
            "uav.start_m: .* is not allowed; wanted: 3 numbers in m",
        ),
    ],
)
def test_a_scenario_made_in_python_is_checked_like_a_file(
    case_a: Scenario, edit: Callable[[Scenario], Any], said: str
) -> None:
    edit(case_a)
    for use in (build_diagram, lambda scenario: simulate(scenario, "d"), validated):
        with pytest.raises(ScenarioError, match=said):
            use(case_a)


def test_wrong_arguments_say_what_is_allowed(case_a: Scenario) -> None:
    for call, error, said in (
        (lambda: build_diagram("case_a"), ScenarioError, "str is no Scenario"),  # type: ignore[arg-type]
        (lambda: load("case_a", {"decision.nose": 1.0}), ScenarioError, r"decision\.nose"),
        (lambda: load("case_a", {"seed": object()}), ScenarioError, "not JSON serializable"),
        (lambda: simulate(case_a, "d", seed=-1), ScenarioError, "seed: -1 is not allowed"),
        (lambda: simulate(case_a, "d", seed=1.5), ScenarioError, "seed: 1.5 is not allowed"),  # type: ignore[arg-type]
        (lambda: simulate(case_a, "z"), UnknownNameError, "unknown run 'z'; allowed: a, b, c, c_literal, d"),
        (lambda: build_diagram(case_a, "z"), UnknownNameError, "unknown method 'z'; allowed: a, b, c, d"),
        (lambda: build_diagram(case_a, composition="z"), UnknownNameError, "unknown composition 'z'; allowed: aug"),  # type: ignore[arg-type]
        (lambda: airground_drake.nothing, AttributeError, "no attribute 'nothing'"),
        (
            lambda: build_diagram(case_a, plants={"ugv1": OwnPlant(lambda start: Integrator(2), 0.0, 0.0)}),
            PluginError, r"of ugv1 has inputs of sizes \[2\].*velocity \(3\) first",
        ),
    ):  # fmt: skip
        with pytest.raises(error, match=said):
            call()
    assert all(getattr(airground_drake, name) is not None for name in airground_drake.__all__)


def test_numbers_of_numpy_and_tuples_may_stand_in_a_scenario_and_its_overrides(case_a: Scenario) -> None:
    before = validated(case_a)
    case_a.ugvs["ugv1"].start_m = np.array(case_a.ugvs["ugv1"].start_m)  # type: ignore[assignment]
    case_a.uav.start_m = tuple(case_a.uav.start_m)  # type: ignore[assignment]
    case_a.duration_s = np.float64(case_a.duration_s)
    case_a.seed = np.int64(case_a.seed)  # type: ignore[assignment]
    assert validated(case_a) == before
    assert resolved(validated(case_a)) == resolved(before)
    changes = {"seed": 7, "decision.noise_m_sqrt_s": np.float64(0.02), "ugvs.ugv1.start_m": (1.0, 0.5, 0.0)}
    texts = ["seed=7", "decision.noise_m_sqrt_s=0.02", "ugvs.ugv1.start_m=[1.0, 0.5, 0.0]"]
    assert load("case_a", changes) == load("case_a", texts)


def starts(scenario: Scenario) -> Array:
    return np.array([*(ugv.start_m for ugv in scenario.ugvs.values()), scenario.uav.start_m])


def advanced(diagram: Diagram, t: float, context: Context | None = None) -> Simulator:
    simulator = Simulator(diagram, context)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(t)
    return simulator


def positions(diagram: Diagram, context: Context, port: str = "bodies") -> Array:
    return np.array(diagram.GetOutputPort(port).Eval(context)).reshape(-1, 3)


@pytest.mark.parametrize("method", ["a", "b", "c", "d"])
def test_robots_begin_at_their_starts_and_move_without_the_recorder(case_a: Scenario, method: str) -> None:
    diagram = build_diagram(case_a, method)
    assert np.array_equal(positions(diagram, diagram.CreateDefaultContext()), starts(case_a))
    moved = positions(diagram, advanced(diagram, 1.0).get_context()) - starts(case_a)
    assert np.linalg.norm(moved[0]) > 0.5


def test_another_simulator_goes_on_with_a_run() -> None:
    """With a clone of the context in the middle of an intervention: triggers so far, and when, are not forgotten."""
    diagram = build_diagram(load("minimal"), "d")
    simulator = advanced(diagram, 7.0)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(8.0)
    advanced(diagram, 8.0, clone)
    for port in ("status", "bodies"):
        there, here = (diagram.GetOutputPort(port).Eval(context) for context in (simulator.get_context(), clone))
        assert here == pytest.approx(there, abs=1e-12)
    assert diagram.GetOutputPort("status").Eval(clone)[1] == 1.0


def test_a_simulator_initialised_again_begins_anew_before_its_first_step_and_goes_on_after_it() -> None:
    diagram = build_diagram(load("minimal"), "d")
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    context.SetAccuracy(1e-6)
    plant = diagram.GetSubsystemByName("vehicles").GetSubsystemByName("ugv1_plant")
    home = plant.GetMyContextFromRoot(context).get_continuous_state_vector().CopyToVector()

    def triggers_at(away_m: float) -> float:
        plant.GetMyMutableContextFromRoot(context).SetContinuousState(home + np.array([0.0, away_m, 0.0]))
        simulator.Initialize()
        return float(diagram.GetOutputPort("status").Eval(context)[1])

    assert [triggers_at(away_m) for away_m in (0.0, 5.0, 0.0)] == [0.0, 1.0, 0.0]
    simulator.AdvanceTo(0.5)
    assert diagram.GetOutputPort("status").Eval(context)[1] == 0.0
    assert [triggers_at(away_m) for away_m in (5.0, 0.0)] == [1.0, 1.0]


@pytest.mark.parametrize(
    ("asked", "built"),
    [
        ({}, ("case_a_method_a", "recursion_listed")),
        ({"method": "d"}, ("case_a_method_d", "augmented")),
        ({"composition": "augmented"}, ("case_a_method_a", "augmented")),
    ],
)
def test_method_and_composition_are_by_default_those_of_the_last_run(
    case_a: Scenario, asked: Any, built: tuple[str, str]
) -> None:
    diagram = build_diagram(case_a, **asked)
    controller = diagram.GetSubsystemByName("task_planning").GetSubsystemByName("ugv_controller")
    assert (diagram.get_name(), controller.avoidance.composition) == built


def drifted(case_a: Scenario, drift: Array | None) -> Array:
    """Positions (n + 1, 3), m, after 1 s in a larger diagram that disturbs UGV2."""
    builder = DiagramBuilder()
    inner = builder.AddNamedSystem("airground", build_diagram(case_a, "d"))
    if drift is not None:
        wind = builder.AddNamedSystem("wind", ConstantVectorSource(drift))
        builder.Connect(wind.get_output_port(), inner.GetInputPort("disturbance_ugv2"))
    builder.ExportOutput(inner.GetOutputPort("bodies"), "positions")
    outer = builder.Build()
    return positions(outer, advanced(outer, 1.0).get_context(), "positions")


def test_it_can_be_embedded_and_disturbed(case_a: Scenario) -> None:
    still = drifted(case_a, None)
    assert np.array_equal(still, drifted(case_a, np.zeros(3)))
    moved = drifted(case_a, np.array([-0.2, 0.0, 0.0]))
    # tracking with gain B = 2 1/s holds against w up to an offset w (1 - exp(-B t)) / B
    expected = -0.2 * (1.0 - np.exp(-2.0)) / 2.0
    assert moved[1, 0] - still[1, 0] == pytest.approx(expected, rel=0.1)
    assert np.abs(moved[0] - still[0]).max() < 1e-9


class Hold(PositionTask):
    """The UAV stays where it is at (0, 0), at its altitude."""

    def __init__(self, ugv_positions: Array, ugv_velocities: Array, altitude: float, gain: float) -> None:
        super().__init__(np.array([[0.0, 0.0, altitude]]), np.zeros((1, 3)), gain)


def test_another_task_of_the_uav(case_a: Scenario) -> None:
    case_a.uav.task, case_a.duration_s = f"{__name__}:Hold", 5.0
    assert np.abs(simulate(case_a, "a").position("uav")[-1] - [0.0, 0.0, 2.0]).max() < 1e-3


def test_a_table_that_changed_is_judged_anew(case_a: Scenario) -> None:
    case_a.duration_s = 1.0
    trace = simulate(case_a, "d")
    assert judge(trace, claims=["SAFE-TRACE"])[0].status == "holds"
    trace.states["ugv1.x_m"] += 0.1 * trace.states["t_s"]  # a robot that disobeys
    assert judge(trace, claims=["SAFE-TRACE"])[0].status == "error"


def test_traces_verdicts_scenarios_and_diagrams_as_tables_figures_and_in_a_notebook() -> None:
    scenario = load("case_a", {"duration_s": 15.0})
    trace = simulate(scenario, "b")
    table = trace.to_pandas()
    assert table["ugv1"]["x_m"].tolist() == trace.position("ugv1")[:, 0].tolist()
    assert (table.index.name, set(table.columns.get_level_values("robot"))) == ("t_s", set(trace.robots))
    assert "<td>trigger</td>" in notebook.trace_html(trace)
    verdicts = judge(trace, ["SAFE-TRACE"])
    assert "Does not establish" in notebook.verdict_html(verdicts[0])
    found = verdicts_to_pandas(verdicts)
    assert found.loc[0, ["claim", "run", "status"]].tolist() == ["SAFE-TRACE", "b", "holds"]
    assert found.loc[0, "margin"] == verdicts[0].margin
    axes = Figure().subplots()
    assert plot(trace, axes) is axes
    drawn = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    assert np.array_equal(drawn["ugv1"], trace.position("ugv1")[:, :2])
    (circles,) = axes.collections
    assert len(circles.get_paths()) == len(scenario.obstacles)
    low, high = np.reshape([axes.get_xlim(), axes.get_ylim()], (2, 2)).T
    assert all((low < trace.position(robot)[:, :2]).all() for robot in trace.robots)
    assert all((trace.position(robot)[:, :2] < high).all() for robot in trace.robots)
    scenario.title = "<b>"
    shown = notebook.scenario_html(scenario)
    assert "&lt;b&gt;" in shown
    assert shown.count("<li>ugv") == 2
    ElementTree.fromstring(shown[shown.index("<svg") : shown.index("</svg>") + 6])
    diagram = build_diagram(scenario)
    drawing = notebook.diagram_html(diagram)
    assert drawing is not None
    assert ElementTree.fromstring(drawing).tag == "{http://www.w3.org/2000/svg}svg"
    assert notebook.diagram_html(diagram.GetSubsystemByName("vehicles")) is None


def test_a_notebook_knows_what_to_show_once_the_package_is_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    told = dict[type, object]()

    class Formatter:
        def for_type_by_name(self, module: str, name: str, show: object) -> None:
            kind = getattr(import_module(module), name)
            assert (kind.__module__, kind.__name__) == (module, name)  # IPython compares these
            told[kind] = show

    display = SimpleNamespace(formatters={"text/html": Formatter()})
    shell = SimpleNamespace(display_formatter=display)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    reload(airground_drake)
    assert told[type(load("minimal"))] is notebook.scenario_html
    assert told[Diagram] is notebook.diagram_html
    assert {kind.__name__ for kind in told} == {"Scenario", "Trace", "Verdict", "Diagram"}
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))  # imported, but no shell
    reload(airground_drake)
