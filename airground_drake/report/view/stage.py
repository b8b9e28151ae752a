"""The robots and obstacles of a scenario with the sizes at which they are drawn."""

from dataclasses import dataclass, field

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.model.geometry import convex, outline
from airground_drake.model.plants.plant import HEADING
from airground_drake.model.trigger.automaton import Mode
from airground_drake.report.view.geometry import outer_edges
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.schema import ARENA, Scenario
from airground_drake.sim.trace import Trace

# A robot follows its own task, follows it while its trigger is set, or executes a proposal.
STATES = ("own task", "triggered", "intervened")
OWN, TRIGGERED, INTERVENED = range(3)

# Smallest and largest radius with which a point is drawn, as shares of the larger side of the scene.
SMALLEST, LARGEST = 0.006, 0.018
# Radius of a point as a share of the least safe distance on the ground: points that keep it are drawn apart.
OF_SAFE_DISTANCE = 0.4
OF_MARK = 0.3  # half of the thickness of a thin wall as a share of the radius of a point
# Up to so many parts of barriers have fine rims: numbers of corners for half a circle, fine and coarse.
MANY, FINE, COARSE = 100, 16, 4
# What is this share of a distance away from a core is inside of the polygon about it, also between two corners.
INWARD = 0.99
HIGHEST = 2.0  # walls are drawn up to this multiple of the largest height of a robot: others may be endless
STATE_COLORS = ("#0060a8", "#d98200", "#00705a")
STATE_MARKS = ("", "▲", "◉")  # by index of STATES; the marks stand beside a robot's name
# Of proposals; the line is solid if accepted, else dashed.
OUTCOME_COLORS = {"asked": "#d98200", "accepted": "#00705a", "refused": "#b00020"}
UAV_COLOR, PATH_COLOR, SAFE_COLOR = "#404040", "#8899aa", "#b03a2e"
# Of an obstacle on the UAV's map, and of one that is missing on it or exists only there.
OBSTACLE_COLOR, UNSEEN_COLOR = "#5a5a5a", "#a0a0a0"


@dataclass(frozen=True)
class Robot:
    """A robot: `kind` is UGV or UAV, `radius_m` as drawn, `target_m` (3,), `turns` whether it has a heading."""

    name: str
    kind: str
    radius_m: float
    target_m: Array
    turns: bool


@dataclass(frozen=True)
class Barrier:
    """An obstacle or phantom, except the walls of the arena."""

    name: str  # of the scenario
    parts: Array  # outlines of its convex parts at the start, (k, W), world frame; see `model.geometry.outline`
    known_to_uav: bool  # whether it is on the UAV's map
    appears_s: float = 0.0  # time from which on it is there, s
    disappears_s: float = np.inf  # time from which on it is gone, s; infinite if it stays
    # Corners of the way of its frame's origin, (n, 3), m; n is 0 if it does not move.
    way_m: Array = field(default_factory=lambda: np.empty((0, 3)))
    mark_m: float = 0.0  # least radius with which points and thin walls are drawn, m
    rays: int = FINE  # number of corners for half a circle

    @property
    def color(self) -> str:
        return OBSTACLE_COLOR if self.known_to_uav else UNSEEN_COLOR

    @property
    def is_round(self) -> bool:
        return bool(len(self.parts) == 1 and self.parts[0, outline.COUNT] == 1.0)

    @property
    def place_m(self) -> Array:
        """A point of it, (3,), m, on the ground below it or its centre: the middle of its largest part."""
        largest = self.parts[np.argmax(self.parts[:, outline.EXTENT])]
        return np.append(outline.corners_of(largest).mean(axis=0), largest[outline.BASE])

    @property
    def top_m(self) -> float:
        return float(self.parts[:, outline.TOP].max())

    @property
    def radius_m(self) -> Array:
        """By how much its parts are rounded as they are drawn, (k,), m; of a ball or a post, its radius."""
        least = np.select([self.parts[:, outline.COUNT] == 1.0, self.parts[:, outline.COUNT] == 2.0], [1.0, OF_MARK])
        return np.maximum(least * self.mark_m, self.parts[:, outline.RADIUS])

    @property
    def safe_m(self) -> Array:
        """Distances that UGVs' surfaces keep from the cores of its parts, (k,), m."""
        return outline.keep(self.parts, 0.0)

    @property
    def body(self) -> list[Array]:
        """Its parts as they are drawn, seen from above: polygons (K, 2), m."""
        return self._rims(self.radius_m)

    @property
    def safe(self) -> list[Array]:
        """The areas that UGVs' surfaces must not enter, for each part: polygons (K, 2), m."""
        return self._rims(self.safe_m)

    @property
    def rim(self) -> Array:
        """The edge of all of `safe` together: ends of short segments, (2, S, 2), m. For fine rims only."""
        reach = self.safe_m

        def inside(points: Array) -> Flags:
            return ~convex.points_are_free(points, self.parts, INWARD * reach)

        return outer_edges(self.safe, inside, 0.25 * float(reach.min()))

    def _rims(self, reach: Array) -> list[Array]:
        """Outlines of all that is within distances (k,), m, of the cores of its parts."""
        return [
            outline.rim(part, distance, self.rays) if distance else outline.corners_of(part)
            for part, distance in zip(self.parts, reach.tolist(), strict=True)
        ]

    @property
    def corners(self) -> tuple[Array, Array]:
        """Corners (2,), m, of the least rectangle, along the axes, that contains `safe` wherever the barrier goes."""
        places = [outline.corners_of(part) for part in self.parts]
        low = np.min([part.min(axis=0) - reach for part, reach in zip(places, self.safe_m, strict=True)], axis=0)
        high = np.max([part.max(axis=0) + reach for part, reach in zip(places, self.safe_m, strict=True)], axis=0)
        goes = self.way_m[:, :2] - self.way_m[:1, :2] if len(self.way_m) else np.zeros((1, 2))
        return low + goes.min(axis=0), high + goes.max(axis=0)


