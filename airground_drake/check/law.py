"""The control law (5)-(11), (14), (20) as the claims state it, for B samples at once."""

from __future__ import annotations

import hashlib
from itertools import combinations, islice
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import Array, Flags

PLANE = np.array([1.0, 1.0, 0.0])
"""Directions in which a UGV can move."""
MARGIN_M_S = 1e-12
"""The closest velocity keeps its inequalities by this much: the corner of two nearly parallel ones depends on it."""
MET_M_S = 5e-13
"""A velocity that misses an inequality by less, and by what rounding makes of its speed, meets it."""
ROUNDING = 1e-15
"""Relative."""
CONTRADICTION_M_S = 1e-9
"""Inequalities that every velocity misses by more contradict each other."""
ABOVE_LEAST, ABOVE_LEAST_M_S = 1e-9, 1e-11
"""What is missed by this much more than the least, relatively and in m/s, is missed as little."""
SHORTEST = 1e-9
"""A shorter normal, of what is nearly above a robot that stays in the plane, asks for nothing that it could do."""
NEAR_M_S = 1e-12
"""The least that has to be missed is known to this, relatively where it is more than 1 m/s."""
DEPENDENT = 1e-10
"""Sine of the angle between a normal and those before it up to which fewer of them say the same."""

NUMBERS = 300_000
"""Inequalities of candidates that are looked at together, so that they fit into the memory."""

MOST_KNOWN = 100_000
"""Velocities that are remembered at most."""


class Inequalities(NamedTuple):
    """normal_k.v >= bound_k: normals (B, K, 3), bounds (B, K), -inf where nothing is asked."""

    normal: Array
    bound: Array

    def rows(self, chosen: Flags) -> Inequalities:
        """Those of some samples."""
        return Inequalities(self.normal[chosen], self.bound[chosen])


def inequalities(offset_m: Array, safe_m: Array, share: Array, control: Json, plane: Array) -> Inequalities:
    """n.v >= share A (d - D) where D <= d, else n.v >= -share (D - d) / h, for what is within sensing range.

    Args:
        offset_m: from each point to the robot, (B, K, 3).
        safe_m: distances d, (K,) or (B, K).
        share: part that the robot takes, (K,) or (B, K).
        control: of the scenario.
        plane: 1 in directions in which the robot can move, else 0, (3,).
    """
    distance = np.linalg.norm(offset_m, axis=2)
    normal = plane * offset_m / np.where(distance > 0.0, distance, 1.0)[..., None]
    steepness = np.where(distance <= safe_m, control["avoidance_gain_1_s"], 1.0 / control["period_s"])
    bound = share * steepness * (safe_m - distance)
    return Inequalities(normal, np.where(distance <= control["sensing_range_m"], bound, -np.inf))


def limited(v_m_s: Array, limit_m_s: Array | float) -> Array:
    """Velocities (B, 3) shortened to a speed limit."""
    speed = np.linalg.norm(v_m_s, axis=1)
    return np.asarray(v_m_s * (limit_m_s / np.maximum(speed, limit_m_s))[:, None])


def avoiding(wanted_m_s: Array, given: Inequalities, composition: str) -> Array:
    """Velocities (B, 3) under the inequalities: closest to what is wanted, or (5) as printed."""
    found = wanted_m_s.copy()
    missed: Flags = np.asarray((_spare(wanted_m_s, given) < 0.0).any(axis=1))
    if missed.any():
        change = _closest if composition == "augmented" else _recursion
        found[missed] = change(wanted_m_s[missed], given.rows(missed), composition)
    return found


def _spare(v_m_s: Array, given: Inequalities) -> Array:
    return np.asarray((given.normal * v_m_s[:, None]).sum(axis=2) - given.bound)


def least_spare(v_m_s: Array, given: Inequalities) -> Array:
    """What velocities (B, 3) have to spare of the inequality that leaves the least, (B,); infinite without any."""
    return np.asarray(_spare(v_m_s, given).min(axis=1, initial=np.inf))


def _recursion(wanted_m_s: Array, given: Inequalities, composition: str) -> Array:
    """(5): from the lowest priority up, each task corrects what those below it want; all samples side by side.

    The priority is the order in which points are listed, or with `recursion_nearest` that of their demands.
    """
    v = wanted_m_s.copy()
    rank = -given.bound if composition == "recursion_nearest" else np.zeros_like(given.bound)
    order = np.argsort(rank, axis=1, kind="stable")[:, ::-1]
    each = np.arange(len(v))
    for k in order.T:
        n, bound = given.normal[each, k], given.bound[each, k]
        squared = (n * n).sum(axis=1)
        lacking = np.maximum(0.0, bound - (n * v).sum(axis=1))
        v += n * np.where(squared > 0.0, lacking / np.where(squared > 0.0, squared, 1.0), 0.0)[:, None]
    return v


