"""Closed loops of a UGV rolled out again in plain numpy, many side by side."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.outlines import Cores, away_from
from airground_drake.verify.runs.control_law import PLANE, least_speeds
from oracles.control_law import Asked, Inequalities, commanded, retreats, tracking
from oracles.positions import towards_old
from oracles.turning import able, edges
from oracles.turning import rates as rates_of

AT_ONCE = 5_000_000
"""Largest number of coordinates of points that are rolled out side by side, so that they fit into memory."""
FAR_M = 1e9
"""A coordinate beyond every sensing range."""
NUDGES_M = 1e-12 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Two algorithms that round differently move a robot by less than this differently in a control period, m. A prediction
that so small a push in every period changes is unstable: a robot that heads straight for another one, say."""
APART = 5.0
"""Ways under opposite pushes that move apart by such a factor in one control period are unstable, too: this happens
where a robot covers many safe distances in a period."""
T = TypeVar("T")


class Scene(NamedTuple):
    """The inputs of a closed loop of S control periods, among M cores at rest, K robots, and L parts that move.

    The arrays of R stacked scenes have a first axis R.

    Attributes:
        here: (3,), m.
        preset: at the control samples, (S + 1, 3), m.
        wanted: the proposed motion at the control samples, (S + 1, 3), m.
        executed: in which periods the proposal is executed, (S,).
        chosen: J_int^+ J_int, (3, 3).
        limit: speed limit, (), m/s.
        still: cores at rest, (M,).
        points: at the control samples, (S + 1, K, 3), m.
        movers: cores of L parts of obstacles that move, about their origins, (L,).
        origins: at the control samples, (S + 1, L, 3), m.
        safe: distances to keep from all of these, (M + K + L,), m.
        share: of the inequalities, (M + K + L,); below 0 see `towards_old`: minus `unsure`.
        speed: expected of them at most, (M + K + L,), m/s; 0: the passive law does not apply.
        heading: of a unicycle or car, (), rad.
        numbers: of a unicycle or car, (5,), see `turning`.
    """

    here: Array
    preset: Array
    wanted: Array
    executed: npt.NDArray[np.bool_]
    chosen: Array
    limit: Array
    still: Cores
    points: Array
    movers: Cores
    origins: Array
    safe: Array
    share: Array
    speed: Array
    heading: Array
    numbers: Array


def stacked(scenes: Sequence[Scene]) -> Scene:
    """Scenes as one, padded to the longest and to the largest numbers of cores and points.

    A padded motion stays at its end; padded cores and points are far away.
    """
    steps = max(len(one.executed) for one in scenes)
    cores, points = max(len(one.still.base) for one in scenes), max(one.points.shape[1] for one in scenes)
    movers = max(len(one.movers.base) for one in scenes)
    far = Cores.at(np.full((max(cores, movers), 3), FAR_M))
    wide, wider = (
        Cores(np.zeros((0, max(part.corners.shape[1] for part in parts), 2)), np.empty(0), np.empty(0))
        for parts in ([one.still for one in scenes], [one.movers for one in scenes])
    )

    def padded(one: Scene) -> Scene:
        m, k, n = len(one.still.base), one.points.shape[1], len(one.movers.base)
        later, more = (0, steps - len(one.executed)), (0, points - k)
        safe, share, speed = (
            np.concatenate([
                part[:m], np.zeros(cores - m), part[m : m + k], np.zeros(points - k), part[m + k :],
                np.zeros(movers - n),
            ])
            for part in (one.safe, one.share, one.speed)
        )  # fmt: skip
        return one._replace(
            preset=np.pad(one.preset, (later, (0, 0)), mode="edge"),
            wanted=np.pad(one.wanted, (later, (0, 0)), mode="edge"),
            executed=np.pad(one.executed, later),
            still=Cores.joined([one.still, far.take(slice(cores - m)), wide]),
            points=np.pad(one.points, (later, more, (0, 0)), constant_values=FAR_M),
            movers=Cores.joined([one.movers, far.take(slice(movers - n)), wider]),
            origins=np.pad(one.origins, (later, (0, movers - n), (0, 0)), mode="constant"),
            safe=safe,
            share=share,
            speed=speed,
        )

    every = [padded(one) for one in scenes]
    still, carried = (
        Cores(*(np.stack([getattr(getattr(one, name), part) for one in every]) for part in ("corners", "base", "top")))
        for name in ("still", "movers")
    )
    parts = {name: np.stack([getattr(one, name) for one in every]) for name in Scene._fields
             if name not in ("still", "movers")}  # fmt: skip
    return Scene(**(parts | {"still": still, "movers": carried}))


