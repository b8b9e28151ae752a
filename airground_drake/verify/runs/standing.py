"""What a proposal says of obstacles, and how long it stands: by the UAV's map, the answers and the periods."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import interpolate
from airground_drake.verify.runs.proposals import answers_of, proposals_of, withdrawn_s

SENSED_M = 1e-9
"""Within this of the sensing range an obstacle may have been sensed or not, m."""
Disc = tuple[float, ...]
"""Centre and radius, m."""


class Told(NamedTuple):
    """A refusal, with the obstacles that the UGV sensed then: surely, and those that it may have sensed besides."""

    refused_s: float
    noticed_s: float
    surely: set[Disc]
    perhaps: set[Disc]


def map_conflicts(trace: Trace) -> Iterator[dict[str, Any]]:
    """Proposals whose obstacles are not those that the UAV knew: own policies send its map as it is.

    What comes with a refusal the UAV knows from the planning instant on at which it notices that: the next one, if the
    proposal is in force until then.
    """
    scenario = trace.scenario
    known = [_disc(each) for each in scenario["obstacles"].values() if each["known_to_uav"]]
    known += [(*map(float, place), 0.0) for place in scenario["uav"]["phantoms_m"]]
    told = list(_told(trace))
    for sent in proposals_of(trace):
        listed = [tuple(row) for row in np.column_stack([sent.mapped_m, sent.mapped_radius_m]).tolist()]
        learnt, t = listed[len(known) :], sent.issued_s
        least = {disc for each in told if each.noticed_s <= t + TIME_TOLERANCE_S for disc in each.surely}
        most = {disc for each in told if each.refused_s < t - TIME_TOLERANCE_S for disc in each.surely | each.perhaps}
        right = listed[: len(known)] == known and len({*learnt}) == len(learnt)
        right &= least - {*known} <= {*learnt} <= most - {*known}
        if not right and ":" not in sent.policy:
            yield {"robot": sent.ugv, "kind": "map of a proposal", "t_s": t, "learnt": learnt, "told": sorted(most)}


def standing_conflicts(trace: Trace) -> Iterator[dict[str, Any]]:
    """Decisions on proposals that had been withdrawn, and proposals that have replaced one in force for no reason.

    Proposals that are sent at the same instant may be parts of a joint plan: one of which another UGV has refused its
    part may be replaced at any time, and so may any other proposal by a part of such a plan. While another UGV is
    intervened on, too, any proposal may be replaced: the policies may have been asked about that one.
    """
    every = proposals_of(trace)
    together = Counter(sent.issued_s for sent in every)
    for ugv in trace.ugvs:
        answers, mine = answers_of(trace, ugv), [sent for sent in every if sent.ugv == ugv]
        ends = {sent.number: withdrawn_s(trace, ugv, sent, mine, answers) for sent in mine}
        for when, number, _ in answers:
            if when > ends[number] + TIME_TOLERANCE_S:
                late = {"withdrawn_s": ends[number], "number": number}
                yield {"robot": ugv, "kind": "decision on what was withdrawn", "t_s": when, **late}
        for before, after in pairwise(mine):
            t = after.issued_s + TIME_TOLERANCE_S
            alone = together[before.issued_s] == together[after.issued_s] == 1 and after.cause == ugv
            row = min(int(np.searchsorted(trace.t, after.issued_s - TIME_TOLERANCE_S)), len(trace.t) - 1)
            alone &= not any(trace.column(f"{other}.mode")[row] == 1.0 for other in trace.ugvs if other != ugv)
            if alone and withdrawn_s(trace, ugv, before, [before], answers) > t and before.times_s[-1] > t:
                yield {"robot": ugv, "kind": "replaced while in force", "t_s": after.issued_s, "by": after.policy}


def _told(trace: Trace) -> Iterator[Told]:
    reach = trace.scenario["control"]["sensing_range_m"]
    discs = [_disc(each) for each in trace.scenario["obstacles"].values()]
    centres = np.array(discs).reshape(-1, 4)[:, :3]
    for ugv in trace.ugvs:
        answers, mine = answers_of(trace, ugv), [sent for sent in proposals_of(trace) if sent.ugv == ugv]
        ends = {sent.number: withdrawn_s(trace, ugv, sent, mine, answers) for sent in mine}
        refused = [(when, number) for when, number, accepted in answers if not accepted]
        for (when, number), here in zip(
            refused, interpolate(trace.t, trace.position(ugv), np.array([when for when, _ in refused])), strict=True
        ):
            away = np.linalg.norm(centres - here, axis=1) - reach
            surely, possibly = ({disc for disc, far in zip(discs, away, strict=True) if far <= side * SENSED_M}
                                for side in (-1.0, 1.0))  # fmt: skip
            later = [other for other, on in refused if on == number and other > when]
            noticed = ends[number]
            last = not any(other < noticed - TIME_TOLERANCE_S for other in later)
            in_time = last and when < noticed - TIME_TOLERANCE_S
            yield Told(when, noticed if in_time else np.inf, surely, possibly)


def _disc(obstacle: dict[str, Any]) -> Disc:
    return (*map(float, obstacle["position_m"]), float(obstacle["radius_m"]))
