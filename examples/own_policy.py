"""A user's own policy: the UAV asks the stuck UGV to go round on one side.

python examples/own_policy.py
"""

from __future__ import annotations

import numpy as np

from airground_drake import Motion, Observation, Policy, load, simulate
from airground_drake.base.registry import POLICIES


class Aside(Policy):
    """A polyline that passes everything ahead at a distance, and ends at the target."""

    def __init__(self, *, speed_m_s: float = 2.0, aside_m: float = 2.6) -> None:
        """Speed, m/s, and how far it goes to the right, m."""
        self.speed, self.aside = speed_m_s, aside_m

    def propose(self, seen: Observation) -> Motion:
        """Beside the UGV, beside its target, then its target."""
        ahead = (seen.target - seen.position) / np.linalg.norm(seen.target - seen.position)
        right = self.aside * np.array([ahead[1], -ahead[0], 0.0])
        corners = [seen.position, seen.position + right, seen.target + right, seen.target]
        return Motion.at_speed(np.array(corners), self.speed, start=seen.start)


if __name__ == "__main__":
    with POLICIES.adding("aside", Aside):
        trace = simulate(load("minimal", {"intervention.policies": [{"name": "aside"}]}), "d")
    for event in trace.events:
        print(f"{event['t_s']:7.3f} s  {event['robot']:5}  {event['kind']}")
