"""Random maps and teams: robots on both sides of a field of obstacles, walls and boxes, each with its target across."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import ConfigDict, PlainValidator, WithJsonSchema

from airground_drake.base.arrays import Array
from airground_drake.base.limits import MAX_UGVS
from airground_drake.base.values import Chance, Positive, refused
from airground_drake.model.geometry import convex, outline
from airground_drake.scenario.schema import Obstacle
from airground_drake.scenario.shapes import convex_parts

TRIES = 10_000  # attempts to place an obstacle before a field counts as full
MOST_OBSTACLES = 10_000
BEYOND_M = 0.3  # margin of starts and targets beyond the safe distance, m
LEAST_M, MOST_M = 1e-3, 1e3  # smallest and largest size of walls and boxes, m

REPLACES = ("ugvs", "obstacles", "uav.start_m", "uav.target_m")  # keys of a scenario, dotted, that a course draws


def _range(least: int, most: int) -> Callable[[object], tuple[int, int]]:
    """Make the reader of a whole number or a range [least, most], within bounds."""

    def read(value: object) -> tuple[int, int]:
        low, high = value if isinstance(value, list) and len(value) == 2 else (value, value)
        if type(low) is not int or type(high) is not int or not least <= low <= high <= most:
            raise refused(value, f"wanted: a whole number from {least} to {most}, or [least, most]")
        return low, high

    return read


def _sizes(value: object) -> tuple[float, float]:
    """Read a range [least, most] of sizes, m."""
    given = value if isinstance(value, list | tuple) else ()
    if len(given) != 2 or any(type(size) not in (int, float) for size in given):
        raise refused(value, "wanted: [least, most] in m")
    low, high = map(float, given)
    if not LEAST_M <= low <= high <= MOST_M:
        raise refused(value, f"wanted: [least, most] in m, from {LEAST_M:g} to {MOST_M:g}")
    return low, high


Ugvs = Annotated[tuple[int, int], PlainValidator(_range(1, MAX_UGVS)), WithJsonSchema({})]
Obstacles = Annotated[tuple[int, int], PlainValidator(_range(0, MOST_OBSTACLES)), WithJsonSchema({})]
Sizes = Annotated[tuple[float, float], PlainValidator(_sizes), WithJsonSchema({})]


@dataclass(frozen=True)
class Course:
    """Ranges and sizes that a random course is drawn from."""

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")

    # Least and largest numbers: of UGVs, of obstacles that are points, thin walls, or boxes.
    ugvs: Ugvs = (1, 4)
    obstacles: Obstacles = (4, 9)
    walls: Obstacles = (0, 0)
    boxes: Obstacles = (0, 0)
    size_m: Sizes = (0.5, 4.0)  # least and largest length of a wall, and of a side of a box
    length_m: Positive = 20.0  # distance between the two sides
    width_m: Positive = 16.0  # of the field
    preset_m_s: Positive = 1.0  # speed of the preset trajectories
    max_speed_m_s: Positive = 3.0  # of a UGV
    hidden: Chance = 0.0  # share of the obstacles that are not on the UAV's map

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"ugv{i + 1}" for i in range(self.ugvs[1]))

    def values(self, rng: np.random.Generator, obstacle_m: float, ugv_m: float, altitude_m: float) -> dict[str, Any]:
        """Draw UGVs, obstacles, and the UAV's start and target, by dotted key (REPLACES); ValueError without room."""
        # obstacle_m, ugv_m: safe distances; the UAV starts and ends over the centroid of the UGVs.
        n, m = (int(rng.integers(low, high, endpoint=True)) for low, high in (self.ugvs, self.obstacles))
        eastward = rng.permutation(np.arange(n) % 2 == 0)
        side = np.where(eastward, 0.0, self.length_m)
        starts = self._apart(rng, side, ugv_m + BEYOND_M)
        targets = self._apart(rng, self.length_m - side, ugv_m + BEYOND_M)
        over = {"uav.start_m": starts.mean(axis=0), "uav.target_m": targets.mean(axis=0)}
        below_m = float(np.sqrt(max(0.0, obstacle_m**2 - altitude_m**2)))  # the UAV's horizontal distance to obstacles
        ends = np.concatenate([starts, targets, [*over.values()]])
        least = np.array([obstacle_m + BEYOND_M] * 2 * n + [below_m] * 2)
        places = self._field(rng, m, ends, least)
        hidden = rng.random(m) < self.hidden
        ugvs = {
            name: {
                "start_m": _ground(start), "target_m": _ground(target), "max_speed_m_s": self.max_speed_m_s,
                "preset": {"waypoints_m": [_ground(start), _ground(target)], "speed_m_s": self.preset_m_s},
            }
            for name, start, target in zip(self.names, starts, targets, strict=False)
        }  # fmt: skip
        obstacles = {
            f"obstacle{k + 1}": {"position_m": _ground(place), "known_to_uav": not hidden[k]}
            for k, place in enumerate(places)
        }
        for kind, (low, high) in {"wall": self.walls, "box": self.boxes}.items():
            obstacles |= self._shapes(rng, kind, int(rng.integers(low, high, endpoint=True)), ends, least)
        above = {key: [*np.round(place, 6).tolist(), altitude_m] for key, place in over.items()}
        return {"ugvs": ugvs, "obstacles": obstacles, **above}

    def _apart(self, rng: np.random.Generator, side: Array, least: float) -> Array:
        """Draw positions (n, 2), m, at these x; any two are at least `least`, m, apart."""
        places: list[Array] = []
        for x in side:
            for _ in range(TRIES):
                place = np.array([x, rng.uniform(-0.5, 0.5) * self.width_m])
                if all(np.linalg.norm(place - taken) >= least for taken in places):
                    places.append(place)
                    break
            else:
                raise ValueError(f"{len(side)} UGVs have no room on a field {self.width_m:g} m wide")
        return np.reshape(places, (-1, 2))

    def _field(self, rng: np.random.Generator, count: int, ends: Array, least: Array) -> Array:
        """Draw places (count, 2), m, at least the distances (k,), m, away from the ends (k, 2), m."""
        places: list[Array] = []
        for _ in range(TRIES):
            if len(places) == count:
                break
            place = rng.uniform([0.0, -0.5 * self.width_m], [self.length_m, 0.5 * self.width_m])
            if (np.linalg.norm(ends - place, axis=1) >= least).all():
                places.append(place)
        if len(places) < count:
            raise ValueError(f"{count} obstacles have no room between starts and targets")
        return np.reshape(places, (-1, 2))

    def _shapes(
        self, rng: np.random.Generator, kind: str, count: int, ends: Array, least: Array
    ) -> dict[str, dict[str, Any]]:
        """Draw walls or boxes, by name, at least the distances (k,), m, away from the ends (k, 2), m."""
        shapes: dict[str, dict[str, Any]] = {}
        for _ in range(TRIES):
            if len(shapes) == count:
                break
            place = rng.uniform([0.0, -0.5 * self.width_m], [self.length_m, 0.5 * self.width_m])
            length, width = np.round(rng.uniform(*self.size_m, 2), 6).tolist()
            heading = round(rng.uniform(-np.pi, np.pi), 6)
            hidden = rng.random() < self.hidden
            shape = Obstacle(_ground(place), known_to_uav=not hidden, heading_rad=heading)
            if kind == "wall":
                shape.segment_m = [[-length / 2.0, 0.0], [length / 2.0, 0.0]]
            else:
                shape.size_m = [length, width]
            rows = outline.stacked(outline.prism(part) for part in convex_parts(shape) or ())
            apart = [convex.distances(rows, np.append(end, 0.0), True)[0] for end in ends]
            if (np.array(apart) >= least).all():
                shapes[f"{kind}{len(shapes) + 1}"] = asdict(shape)
        if len(shapes) < count:
            raise ValueError(f"{count} of kind {kind} have no room between starts and targets")
        return shapes


def _ground(place: Sequence[float] | Array) -> list[float]:
    return [*np.round(np.asarray(place, dtype=np.float64), 6).tolist(), 0.0]
