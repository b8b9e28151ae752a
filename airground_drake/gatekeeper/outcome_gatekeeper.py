"""Method (d)'s gatekeeper: proposals are judged by their outcome, once.

At the first sample at which a UGV sees a proposal it rolls out what comes of accepting it now and of refusing it for
ever (`outcome`), and takes the better one. That answer stands: a refusal for good, an acceptance until the proposal is
withdrawn, its motion is over, or it has been executed for as long as it may be. It is never reversed because waiting
looks cheaper, nor because the other choice does, with one exception: when the UGV senses an obstacle that it did not
know at the acceptance, it looks at both outcomes again. That is no new try: how often a UGV goes along is bounded
(`patience`).

Nothing here has a part in safety: whatever is accepted is executed below the avoidance inequalities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import thread_time

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.answer import Decision, Foreseen, Reason
from airground_drake.gatekeeper.mpc_gatekeeper import Gatekeepers, Memory, View
from airground_drake.gatekeeper.outcome import Other, Outcome, Outlook, outcomes
from airground_drake.gatekeeper.patience import Commitment, Patience
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT, DONE, REFUSE, SILENT, Proposals, Report, answer_to
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.kernels import news_within, within
from airground_drake.nsbc.law import UgvLaw
from airground_drake.world.world import World

ACCEPTING: tuple[Reason, ...] = ("cheaper", "makes_way")
"""Reasons for which a proposal is accepted."""
MOST_CLAIMED = 64
"""Obstacles of the UAV's map that a UGV takes into account."""
SAME_M = 1e-9
"""Obstacles closer to each other than this are one, m."""