def roll_out(trace: Trace, scenes: Scene, nudge: Array | float = 0.0) -> Iterator[Array]:
    """Places of R stacked closed loops after each control period, (R, 3), m, by the law of the run.

    In every period each is pushed by `nudge`, (R, 3), m.
    """
    control, h, place = trace.scenario.control, trace.scenario.control.period_s, scenes.here
    heading = scenes.heading
    rates, wishes = (np.diff(part, axis=1) / h for part in (scenes.preset, scenes.wanted))
    for k in range(scenes.executed.shape[1]):
        offset = place[:, None] - scenes.points[:, k]
        apart, (distance, normal) = (
            np.sqrt(np.square(offset).sum(axis=2)),
            away_from(scenes.still, place[:, None], planar=True),
        )
        moving = away_from(scenes.movers, place[:, None] - scenes.origins[:, k], planar=True)
        robots = offset / np.where(apart > 0.0, apart, 1.0)[..., None]
        normal = np.concatenate([normal, robots, moving.normal], axis=1)
        distance = np.concatenate([distance, apart, moving.distance], axis=1)
        bound = least_speeds(distance, scenes.safe, scenes.share, control, scenes.speed)
        retreat = retreats(distance, scenes.safe, scenes.speed, h)
        given = Inequalities(normal * PLANE, bound, retreat if retreat.any() else None)
        unsure = np.where(scenes.speed > 0.0, trace.scenario.position_error_m, -np.minimum(scenes.share, 0.0))
        if (old := unsure > 0.0).any():
            safe = scenes.safe + np.where(scenes.speed > 0.0, scenes.speed * h - unsure, 0.0)
            given = given._replace(
                bound=np.where(old, -np.inf, bound), retreat=None if given.retreat is None else retreat * ~old
            )
            both_sides = np.concatenate([retreat * old, retreat * old], axis=1)
            given = given.also(*towards_old(normal, distance, safe, unsure, h), both_sides)
        given = given.also(*edges(heading, scenes.numbers))
        own = tracking(place, scenes.preset[:, k], rates[:, k], control.motion_gain_1_s, scenes.limit)
        rows = np.flatnonzero(scenes.executed[:, k])
        asked = Asked(scenes.wanted[rows, k], wishes[rows, k], scenes.chosen[rows])
        velocity = commanded(trace, place, own, given, rows, asked, scenes.limit)
        if scenes.numbers[..., 0].any():
            velocity = able(velocity, heading, scenes.numbers, h)
            heading = heading + h * rates_of(velocity, heading, scenes.numbers, h)[1]
        place = place + h * velocity + nudge
        yield place


def move_apart(ways: Sequence[Array]) -> bool:
    """Whether ways (S + 1, 3), m, under `NUDGES_M` move apart from those under the opposite push."""
    half = len(NUDGES_M) // 2
    for one, opposite in zip(ways[:half], ways[half:], strict=True):
        last = min(len(one), len(opposite))
        apart = np.linalg.norm(one[1:last] - opposite[1:last], axis=1)
        if (apart[1:] > APART * np.maximum(apart[:-1], 2.0 * np.abs(NUDGES_M).max())).any():
            return True
    return False


def in_batches(items: Iterable[T], scenes_of: Callable[[T], Sequence[Scene]]) -> Iterator[list[T]]:
    batch, count, largest = list[T](), 0, 0
    for item in items:
        scenes = scenes_of(item)
        batch.append(item)
        count, largest = (
            count + len(scenes),
            max(largest, *(one.points.size + 100 * len(one.still.base) for one in scenes)),
        )
        if count * largest > AT_ONCE:
            yield batch
            batch, count, largest = [], 0, 0
    if batch:
        yield batch
