"""What a UGV knew when it decided about a proposal, and how it predicts other robots, again from a trace."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import corner_times, interpolate, travelled
from airground_drake.verify.runs.pairs import Pair, appears_of, centres_of, pairs_of, preset_of
from airground_drake.verify.runs.proposals import ProposalRecord, proposal_of, proposals_of
from oracles.closed_loops import Scene
from oracles.control_law import place, selected
from oracles.protocol import answers_to
from oracles.sensing import moves

MOST_CLAIMED = 64
"""Obstacles of a message that a UGV takes into account."""


class Beginning(NamedTuple):
    """What the roll-outs of a decision by outcomes begin with; S is the number of periods.

    Attributes:
        refused, accepted: the closed loops if the proposal is refused and if it is accepted. Obstacles come first
            among their points.
        settled: periods after which the prediction ends once nothing moves.
        discs: number of obstacles.
        goal: (3,), m.
    """

    refused: Scene
    accepted: Scene
    settled: int
    discs: int
    goal: Array

    @property
    def known(self) -> tuple[Array, Array]:
        """Centres of the obstacles, (discs, 3), and the distances that are kept from them, (discs,), m."""
        return self.refused.points[0, : self.discs], self.refused.safe[: self.discs]


def beginning(trace: Trace, t: float, number: int) -> Beginning:
    """What the roll-outs begin with when a UGV decides by outcomes at t, s, about the proposal with a number."""
    gate, h = trace.scenario.gatekeeper, trace.scenario.control.period_s
    on = proposal_of(trace, number)
    robot = on.ugv
    corners, speed = preset_of(trace, robot)
    arrives = float(corner_times(corners, speed)[-1]) if len(corners) > 1 else 0.0
    until = min(float(on.times_s[-1]), t + gate.longest_s)
    ends = min(max(until, arrives), t + gate.longest_s) + gate.settling_s
    after = h * np.arange(np.ceil((ends - t) / h) + 1.0)
    discs, distances = known_discs(trace, robot, t, on)
    pairs = [pair for pair in _among_robots(trace) if robot in (pair.first, pair.second)]
    others = [_other(trace, robot, t, after, pair) for pair in pairs]
    settled = max(until, arrives, t + gate.horizon_s, *(end for _, _, _, end in others))
    fixed = np.broadcast_to(discs, (len(after), *discs.shape))
    safe = np.array([*distances, *(each[1] for each in others)])
    share = np.array([1.0] * len(discs) + [each[2] for each in others])

    def loop(choice: int, periods: int) -> Scene:
        points = np.concatenate([fixed, *(each[0][choice][:, None] for each in others)], axis=1)
        return scene(trace, on, t, after, periods, points, safe, share)

    executed = max(0, int(np.ceil((until - t) / h - 1e-9)))
    settles = round(np.ceil((settled - t) / h - 1e-9))
    return Beginning(loop(0, 0), loop(1, executed), settles, len(discs), corners[-1])


def scene(
    trace: Trace, on: ProposalRecord, t: float, after: Array, periods: int, points: Array, safe: Array, share: Array
) -> Scene:
    """The closed loop of the UGV that a proposal is for.

    Args:
        trace: the run.
        on: the proposal.
        t: when it begins, s.
        after: the control samples, since then, (S + 1,), s.
        periods: for which the proposal is executed.
        points: to keep away from, at the samples, (S + 1, K, 3), m.
        safe: distances to keep, (K,), m.
        share: of the inequalities, (K,).
    """
    return Scene(
        here=interpolate(trace.t, trace.position(on.ugv), t),
        preset=travelled(*preset_of(trace, on.ugv), t + after),
        wanted=place(on, t + after),
        executed=np.arange(len(after) - 1) < periods,
        chosen=selected(on),
        limit=np.array(trace.scenario.ugvs[on.ugv].max_speed_m_s),
        points=points,
        safe=safe,
        share=share,
    )


def _among_robots(trace: Trace) -> list[Pair]:
    robots = set(trace.robots)
    return trace.derived("robots", lambda: [pair for pair in pairs_of(trace) if pair.second in robots])


def known_discs(trace: Trace, robot: str, t: float, on: ProposalRecord) -> tuple[Array, Array]:
    """Obstacles that a UGV has sensed up to a time, and those of the message that it would not sense.

    At most the `MOST_CLAIMED` nearest ones of the message count, and those with a negative radius are left out.

    Returns:
        Centres, (k, 3), and the distances that the UGV keeps from them, (k,), m.
    """
    sensing, gate_s = trace.scenario.control.sensing_range_m, trace.scenario.gatekeeper.period_s
    samples = gate_s * np.arange(round(t / gate_s) + 1.0)
    was = interpolate(trace.t, trace.position(robot), np.minimum(samples, t))
    obstacles = centres_of(trace)
    there = samples[:, None] >= appears_of(trace) - TIME_TOLERANCE_S
    seen = (there & (np.linalg.norm(was[:, None] - obstacles, axis=2) <= sensing)).any(axis=0)
    hidden = np.linalg.norm(on.mapped_m - was[-1], axis=1) > sensing
    told = np.column_stack([on.mapped_m, on.mapped_radius_m])[hidden & (on.mapped_radius_m >= 0.0)]
    apart = np.linalg.norm(told[:, None, :3] - obstacles[seen], axis=2)
    new = told[(apart > 1e-9).all(axis=1)]
    order = np.linalg.norm(new[:, :3] - was[-1], axis=1).argsort(kind="stable")
    radii = np.array([each.radius_m for each in trace.scenario.obstacles.values()])
    known = np.concatenate([np.column_stack([obstacles, radii])[seen], new[order.argsort() < MOST_CLAIMED]])
    own = trace.scenario.ugvs[robot].radius_m
    return known[:, :3], trace.scenario.safe_distance.obstacle_m + (own + known[:, 3])


def _other(
    trace: Trace, robot: str, t: float, after: Array, pair: Pair
) -> tuple[tuple[Array, Array], float, float, float]:
    """Where another robot is predicted to be, (S + 1, 3), m; its safe distance, its share, when its motion is over.

    The places come twice: if the proposal is refused, and if it is accepted. A motion that the other robot has not
    accepted yet counts in the latter only.
    """
    other = pair.second if pair.first == robot else pair.first
    here, velocity = moves(trace, other, t)
    coasting = here + np.minimum(after, trace.scenario.gatekeeper.horizon_s)[:, None] * velocity
    asked, accepted = asked_of(trace, other, t)
    if asked is None:
        return (coasting, coasting), pair.safe_m, pair.share, -np.inf
    goes = place(asked, t + after) + np.exp(-after)[:, None] * (here - place(asked, t))
    return (goes if accepted else coasting, goes), pair.safe_m, pair.share, float(asked.times_s[-1])


def asked_of(trace: Trace, ugv: str, t: float) -> tuple[ProposalRecord | None, bool]:
    """The proposal in force for a UGV at a sample of the gatekeeper, unless it has refused it by the sample before.

    A proposal is in force if the UGV decides about it at that sample. Besides: whether it has accepted it by then.
    """
    for one in proposals_of(trace):
        answers = answers_to(trace, one) if one.ugv == ugv else []
        if any(abs(answer.t_s - t) <= TIME_TOLERANCE_S for answer in answers):
            before = [answer.accepted for answer in answers if answer.t_s < t - TIME_TOLERANCE_S]
            return (one if all(before[-1:]) else None), any(before[-1:])
    return None, False
