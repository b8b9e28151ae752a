"""The state of a run is in its Context: copies, other simulators, threads and runs made again are identical."""

import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import msgpack
import pytest
from pydrake.systems.framework import Context
from sim.blocks.contexts import advanced, begun

from airground_drake.report.view.draw import robot_path, served
from airground_drake.report.view.live_view import LiveView
from airground_drake.scenario.load import load
from airground_drake.sim.diagram import RECORDED, Model, build_model
from airground_drake.sim.simulation import Recorder

HALF_S, END_S = 15.0, 18.0
"""Case A triggers at 14.48 s: at half time a proposal is being executed and watched."""


def ends(model: Model, context: Context) -> list[Any]:
    signals = [model.diagram.GetOutputPort(name).Eval(context).tolist() for name in RECORDED]
    gatekeeper = model.gatekeeper
    assert gatekeeper is not None
    decided = gatekeeper.decisions(gatekeeper.GetMyContextFromRoot(context))
    return [*signals, [(d.t, d.robot, d.accepted, d.reason, d.proposal.number) for d in decided]]


@pytest.mark.parametrize("method", ["c", "d"])
def test_a_cloned_context_goes_on_identically(method: str) -> None:
    scenario = load("case_a")
    model = build_model(scenario, method)
    simulator = advanced(model.diagram, begun(model.diagram, scenario.seed), HALF_S)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(END_S)
    first = ends(model, simulator.get_context())
    assert len(first[-1]) > 10
    second = advanced(model.diagram, clone, END_S)
    assert ends(model, second.get_context()) == first


@pytest.mark.slow
def test_two_simulators_of_one_diagram_do_not_disturb_each_other() -> None:
    scenario = load("case_a")
    model = build_model(scenario, "d")
    simulators = [advanced(model.diagram, begun(model.diagram, seed), HALF_S) for seed in (scenario.seed, 7)]
    for until in (16.0, 17.0, END_S):
        for simulator in simulators:
            simulator.AdvanceTo(until)
    for simulator, seed in zip(simulators, (scenario.seed, 7), strict=True):
        alone = build_model(scenario, "d")
        expected = ends(alone, advanced(alone.diagram, begun(alone.diagram, seed), END_S).get_context())
        assert ends(model, simulator.get_context()) == expected


@pytest.mark.slow
@pytest.mark.parametrize("method", ["c", "d"])
def test_runs_of_one_diagram_in_threads_are_those_made_one_after_the_other(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = load("case_a")
    model = build_model(scenario, method)
    contexts = [begun(model.diagram, seed) for seed in (scenario.seed, 7)]
    alone = [ends(model, advanced(model.diagram, each.Clone(), HALF_S).get_context()) for each in contexts]
    assert len(alone[0][-1]) > 5
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(2) as threads:
            run = [threads.submit(advanced, model.diagram, each, HALF_S) for each in contexts]
            together = [ends(model, each.result().get_context()) for each in run]
    finally:
        sys.setswitchinterval(before)
    assert together == alone


@pytest.mark.parametrize("method", ["c", "d"])
def test_a_run_that_is_made_again_in_its_context_has_the_same_decisions_once(method: str) -> None:
    scenario = load("case_a")
    model = build_model(scenario, method)
    start = begun(model.diagram, scenario.seed)
    simulator = advanced(model.diagram, start.Clone(), HALF_S)
    first, half = ends(model, simulator.get_context()), simulator.get_context().Clone()
    simulator.AdvanceTo(HALF_S + 0.5)
    later = ends(model, simulator.get_context())
    for begin, until, expected in ((start, HALF_S, first), (half, HALF_S + 0.5, later)):
        simulator.get_mutable_context().SetTimeStateAndParametersFrom(begin)
        simulator.Initialize()
        simulator.AdvanceTo(until)
        assert ends(model, simulator.get_context()) == expected


def test_what_is_planned_ahead_in_one_context_is_not_sent_in_another() -> None:
    """Both at 14.5 s: in one a proposal is due, in the other no UGV is triggered."""
    scenario = load("case_a")
    model = build_model(scenario, "d")
    contexts = [advanced(model.diagram, begun(model.diagram, scenario.seed), 14.5).get_context().Clone()]
    contexts.append(begun(model.diagram, scenario.seed))
    contexts[1].SetTime(14.5)
    model.trigger.mutable_levels(model.trigger.GetMyMutableContextFromRoot(contexts[1])).zeta_m = 1e3
    model.planners["uav"].plan_ahead(model.planners["uav"].GetMyContextFromRoot(contexts[0]))
    sent = []
    for context in contexts[::-1]:
        after = advanced(model.diagram, context, 14.55).get_context()
        sent.append(len(model.planners["uav"].memory(model.planners["uav"].GetMyContextFromRoot(after)).sent))
    assert sent == [0, 1]


def test_each_run_is_shown_at_its_own_time() -> None:
    """Two runs in one Meshcat, one ahead of the other: the view has no time of its own."""
    scenario, meshcat = load("minimal"), served()
    view = LiveView(meshcat, scenario)
    recorder = Recorder(scenario, "d", observers=[view])
    ahead, behind = recorder.begin(), recorder.begin()
    for until in (1.0, 2.0):
        recorder.advance(ahead, until + 1.0)
        recorder.advance(behind, until)
        shown = msgpack.unpackb(meshcat._GetPackedTransform(robot_path(0)))["matrix"][12:15]
        own = recorder.model.diagram.GetMyContextFromRoot(behind.get_context())
        assert shown == recorder.model.diagram.GetOutputPort("bodies").Eval(own)[:3].tolist()
