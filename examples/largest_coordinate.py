import numpy as np

from airground_drake import load, simulate
from airground_drake.sim.blocks import DecisionBlock


class LargestCoordinate(DecisionBlock):
    """The largest coordinate of the task error, plus the noise."""

    def value(self, t, parts):
        """x (n,), m, of task errors and noise (n, 4), m, at time t, s."""
        return np.abs(parts[:, :3]).max(axis=1) + parts[:, 3]


trace = simulate(load("case_a"), "b", decision_block=LargestCoordinate)
first = next(event["t_s"] for event in trace.events if event["kind"] == "trigger")
assert 14.4795 < first < 14.482  # with the norm of (15): 14.4791 s
