"""Hypothesis strategies for scenarios: every draw is valid, and stays valid while it shrinks.

Nothing is filtered. Places are cells of a grid whose pitch keeps every safe distance; periods are multiples of the
control period; gains, release level and sensing range are fractions or multiples of their bounds. Draws shrink to fewer
robots and obstacles, plainer shapes, shorter runs, and the defaults of the schema.

    from hypothesis import given, settings, strategies as st
    from airground_drake import simulate
    from airground_drake.study.testing import assert_holds
    from airground_drake.study.testing.strategies import scenarios

    @settings(max_examples=20, deadline=None)
    @given(scenarios(ugvs=st.integers(1, 3), methods=st.just("d")))
    def test_distances_are_kept(scenario):
        (run,) = scenario.runs
        assert_holds(simulate(scenario, run), "SAFE-TRACE", "SAFE-HYP")
"""

import math
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import TypeVar

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from airground_drake.base.registry import METHODS, ROUTES
from airground_drake.model.trigger import bayes
from airground_drake.scenario import schema

T = TypeVar("T")

SPEEDS = (1.0, 0.5, 2.0)  # speeds of preset trajectories and of proposals, m/s
DISTANCES = (2.0, 1.0, 0.5, 3.0)  # safe distances, m, the default first
RADII = (0.0, 0.5, 0.1)  # radii of robots and obstacles, m
PERIODS = (0.025, 0.05, 0.1)  # control periods, s
JITTER = (0.0, 0.25, -0.25, 0.5, -0.5)  # offsets of a place from the middle of its cell, along an axis, m
KINDS = ("ball", "box", "wall", "polygon", "post")  # shapes of obstacles
SIZES = (1.0, 2.0)  # how far shapes extend from their places at most, before they are rounded, m
OWN_DISTANCES = (0.0, 0.5, 3.0)  # distances that an obstacle may have instead of the scenario's, m; 0: none
HEADINGS = (0.0, 0.5, 1.5707963, -2.0)  # of obstacles, rad
HEIGHTS = (0.0, 1.0, 50.0)  # of obstacles, m
APPEARANCES = (0.0, 1.5, 30.0)  # times of appearance, s, of obstacles
OBSTACLE_SPEEDS = (1.0, 0.5, 1.7)  # speeds of obstacles that move, m/s
# Speeds at which obstacles promise to move at most, as shares of the true one; 0: no promise of their own.
PROMISES = (1.0, 0.0, 0.5, 1.5)
# Thresholds by the Bayes risk.
BAYES = (schema.Threshold("bayes"), schema.Threshold("bayes", drift_m_s=0.5, noise_m_sqrt_s=1.0))


@lru_cache(maxsize=None, typed=True)
def first_of(*values: T) -> SearchStrategy[T]:
    """One of the values; the first is the simplest. Cached, because making strategies takes most of a draw's time."""
    return st.sampled_from(values)


# Parameters of the package's policies, besides their speed.
PARAMETERS: dict[str, dict[str, float]] = {
    "coordinate": {}, "detour": {}, "towards": {"x_m": 0.0, "y_m": 0.0}, "stale_map": {}, "noisy": {"noise_m": 0.5},
    "hostile": {},
}  # fmt: skip


@st.composite
def policies(draw: DrawFn, names: Sequence[str] = tuple(PARAMETERS), *, at_most: int = 2) -> list[schema.Policy]:
    """A behaviour database, without repetition.

    Args:
        draw: given by Hypothesis.
        names: allowed policies, the simplest first; third-party ones (`module:Class`) get no parameters.
        at_most: largest number of policies.
    """
    chosen = draw(st.lists(st.sampled_from(names), max_size=at_most, unique=True))
    speeds = [draw(first_of(*SPEEDS)) for _ in chosen]
    return [
        schema.Policy(name, {"speed_m_s": speed, **PARAMETERS[name]} if name in PARAMETERS else {})
        for name, speed in zip(chosen, speeds, strict=True)
    ]


DATABASES = policies()  # made once, because making strategies takes time


