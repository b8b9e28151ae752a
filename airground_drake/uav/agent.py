"""The policy through which the agent of a step-wise environment proposes: see `study.environments`."""

from collections.abc import Mapping

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.policy import Observation, Policy

Proposed = Motion | Mapping[str, Motion] | None  # what a policy returns


class Agent(Policy):
    """Proposes what the agent of a step-wise environment chose; nothing outside of such an environment.

    Attributes:
        chosen: answers to requests of the present planning instant, by UGV.
        requests: requests of this instant without an answer.
    """

    counted = True

    def __init__(self) -> None:
        self.chosen: dict[str, Proposed] = {}
        self.requests: dict[str, Observation] = {}

    def propose(self, seen: Observation) -> Proposed:
        """The motion chosen for this UGV; without a choice, None, and a request is added."""
        if seen.robot not in self.chosen:
            self.requests[seen.robot] = seen
            return None
        return self.chosen[seen.robot]
