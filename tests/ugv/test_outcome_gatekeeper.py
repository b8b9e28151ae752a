"""Method (d)'s gatekeeper, sample by sample: what it remembers, when it answers, and what tips the balance."""

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import LAW
from builders.worlds import world

from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import balls
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, SILENT
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.mpc_gatekeeper import GatekeeperState, Inputs
from airground_drake.ugv.outcome import Outcome, Outlook
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers, reason_of
from airground_drake.ugv.patience import Commitment, Patience

ROCK = np.array([[3.0, 0.0, 0.0]])
STAYS = Motion(np.array([0.0, 5.0]), np.array([[20.0, 0.0, 0.0], [20.0, 0.0, 0.0]]))


class Team:
    """A UGV that is to be at (20, 0), with rocks on the way and a sensing range of 4 m, and another one far away.

    The gatekeepers are called as their system calls them, a sample at a time.
    """

    def __init__(self, rocks: np.ndarray = ROCK, gone_s: float = np.inf) -> None:
        preset, patience = Motion(np.zeros(1), np.array([[20.0, 0.0, 0.0]])), Patience(most=2, rest=1.0, longest=5.0)
        around = world(("ugv", "other"), rocks)
        around = replace(around, bodies=tuple(replace(body, disappears_s=gone_s) for body in around.bodies))
        self.gate = OutcomeGatekeepers(around, LAW, [preset] * 2, Outlook(5.0), patience)
        self.memory, self.t, self.calls = GatekeeperState.empty(2), 0.0, 0

    def sees(self, proposal: Proposal | None, x: float = 20.0, other: Proposal | None = None) -> Commitment:
        self.t += 0.05
        places = np.array([[x, 0.0, 0.0], [0.0, 90.0, 0.0], [x, 0.0, 9.0]])
        repeated = self.gate.repeated(self.t, (proposal, other), places, self.memory)
        if repeated is None:
            now = Inputs(self.t, (proposal, other), places, np.zeros((3, 3)), self.gate.law)
            repeated, self.calls = self.gate.sample(now, self.memory), self.calls + 1
        self.memory = repeated
        return self.memory.commitments[0]


def test_obstacles_that_were_in_sight_stay_known() -> None:
    """Also before anything was proposed; only what is new needs a call."""
    rocks, proposal = np.concatenate([ROCK, [[22.0, 3.0, 0.0]]]), Proposal("way", 0.0, STAYS)
    team = Team(rocks)
    for x, known, calls in ((-20.0, 0, 1), (-20.0, 0, 1), (0.0, 1, 2), (0.0, 1, 2), (20.0, 2, 3), (40.0, 2, 3)):
        team.sees(None, x)
        assert (team.memory.sensed[0].sum(), team.calls) == (known, calls)
    told = team.gate._believed(np.array([40.0, 0.0, 0.0]), team.memory.sensed[0], proposal)
    assert team.memory.sensed[0].all()
    assert not len(told)


def test_an_obstacle_is_forgotten_at_the_sample_at_which_it_disappears() -> None:
    """Though nothing is proposed, and the UGV leaves at once."""
    team = Team(gone_s=0.2 + 0.9 * SAME_S)
    for x, known in ((0.0, 1), (0.0, 1), (0.0, 1), (0.0, 0), (40.0, 0)):
        team.sees(None, x)
        assert team.memory.sensed.sum() == known


def test_an_obstacle_that_nobody_knew_is_a_reason_to_look_again_and_costs_no_try() -> None:
    """The second rock comes into sight under way, on the map or not."""
    way = Motion(np.array([0.0, 3.0, 6.0]), np.array([[0.0, 0.0, 0.0], [3.0, 3.0, 0.0], [20.0, 3.0, 0.0]]))
    rocks = np.concatenate([ROCK, [[7.0, 1.0, 0.0]]])
    for mapped, looked in ((rocks[:1], [True, False, True, False]), (rocks, [True, False, False, False])):
        team, again = Team(rocks), []
        proposal = Proposal("way", 0.0, way, mapped=balls(mapped), number=0)
        for x in (0.0, 0.1, 3.5, 3.6):
            assert team.sees(proposal, x).tries == 1
            again += [decision.accept is not None for decision in team.memory.decisions]
        assert again == looked


