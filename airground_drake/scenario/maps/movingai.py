"""Maps and scenarios of MovingAI's benchmarks, https://movingai.com/benchmarks."""

from typing import NamedTuple

import numpy as np

from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.scenario.maps.rectangles import MOST_CELLS, Cells

# Whether a cell with this character is in the way: out of bounds, trees and water are.
TERRAIN = {**dict.fromkeys(".GS", False), **dict.fromkeys("@OTW", True)}
HEADER = ("type", "height", "width", "map")


class Agent(NamedTuple):
    """One line of a scenario: cells (column, row) of start and goal, and the line's number in the file."""

    # In the file, rows are counted from the top; here, from the bottom.

    start: tuple[int, int]
    goal: tuple[int, int]
    line: int


def cells(text: str, source: str) -> Cells:
    """Which cells of a `.map` file are in the way, (rows, columns), the lowest row first."""
    lines = text.splitlines()
    sizes = {}
    for number, (key, line) in enumerate(zip(HEADER, [*lines, "", "", "", ""], strict=False), 1):
        name, _, value = line.strip().partition(" ")
        if name != key:
            raise ScenarioError(f"{source}:{number}", key, Fault("missing"), "wanted: a map of MovingAI")
        if key in ("height", "width"):
            sizes[key] = _whole(value, f"{source}:{number}", key, 1, MOST_CELLS)
    rows, (height, width) = lines[len(HEADER) :], sizes.values()
    if height * width > MOST_CELLS:
        fault = Fault(f"{height} x {width} cells")
        raise ScenarioError(f"{source}:2", "height", fault, f"at most {MOST_CELLS} are allowed")
    if len(rows) < height or any(map(str.strip, rows[height:])):
        where = f"{source}:{min(len(rows), height) + len(HEADER)}"
        fault = Fault(f"{len(rows)} rows")
        raise ScenarioError(where, "map", fault, f"as many as height = {height} are wanted")
    rows = [row.rstrip() for row in rows[:height]]
    for number, row in enumerate(rows, len(HEADER) + 1):
        if len(row) != width:
            fault = Fault(f"{len(row)} characters")
            raise ScenarioError(f"{source}:{number}", "map", fault, f"as many as width = {width} are wanted")
        if strange := set(row) - set(TERRAIN):
            raise ScenarioError(f"{source}:{number}", "map", min(strange), f"allowed: {' '.join(TERRAIN)}")
    return np.array([[TERRAIN[letter] for letter in row] for row in rows[height - 1 :: -1]], bool)


def agents(text: str, source: str, in_the_way: Cells) -> list[Agent]:
    """The agents of a `.scen` file, on the map whose cells are given."""
    height, width = in_the_way.shape
    first, *lines = text.splitlines() or [""]
    if first.split()[:1] != ["version"]:
        raise ScenarioError(f"{source}:1", "version", Fault("missing"), "wanted: a scenario of MovingAI")
    placed = []
    for number, line in enumerate(lines, 2):
        where = f"{source}:{number}"
        parts = line.split("\t") if "\t" in line else line.split()
        if not line.strip():
            continue
        if len(parts) != 9:
            allowed = "wanted: bucket, map, width, height, x and y of start and goal, length of the way"
            raise ScenarioError(where, "", Fault(f"{len(parts)} columns"), allowed)
        for key, value, size in (("width", parts[2], width), ("height", parts[3], height)):
            _whole(value, where, key, size, size)
        x, y, to_x, to_y = (
            _whole(value, where, key, 0, size - 1)
            for key, value, size in zip(
                ("start x", "start y", "goal x", "goal y"), parts[4:8], (width, height) * 2, strict=True
            )
        )
        start, goal = (x, height - 1 - y), (to_x, height - 1 - to_y)
        for key, (column, row) in (("start", start), ("goal", goal)):
            if in_the_way[row, column]:
                raise ScenarioError(where, key, Fault("in the way"), "wanted: a free cell of the map")
        placed.append(Agent(start, goal, number))
    return placed


def map_name(text: str) -> str:
    """The name of the map in the first line of a `.scen` file that names one; ''."""
    return next((parts[1] for parts in map(str.split, text.splitlines()[1:]) if len(parts) == 9), "")


def _whole(text: str, source: str, key: str, least: int, most: int) -> int:
    try:
        if least <= (number := int(text)) <= most:
            return number
    except ValueError:
        pass
    span = str(least) if least == most else f"a whole number from {least} to {most}"
    raise ScenarioError(source, key, text, f"wanted: {span}")