_known: dict[bytes, Array] = {}
"""Closest velocities by the SHA-256 of all that they follow from: roll-outs of a run have much in common."""


def _closest(wanted_m_s: Array, given: Inequalities, _: str) -> Array:
    """The closest velocities, each worked out once."""
    parts = zip(wanted_m_s, given.normal, given.bound, strict=True)
    keys = [hashlib.sha256(b"".join(part.tobytes() for part in row)).digest() for row in parts]
    if len(_known) > MOST_KNOWN:
        _known.clear()
    new = np.array([key not in _known for key in keys])
    if new.any():
        found = _worked_out(wanted_m_s[new], given.rows(new))
        _known.update(zip((key for key, is_new in zip(keys, new, strict=True) if is_new), found, strict=True))
    return np.array([_known[key] for key in keys])


def _worked_out(wanted_m_s: Array, given: Inequalities) -> Array:
    """The closest velocities; where inequalities contradict each other, the slowest that miss them least.

    They are shortened until the inequalities hold that standing still meets but for rounding.
    """
    kept = Inequalities(given.normal, given.bound + MARGIN_M_S)
    found, lacking = _by_active_sets(wanted_m_s, kept)
    torn = lacking > CONTRADICTION_M_S
    if torn.any():
        found[torn] = _least_missing(kept.rows(torn))
    rate = (given.normal * found[:, None]).sum(axis=2)
    least = np.minimum(given.bound, 0.0)
    late = (rate < least) & (given.bound <= CONTRADICTION_M_S)
    factor = np.where(late, least / np.where(late, rate, 1.0), 1.0).min(axis=1)
    return np.asarray(found * factor[:, None])


def _least_missing(given: Inequalities) -> Array:
    """The slowest velocities that miss no more than the least that has to be missed.

    That is guessed, tried a little below and above, and found by bisection where the guess was wrong.
    """
    most = np.maximum(0.0, given.bound.max(axis=1))  # what standing still misses
    guess = np.clip(_equally_missing(given), 0.0, most)
    near = NEAR_M_S * np.maximum(1.0, guess)
    low, high = np.maximum(0.0, guess - near), guess + near / 10.0
    low = np.where(_lacking(given, low) > 0.0, low, 0.0)
    high = np.where(_lacking(given, high) == 0.0, high, most)
    for _ in range(60):
        on: Flags = high - low > 2.0 * near
        if not on.any():
            break
        middle = (low[on] + high[on]) / 2.0
        met = _lacking(given.rows(on), middle) == 0.0
        low[on], high[on] = np.where(met, low[on], middle), np.where(met, middle, high[on])
    least = Inequalities(given.normal, given.bound - (1.0 + ABOVE_LEAST) * high[:, None] - ABOVE_LEAST_M_S)
    return _by_active_sets(np.zeros((len(high), 3)), least, every=True)[0]


