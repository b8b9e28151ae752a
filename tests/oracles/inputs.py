"""What a decision rested on, as recorded: parts within range, known, new and told."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.outlines import (
    BASE,
    COUNT,
    EXTENT,
    GAP,
    MIDDLE,
    RADIUS,
    SPEED,
    TOP,
    Cores,
    away_from,
)
from airground_drake.verify.runs.proposals import METHOD, proposal_of
from oracles.fault import Fault
from oracles.sensing import are_same, are_there, beyond_range, first_sensed, place_of, seen_gone, still_parts

MOST_CLAIMED = 64
"""Outlines of a message that a UGV takes into account."""
EDGE_M = 1e-9
"""Within this of the sensing range a part may have been sensed or not, m."""


def wrong_inputs(trace: Trace) -> list[Fault]:
    return [
        Fault(f"recorded as {name}", str(row["robot"]), float(row["t_s"]), {"due": due, "recorded": recorded})
        for row in trace.decisions.to_dict("records")
        for name, due, recorded in _compared(trace, row)
        if due != recorded
    ]


def _compared(trace: Trace, row: dict[Any, Any]) -> Iterator[tuple[str, list[Any], list[Any]]]:
    t, ugv, period_s = float(row["t_s"]), str(row["robot"]), trace.scenario.gatekeeper.period_s
    recorded = {name: [*row[name]] for name in ("sensed", "known", "new", "told")}
    if trace.meta["method"] == METHOD and row["accept_stalls"] < 0.0:
        yield from ((name, [], found) for name, found in recorded.items())
        return
    away, there = beyond_range(trace, ugv, t), are_there(trace, t)
    surely = [k for k in recorded["sensed"] if abs(away[k]) <= EDGE_M]
    yield "sensed", sorted({*np.flatnonzero(there & (away < -EDGE_M)).tolist(), *surely}), recorded["sensed"]
    if trace.meta["method"] != METHOD:
        return
    on, first = proposal_of(trace, int(row["number"])), first_sensed(trace, ugv)
    gone = trace.derived(("seen gone", ugv), lambda: seen_gone(trace, ugv))
    known = np.flatnonzero((first <= t + TIME_TOLERANCE_S) & (gone > t + TIME_TOLERANCE_S))
    yield "known", known.tolist(), recorded["known"]
    cores = still_parts(trace).cores
    shown = are_same(cores, Cores.of(on.mapped)).any(axis=1)
    stood = bool(((trace.decisions["number"] == on.number) & (trace.decisions["t_s"] < t - TIME_TOLERANCE_S)).any())
    new = (first > t - period_s + TIME_TOLERANCE_S) & (first <= t + TIME_TOLERANCE_S) & ~shown
    if stood:  # at the first decision on a proposal what is new makes no difference
        yield "new", np.flatnonzero(new).tolist(), recorded["new"]
    yield "told", _told(trace, ugv, t, on.mapped, cores.take(known)), recorded["told"]


def _told(trace: Trace, ugv: str, t: float, mapped: Array, known: Cores) -> list[int]:
    """Rows of a map that a UGV believes: outlines out of sight that it has not sensed, and the nearest ones only."""
    here, cores = place_of(trace, ugv, t), Cores.of(mapped)
    far = away_from(cores, here, planar=True).distance
    new = (far > trace.scenario.control.sensing_range_m) & ~are_same(cores, known).any(axis=1)
    sound = np.array([_is_outline(*each) for each in zip(mapped, cores.corners, strict=True)], dtype=np.bool_)
    rows = np.flatnonzero(new & sound)
    return sorted(rows[np.argsort(far[rows], kind="stable")[:MOST_CLAIMED]].tolist())


def _is_outline(row: Array, corners: Array) -> bool:
    """Whether numbers describe a convex core, within its circle, with distances that are not negative."""
    there = corners[: int(row[COUNT])]
    edges = np.roll(there, -1, axis=0) - there
    turned = np.roll(edges, 1, axis=0)[:, 0] * edges[:, 1] - np.roll(edges, 1, axis=0)[:, 1] * edges[:, 0]
    held = np.hypot(*(there - row[MIDDLE:EXTENT]).T).max() <= row[EXTENT]
    lengths = row[[GAP, RADIUS, SPEED]].min() >= 0.0 and row[BASE] <= row[TOP]
    return bool(held and lengths and (turned >= 0.0).all())
