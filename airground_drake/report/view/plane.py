"""A scenario and the ways of its robots seen from above, drawn by matplotlib: the one way to draw the ground plane.

Figures of reports, replays and notebooks are drawn inside `canvas.style`, which gives them the same looks.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Polygon
from matplotlib.path import Path

from airground_drake.base.arrays import Array
from airground_drake.report.view import canvas, svg
from airground_drake.report.view.canvas import INK, MUTED, UAV_LOOK, Look, look, rule, short, thin
from airground_drake.report.view.labels import Label, place
from airground_drake.report.view.stage import MANY, Barrier, arena_of, barriers_of
from airground_drake.scenario.schema import MAP, Scenario
from airground_drake.sim.trace import Trace

MAX_NAMED_BARRIERS = 12
THUMBNAIL_IN = (2.5, 1.9)  # width and height of a small picture, inches
MAX_THUMBNAIL_UGVS, MAX_THUMBNAIL_POINTS = 20, 200
# Least size of the wedge of a robot with a heading, as a share of the picture, and number of wedges on its way.
WEDGE, WEDGES = 0.008, 9
MOST_OBLONG = 12.0  # largest ratio of a map's sides, so that labels have room
# Margin left of a map, both side margins together, margins below and above it, inches.
_LEFT_IN, _BESIDE_IN, _BELOW_IN, _ABOVE_IN = 0.5, 0.65, 0.42, 0.1
_VOID_DASH, _WAY_DOTS = (0, (1.5, 2.5)), (0, (1.0, 1.5))


class Frame(NamedTuple):
    """A rectangle of the ground plane, m."""

    left: float
    right: float
    bottom: float
    top: float

    def width_in(self, widest: float, tallest: float) -> float:
        """Width of its largest map within these limits, inches."""
        return min(widest, tallest * (self.right - self.left) / (self.top - self.bottom) + _BESIDE_IN)

    def show(self, axes: Axes) -> None:
        """Set the limits of axes, with equal scales."""
        axes.set(xlim=(self.left, self.right), ylim=(self.bottom, self.top), aspect="equal")


def frame_of(scenario: Scenario, ways: Iterable[tuple[str, Array]], *, targets: bool = True) -> Frame:
    """The rectangle around the ways (T, 3), m, of robots, by name, their targets, the arena, and safe outlines."""
    points = list[Array]()
    for name, way in ways:
        points += [way[:, :2] + side * scenario.robots[name].radius_m for side in (-1.0, 1.0)]
        points += [np.array([scenario.ugvs[name].target_m[:2]])] if targets and name in scenario.ugvs else []
    travelled = np.concatenate(points)
    low, high = travelled.min(axis=0), travelled.max(axis=0)
    around = float((high - low).max())  # a map may reach far beyond what robots can
    points += [
        np.clip(barrier.corners, low - around, high + around) if barrier.name == MAP else np.array(barrier.corners)
        for barrier in barriers_of(scenario)
    ]
    shown = np.concatenate([*points, *arena_of(scenario)])
    low, high = shown.min(axis=0) - [0.4, 1.0], np.add(shown.max(axis=0), [0.4, 1.2])
    beside = np.maximum(0.0, (high - low).max() / MOST_OBLONG - (high - low)) / 2.0
    (left, bottom), (right, top) = low - beside, high + beside
    return Frame(left, right, bottom, top)


def axes_over(frame: Frame, width_in: float, full_in: float = 0.0, below_in: float = 0.0) -> tuple[Figure, Axes]:
    """A figure with axes over a part of the ground plane, at least `full_in` wide, with more room below the axes."""
    inner_in, full_in, below_in = width_in - _BESIDE_IN, max(width_in, full_in), _BELOW_IN + below_in
    inner_height_in = inner_in * (frame.top - frame.bottom) / (frame.right - frame.left)
    height_in = inner_height_in + below_in + _ABOVE_IN
    figure = Figure(figsize=(full_in, height_in))
    box = (_LEFT_IN / full_in, below_in / height_in, inner_in / full_in, inner_height_in / height_in)
    axes = figure.add_axes(box)
    frame.show(axes)
    rule(axes, "x, m", "y, m")
    return figure, axes


def draw_barriers(axes: Axes, scenario: Scenario, *, moving: bool = True) -> tuple[list[Label], list[Array]]:
    """Draw obstacles with the outlines that robots' surfaces must not enter, the arena, and phantoms."""
    # What the UAV does not know is hollow. Points and balls have a hexagon in the middle. What moves is drawn where it
    # starts, with its way in dots, unless `moving` is False.
    # Returns labels, the names of the barriers, unless they are many, and of phantoms; and lines (K, 2), m, that labels
    # should avoid: ways of what moves, the arena, and the edges of walls, unless they are many.
    _draw_arena(axes, arena_of(scenario))
    barriers = [barrier for barrier in barriers_of(scenario) if moving or not len(barrier.way_m)]
    for barrier in barriers:
        if len(barrier.way_m):
            axes.plot(*barrier.way_m[:, :2].T, color=INK, linestyle=_WAY_DOTS, linewidth=1.8, zorder=1.4)
    walls, balls = ([barrier for barrier in barriers if barrier.is_round == of_balls] for of_balls in (False, True))
    _fill(axes, [part for wall in walls for part in wall.safe], _SAFE, 0.9)
    for known, appearance in ((True, _KNOWN), (False, _UNKNOWN)):
        _fill(axes, [part for wall in walls if wall.known_to_uav == known for part in wall.body], appearance, 1.5)
    circles = [Circle((ball.place_m[0], ball.place_m[1]), ball.safe_m[0]) for ball in balls]
    axes.add_collection(
        PatchCollection(circles, facecolor="#f3f3f3", edgecolor=MUTED, linestyle=(0, (2, 2)), linewidth=1.0, zorder=1.0)
    )
    hexagon: dict[str, Any] = {"linestyle": "none", "marker": "h", "markersize": 6, "color": INK, "zorder": 3}
    for ball in balls:
        _disc(axes, ball.place_m, ball.radius_m[0], INK)
        axes.plot(*ball.place_m[:2], **hexagon, markerfacecolor=INK if ball.known_to_uav else "white")
    labels = [_name_of(barrier) for barrier in barriers] if len(barriers) <= MAX_NAMED_BARRIERS else []
    for at in (at for uav in scenario.aerial.values() for at in uav.phantoms_m):
        axes.plot(*at[:2], marker="x", markersize=6, color=MUTED, zorder=3)
        labels.append(Label(np.array(at), "(only on the UAV's map)", size_pt=7.5))
    edges = [part for wall in walls for part in wall.body]
    rings = [*arena_of(scenario), *(edges if len(edges) <= MANY else [])]
    ways = [barrier.way_m[:, :2] for barrier in barriers if len(barrier.way_m)]
    return labels, [*ways, *(np.concatenate([ring, ring[:1]]) for ring in rings)]


