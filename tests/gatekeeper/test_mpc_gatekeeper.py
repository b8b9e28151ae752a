"""Method (c)'s gatekeeper, sample by sample: since when an answer stands."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from builders.worlds import world

from airground_drake.gatekeeper.answer import Decision, Rules
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.mpc_gatekeeper import GatekeeperState, Inputs, PaperGatekeepers
from airground_drake.gatekeeper.problem import Horizon
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw


class Agreeing(PaperGatekeepers):
    """Accepts everything."""

    def _decide(
        self, now: Inputs, before: GatekeeperState, i: int, proposal: Proposal, budgets: Iterator[Budget]
    ) -> Decision:
        return Decision(now.t, i, proposal, True, "cheaper")


def test_the_dwell_of_an_answer_begins_anew_with_each_proposal() -> None:
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=True)
    motion = Motion(np.zeros(1), np.zeros((1, 3)))
    rules = Rules(switching_margin=0.1, min_dwell=0.2)
    gate = Agreeing(world(("ugv",)), law, [motion], RelaxedRoute(), Horizon(4, 1, 1.0, 1.0, 0.0), rules)
    state = GatekeeperState.empty(1)
    since = []
    for k, number in enumerate((0, 0, 1, 1)):
        proposal = Proposal("way", 0.0, motion, number=number)
        state = gate.sample(Inputs(0.05 * (k + 1), (proposal,), np.zeros((2, 3)), np.zeros((2, 3)), law), state)
        assert state.answers == (ACCEPT, number)
        since.append(state.since[0])
    assert since == [0.05, 0.05, 0.05 * 3, 0.05 * 3]
