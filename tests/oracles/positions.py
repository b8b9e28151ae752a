"""Positions between UGVs over links: what is announced, who stands and who is left out."""

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.scenario.rounding import SPARE_S
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.pairs import pair_of
from oracles.fault import Fault

SAME_M = 1e-9
"""A position may differ from the one announced by this, m: rounding in a step."""
Flags = npt.NDArray[np.bool_]


def loses(trace: Trace) -> bool:
    links = trace.scenario.ugv_links
    return links is not None and links.loss > 0.0 and not acts_on_old(trace)


def acts_on_old(trace: Trace) -> bool:
    """Whether UGVs act on the last positions of each other that arrived, by the asynchronous law."""
    return trace.scenario.control.law == "asynchronous"


def towards_old(normal: Array, distance: Array, safe: Array, unsure: Array, period_s: float) -> tuple[Array, Array]:
    """The asynchronous law: normals (B, 2 K, 3) and bounds (B, 2 K), m/s, towards K places of others that were once.

    Each was `distance` away, (B, K), m; the other one is within `unsure`, (B, K), m, of it until it decides again, 0
    where the law is another one.
    """
    excess = distance - safe - unsure
    angle = np.where(excess < 0.0, np.arccos(np.minimum(unsure / np.maximum(distance, 1e-300), 1.0)), 0.5 * np.pi)
    bound = np.where(excess < 0.0, 0.0, -excess / period_s)
    across = np.stack([-normal[..., 1], normal[..., 0], np.zeros_like(distance)], axis=-1)
    sides = [np.sin(angle)[..., None] * normal + side * np.cos(angle)[..., None] * across for side in (1.0, -1.0)]
    stuck = (excess < 0.0) & (distance <= unsure)
    for side, turned in zip((1.0, -1.0), sides, strict=True):
        turned[stuck] = [side, 0.0, 0.0]
    bound = np.where(unsure > 0.0, np.where(stuck, 1.0, bound), -np.inf)
    return np.concatenate(sides, axis=1), np.concatenate([bound, bound], axis=1)


def old_positions(trace: Trace, ugv: str) -> tuple[Array, Array]:
    """`towards_old` of what a UGV had heard at the control samples, (S, 2 K, 3) and (S, 2 K)."""
    others = [other for other in trace.ugvs if other != ugv] if acts_on_old(trace) and ugv in trace.ugvs else []
    here, t, h = trace.position(ugv)[trace.sample_rows], trace.sampled("t_s"), trace.scenario.control.period_s
    away, unsure, safe = np.zeros((len(t), len(others), 3)), *np.zeros((2, len(t), len(others)))
    for k, other in enumerate(others):
        since = t - trace.sampled(f"{ugv}.heard_{other}_s")
        sent = np.arange(len(t)) - np.rint(since / h).astype(np.intp)
        away[:, k] = here - trace.position(other)[trace.sample_rows][sent]
        unsure[:, k] = trace.scenario.ugvs[other].max_speed_m_s * (since + h + SPARE_S)
        safe[:, k] = pair_of(trace, ugv, other).law_m
    apart = np.linalg.norm(away, axis=2)
    return towards_old(away / np.where(apart > 0.0, apart, 1.0)[..., None], apart, safe, unsure, h)


def unheard(trace: Trace, ugv: str) -> Flags:
    t, lacks = trace.sampled("t_s"), np.zeros((len(trace.sample_rows), len(trace.robots)), dtype=np.bool_)
    for k, other in enumerate(trace.ugvs if loses(trace) and ugv in trace.ugvs else ()):
        if other != ugv:
            lacks[:, k] = trace.sampled(f"{ugv}.heard_{other}_s") < t - TIME_TOLERANCE_S
    return lacks


def stands(trace: Trace, ugv: str) -> Flags:
    """Control samples at which a UGV has to stand, (S,): one whose message it lacks may be within the law's reach."""
    t, lacks = trace.sampled("t_s"), unheard(trace, ugv)
    due = np.zeros(len(t), dtype=np.bool_)
    for k in np.flatnonzero(lacks.any(axis=0)).tolist():
        other = trace.robots[k]
        since = t - trace.sampled(f"{ugv}.heard_{other}_s")
        before = np.rint(since / trace.scenario.control.period_s).astype(np.intp)
        last = trace.as_seen(ugv, other)[np.arange(len(t)) - before]
        apart = np.linalg.norm(trace.as_seen(ugv, ugv) - last, axis=1)
        due |= lacks[:, k] & (apart - trace.scenario.ugvs[other].max_speed_m_s * since <= _reach(trace, ugv, other))
    return due


def _reach(trace: Trace, ugv: str, other: str) -> float:
    step = sum(trace.scenario.ugvs[name].max_speed_m_s for name in (ugv, other)) * trace.scenario.control.period_s
    return pair_of(trace, ugv, other).law_m + 2.0 * trace.scenario.position_error_m + step


def wrong_positions(trace: Trace) -> list[Fault]:
    """Without errors a UGV is announced a step of its command from where it was."""
    if not trace.scenario.announces or trace.scenario.sensing:
        return []
    faults = list[Fault]()
    t = trace.sampled("t_s")
    for ugv in trace.ugvs:
        place: Array = trace.position(ugv)[trace.sample_rows]
        due = np.concatenate([place[:1], place[:-1] + trace.scenario.control.period_s * trace.chosen(ugv)[:-1]])
        off = np.linalg.norm(trace.as_seen(ugv, ugv) - due, axis=1)
        if (off > SAME_M).any():
            faults.append(Fault("announced otherwise", ugv, float(t[int(np.argmax(off > SAME_M))]), float(off.max())))
    return faults
