"""Maps in the files of ROS's `map_server`: a YAML file and the image that it names."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

from pydantic import BeforeValidator, ConfigDict

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.base.limits import MAX_RECTANGLES
from airground_drake.base.values import Chance, Real, Words, as_float, wanted
from airground_drake.scenario.document import MAX_BYTES, parsed
from airground_drake.scenario.filled import filled
from airground_drake.scenario.maps.grid import Frame, Grid
from airground_drake.scenario.maps.images import Occupancy, occupancy
from airground_drake.scenario.maps.rectangles import covering
from airground_drake.scenario.schema import Map, MapCells

MOST_BYTES = 64_000_000  # most bytes of an image


@dataclass(frozen=True, kw_only=True)
class MapServer:
    """The keys of a map_server's file; other keys are ignored."""

    __pydantic_config__: ClassVar = ConfigDict(extra="ignore")

    # Path of the image, from the file's folder.
    image: Annotated[Words, wanted("the path of a PGM, PPM, PNG or BMP file", min_length=1)]
    resolution: Annotated[
        float, wanted("the side of a cell, 0.001 to 1000 m", strict=True, ge=1e-3, le=1e3), BeforeValidator(as_float)
    ]
    # Outer corner of the cell at the lower left, x and y in m; heading of the image, rad.
    origin: Annotated[list[Real], wanted("3 numbers: [x, y, yaw], m and rad", min_length=3, max_length=3)]
    occupied_thresh: Chance  # probability above which a cell is occupied
    free_thresh: Chance  # probability below which it is free
    negate: Annotated[int, wanted("0 or 1", ge=0, le=1)]  # 1 if white is occupied, not black
    mode: Annotated[str, BeforeValidator(lambda given: str(given).lower()), wanted("trinary", pattern="^trinary$")] = (
        "trinary"
    )


_contents: dict[str, bytes] = {}  # contents of the files of maps, by SHA-256: reports copy them


class MapFile(NamedTuple):
    """A map_server's map."""

    cells: Occupancy  # which are occupied, which unknown, (rows, columns), the lowest row first
    frame: Frame  # where they are
    contents: dict[Path, bytes]  # content of the YAML file and of its image, by path

    def grid(self, *, unknown: bool = True) -> Grid:
        """The map with the unknown cells occupied, or free if `unknown` is false."""
        occupied = self.cells.occupied | self.cells.unknown if unknown else self.cells.occupied
        return Grid(occupied, self.frame)


def read(path: Path, where: str = "", *, copied: bool = False) -> MapFile:
    data = _content(path, MAX_BYTES, where or str(path), "map.file" if where else "", "the YAML file of a map")
    try:
        document = parsed(data.decode("utf-8-sig"), str(path))
    except UnicodeDecodeError:
        raise ScenarioError(str(path), "", Fault("not UTF-8 text"), "wanted: the YAML file of a map") from None
    about: MapServer = filled(MapServer, document)
    if about.free_thresh > about.occupied_thresh:
        allowed = f"at most occupied_thresh = {about.occupied_thresh:g}"
        raise ScenarioError(document.where("free_thresh"), "free_thresh", about.free_thresh, allowed)
    image = path.parent / (Path(about.image).name if copied else about.image)
    content = _content(image, MOST_BYTES, document.where("image"), "image", "a PGM, PPM, PNG or BMP file")
    try:
        cells = occupancy(
            content, occupied_above=about.occupied_thresh, free_below=about.free_thresh, negate=bool(about.negate)
        )
    except ValueError as error:
        fault = Fault(f"{about.image} is {error}")
        raise ScenarioError(document.where("image"), "image", fault, "wanted: the image of a map") from None
    x, y, heading = about.origin
    if abs(heading) > math.tau:
        allowed = f"from -{math.tau:.6g} to {math.tau:.6g} rad"
        raise ScenarioError(document.where("origin", "2"), "origin.2", heading, allowed)
    return MapFile(cells, Frame(about.resolution, (x, y, heading)), {path: data, image: content})


def cells(given: Map, folder: Path, starts: Sequence[Sequence[float]], where: str, *, copied: bool = False) -> MapCells:
    # starts: of all robots, [x, y, ...], m; what none of them can reach is filled.
    chart = read(folder / given.file, where, copied=copied)
    grid = chart.grid(unknown=given.unknown == "occupied")
    starts_m = [[*start[:2]] for start in starts]
    filled = grid.filled(starts_m)
    rectangles = covering(filled.occupied)
    if len(rectangles) > MAX_RECTANGLES:
        fault = Fault(f"{given.file} needs {len(rectangles)} rectangles")
        raise ScenarioError(where, "map.file", fault, f"at most {MAX_RECTANGLES} are allowed: remove noise, or crop it")
    digests = {path.name: files.sha256(content) for path, content in chart.contents.items()}
    _contents.update(zip(digests.values(), chart.contents.values(), strict=True))
    rows, columns = grid.occupied.shape
    return MapCells(
        file=given.file, unknown=given.unknown, sha256=digests, starts_m=starts_m,
        cell_m=grid.frame.cell_m, origin=[*grid.frame.origin],
        rows=rows, columns=columns,
        occupied=int(chart.cells.occupied.sum()), unsure=int(chart.cells.unknown.sum()),
        unreached=int((filled.occupied & ~grid.occupied).sum()),
        rectangles=rectangles.tolist(),
    )  # fmt: skip


def content(sha256: str) -> bytes | None:
    """The content of a file of a map that this process has read, by its SHA-256."""
    return _contents.get(sha256)


def _content(path: Path, most: int, source: str, key: str, what: str) -> bytes:
    try:
        return files.read_bytes(path, most, links=True)
    except (OSError, ValueError) as error:  # ValueError: a null character
        why = getattr(error, "strerror", None) or str(error)
        raise ScenarioError(source, key, Fault(f"{path} cannot be read ({why})"), f"wanted: {what}") from None
