"""The UAV's behaviour database: it asks the policies for a proposal, in turn or by rank, and records their failures.

The planner calls `plan` for a UGV that needs a proposal, and `after_refusal` when a UGV has refused one.
"""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import Any, Literal, get_args

import numpy as np

from airground_drake.base.errors import PolicyError, described, traceback_of
from airground_drake.base.history import Immutable
from airground_drake.base.registry import POLICIES
from airground_drake.model.geometry import convex
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.guest.process import GuestPolicy
from airground_drake.uav.guest.time_limit import OutOfTime, time_limit
from airground_drake.uav.policy import Observation, Policy, Proposal, motions_of

Ranking = Literal["listed", "predicted"]
RANKINGS: tuple[Ranking, ...] = get_args(Ranking)

# The rest doubles at most this often while no policy proposes anything; it is then longer than any run.
MOST_DOUBLINGS = 10
PREDICTION_S = 3.0
INTRUSION = 1000.0  # weight of squared intrusion against squared task error; the gatekeeper's default is the same


def make_policy(name: str, parameters: Mapping[str, float], budget: float = 2.0) -> Policy:
    """Build a policy: in this process if it comes with the package or was added here, else in a process of its own."""
    # budget: s
    if POLICIES.accepts(name) and POLICIES.is_foreign(name):
        return GuestPolicy(name, parameters, budget)
    return POLICIES.make(name, of=Policy, **parameters)


@dataclass(frozen=True)
class Negotiation(Immutable):
    """The UAV's memory of its exchange with one UGV."""

    proposal: Proposal | None = None  # the proposal in force, or None
    turn: int = 0  # index of the policy that made the proposal, or that is asked next
    refusals: int = 0  # number of refused proposals since the trigger
    too_fast: int = 0  # number of motions since then that the UGV could not follow, see `Teammate`
    in_vain: int = 0  # how many times in a row no policy had a proposal
    retry_at: float = -1.0  # earliest time for a new proposal, s
    cause: str = ""  # name of the UGV whose trigger led to the last proposal; empty before the first

    def is_due(self, t: float) -> bool:
        """Whether the UGV has no proposal in force at time t, s, and its rest is over."""
        return self.proposal is None and t >= self.retry_at

    def refused_lately(self, t: float) -> bool:
        """Whether the UGV rests after a refusal at time t, s; then it gets no part of a joint plan either."""
        return self.proposal is None and t < self.retry_at and not self.in_vain


@dataclass(frozen=True)
class Asked:
    """A policy that was asked for a plan for a UGV."""

    t: float  # time, s
    robot: str  # name of the UGV
    policy: str  # name of the policy
    party: tuple[str, ...] = ()  # UGVs for which it proposed motions
    chosen: bool = False  # whether the plan was sent
    what: str = ""  # what went wrong; empty if nothing did. A failure counts as no intervention.
    traceback: str = ""  # of the failure
    reason: str = ""  # why it left a UGV without a way, if stated


Candidate = tuple[int, Asked, dict[str, Motion]]  # a plan: its turn, the policy that was asked, and motions by UGV


