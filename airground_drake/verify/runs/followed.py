"""Accepted interventions of a run, and whether a new obstacle was sensed meanwhile: the premise of LIVE-GATE."""

from __future__ import annotations

from itertools import compress
from typing import Any, NamedTuple

import numpy as np

from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.beginnings import known_discs
from airground_drake.verify.runs.instants import samples_of
from airground_drake.verify.runs.pairs import appears_of, centres_of
from airground_drake.verify.runs.proposals import accepted_at, proposal_of

METHOD = "d"
"""Only this method predicts where an accepted intervention leads."""
SAME_M = 1e-9
"""Obstacles closer to each other than this are one, m."""


class Followed(NamedTuple):
    """An accepted intervention, from its acceptance until it is given back, withdrawn, over, or the run ends.

    Attributes:
        ugv: which UGV.
        t_s: when it was accepted.
        new: obstacles that were sensed meanwhile and were not known at the acceptance.
    """

    ugv: str
    t_s: float
    new: list[str]

    @property
    def met(self) -> bool:
        """Whether the premise of LIVE-GATE was met: nothing was new."""
        return not self.new


def followed(trace: Trace) -> list[Followed]:
    """All accepted interventions of a run under method (d), by time; [] for another method.

    Raises:
        TraceError: if a decision is on a proposal that was not sent.
    """
    if trace.meta["method"] != METHOD:
        return []
    table = trace.decisions
    first = table[(table["decision"] == "accept") & (table["accept_stalls"] >= 0.0)]
    return [_followed(trace, row) for row in first.to_dict("records")]


def _followed(trace: Trace, given: dict[Any, Any]) -> Followed:
    ugv, t_s, on = str(given["robot"]), float(given["t_s"]), proposal_of(trace, given["number"])
    samples = samples_of(trace)
    begin = int(np.searchsorted(trace.t[samples], t_s - TIME_TOLERANCE_S))
    executed = [one is on for one in accepted_at(trace, ugv)[begin:]]
    lasts = executed.index(False) if False in executed else len(executed)
    rows = np.append(samples, len(trace.t) - 1)[begin : begin + lasts + 1]
    places, there = trace.position(ugv)[rows], trace.t[rows, None] >= appears_of(trace) - TIME_TOLERANCE_S
    centres, reach = centres_of(trace), trace.scenario.control.sensing_range_m
    known, _ = known_discs(trace, ugv, t_s, on)
    sensed = (there & (np.linalg.norm(places[:, None] - centres, axis=2) <= reach)).any(axis=0)
    strange = (np.linalg.norm(centres[:, None] - known, axis=2) > SAME_M).all(axis=1)
    return Followed(ugv, t_s, list(compress(trace.scenario.obstacles, sensed & strange)))
