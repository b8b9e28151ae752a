"""Method (c)'s gatekeeper, sample by sample: since when an answer stands."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from builders.worlds import world

from airground_drake.gatekeeper.answer import Decision, Foreseen, Rules
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.mpc_gatekeeper import Judging, Memory, PaperGatekeepers, View
from airground_drake.gatekeeper.problem import Horizon
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw


class Agreeing(PaperGatekeepers):
    """Accepts everything."""

    def _decide(self, seen: View, i: int, proposal: Proposal, budgets: Iterator[Budget]) -> Decision:
        return Decision(seen.t, i, proposal, True, "cheaper", Foreseen())


def test_the_dwell_of_an_answer_begins_anew_with_each_proposal() -> None:
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=True)
    motion = Motion(np.zeros(1), np.zeros((1, 3)))
    judging = Judging(RelaxedRoute(), Horizon(4, 1, 1.0, 1.0, 0.0), Rules(switching_margin=0.1, min_dwell=0.2), 0.05)
    gate, memory = Agreeing(world(("ugv",)), law, [motion], judging), Memory.empty(1)
    since = []
    for k, number in enumerate((0, 0, 1, 1)):
        proposal = Proposal("way", 0.0, motion, number=number)
        memory = gate.sample(0.05 * (k + 1), (proposal,), np.zeros((2, 3)), np.zeros((2, 3)), memory)
        assert memory.answers == (ACCEPT, number)
        since.append(memory.since[0])
    assert since == [0.05, 0.05, 0.05 * 3, 0.05 * 3]
