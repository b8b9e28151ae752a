"""What a proposal says of obstacles, and how long it stands: by the UAV's map, the answers and the periods."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import interpolate
from airground_drake.verify.runs.proposals import answers_to, parts_of, proposals_of, withdrawn_s

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
    """Joint plans of which a part was not sent, decisions on what was withdrawn, and replacements for no reason.

    A proposal in force is replaced only by a part of a joint plan, or while another UGV is intervened on, for which the
    policies may have been asked.
    """
    every = proposals_of(trace)
    for sent in every:
        there = {sent.ugv, *(part.ugv for part in parts_of(trace, sent))}
        if missing := sorted(set(sent.party) - there):
            yield {"robot": sent.ugv, "kind": "part of a joint plan not sent", "t_s": sent.issued_s, "to": missing}
        end = withdrawn_s(trace, sent)
        for answer in answers_to(trace, sent):
            if answer.t_s > end + TIME_TOLERANCE_S:
                late = {"withdrawn_s": end, "number": sent.number}
                yield {"robot": sent.ugv, "kind": "decision on what was withdrawn", "t_s": answer.t_s, **late}
    for ugv in trace.ugvs:
        for before, after in pairwise(sent for sent in every if sent.ugv == ugv):
            t = after.issued_s + TIME_TOLERANCE_S
            row = min(int(np.searchsorted(trace.t, after.issued_s - TIME_TOLERANCE_S)), len(trace.t) - 1)
            others = any(trace.column(f"{other}.mode")[row] == 1.0 for other in trace.ugvs if other != ugv)
            alone = not (after.party or others) and after.cause == ugv
            if alone and withdrawn_s(trace, before, unless_replaced=True) > t and before.times_s[-1] > t:
                yield {"robot": ugv, "kind": "replaced while in force", "t_s": after.issued_s, "by": after.policy}


def _told(trace: Trace) -> Iterator[Told]:
    reach = trace.scenario["control"]["sensing_range_m"]
    discs = [_disc(each) for each in trace.scenario["obstacles"].values()]
    centres = np.array(discs).reshape(-1, 4)[:, :3]
    for sent in proposals_of(trace):
        noticed = withdrawn_s(trace, sent)
        refused = [answer.t_s for answer in answers_to(trace, sent) if not answer.accepted]
        for when in refused:
            away = np.linalg.norm(centres - interpolate(trace.t, trace.position(sent.ugv), when), axis=1) - reach
            surely, possibly = ({disc for disc, far in zip(discs, away, strict=True) if far <= side * SENSED_M}
                                for side in (-1.0, 1.0))  # fmt: skip
            last = not any(when < other < noticed - TIME_TOLERANCE_S for other in refused)
            in_time = last and when < noticed - TIME_TOLERANCE_S
            yield Told(when, noticed if in_time else np.inf, surely, possibly)


def _disc(obstacle: dict[str, Any]) -> Disc:
    return (*map(float, obstacle["position_m"]), float(obstacle["radius_m"]))
