"""Entries of report.json that several parts of a report read: distances of pairs, in words too, and claims."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

SLACK_M = 1e-9  # a distance counts as kept if it falls short of the required one by less, as verdicts have it

Document = Mapping[str, Any]


class Near(NamedTuple):
    """The smallest distance of a pair: the gap between the surfaces, below 0 if they overlap."""

    # `appeared`: at the instant at which the other one appeared. `moves`: the other one may move, and no theorem keeps
    # its distance. `at_m`: the place of the map that was nearest, m, if the other one is the map.

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float
    appeared: bool = False
    moves: bool = False
    at_m: Sequence[float] | None = None

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Near:
        """That of an entry of report.json with `first` and `second`."""
        value, required = float(entry.get("value", entry.get("min_distance_m"))), float(entry["safe_distance_m"])
        about = (value - required, entry["first"], entry["second"], value, required, entry["t_s"])
        return cls(*about, moves=bool(entry.get("moves")), at_m=entry.get("at_m"))

    @property
    def whom(self) -> str:
        """The other one in words."""
        return named(self.other, self.at_m)

    @property
    def is_short(self) -> bool:
        """Whether the distance was not kept."""
        return self.margin_m < -SLACK_M

    def __str__(self) -> str:
        """The distance, without the pair."""
        return distance(self.value_m, self.required_m)

    @property
    def line(self) -> str:
        """The pair, its distance beside the required one, and when: a line of the first screen."""
        told, sign = metres(self.value_m, self.required_m).removesuffix(" m"), "<" if self.is_short else "≥"
        apart = f"overlap {told[1:]} m" if told.startswith("-") else f"{told} {sign} {self.required_m:g} m"
        return f"{self.robot}\N{EN DASH}{self.whom} {apart} at {f'{self.t_s:.2f} s' if self.t_s > 0.0 else 'the start'}"


def no_way(run: Mapping[str, Any]) -> list[str]:
    """UGVs that the UAV was called for and found no way for in a run, ever or at the end, though no policy failed."""
    failed = {fault["robot"] for fault in run["faults"]}
    lost = [*run["metrics"]["without_proposals"], *run["metrics"]["lost_at_the_end"]]
    return [ugv for ugv in dict.fromkeys(lost) if ugv not in failed]


def pairs(run: Mapping[str, Any]) -> Iterator[Near]:
    """The smallest distances of a run, an entry of report.json; two robots may be there twice."""
    for kind in ("min_distance_m", "min_robot_distance_m"):
        for robot, others in run["metrics"][kind].items():
            for other, found in others.items():
                value, required = found["value"], found["safe_distance_m"]
                flags = bool(found.get("appeared")), bool(found.get("moves"))
                yield Near(value - required, robot, other, value, required, found["t_s"], *flags, found.get("at_m"))


def claims(document: Document, *names: str, run: str | None = None) -> list[Mapping[str, Any]]:
    """The claims with these names, all if none is given; `run`: only those about this run, '' for the model."""
    return [each for each in document["claims"] if each["id"] in (names or [each["id"]]) and run in (None, each["run"])]


def named(body: str, at_m: Sequence[float] | None = None) -> str:
    """The name of a body in words; of the map, which is everywhere, with the place that is meant, m."""
    return f"the map at ({', '.join(f'{each + 0.0:.2f}' for each in at_m)})" if at_m else body


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    told = metres(value_m, required_m)
    return f"{told} (overlap)" if told.startswith("-") else told


def metres(value_m: float, required_m: float, decimals: int = 3) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
