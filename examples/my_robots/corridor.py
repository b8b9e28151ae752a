import numpy as np

from airground_drake import Finding, Trace, TraceClaim
from airground_drake.verify.finding import Chart


class Corridor(TraceClaim):
    """CORRIDOR."""

    id = "CORRIDOR"
    subject = "the corridor"
    statement = "No UGV left the corridor of 30 m on either side of x = 0."
    formula = "max over t of |x_i(t)| <= 30 m"
    method = "The rows of the trace; in between the motion is straight."
    equations = "none"
    assumptions = ("Between two rows every robot moves on a straight line.",)
    does_not_establish = "Anything about other runs."
    exercised_by = "UGVs that moved across the corridor"

    def check(self, trace: Trace) -> Finding:
        """Compare the largest excursion with the half width."""
        aside_m = {ugv: np.abs(trace.position(ugv)[:, 0]) for ugv in trace.ugvs}
        margin = 30.0 - max(float(aside.max()) for aside in aside_m.values())
        lines = {ugv: (trace.t[::20], aside[::20]) for ugv, aside in aside_m.items()}
        return Finding(
            "holds" if margin >= 0.0 else "refuted",
            margin=margin,
            unit="m",
            quantity="30 m less the largest excursion",
            exercised=sum(bool(np.ptp(trace.position(ugv)[:, 0]) > 0.0) for ugv in trace.ugvs),
            figure=Chart("Distance from the middle of the corridor", "time, s", "distance, m", lines),
        )