@st.composite
def scenarios(
    draw: DrawFn,
    *,
    ugvs: SearchStrategy[int] | None = None,
    obstacles: SearchStrategy[int] | None = None,
    methods: SearchStrategy[str] | None = None,
    policies: SearchStrategy[list[schema.Policy]] | None = None,
    triggers: SearchStrategy[str] | None = None,
    routes: SearchStrategy[str] | None = None,
    durations: SearchStrategy[float] | None = None,
    compositions: SearchStrategy[str] | None = None,
    shapes: SearchStrategy[str] | None = None,
    moving: SearchStrategy[bool] | None = None,
) -> schema.Scenario:
    """A valid scenario with one run, named by its method.

    Args:
        draw: given by Hypothesis.
        ugvs: how many; default: 1 to 4.
        obstacles: how many; default: up to 6.
        methods: of the run; default: any, (d) first.
        policies: of the UAV; default: `policies()`.
        triggers: default: any.
        routes: of method (c)'s gatekeeper; default: any.
        durations: of the run, s; default: 1 to 20. Runs of minutes may be invalid, because rounding errors of
            distances grow with the way.
        compositions: of the avoidance; default: `augmented`, the only one that guarantees distances.
        shapes: of the obstacles, names of `KINDS`; default: any of them in half of the scenarios, which may also have
            an arena, and balls in the others.
        moving: whether an obstacle moves; default: none does. Some move faster than they promise. Beside them no robot
            comes too near by its own motion; the obstacle can break distances.
    """
    count = draw(st.integers(1, 4) if ugvs is None else ugvs)
    method = draw(first_of(*sorted(METHODS, reverse=True)) if methods is None else methods)
    period = draw(first_of(*PERIODS))
    safe = schema.SafeDistance(
        obstacle_m=draw(first_of(*DISTANCES)),
        moving_m=draw(first_of(0.0, *DISTANCES)) if moving is not None else 0.0,
        ugv_m=draw(first_of(*DISTANCES)),
        air_ground_m=draw(first_of(1.0, 0.5)),
    )
    largest = draw(first_of(*RADII))
    others = draw(st.integers(0, 6) if obstacles is None else obstacles)
    if shapes is None:
        shapes = draw(first_of(first_of("ball"), first_of(*KINDS)))
    own = draw(first_of(*OWN_DISTANCES))
    team, uav, rocks, arena = draw(
        _maps(count, others, safe, largest, own, shapes, st.just(False) if moving is None else moving)
    )
    speed = max(uav.max_speed_m_s, *(ugv.max_speed_m_s for ugv in team.values()))
    database = draw(DATABASES if policies is None else policies)
    reach = _farthest(safe, own) + 2.0 * (largest + speed * period)  # and the way of two robots in one period
    return schema.Scenario(
        name="drawn",
        seed=draw(st.integers(0, 3)),
        duration_s=draw(st.integers(1, 20).map(float) if durations is None else durations),
        ugvs=team,
        uav=uav,
        obstacles=rocks,
        arena_m=arena,
        safe_distance=safe,
        control=draw(_controls(period, reach)),
        decision=draw(_decisions(period, triggers)),
        intervention=draw(_interventions(period, database)),
        gatekeeper=draw(_gatekeepers(period, routes)),
        runs={method: schema.Run(method, "augmented" if compositions is None else draw(compositions))},
    )


def _farthest(safe: schema.SafeDistance, own: float) -> float:
    """The largest distance that any two bodies keep, m, including obstacles' own distances."""
    return max(safe.obstacle_m, safe.moving_m, safe.ugv_m, safe.air_ground_m, own)


Cell = tuple[int, int]  # column and row in the grid of a map


