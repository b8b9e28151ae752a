"""Judges positions from elsewhere: the distances that were kept, and by how much the samples miss the law.

It needs a table of sampled positions and a scenario, nothing from the simulator of this package.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from .files import Json
from .limits import LARGEST
from .rules import SMALL, Array
from .safety import gain_of, lost_m, shortfall_m
from .scenario import barriers_of, moving_of, pairs_of, places_of, robots_of

COLUMNS = ("t_s", "body", "x_m", "y_m", "z_m")
MOST_ROWS = 10_000_000
NOT_JUDGED = (
    "how bodies moved between samples: motion is taken as straight",
    "where obstacles at rest were: they are taken as where the scenario has them",
    "triggers, proposals, decisions, commands and arrivals",
)


class UnusableError(Exception):
    """The table cannot be judged for this scenario; the message says why, and what was wanted."""


class JudgedPair(NamedTuple):
    """What was found about a pair of bodies; distances are between their surfaces, below 0 they overlap.

    Attributes:
        first: a robot.
        second: an obstacle, or another robot.
        safe_m: distance to be kept.
        least_m: distance that was kept at all times, with straight motion between samples.
        missed_m: e, by how much the samples miss the avoidance inequalities, m per sampling period; None if the law
            says nothing, since samples are not equally spaced.
        guarantee_m: distance that follows from the law with that e; None as above, if it is not above 0, or beside an
            obstacle that may move: there e is by how much the robot itself came too near in a period.
    """

    first: str
    second: str
    safe_m: float
    least_m: float
    missed_m: float | None
    guarantee_m: float | None

    @property
    def kept(self) -> bool:
        """Whether the distance was kept, to 1e-9 m."""
        return self.least_m >= self.safe_m - SMALL


class Coverage(NamedTuple):
    """The times of the samples.

    Attributes:
        first_s: of the first sample, as written.
        lasting_s: from the first to the last.
        duration_s: of the scenario.
    """

    first_s: float
    lasting_s: float
    duration_s: float


def judge(table: pd.DataFrame, scenario: Json) -> tuple[list[JudgedPair], Coverage]:
    """Judge the positions of a table.

    Args:
        table: columns `COLUMNS`; a row is where a body is at a time, s and m, world frame. All robots of the scenario,
            and the origins of all obstacles that move, at the same times.
        scenario: as resolved; says which distances are to be kept, and the gain of the law.

    Returns:
        One entry per pair, the least margin first; and the times that the samples cover.

    Raises:
        UnusableError: if the table lacks something.
    """
    t_s, places = _sampled(table, scenario)
    spacing, control_s = np.diff(t_s), float(scenario["control"]["period_s"])
    period: float | None = None
    if np.ptp(spacing) <= (within := _resolution_s(t_s)):
        period = control_s if abs(spacing[0] - control_s) <= within else float(spacing.mean())
    found = []
    for pair in pairs_of(scenario):
        own, other = places[pair.robot], places[pair.other]
        least_m = pair.shape.least_m(own - other) - pair.radii_m
        missed = guarantee = None
        if period is not None:
            gain = Fraction() if pair.moves_m_s else gain_of(scenario, period)
            e = shortfall_m(own, other, pair.passive(period), gain)
            short = max(0.0, pair.safe_m - pair.shape.least_m(own[:1] - other[:1]))
            promised = pair.gap_m - max(lost_m(e, gain, len(spacing)), short)
            missed, guarantee = float(e), promised if promised > 0.0 and not pair.moves_m_s else None
        found.append(JudgedPair(pair.robot, pair.other, pair.gap_m, least_m, missed, guarantee))
    covered = Coverage(float(t_s[0]), float(t_s[-1] - t_s[0]), float(scenario["duration_s"]))
    return sorted(found, key=lambda one: one.least_m - one.safe_m), covered


def _resolution_s(t_s: Array) -> float:
    """Largest difference of two spacings that rounding explains, s: since 1970 the resolution is 2.4e-7 s."""
    return max(SMALL, 2.0 * float(np.spacing(np.abs(t_s).max())))


def _sampled(table: pd.DataFrame, scenario: Json) -> tuple[Array, Mapping[str, Array]]:
    """Times (K,), and the places of all bodies at them, (K, 3) each."""
    if sorted(table.columns) != sorted(COLUMNS):
        raise UnusableError(f"its columns are {', '.join(map(str, table.columns))}; wanted: {', '.join(COLUMNS)}")
    if len(table) > MOST_ROWS:
        raise UnusableError(f"it has {len(table)} rows; allowed: {MOST_ROWS}")
    bodies = [*robots_of(scenario), *moving_of(scenario)]
    names = table["body"].astype(str)
    if strange := sorted({*names} - {*bodies}):
        raise UnusableError(f"body {strange[0]!r} is not a robot or moving obstacle; wanted: {', '.join(bodies)}")
    found: dict[str, Array] = {}
    times: dict[str, Array] = {}
    for name in bodies:
        rows = table[names == name]
        if len(rows) < 2:
            raise UnusableError(f"{name} has {len(rows)} rows; wanted: 2 at least")
        numbers = _numbers(rows, name)
        times[name], found[name] = numbers[:, 0], numbers[:, 1:]
        if (np.diff(times[name]) <= 0.0).any():
            k = int(np.argmax(np.diff(times[name]) <= 0.0)) + 1
            raise UnusableError(f"{name}: t_s = {times[name][k]:g} does not come after the row before")
    first = bodies[0]
    for name, own in times.items():
        if len(own) != len(times[first]) or not np.allclose(own, times[first], rtol=0.0, atol=_resolution_s(own)):
            raise UnusableError(f"{name} and {first} are not sampled at the same times; wanted: equal t_s")
    for name, body in barriers_of(scenario).items():
        for key in ("appears_s", "disappears_s"):
            if body[key]:
                does = key.removesuffix("_s")
                raise UnusableError(f"{name} {does} under way ({key}); wanted: obstacles that are always there")
    return times[first], places_of(scenario, times[first]) | found


def _numbers(rows: pd.DataFrame, name: str) -> Any:
    values = [
        pd.to_numeric(rows[column], errors="coerce").to_numpy(dtype=np.float64)
        for column in COLUMNS
        if column != "body"
    ]
    numbers = np.column_stack(values)
    if not np.isfinite(numbers).all():
        k = int(np.argmax(~np.isfinite(numbers).all(axis=1)))
        raise UnusableError(f"{name}: row {rows.index[k]} has a value that is not a finite number")
    if not (within := (np.abs(numbers) <= LARGEST).all(axis=1)).all():
        k = int(np.argmin(within))
        raise UnusableError(f"{name}: row {rows.index[k]} has a value beyond {LARGEST:g}; wanted: seconds and metres")
    return numbers
