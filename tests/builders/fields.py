"""Fields of cylinders within walls, as Gazebo worlds in the form of those of the BARN challenge.

A cellular automaton makes them, as in Perille, Truong, Xiao, Stone: Benchmarking metric ground navigation (2020): cells
are filled at random; then a cell with at least five filled neighbours is filled, and one with at most one is emptied.
No world of theirs is copied. The shipped scenario `barn` is the field of seed `SHIPPED`:

    python tests/builders/fields.py > field.world && airground import barn field.world
"""

import sys

import numpy as np
from scipy import ndimage

CELL_M = 0.15
RADIUS_M = 0.075
SHAPE = (40, 30)
"""Rows and columns of the field; its walls are 4.5 m apart."""
CORNER_M = (-4.5, 5.0)
"""Its lowest corner. The robot goes from (-2.25, 3) to (-2.25, 13)."""
ROUNDS = 3
SHIPPED = 21

CYLINDER = f"<cylinder><radius>{RADIUS_M}</radius><length>1</length></cylinder>"
MODEL = (
    '<model name="{name}"><pose>{x} {y} 0.5 0 0 0</pose><link name="link"><collision name="collision"><geometry>{shape}'
    "</geometry></collision></link></model>"
)
STATE = '<model name="{name}"><pose>{x} {y} 0.5 0 0 0</pose></model>'


def world(seed: int, fill: float = 0.25) -> str:
    filled = np.random.default_rng(seed).random(SHAPE) < fill
    for _ in range(ROUNDS):
        neighbours = ndimage.convolve(filled.astype(int), np.ones((3, 3), int), mode="constant") - filled
        filled = (filled | (neighbours >= 5)) & (neighbours > 1)
    models, states = [], []
    for number, (row, column) in enumerate(np.argwhere(filled).tolist()):
        name = f"unit_cylinder_{number}"
        models.append(MODEL.format(name=name, x=0, y=0, shape=CYLINDER))  # the state moves it
        x, y = CORNER_M[0] + (column + 0.5) * CELL_M, CORNER_M[1] + (row + 0.5) * CELL_M
        states.append(STATE.format(name=name, x=round(x, 3), y=round(y, 3)))
    long, wide = SHAPE[0] * CELL_M + 4.0, SHAPE[1] * CELL_M
    low, across = CORNER_M[1] - 2.5, CORNER_M[0] + 0.5 * wide
    walls = [("wall_west", CORNER_M[0], low + 0.5 * long, 0.1, long), ("wall_south", across, low, wide, 0.1)]
    walls += [("wall_east", CORNER_M[0] + wide, low + 0.5 * long, 0.1, long)]
    for name, x, y, *size in walls:
        box = f"<box><size>{size[0]} {size[1]} 1</size></box>"
        models.append(MODEL.format(name=name, x=round(x, 3), y=round(y, 3), shape=box))
    inner = "\n".join([*models, "<state world_name='default'>", *states, "</state>"])
    return f'<?xml version="1.0"?>\n<sdf version="1.6">\n<world name="default">\n{inner}\n</world>\n</sdf>\n'


if __name__ == "__main__":
    sys.stdout.write(world(int(sys.argv[1]) if len(sys.argv) > 1 else SHIPPED))
