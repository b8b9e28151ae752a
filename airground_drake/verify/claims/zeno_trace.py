"""ZENO-TRACE: the times between the triggers of a run."""

from dataclasses import asdict, dataclass
from itertools import pairwise

from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.triggers import column_conflict, recorded_events


@dataclass(frozen=True)
class Triggers:
    """Triggers of a UGV: how many, and when, s."""

    count: int
    t_s: list[float]


@dataclass(frozen=True, order=True)
class TriggerGap:
    """Two consecutive triggers of a UGV, s."""

    gap_s: float
    robot: str
    previous_t_s: float
    t_s: float


@dataclass(frozen=True)
class Gaps:
    """The evidence: triggers by UGV, the bound on gaps, s, and the number of triggers that it admits."""

    triggers: dict[str, Triggers]
    bound_s: float
    most_triggers_possible: int


class ZenoTrace(TraceClaim):
    id = "ZENO-TRACE"
    subject = "gaps between triggers"
    summary = "No UGV was triggered twice within the minimum inter-event time."
    statement = "In this run no UGV was triggered twice within the minimum inter-event time."
    latex = (r"t_{k+1} - t_k \ge \tau_{\min} - 10^{-9} \text{ s} \quad \text{for consecutive triggers of each UGV}",)
    method = (
        "Differences of the recorded trigger times; the events must agree with the columns triggers, triggered_at_s "
        "and released_at_s at every row, otherwise the verdict is `error`. A bare trigger is held to the same bound."
    )
    equations = "(20)"
    assumptions = ("The trace records every trigger (THR-TRIG recomputes them independently).",)
    does_not_establish = (
        "Absence of Zeno behaviour in other runs: a finite run has finitely many events whatever the trigger is. The "
        "statement for all runs is ZENO-PROOF, that about refined noise ZENO-REFINE. Without two triggers of a UGV "
        "there is no gap: the claim holds with an empty margin."
    )

    exercised_by = "gaps between consecutive triggers of one UGV"

    def check(self, trace: Trace) -> Finding:
        bound = float(trace.scenario.decision.min_inter_event_s)
        if bound <= 0.0:
            return Finding("not_run", evidence={"reason": "min_inter_event_s is 0: no bound to compare with"})
        triggers: dict[str, Triggers] = {}
        for ugv in trace.ugvs:
            events = recorded_events(trace, ugv)
            if conflict := column_conflict(trace, ugv, events):
                raise TraceError(f"events and columns disagree: {conflict}")
            times = [time for time, kind in events if kind == "trigger"]
            triggers[ugv] = Triggers(len(times), times)
        evidence = asdict(Gaps(triggers, bound, int(trace.scenario.duration_s / bound) + 1))
        gaps = [
            TriggerGap(after - before, ugv, before, after)
            for ugv, of_ugv in triggers.items()
            for before, after in pairwise(of_ugv.t_s)
        ]
        if not gaps:
            return Finding("holds", evidence=evidence | {"reason": "no UGV was triggered twice"}, exercised=0)
        smallest = min(gaps)
        held = smallest.gap_s >= bound - TIME_TOLERANCE_S
        return Finding(
            "holds" if held else "refuted",
            margin=smallest.gap_s - bound,
            unit="s",
            quantity="smallest gap between two triggers less the bound",
            where={"robot": smallest.robot, "t_s": smallest.t_s},
            counterexample=None if held else asdict(smallest),
            evidence=evidence | {"smallest_gap": asdict(smallest)},
            exercised=len(gaps),
        )
