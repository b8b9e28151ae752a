"""Robots that turn and lag under hostile commands: how much of the distance budget an attack can use up.

`python benchmarks/plants.py`: for each plant, periods of the running law in which the task below it is hostile: it
circles the obstacle, goes to and fro, wanders, or takes the command, of several, that brings the body nearest. It
prints what the law keeps beyond the distance promised, how much of that the worst body used up, and whether a run in
Drake is the same as the law and the plant step by step, bit by bit. The exit code is 1 if a promise is broken.
"""

import argparse
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.registry import method_of
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.geometry import convex, outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.ackermann import Ackermann
from airground_drake.model.plants.delay import Delay
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.plants.lag import Lag
from airground_drake.model.plants.plant import Plant
from airground_drake.model.plants.steering import steer
from airground_drake.model.plants.unicycle import Unicycle
from airground_drake.scenario.load import load
from airground_drake.scenario.world import make_world
from airground_drake.sim.components import make_law
from airground_drake.sim.simulation import simulate

H, GAIN, SPEED, SAFE_M = 0.05, 3.0, 1.0, 0.6
PERIODS_A_RUN = 100
PARTS = np.array([0.25, 0.5, 0.75, 1.0])
"""Shares of a period at which bodies are looked at."""
OBSTACLES = {
    "a point": outline.balls(np.zeros(3), gap=SAFE_M),
    "a wall": outline.stacked([outline.prism([[0.0, -50.0], [0.0, 50.0]], gap=SAFE_M)]),
}
PLANTS: dict[str, Plant] = {
    "first order": FirstOrder(),
    "unicycle, l = 0.35 m": Unicycle(0.35, H),
    "unicycle, 0.35 m, never backwards": Unicycle(0.35, H, backwards=False),
    "unicycle, l = 0.1 m, 2 rad/s": Unicycle(0.1, H, max_turn_rad_s=2.0),
    "unicycle, l = 0.1 m, wheels": Unicycle(0.1, H, wheel_base_m=0.3, max_wheel_m_s=0.8),
    "car, l = 0.35 m, R = 0.5 m": Ackermann(0.35, H, backwards=False, radius_m=0.5),
    "lag 0.1 s": Lag(0.1),
    "lag 0.3 s": Lag(0.3),
    "delay 0.15 s": Delay(3, H),
    "delay 0.15 s and lag 0.1 s": Delay(3, H, Lag(0.1)),
}
DRIVE = "{kind: unicycle, hand_point_m: 0.2, max_turn_rad_s: 2.0, wheel_base_m: 0.4, max_wheel_speed_m_s: 1.2}"
IN_DRAKE = {
    "unicycle": DRIVE,
    "unicycle that never drives backwards": DRIVE.replace("}", ", backwards: false}"),
    "car": "{kind: ackermann, hand_point_m: 0.2, wheelbase_m: 0.3, max_steering_rad: 0.5}",
    "lag": "{kind: lag, time_constant_s: 0.2}",
    "delay and lag": "[{kind: delay, delay_s: 0.125}, {kind: lag, time_constant_s: 0.2}]",
}


class Worst(NamedTuple):
    """What the law keeps beyond the promise, how much of it the worst body used up, and the least distance, m."""

    more_m: float
    used_m: float
    least_m: float


