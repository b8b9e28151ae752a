"""The policy through which the agent of a step-wise environment proposes: see `environments`."""

from collections.abc import Mapping

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.policy import Observation, Policy

Proposed = Motion | Mapping[str, Motion] | None  # what a policy returns


class Agent(Policy):
    """What the agent of a step-wise environment chose; nothing outside of such an environment.

    Attributes:
        chosen: answers to requests of the present planning instant, by UGV.
        requests: requests of this instant without an answer.
    """

    counted = True

    def __init__(self) -> None:
        self.chosen: dict[str, Proposed] = {}
        self.requests: dict[str, Observation] = {}

    def propose(self, seen: Observation) -> Proposed:
        """What was chosen for this UGV; None, and a request, if nothing was."""
        if seen.robot not in self.chosen:
            self.requests[seen.robot] = seen
            return None
        return self.chosen[seen.robot]
