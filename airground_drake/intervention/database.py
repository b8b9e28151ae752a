"""The UAV's behaviour database: which policy proposes next, and what happens when a policy fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from airground_drake.errors import PluginError
from airground_drake.intervention.guard import OutOfTime, time_limit
from airground_drake.intervention.policy import Observation, Policy, Proposal
from airground_drake.nsbc.motion import Motion
from airground_drake.registry import POLICIES

Ranking = Literal["listed", "predicted"]
RANKINGS: tuple[Ranking, ...] = get_args(Ranking)

PREDICTION_S = 3.0
INTRUSION = 1000.0
"""Weight of squared intrusion against squared task error, as the gatekeeper's by default."""

Candidate = tuple[int, str, Motion]
"""A proposal: its turn, the policy's name, the motion."""


def make_policy(name: str, parameters: Mapping[str, float]) -> Policy:
    """Build a policy.

    Raises:
        UnknownNameError: if the name is neither registered nor of the form `module:Class`.
        PluginError: if it cannot be imported, is no Policy, or does not take these parameters.
    """
    kind = POLICIES.load(name, of=Policy)
    try:
        return kind(**parameters)
    except (TypeError, ValueError) as error:
        raise PluginError(f"policy {name!r} with {dict(parameters)}: {error}") from error


@dataclass(frozen=True)
class Desk:
    """What the UAV remembers about one UGV while it intervenes.

    Attributes:
        proposal: the one in force, or None.
        turn: index of the policy that made it, or that is to be asked next.
        refusals: refused proposals since the trigger.
        retry_at: no new proposal before this time, s.
    """

    proposal: Proposal | None = None
    turn: int = 0
    refusals: int = 0
    retry_at: float = -1.0

    def __deepcopy__(self, memo: object) -> Desk:
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
        retry: rest after a refusal, s.
        ranking: 'listed' takes the policies in turn; 'predicted' asks them all and takes the proposal with the
            best predicted outcome on the UAV's own map, after refusals the next best.
        budget: wall-clock time that a policy may take for one proposal, s.
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

    def plan(
        self, desk: Desk, seen: Observation, *, refused: bool = False, learnt: bool = False
    ) -> tuple[Desk, list[Fault]]:
        """Next proposal for a UGV that needs one.

        A proposal stays in force until it is refused or has run out.

        Args:
            desk: memory of this UGV.
            seen: what the UAV sees.
            refused: whether the UGV has refused the proposal in force.
            learnt: whether that refusal has put an obstacle on the map: then a ranking starts anew.

        Returns:
            The new memory and the faults of policies asked.
        """
        if refused:
            turn = 0 if learnt and self.ranking == "predicted" else desk.turn + 1
            desk = Desk(turn=turn, refusals=desk.refusals + 1, retry_at=seen.t + self.retry)
        if seen.t < (desk.proposal.motion.end if desk.proposal is not None else desk.retry_at):
            return desk, []
        seen = replace(seen, refusals=desk.refusals)
        candidates, faults = self._ranked(seen, desk.turn) if self.ranking == "predicted" else self._next(seen, desk)
        if not candidates:
            return replace(desk, proposal=None), faults
        turn, name, motion = candidates[0]
        return replace(desk, proposal=Proposal(name, seen.t, motion, mapped=seen.obstacles), turn=turn), faults

    def _next(self, seen: Observation, desk: Desk) -> tuple[list[Candidate], list[Fault]]:
        """The first policy, from this turn on, that proposes."""
        faults: list[Fault] = []
        for step in range(len(self.policies)):
            turn = (desk.turn + step) % len(self.policies)
            motion = self._ask(turn, seen, faults)
            if motion is not None:
                return [(turn, self.policies[turn][0], motion)], faults
        return [], faults

    def _ranked(self, seen: Observation, turn: int) -> tuple[list[Candidate], list[Fault]]:
        """All proposals from best to worst, rotated so that the one of this turn comes first."""
        faults: list[Fault] = []
        motions = [(name, self._ask(i, seen, faults)) for i, (name, _) in enumerate(self.policies)]
        found = [(name, motion) for name, motion in motions if motion is not None]
        found.sort(key=lambda entry: predicted_cost(entry[1], seen))
        ranked = [(i, name, motion) for i, (name, motion) in enumerate(found)]
        first = turn % len(ranked) if ranked else 0
        return ranked[first:] + ranked[:first], faults

    def _ask(self, index: int, seen: Observation, faults: list[Fault]) -> Motion | None:
        name, policy = self.policies[index]
        try:
            with time_limit(self.budget):
                return _plain(policy.propose(seen))
        except (Exception, OutOfTime) as error:  # whatever a user's policy does, it must not stop the UAV
            faults.append(Fault(seen.t, seen.robot, name, f"{type(error).__name__}: {error}"))
            return None


def predicted_cost(motion: Motion, seen: Observation) -> float:
    """Outcome that the UAV predicts for a motion on the obstacles that it knows; smaller is better.

    The cost (25) over PREDICTION_S, for a UGV that follows the motion exactly: squared distance to the preset
    trajectory, and squared intrusion into safe distances with the weight INTRUSION.
    """
    t = seen.start + np.arange(0.0, PREDICTION_S, 0.05)
    positions = motion.sample(t)
    cost = np.square(positions - seen.preset.sample(t)).sum()
    if len(seen.obstacles):
        distance = np.linalg.norm(positions[:, None] - seen.obstacles, axis=2).min(axis=1)
        cost += INTRUSION * np.square(np.maximum(0.0, seen.safe_distance - distance)).sum()
    return float(0.05 * cost)


def _plain(motion: object) -> Motion | None:
    """A policy's answer as plain data, so that none of its code is called later; raises if it is no motion."""
    if motion is None:
        return None
    if not isinstance(motion, Motion):
        raise TypeError(f"a policy proposes a Motion or None, not {type(motion).__name__}")
    return Motion(motion.times, motion.positions)