class _Look(NamedTuple):
    """How polygons are drawn as one."""

    fill: str  # colour of what fills them
    edge: str  # colour of their edges
    width: float  # of the edges that are seen, points
    core: float  # width of a line in the colour of the filling, points; it hides seams, and makes thin walls hollow
    many: tuple[str, str]  # colours of filling and edges if the polygons are many
    dash: Any = "-"  # of the edges


_SAFE = _Look("#f3f3f3", MUTED, 1.0, 0.0, ("#dddddd", "none"), (0, (1, 1)))
# Looks of walls that the UAV knows, and of walls that it does not know.
_KNOWN, _UNKNOWN = _Look(MUTED, INK, 1.6, 1.0, (MUTED, MUTED)), _Look("white", INK, 1.5, 1.2, ("white", INK))


def _fill(axes: Axes, parts: Sequence[Array], appearance: _Look, zorder: float) -> None:
    """Draw polygons (K, 2): what fills them covers the inner half of their edges, and edges in other polygons."""
    # Many polygons are drawn once, without their outline: they would take most of the bytes of a page.
    fill, edge, width, core, many, dash = appearance
    if len(parts) > MANY:
        axes.add_collection(PolyCollection(parts, facecolor=many[0], edgecolor=many[1], linewidth=0.5, zorder=zorder))
    elif parts:
        below: dict[str, Any] = {"edgecolor": edge, "linewidth": 2.0 * width, "linestyle": dash, "zorder": zorder}
        axes.add_collection(PolyCollection(parts, facecolor="none", **below))
        above = PolyCollection(parts, facecolor=fill, edgecolor=fill, linewidth=core, zorder=zorder + 0.05)
        axes.add_collection(above)


def _draw_arena(axes: Axes, rings: Sequence[Array]) -> None:
    """Draw the frame of an arena, (4, 2), and the frame that robots' surfaces keep to, if there is an arena."""
    if rings:
        frame, inner = ([*ring, ring[0]] for ring in rings)
        band = Path.make_compound_path(Path(frame, closed=True), Path(inner[::-1], closed=True))
        axes.add_patch(PathPatch(band, facecolor="#f3f3f3", edgecolor="none", zorder=0.9))
        axes.plot(*np.transpose(inner), color=MUTED, linestyle=(0, (2, 2)), linewidth=1.0, zorder=1.0)
        axes.plot(*np.transpose(frame), color=INK, linewidth=1.6, zorder=1.5)


def _name_of(barrier: Barrier) -> Label:
    since = f", from {barrier.appears_s:g} s" if barrier.appears_s else ""
    since += f", until {barrier.disappears_s:g} s" if np.isfinite(barrier.disappears_s) else ""
    return Label(barrier.place_m, f"{short(barrier.name, 12)}{since}", size_pt=7.5)


