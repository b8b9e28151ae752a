"""A user's own claim about a run: what it states, how it is decided, and what it does not establish.

python examples/own_claim.py
"""

from __future__ import annotations

import numpy as np

from airground_drake import Finding, Trace, TraceClaim, load, simulate

SLOW_M_S = 2.5


class Slow(TraceClaim):
    """SLOW."""

    id = "SLOW"
    statement = f"No UGV was told to drive faster than {SLOW_M_S} m/s."
    formula = f"max over samples of |v_i| <= {SLOW_M_S} m/s"
    method = "The commands chosen at the control samples, which are held in between."
    equations = "none"
    assumptions = ("Each UGV moves as it is told.",)
    does_not_establish = "Anything about other runs."
    exercised_by = "UGVs that were told to move"

    def check(self, trace: Trace) -> Finding:
        """Compare the largest speed with the limit."""
        speeds = [float(np.linalg.norm(trace.chosen(ugv), axis=1).max()) for ugv in trace.ugvs]
        left = SLOW_M_S - max(speeds)
        moved = sum(speed > 0.0 for speed in speeds)
        return Finding("holds" if left >= 0.0 else "refuted", margin=left, unit="m/s", exercised=moved)


if __name__ == "__main__":
    finding = Slow().judge(simulate(load("case_a"), "d"))
    print(f"SLOW is {finding.status}, margin {finding.margin:.3g} {finding.unit}")
