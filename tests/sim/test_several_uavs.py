"""Several UAVs: each in charge of its UGVs, apart from each other, and one of them lost."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from builders.edits import moved, with_scenario
from builders.misbuilt import distances
from oracles import ORACLES, faults_of
from pydrake.systems.analysis import Simulator
from verify.judging import decided

from airground_drake.check.scenario import pairs_of
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.diagram import build_diagram, make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.study.environments.episode import Episode, Stage, with_agent
from airground_drake.uav.coordinate import Coordinate
from airground_drake.uav.policy import Observation
from airground_drake.verify.pair_kinds import apart
from airground_drake.verify.proofs.export import demands
from airground_drake.verify.runs.proposals import proposals_of

Run = Callable[..., Trace]
CROSSED = {
    "uavs.north.ugvs": ["ugv1", "ugv3", "ugv5", "ugv7"],
    "uavs.south.ugvs": ["ugv2", "ugv4", "ugv6", "ugv8"],
    "uavs.north.target_m": [-1.0, 0.0, 3.0],
    "uavs.south.target_m": [1.0, 0.0, 3.0],
}
"""Both teams have their centroid at the same place, over which both UAVs are to fly."""


@pytest.fixture(scope="module")
def trace(run: Run) -> Trace:
    return run("two_uavs", "d")


@pytest.fixture(scope="module")
def lost_s(trace: Trace) -> float:
    return trace.scenario.aerial["south"].lost_at_s


@pytest.fixture(scope="module")
def crossed() -> Trace:
    return simulate(load("two_uavs", {**CROSSED, "duration_s": 6.0}), "a")


@pytest.mark.parametrize("setting", ["uav.lost_at_s=5", "intervention.policies=[]"])
def test_a_uav_that_is_lost_or_has_no_policies_helps_nobody(run: Run, setting: str) -> None:
    trace = run("crossing", "d", set=[setting, "duration_s=15"])
    assert trace.proposals.empty
    assert {decided(claim, trace).status for claim in ("GATE-PLAN", "LIVE-HYP")} == {"holds"}  # nobody was asked
    assert not {event["robot"] for event in trace.events if event["kind"] == "arrival"} - {"uav"}
    assert not faults_of(trace)


@pytest.mark.parametrize(
    ("method", "lost_at_s"), [("b", 8.23), ("b", 12.0), pytest.param("c", 12.0, marks=pytest.mark.slow)]
)
def test_other_methods_forget_what_a_lost_uav_asked_at_its_end_too(method: str, lost_at_s: float) -> None:
    over = {"runs": {method: {"method": method}}, "uavs.south.lost_at_s": lost_at_s, "duration_s": 20.0}
    trace = simulate(load("two_uavs", {**over, "gatekeeper.blocks": 6}), method)  # plans of few variables
    assert proposals_of(trace)
    assert not faults_of(trace)


def test_uavs_keep_apart(crossed: Trace) -> None:
    away = np.linalg.norm(crossed.position("north") - crossed.position("south"), axis=1)
    assert 1.0 - 1e-9 < away.min() < 1.0 + 1e-3
    assert decided("SAFE-HYP", crossed).evidence["inequalities_that_bind"]["uav beside uav"] > 0
    assert not faults_of(crossed)
    row = int(away.argmin())
    towards = 0.01 * (crossed.position("south") - crossed.position("north"))[row]
    assert decided("SAFE-TRACE", moved(crossed, "north", row, towards.tolist())).status == "refuted"
    wider = with_scenario(crossed, safe_distance__uav_m=1.2)
    assert (decided("SAFE-TRACE", wider).status, decided("SAFE-HYP", wider).status) == ("refuted", "refuted")


def test_the_distance_between_uavs_that_controllers_are_built_with_is_read_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    distances(0.9999, "uav")(monkeypatch)
    found = decided("SAFE-HYP", simulate(load("two_uavs", {"duration_s": 1.0}), "a"))
    about = {"controller": "uav_controller_north", "parameter": "safe_m", "robot": "north", "other": "south"}
    assert found.status == "refuted"
    assert about.items() <= (found.counterexample or {}).items(), found.counterexample


def test_checker_claims_and_theorems_ask_for_the_same_distances() -> None:
    scenario = load("two_uavs")
    asked = {(pair.first, pair.second): pair.required_m for pair in apart(scenario)}
    checked = {(pair.robot, pair.other): pair.gap_m for pair in pairs_of(resolved(scenario))}
    exported = {(demand.first, demand.second): float(demand.required_m) for demand in demands(scenario)}
    assert asked == checked == exported
    assert asked["north", "south"] == scenario.safe_distance.uav_m
    assert [pair.kind for pair in apart(scenario) if pair.first == "north" and pair.second == "south"] == ["uav_uav"]


def test_withdrawals_of_lost_uavs_are_noticed(trace: Trace, lost_s: float) -> None:
    gone = {"kind": "withdrawal", "about": 1, "sent_s": lost_s + 1.0, "sender": "south", "receiver": "ugv6"}
    row = trace.messages[trace.messages["kind"] == "withdrawal"].iloc[[0]].assign(**gone)
    more = replace(trace, messages=pd.concat([trace.messages, row]))
    for forged in (more, with_scenario(trace, uavs__south__lost_at_s=0.0)):
        assert "withdrawn at another time" in {fault.what for fault in ORACLES["protocol"](forged)}


def test_plans_treat_what_other_uavs_ask_as_moving(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Observation] = []
    right = Coordinate.propose

    def watched(self: Coordinate, observation: Observation) -> object:
        seen.append(observation)
        return right(self, observation)

    monkeypatch.setattr(Coordinate, "propose", watched)
    scenario = load("two_uavs", {"duration_s": 9.0})
    simulate(scenario, "d")
    asked = {
        (mate.name, mate.proposal.sender)
        for observation in seen for mate in observation.team if mate.proposal is not None and not mate.in_charge
    }  # fmt: skip
    assert asked
    for observation in seen:
        own_ugvs = {mate.name for mate in observation.team if mate.in_charge}
        assert own_ugvs == {
            *scenario.in_charge("north" if observation.robot in scenario.in_charge("north") else "south")
        }
        for mate in observation.team:
            assert mate.proposal is None or (mate.proposal.sender in scenario.aerial)


def test_the_loop_leaves_several_uavs_to_drake() -> None:
    scenario = load("two_uavs", {"duration_s": 2.0})
    with pytest.raises(LeftToDrakeError, match="several UAVs"):
        Batch(scenario, "d")
    with pytest.raises(LeftToDrakeError, match="lost"):
        Batch(load("crossing", {"uav.lost_at_s": 1.0}), "d")
    assert simulate(scenario, "d", engine="batch").states.equals(simulate(scenario, "d").states)


def test_a_monitor_knows_the_laws_of_all_uavs() -> None:
    scenario = load("two_uavs", {**CROSSED, "duration_s": 3.0})
    diagram = build_diagram(scenario, "a", monitor=make_monitor(scenario, "a"))
    simulator = Simulator(diagram)
    simulator.get_mutable_context().SetAccuracy(1e-6)
    simulator.AdvanceTo(3.0)
    assert diagram.GetOutputPort("violation").Eval(diagram.GetMyContextFromRoot(simulator.get_context()))[0] == 0.0


def test_an_environment_asks_for_the_ugvs_of_all_uavs() -> None:
    scenario = with_agent(load("two_uavs", {"duration_s": 9.0}), "d")
    episode = Episode(Stage(scenario, "d"))
    asked = set[str]()
    while requests := episode.requests():
        for ugv in requests:
            asked.add(ugv)
            episode.answer(ugv, None)
    assert asked & {*scenario.in_charge("north")}
    assert asked & {*scenario.in_charge("south")}


def test_one_uav_among_uavs_is_as_uav() -> None:
    given = resolved(load("case_a"))
    kite = given.pop("uav") | {"name": "uav"}
    alone = simulate(load("case_a", {"duration_s": 8.0}), "d")
    spelled = from_data(given | {"uavs": {"uav": kite}, "duration_s": 8.0, "choices": []}, "test")
    assert simulate(spelled, "d").states.equals(alone.states)
