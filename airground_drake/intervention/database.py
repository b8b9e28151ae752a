"""The UAV's behaviour database: which policy proposes next, and what happens when a policy fails."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airground_drake.errors import AirgroundError
from airground_drake.intervention.detour import Detour
from airground_drake.intervention.policy import Observation, Policy, Proposal
from airground_drake.nsbc.motion import Motion

POLICIES: dict[str, type[Policy]] = {"detour": Detour}
"""Policies that a scenario may name; any other is named as `module:Class`."""


class PolicyError(AirgroundError):
    """A policy that cannot be made from its name and parameters."""


def make_policy(name: str, parameters: Mapping[str, float]) -> Policy:
    """Build a policy.

    Raises:
        PolicyError: if the name is unknown, names something that is not a Policy, or the parameters do not fit.
    """
    kind: object = POLICIES.get(name)
    if kind is None:
        module, _, attribute = name.partition(":")
        if not attribute:
            raise PolicyError(f"policy {name!r}: allowed are {', '.join(sorted(POLICIES))} or 'module:Class'")
        try:
            kind = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise PolicyError(f"policy {name!r} cannot be imported: {error}") from error
    if not (isinstance(kind, type) and issubclass(kind, Policy)):
        raise PolicyError(f"policy {name!r} is not a subclass of airground_drake.intervention.policy.Policy")
    try:
        return kind(**parameters)
    except (TypeError, ValueError) as error:
        raise PolicyError(f"policy {name!r} with {dict(parameters)}: {error}") from error


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
    """Policies in the order in which the UAV tries them: after a refusal, and a rest, the next."""

    def __init__(self, policies: Sequence[tuple[str, Policy]], retry: float = 0.0) -> None:
        """Take (name, policy) pairs, none meaning that the UAV only supervises, and the rest after a refusal, s."""
        self.policies = tuple(policies)
        self.retry = retry

    def plan(self, desk: Desk, seen: Observation, refused: bool) -> tuple[Desk, list[Fault]]:
        """Next proposal for a UGV that needs one.

        A proposal stays in force until it is refused or has run out; then the policies are asked in turn,
        from the next one after a refusal, until one proposes.

        Args:
            desk: memory of this UGV.
            seen: what the UAV sees.
            refused: whether the UGV has refused the proposal in force.

        Returns:
            The new memory and the faults of policies asked.
        """
        if refused:
            retry_at = seen.t + self.retry
            desk = Desk(turn=desk.turn + 1, refusals=desk.refusals + 1, retry_at=retry_at)
        if seen.t < (desk.proposal.motion.end if desk.proposal is not None else desk.retry_at):
            return desk, []
        faults = []
        for step in range(len(self.policies)):
            turn = (desk.turn + step) % len(self.policies)
            name, policy = self.policies[turn]
            try:
                motion = policy.propose(replace(seen, refusals=desk.refusals))
                _check(motion)
            except Exception as error:  # whatever a user's policy does, it must not stop the UAV
                faults.append(Fault(seen.t, seen.robot, name, f"{type(error).__name__}: {error}"))
                continue
            if motion is not None:
                return replace(desk, proposal=Proposal(name, seen.t, motion), turn=turn), faults
        return replace(desk, proposal=None), faults


def _check(motion: object) -> None:
    if motion is None:
        return
    if not isinstance(motion, Motion):
        raise TypeError(f"a policy proposes a Motion or None, not {type(motion).__name__}")
    if not np.isfinite(motion.positions).all():  # a Motion checks itself; this is for subclasses
        raise ValueError("the proposed motion is not finite")
