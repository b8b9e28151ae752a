"""A map of square cells in the world: its frame, its rectangles, and what robots can reach."""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from airground_drake.base.arrays import Array
from airground_drake.scenario.maps.rectangles import Cells, Rectangles

DIGITS = 12  # corners are rounded to this many digits after the point, m: they are then the same on every machine


class Frame(NamedTuple):
    """Where a map's cells are in the world."""

    # Places are given in cells, (column, row), from the corner of cell (0, 0).

    cell_m: float  # side of a cell, m
    # Outer corner of the cell (0, 0) in the world, x and y in m; heading of the rows, rad.
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def points(self, places: Array) -> Array:
        """Points of the world, (..., 2), m, at places (..., 2)."""
        x, y, heading = self.origin
        cos, sin = math.cos(heading), math.sin(heading)
        across, up = np.moveaxis(np.asarray(places) * self.cell_m, -1, 0)
        return np.stack([x + (cos * across - sin * up), y + (sin * across + cos * up)], axis=-1)

    def places(self, points: Array) -> Array:
        """Inverse of `points`."""
        x, y, heading = self.origin
        cos, sin = math.cos(heading), math.sin(heading)
        right, up = np.moveaxis(np.asarray(points) - (x, y), -1, 0)
        return np.stack([cos * right + sin * up, cos * up - sin * right], axis=-1) / self.cell_m

    def corners(self, rectangles: Rectangles) -> Array:
        """Corners of rectangles of cells in the world, counter-clockwise, (n, 4, 2), m."""
        bottom, top, left, right = rectangles.T
        places = np.stack([left, bottom, right, bottom, right, top, left, top], axis=-1).reshape(-1, 4, 2)
        return np.round(self.points(places), DIGITS)


class Grid(NamedTuple):
    """Square cells. Row 0 has the lowest y in the map's frame, column 0 the lowest x."""

    occupied: Cells  # which cells are occupied, (rows, columns)
    frame: Frame  # where they are

    def cells(self, points: Array) -> NDArray[np.int64]:
        """Row and column of the cell at each point, (n, 2) for (n, 2), m. They may be outside of the map."""
        return np.floor(self.frame.places(points))[:, ::-1].astype(np.int64)

    def filled(self, robots: Sequence[Sequence[float]]) -> Self:
        """The map with all free cells occupied that no robot can reach; `robots` in m."""
        # Robots go from a cell to one that shares a side with it, and leave the map where its edge is free. If no robot
        # is at a free cell, nothing is filled.
        from scipy import ndimage  # takes long to import, and most scenarios have no map

        free = np.pad(~self.occupied, 1, constant_values=True)  # a way round the map
        regions = ndimage.label(free)[0]
        cells = np.clip(self.cells(np.reshape(robots, (-1, 2))) + 1, 0, np.array(free.shape) - 1)
        theirs = np.unique(regions[tuple(cells.T)])
        if not theirs.any():
            return self
        return self._replace(occupied=~np.isin(regions, theirs[theirs > 0])[1:-1, 1:-1])

    def clearance(self) -> Array:
        """Distance of each free cell's middle from the nearest occupied cell's middle, less half its diagonal, m."""
        # It is at most the distance from the cell. Where nothing is occupied, it is infinite.
        from scipy import ndimage

        if not self.occupied.any():
            return np.full(self.occupied.shape, math.inf)
        return (ndimage.distance_transform_edt(~self.occupied) - math.sqrt(0.5)) * self.frame.cell_m
