"""Method (c): from a solution to an answer, and since when it stands."""

from typing import Any

import numpy as np
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.uav.messages import ACCEPT, REFUSE
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import Rules, settle
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.mpc_gatekeeper import GatekeeperState, Inputs, PaperGatekeepers
from airground_drake.ugv.problem import Horizon, Problem
from airground_drake.ugv.solution import Solution, Status

RULES = Rules(switching_margin=0.1, min_dwell=0.2)
COSTS = st.floats(0.1, 100.0)


def solution(accept: float, refuse: float, status: Any = "optimal") -> Solution:
    return Solution(accept < refuse, status, objective=min(accept, refuse))


@given(COSTS, COSTS, st.tuples(COSTS, COSTS), st.floats(0.0, 0.5), st.sampled_from([ACCEPT, REFUSE]))
def test_once_reversed_the_same_costs_do_not_reverse_an_answer_back(
    accept: float, refuse: float, kept: tuple[float, float], margin: float, standing: float
) -> None:
    rules = Rules(switching_margin=margin)
    accepted, _ = settle(solution(accept, refuse), kept, standing, 1.0, rules)
    assert settle(solution(accept, refuse), kept, ACCEPT if accepted else REFUSE, 1.0, rules)[1] == "kept"


class Agreeing:
    status: Status = "optimal"

    def solve(self, problem: Problem, budget: Budget) -> Solution:
        return Solution(True, self.status, objective=-1.0)


class NotFinite(Agreeing):
    status = "refused_not_finite"


def test_without_a_plan_it_is_refused_and_no_costs_are_told() -> None:
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=True)
    motion = Motion(np.zeros(1), np.zeros((1, 3)))
    gate = PaperGatekeepers(world(("ugv",)), law, [motion], NotFinite(), Horizon(4, 1, 1.0, 1.0), RULES)
    now = Inputs(0.05, (Proposal("way", 0.0, motion, number=0),), np.zeros((2, 3)), np.zeros((2, 3)), law)
    (decision,) = gate.sample(now, GatekeeperState.empty(1)).decisions
    assert (decision.accepted, decision.throughout) == (False, (-1.0, -1.0))


def test_the_dwell_of_an_answer_begins_anew_with_each_proposal() -> None:
    law, places = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=True), np.zeros((2, 3))
    motion = Motion(np.zeros(1), places[:1])
    gate = PaperGatekeepers(world(("ugv",)), law, [motion], Agreeing(), Horizon(4, 1, 1.0, 1.0), RULES)
    state, since = GatekeeperState.empty(1), []
    for k, number in enumerate((0, 0, 1, 1)):
        proposal = Proposal("way", 0.0, motion, number=number)
        state = gate.sample(Inputs(0.05 * (k + 1), (proposal,), places, places, law), state)
        assert state.answers == (ACCEPT, number)
        since.append(state.since[0])
    assert since == [0.05, 0.05, 0.05 * 3, 0.05 * 3]