@dataclass(frozen=True, eq=False)
class BehaviourDatabase:
    """Policies and the order in which the UAV tries them."""

    policies: Sequence[tuple[str, Policy]]  # by name; without any the UAV only supervises
    # Rest after a refusal, or when no policy has a proposal, s. It doubles each time in a row without a proposal.
    retry: float = 0.0
    # 'listed' asks the policies in turn. 'predicted' asks all and takes the proposal with the best predicted outcome on
    # the UAV's map; after a refusal it takes the next best.
    ranking: Ranking = "listed"
    budget: float = 2.0  # wall-clock time for a policy's proposal, s, unless the policy counts its effort
    joint: bool = True  # whether a joint plan takes effect only as a whole; if not, each part is a proposal of its own
    _asking: Any = field(default_factory=Lock, init=False)

    def close(self) -> None:
        """End the processes of third-party policies; the next run starts them again."""
        for _, policy in self.policies:
            if isinstance(policy, GuestPolicy):
                policy.close()

    def after_refusal(
        self, held: Negotiation, t: float, *, learnt: bool = False, too_fast: bool = False
    ) -> Negotiation:
        """The negotiation after a refusal: after a rest the next policy is asked."""
        # t: s
        # learnt: whether the UAV has learnt of an obstacle with the refusal; then a ranking starts again at the best.
        # too_fast: whether the UGV refused because it would have come to rest short of its goal.
        turn = 0 if learnt and self.ranking == "predicted" else held.turn + 1
        return Negotiation(
            turn=turn,
            refusals=held.refusals + 1,
            too_fast=held.too_fast + too_fast,
            retry_at=t + self.retry,
            cause=held.cause,
        )

    def plan(
        self, held: Negotiation, seen: Observation, memories: dict[int, Any] | None = None
    ) -> tuple[dict[str, Negotiation], list[Asked]]:
        """Ask the policies for the next proposal to a UGV; a joint plan also contains proposals to other UGVs."""
        # If no policy has a proposal, the UGV rests for `retry`, and twice as long each time in a row.
        # memories: `Policy.remembered` by index of the policy, changed in place; None: nothing is remembered.
        # Returns the negotiations that change, by UGV, and the policies that were asked.
        seen = replace(seen, refusals=held.refusals)
        memories = {} if memories is None else memories
        if self.ranking == "predicted":
            candidates, asked = self._ranked(seen, held.turn, memories)
        else:
            candidates, asked = self._next(seen, held, memories)
        in_vain = 0 if candidates else held.in_vain + 1
        rest = self.retry * 2.0 ** min(max(0, in_vain - 1), MOST_DOUBLINGS)
        held_by = {seen.robot: replace(held, in_vain=in_vain, retry_at=seen.t + rest)}
        for turn, chosen, motions in candidates[:1]:
            asked = [replace(candidate, chosen=True) if candidate is chosen else candidate for candidate in asked]
            party = tuple(sorted(motions)) if self.joint and len(motions) > 1 else ()
            for robot, motion in motions.items():
                mate = None if robot == seen.robot else next(member for member in seen.team if member.name == robot)
                before = held if mate is None else Negotiation(refusals=mate.refusals, too_fast=mate.too_fast)
                cause = robot if mate is None or mate.triggered else seen.robot
                beside = tuple(part for part in motions.items() if party and part[0] != robot)
                proposal = Proposal(
                    chosen.policy, seen.t, motion, cause=cause, mapped=seen.obstacles, party=party, beside=beside
                )
                held_by[robot] = replace(before, proposal=proposal, turn=turn, in_vain=0, cause=cause)
        return held_by, asked

    def _next(
        self, seen: Observation, held: Negotiation, memories: dict[int, Any]
    ) -> tuple[list[Candidate], list[Asked]]:
        """The first proposal of a policy, starting at the negotiation's turn."""
        asked: list[Asked] = []
        for step in range(len(self.policies)):
            turn = (held.turn + step) % len(self.policies)
            motions = self._ask(turn, seen, asked, memories)
            if motions:
                return [(turn, asked[-1], motions)], asked
        return [], asked

    def _ranked(self, seen: Observation, turn: int, memories: dict[int, Any]) -> tuple[list[Candidate], list[Asked]]:
        """All proposals from best to worst, rotated so that number `turn` comes first."""
        asked: list[Asked] = []
        every = [self._ask(i, seen, asked, memories) for i in range(len(self.policies))]
        able = [(candidate, motions) for candidate, motions in zip(asked, every, strict=True) if motions]
        able.sort(key=lambda entry: predicted_cost(entry[1], seen))
        ranked = [(i, candidate, motions) for i, (candidate, motions) in enumerate(able)]
        first = turn % len(ranked) if ranked else 0
        return ranked[first:] + ranked[:first], asked

    def _ask(self, index: int, seen: Observation, asked: list[Asked], memories: dict[int, Any]) -> dict[str, Motion]:
        """A policy's proposal; updates `asked` and `memories`, under a lock."""
        with self._asking:
            _, policy = self.policies[index]
            policy.remembered = memories.get(index)
            motions = self._proposed(index, seen, asked)
            memories[index] = policy.remembered
        return motions

    def _proposed(self, index: int, seen: Observation, asked: list[Asked]) -> dict[str, Motion]:
        name, policy = self.policies[index]
        motions = dict[str, Motion]()
        what = traceback = reason = ""
        try:
            with nullcontext() if policy.counted else time_limit(self.budget):
                motions = motions_of(policy.propose(seen if isinstance(policy, GuestPolicy) else seen.fresh()), seen)
                reason = str(policy.reason)
        except PolicyError as fault:
            what, traceback = str(fault), fault.traceback
        except (Exception, OutOfTime, SystemExit) as error:  # no failure of a policy may stop the UAV
            what, traceback = described(error, type(policy).propose), traceback_of(error)
        asked.append(Asked(seen.t, seen.robot, name, tuple(motions), what=what, traceback=traceback, reason=reason))
        return motions


def predicted_cost(motions: Mapping[str, Motion], seen: Observation) -> float:
    """Cost (25) of a proposal over PREDICTION_S, as the UAV predicts it with the obstacles that it knows."""
    # The UGV is assumed to follow its motion exactly, or to stand without one. The cost is its squared distance to the
    # preset trajectory, plus INTRUSION times its squared intrusion into safe distances. These are the distances to
    # obstacles, and to UGVs that stand, have accepted a motion, or get one with this proposal.
    t = seen.start + np.arange(0.0, PREDICTION_S, 0.05)
    own = motions.get(seen.robot)
    positions = own.sample(t) if own is not None else np.tile(seen.position, (len(t), 1))
    cost = np.square(positions - seen.preset.sample(t)).sum()
    if len(seen.obstacles):
        apart = np.array([convex.distances(seen.obstacles, position, True) for position in positions])
        lacking = (seen.obstacle_distances - apart).max(axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, lacking)).sum()
    for body in seen.moving:
        offsets = positions - body.motion.sample(t)
        apart = np.array([convex.distances(body.outlines, offset, True) for offset in offsets])
        lacking = (body.distances(seen.radius) - apart).max(axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, lacking)).sum()
    for mate in seen.team:
        motion = motions.get(mate.name, mate.proposal.motion if mate.proposal and mate.answered == "accepted" else None)
        if mate.name == seen.robot or (motion is None and not mate.standing):
            continue
        distance = np.linalg.norm(positions - (mate.position if motion is None else motion.sample(t)), axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, seen.distance_to(mate) - distance)).sum()
    return float(0.05 * cost)
