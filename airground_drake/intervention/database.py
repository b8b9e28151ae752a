"""The UAV's behaviour database: which policy proposes next, and what happens when a policy fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any, Literal, Self, get_args

import numpy as np

from airground_drake.base.errors import PolicyError, described
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.guest.process import GuestPolicy
from airground_drake.intervention.guest.time_limit import OutOfTime, time_limit
from airground_drake.intervention.policy import Observation, Policy, Proposal, Teammate, motions_of
from airground_drake.registry import POLICIES

Ranking = Literal["listed", "predicted"]
RANKINGS: tuple[Ranking, ...] = get_args(Ranking)

MOST_DOUBLINGS = 10
"""Of the rest while no policy proposes anything: by then it is longer than any run that it began in."""
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
class Negotiation:
    """Where the UAV stands with one UGV.

    Attributes:
        proposal: the one in force, or None.
        turn: index of the policy that made it, or that is to be asked next.
        refusals: refused proposals since the trigger.
        in_vain: how often in a row no policy had a proposal.
        retry_at: no new proposal before this time, s.
        cause: name of the UGV whose trigger it was last sent a proposal for; empty: its own.
    """

    proposal: Proposal | None = None
    turn: int = 0
    refusals: int = 0
    in_vain: int = 0
    retry_at: float = -1.0
    cause: str = ""

    def is_due(self, t: float) -> bool:
        """Whether nothing is in force at time t, s, and the rest is over."""
        return self.proposal is None and t >= self.retry_at

    def refused_lately(self, t: float) -> bool:
        """Whether it rests at time t, s, because the UGV has refused: then it gets no part of another's plan either."""
        return self.proposal is None and t < self.retry_at and not self.in_vain

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


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
        retry: rest after a refusal, s; so, too, when no policy has a proposal, and twice as long each time in a row.
        ranking: 'listed' takes the policies in turn; 'predicted' asks them all and takes the proposal with the
            best predicted outcome on the UAV's own map, after refusals the next best.
        budget: wall-clock time that a policy may take for one proposal, s, unless it counts its effort.
        joint: whether a joint plan takes effect as a whole or not at all; otherwise each part is a proposal of its own.
    """

    def __init__(
        self,
        policies: Sequence[tuple[str, Policy]],
        *,
        retry: float = 0.0,
        ranking: Ranking = "listed",
        budget: float = 2.0,
        joint: bool = True,
    ) -> None:
        """See the attributes."""
        self.policies = tuple(policies)
        self.retry = retry
        self.ranking = ranking
        self.budget = budget
        self.joint = joint

    def close(self) -> None:
        """End the processes of policies that have one."""
        for _, policy in self.policies:
            if isinstance(policy, GuestPolicy):
                policy.close()

    def after_refusal(self, held: Negotiation, t: float, *, learnt: bool = False) -> Negotiation:
        """After a UGV has refused its proposal: the next policy's turn, after a rest.

        Args:
            held: with the proposal.
            t: time, s.
            learnt: whether the refusal has put an obstacle on the map: then a ranking starts anew.
        """
        turn = 0 if learnt and self.ranking == "predicted" else held.turn + 1
        return Negotiation(turn=turn, refusals=held.refusals + 1, retry_at=t + self.retry, cause=held.cause)

    def plan(self, held: Negotiation, seen: Observation) -> tuple[dict[str, Negotiation], list[Fault]]:
        """Next proposal for a UGV that needs one, and those to others that go with it.

        A UGV without a proposal is planned for again after `retry`. Each time in a row that no policy proposes
        anything to anybody, that time doubles.

        Args:
            held: with this UGV.
            seen: what the UAV sees.

        Returns:
            The negotiations that change, by UGV, and faults of the policies asked.
        """
        seen = replace(seen, refusals=held.refusals)
        candidates, faults = self._ranked(seen, held.turn) if self.ranking == "predicted" else self._next(seen, held)
        in_vain = 0 if candidates else held.in_vain + 1
        rest = self.retry * 2.0 ** min(max(0, in_vain - 1), MOST_DOUBLINGS)
        found = {seen.robot: replace(held, in_vain=in_vain, retry_at=seen.t + rest)}
        for turn, name, motions in candidates[:1]:
            party = tuple(sorted(motions)) if self.joint and len(motions) > 1 else ()
            for robot, motion in motions.items():
                mate = None if robot == seen.robot else _mate(seen, robot)
                before = held if mate is None else Negotiation(refusals=mate.refusals)
                cause = robot if mate is None or mate.triggered else seen.robot
                proposal = Proposal(
                    name, seen.t, motion, cause=cause, mapped=seen.obstacles, mapped_radii=seen.obstacle_radii,
                    party=party,
                )  # fmt: skip
                found[robot] = replace(before, proposal=proposal, turn=turn, in_vain=0, cause=cause)
        return found, faults

    def _next(self, seen: Observation, held: Negotiation) -> tuple[list[Candidate], list[Fault]]:
        """The first policy, from this turn on, that proposes."""
        faults: list[Fault] = []
        for step in range(len(self.policies)):
            turn = (held.turn + step) % len(self.policies)
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