def _equally_missing(given: Inequalities) -> Array:
    """The least of what velocities miss that miss two or more inequalities by the same, (B,): but for rounding, all."""
    normal, bound = _relevant(np.zeros((len(given.bound), 3)), given, every=True)
    asked, found = np.where(np.isfinite(bound), bound, 0.0), np.full(len(bound), np.inf)
    at_once = max(1, NUMBERS // bound.size)
    for size in range(2, 5 if normal[:, :, 2].any() else 4):
        sets = combinations(range(bound.shape[1]), size)
        while some := [*islice(sets, at_once)]:
            n, b = normal[:, np.array(some)], asked[:, np.array(some)]
            apart, due = n[:, :, 1:] - n[:, :, :1], b[:, :, 1:] - b[:, :, :1]
            v = np.einsum("bcij,bcj->bci", np.linalg.pinv(apart), due)
            missed = (bound[:, None] - np.einsum("bkd,bcd->bck", normal, v)).max(axis=2)
            found = np.minimum(found, missed.min(axis=1))
    return found


def _lacking(given: Inequalities, may_m_s: Array) -> Array:
    """What every velocity lacks if each inequality may be missed by so much, (B,)."""
    less = Inequalities(given.normal, given.bound - may_m_s[:, None])
    return _by_active_sets(np.zeros((len(may_m_s), 3)), less, every=True)[1]


def _by_active_sets(wanted_m_s: Array, given: Inequalities, *, every: bool = False) -> tuple[Array, Array]:
    """The closest velocity (B, 3) that meets all inequalities, and what it lacks (B,): one of the candidates is it.

    A candidate is the velocity closest to what is wanted with some inequalities met exactly. At most as many are
    needed as there are directions. Where no candidate meets all, the one that misses least is returned. Inequalities
    that cannot matter are left out, unless `every` one is asked for.
    """
    normal, bound = _relevant(wanted_m_s, given, every=every)
    rounding = 0.0 if every else ROUNDING  # it makes fast velocities look better than slow ones
    best, lacking = wanted_m_s.copy(), np.maximum(0.0, -_spare(wanted_m_s, given)).max(axis=1)
    lacking = np.where(lacking <= MET_M_S, 0.0, lacking)
    length = np.where(lacking == 0.0, 0.0, np.inf)
    at_once = max(1, NUMBERS // bound.size)
    for size in range(1, 4 if normal[:, :, 2].any() else 3):
        sets = combinations(range(bound.shape[1]), size)
        while active := [*islice(sets, at_once)]:
            step, lacks = _candidates(wanted_m_s, Inequalities(normal, bound), np.array(active), rounding)
            size_of, met = np.linalg.norm(step, axis=2), lacks == 0.0
            first = np.argmin(np.where(met, size_of, np.inf), axis=1)
            pick = np.arange(len(best)), np.where(met.any(axis=1), first, np.argmin(lacks, axis=1))
            lacks, size_of, met = lacks[pick], size_of[pick], met[pick]
            before = lacking == 0.0
            better = np.where(met & before, size_of < length, met | (~before & (lacks < lacking)))
            best[better] = (wanted_m_s + step[pick])[better]
            lacking[better], length[better] = lacks[better], size_of[better]
    return best, lacking


def _candidates(wanted_m_s: Array, given: Inequalities, active: Array, rounding: float) -> tuple[Array, Array]:
    """How far from what is wanted the velocities are that meet the active inequalities (C, size) exactly.

    Each solves three equations: those of the active inequalities and, in the directions that are orthogonal to their
    normals, those of what is wanted. What the first solution leaves is solved again: rounding grows with the inverse of
    the angle between normals.

    Returns:
        Their differences from it (B, C, 3), and what they lack (B, C): infinitely much where the active ones depend on
        each other or ask for nothing.
    """
    n, b = given.normal[:, active], given.bound[:, active]
    length = np.linalg.norm(n, axis=3)
    asked = np.isfinite(b) & (length > SHORTEST)
    unit = n / np.where(asked, length, 1.0)[..., None]
    rest, sine = _completed(unit)
    usable = asked.all(axis=2) & (sine > DEPENDENT)
    equations = np.where(usable[..., None, None], np.concatenate([unit, rest], axis=2), np.eye(3))
    free = np.einsum("bckd,bd->bck", rest, wanted_m_s)
    due = np.concatenate([np.where(asked, b / np.where(asked, length, 1.0), 0.0), free], axis=2)
    inverse = np.linalg.inv(equations)
    v = np.einsum("bcij,bcj->bci", inverse, due)
    v += np.einsum("bcij,bcj->bci", inverse, due - np.einsum("bcij,bcj->bci", equations, v))
    rate = np.einsum("bkd,bcd->bck", given.normal, v)
    lacks = np.maximum(0.0, given.bound[:, None] - rate).max(axis=2)
    lacks = np.where(lacks <= MET_M_S + rounding * np.linalg.norm(v, axis=2), 0.0, lacks)
    return v - wanted_m_s[:, None], np.where(usable, lacks, np.inf)


def _completed(unit: Array) -> tuple[Array, Array]:
    """What unit vectors (B, C, size, 3) lack to a basis, (B, C, 3 - size, 3), and the least sine among them, (B, C)."""
    size, first = unit.shape[2], unit[:, :, 0]
    other = unit[:, :, 1] if size > 1 else np.eye(3)[np.argmin(np.abs(first), axis=2)]
    across = _cross(first, other)
    sine = np.linalg.norm(across, axis=2)
    across /= np.where(sine > 0.0, sine, 1.0)[..., None]
    if size == 3:
        return unit[:, :, :0], np.minimum(sine, np.abs((across * unit[:, :, 2]).sum(axis=2)))
    rest = [across] if size == 2 else [across, _cross(first, across)]
    return np.stack(rest, axis=2), sine


def _cross(a: Array, b: Array) -> Array:
    """Of vectors along the last axis; numpy's own takes three times as long."""
    return np.asarray(a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]])


def _relevant(wanted_m_s: Array, given: Inequalities, *, every: bool) -> Inequalities:
    """The inequalities that can be active, as few columns as there are at most in a sample, most demanding first.

    Where standing still meets all but for rounding, the closest velocity is no faster than what is wanted, and what
    lets that speed pass in every direction is never active; unless `every` one is asked for.
    """
    reach = np.linalg.norm(wanted_m_s, axis=1) + 1e-6
    demands = every | (given.bound.max(axis=1, initial=-np.inf) > CONTRADICTION_M_S)[:, None]
    can = np.isfinite(given.bound) & (demands | (given.bound > -reach[:, None]))
    bound = np.where(can, given.bound, -np.inf)
    order = np.argsort(-bound, axis=1, kind="stable")[:, : max(1, int(can.sum(axis=1).max(initial=0)))]
    return Inequalities(
        np.take_along_axis(given.normal, order[..., None], axis=1), np.take_along_axis(bound, order, axis=1)
    )
