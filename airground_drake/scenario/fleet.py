"""Scenarios of any size: UGVs that cross a field of obstacles, drawn from a seed.

Each start, target and obstacle lies at a random place near the middle of its own cell of a square grid, so that a UGV
can pass between any two. Every UGV goes straight to the second cell ahead; some UGVs have an obstacle in their way.
"""

import math
import random

CELL_M = 5.0
# Largest offset from the middle of a cell along either axis, m. Neighbours are over two safe distances apart.
OFF_M = 1.4
BLOCKED = 3  # one in so many UGVs has an obstacle in the middle of its way
ROOMY = 1.5  # number of cells per occupied cell

SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1))

Point = tuple[float, float]

HEAD = """\
name: "{name}"
title: "{ugvs} UGVs among {obstacles} obstacles"
description: >-
  {ugvs} UGVs cross a field with {obstacles} obstacles, straight ahead. Those that have one in their way stop before
  it; the UAV shows them the way round (run d).
seed: {seed}
duration_s: 20.0

uav:
  start_m: [0.0, 0.0, 4.0]
  target_m: [{over}, 4.0]
  altitude_m: 4.0

safe_distance: {{obstacle_m: 1.0, ugv_m: 1.0, air_ground_m: 1.0}}

control: {{period_s: 0.05}}

decision:
  threshold: {{rule: fixed, zeta_m: 1.5}}
  release_m: 1.0
  noise_m_sqrt_s: 0.004
  noise_period_s: 0.05

intervention:
  policies: [{{name: detour, parameters: {{speed_m_s: 1.6}}}}]

gatekeeper: {{period_s: 0.2}}

runs:
  d:
    method: d
    expected: {{{expected}}}
"""


def fleet(ugvs: int, obstacles: int, seed: int = 1, name: str = "fleet") -> str:
    """The text of a scenario file, without a comment at its head."""
    side = math.ceil(math.sqrt(ROOMY * (3 * ugvs + obstacles)))
    while True:
        ways, rocks = _field(random.Random(seed), ugvs, obstacles, side)
        if len(ways) == ugvs and len(rocks) == obstacles:
            break
        side += 1
    middle = [sum(target[axis] for _, target in ways) / ugvs for axis in (0, 1)]
    expected = "LIVE-GOAL: exercised"
    if min(ugvs // BLOCKED, obstacles):
        expected = f"interventions: 1, messages: 2, THR-TRIG: exercised, LIVE-HYP: exercised, {expected}"
    over = ", ".join(f"{x:.2f}" for x in middle)
    head = HEAD.format(name=name, ugvs=ugvs, obstacles=obstacles, seed=seed, over=over, expected=expected)
    rows = [_ugv(number, *way) for number, way in enumerate(ways, 1)]
    rows = ["", "ugvs:", *rows, "", "obstacles:" if obstacles else "obstacles: {}"]
    rows += [f"  o{number}: {{position_m: {_place(point)}}}" for number, point in enumerate(rocks, 1)]
    return head + "\n".join(rows) + "\n"


def _field(draw: random.Random, ugvs: int, obstacles: int, side: int) -> tuple[list[tuple[Point, Point]], list[Point]]:
    """Ways of UGVs (start and target) and places of obstacles, m, as many as fit into a square of cells."""
    free = {(column, row) for column in range(side) for row in range(side)}
    cells = draw.sample(sorted(free), len(free))
    ways, rocks = list[tuple[Point, Point]](), list[Point]()
    for column, row in cells:
        for i, j in draw.sample(SIDES, len(SIDES)):
            taken = {(column + k * i, row + k * j) for k in range(3)}
            if len(ways) < ugvs and free >= taken:
                free -= taken
                start, target = (_off(draw, column + k * i, row + k * j, side) for k in (0, 2))
                ways.append((start, target))
                if not len(ways) % BLOCKED and len(rocks) < obstacles:
                    rocks.append((0.5 * (start[0] + target[0]), 0.5 * (start[1] + target[1])))
    rocks += [_off(draw, *cell, side) for cell in cells if cell in free][: obstacles - len(rocks)]
    return ways, rocks


def _off(draw: random.Random, column: int, row: int, side: int) -> Point:
    """A place in a cell, m, in a frame whose origin is the middle of the field."""
    x, y = (CELL_M * (at - 0.5 * (side - 1)) + draw.uniform(-OFF_M, OFF_M) for at in (column, row))
    return round(x, 1), round(y, 1)


def _ugv(number: int, start: Point, target: Point) -> str:
    a, b = _place(start), _place(target)
    return (
        f"  ugv{number}:\n    start_m: {a}\n    target_m: {b}\n"
        f"    preset: {{waypoints_m: [{a}, {b}], speed_m_s: 1.0}}\n    max_speed_m_s: 2.0"
    )


def _place(point: Point) -> str:
    return f"[{point[0]:.2f}, {point[1]:.2f}, 0.0]"
