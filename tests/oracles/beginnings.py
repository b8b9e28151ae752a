"""What a UGV knew when it decided about a proposal, and how it predicts other robots, again from a trace."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.check.plants import law_m, taken
from airground_drake.scenario.courses import course
from airground_drake.scenario.load import resolved
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import corner_times, interpolate, travelled
from airground_drake.verify.engines.outlines import GAP, RADIUS, SPEED, Cores, away_from
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.pairs import Pair, cores_of, pairs_beside, pairs_of, preset_of
from airground_drake.verify.runs.proposals import ProposalRecord, proposal_of
from oracles.closed_loops import Scene
from oracles.control_law import place, selected
from oracles.positions import acts_on_old
from oracles.protocol import parts_of
from oracles.sensing import moves, place_of, still_parts
from oracles.turning import numbers_of


class Beginning(NamedTuple):
    """What the roll-outs of a decision by outcomes begin with; S is the number of periods.

    Attributes:
        refused, accepted: the closed loops if the proposal is refused and if it is accepted.
        settled: periods after which the prediction ends once nothing moves.
        goal: (3,), m.
    """

    refused: Scene
    accepted: Scene
    settled: int
    goal: Array

    @property
    def known(self) -> tuple[Cores, Array]:
        return self.refused.still, self.refused.safe[: len(self.refused.still.base)]


def beginning(trace: Trace, t: float, number: int) -> Beginning:
    """What the roll-outs begin with when a UGV decides by outcomes at t, s, about the proposal with a number.

    What the UGV knew is taken as recorded: see `inputs`.
    """
    table = trace.decisions
    (row,) = table[(table["t_s"] == t) & (table["number"] == number)].to_dict("records")
    gate, h = trace.scenario.gatekeeper, trace.scenario.control.period_s
    on = proposal_of(trace, number)
    asked = {part.ugv: part for part in parts_of(trace, on)}
    robot = on.ugv
    corners, speed = preset_of(trace, robot)
    arrives = float(corner_times(corners, speed)[-1]) if len(corners) > 1 else 0.0
    until = min(float(on.times_s[-1]), t + gate.longest_s)
    ends = min(max(until, arrives), t + gate.longest_s) + gate.settling_s
    after = h * np.arange(np.ceil((ends - t) / h) + 1.0)
    still, law = known_cores(trace, row, on)
    pairs = [pair for pair in _among_robots(trace) if robot in (pair.first, pair.second)]
    others = [_other(trace, robot, t, after, pair, asked) for pair in pairs]
    known = [mover.ends for mover in movers(trace, robot, t, after)]
    settled = max(until, arrives, t + gate.horizon_s, *(end for _, _, _, end in others), *known)
    law = np.concatenate([law, np.array([(each[1], each[2], 0.0) for each in others]).reshape(-1, 3).T], axis=1)

    def loop(choice: int, periods: int) -> Scene:
        points = np.stack([each[0][choice] for each in others], axis=1) if others else np.empty((len(after), 0, 3))
        return scene(trace, on, t, after, periods, still, points, law)

    executed = max(0, int(np.ceil((until - t) / h - 1e-9)))
    settles = round(np.ceil((settled - t) / h - 1e-9))
    return Beginning(loop(0, 0), loop(1, executed), settles, corners[-1])


def scene(
    trace: Trace, on: ProposalRecord, t: float, after: Array, periods: int, still: Cores, points: Array, law: Array
) -> Scene:
    """The closed loop of the UGV that a proposal is for, with the obstacles that move and are within its range."""
    around = movers(trace, on.ugv, t, after)
    origins = np.stack([each.places for each in around], axis=1) if around else np.empty((len(after), 0, 3))
    of_movers = np.array([(pair.law_m, pair.share, pair.speed_m_s) for pair, *_ in around]).reshape(-1, 3).T
    safe, share, speed = np.concatenate([law, of_movers], axis=1)
    numbers, heading = numbers_of(trace, on.ugv), 0.0
    if numbers[0]:
        heading = float(np.interp(t, trace.t, trace.column(f"{on.ugv}.heading_rad")))
    return Scene(
        here=place_of(trace, on.ugv, t),
        preset=travelled(*preset_of(trace, on.ugv), t + after),
        wanted=place(on, t + after),
        executed=np.arange(len(after) - 1) < periods,
        chosen=selected(on),
        limit=np.array(trace.scenario.ugvs[on.ugv].max_speed_m_s),
        still=still,
        points=points,
        movers=Cores.joined([each.core for each in around]),
        origins=origins,
        safe=safe,
        share=share,
        speed=speed,
        heading=np.array(heading),
        numbers=numbers,
    )


class Mover(NamedTuple):
    """A part of what moves: its pair, its core about the origin, (1,), and the places of the origin, (S + 1, 3), m.

    `ends`: when a known motion is over, s; -inf for another one.
    """

    pair: Pair
    core: Cores
    places: Array
    ends: float


def movers(trace: Trace, ugv: str, t: float, after: Array) -> list[Mover]:
    """What moves, is there, and is within sensing range of a UGV at a time, s, at times `after` that, (S + 1,), s.

    It is predicted to go on as it goes for the horizon and then to stand; under method (d) a known motion goes its way.
    """
    gate, reach, here = trace.scenario.gatekeeper, trace.scenario.control.sensing_range_m, trace.position(ugv)
    row, found = int(np.searchsorted(trace.t, t + TIME_TOLERANCE_S)) - 1, list[Mover]()
    for name, barrier in trace.scenario.barriers.items():
        gone = barrier.disappears_s and trace.there_until(name) <= row
        if not barrier.moves or gone or trace.there_from(name) > row:
            continue
        way, own = trace.position(name), cores_of(trace)[name]
        velocity = (way[row + 1] - way[row]) / (trace.t[row + 1] - trace.t[row])
        places, ends = way[row] + np.minimum(after, gate.horizon_s)[:, None] * velocity, -np.inf
        if barrier.known_motion and trace.meta["method"] not in ON_TOP:
            script = course(barrier.moves, trace.scenario.control.period_s, trace.scenario.duration_s)
            places, ends = interpolate(script.times, script.positions, t + after), float(script.times[-1])
        near = np.flatnonzero(away_from(own, here[row] - way[row], planar=True).distance <= reach)
        pair = pairs_beside(trace, ugv)[name]
        found += [Mover(pair, own.take(slice(k, k + 1)), places, ends) for k in near.tolist()]
    return found


def _among_robots(trace: Trace) -> list[Pair]:
    robots = set(trace.robots)
    return trace.derived("robots", lambda: [pair for pair in pairs_of(trace) if pair.second in robots])


def known_cores(trace: Trace, row: dict[Any, Any], on: ProposalRecord) -> tuple[Cores, Array]:
    """Parts that a UGV had sensed when it decided, and those of the message that it believed, as recorded."""
    known, told = (np.array(row[name], dtype=np.intp) for name in ("known", "told"))
    parts, pairs = still_parts(trace), pairs_beside(trace, on.ugv)
    beside = [pairs[parts.names[k]] for k in parts.owner[known]]
    claimed = on.mapped[told]
    theirs = claimed[:, GAP] + (trace.scenario.ugvs[on.ugv].radius_m + claimed[:, RADIUS])
    given = resolved(trace.scenario)
    room = taken(given["ugvs"][on.ugv], given["control"])
    passive = (claimed[:, SPEED] > 0.0).tolist()
    theirs = np.array(
        [law_m(safe, room, None, passive=moves_) for safe, moves_ in zip(theirs.tolist(), passive, strict=True)]
    )
    if error_m := trace.scenario.position_error_m:
        theirs = error_m + np.hypot(theirs - room.drift_m, error_m) + room.drift_m
    safe, speed = [pair.law_m for pair in beside], [pair.speed_m_s for pair in beside]
    law = np.array([np.append(safe, theirs), np.ones(len(known) + len(told)), np.append(speed, claimed[:, SPEED])])
    return Cores.joined([parts.cores.take(known), Cores.of(claimed)]), law


def _other(
    trace: Trace, robot: str, t: float, after: Array, pair: Pair, told: Mapping[str, ProposalRecord]
) -> tuple[tuple[Array, Array], float, float, float]:
    """Where another robot is predicted to be, (S + 1, 3), m; its safe distance, its share, when its motion is over.

    The share is below 0 where old positions count: minus how far off it may be then, m.

    The places come twice: if the proposal is refused, and if it is accepted. The other part of its joint plan counts in
    the second only.
    """
    other = pair.second if pair.first == robot else pair.first
    here, velocity = moves(trace, other, t)
    coasting = here + np.minimum(after, trace.scenario.gatekeeper.horizon_s)[:, None] * velocity
    asked, share = told.get(other), pair.share
    if acts_on_old(trace) and other in trace.ugvs:
        since = (trace.scenario.late_samples + 1) * trace.scenario.control.period_s
        share = -trace.scenario.ugvs[other].max_speed_m_s * since
    if asked is None:
        return (coasting, coasting), pair.law_m, share, -np.inf
    goes = place(asked, t + after) + np.exp(-after)[:, None] * (here - place(asked, t))
    return (coasting, goes), pair.law_m, share, float(asked.times_s[-1])