def attack(plant: Plant, rows: Array, periods: int, seed: int = 1) -> Worst:
    """The worst of some hostile periods beside an obstacle at rest, given by its outlines (1, W)."""
    rng, law = np.random.default_rng(seed), UgvLaw(Avoidance(GAIN, H), 1.0, 1.0, False)
    body = Body("robot", "ugv", np.zeros(3), plant=plant, max_speed_m_s=SPEED)
    world = World((body, Body("obstacle", "obstacle", np.zeros(3), rows)), {}, GAIN)
    near = world.around(slice(0, 1))
    keeps, least = float(near.distance[0, 0]), np.inf
    for run in range(periods // PERIODS_A_RUN):
        base, memory, mode = np.array([keeps + rng.uniform(0.0, 0.3) * (run % 2), 0.0, 0.0]), plant.memory(), run % 4
        side = rng.choice([-1.0, 1.0])
        if isinstance(plant, Unicycle):
            memory = rng.uniform(-np.pi, np.pi, 1)
            while _nearest(plant, rows, base, memory, np.zeros(3)) < SAFE_M:
                memory = rng.uniform(-np.pi, np.pi, 1)
        for _ in range(PERIODS_A_RUN):
            side = -side if mode == 1 else side
            found = []
            for wish in _wishes(base, side, mode, rng):
                steered = (memory, plant.steering[None]) if isinstance(plant, Unicycle) else None
                command = law.velocity(base[None], near, base[None], wish[None], [None], steered)[0]
                if isinstance(plant, Unicycle):
                    steer(command, float(memory[0]), plant.steering, H)
                found.append((_nearest(plant, rows, base, memory, command), command))
            nearest, command = min(found, key=lambda each: each[0])
            least = min(least, nearest)
            memory, base = plant.remembered(memory, command, H), base + H * command
    return Worst(keeps - SAFE_M, keeps - least, least)


def _wishes(base: Array, side: float, mode: int, rng: np.random.Generator) -> Iterator[Array]:
    """Velocities that a hostile task asks for, (3,), m/s."""
    inwards = -base / np.linalg.norm(base)
    aside = side * np.array([-inwards[1], inwards[0], 0.0])
    angles = {0: [1.45], 1: [1.2], 2: [rng.uniform(-np.pi, np.pi)], 3: np.linspace(-np.pi, np.pi, 9)[1:]}[mode]
    for angle in angles:
        yield 2.0 * SPEED * (np.cos(angle) * inwards + np.sin(angle) * aside)


def _nearest(plant: Plant, rows: Array, base: Array, memory: Array, command: Array) -> float:
    """Least distance of the body from the obstacle at some instants of a period, m."""
    places = []
    for part in PARTS * H:
        here = base + part * command
        places.append(plant.at(memory, here, command, float(part))[:3] if plant.signals else here)
    return min(float(convex.distances(rows, place, True)[0]) for place in places)


def same_in_drake(plant: str, periods: int = 100) -> tuple[int, int]:
    """How many of some periods in Drake agree bit by bit with law and plant, and how many were compared.

    The period is a binary fraction, so that Drake's times are exact, and the noise does not isolate events.
    """
    given = [
        f"ugvs.ugv1.plant={plant}", "control.period_s=0.03125", "intervention.period_s=0.0625", "duration_s=3.5",
        "gatekeeper.period_s=0.0625", "gatekeeper.horizon_s=3.125", "gatekeeper.stages=50",
        "ugvs.ugv1.max_speed_m_s=1.4",
        "decision.noise_period_s=0.03125", "uav.altitude_m=3.0", "uav.start_m=[0, 0, 3]", "uav.target_m=[10, 0, 3]",
        "ugvs.ugv1.start_m=[2.3, 0, 0]", "ugvs.ugv1.preset.waypoints_m=[[2.5, 0.4, 0], [10, 0, 0]]",
    ]  # fmt: skip
    scenario = load("minimal", given)
    trace = simulate(scenario, "a")
    world, law = make_world(scenario), make_law(scenario, method_of("a"))
    near, period = world.around(world.select("ugv")), scenario.control.period_s
    robot = world.bodies[0]
    assert robot.plant is not None
    rows, same = trace.sample_rows[:periods], 0
    memory = robot.plant.memory()
    for begin, end in zip(rows, trace.sample_rows[1 : periods + 1], strict=True):
        k = int(np.searchsorted(rows, begin))
        positions = np.array([trace.position(name)[begin] for name in trace.robots])
        reference, rate = trace.reference("ugv1")[k], trace.reference_rate("ugv1")[k]
        steered = (memory, robot.plant.steering[None]) if isinstance(robot.plant, Unicycle) else None
        command = law.velocity(positions, near, reference[None], rate[None], [None], steered)[0]
        if isinstance(robot.plant, Unicycle):
            steer(command, float(memory[0]), robot.plant.steering, period)
        led = positions[0] + period * command
        due = robot.plant.at(memory, led, command, period)
        memory = robot.plant.remembered(memory, command, period)
        found = np.array([trace.column(f"ugv1.{name}")[end] for name in robot.plant.signals])
        same += (
            (command == trace.chosen("ugv1")[k]).all()
            and (led == trace.position("ugv1")[end]).all()
            and (due == found).all()
        )
    return int(same), len(rows)


def main() -> int:
    """Attack every plant beside every obstacle."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-n", "--periods", type=int, default=100_000, help="of each attack (default: 100,000)")
    periods, broken = parser.parse_args().periods, 0
    print(f"d = {SAFE_M} m, V = {SPEED} m/s, A = {GAIN} 1/s, h = {H} s, {periods} periods each")
    print("plant                              beside    law - d, m   used, m    of it   least, m")
    for name, plant in PLANTS.items():
        for beside, rows in OBSTACLES.items():
            worst = attack(plant, rows, periods)
            kept = worst.least_m >= SAFE_M - 1e-9
            broken += not kept
            share = f"{100.0 * worst.used_m / worst.more_m:4.0f} %" if worst.more_m else "     -"
            print(
                f"{name:34s} {beside:8s} {worst.more_m:11.5f} {worst.used_m:9.5f} {share} {worst.least_m:10.5f}"
                f"{'' if kept else '  BROKEN'}",
                flush=True,
            )
    for name, plant in IN_DRAKE.items():
        same, count = same_in_drake(plant)
        broken += same < count
        print(f"in Drake, {name}: {same} of {count} periods are those of law and plant, bit by bit")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
