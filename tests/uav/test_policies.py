"""Policies in whole runs: what goes wrong in one is reported, and nothing wrong gets past method (d)."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.observations import mate, seen
from sim.blocks.both_programs import found
from timeline import kinds

from airground_drake.base.registry import POLICIES
from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.schema import Policy as PolicyEntry
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.uav.database import BehaviourDatabase, Negotiation, Ranking
from airground_drake.uav.policy import Observation, Policy
from airground_drake.uav.wrong import Hostile


class Raises(Policy):
    def propose(self, seen: Observation) -> Motion | None:
        raise RuntimeError("no plan")


class Returns(Policy):
    def __init__(self, found: object) -> None:
        self.found = found

    def propose(self, seen: Observation) -> Any:
        return self.found(seen) if callable(self.found) else self.found


def along(end: float, lasts: float) -> Callable[[Observation], Motion]:
    """Straight from where the UGV is, to a place on the x-axis, m, in so many s."""
    return lambda seen: Motion(seen.start + np.array([0.0, lasts]), np.array([seen.position, [end, 0.0, 0.0]]))


@pytest.mark.parametrize(
    "found",
    [
        "left",
        lambda seen: Motion(np.array([seen.start]), np.full((1, 3), np.nan)),
        along(1.0, 1e-12),  # a leg as short as times of a run are rounded
        along(1e308, 1.0), along(1e155, 1.0), along(-1e10, 1.0), along(1.0, 1e10),
    ],
)  # fmt: skip
def test_what_is_no_motion_counts_as_no_intervention(found: object) -> None:
    sight = seen([mate("a", (0, 0), (10, 0))])
    talks, faults = BehaviourDatabase([("broken", Returns(found))]).plan(Negotiation(), sight)
    assert [talk.proposal for talk in talks.values()] == [None]
    assert [fault.policy for fault in faults] == ["broken"]


def test_after_a_failure_the_next_policy_is_asked(case_a: Scenario) -> None:
    case_a.intervention.policies.insert(0, PolicyEntry("broken", {}))
    case_a.duration_s = 16.0
    with POLICIES.adding("broken", Raises):
        of_run = simulate(case_a, "d")
    assert "proposal" in kinds(of_run, "ugv1")
    assert re.fullmatch(r"test_policies\.py:\d+ RuntimeError: no plan", of_run.meta["faults"][0]["what"])


class Counts(Returns):
    def propose(self, seen: Observation) -> Any:
        self.remembered = (self.remembered or 0) + 1
        return super().propose(seen)


@pytest.mark.parametrize("ranking", ["listed", "predicted"])
def test_after_a_refusal_the_next_policy_is_asked_and_remembers_its_own(ranking: Ranking) -> None:
    policies = [("nearer", Counts(along(9.0, 9.0))), ("near", Counts(along(5.0, 9.0)))]
    database, memories = BehaviourDatabase(policies, ranking=ranking), {1: 4}
    held = database.after_refusal(Negotiation(too_fast=1), 9.0, too_fast=True)
    talks, _ = database.plan(held, seen([mate("a", (0, 0), (10, 0))]), memories)
    proposal = talks["a"].proposal
    assert proposal is not None
    assert (proposal.policy, held.too_fast, memories[1]) == ("near", 2, 5)


class Hangs(Policy):
    def propose(self, seen: Observation) -> Motion | None:
        while True:
            try:
                sum(range(1000))
            except Exception:
                continue


def test_a_policy_that_hangs_is_stopped_and_reported(case_a: Scenario) -> None:
    case_a.intervention.policies.insert(0, PolicyEntry("hangs", {}))
    case_a.intervention.budget_s, case_a.duration_s = 0.05, 16.0
    with POLICIES.adding("hangs", Hangs):
        of_run = simulate(case_a, "d")
    assert "proposal" in kinds(of_run, "ugv1")
    assert "OutOfTime" in of_run.meta["faults"][0]["what"]


@pytest.mark.parametrize("ranking", ["listed", "predicted"])
def test_the_ranking_decides_what_is_proposed_first(case_a: Scenario, ranking: str) -> None:
    wrong = PolicyEntry("towards", {"x_m": 4.0, "y_m": 7.0, "speed_m_s": 2.0})
    case_a.intervention.policies.insert(0, wrong)
    case_a.intervention.ranking, case_a.duration_s = ranking, 16.0
    of_run = simulate(case_a, "d")
    first = next(event for event in of_run.events if event["kind"] == "proposal")
    assert first["policy"] == ("towards" if ranking == "listed" else "detour")


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("hostile", {"speed_m_s": 3.0}),
        ("noisy", {"speed_m_s": 2.8, "noise_m": 1.0}),
        ("stale_map", {"speed_m_s": 2.8}),
        ("towards", {"x_m": 1.7, "y_m": 4.0, "speed_m_s": 3.0}),
    ],
)
def test_no_wrong_policy_gets_past_method_d(case_a: Scenario, name: str, parameters: dict[str, float]) -> None:
    case_a.intervention.policies = [PolicyEntry(name, parameters)]
    case_a.obstacles["obstacle_2"].known_to_uav = False
    case_a.gatekeeper.error_weight_1_m2_s = 500.0  # accepts nearly anything
    case_a.duration_s = 20.0
    of_run = simulate(case_a, "d")
    assert "proposal" in kinds(of_run, "ugv1")
    assert found(of_run, "SAFE-TRACE", "SAFE-HYP") == {"SAFE-TRACE": "holds", "SAFE-HYP": "holds"}


def test_the_hostile_policy_stays_where_it_is_hardly_away_from_its_goal() -> None:
    """As a robot does that a rounding error parts from it (a leg of 3.6e-15 s had no velocity to speak of)."""
    there = mate("one", [5.592841433684655, 5.2172957826435375], [9.0, 9.0])
    sight = replace(seen([there]), others=np.array([[5.592841433684654, 5.217295782643537, 0.0]]))
    motion = Hostile(speed_m_s=0.5).propose(sight)
    assert motion is not None
    assert np.diff(motion.times).min() > 1.0
