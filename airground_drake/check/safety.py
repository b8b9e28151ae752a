"""SAFE-TRACE and SAFE-HYP: the distances of a run, and the hypotheses of the invariance proof along it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import SMALL, Array, Disagreement, Found, agrees, close, holds, same
from .run import Run
from .scenario import Pair

MOST_LISTED = 300
"""Pairs that the evidence lists at most: those of least margin."""


@lru_cache(maxsize=4096)
def least_distance_m(run: Run, pair: Pair) -> float:
    """Least distance of a pair over continuous time.

    On a segment the relative position is r + s w, 0 <= s <= 1; |r + s w|^2 is least at s = -r.w / w.w.
    """
    relative = run.position_m[pair.robot] - run.position_m[pair.other]
    r, w = relative[:-1], np.diff(relative, axis=0)
    ww = (w * w).sum(axis=1)
    s = np.clip(-(r * w).sum(axis=1) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(r + s[:, None] * w, axis=1).min())


def safe_trace(run: Run, claim: Json) -> Found:
    """SAFE-TRACE: min over t of ||p_i(t) - q_j(t)|| >= d_ij for every pair."""
    by_names = {(entry["first"], entry["second"]): entry for entry in claim["evidence"]["pairs"]}
    known = {(pair.robot, pair.other) for pair in run.pairs}
    same("pairs", claim["evidence"]["pairs_in_all"], len(known))
    same("pairs", sorted({*by_names} - known), [])
    same("pairs", [len(claim["evidence"]["pairs"]), len(by_names)], [min(len(known), MOST_LISTED)] * 2)
    largest = max(float(entry["margin_m"]) for entry in by_names.values())
    margins, close_by, doubtful = {}, 0, 0
    for pair in run.pairs:
        names, closing = (pair.robot, pair.other), pair.closing_m_s * run.scenario["control"]["period_s"]
        if names not in by_names and run.apart_m[names] - pair.safe_m > max(largest, closing + SMALL):
            continue
        least = least_distance_m(run, pair)
        margins[names] = least - pair.safe_m
        spare = margins[names] - closing
        close_by += spare < -SMALL
        doubtful += abs(spare) <= SMALL
        about = ", ".join(names)
        if names not in by_names:
            farther = margins[names] >= largest - SMALL
            holds("a pair that is not listed is farther apart", farther, margins[names], largest, about=about)
            continue
        _evidence_on_a_pair(run, pair, least, by_names[names])
        if abs(spare) > SMALL:
            same("a period at full speed breaks it", by_names[names]["exercised"], bool(spare < 0.0), about=about)
    margin = min(margins.values())
    worst = claim["where"]["first"], claim["where"]["second"]
    close("pair of least margin", margins[worst], margin, within=SMALL, about=", ".join(worst))
    found = Found.with_margin("holds" if margin >= -SMALL else "refuted", margin)
    return found.counted(close_by, close_by + doubtful)


def _evidence_on_a_pair(run: Run, pair: Pair, least_m: float, recorded: Json) -> None:
    about, when = f"{pair.robot}, {pair.other}", recorded["t_s"]
    there = np.linalg.norm(run.place_m(pair.robot, when) - run.place_m(pair.other, when))
    close("least distance", recorded["min_distance_m"], least_m, within=SMALL, about=about, t_s=when)
    close("margin of a pair", recorded["margin_m"], least_m - pair.safe_m, within=SMALL, about=about, t_s=when)
    close("distance at the recorded time", recorded["min_distance_m"], there, within=SMALL, about=about, t_s=when)
    agrees("safe distance", recorded["safe_distance_m"], pair.safe_m, within=0.0, about=about)


class Hypothesis(NamedTuple):
    """A hypothesis of SAFE-INV at some instants: it holds where its margin is not negative.

    Of an avoidance inequality `kind` says who moves and what it avoids, such as `ugv beside obstacle`.
    """

    name: str
    t_s: Array
    margin: Array
    kind: str = ""


KINDS = ("ugv beside obstacle", "uav beside obstacle", "ugv beside ugv", "ugv beside uav", "uav beside ugv")
DOUBT_M_S = 1e-11
"""An inequality binds where a command has 1e-9 m/s to spare at most; of one this close to that, rounding decides."""


def _binding(found: list[Hypothesis], recorded: Json) -> tuple[int, int]:
    """How many avoidance inequalities bound a command, at least and at most; by kinds as recorded."""
    least, most = dict.fromkeys(KINDS, 0), dict.fromkeys(KINDS, 0)
    for each in found:
        if each.name == "avoidance":
            least[each.kind] += int((each.margin <= SMALL - DOUBT_M_S).sum())
            most[each.kind] += int((each.margin <= SMALL + DOUBT_M_S).sum())
    same("kinds of inequalities", sorted(recorded), sorted(KINDS))
    for kind in KINDS:
        possible = type(recorded[kind]) is int and least[kind] <= recorded[kind] <= most[kind]
        between = f"{least[kind]}" if least[kind] == most[kind] else f"{least[kind]} to {most[kind]}"
        holds("inequalities that bind", possible, recorded[kind], between, about=kind)
    return sum(least.values()), sum(most.values())


def safe_hyp(run: Run, claim: Json) -> Found:
    """SAFE-HYP: at every control sample the hypotheses of the invariance proof held.

    The margin is that of the avoidance inequalities, or of the hypothesis that was broken first.
    """
    found = [*_constants(run), *_velocities(run), *_inequalities(run)]
    in_range = sum(len(each.margin) for each in found if each.name == "avoidance")
    broken = [(each, k) for each in found for k in np.flatnonzero(~(each.margin >= -SMALL))[:1]]
    leading = "avoidance"
    if broken:
        first, k = min(broken, key=lambda one: float(one[0].t_s[one[1]]))
        when = float(first.t_s[k])
        if claim["status"] == "holds":
            raise Disagreement("the hypotheses held", "held", float(first.margin[k]), first.name, when)
        leading = claim["where"]["hypothesis"]
        earliest = sorted({each.name for each, j in broken if each.t_s[j] <= when + SMALL})
        holds("hypothesis broken first", leading in earliest, leading, " or ".join(earliest), t_s=when)
    margins = [float(each.margin.min()) for each in found if each.name == leading and len(each.margin)]
    status = "refuted" if broken else "holds"
    margin = min(margins, default=None)
    least, most = _binding(found, claim["evidence"]["inequalities_that_bind"])
    return Found(status, margin, margin, {"inequalities_in_range": in_range}).counted(least, most)


def _constants(run: Run) -> Iterator[Hypothesis]:
    """A h <= 1; every pair starts at its safe distance; the sensing range covers d + (closing speed) h."""
    control, start = run.scenario["control"], run.t_s[:1]
    h = control["period_s"]
    yield Hypothesis("gain: A h <= 1", start, np.array([1.0 - control["avoidance_gain_1_s"] * h]))
    first = {name: place[0] for name, place in run.position_m.items()}
    offset = np.array([first[pair.robot] - first[pair.other] for pair in run.pairs])
    safe, closing = np.array([(pair.safe_m, pair.closing_m_s) for pair in run.pairs]).T
    each = np.repeat(start, len(safe))
    yield Hypothesis("safe start", each, np.linalg.norm(offset, axis=1) - safe)
    yield Hypothesis("sensing range", each, control["sensing_range_m"] - safe - closing * h)


def _velocities(run: Run) -> Iterator[Hypothesis]:
    """||v|| <= v_max; v_z = 0 for a UGV; v is held from sample to sample. Rows within 1e-9 s are one instant."""
    begins = run.t_s[:-1]
    segment = np.flatnonzero(np.diff(run.t_s) >= SMALL)
    sample = np.searchsorted(run.sample_s, begins[segment] + SMALL, side="right") - 1
    for robot, spec in run.robots.items():
        v = run.command_m_s[robot]
        drift = np.linalg.norm(v[segment + 1] - v[run.chosen_row][sample], axis=1)
        yield Hypothesis("zero-order hold", begins[segment], -drift)
        yield Hypothesis("speed limit", begins, spec["max_speed_m_s"] - np.linalg.norm(v[1:], axis=1))
        if robot != run.uav:
            yield Hypothesis("planar motion", begins, -np.abs(v[1:, 2]))


def _inequalities(run: Run) -> Iterator[Hypothesis]:
    """n.v >= share A (d - D) where D <= d, else n.v >= -share (D - d) / h, for what is within sensing range."""
    sort = {robot: "uav" if robot == run.uav else "ugv" for robot in run.robots}
    for pair in chain.from_iterable(run.near_views.values()):
        kind = f"{sort[pair.robot]} beside {sort.get(pair.other, 'obstacle')}"
        spare = avoidance_spare_m_s(run, pair, run.command_m_s[pair.robot][run.chosen_row])
        seen = np.isfinite(spare)
        yield Hypothesis("avoidance", run.sample_s[seen], spare[seen], kind)


def avoidance_spare_m_s(run: Run, pair: Pair, v_m_s: Array) -> Array:
    """n.v less its bound at every control sample, (S,); infinite beyond the sensing range.

    Args:
        run: the run.
        pair: the robot that moves, and what it avoids.
        v_m_s: velocity of the robot at the samples, (S, 3); a UGV cannot use the z component of n.
    """
    control = run.scenario["control"]
    offset = run.position_m[pair.robot][run.sample_row] - run.position_m[pair.other][run.sample_row]
    distance = np.linalg.norm(offset, axis=1)
    normal = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    if pair.robot != run.uav:
        normal = normal * [1.0, 1.0, 0.0]
    steepness = np.where(distance <= pair.safe_m, control["avoidance_gain_1_s"], 1.0 / control["period_s"])
    bound = pair.share * steepness * (pair.safe_m - distance)
    return np.where(distance <= control["sensing_range_m"], (normal * v_m_s).sum(axis=1) - bound, np.inf)
