import numpy as np

from airground_drake import Motion, Observation, Policy


class Sidestep(Policy):
    """Go round the obstacle ahead on one side, then back to the preset trajectory and to the target."""

    def __init__(self, *, speed_m_s: float, aside_m: float = 2.9) -> None:
        """Parameters are numbers, passed by keyword from the scenario."""
        self.speed, self.aside = speed_m_s, aside_m

    def propose(self, seen: Observation) -> Motion | None:
        """Two corners beside where the UGV stands, where its preset trajectory will be, and the target."""
        corners = [
            seen.position,
            seen.position + [self.aside, -0.3, 0.0],
            seen.position + [self.aside, 2.5, 0.0],
            seen.preset.at(seen.start + 3.5)[0],
            seen.target,
        ]
        return Motion.at_speed(np.array(corners), self.speed, start=seen.start)