def test_a_favour_is_done_unless_it_strands_the_ugv() -> None:
    way = np.zeros((2, 3))
    plain, stranded = Outcome(way, False, 0.0, 2.0), Outcome(way, True, 1.0, 2.0)
    assert reason_of(plain, plain, favour=True) == "makes_way"
    assert reason_of(plain, stranded, favour=True) == "stalls"
    assert reason_of(plain, plain, favour=False) == "not_cheaper"


def making_way(number: int, cause: str = "other") -> Proposal:
    return Proposal("way", 0.05 * number, STAYS, cause=cause, number=number)


@pytest.mark.parametrize(("cause", "answer"), [("", REFUSE), ("ugv", REFUSE), ("uav", REFUSE), ("other", ACCEPT)])
def test_only_another_ugv_is_made_way_for(cause: str, answer: float) -> None:
    """The first sample decides; a motion that keeps the UGV where it stands anyway is refused."""
    team = Team()
    team.sees(making_way(0, cause))
    assert team.memory.answers[0] == answer
    assert [decision.reason for decision in team.memory.decisions] == [
        "makes_way" if cause == "other" else "not_cheaper"
    ]


def test_a_part_of_a_joint_plan_is_judged_by_its_own_ugv_alone() -> None:
    team = Team()
    motion = Motion(STAYS.times, np.array([[0.0, 90.0, 0.0]] * 2))
    parts = [replace(making_way(number, "other"), party=("other", "ugv")) for number in (0, 1)]
    turn = team.sees(parts[0], other=replace(parts[1], motion=motion))
    assert [each.reason for each in team.memory.decisions] == ["makes_way", "not_cheaper"]
    assert team.memory.answers == (ACCEPT, 0.0, REFUSE, 1.0)
    assert turn.executing


def test_a_withdrawal_is_noticed_when_nothing_else_is_proposed() -> None:
    team = Team()
    assert team.sees(making_way(0)).executing
    turn = team.sees(None)
    assert (turn.executing, turn.since) == (False, team.t)
    assert team.memory.answers[:2] == (SILENT, -1.0)


@pytest.mark.parametrize(("end", "answer"), [(2.0, DONE), (9.0, REFUSE)])
def test_an_accepted_proposal_is_over_with_its_motion_or_after_the_longest_try(end: float, answer: float) -> None:
    team, way = Team(), Motion(np.array([0.0, end]), STAYS.positions)
    proposal = Proposal("way", 0.0, way, cause="other", number=0)
    while team.sees(proposal).executing:
        assert team.memory.answers[0] == ACCEPT
    assert team.t == pytest.approx(min(end, 5.05), abs=0.051)  # the longest try of 5 s begins at the first sample
    assert [decision.reason for decision in team.memory.decisions] == ["over"]
    for k in range(1, 4):  # also while another UGV decides
        assert team.memory.answers[0] == answer
        assert not team.sees(proposal, other=Proposal("way", 0.0, STAYS, number=k)).executing
    assert Patience(1, 2.0, 5.0).rested(Commitment(tries=1, since=1.0), 3.0).tries == 0


@pytest.mark.parametrize("end", [0.0, 0.05])
def test_a_proposal_that_comes_after_its_motion_is_over_and_costs_no_try(end: float) -> None:
    team = Team()
    turn = team.sees(Proposal("way", 0.0, Motion(np.array([-2.0, end]), STAYS.positions), cause="other", number=0))
    assert (turn.executing, turn.tries, team.memory.answers[0]) == (False, 0, DONE)
    assert [decision.reason for decision in team.memory.decisions] == ["over"]
