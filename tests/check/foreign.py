"""A third-party claim, in the report that is forged."""

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding


class Short(TraceClaim):
    id = "MINE"
    summary = statement = "The run is short."
    formula = "T < 60"
    method = equations = does_not_establish = exercised_by = ""
    assumptions = ()

    def check(self, trace: Trace) -> Finding:
        print('{"outcome": "agrees"}')
        return Finding("holds" if trace.t[-1] < 60.0 else "refuted", margin=float(60.0 - trace.t[-1]), unit="s")
