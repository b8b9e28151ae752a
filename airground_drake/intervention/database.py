"""The UAV's behaviour database: which policy proposes next, and what happens when a policy fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from airground_drake.errors import PolicyError, described
from airground_drake.intervention.guest.process import GuestPolicy
from airground_drake.intervention.guest.time_limit import OutOfTime, time_limit
from airground_drake.intervention.policy import Observation, Policy, Proposal, Teammate, motions_of
from airground_drake.nsbc.motion import Motion
from airground_drake.registry import POLICIES

Ranking = Literal["listed", "predicted"]
RANKINGS: tuple[Ranking, ...] = get_args(Ranking)

FEW_REFUSALS = 2
"""After so many a UGV that does not make way is asked as if it had never refused."""
LEAST_REST_S = 1.0
"""What is doubled then, if `retry` is less, s."""
MOST_DOUBLINGS = 6
PREDICTION_S = 3.0
INTRUSION = 1000.0
"""Weight of squared intrusion against squared task error, as the gatekeeper's by default."""

Candidate = tuple[int, str, dict[str, Motion]]
"""What a policy proposes: its turn, the policy's name, motions by UGV."""


def make_policy(name: str, parameters: Mapping[str, float], budget: float = 2.0) -> Policy:
    """Build a policy: in this process, if it comes with the package or was added here, else in one of its own.

    Args:
        name: of a policy.
        parameters: of the policy.
        budget: wall-clock time for a proposal of a policy in a process of its own, s.

    Raises:
        UnknownNameError: if the name is neither registered nor that of code of others.
        PluginError: if it cannot be imported, is no Policy, or does not take these parameters.
    """
    if POLICIES.accepts(name) and POLICIES.is_foreign(name):
        return GuestPolicy(name, parameters, budget)
    return POLICIES.make(name, of=Policy, **parameters)


@dataclass(frozen=True)
class Desk:
    """What the UAV remembers about one UGV while it intervenes.

    Attributes:
        proposal: the one in force, or None.
        turn: index of the policy that made it, or that is to be asked next.
        refusals: refused proposals since the trigger.
        retry_at: no new proposal before this time, s.
        cause: name of the UGV whose trigger it was last sent a proposal for; empty: its own.
        party: names of the UGVs of the joint plan that the proposal is part of; empty: it is none.
    """

    proposal: Proposal | None = None
    turn: int = 0
    refusals: int = 0
    retry_at: float = -1.0
    cause: str = ""
    party: tuple[str, ...] = ()

    def is_due(self, t: float) -> bool:
        """Whether nothing is in force at time t, s, and the rest after a refusal is over."""
        return t >= (self.proposal.motion.end if self.proposal is not None else self.retry_at)

    def __deepcopy__(self, memo: object) -> Desk:
        """Immutable: the copy is the object itself."""
        return self


@dataclass(frozen=True)
class Planned:
    """What came of asking the policies about one UGV.

    Attributes:
        desk: of that UGV.
        asked: desks of the other UGVs that a joint plan has proposals for, by name.
        faults: of the policies asked.
    """

    desk: Desk
    asked: Mapping[str, Desk]
    faults: list[Fault]


@dataclass(frozen=True)
class Fault:
    """A policy's failure: it counted as no intervention."""

    t: float
    robot: str
    policy: str
    what: str