def draw_robot(
    axes: Axes,
    scenario: Scenario,
    name: str,
    way: Array,
    appearance: Look,
    rows: int | None = None,
    headings: Array | None = None,
    **options: Any,
) -> list[Label]:
    """Draw the way (T, 2) or (T, 3), m, of a robot: its start o, a UGV's target x, its size at both ends."""
    # headings: (T,), rad
    # rows: number of positions that count, by default all; the others are drawn in short dashes.
    # Returns labels: its name at both ends.
    rows = len(way) if rows is None else rows
    options = {"linewidth": 1.9 if name in scenario.ugvs else 1.1, **options}
    parts = [(way[:rows, :2], appearance.dash, options), (way[rows - 1 :, :2], _VOID_DASH, {"linewidth": 0.9})]
    for part, dash, of_line in parts[: 1 + (rows < len(way))]:
        axes.plot(*part[thin(part)].T, color=appearance.color, linestyle=dash, **of_line)
    if headings is not None:
        _wedges(axes, way[:rows], headings[:rows], scenario.robots[name].radius_m, appearance.color)
    ends = [way[0], way[-1]]
    for at in ends:
        _disc(axes, at, scenario.robots[name].radius_m, appearance.color)
    axes.plot(*way[0][:2], marker="o", markersize=6, color=appearance.color, markerfacecolor="white", zorder=4)
    if name in scenario.ugvs:
        ends[1] = np.array(scenario.ugvs[name].target_m)
        axes.plot(*ends[1][:2], marker="x", markersize=7, markeredgewidth=2, color=appearance.color, zorder=4)
    return [Label(at, short(name, 9), appearance.color, weight="bold") for at in ends[name not in scenario.ugvs :]]


def _wedges(axes: Axes, way: Array, headings: Array, radius_m: float, color: str) -> None:
    """A robot as a wedge in the direction of its heading, at the same number of rows apart."""
    across = max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()))
    length = max(radius_m, WEDGE * float(across))
    for k in np.linspace(0, len(way) - 1, WEDGES).astype(int).tolist():
        turn = headings[k] + np.array([0.0, 2.5, -2.5])
        corners = way[k, :2] + length * np.column_stack([np.cos(turn), np.sin(turn)])
        axes.add_patch(Polygon(corners, facecolor="white", edgecolor=color, linewidth=1.0, zorder=3))


def looks_of(scenario: Scenario, ugvs: Iterable[str]) -> dict[str, Look]:
    """The look of each of some UGVs, in turn, and of the UAVs."""
    return {ugv: look(k) for k, ugv in enumerate(ugvs)} | dict.fromkeys(scenario.aerial, UAV_LOOK)


def plot(trace: Trace, axes: Axes | None = None) -> Axes:
    """Draw a run in the ground plane, in m: ways, starts o, targets x, obstacles in their safe circles.

    Args:
        trace: the run.
        axes: where to draw; default: those of a new figure of pyplot.

    Returns:
        The axes.

    Raises:
        TraceError: if the trace lacks a column or holds numbers that are not finite.
    """
    if axes is None:
        from matplotlib import pyplot

        _, axes = pyplot.subplots()
    scenario = trace.scenario
    ways = {robot: trace.body(robot) for robot in trace.robots}
    frame_of(scenario, ways.items()).show(axes)
    labels, edges = draw_barriers(axes, scenario)
    for robot, appearance in looks_of(scenario, trace.ugvs).items():
        rows = trace.counting_rows(robot)
        headings = trace.heading(robot)
        labels += draw_robot(axes, scenario, robot, ways[robot], appearance, rows, headings, label=robot)
    place(axes, labels, [*ways.values(), *edges])
    axes.set(xlabel="x, m", ylabel="y, m", title=f"{scenario.name}, run {trace.run}")
    return axes


def thumbnail(scenario: Scenario, ways: Mapping[str, Array] | None = None) -> str:
    # ways: positions (T, 3), m, by UGV; default: the preset trajectories. Those of the first UGVs are drawn.
    if ways is None:
        ways = {name: np.array(ugv.preset.waypoints_m) for name, ugv in scenario.ugvs.items()}
    drawn: Sequence[tuple[str, Array]] = [*ways.items()][:MAX_THUMBNAIL_UGVS]
    with canvas.style():
        figure = Figure(figsize=THUMBNAIL_IN)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        frame_of(scenario, drawn).show(axes)
        draw_barriers(axes, scenario)
        for k, (name, way) in enumerate(drawn):
            draw_robot(axes, scenario, name, way[thin(way, MAX_THUMBNAIL_POINTS)], look(k), linewidth=1.4)
        return canvas.svg(figure)


def thumbnail_of(trace: Trace, prefix: str) -> str:
    """The thumbnail of a run as an element for HTML; `prefix` is unique in the page."""
    drawn = thumbnail(trace.scenario, {ugv: trace.body(ugv) for ugv in trace.ugvs})
    says = "Ways of the UGVs from above; rings: starts; crosses: targets; grey: obstacles in their safe circles."
    return svg.inline(drawn, prefix, f"Run {trace.run}", says, natural_size=True)


def _disc(axes: Axes, at: Sequence[float] | Array, radius: float, color: str) -> None:
    if radius:
        axes.add_patch(Circle((at[0], at[1]), radius, facecolor=color, edgecolor=color, alpha=0.35, zorder=1.5))
