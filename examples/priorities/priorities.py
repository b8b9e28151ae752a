"""A supervisor that switches task priorities, as a Drake diagram: by a rule, or by a table that was learnt.

    python priorities.py            # fixed order, rule and table on two scenes, and on 60 maps
    python priorities.py --train    # learns the table again, and writes table.json

One UGV has two tasks below avoidance: `track`, (6), goes to the target, and `round_left` or `round_right` goes along
the boundary of what is in the way. A `Supervisor` says at each sample which of them comes first; `Behaviours` composes
them as (5): the second one acts in the null space of the first. Avoidance stays on top whatever the order, so that no
supervisor, good or bad, can bring the UGV nearer than the safe distance.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, DiscreteValues, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry.outline import balls
from airground_drake.model.law.avoidance import Avoidance, limit_speed
from airground_drake.model.law.task import Task
from airground_drake.model.law.tasks import PositionTask
from airground_drake.sim.blocks.plant import first_order_plant

Array = NDArray[np.float64]

TABLE = Path(__file__).with_name("table.json")
ORDERS = ("track", "round_left", "round_right")
"""Which task comes first."""
PERIOD_S, DECIDE_S, LONGEST_S = 0.05, 0.5, 40.0
DISTANCE_M, SPEED_M_S, NEAR_M, ARRIVED_M = 2.0, 1.0, 0.15, 0.2
AVOIDANCE = Avoidance(gain=2.0, period=PERIOD_S, sensing_range=6.0)
SECTORS = 8


class Scene(NamedTuple):
    """Obstacles (m, 3) and the target (3,), m; the UGV starts at the origin."""

    obstacles: Array
    target: Array


class Round(Task):
    """Move along a boundary: sigma is the path along the tangent, with the wanted rate `speed`; J is one row."""

    def __init__(self, tangent: Array, speed: float) -> None:
        """Unit vector (3,) and speed, m/s."""
        super().__init__(0.0)
        self.tangent, self.speed = tangent, speed

    def value(self, position: Array) -> Array:
        return np.zeros((len(position), 1))

    def jacobian(self, position: Array) -> Array:
        return np.broadcast_to(self.tangent, (len(position), 1, 3))

    def desired(self) -> tuple[Array, Array]:
        return np.zeros(1), np.full(1, self.speed)


def null_space(jacobian: Array) -> Array:
    """Projector I - J^+ J of (5) onto the null space of a Jacobian (m, 3): (3, 3)."""
    return np.eye(3) - np.linalg.pinv(jacobian) @ jacobian


def normals(scene: Scene, position: Array) -> Array:
    """Unit vectors away from the obstacles whose safe circle the UGV touches, (k, 3)."""
    offset = position - scene.obstacles
    distance = np.linalg.norm(offset, axis=1)
    near = distance < DISTANCE_M + NEAR_M
    return offset[near] / distance[near, None]


def command(scene: Scene, position: Array, order: int) -> Array:
    """Velocity (3,), m/s: the first task, the second in its null space as in (5), and avoidance on top."""
    away, row, limit = normals(scene, position), position[None], np.array([SPEED_M_S])
    wanted = limit_speed(PositionTask(scene.target, np.zeros(3), 1.0).velocity(row), limit)
    if order and len(away):
        turn = 1.0 if order == 1 else -1.0
        along = turn * np.column_stack([away[:, 1], -away[:, 0], np.zeros(len(away))])
        out_of_a_corner = along[np.argmax((along @ away.T).min(axis=1))]
        first = Round(out_of_a_corner, SPEED_M_S)
        wanted = first.velocity(row) + wanted @ null_space(first.jacobian(row)[0])
    around = Neighbours.at_rest(balls(scene.obstacles, gap=DISTANCE_M), limit)
    return AVOIDANCE.command(wanted, row, around)[0]


def state(scene: Scene, position: Array, order: int) -> int:
    """What a supervisor sees, as one number: where the target is from the boundary, and the order in force."""
    away = normals(scene, position)
    if not len(away):
        return order
    outward, ahead = away.sum(axis=0), scene.target - position
    angle = np.arctan2(outward[0] * ahead[1] - outward[1] * ahead[0], outward @ ahead)
    return len(ORDERS) * (1 + int((angle + np.pi) / (2.0 * np.pi) * SECTORS) % SECTORS) + order


STATES = len(ORDERS) * (1 + SECTORS)


def fixed(seen: int) -> int:
    """Tracking first, always: the order of the paper."""
    return 0


def rule(seen: int) -> int:
    """Go round, to the left unless already to the right, while an obstacle hides the target."""
    sector, order = divmod(seen, len(ORDERS))
    behind = sector - 1 not in (3, 4)  # the two sectors of the outward direction
    return (order or 1) if sector and behind else 0


def learnt(table: Array) -> Callable[[int], int]:
    """By the table (STATES, 3): the order of the greatest value."""
    return lambda seen: int(np.argmax(table[seen]))


class Supervisor(LeafSystem):
    """In `position` (3), m; out `order` (1), held: which task comes first. Rate: DECIDE_S."""

    def __init__(self, scene: Scene, decide: Callable[[int], int]) -> None:
        """`decide` maps an observed `state` to an index of ORDERS."""
        super().__init__()
        self._scene, self._decide = scene, decide
        self._position = self.DeclareVectorInputPort("position", 3)
        self.DeclareStateOutputPort("order", self.DeclareDiscreteState(1))
        self.DeclarePeriodicDiscreteUpdateEvent(DECIDE_S, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        order = int(context.get_discrete_state(0).GetAtIndex(0))
        discrete.set_value(0, [self._decide(state(self._scene, self._position.Eval(context), order))])


class Behaviours(LeafSystem):
    """In `position` (3), m, and `order` (1); out `command` (3), m/s, held. Rate: PERIOD_S."""

    def __init__(self, scene: Scene) -> None:
        """Of one UGV in a scene."""
        super().__init__()
        self._scene = scene
        self._position = self.DeclareVectorInputPort("position", 3)
        self._order = self.DeclareVectorInputPort("order", 1)
        self.DeclareStateOutputPort("command", self.DeclareDiscreteState(3))
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD_S, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        order = int(self._order.Eval(context)[0])
        discrete.set_value(0, command(self._scene, self._position.Eval(context), order))


def diagram(scene: Scene, decide: Callable[[int], int]) -> Diagram:
    """Supervisor -> behaviours -> plant, and the position back to both; exports `position`."""
    builder = DiagramBuilder()
    supervisor = builder.AddNamedSystem("supervisor", Supervisor(scene, decide))
    behaviours = builder.AddNamedSystem("behaviours", Behaviours(scene))
    plant = builder.AddNamedSystem("ugv", first_order_plant("ugv", np.zeros(3)))
    builder.Connect(supervisor.GetOutputPort("order"), behaviours.GetInputPort("order"))
    builder.Connect(behaviours.GetOutputPort("command"), plant.get_input_port())
    for system in (supervisor, behaviours):
        builder.Connect(plant.get_output_port(), system.GetInputPort("position"))
    builder.ExportOutput(plant.get_output_port(), "position")
    LogVectorOutput(plant.get_output_port(), builder, PERIOD_S).set_name("log")
    return builder.Build()


class Result(NamedTuple):
    """When the UGV arrived, s (None: it did not), and its least distance to an obstacle, m."""

    arrived_s: float | None
    nearest_m: float


def run(scene: Scene, decide: Callable[[int], int]) -> Result:
    """Simulate the diagram of a scene for LONGEST_S."""
    built = diagram(scene, decide)
    simulator = Simulator(built)
    simulator.AdvanceTo(LONGEST_S)
    log = built.GetSubsystemByName("log").FindLog(simulator.get_context())
    positions = log.data().T
    there = np.linalg.norm(positions - scene.target, axis=1) < ARRIVED_M
    arrived = float(log.sample_times()[np.argmax(there)]) if there.any() else None
    return Result(arrived, float(np.linalg.norm(positions[:, None] - scene.obstacles, axis=2).min()))


def drawn(rng: np.random.Generator) -> Scene:
    """One to four obstacles near the straight way, none within the safe distance of start or target."""
    target, obstacles = np.array([12.0, 0.0, 0.0]), []
    while len(obstacles) < 1 or (len(obstacles) < 4 and rng.random() < 0.7):
        place = np.array([rng.uniform(2.0, 10.0), rng.uniform(-2.0, 2.0), 0.0])
        if min(np.linalg.norm(place), np.linalg.norm(place - target)) > DISTANCE_M + NEAR_M:
            obstacles.append(place)
    return Scene(np.array(obstacles), target)


def train(episodes: int = 1500, seed: int = 1) -> Array:
    """Q-learning of the table: -1 for each decision, and 0 from the target on; random starts of the order."""
    rng, values = np.random.default_rng(seed), np.full((STATES, len(ORDERS)), -10.0)
    for episode in range(episodes):
        scene, position, order = drawn(rng), np.zeros(3), 0
        seen, greed = state(scene, position, order), episode / episodes
        for _ in range(int(LONGEST_S / DECIDE_S)):
            order = int(np.argmax(values[seen])) if rng.random() < greed else int(rng.integers(len(ORDERS)))
            for _ in range(round(DECIDE_S / PERIOD_S)):
                position = position + PERIOD_S * command(scene, position, order)
            done = np.linalg.norm(position - scene.target) < ARRIVED_M
            after = state(scene, position, order)
            worth = 0.0 if done else values[after].max()
            values[seen, order] += 0.1 * (-1.0 + worth - values[seen, order])
            seen = after
            if done:
                break
    return values.round(3)


SCENES = {
    "a corner between two": Scene(np.array([[4.0, 1.5, 0.0], [4.0, -1.5, 0.0]]), np.array([12.0, 0.0, 0.0])),
    "a wall of three": Scene(
        np.array([[4.0, 3.0, 0.0], [4.0, 0.0, 0.0], [4.0, -3.0, 0.0]]), np.array([12.0, 0.0, 0.0])
    ),
}


def supervisors() -> dict[str, Callable[[int], int]]:
    """By name."""
    return {"fixed order": fixed, "rule": rule, "table": learnt(np.array(json.loads(TABLE.read_text())))}


def main(maps: int = 60) -> None:
    """Print when the UGV arrives, scene by scene, and how often on maps that the table has not been learnt on."""
    for title, scene in SCENES.items():
        for name, decide in supervisors().items():
            result = run(scene, decide)
            arrived = "does not arrive" if result.arrived_s is None else f"arrives at {result.arrived_s:.2f} s"
            print(f"{title}, {name}: {arrived}, least distance {result.nearest_m:.6f} m")
    for name, decide in supervisors().items():
        rng = np.random.default_rng(1000)
        results = [run(drawn(rng), decide) for _ in range(maps)]
        times = [each.arrived_s for each in results if each.arrived_s is not None]
        nearest = min(each.nearest_m for each in results)
        print(f"{maps} maps, {name}: {len(times)} arrive, median {np.median(times):.2f} s, least {nearest:.6f} m")


if __name__ == "__main__":
    if "--train" in sys.argv:
        TABLE.write_text(json.dumps(train().tolist()) + "\n")
    main()
