"""What UGVs accepted under method (d), and for how long: the intervals that LIVE-WAIT and LIVE-GATE are about."""

from itertools import groupby, zip_longest
from typing import NamedTuple

from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.proposals import ProposalRecord, proposal_of

METHOD = "d"  # only this method has tries and rests, and predicts where an accepted intervention leads


class Acceptance(NamedTuple):
    """An accepted proposal, from its acceptance until the UGV gives it back, it is withdrawn, or the run ends."""

    on: ProposalRecord  # the proposal
    t_s: float  # when it was accepted
    end_s: float  # when the UGV gave it back, or the gatekeeper's first sample at which it was withdrawn
    until_s: float  # when it must be over: its motion has ended, or it has lasted as long as it may
    given_back: bool  # whether the UGV ended it
    # When the UGV sensed an obstacle for the first time that was not on the proposal's map, s.
    news_s: tuple[float, ...]


def acceptances(trace: Trace) -> dict[str, list[Acceptance]]:
    """All acceptances of a run by UGV and time; {} for another method."""
    return {ugv: _of_ugv(trace, ugv) for ugv in trace.ugvs} if trace.meta["method"] == METHOD else {}


def below_avoidance(trace: Trace) -> tuple[int, int]:
    """How many executed interventions were below avoidance, as method (d) has them, and how many there were."""
    count = sum(len({*trace.sampled(f"{ugv}.executing").tolist()} - {-1.0}) for ugv in trace.ugvs)
    return (count if trace.meta["method"] == METHOD else 0), count


def _of_ugv(trace: Trace, ugv: str) -> list[Acceptance]:
    gate = trace.scenario.gatekeeper
    accepted = list[Acceptance]()
    table = trace.decisions
    mine = table[table["robot"] == ugv].sort_values("t_s", kind="stable")
    given = zip(*(mine[name].tolist() for name in ("number", "decision", "t_s", "new")), strict=True)
    answers = [(*key, [(t, len(new)) for *_, t, new in rows]) for key, rows in groupby(given, lambda row: row[:2])]
    for (number, said, rows), following in zip_longest(answers, answers[1:]):
        if said == "accept":
            on = proposal_of(trace, number)
            back = following is not None and following[0] == number
            last = following[2][:1] if back else []
            end_s = last[0][0] if back else min(rows[-1][0] + gate.period_s, float(trace.t[-1]))
            until_s = min(float(on.times_s[-1]), rows[0][0] + gate.longest_s)
            news_s = tuple(t for t, new in [*rows[1:], *last] if new)
            accepted.append(Acceptance(on, rows[0][0], end_s, until_s, back, news_s))
    return accepted
