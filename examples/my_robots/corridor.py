import numpy as np

from airground_drake import Finding, Trace, TraceClaim


class Corridor(TraceClaim):
    """CORRIDOR."""

    id = "CORRIDOR"
    statement = "No UGV left the corridor of 30 m on either side of x = 0."
    formula = "max over t of |x_i(t)| <= 30 m"
    method = "The rows of the trace; in between the motion is straight."
    equations = "none"
    assumptions = ("Between two rows every robot moves on a straight line.",)
    does_not_establish = "Anything about other runs."
    exercised_by = "UGVs that moved across the corridor"

    def check(self, trace: Trace) -> Finding:
        """Compare the largest excursion with the half width."""
        widest = max(float(np.abs(trace.position(ugv)[:, 0]).max()) for ugv in trace.ugvs)
        within = widest <= 30.0
        quantity = "30 m less the largest excursion"
        moved = sum(bool(np.ptp(trace.position(ugv)[:, 0]) > 0.0) for ugv in trace.ugvs)
        return Finding(
            "holds" if within else "refuted", margin=30.0 - widest, unit="m", quantity=quantity, exercised=moved
        )
