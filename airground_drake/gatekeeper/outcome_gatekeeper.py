"""Method (d)'s gatekeeper: proposals are judged by their outcome, once, and their progress is watched.

At the first sample at which a UGV sees a proposal it rolls out what comes of accepting it now and of refusing it for
ever (`outcome`), and takes the better one. That answer stands: a refusal for good, an acceptance until the proposal is
withdrawn, its motion is over, or the UGV has been farther behind it than predicted for too long. It is never reversed
because waiting looks cheaper, nor because the other choice does, with one exception: when the UGV senses an obstacle
that it did not know at the acceptance, it looks at both outcomes again. That is no new try: how often a UGV goes along
is bounded (`patience`).

Nothing here has a part in safety: whatever is accepted is executed below the avoidance inequalities.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from time import thread_time

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.gatekeeper.answer import Decision, Foreseen, Reason
from airground_drake.gatekeeper.mpc_gatekeeper import Commitment, Gatekeepers, Memory, Situation
from airground_drake.gatekeeper.outcome import Other, Outcome, Outlook, outcomes
from airground_drake.gatekeeper.patience import Patience, Turn
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT, Proposals, Report, answer_to
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.kernels import news_within, within
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team

ACCEPTING: tuple[Reason, ...] = ("cheaper", "makes_way")
"""Reasons for which a proposal is accepted."""
MOST_CLAIMED = 64
"""Obstacles of the UAV's map that a UGV takes into account."""
SAME_M = 1e-9
"""Obstacles closer to each other than this are one, m."""


