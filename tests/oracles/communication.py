"""Messages are sent only while they are needed, and carry the obstacles that the UAV knew."""

from collections.abc import Iterator

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.outlines import CORNERS, COUNT, MIDDLE, Cores
from airground_drake.verify.runs.demands import outlines_of
from airground_drake.verify.runs.pairs import carried
from airground_drake.verify.runs.proposals import proposals_of
from oracles.channel import has_channel
from oracles.fault import Fault
from oracles.protocol import answers_to, known_answers, withdrawn_s
from oracles.sensing import are_same, are_there, beyond_range, still_parts

SENSED_M = 1e-9
"""Within this of the sensing range an obstacle may have been sensed or not, m."""
Part = tuple[float, ...]
"""The numbers of an outline, but for the circle round its corners."""


def wrong_messages(trace: Trace) -> list[Fault]:
    return [*_answered_otherwise(trace), *_wrong_maps(trace)]


def _answered_otherwise(trace: Trace) -> Iterator[Fault]:
    """Decisions of which the UAV should have been told, or need not have been.

    A UGV answers when it decides otherwise than before, or senses what neither its proposal's map nor its last answer
    has. While an obstacle moves that the UAV does not see, it may answer all the time.
    """
    still = still_parts(trace)
    unseen = any(barrier.moves and not barrier.known_to_uav for barrier in trace.scenario.barriers.values())
    numbers = trace.decisions.sort_values("t_s", kind="stable").groupby("number")["answer"].apply(list).to_dict()
    for sent in proposals_of(trace):
        shown, before = are_same(still.cores, Cores.of(sent.mapped)).any(axis=1), None
        told = np.zeros((2, len(shown)), dtype=np.bool_)
        for answer, number in zip(answers_to(trace, sent), numbers.get(sent.number, []), strict=True):
            away = np.where(are_there(trace, answer.t_s), beyond_range(trace, sent.ugv, answer.t_s), np.inf)
            near = np.array([away <= -SENSED_M, away <= SENSED_M])  # surely, perhaps
            new = near & ~shown & ~told[::-1]
            due = before is None or (before.accepted, before.done) != (answer.accepted, answer.done)
            if (due or new[0].any()) if number < 0 else not (due or unseen or new[1].any()):
                yield Fault("answers out of turn", sent.ugv, answer.t_s, {"due": due, "number": number})
            before, told = answer, near if number >= 0 else told


def _wrong_maps(trace: Trace) -> Iterator[Fault]:
    """Proposals whose obstacles are not those that the UAV knew; third-party policies may send other maps.

    The UAV knows an obstacle that came with an answer from the next planning instant on, if the proposal is in force
    until then. One that was on its own map, and then disappeared, it need not have learnt.
    """
    scenario, parts, numbers = trace.scenario, still_parts(trace), carried(trace)[0][0].tolist()
    outlines = list(map(tuple, map(np.ndarray.tolist, outlines_of(trace))))
    every = [outlines[k] for k in numbers]
    told_before = np.array([scenario.barriers[parts.names[k]].known_to_uav for k in parts.owner], dtype=np.bool_)
    once = {every[k] for k in np.flatnonzero(told_before)}
    gap = scenario.safe_distance.obstacle_m
    told = {uav: _told(trace, every, uav) for uav in scenario.aerial}
    for sent in proposals_of(trace):
        surely, perhaps = told[sent.sender]
        phantoms = [(gap, 0.0, 0.0, z, z, 1.0, x, y) for x, y, z in scenario.aerial[sent.sender].phantoms_m]
        listed, t = list(map(_without_circle, sent.mapped)), sent.issued_s
        there = told_before & are_there(trace, t)
        known = [*(every[k] for k in np.flatnonzero(there)), *phantoms]
        learnt = listed[len(known) :]
        least = {part for part, noticed in surely.items() if noticed <= t + TIME_TOLERANCE_S}
        most = {part for part, answered in perhaps.items() if answered < t - TIME_TOLERANCE_S}
        right = listed[: len(known)] == known and len({*learnt}) == len(learnt)
        right &= least - {*known} - once <= {*learnt} <= most - {*known}
        if not right and ":" not in sent.policy:
            yield Fault("map of a proposal", sent.ugv, t, {"learnt": learnt, "told": sorted(most)})


def _told(trace: Trace, every: list[Part], uav: str) -> tuple[dict[Part, float], dict[Part, float]]:
    """When a UAV surely knew each part of a barrier that came with an answer, and when it may have known it, s.

    At a planning instant the UAV reads the last answer before, if the proposal has been in force until then.
    """
    period, surely, perhaps = trace.scenario.intervention.period_s, dict[Part, float](), dict[Part, float]()
    for sent in (sent for sent in proposals_of(trace) if sent.sender == uav):
        end = min(withdrawn_s(trace, sent), float(trace.t[-1])) + TIME_TOLERANCE_S
        read = dict[float, float]()  # by time of the last answer before a planning instant
        for k in range(round(sent.issued_s / period) + 1, int(end / period + 1e-6) + 1):
            before = [answer.t_s for answer in answers_to(trace, sent) if answer.t_s < k * period - TIME_TOLERANCE_S]
            if has_channel(trace):
                before = [answer.t_s for answer in known_answers(trace, sent, k * period)]
            if before:
                read.setdefault(before[-1], k * period)
        for answer in answers_to(trace, sent):
            there = are_there(trace, answer.t_s)
            away = np.where(there, beyond_range(trace, sent.ugv, answer.t_s), np.inf)
            for k in np.flatnonzero(away <= SENSED_M).tolist():
                part = every[k]
                perhaps[part] = min(answer.t_s, perhaps.get(part, np.inf))
                if away[k] <= -SENSED_M:
                    surely[part] = min(read.get(answer.t_s, np.inf), surely.get(part, np.inf))
    return surely, perhaps


def _without_circle(row: Array) -> Part:
    return tuple(np.append(row[:MIDDLE], row[CORNERS : CORNERS + 2 * int(row[COUNT])]).tolist())
