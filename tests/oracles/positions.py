"""Positions between UGVs over links: which messages arrive, what is announced, who stands and who is left out."""

import random
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.pairs import pair_of
from oracles.fault import Fault

SAME_M = 1e-9
"""A position may differ from the one announced by this, m: rounding in a step."""
Flags = npt.NDArray[np.bool_]


def loses(trace: Trace) -> bool:
    links = trace.scenario.ugv_links
    return links is not None and links.loss > 0.0


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
    """Messages that arrive or are lost against the channel's draws, and positions that are not as announced."""
    return [*_heard_otherwise(trace), *_announced_otherwise(trace)]


def _heard_otherwise(trace: Trace) -> Iterator[Fault]:
    links, channel, t = trace.scenario.ugv_links, trace.scenario.channel, trace.sampled("t_s")
    if links is None or channel is None or not links.loss:
        return
    n, last = len(trace.ugvs), np.zeros((len(trace.ugvs),) * 2)
    for k, now in enumerate(t.tolist()):
        lot = random.Random(f"{channel.seed}/ugvs/{k}")
        draws = [[lot.random() for _ in range(n)] for _ in range(n)]
        for i, ugv in enumerate(trace.ugvs):
            for j, other in enumerate(trace.ugvs):
                if i == j:
                    continue
                if k == 0 or draws[i][j] >= links.loss:
                    last[i, j] = now
                recorded = trace.sampled(f"{ugv}.heard_{other}_s")[k]
                if abs(recorded - last[i, j]) > TIME_TOLERANCE_S:
                    yield Fault("heard otherwise", ugv, now, {"of": other, "due": last[i, j], "recorded": recorded})
                    return


def _announced_otherwise(trace: Trace) -> Iterator[Fault]:
    """Without errors a UGV is announced a step of its command from where it was."""
    if not trace.scenario.announces or trace.scenario.sensing:
        return
    t = trace.sampled("t_s")
    for ugv in trace.ugvs:
        place: Array = trace.position(ugv)[trace.sample_rows]
        due = np.concatenate([place[:1], place[:-1] + trace.scenario.control.period_s * trace.chosen(ugv)[:-1]])
        off = np.linalg.norm(trace.as_seen(ugv, ugv) - due, axis=1)
        if (off > SAME_M).any():
            yield Fault("announced otherwise", ugv, float(t[int(np.argmax(off > SAME_M))]), float(off.max()))