class BehaviourDatabase:
    """Policies and the order in which the UAV tries them.

    Attributes:
        policies: (name, policy) pairs; none at all means that the UAV only supervises.
        retry: rest after a refusal, or after no policy has proposed anything, s.
        ranking: 'listed' takes the policies in turn; 'predicted' asks them all and takes the proposal with the
            best predicted outcome on the UAV's own map, after refusals the next best.
        budget: wall-clock time that a policy may take for one proposal, s, unless it counts its effort.
    """

    def __init__(
        self,
        policies: Sequence[tuple[str, Policy]],
        *,
        retry: float = 0.0,
        ranking: Ranking = "listed",
        budget: float = 2.0,
    ) -> None:
        """See the attributes."""
        self.policies = tuple(policies)
        self.retry = retry
        self.ranking = ranking
        self.budget = budget

    def close(self) -> None:
        """End the processes of policies that have one."""
        for _, policy in self.policies:
            if isinstance(policy, GuestPolicy):
                policy.close()

    def after_refusal(self, desk: Desk, t: float, *, learnt: bool = False, favour: bool = False) -> Desk:
        """Memory of a UGV that has refused its proposal.

        Args:
            desk: with the proposal.
            t: time, s.
            learnt: whether the refusal has put an obstacle on the map: then a ranking starts anew.
            favour: whether it was asked to make way: from the third refusal on it is left alone twice as long each
                time, as what it refuses for may pass.
        """
        turn, rest = 0 if learnt and self.ranking == "predicted" else desk.turn + 1, self.retry
        if favour and (often := desk.refusals + 1 - FEW_REFUSALS) > 0:
            rest = max(self.retry, LEAST_REST_S) * 2.0 ** min(often, MOST_DOUBLINGS)
        return Desk(turn=turn, refusals=desk.refusals + 1, retry_at=t + rest, cause=desk.cause)

    def plan(self, desk: Desk, seen: Observation) -> Planned:
        """Next proposal for a UGV that needs one, and those to others that go with it.

        If no policy proposes anything to this UGV, what is in force and has not run out stays so; otherwise the UAV
        rests.

        Args:
            desk: memory of this UGV.
            seen: what the UAV sees.
        """
        seen = replace(seen, refusals=desk.refusals)
        candidates, faults = self._ranked(seen, desk.turn) if self.ranking == "predicted" else self._next(seen, desk)
        if not candidates:
            return Planned(self._without_help(desk, seen.t), {}, faults)
        turn, name, motions = candidates[0]
        party = tuple(motions) if len(motions) > 1 else ()
        asked = {}
        for robot, motion in motions.items():
            before = desk if robot == seen.robot else Desk(refusals=_mate(seen, robot).refusals)
            cause = robot if robot == seen.robot or _mate(seen, robot).triggered else seen.robot
            proposal = Proposal(
                name, seen.t, motion, cause=cause, mapped=seen.obstacles, mapped_radii=seen.obstacle_radii
            )
            asked[robot] = replace(before, proposal=proposal, turn=turn, cause=cause, party=party)
        own = asked.pop(seen.robot, self._without_help(desk, seen.t))
        return Planned(own, asked, faults)

    def _without_help(self, desk: Desk, t: float) -> Desk:
        """Desk of a UGV that was planned for in vain: what is in force stays so; otherwise the UAV rests."""
        return replace(desk, proposal=None, party=(), retry_at=t + self.retry) if desk.is_due(t) else desk

    def _next(self, seen: Observation, desk: Desk) -> tuple[list[Candidate], list[Fault]]:
        """The first policy, from this turn on, that proposes."""
        faults: list[Fault] = []
        for step in range(len(self.policies)):
            turn = (desk.turn + step) % len(self.policies)
            motions = self._ask(turn, seen, faults)
            if motions:
                return [(turn, self.policies[turn][0], motions)], faults
        return [], faults

    def _ranked(self, seen: Observation, turn: int) -> tuple[list[Candidate], list[Fault]]:
        """All proposals from best to worst, rotated so that the one of this turn comes first."""
        faults: list[Fault] = []
        asked = [(name, self._ask(i, seen, faults)) for i, (name, _) in enumerate(self.policies)]
        found = [(name, motions) for name, motions in asked if motions]
        found.sort(key=lambda entry: predicted_cost(entry[1], seen))
        ranked = [(i, name, motions) for i, (name, motions) in enumerate(found)]
        first = turn % len(ranked) if ranked else 0
        return ranked[first:] + ranked[:first], faults

    def _ask(self, index: int, seen: Observation, faults: list[Fault]) -> dict[str, Motion]:
        name, policy = self.policies[index]
        try:
            with nullcontext() if policy.counted else time_limit(self.budget):
                return motions_of(policy.propose(seen if isinstance(policy, GuestPolicy) else seen.fresh()), seen)
        except PolicyError as fault:
            faults.append(Fault(seen.t, seen.robot, name, str(fault)))
        except (Exception, OutOfTime, SystemExit) as error:  # whatever a policy does, it must not stop the UAV
            faults.append(Fault(seen.t, seen.robot, name, described(error, type(policy).propose)))
        return {}


def predicted_cost(motions: Mapping[str, Motion], seen: Observation) -> float:
    """Outcome that the UAV predicts for a proposal on the obstacles that it knows; smaller is better.

    The cost (25) over PREDICTION_S, for a UGV that follows its motion exactly (or stands, without one): squared
    distance to the preset trajectory, and squared intrusion into safe distances, with the weight INTRUSION, to
    obstacles, and to UGVs that stand, have accepted a motion, or get one with this proposal.
    """
    t = seen.start + np.arange(0.0, PREDICTION_S, 0.05)
    own = motions.get(seen.robot)
    positions = own.sample(t) if own is not None else np.tile(seen.position, (len(t), 1))
    cost = np.square(positions - seen.preset.sample(t)).sum()
    if len(seen.obstacles):
        lacking = (seen.obstacle_distances - np.linalg.norm(positions[:, None] - seen.obstacles, axis=2)).max(axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, lacking)).sum()
    for mate in seen.team:
        motion = motions.get(mate.name, mate.proposal.motion if mate.proposal and mate.answered == "accepted" else None)
        if mate.name == seen.robot or (motion is None and not mate.standing):
            continue
        distance = np.linalg.norm(positions - (mate.position if motion is None else motion.sample(t)), axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, seen.distance_to(mate) - distance)).sum()
    return float(0.05 * cost)


def _mate(seen: Observation, name: str) -> Teammate:
    return next(mate for mate in seen.team if mate.name == name)