class OutcomeGatekeepers(Gatekeepers):
    """The UGVs of a team under method (d)."""

    def __init__(
        self, team: Team, law: UgvLaw, presets: Sequence[Motion], outlook: Outlook, patience: Patience
    ) -> None:
        """Of the UGVs of a team: their law, their preset trajectories, how far they look and how long they wait."""
        super().__init__(team, law, presets)
        self._outlook, self._patience = outlook, patience

    def idle(self, proposals: Proposals, positions: Array, memory: Memory) -> bool:
        """Whether a sample changes nothing."""
        return super().idle(proposals, positions, memory) and memory.sensed is self._remembered(positions, memory)

    def sample(self, t: float, proposals: Proposals, positions: Array, velocities: Array, memory: Memory) -> Memory:
        """Judge every proposal in force by its outcome, if it is new, or else by its progress."""
        sensed = self._remembered(positions, memory)
        seen = Situation(t, proposals, positions, velocities, replace(memory, sensed=sensed))
        answers: list[float] = []
        reports: list[Report] = []
        turns, commitments = list(memory.turns), list(memory.commitments)
        decisions: list[Decision] = []
        for i, proposal in enumerate(proposals):
            standing = answer_to(proposal, memory.answers, i)
            if turns[i].executing and standing != ACCEPT:  # withdrawn
                turns[i], commitments[i] = self._patience.stop(turns[i], t), None
            turns[i] = self._patience.rested(turns[i], t)
            if proposal is None:
                answers += [SILENT, -1.0]
                reports.append(Report())
                continue
            started = thread_time()
            if standing == ACCEPT:
                again = self._discovers(sensed, memory, i, proposal)
                decision, turns[i], commitments[i] = self._watch(seen, i, proposal, again=again)
            elif standing == REFUSE:
                decision = Decision(t, i, proposal, False, "kept", Foreseen(tries=turns[i].tries))
            else:
                decision, turns[i], commitments[i] = self._judge(seen, i, proposal, turns[i])
            self.times_s.append(thread_time() - started)
            decisions.append(decision)
            answers += [ACCEPT if decision.accepted else REFUSE, proposal.number]
            reports.append(self._report(positions[i], decision))
        return replace(
            memory, answers=tuple(answers), reports=tuple(reports),
            decisions=tuple(decisions), turns=tuple(turns),
            commitments=tuple(commitments), sensed=sensed,
        )  # fmt: skip

    def _remembered(self, positions: Array, memory: Memory) -> np.ndarray:
        """Which obstacles each UGV has sensed up to now, (n, m); the very same array if nothing is new."""
        points, own, reach = self._neighbourhood.obstacles, positions[:-1], self._law.avoidance.sensing_range
        if memory.sensed.shape != (len(own), len(points)):
            return within(points, own, reach)
        if news_within(points, own, reach, memory.sensed):
            return memory.sensed | within(points, own, reach)
        return memory.sensed

    def _discovers(self, sensed: npt.NDArray[np.bool_], memory: Memory, i: int, proposal: Proposal) -> bool:
        """Whether a UGV senses an obstacle for the first time that is not on the proposal's map."""
        if sensed is memory.sensed:
            return False
        new = self._team.obstacles[sensed[i] & ~memory.sensed[i]]
        apart = np.linalg.norm(new[:, None] - proposal.mapped, axis=2)
        return not (apart <= SAME_M).any(axis=1).all()

    def _judge(
        self, seen: Situation, i: int, proposal: Proposal, turn: Turn
    ) -> tuple[Decision, Turn, Commitment | None]:
        """The first decision about a proposal."""
        if self._patience.exhausted(turn):
            return Decision(seen.t, i, proposal, False, "exhausted", Foreseen(tries=turn.tries)), turn, None
        reason, grounds, commitment = self._weigh(seen, i, proposal)
        if commitment is not None:
            turn = self._patience.accept(turn, seen.t, proposal.motion.end)
        decision = Decision(seen.t, i, proposal, commitment is not None, reason, replace(grounds, tries=turn.tries))
        return decision, turn, commitment

    def _weigh(self, seen: Situation, i: int, proposal: Proposal) -> tuple[Reason, Foreseen, Commitment | None]:
        """The better outcome: the reason, what it rests on, and what is to be watched if it is to accept."""
        refuse, accept = self.foresee(seen, i, proposal)
        favour = proposal.cause in self._team.ugvs and proposal.cause != self._team.ugvs[i]
        reason = reason_of(refuse, accept, favour=favour)
        if reason not in ACCEPTING:
            return reason, Foreseen(refuse, accept), None
        after = self._law.avoidance.period * np.arange(0.0, len(accept.positions))
        lags = lags_of(proposal, seen.t + after, accept.positions)
        return reason, Foreseen(refuse, accept, float(lags[0]), float(lags[0])), Commitment(lags, seen.t, seen.t)

    def _watch(
        self, seen: Situation, i: int, proposal: Proposal, *, again: bool
    ) -> tuple[Decision, Turn, Commitment | None]:
        """A later decision about a proposal that is executed; `again`: look at both outcomes once more."""
        t, turn, patience = seen.t, seen.before.turns[i], self._patience
        commitment = seen.before.commitments[i]
        assert commitment is not None
        k = min(round((t - commitment.begun) / self._law.avoidance.period), len(commitment.lags) - 1)
        predicted = float(commitment.lags[k])
        lag = lag_of(proposal, t, seen.positions[i])
        on_time = t if lag <= predicted + patience.lag else commitment.on_time
        grounds = Foreseen(lag=lag, predicted_lag=predicted, tries=turn.tries)
        late = patience.late(on_time, t)
        if late or patience.over(turn, t):
            reason: Reason = "no_progress" if late else "over"
            return Decision(t, i, proposal, False, reason, grounds), patience.stop(turn, t), None
        if again:
            reason, outcomes, renewed = self._weigh(seen, i, proposal)
            grounds = replace(grounds, refuse=outcomes.refuse, accept=outcomes.accept)
            stays = renewed is not None
            return Decision(t, i, proposal, stays, reason, grounds), turn if stays else patience.stop(turn, t), renewed
        return Decision(t, i, proposal, True, "kept", grounds), turn, replace(commitment, on_time=on_time)

    def foresee(self, seen: Situation, i: int, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """What comes of refusing and of accepting, with what the UGV knows."""
        scene = self._scene(seen, i)
        discs, distances = self._known(seen, i, proposal)
        first = len(self._neighbourhood.obstacles)
        others = []
        for k, j in enumerate(self._neighbourhood.others[i], start=first):
            asked = seen.proposals[j] if j < len(seen.proposals) else None
            answer = SILENT if asked is None else answer_to(asked, seen.before.answers, int(j))
            others.append(
                Other(
                    scene.centres[k], scene.velocities[k],
                    asked.motion if asked is not None and answer != REFUSE else None, answer == ACCEPT,
                    float(scene.distances[k]), float(scene.shares[k]),
                )
            )  # fmt: skip
        return outcomes(scene, self._law, proposal, discs, distances, others, self._outlook)

    def _known(self, seen: Situation, i: int, proposal: Proposal) -> tuple[Array, Array]:
        """Obstacles that a UGV has sensed, and those of the UAV's map that are out of its sight.

        Of the latter the `MOST_CLAIMED` that are nearest, so that no map makes a decision take long; none whose radius
        is no length.

        Returns:
            Centres, (k, 3), and safe distances, (k,), m.
        """
        was = seen.before.sensed[i]
        sensed, claimed = self._team.obstacles[was], proposal.mapped
        radii = np.broadcast_to(proposal.mapped_radii, len(claimed))
        hidden = np.linalg.norm(claimed - seen.positions[i], axis=1) > self._law.avoidance.sensing_range
        apart = np.linalg.norm(claimed[:, None] - sensed, axis=2)
        new = np.flatnonzero(hidden & (apart > SAME_M).all(axis=1) & np.isfinite(radii) & (radii >= 0.0))
        nearest = np.argsort(np.linalg.norm(claimed[new] - seen.positions[i], axis=1), kind="stable")[:MOST_CLAIMED]
        new = new[np.sort(nearest)]
        bodies = np.concatenate([self._team.obstacle_radii[was], radii[new]])
        return np.concatenate([sensed, claimed[new]]), self._team.distance_to(bodies)[i]


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


def lags_of(proposal: Proposal, t: Array, positions: Array) -> Array:
    """Distance of positions (K, 3), m, at times (K,), s, from where the UGV is asked to be, (K,), m."""
    away = positions - proposal.motion.sample(t)
    return np.asarray(np.linalg.norm(away @ proposal.chosen.T, axis=1))


def lag_of(proposal: Proposal, t: float, position: Array) -> float:
    """`lags_of` at one time, s, m."""
    x, y, z = ((position - proposal.motion.at(t)[0])[None] @ proposal.chosen.T)[0].tolist()
    return math.sqrt(x * x + y * y + z * z)
