"""What UGVs accepted under method (d), and for how long: the intervals that LIVE-WAIT and LIVE-GATE are about."""

from __future__ import annotations

from itertools import groupby, zip_longest
from typing import NamedTuple

from airground_drake.run.trace import Trace
from airground_drake.verify.runs.proposals import ProposalRecord, proposal_of
from airground_drake.verify.runs.sensing import news

METHOD = "d"
"""Only this method has tries and rests, and predicts where an accepted intervention leads."""


class Acceptance(NamedTuple):
    """An accepted proposal, from its acceptance until the UGV gives it back, it is withdrawn, or the run ends.

    Attributes:
        on: the proposal.
        t_s: when it was accepted.
        end_s: when the UGV gave it back, or the gatekeeper's first sample at which it was withdrawn.
        until_s: when it must be over: its motion has ended, or it has lasted as long as it may.
        given_back: whether the UGV ended it.
    """

    on: ProposalRecord
    t_s: float
    end_s: float
    until_s: float
    given_back: bool

    def new(self, trace: Trace, within_s: float = float("inf")) -> list[str]:
        """Obstacles that the UGV sensed for the first time meanwhile and did not know of from the proposal's map.

        Args:
            trace: the run.
            within_s: only those of so much time before the end, s.
        """
        return news(trace, self.on.ugv, self.on.mapped_m, max(self.t_s, self.end_s - within_s), self.end_s)


def acceptances(trace: Trace) -> dict[str, list[Acceptance]]:
    """All acceptances of a run by UGV and time; {} for another method.

    Raises:
        TraceError: if a decision is on a proposal that was not sent.
    """
    return {ugv: _of_ugv(trace, ugv) for ugv in trace.ugvs} if trace.meta["method"] == METHOD else {}


def _of_ugv(trace: Trace, ugv: str) -> list[Acceptance]:
    gate, found, table = trace.scenario.gatekeeper, list[Acceptance](), trace.decisions
    mine = table[table["robot"] == ugv].sort_values("t_s", kind="stable")
    given = zip(mine["number"].tolist(), mine["decision"].tolist(), mine["t_s"].tolist(), strict=True)
    answers = [(number, said, [t for *_, t in rows]) for (number, said), rows in groupby(given, lambda row: row[:2])]
    for (number, said, times), following in zip_longest(answers, answers[1:]):
        if said == "accept":
            on, back = proposal_of(trace, number), following is not None and following[0] == number
            end_s = following[2][0] if back else min(times[-1] + gate.period_s, float(trace.t[-1]))
            found.append(Acceptance(on, times[0], end_s, min(float(on.times_s[-1]), times[0] + gate.longest_s), back))
    return found
