"""What a UGV senses in a run: bodies within range at a time, and obstacles that it had not sensed before."""

from __future__ import annotations

from itertools import compress
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.instants import row_at
from airground_drake.verify.runs.pairs import Pair, appears_of, around, centres_of, places_of

SAME_M = 1e-9
"""Obstacles closer to each other than this are one, m."""


class Sensed(NamedTuple):
    """What a UGV senses when it decides: the other of a pair, and its places (S, 3), m, if it moves on as it does."""

    name: str
    pair: Pair
    places: Array


def sensed(trace: Trace, robot: str, t: float, after: Array) -> list[Sensed]:
    """Obstacles and other robots within sensing range of a robot at a time, with their places at times `after` that."""
    here, found = interpolate(trace.t, trace.position(robot), t), []
    for other, pair in around(trace, robot):
        place, velocity = moves(trace, other, t)
        if (
            t >= trace.t[pair.row] - TIME_TOLERANCE_S
            and np.linalg.norm(place - here) <= trace.scenario.control.sensing_range_m
        ):
            found.append(Sensed(other, pair, place + after[:, None] * velocity))
    return found


def moves(trace: Trace, name: str, t: float) -> tuple[Array, Array]:
    """Where an obstacle or a robot is at a time, (3,), m, and its velocity up to then, (3,), m/s."""
    place = places_of(trace)[name]
    if place.ndim == 1:
        return place, np.zeros(3)
    return interpolate(trace.t, place, t), trace.command(name)[row_at(trace, t)]


def news(trace: Trace, ugv: str, mapped_m: Array, begin_s: float, end_s: float) -> list[str]:
    """Obstacles that a UGV senses for the first time within (begin_s, end_s], and that are not on a proposal's map.

    Args:
        trace: the run.
        ugv: the UGV.
        mapped_m: obstacles on the map, (k, 3), m.
        begin_s: s.
        end_s: s.
    """
    first = trace.derived(("first sensed", ugv), lambda: first_sensed(trace, ugv))
    new = (first > begin_s + TIME_TOLERANCE_S) & (first <= end_s + TIME_TOLERANCE_S)
    shown = (np.linalg.norm(centres_of(trace)[:, None] - mapped_m, axis=2) <= SAME_M).any(axis=1)
    return list(compress(trace.scenario.obstacles, new & ~shown))


def first_sensed(trace: Trace, ugv: str) -> Array:
    """When a UGV senses each obstacle for the first time, at the gatekeeper's samples, (m,), s; inf if never."""
    period_s = trace.scenario.gatekeeper.period_s
    samples = period_s * np.arange(np.floor(trace.t[-1] / period_s + 1e-9) + 1.0)
    was = interpolate(trace.t, trace.position(ugv), np.minimum(samples, trace.t[-1]))
    away = np.linalg.norm(was[:, None] - centres_of(trace), axis=2)
    there = samples[:, None] >= appears_of(trace) - TIME_TOLERANCE_S
    seen = there & (away <= trace.scenario.control.sensing_range_m)
    return np.where(seen.any(axis=0), samples[seen.argmax(axis=0)], np.inf)
