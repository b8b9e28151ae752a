"""Distances of pairs, in words too."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from airground_drake.report.model import Approach, Distance, Run

SLACK_M = 1e-9  # a distance counts as kept if it falls short of the required one by less, as verdicts have it


class Near(NamedTuple):
    """The smallest distance of a pair: the gap between the surfaces, below 0 if they overlap."""

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float
    at_m: Sequence[float] | None = None  # the place of the map that was nearest, if the other one is the map

    @classmethod
    def of(cls, pair: Approach) -> Near:
        return cls.between(pair.first, pair.second, pair)

    @classmethod
    def between(cls, robot: str, other: str, at: Distance) -> Near:
        margin_m = at.value - at.safe_distance_m
        return cls(margin_m, robot, other, at.value, at.safe_distance_m, at.t_s, at.at_m)

    @property
    def whom(self) -> str:
        return named(self.other, self.at_m)

    @property
    def is_short(self) -> bool:
        return self.margin_m < -SLACK_M

    def __str__(self) -> str:
        """The distance, without the pair."""
        return distance(self.value_m, self.required_m)

    @property
    def line(self) -> str:
        """The pair, its distance beside the required one, and when: a line of the first screen."""
        told = metres(self.value_m, self.required_m).removesuffix(" m")
        sign = "<" if self.is_short else "≥"
        apart = f"overlap {told[1:]} m" if told.startswith("-") else f"{told} {sign} {self.required_m:g} m"
        return f"{self.robot}\N{EN DASH}{self.whom} {apart} at {f'{self.t_s:.2f} s' if self.t_s > 0.0 else 'the start'}"


def pairs(run: Run) -> Iterator[Near]:
    for nearest in (run.metrics.min_distance_m, run.metrics.min_robot_distance_m):
        for robot, others in nearest.items():
            yield from (Near.between(robot, other, at) for other, at in others.items())


def named(body: str, at_m: Sequence[float] | None = None) -> str:
    """The name of a body in words; of the map, which is everywhere, with the place that is meant, m."""
    return f"the map at ({', '.join(f'{axis + 0.0:.2f}' for axis in at_m)})" if at_m else body


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    told = metres(value_m, required_m)
    return f"{told} (overlap)" if told.startswith("-") else told


def metres(value_m: float, required_m: float, decimals: int = 3) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