@dataclass(frozen=True)
class Stage:
    """A scenario at the start."""

    # `low_m` and `high_m` (3,) bound what is shown. `mark_m` is the radius with which a point is drawn. `phantoms_m`
    # (P, 3) are the obstacles that only the UAV's map has. `arena` is as `arena_of` gives it.

    robots: tuple[Robot, ...]
    barriers: tuple[Barrier, ...]
    arena: tuple[Array, ...]
    phantoms_m: Array
    low_m: Array
    high_m: Array
    mark_m: float


def stage(scenario: Scenario, visited_m: Array | None = None) -> Stage:
    """The stage of a scenario; it contains the positions `visited_m` (M, 3), m; default: the starts."""
    specs = scenario.robots
    if visited_m is None:
        visited_m = np.array([spec.start_m for spec in specs.values()])
    low, high = _bounds(scenario, visited_m)
    extent = float((high - low)[:2].max())
    apart = min(scenario.safe_distance.obstacle_m, scenario.safe_distance.ugv_m)
    mark = min(max(SMALLEST * extent, OF_SAFE_DISTANCE * apart), LARGEST * extent)
    robots = tuple(
        Robot(
            name=name,
            kind="UGV" if scenario.kind_of(name) == "ugv" else "UAV",
            radius_m=max(mark, spec.radius_m),
            target_m=np.array(spec.target_m),
            turns=HEADING in plant_of(spec, scenario.control.period_s).signals,
        )
        for name, spec in specs.items()
    )
    phantoms = np.reshape([at for uav in scenario.aerial.values() for at in uav.phantoms_m], (-1, 3))
    return Stage(robots, barriers_of(scenario, mark), arena_of(scenario), phantoms, low, high, mark)


def stage_of(trace: Trace, scenario: Scenario) -> Stage:
    return stage(scenario, np.concatenate([trace.body(robot) for robot in trace.robots]))


def barriers_of(scenario: Scenario, mark: float = 0.0) -> tuple[Barrier, ...]:
    """All obstacles and phantoms but the walls of the arena; `mark` is the least drawn width, m."""
    specs = {name: spec for name, spec in scenario.barriers.items() if not name.startswith(ARENA)}
    parts = {name: outlines_of(scenario, spec) for name, spec in specs.items()}
    rays = FINE if sum(map(len, parts.values())) <= MANY else COARSE
    barriers = []
    for name, spec in specs.items():
        way = np.array([[*place, 0.0][:3] for place in spec.moves.waypoints_m]) if spec.moves else np.empty((0, 3))
        barrier = Barrier(
            name=name,
            parts=outline.moved(parts[name], way[0]) if len(way) else parts[name],
            known_to_uav=spec.known_to_uav,
            appears_s=spec.appears_s,
            disappears_s=spec.disappears_s or np.inf,
            way_m=way,
            mark_m=mark,
            rays=rays,
        )
        barriers.append(barrier)
    return tuple(barriers)


def arena_of(scenario: Scenario) -> tuple[Array, ...]:
    """The frames of the arena and of what robots' surfaces keep to: corners (4, 2) each, m; none without arena."""
    if not scenario.arena_m:
        return ()
    low, high = np.min(scenario.arena_m, axis=0), np.max(scenario.arena_m, axis=0)
    side = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    gap = scenario.safe_distance.obstacle_m
    return tuple(low + inset + side * (high - low - 2.0 * inset) for inset in (0.0, gap))


def states(trace: Trace, ugv: str, times: Array) -> Indices:
    """Indices of STATES (F,) in force just before times (F,), s."""
    rows = np.minimum(np.searchsorted(trace.t, times - 1e-9), len(trace.t) - 1)
    return states_of(trace.executing(ugv)[rows], trace.column(f"{ugv}.mode")[rows])


def states_of(executing: Array, mode: Array) -> Indices:
    """Indices of STATES, from numbers of the proposals executed (-1: none) and the trigger's modes, of equal shapes."""
    return np.where(executing >= 0, INTERVENED, np.where(mode == Mode.INTERVENING, TRIGGERED, OWN))


def _bounds(scenario: Scenario, visited_m: Array) -> tuple[Array, Array]:
    """Corners (3,), m, of a box around positions (M, 3), m, targets, arena, and barriers with their safe zones."""
    points = [visited_m, np.array([spec.target_m for spec in scenario.ugvs.values()])]
    highest = HIGHEST * visited_m[:, 2].max()
    for barrier in barriers_of(scenario):
        heights = barrier.parts[:, outline.BASE].min(), max(min(barrier.top_m, highest), barrier.place_m[2])
        points.append(np.column_stack([barrier.corners, heights]))
    points += [np.column_stack([ring, np.zeros(4)]) for ring in arena_of(scenario)]
    shown = np.concatenate([*points, visited_m[:1] * [1.0, 1.0, 0.0]])
    return shown.min(axis=0), np.maximum(shown.max(axis=0), shown.min(axis=0) + 1.0)


def rgb(color: str) -> list[float]:
    """Red, green and blue, from 0 to 1, of a colour #rrggbb."""
    return [int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
