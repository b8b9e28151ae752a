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


def sampled(route: Agreeing, t: float, number: int, before: GatekeeperState) -> GatekeeperState:
    """After a sample at which a UGV is asked to stay where it is."""
    law, places = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=True), np.zeros((2, 3))
    stays = Motion(np.zeros(1), places[:1])
    gate = PaperGatekeepers(world(("ugv",)), law, [stays], route, Horizon(4, 1, 1.0, 1.0), RULES)
    return gate.sample(Inputs(t, (Proposal("way", 0.0, stays, number=number),), places, places, law), before)


def test_without_a_plan_it_is_refused_and_no_costs_are_told() -> None:
    (decision,) = sampled(NotFinite(), 0.05, 0, GatekeeperState.empty(1)).decisions
    assert (decision.accepted, decision.throughout) == (False, (-1.0, -1.0))


def test_the_dwell_of_an_answer_begins_anew_with_each_proposal() -> None:
    state, since = GatekeeperState.empty(1), []
    for k, number in enumerate((0, 0, 1, 1)):
        state = sampled(Agreeing(), 0.05 * (k + 1), number, state)
        assert state.answers == (ACCEPT, number)
        since.append(state.since[0])
    assert since == [0.05, 0.05, 0.05 * 3, 0.05 * 3]