class OutcomeGatekeepers(Gatekeepers):
    """The UGVs of a team under method (d)."""

    def __init__(
        self, world: World, law: UgvLaw, presets: Sequence[Motion], outlook: Outlook, patience: Patience
    ) -> None:
        """Of the UGVs of a world: their law, their preset trajectories, how far they look and how long they wait."""
        super().__init__(world, law, presets)
        self._outlook, self._patience = outlook, patience
        self._ugvs = world.names("ugv")

    def idle(self, proposals: Proposals, positions: Array, memory: Memory) -> bool:
        """Whether a sample changes nothing."""
        return super().idle(proposals, positions, memory) and memory.sensed is self._remembered(positions, memory)

    def sample(self, t: float, proposals: Proposals, positions: Array, velocities: Array, memory: Memory) -> Memory:
        """Judge every proposal in force by its outcome if it is new; else keep to what was answered."""
        sensed = self._remembered(positions, memory)
        seen = View(t, proposals, positions, velocities, replace(memory, sensed=sensed))
        answers: list[float] = []
        reports: list[Report] = []
        held = list(memory.commitments)
        decisions: list[Decision] = []
        for i, proposal in enumerate(proposals):
            standing = answer_to(proposal, memory.answers, i)
            if held[i].executing and standing != ACCEPT:  # withdrawn
                held[i] = self._patience.stop(held[i], t)
            held[i] = self._patience.rested(held[i], t)
            if proposal is None:
                answers += [SILENT, -1.0]
                reports.append(Report())
                continue
            started = thread_time()
            if standing == ACCEPT:
                again = self._discovers(sensed, memory, i, proposal)
                decision, held[i] = self._go_on(seen, i, proposal, held[i], again=again)
            elif standing == SILENT:
                decision, held[i] = self._judge(seen, i, proposal, held[i])
            else:
                decision = Decision(t, i, proposal, False, "kept", Foreseen(tries=held[i].tries))
            self.times_s.append(thread_time() - started)
            decisions.append(decision)
            answers += [_answer(decision, standing), proposal.number]
            reports.append(self._report(positions[i], decision))
        return replace(
            memory, answers=tuple(answers), reports=tuple(reports),
            decisions=tuple(decisions), commitments=tuple(held), sensed=sensed,
        )  # fmt: skip

    def _remembered(self, positions: Array, memory: Memory) -> np.ndarray:
        """Which obstacles each UGV has sensed up to now, (n, m); the very same array if nothing is new."""
        points, own, reach = self._near.still, positions[self._near.members], self._law.avoidance.sensing_range
        if memory.sensed.shape != (len(own), len(points)):
            return within(points, own, reach)
        if news_within(points, own, reach, memory.sensed):
            return memory.sensed | within(points, own, reach)
        return memory.sensed

    def _discovers(self, sensed: npt.NDArray[np.bool_], memory: Memory, i: int, proposal: Proposal) -> bool:
        """Whether a UGV senses an obstacle for the first time that is not on the proposal's map."""
        if sensed is memory.sensed:
            return False
        new = self._near.still[sensed[i] & ~memory.sensed[i]]
        apart = np.linalg.norm(new[:, None] - proposal.mapped, axis=2)
        return not (apart <= SAME_M).any(axis=1).all()

    def _judge(self, seen: View, i: int, proposal: Proposal, held: Commitment) -> tuple[Decision, Commitment]:
        """The first decision about a proposal."""
        if self._patience.exhausted(held):
            return Decision(seen.t, i, proposal, False, "exhausted", Foreseen(tries=held.tries)), held
        reason, refuse, accept = self._weigh(seen, i, proposal)
        if reason in ACCEPTING:
            held = self._patience.accept(held, seen.t, proposal.motion.end)
        return Decision(seen.t, i, proposal, held.executing, reason, Foreseen(refuse, accept, held.tries)), held

    def _weigh(self, seen: View, i: int, proposal: Proposal) -> tuple[Reason, Outcome, Outcome]:
        """The reason for the answer, and what comes of refusing and of accepting."""
        refuse, accept = self.foresee(seen, i, proposal)
        favour = proposal.cause in self._ugvs and proposal.cause != self._ugvs[i]
        return reason_of(refuse, accept, favour=favour), refuse, accept

    def _go_on(
        self, seen: View, i: int, proposal: Proposal, held: Commitment, *, again: bool
    ) -> tuple[Decision, Commitment]:
        """A later decision about a proposal that is executed; `again`: look at both outcomes once more."""
        reason: Reason = "kept"
        grounds = Foreseen(tries=held.tries)
        if self._patience.over(held, seen.t):
            reason = "over"
        elif again:
            reason, refuse, accept = self._weigh(seen, i, proposal)
            grounds = Foreseen(refuse, accept, held.tries)
        stays = reason == "kept" or reason in ACCEPTING
        decision = Decision(seen.t, i, proposal, stays, reason, grounds)
        return decision, held if stays else self._patience.stop(held, seen.t)

    def foresee(self, seen: View, i: int, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """What comes of refusing and of accepting, with what the UGV knows."""
        scene = self._scene(seen, i)
        discs, distances = self._known(seen, i, proposal)
        first = len(self._near.still)
        others = []
        for k, j in enumerate(self._near.others[i], start=first):
            asked = seen.proposals[j] if j < len(seen.proposals) else None
            answer = SILENT if asked is None else answer_to(asked, seen.before.answers, int(j))
            others.append(
                Other(
                    scene.centres[k], scene.velocities[k],
                    asked.motion if asked is not None and answer in (ACCEPT, SILENT) else None, answer == ACCEPT,
                    float(scene.distances[k]), float(scene.shares[k]),
                )
            )  # fmt: skip
        return outcomes(scene, self._law, proposal, discs, distances, others, self._outlook)

    def _known(self, seen: View, i: int, proposal: Proposal) -> tuple[Array, Array]:
        """Obstacles that a UGV has sensed, and those of the UAV's map that are out of its sight.

        Of the latter the `MOST_CLAIMED` that are nearest, so that no map makes a decision take long; none whose radius
        is no length.

        Returns:
            Centres, (k, 3), and safe distances, (k,), m.
        """
        was = seen.before.sensed[i]
        sensed, claimed = self._near.still[was], proposal.mapped
        radii = np.broadcast_to(proposal.mapped_radii, len(claimed))
        hidden = np.linalg.norm(claimed - seen.positions[i], axis=1) > self._law.avoidance.sensing_range
        apart = np.linalg.norm(claimed[:, None] - sensed, axis=2)
        new = np.flatnonzero(hidden & (apart > SAME_M).all(axis=1) & np.isfinite(radii) & (radii >= 0.0))
        nearest = np.argsort(np.linalg.norm(claimed[new] - seen.positions[i], axis=1), kind="stable")[:MOST_CLAIMED]
        new = new[np.sort(nearest)]
        away = self._world.apart("ugv", "obstacle") + (self._world.radius[self._near.members[i]] + radii[new])
        distances = np.concatenate([self._near.distance[i, : len(was)][was], away])
        return np.concatenate([sensed, claimed[new]]), distances


def _answer(decision: Decision, standing: float) -> float:
    """The answer that a decision comes to: what was DONE stays so."""
    if decision.accepted:
        return ACCEPT
    done = decision.reason == "over" and decision.t >= decision.proposal.motion.end
    return DONE if done or standing == DONE else REFUSE


def reason_of(refuse: Outcome, accept: Outcome, *, favour: bool) -> Reason:
    """Why to accept (one of ACCEPTING) or why not, given what comes of either.

    A UGV that is asked to make way for another one of its team (a `favour`) has nothing to gain: it accepts unless it
    would come to rest short of its own goal. Whether that other one's trigger is on it cannot know; what a lie may cost
    it is bounded like any other try (`patience`).
    """
    if not (np.isfinite(accept.cost) and np.isfinite(refuse.cost)):
        return "no_plan"
    if accept.better_than(refuse):
        return "cheaper"
    if accept.stalls:
        return "stalls"
    return "makes_way" if favour else "not_cheaper"