@st.composite
def _maps(
    draw: DrawFn,
    count: int,
    others: int,
    safe: schema.SafeDistance,
    largest: float,
    own: float,
    shapes: SearchStrategy[str],
    moving: SearchStrategy[bool],
) -> tuple[dict[str, schema.Ugv], schema.Uav, dict[str, schema.Obstacle], list[schema.Vector]]:
    """UGVs, UAV and obstacles on a grid, in an arena or without one; `largest` in m."""
    # Each start has its own cell, and so has each target and each obstacle.
    # own: distance that some obstacles have instead of the scenario's, m; 0: none.
    kinds = [draw(shapes) for _ in range(others)]
    size = draw(first_of(*SIZES)) if {*kinds} - {"ball", "post"} else 0.0
    pitch = _farthest(safe, own) + 2.0 * (max(JITTER) + largest) + size
    radii = first_of(0.0, largest)
    width = math.isqrt(count + others + 2) + draw(st.integers(1, 3))
    cells = [(x, y) for y in range(width) for x in range(width)]
    free = list(cells)
    points = {
        f"obstacle_{k + 1}": draw(_obstacles(kind, draw(_places(free, pitch)), size, radii, own))
        for k, kind in enumerate(kinds)
    }
    for obstacle in points.values():
        if draw(moving):
            _move(draw, obstacle, cells, pitch)
    arena = [[-pitch, -pitch], [width * pitch, width * pitch]] if size and draw(first_of(False, True)) else []
    starts, targets = list(free), list(free)
    team = {f"ugv{k + 1}": draw(_ugvs(cells, starts, targets, pitch, radii)) for k in range(count)}
    altitude = safe.air_ground_m + 2.0 * largest + 1.0
    return team, draw(_uavs(cells, starts, targets, pitch, altitude, radii)), points, arena


@st.composite
def _obstacles(
    draw: DrawFn, kind: str, place: schema.Vector, size: float, radii: SearchStrategy[float], own: float
) -> schema.Obstacle:
    """An obstacle of a kind whose core extends at most `size`, m, from its place."""
    obstacle = schema.Obstacle(place, draw(first_of(True, False)), draw(radii))
    if kind == "ball":
        return obstacle
    obstacle.height_m = 1.0 if kind == "post" else draw(first_of(*HEIGHTS))
    obstacle.distance_m, obstacle.appears_s = draw(first_of(0.0, own)), draw(first_of(*APPEARANCES))
    if kind == "post":
        return obstacle
    obstacle.heading_rad = draw(first_of(*HEADINGS))
    if kind == "box":
        obstacle.size_m = [size, size * draw(first_of(0.5, 1.5))]
        return obstacle
    corners = draw(st.integers(3, 7))  # at equal angles, so that edges do not cross
    rays = [size * draw(first_of(1.0, 0.3, 0.6)) for _ in range(corners)]
    around = [
        [round(ray * math.cos(math.tau * k / corners), 6), round(ray * math.sin(math.tau * k / corners), 6)]
        for k, ray in enumerate(rays)
    ]
    if kind == "wall":
        obstacle.segment_m = around[: draw(st.integers(2, corners))]
    else:
        obstacle.polygon_m = around
    return obstacle


def _move(draw: DrawFn, obstacle: schema.Obstacle, cells: list[Cell], pitch: float) -> None:
    """Let an obstacle move from its place through middles of cells."""
    way = _distinct([obstacle.position_m, *draw(_middles(cells, pitch, 3))])
    at_end = draw(first_of(*schema.AT_END))
    if len(way) == 1 or (at_end == "loop" and way[0] == way[-1]):
        way.append([way[0][0] + pitch, *way[0][1:]])
    speed = draw(first_of(*OBSTACLE_SPEEDS))
    obstacle.position_m, obstacle.moves = [], schema.Moves(way, speed, draw(first_of(0.0, 1.0)), at_end)
    obstacle.max_speed_m_s, obstacle.known_motion = speed * draw(first_of(*PROMISES)), draw(first_of(False, True))


@st.composite
def _places(draw: DrawFn, free: list[Cell], pitch: float, besides: Cell | None = None) -> schema.Vector:
    """A point on the ground, m, in a free cell other than `besides`, which is then occupied."""
    options = [cell for cell in free if cell != besides]
    cell = options[draw(st.integers(0, len(options) - 1))]
    free.remove(cell)
    return [*(pitch * at + draw(first_of(*JITTER)) for at in cell), 0.0]


def _middles(cells: list[Cell], pitch: float, at_most: int) -> SearchStrategy[list[schema.Vector]]:
    """Some middles of cells, m, occupied or not."""
    return st.lists(first_of(*cells).map(lambda cell: [pitch * cell[0], pitch * cell[1], 0.0]), max_size=at_most)


