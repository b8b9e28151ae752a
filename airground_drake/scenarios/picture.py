"""A scenario or a run of it as a small picture: the ground plane as SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from airground_drake.base.arrays import Array

if TYPE_CHECKING:
    from airground_drake.scenarios.schema import Scenario

WIDTH, HEIGHT, EDGE = 240.0, 180.0, 8.0
NAMESPACE = "http://www.w3.org/2000/svg"


def picture(scenario: Scenario, paths: Mapping[str, Array] | None = None, colors: Sequence[str] = ("#0060a8",)) -> str:
    """Obstacles (grey) in their safe circles, a line for each UGV that ends in a dot, and targets (crosses).

    Args:
        scenario: has the obstacles and targets.
        paths: positions (T, 2), m, by UGV; default: the preset trajectories of all UGVs.
        colors: of the UGVs' lines, in turn.

    Returns:
        An SVG document; the tooltip of a line is the UGV's name.
    """
    if paths is None:
        paths = {name: np.array(ugv.preset.waypoints_m)[:, :2] for name, ugv in scenario.ugvs.items()}
    targets = {name: np.array(scenario.ugvs[name].target_m[:2]) for name in paths}
    circles = [
        (np.array(each.position_m[:2]), scenario.safe_distance.obstacle_m + each.radius_m)
        for each in scenario.obstacles.values()
    ]
    shown = [*paths.values(), *([at] for at in targets.values())]
    shown += [[at - reach, at + reach] for at, reach in circles]
    every = np.concatenate([np.asarray(each) for each in shown])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = float(((np.array([WIDTH, HEIGHT]) - 2.0 * EDGE) / np.maximum(high - low, 1.0)).min())

    def pixels(points: Array) -> Array:
        """Points (..., 2), m, in the picture, whose y axis points down."""
        placed: Array = np.array([WIDTH, HEIGHT]) / 2.0 + (points - (low + high) / 2.0) * scale * [1.0, -1.0]
        return placed

    shapes = [_circle(pixels(at), reach * scale, "fill='#eeeeee' stroke='#aaaaaa'") for at, reach in circles]
    shapes += [_circle(pixels(at), 2.5, "fill='#777777'") for at, _ in circles]
    for k, (name, path) in enumerate(paths.items()):
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in pixels(path))
        color = colors[k % len(colors)]
        shapes.append(
            f"<polyline points='{line}' fill='none' stroke='{color}' stroke-width='2'><title>{escape(name)}</title>"
            "</polyline>"
        )
        shapes.append(_circle(pixels(path[-1]), 3.0, f"fill='{color}'"))
        x, y = pixels(targets[name])
        cross = f"M{x - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8"
        shapes.append(f"<path d='{cross}' fill='none' stroke='{color}' stroke-width='1.5'/>")
    size = f"viewBox='0 0 {WIDTH:g} {HEIGHT:g}' width='{WIDTH:g}' height='{HEIGHT:g}'"
    return f"<svg xmlns='{NAMESPACE}' {size}>{''.join(shapes)}</svg>"


def _circle(at: Array, radius: float, look: str) -> str:
    return f"<circle cx='{at[0]:.1f}' cy='{at[1]:.1f}' r='{radius:.1f}' {look}/>"
