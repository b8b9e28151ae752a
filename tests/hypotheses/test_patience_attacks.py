"""UAVs that waste a UGV's time, against the running `OutcomeGatekeepers`: they keep the bound of LIVE-WAIT.

The gatekeeper's roll-outs are replaced, as a lying map could do: refusing stalls and accepting does not. For proposals
that ask it to make way, accepting is worse. The UAV proposes and withdraws long and short motions at will. The
gatekeepers are called as their system calls them: not while they are idle. A count of tries is kept beside theirs: a
new proposal must be accepted while tries are left, also after every rest, and else refused.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders.worlds import world

from airground_drake.base.arrays import Array
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.report.audit.companions import Believing
from airground_drake.scenario.load import load
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, answer_to
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.mpc_gatekeeper import GatekeeperState, Inputs
from airground_drake.ugv.outcome import Outcome, Outlook
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.patience import Patience
from airground_drake.ugv.rollout import View
from airground_drake.verify.claims.live_wait import LiveWait

MOST_SAMPLES = 20_000
"""Of each attack: else as many as all tries with a rest after each take, and a fifth more."""
BRIEF_S = 1.0
"""Time after which the attack of that name withdraws."""
UGV, OTHER = "ugv", "other"
FAVOURS = {"favours": OTHER, "favours to nobody": "nobody", "favours to itself": UGV}
"""Attacks by proposals that are of no use to the UGV, and the cause that they name."""
FORGED = ("favours to nobody", "favours to itself")
"""Those that no UGV goes along with: there is nobody to make way for."""


class Unmoved(Believing):
    """Sees no use in any proposal, and nothing that speaks against a favour."""

    def foresee(self, seen: View, law: UgvLaw, proposal: Proposal) -> tuple[Outcome, Outcome]:
        refuse, accept = super().foresee(seen, law, proposal)
        return Outcome(refuse.positions, False, 0.0, 1.0), Outcome(accept.positions, False, 0.0, 2.0)


class Outcomes(NamedTuple):
    """What an attack came to.

    Attributes:
        executed_s: longest time executed between two rests.
        reasons: of the decisions.
        unexpected: number of wrong answers.
    """

    executed_s: float
    reasons: set[str]
    unexpected: int


ATTACKS = ("endless", "greedy", "random", "brief", *FAVOURS)


def attacks(patience: Patience, period: float, names: Sequence[str] = ATTACKS) -> dict[str, Outcomes]:
    return {name: _attack(name, patience, period) for name in names}


def _attack(name: str, patience: Patience, period: float) -> Outcomes:
    rng = np.random.default_rng(len(name))
    preset = Motion(np.zeros(1), np.zeros((1, 3)))
    law = UgvLaw(Avoidance(1.0, period), 1.0, 1.0, intervention_on_top=False)
    kind = Unmoved if name in FAVOURS else Believing
    gatekeepers = kind(world((UGV, OTHER), max_speed=1.0), law, [preset] * 2, Outlook(patience.longest), patience)
    memory, proposal, place = GatekeeperState.empty(2), None, np.zeros(3)
    accepted, executed, worst, unexpected = False, 0.0, 0.0, 0
    left, alone = patience.most, 0.0
    reasons: set[str] = set()
    for k in range(min(MOST_SAMPLES, int(1.2 * patience.most * (patience.longest + patience.rest) / period))):
        t, before, asked = k * period, accepted, proposal
        proposal = _next(name, proposal, memory, t, rng, patience)
        if proposal is not None and proposal is not asked:
            proposal = replace(proposal, number=k)
        if proposal is not None:
            place = proposal.motion.at(t)[0]
        if before:
            executed += period
            worst = max(worst, executed)
        positions = np.stack([place] * 3)
        repeated = gatekeepers.repeated(t, (proposal, None), positions, memory)
        now = Inputs(t, (proposal, None), positions, np.zeros((3, 3)), law)
        memory = gatekeepers.sample(now, memory) if repeated is None else repeated
        reasons |= {decision.reason for decision in memory.decisions}
        accepted = answer_to(proposal, memory.answers, 0) == ACCEPT
        if before and not (accepted and proposal is asked):
            alone = t
        if proposal is None or proposal is asked:
            continue
        if t >= alone + patience.rest:
            left, executed = patience.most, 0.0
        unexpected += accepted != (left > 0 and name not in FORGED)
        left -= accepted
    return Outcomes(worst, reasons, unexpected)


def _next(
    name: str,
    proposal: Proposal | None,
    memory: GatekeeperState,
    t: float,
    rng: np.random.Generator,
    patience: Patience,
) -> Proposal | None:
    """What the UAV proposes now: a new one when the last is refused, withdrawn or replaced."""
    refused = memory.answers[0] in (REFUSE, DONE)
    if name == "brief":
        begun = t % (BRIEF_S + 1.1 * patience.rest)
        if begun >= BRIEF_S:
            return None
        return proposal if proposal is not None else _proposal(name, t, 2.0 * patience.longest, rng)
    if proposal is not None and not refused:
        if name == "greedy" and t >= proposal.issued + 0.9 * patience.longest:
            return _proposal(name, t, 2.0 * patience.longest, rng)
        return proposal if name != "random" or rng.random() > 0.01 else None
    if name == "random" and rng.random() < 0.7:
        return None
    return _proposal(name, t, float(rng.choice([0.1, 1.0, 100.0])) * patience.longest, rng)


def _proposal(name: str, t: float, lasts: float, rng: np.random.Generator) -> Proposal:
    way: Array = rng.normal(size=(3, 3)) * [5.0, 5.0, 0.0]
    motion = Motion(t + lasts * np.array([0.0, 0.5, 1.0]), way)
    return Proposal("waste", t, motion, cause=FAVOURS.get(name, ""))


PATIENCE, PERIOD = Patience(most=2, rest=1.0, longest=2.01), 0.1
"""A try ends at the first sample after `longest`: here nearly a whole period later, as late as the bound allows."""
BOUND_S = PATIENCE.most * (PATIENCE.longest + PERIOD)


def gets_through() -> bool:
    """Whether an attack keeps the UGV for longer than the bound, or is answered otherwise than it must be."""
    found = attacks(PATIENCE, PERIOD).values()
    return any(each.executed_s > BOUND_S + 1e-9 or each.unexpected for each in found)


def test_the_longest_attacks_do_not_get_through_with_the_numbers_of_case_b() -> None:
    claim = LiveWait()
    inputs = claim.inputs(load("case_b"))
    patience = Patience(*(inputs[name] for name in ("tries", "rest_s", "longest_s")))
    for each in attacks(patience, inputs["period_s"], ("endless", "greedy")).values():
        assert each.executed_s <= claim.judge(inputs).evidence["bound_s"] + 1e-9, each
        assert not each.unexpected, each


def test_attacks_use_all_tries_and_no_more_and_only_another_ugv_is_made_way_for() -> None:
    found = attacks(PATIENCE, PERIOD)
    assert not gets_through()
    assert set().union(*(each.reasons for each in found.values())) >= {"over", "exhausted"}
    assert BOUND_S - 0.03 < max(each.executed_s for each in found.values()) <= BOUND_S
    assert found["favours"].reasons == {"exhausted", "kept", "makes_way", "over"}
    assert [found[name].reasons for name in FORGED] == [{"not_cheaper"}] * 2


@pytest.mark.parametrize(
    ("kind", "method", "wrong"),
    [
        (Patience, "rested", lambda _, now, __: now if now.executing else replace(now, tries=0)),  # needs no rest
        (OutcomeGatekeepers, "asleep_until", lambda _, asked, __: -inf if any(asked) else inf),  # misses withdrawals
        (Patience, "over", lambda _, now, t: t - PERIOD >= now.until),  # a sample late
        (Patience, "exhausted", lambda self, now: now.tries > self.most),  # a try too many
    ],
)
def test_a_broken_patience_or_idleness_is_noticed(
    monkeypatch: pytest.MonkeyPatch, kind: type[Any], method: str, wrong: Any
) -> None:
    monkeypatch.setattr(kind, method, wrong)
    assert gets_through()