@st.composite
def _ugvs(
    draw: DrawFn, cells: list[Cell], starts: list[Cell], targets: list[Cell], pitch: float, radii: SearchStrategy[float]
) -> schema.Ugv:
    """A UGV with a target away from its start, and a preset trajectory that may lead anywhere."""
    begin = draw(_places(starts, pitch))
    end = draw(_places(targets, pitch, besides=(round(begin[0] / pitch), round(begin[1] / pitch))))
    speed = draw(first_of(*SPEEDS))
    preset = schema.Preset(_distinct([begin, *draw(_middles(cells, pitch, 2)), end]), speed)
    return schema.Ugv(begin, end, preset, draw(first_of(6.0, speed)), draw(radii))


@st.composite
def _uavs(
    draw: DrawFn,
    cells: list[Cell],
    starts: list[Cell],
    targets: list[Cell],
    pitch: float,
    altitude: float,
    radii: SearchStrategy[float],
) -> schema.Uav:
    """A UAV whose start and target have cells of their own; its map may have phantom obstacles."""
    above = [[*draw(_places(free, pitch))[:2], altitude] for free in (starts, targets)]
    return schema.Uav(
        start_m=above[0],
        target_m=above[1],
        altitude_m=altitude,
        max_speed_m_s=draw(first_of(10.0, 3.0)),
        phantoms_m=draw(_middles(cells, pitch, 1)),
        radius_m=draw(radii),
    )


def _distinct(points: list[schema.Vector]) -> list[schema.Vector]:
    return [point for before, point in zip([None, *points], points, strict=False) if point != before]


@st.composite
def _controls(draw: DrawFn, period: float, reach: float) -> schema.Control:
    """Gains up to nine tenths of the bound by the period; a sensing range that is just enough, or larger."""
    gain = st.one_of(st.none(), first_of(0.1, 0.5, 0.9).map(lambda part: part / period))
    names = ("avoidance_gain_1_s", "motion_gain_1_s", "formation_gain_1_s", "intervention_gain_1_s")
    gains = {name: value for name in names if (value := draw(gain)) is not None}
    return schema.Control(period_s=period, sensing_range_m=draw(first_of(max(4.0, reach), reach, reach + 4.0)), **gains)


@st.composite
def _decisions(draw: DrawFn, period: float, triggers: SearchStrategy[str] | None) -> schema.Decision:
    """A trigger with its threshold, a release level below it, and noise with a period of its own."""
    fixed = first_of(3.0, 1.0, 0.5, 0.1).map(lambda zeta: schema.Threshold(zeta_m=zeta))
    threshold = draw(st.one_of(fixed, st.sampled_from(BAYES)))
    return schema.Decision(
        threshold=threshold,
        trigger=draw(first_of(*schema.TRIGGERS) if triggers is None else triggers),
        release_m=bayes.threshold(**asdict(threshold)) * draw(first_of(0.5, 0.1, 0.9)),
        min_inter_event_s=draw(first_of(0.5, 0.0, 0.05, 2.0)),
        noise_m_sqrt_s=draw(first_of(0.0, 0.004, 0.1)),
        leak_1_s=draw(first_of(0.0, 0.5)),
        noise_period_s=period * draw(first_of(1.0, 0.5, 2.0)),
    )


@st.composite
def _interventions(draw: DrawFn, period: float, database: list[schema.Policy]) -> schema.Intervention:
    """Times and order in which the UAV asks its policies."""
    return schema.Intervention(
        period_s=period * draw(first_of(2, 1, 4)),
        retry_s=draw(first_of(1.0, 0.0)),
        ranking=draw(first_of("predicted", "listed")),
        policies=database,
    )


@st.composite
def _gatekeepers(draw: DrawFn, period: float, routes: SearchStrategy[str] | None) -> schema.Gatekeeper:
    """A gatekeeper whose stages and period are multiples of the control period."""
    stages = draw(first_of(60, 20, 6, 2))
    return schema.Gatekeeper(
        route=draw(first_of(*ROUTES.own) if routes is None else routes),
        period_s=period * draw(first_of(2, 1, 4)),
        horizon_s=stages * period * draw(first_of(2, 1)),
        stages=stages,
        terminal_weight_s=draw(first_of(0.0, 1.0)),
        min_dwell_s=draw(first_of(0.2, 0.0)),
        tries=draw(first_of(5, 1)),
        longest_s=draw(first_of(30.0, 3.0)),
    )
