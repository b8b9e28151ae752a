"""Method (d)'s gatekeeper, sample by sample: what it remembers, when it answers, and what tips the balance."""

from __future__ import annotations

import numpy as np
import pytest
from builders.worlds import world

from airground_drake.gatekeeper.mpc_gatekeeper import GatekeeperState, Inputs
from airground_drake.gatekeeper.outcome import Outcome, Outlook
from airground_drake.gatekeeper.outcome_gatekeeper import OutcomeGatekeepers, reason_of
from airground_drake.gatekeeper.patience import Commitment, Patience
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw

ROCK = np.array([[3.0, 0.0, 0.0]])
STAYS = Motion(np.array([0.0, 5.0]), np.array([[20.0, 0.0, 0.0], [20.0, 0.0, 0.0]]))


def gatekeepers(*ugvs: str, rocks: np.ndarray = ROCK) -> OutcomeGatekeepers:
    """Of UGVs that are to be at (20, 0), with a rock on the way and a sensing range of 4 m."""
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)
    patience = Patience(most=2, rest=1.0, longest=5.0)
    preset = Motion(np.zeros(1), np.array([[20.0, 0.0, 0.0]]))
    return OutcomeGatekeepers(world(ugvs, rocks), law, [preset] * len(ugvs), Outlook(5.0), patience)


def sampled(
    gate: OutcomeGatekeepers, t: float, x: float, proposal: Proposal | None, memory: GatekeeperState
) -> GatekeeperState:
    places = np.array([[x, 0.0, 0.0], [x, 0.0, 2.0]])
    return gate.sample(Inputs(t, (proposal,), places, np.zeros((2, 3)), gate.law), memory)


@pytest.mark.parametrize(("passed", "known"), [(True, 1), (False, 0)])
def test_an_obstacle_that_was_in_sight_is_known_when_it_is_out_of_it(passed: bool, known: int) -> None:
    gate, proposal = gatekeepers("ugv"), Proposal("way", 0.0, STAYS)
    memory = sampled(gate, 0.0, 0.0 if passed else 20.0, None, GatekeeperState.empty(1))
    memory = sampled(gate, 0.05, 20.0, None, memory)
    discs, _ = gate._known(np.array([20.0, 0.0, 0.0]), memory.sensed[0], 0, proposal)
    assert discs.tolist() == ROCK[:known].tolist()


def test_what_was_in_sight_before_anything_was_proposed_is_known() -> None:
    """The gatekeepers are called as their system calls them."""
    gate, memory = gatekeepers("ugv"), GatekeeperState.empty(1)
    called = []
    for k, x in enumerate((-20.0, -20.0, 0.0, 0.0, 20.0)):
        places = np.array([[x, 0.0, 0.0], [x, 0.0, 2.0]])
        if not gate.idle((None,), places, memory):
            memory = sampled(gate, 0.05 * k, x, None, memory)
            called.append(k)
    assert called == [0, 2]
    assert memory.sensed.tolist() == [[True]]


def test_what_comes_into_sight_does_not_replace_what_was() -> None:
    rocks = np.concatenate([ROCK, [[22.0, 3.0, 0.0]]])
    gate, memory = gatekeepers("ugv", rocks=rocks), GatekeeperState.empty(1)
    for t, x, known in ((0.0, 0.0, [True, False]), (0.05, 20.0, [True, True]), (0.1, 40.0, [True, True])):
        memory = sampled(gate, t, x, None, memory)
        assert memory.sensed.tolist() == [known]


def test_the_first_sample_decides_and_what_makes_no_difference_is_refused() -> None:
    """The motion keeps the UGV where it stands anyway."""
    memory = sampled(gatekeepers("ugv"), 0.05, 20.0, Proposal("way", 0.0, STAYS), GatekeeperState.empty(1))
    assert [decision.reason for decision in memory.decisions] == ["not_cheaper"]
    assert memory.answers == (REFUSE, -1.0)


