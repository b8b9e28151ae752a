"""Messages are sent only while they are needed, and carry the obstacles that the UAV knew."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Obstacle
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.instants import intervening
from airground_drake.verify.runs.pairs import appears_of
from airground_drake.verify.runs.proposals import proposals_of
from oracles.fault import Fault
from oracles.protocol import answers_to, withdrawn_s

SENSED_M = 1e-9
"""Within this of the sensing range an obstacle may have been sensed or not, m."""
Disc = tuple[float, ...]
"""Centre and radius, m."""


def wrong_messages(trace: Trace) -> list[Fault]:
    """Proposals and decisions out of turn, and proposals whose map is not the UAV's."""
    return [*_out_of_turn(trace), *_wrong_maps(trace)]


def _out_of_turn(trace: Trace) -> Iterator[Fault]:
    """Messages while neither the UGV nor the one that it was to make way for was being intervened on.

    After a release the UAV withdraws its proposal at its next planning instant, and the gatekeeper notices at its next
    sample: one period each is allowed.
    """
    allowance = trace.scenario.intervention.period_s + trace.scenario.gatekeeper.period_s
    for sent in proposals_of(trace):
        spans = np.concatenate([intervening(trace, ugv) for ugv in sorted({sent.ugv, sent.cause})])
        begins, ends = spans[:, 0] - TIME_TOLERANCE_S, spans[:, 1] + allowance + TIME_TOLERANCE_S
        messages = [("proposal", sent.issued_s), *(("decision", answer.t_s) for answer in answers_to(trace, sent))]
        if wrong := [(kind, t) for kind, t in messages if not ((t >= begins) & (t <= ends)).any()]:
            yield Fault(f"{wrong[0][0]} while nobody needs it", sent.ugv, wrong[0][1])


def _wrong_maps(trace: Trace) -> Iterator[Fault]:
    """Proposals whose obstacles are not those that the UAV knew; third-party policies may send other maps.

    The UAV knows an obstacle that came with an answer from the next planning instant on, if the proposal is in force
    until then.
    """
    scenario = trace.scenario
    appears = dict(zip(scenario.obstacles, appears_of(trace).tolist(), strict=True))
    phantoms = [(*map(float, place), 0.0) for place in scenario.uav.phantoms_m]
    surely, perhaps = _told(trace)
    for sent in proposals_of(trace):
        listed = [tuple(row) for row in np.column_stack([sent.mapped_m, sent.mapped_radius_m]).tolist()]
        t = sent.issued_s
        there = [each for name, each in scenario.obstacles.items() if appears[name] <= t + TIME_TOLERANCE_S]
        known = [*(_disc(each) for each in there if each.known_to_uav), *phantoms]
        learnt = listed[len(known) :]
        least = {disc for disc, noticed in surely.items() if noticed <= t + TIME_TOLERANCE_S}
        most = {disc for disc, answered in perhaps.items() if answered < t - TIME_TOLERANCE_S}
        right = listed[: len(known)] == known and len({*learnt}) == len(learnt)
        right &= least - {*known} <= {*learnt} <= most - {*known}
        if not right and ":" not in sent.policy:
            yield Fault("map of a proposal", sent.ugv, t, {"learnt": learnt, "told": sorted(most)})


def _told(trace: Trace) -> tuple[dict[Disc, float], dict[Disc, float]]:
    """When the UAV surely knew each obstacle that came with an answer, and when it may have known it, s.

    At a planning instant the UAV reads the last answer before, if the proposal has been in force until then.
    """
    reach, period = trace.scenario.control.sensing_range_m, trace.scenario.intervention.period_s
    discs = [_disc(each) for each in trace.scenario.obstacles.values()]
    centres = np.array(discs).reshape(-1, 4)[:, :3]
    surely, perhaps = dict[Disc, float](), dict[Disc, float]()
    for sent in proposals_of(trace):
        end = min(withdrawn_s(trace, sent), float(trace.t[-1])) + TIME_TOLERANCE_S
        read = dict[float, float]()  # by time of the last answer before a planning instant
        for k in range(round(sent.issued_s / period) + 1, int(end / period + 1e-6) + 1):
            before = [answer.t_s for answer in answers_to(trace, sent) if answer.t_s < k * period - TIME_TOLERANCE_S]
            if before:
                read.setdefault(before[-1], k * period)
        for answer in answers_to(trace, sent):
            here = interpolate(trace.t, trace.position(sent.ugv), answer.t_s)
            away = np.linalg.norm(centres - here, axis=1) - reach
            away = np.where(appears_of(trace) <= answer.t_s + TIME_TOLERANCE_S, away, np.inf)
            for disc, far in zip(discs, away.tolist(), strict=True):
                if far <= SENSED_M:
                    perhaps[disc] = min(answer.t_s, perhaps.get(disc, np.inf))
                if far <= -SENSED_M:
                    surely[disc] = min(read.get(answer.t_s, np.inf), surely.get(disc, np.inf))
    return surely, perhaps


def _disc(obstacle: Obstacle) -> Disc:
    x, y, z = obstacle.position_m
    return x, y, z, obstacle.radius_m
