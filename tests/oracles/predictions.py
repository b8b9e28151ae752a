"""What the gatekeeper predicts for yes and for no is what the UGV would do, rolled out again by other code."""

from collections.abc import Iterator, Sequence

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of
from airground_drake.verify.runs.pairs import pairs_beside
from airground_drake.verify.runs.proposals import proposal_of
from oracles.beginnings import scene
from oracles.closed_loops import NUDGES_M, Scene, in_batches, move_apart, roll_out, stacked
from oracles.fault import Fault
from oracles.outcome_rolls import Foreseen, foreseen
from oracles.sensing import sensed, still_parts

VELOCITY_TOLERANCE_M_S = 1e-6
"""Recorded and recomputed mode velocities may differ by this, m/s: rounding of two algorithms, which the closed loop
damps; a corner of nearly parallel inequalities enlarges it."""
OUTCOME_TOLERANCE = 1e-6
"""Recorded and recomputed outcomes may differ by this, relative, or in m^2 s: they are sums over such velocities."""
LEFT_TOLERANCE_M = 1e-3
"""A recorded way may be outside its bounds by this, m, or by `OUTCOME_TOLERANCE` of it: the recomputed end is not quite
the recorded one."""
CHOICES = ("refuse", "accept")


def wrong_predictions(trace: Trace) -> list[Fault]:
    """Decisions that rest on other mode velocities, or under method (d) on other outcomes, than those rolled out again.

    Under method (d) outcomes are recorded for the first decision about a proposal. A velocity that a push of 1e-12 m in
    every period changes depends on rounding, and is not compared: a robot that heads straight for another one, say.
    """
    rows = rows_of(trace)
    return [*(_wrong_modes if trace.meta["method"] in ON_TOP else _wrong_outcomes)(trace, rows)]


def _wrong_modes(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Fault]:
    for row, both in predicted(trace, rows):
        away = [off(row[f"{name}_m_s"] - velocities(places, row)) for name, places in zip(CHOICES, both, strict=True)]
        if not max(away) <= VELOCITY_TOLERANCE_M_S and not _is_unstable(trace, row, both):
            name = CHOICES[int(np.argmax(away))]
            yield Fault(f"velocity of mode {name}, m/s", row.robot, row.t_s, max(away))


def _wrong_outcomes(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Fault]:
    for row in rows:
        if row.given["accept_stalls"] >= 0.0:
            yield from _of_outcome(trace, row, foreseen(trace)[row.t_s, row.number])


def _of_outcome(trace: Trace, row: DecisionRecord, both: tuple[Foreseen, Foreseen]) -> Iterator[Fault]:
    """The recorded outcomes of refusing and of accepting, compared with those rolled out again."""
    for choice, found in zip(CHOICES, both, strict=True):
        stalls, cost, left = (float(row.given[f"{choice}_{name}"]) for name in ("stalls", "outcome_m2_s", "left_m"))
        ahead = left**3 / (3.0 * trace.scenario.ugvs[row.robot].preset.speed_m_s)
        due = ahead if found.stalls else found.integral_m2_s + ahead
        if stalls != float(found.stalls):
            yield Fault(f"{choice}: stalls", row.robot, row.t_s, stalls)
        if not abs(cost - due) <= OUTCOME_TOLERANCE * max(1.0, due):
            yield Fault(f"{choice}: outcome, m^2 s", row.robot, row.t_s, {"due": due, "recorded": cost})
        short = max(0.0, found.least_left_m - left, left - found.most_left_m)
        if not short <= max(LEFT_TOLERANCE_M, OUTCOME_TOLERANCE * left):
            yield Fault(f"{choice}: way left, m", row.robot, row.t_s, {"off": short, "recorded": left})


def _is_unstable(trace: Trace, row: DecisionRecord, both: tuple[Array, Array]) -> bool:
    """Whether a push of `NUDGES_M` in every period changes a velocity of a mode by more than its tolerance."""
    for choice, places in enumerate(both):
        loops = stacked([scene_of(trace, row, np.full(row.stages, float(choice)))] * len(NUDGES_M))
        pushed = np.array([loops.here, *roll_out(trace, loops, NUDGES_M)]).swapaxes(0, 1)
        moved = max(off(velocities(one, row) - velocities(places, row)) for one in pushed)
        if moved > VELOCITY_TOLERANCE_M_S or move_apart([*pushed]):
            return True
    return False


def predicted(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[tuple[DecisionRecord, tuple[Array, Array]]]:
    """Each decision with the places that refusing and accepting throughout lead to, (S + 1, 3) each, m."""
    begun = ((row, [scene_of(trace, row, np.full(row.stages, choice)) for choice in (0.0, 1.0)]) for row in rows)
    for batch in in_batches(begun, lambda each: each[1]):
        loops = stacked([one for _, scenes in batch for one in scenes])
        ways = np.array([loops.here, *roll_out(trace, loops)]).swapaxes(0, 1)
        for k, (row, _) in enumerate(batch):
            yield row, (ways[2 * k], ways[2 * k + 1])


def scene_of(trace: Trace, row: DecisionRecord, plan: Array) -> Scene:
    """The closed loop of a decision under a plan (N,) of 0 (refused) and 1 (accepted): others move on as they do."""
    control_s, horizon_s = trace.scenario.control.period_s, trace.scenario.gatekeeper.horizon_s
    each = round(horizon_s / row.stages / control_s)
    after = control_s * np.arange(each * row.stages + 1.0)
    on = proposal_of(trace, row.number)
    there = sensed(trace, on.ugv, row.t_s, after)
    points = np.stack(there.places, axis=1) if there.places else np.empty((len(after), 0, 3))
    parts, pairs = still_parts(trace), pairs_beside(trace, on.ugv)
    beside = [*(pairs[parts.names[k]] for k in parts.owner[there.parts]), *there.robots]
    law = np.array([(pair.law_m, pair.share, pair.speed_m_s) for pair in beside]).reshape(-1, 3).T
    loop = scene(trace, on, row.t_s, after, 0, parts.cores.take(there.parts), points, law)
    return loop._replace(executed=np.repeat(plan == 1.0, each))


def off(by: Array) -> float:
    return float(np.abs(by).max(initial=0.0))


def velocities(places: Array, row: DecisionRecord) -> Array:
    return np.diff(places[:: (len(places) - 1) // row.stages], axis=0) / row.dt