def test_an_obstacle_that_nobody_knew_is_a_reason_to_look_again_and_costs_no_try() -> None:
    """The second rock comes into sight under way, on the map or not."""
    way = Motion(np.array([0.0, 3.0, 6.0]), np.array([[0.0, 0.0, 0.0], [3.0, 3.0, 0.0], [20.0, 3.0, 0.0]]))
    rocks = np.concatenate([ROCK, [[7.0, 1.0, 0.0]]])
    for mapped, looked in ((rocks[:1], [True, False, True, False]), (rocks, [True, False, False, False])):
        gate, memory = gatekeepers("ugv", rocks=rocks), GatekeeperState.empty(1)
        proposal = Proposal("way", 0.0, way, mapped=mapped, mapped_radii=np.zeros(len(mapped)), number=0)
        decisions = []
        for k, x in enumerate((0.0, 0.1, 3.5, 3.6)):
            memory = sampled(gate, 0.05 * k, x, proposal, memory)
            decisions += memory.decisions
        assert [decision.accept is not None for decision in decisions] == looked
        assert [decision.tries for decision in decisions] == [1, 1, 1, 1]
        assert memory.commitments[0].tries == 1


def test_a_favour_is_done_unless_it_strands_the_ugv() -> None:
    way = np.zeros((2, 3))
    plain, stranded = Outcome(way, False, 0.0, 2.0), Outcome(way, True, 1.0, 2.0)
    assert reason_of(plain, plain, favour=True) == "makes_way"
    assert reason_of(plain, stranded, favour=True) == "stalls"
    assert reason_of(plain, plain, favour=False) == "not_cheaper"


@pytest.mark.parametrize(("cause", "answer"), [("", REFUSE), ("ugv", REFUSE), ("uav", REFUSE), ("other", ACCEPT)])
def test_only_another_ugv_is_made_way_for(cause: str, answer: float) -> None:
    gate = gatekeepers("ugv", "other")
    places = np.array([[20.0, 0.0, 0.0], [0.0, 9.0, 0.0], [20.0, 0.0, 9.0]])
    proposal = Proposal("way", 0.0, STAYS, cause=cause)
    memory = gate.sample(Inputs(0.05, (proposal, None), places, np.zeros((3, 3)), gate.law), GatekeeperState.empty(2))
    assert memory.answers[0] == answer


def making_way(issued: float, cause: str = "other") -> Proposal:
    """One that "ugv" accepts as a favour to the other; with its own name for the cause it refuses."""
    return Proposal("way", issued, STAYS, cause=cause, number=round(issued / 0.05))


class Pair:
    """Two UGVs, of which the first is asked to make way; time goes on by a sample at a time."""

    def __init__(self) -> None:
        self.gate = gatekeepers("ugv", "other")
        self.places = np.array([[20.0, 0.0, 0.0], [0.0, 9.0, 0.0], [20.0, 0.0, 9.0]])
        self.memory, self.t = GatekeeperState.empty(2), 0.0

    def sees(self, proposal: Proposal | None) -> Commitment:
        self.t += 0.05
        if not self.gate.idle((proposal, None), self.places, self.memory):
            now = Inputs(self.t, (proposal, None), self.places, np.zeros((3, 3)), self.gate.law)
            self.memory = self.gate.sample(now, self.memory)
        return self.memory.commitments[0]


def test_a_withdrawal_is_noticed_when_nothing_else_is_proposed() -> None:
    pair = Pair()
    assert pair.sees(making_way(0.0)).executing
    turn = pair.sees(None)
    assert not turn.executing
    assert turn.since == pair.t
    assert pair.memory.answers[:2] == (SILENT, -1.0)


def test_a_replaced_proposal_ends_its_try_whatever_becomes_of_the_next() -> None:
    pair = Pair()
    assert pair.sees(making_way(0.0)).executing
    turn = pair.sees(making_way(0.05, cause="ugv"))
    assert pair.memory.answers[0] == REFUSE
    assert (turn.executing, turn.tries, turn.since) == (False, 1, pair.t)


def test_a_ugv_rests_while_proposals_keep_coming() -> None:
    """It refuses them as exhausted, and accepts the first one after its rest."""
    pair = Pair()
    issued, said = 0.0, []
    for _ in range(60):
        pair.sees(making_way(issued))
        said.append(pair.memory.decisions[-1].reason)
        issued = round(issued + 0.05, 9)  # a new one each time
    first = said.index("exhausted")
    assert said[:first] == ["makes_way"] * 2
    again = first + said[first:].index("makes_way")
    assert set(said[first:again]) == {"exhausted"}
    assert again - first == pytest.approx(1.0 / 0.05, abs=1)  # a rest of 1 s
