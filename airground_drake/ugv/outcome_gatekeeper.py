"""Method (d)'s gatekeeper: proposals are judged by their outcome, once.

At the first sample at which a UGV sees a proposal it rolls out both outcomes (`outcome`): accepting it now, and
refusing it for ever. It takes the better one. A refusal stands for good. An acceptance stands until the proposal is
withdrawn, its motion is over, or it has been executed for as long as it may be. Neither is reversed because waiting
or the other choice looks cheaper. There is one exception: when the UGV senses an obstacle that it did not know at the
acceptance, it compares both outcomes again. That is no new try: `patience` bounds how often a UGV goes along.

Each UGV judges its own part of a joint plan, and executes it when it accepts.

Safety does not rest on this: an accepted motion is executed below the avoidance inequalities.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property
from time import thread_time

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.convex import news_within, within
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.scripted import Scripted
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, SILENT, Proposals, answer_to
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import Basis, GatekeeperDecision
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers, GatekeeperState, Inputs
from airground_drake.ugv.outcome import Outcome, Outlook, outcomes
from airground_drake.ugv.patience import Commitment, Patience
from airground_drake.ugv.reasons import Reason
from airground_drake.ugv.rollout import View

ACCEPTING: tuple[Reason, ...] = ("cheaper", "makes_way")  # reasons for which a proposal is accepted
MOST_CLAIMED = 64  # obstacles of the UAV's map that a UGV takes into account


class OutcomeGatekeepers(Gatekeepers):
    """The UGVs of a team under method (d)."""

    def __init__(
        self, world: World, law: UgvLaw, presets: Sequence[Motion], outlook: Outlook, patience: Patience,
        unreported: Collection[str] = frozenset(),
    ) -> None:  # fmt: skip
        """Gatekeepers of a world's UGVs: law, preset trajectories, prediction horizon and patience."""
        super().__init__(world, law, presets, unreported)
        self._outlook, self._patience = outlook, patience
        self._ugvs = world.names("ugv")
        self._leaves = np.array([world.resting[k].disappears_s - 2.0 * SAME_S for k in world.owner])

    def asleep_until(self, proposals: Proposals, before: GatekeeperState) -> float:
        """Until an executed proposal ends, tries are reset, or a known obstacle disappears."""
        # obstacles that move are new at every sample, unless the UAV sees them
        if any(proposals) and self._reported:
            return -math.inf
        until = math.inf
        if before.sensed.size:
            until = float(self._leaves[before.sensed.any(axis=0)].min(initial=math.inf))
        for i, (proposal, held) in enumerate(zip(proposals, before.commitments, strict=True)):
            if proposal is None:
                if before.answers[2 * i] != SILENT:  # withdrawn
                    return -math.inf
            elif answer_to(proposal, before.answers, i) == SILENT:
                return -math.inf
            elif held.executing:
                until = min(until, held.until)
            elif held.tries:
                until = min(until, held.since + self._patience.rest)
        return until

    def wakes(self, t: float, positions: Array, before: GatekeeperState) -> bool:
        """Whether an outline in range is not quiet."""
        still, own = self._world.at(self._near, t).still, positions[self._near.members]
        reach, quiet = self.law.avoidance.sensing_range, before.quiet
        return quiet.shape != (len(own), len(still)) or bool(news_within(still, own, reach, True, quiet))

    @cached_property
    def _reported(self) -> bool:
        """Whether UGVs report moving obstacles."""
        return any(body.kind not in ROBOTS and body.name not in self._unreported for body in self._world.moving)

    def _quiet(self, proposals: Proposals, after: GatekeeperState) -> Flags:
        """Which outlines in range are known and change no answer, (n, m)."""
        quiet = after.sensed.copy()
        for i, (proposal, report) in enumerate(zip(proposals, after.reports, strict=True)):
            rows = np.flatnonzero(quiet[i])
            if proposal is not None and len(rows):
                reported = np.array([outline.as_tuple(self._near.still[k]) in report.sensed for k in rows])
                quiet[i, rows] = reported | outline.is_among(self._near.still[rows], proposal.mapped)
        return quiet

    def sample(self, now: Inputs, before: GatekeeperState) -> GatekeeperState:
        """Judge every new proposal by its outcome; keep the other answers."""
        sensed = self._remembered(now.t, now.positions, before)
        known = replace(before, sensed=sensed)
        answers = [answer_to(proposal, before.answers, i) for i, proposal in enumerate(now.proposals)]
        held = list(before.commitments)
        for i, standing in enumerate(answers):
            if held[i].executing and standing != ACCEPT:  # withdrawn
                held[i] = self._patience.stop(held[i], now.t)
            held[i] = self._patience.rested(held[i], now.t)
        judged = [
            self._decide(now, known, before, i, proposal, answers[i], held[i])
            for i, proposal in enumerate(now.proposals)
            if proposal is not None
        ]
        verdicts: list[tuple[GatekeeperDecision, float]] = []
        for decision in judged:
            i = decision.robot
            held[i] = self._after(held[i], decision, answers[i])
            verdicts.append((replace(decision, tries=held[i].tries), _answer(decision, answers[i])))
        after = replace(self._answered(now, known, verdicts), commitments=tuple(held))
        return replace(after, quiet=self._quiet(now.proposals, after))

    def _remembered(self, t: float, positions: Array, before: GatekeeperState) -> Flags:
        """Which outlines each UGV has sensed up to time t, s, and has not seen disappear, (n, m)."""
        # The very same array if nothing changes.
        still, own = self._world.at(self._near, t).still, positions[self._near.members]
        reach, known = self.law.avoidance.sensing_range, before.sensed
        if known.shape != (len(own), len(still)):
            return within(still, own, reach, True)
        gone = known.any(axis=0) & ~self._world.there(t, self._world.resting)[self._world.owner]
        if gone.any():
            seen = np.zeros(known.shape, dtype=bool)
            seen[:, gone] = within(self._near.still[gone], own, reach, True)
            known = known & ~seen if (known & seen).any() else known
        return known | within(still, own, reach, True) if news_within(still, own, reach, True, known) else known

    def _discovered(self, sensed: Flags, before: GatekeeperState, i: int, proposal: Proposal) -> tuple[int, ...]:
        """Outlines that a UGV senses for the first time and that are not on the proposal's map."""
        if sensed is before.sensed or before.sensed.shape != sensed.shape:
            return ()
        new = np.flatnonzero(sensed[i] & ~before.sensed[i])
        return tuple(new[~outline.is_among(self._near.still[new], proposal.mapped)].tolist())

    def _decide(
        self,
        now: Inputs,
        known: GatekeeperState,
        before: GatekeeperState,
        i: int,
        proposal: Proposal,
        standing: float,
        held: Commitment,
    ) -> GatekeeperDecision:
        """Judge a new proposal, monitor an accepted one, or keep a refusal."""
        reason: Reason = "kept"
        refuse = accept = None
        cpu_s = 0.0  # of predictions: reading the clock takes as long as keeping an answer
        basis, new = Basis(), self._discovered(known.sensed, before, i, proposal)
        came_too_late = standing == SILENT and now.t >= proposal.motion.end
        if came_too_late or (standing == ACCEPT and self._patience.over(held, now.t)):
            reason = "over"
        elif standing == SILENT and self._patience.exhausted(held):
            reason = "exhausted"
        elif standing == SILENT or (standing == ACCEPT and new):
            started = thread_time()
            seen, basis = self._view_of(now, known, i, proposal)
            basis = basis._replace(new=new)
            refuse, accept = self.foresee(seen, now.law, proposal)
            cpu_s = thread_time() - started
            favour = proposal.cause in self._ugvs and proposal.cause != self._ugvs[i]
            reason = reason_of(refuse, accept, favour=favour)
        accepted = reason in ACCEPTING or (reason == "kept" and standing == ACCEPT)
        return GatekeeperDecision(
            now.t, i, proposal, accepted, reason, refuse=refuse, accept=accept, basis=basis, cpu_s=cpu_s
        )

    def _after(self, held: Commitment, decision: GatekeeperDecision, standing: float) -> Commitment:
        """A UGV's commitment after a decision; `standing` is its answer so far."""
        if decision.accepted and standing == SILENT:
            return self._patience.accept(held, decision.t, decision.proposal.motion.end)
        if standing == ACCEPT and not decision.accepted:
            return self._patience.stop(held, decision.t)
        return held

    def foresee(self, seen: View, law: UgvLaw, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """The outcomes of refusing and of accepting, from a UGV's knowledge."""
        return outcomes(seen, law, proposal, self._outlook)

    def _view_of(self, now: Inputs, known: GatekeeperState, i: int, proposal: Proposal) -> tuple[View, Basis]:
        """A UGV's knowledge: sensed or reported obstacles, moving bodies, and other parts of the same joint plan."""
        around, m = self._view(now, i), len(self._near.still)
        believed = self._believed(now.positions[i], known.sensed[i], proposal)
        still = outline.joined(self._near.still[known.sensed[i]], proposal.mapped[believed])
        asked: list[tuple[Motion, bool] | None] = []
        planned = dict(proposal.beside)
        for body in (self._world.moving[j] for j in self._near.carrier[self._beside(now, i)]):
            if isinstance(body.plant, Scripted):
                asked.append((body.plant.script, True) if body.plant.announced else None)
            else:
                asked.append((planned[body.name], False) if body.name in planned else None)
        sensed = np.flatnonzero(self._in_range(now.t, now.positions[i])).tolist()
        remembered = np.flatnonzero(known.sensed[i]).tolist()
        basis = Basis(tuple(sensed), tuple(remembered), (), tuple(believed.tolist()))
        seen = replace(
            around,
            still=still,
            distances=np.concatenate([self._world.keep(i, still), around.distances[m:]]),
            shares=np.concatenate([self._world.shares(i, still), around.shares[m:]]),
            asked=tuple(asked),
        )
        return seen, basis

    def _believed(self, position: Array, sensed: Flags, proposal: Proposal) -> Indices:
        """Rows of the UAV's map that are out of a UGV's sight and that it has not sensed itself."""
        # Only the `MOST_CLAIMED` nearest ones count, so that no map makes a decision slow. Rows that
        # are no outlines are left out.
        claimed = proposal.mapped
        apart = np.full(len(claimed), -np.inf)
        sound = outline.are_outlines(claimed)
        apart[sound] = convex.distances(claimed[sound], position, True)
        known = outline.is_among(claimed, self._near.still[sensed])
        new = np.flatnonzero((apart > self.law.avoidance.sensing_range) & ~known)
        nearest = np.argsort(apart[new], kind="stable")[:MOST_CLAIMED]
        return new[np.sort(nearest)]


def _answer(decision: GatekeeperDecision, standing: float) -> float:
    """The answer after a decision; DONE stays DONE."""
    if decision.accepted:
        return ACCEPT
    done = decision.reason == "over" and decision.t >= decision.proposal.motion.end
    return DONE if done or standing == DONE else REFUSE


def reason_of(refuse: Outcome, accept: Outcome, *, favour: bool) -> Reason:
    """Why to accept (one of ACCEPTING) or why not, given both outcomes."""
    # A UGV that makes way for another UGV (a `favour`) has nothing to gain: it accepts unless it would come to rest
    # short of its own goal. It cannot know whether the other UGV's trigger is on; `patience` bounds the cost of a lie.
    if not (np.isfinite(accept.cost) and np.isfinite(refuse.cost)):
        return "no_plan"
    if accept.better_than(refuse):
        return "cheaper"
    if accept.stalls:
        return "stalls"
    return "makes_way" if favour else "not_cheaper"
