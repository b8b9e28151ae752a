"""The controllers of a built diagram of method (d), driven through their ports, against what the scenario demands.

Every robot is put beside every obstacle and every other robot, at distances where the inequality of that pair binds;
all else is far away. Presets, proposals and the velocities that the UAV is told of drive it to what it must avoid. Its
command must be the closest velocity that the scenario allows. So what is missing, too weak, too strong or executed
without leave shows as another command.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from hypotheses.demands import Demands, limited, unit
from pydrake.common.value import Value

from airground_drake.base.arrays import Array
from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.diagram import build_model
from airground_drake.uav.policy import Proposal

ANSWERS = {"none": 1.0, "accepted": 1.0, "refused": -1.0, "silent": 0.0, "answered another": 1.0}
"""What may be the matter with a proposal, and the answer that there is."""
TIME_S = 2.0
"""Time in the contexts, s."""
COMMAND_M_S = 1e-7
"""By which a command may differ, relative to 1 m/s and more: the projection adds 1e-12 m/s to every bound."""


def differences(scenario: Scenario, build: Any = build_model) -> tuple[list[str], set[tuple[str, str]]]:
    """In which ways the built diagram is not what the scenario says, up to the first, and the pairs that bound."""
    demands, rng = Demands.of(scenario), np.random.default_rng(1)
    probe = Probe(scenario, demands, build)
    wrong = probe.sampled_otherwise()
    bound: set[tuple[str, str]] = set()
    for k, (positions, towards) in enumerate(states(demands, rng)):
        if wrong:
            break
        wrong += probe.look(positions, towards, [*ANSWERS][k % len(ANSWERS)], rng, bound)
    return wrong, bound


def states(demands: Demands, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
    count, m = len(demands.robots), len(demands.obstacles)
    away = np.arange(count)[:, None] * [200.0, 0.0, 0.0] + [1e3, 1e3, 0.0]
    pairs = [(i, k) for i in range(count) for k in range(m)] + [(i, m + j) for j in range(count) for i in range(j)]
    for i, k in pairs:
        safe, share = demands.safe[i, k], demands.share[i, k]
        free = demands.max_speed[i] * demands.period / share  # farther outside than this nothing binds
        for reach in (0.8 * safe, safe * (1.0 + 1e-9), safe + 0.3 * free, safe + 0.9 * free):
            for _ in ANSWERS:
                positions, towards = away.copy(), unit(rng, count)
                direction = unit(rng, 1)[0]
                moves, other = (i, None) if k < m else (k - m, i)
                direction *= demands.mobility[moves]
                if other is not None and moves == count - 1:
                    direction = np.array([direction[0], direction[1], abs(direction[2])])
                direction /= np.linalg.norm(direction)
                place = demands.obstacles[k] if other is None else positions[other]
                positions[moves] = place + reach * direction
                towards[moves] = -direction
                if other is not None:
                    towards[other] = direction
                yield positions, towards


class Probe:
    """The built diagram in a context of its own."""

    def __init__(self, scenario: Scenario, demands: Demands, build: Any) -> None:
        self._demands, self._scenario = demands, scenario
        diagram = build(scenario, "d").diagram
        self._root = diagram.CreateDefaultContext()
        self._root.SetTime(TIME_S)
        vehicles, tasks = (diagram.GetSubsystemByName(each) for each in ("vehicles", "task_planning"))
        plants = [vehicles.GetSubsystemByName(f"{robot}_plant") for robot in demands.robots]
        self._plants = [(plant, plant.GetMyMutableContextFromRoot(self._root)) for plant in plants]
        self._systems = tasks.GetSubsystemByName("ugv_controller"), tasks.GetSubsystemByName("uav_controller")

    def sampled_otherwise(self) -> list[str]:
        """Controllers whose updates do not come every control period from t = 0."""
        timings = {each.get_name(): each.GetUniquePeriodicDiscreteUpdateAttribute() for each in self._systems}
        wanted = (self._demands.period, 0.0)
        return [name for name, at in timings.items() if (at.period_sec(), at.offset_sec()) != wanted]

    def look(
        self, positions: Array, towards: Array, how: str, rng: np.random.Generator, bound: set[tuple[str, str]]
    ) -> list[str]:
        demands, n, m = self._demands, len(positions) - 1, len(self._demands.obstacles)
        push = towards * demands.max_speed[:, None] * rng.choice([1.0, 1.5, 10.0])
        executed = how == "accepted"
        asked, own = (push, -push) if executed else (-push, push)  # the two cannot be confused
        commands, accepted, driven = self._commands(positions, asked, own, how)
        wanted = limited(push * demands.mobility, demands.max_speed)
        _, normal, least = demands.inequalities(positions)
        expected, binding = closest_velocity(wanted, normal, least)
        names = [*(f"obstacle {k}" for k in range(m)), *demands.robots]
        bound |= {(demands.robots[i], names[k]) for i, k in np.argwhere(binding).tolist()}
        scale = COMMAND_M_S * np.maximum(1.0, np.linalg.norm(expected, axis=1))
        off = np.linalg.norm(commands - expected, axis=1) > scale
        found = [f"{demands.robots[i]} is commanded {commands[i]}, not {expected[i]}" for i in np.flatnonzero(off)]
        if (accepted != executed).any():
            found.append(f"a proposal is executed: {accepted}, though it is {how}")
        if (driven != commands).any():
            found.append("a plant does not move as its robot is commanded")
        if (commands[:n, 2] != 0.0).any():
            found.append("a UGV leaves its plane")
        return found

    def _commands(self, positions: Array, asked: Array, own: Array, how: str) -> tuple[Array, Array, Array]:
        """Commands, (R, 3), m/s; whether each UGV executes a proposal, (n,); how the plants move, (R, 3), m/s."""
        n, given = len(positions) - 1, self._scenario
        for (_, context), position in zip(self._plants, positions, strict=True):
            context.SetContinuousState(position)
        (ugvs, of_ugvs), (uav, of_uav) = (
            (each, each.GetMyMutableContextFromRoot(self._root)) for each in self._systems
        )
        times, numbers = np.array([TIME_S - 1.0, TIME_S + 1.0]), np.arange(1, n + 1)
        legs = np.stack([positions[:n] - asked[:n], positions[:n] + asked[:n]], axis=1)
        proposals = [Proposal(f"hostile_{i}", 0.0, Motion(times, legs[i]), number=int(numbers[i])) for i in range(n)]
        answers = np.column_stack([np.full(n, ANSWERS[how]), numbers + (how == "answered another")])
        ugvs.GetInputPort("reference").FixValue(of_ugvs, np.concatenate([positions[:n].ravel(), own[:n].ravel()]))
        ugvs.GetInputPort("proposals").FixValue(of_ugvs, Value([None] * n if how == "none" else proposals))
        ugvs.GetInputPort("answers").FixValue(of_ugvs, answers.ravel())
        above = positions[:n].mean(axis=0) + np.array([0.0, 0.0, given.uav.altitude_m])
        push = own[n] if how != "accepted" else asked[n]
        feed = push - given.control.formation_gain_1_s * (above - positions[n])
        uav.GetInputPort("ugv_command").FixValue(of_uav, np.tile(feed, n))
        found = []
        for system, context in ((ugvs, of_ugvs), (uav, of_uav)):
            updated = system.EvalUniquePeriodicDiscreteUpdate(context)
            found.append(updated.value(0).reshape(-1, 3).copy())
            if system is ugvs:
                accepted = np.asarray(updated.value(1)) > 0.5
            context.get_mutable_discrete_state().SetFrom(updated)
        driven = np.array([plant.EvalTimeDerivatives(context).CopyToVector() for plant, context in self._plants])
        return np.vstack(found), accepted, driven


def closest_velocity(wanted: Array, normal: Array, bound: Array) -> tuple[Array, Array]:
    """Of each robot the velocity closest to `wanted` (R, 3) with n.v >= b, by projections in turn (Dykstra)."""
    velocity = wanted.copy()
    square = np.maximum((normal**2).sum(axis=-1), 1e-18)
    correction = np.zeros_like(normal)
    for _ in range(400):
        before = velocity
        for k in range(bound.shape[1]):
            moved = velocity - correction[:, k]
            short = np.where(np.isfinite(bound[:, k]), bound[:, k] - (normal[:, k] * moved).sum(axis=1), -1.0)
            correction[:, k] = np.maximum(short, 0.0)[:, None] / square[:, k, None] * normal[:, k]
            velocity = moved + correction[:, k]
        if np.abs(velocity - before).max() < 1e-14:
            break
    return velocity, np.linalg.norm(correction, axis=-1) > 0.0
