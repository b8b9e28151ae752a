"""Disturbed runs of the running avoidance layer: safe starts under hostile velocities and disturbances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.nsbc.avoidance import HalfSpaces, Surroundings, limit_speed
from airground_drake.verify.engines.rounding import SEED, nearest, rates, unit
from airground_drake.verify.model.avoidance.constants import Inputs, running_avoidance
from airground_drake.verify.model.avoidance.scenario_pairs import WHOLE, Views, as_points

TOLERANCE = 1e-9
"""For distances, m, and inequalities, m/s, of the disturbed runs: thousands of rounded steps err by 1e-12."""
STEPS = 250
"""Control periods of each disturbed run."""
ATTACKS = ("pinned", "idle", "switching", "random")
Edit = Callable[[HalfSpaces], HalfSpaces]


@dataclass(frozen=True)
class SafeStart:
    """A safe start of a team; `positions` (n + 1, 3), m."""

    name: str
    team: Views
    positions: Array


def scenes(inputs: Inputs) -> list[SafeStart]:
    """Safe starts, from one obstacle to a field of them, of points that keep the least distance of each kind of pair.

    In `squeezed` a UGV has no room between another and an obstacle: there the inequalities contradict each other.
    """
    team, far = Views.of(as_points(inputs["team"]), ugvs=2), np.array([0.0, 0.0, 1e3])
    d = team.obstacle_distance
    dd = team.ugv_distance
    low = team.air_ground_distance
    first = replace(team, ugvs=team.ugvs[:1], max_speed=team.max_speed[[0, -1]], radius=np.zeros(2))
    turn = np.deg2rad([90.0, 210.0, 330.0])
    triangle = d * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(3)])
    rng = np.random.default_rng(SEED)
    field = np.column_stack([rng.uniform(-3.0 * d, 3.0 * d, (10, 2)), np.zeros(10)])
    field = field[np.linalg.norm(field, axis=1) >= 1.2 * d]

    def alone(name: str, obstacles: list[list[float]] | Array, ugv: list[float], uav: Array = far) -> SafeStart:
        around = np.array(obstacles, dtype=np.float64).reshape(-1, 3)
        return SafeStart(name, _among(first, around), np.array([ugv, uav]))

    found = [
        alone("obstacle", [[0.0, 0.0, 0.0]], [1.01 * d, 0.0, 0.0]),
        alone("notch", [[-0.8 * d, 0.0, 0.0], [0.8 * d, 0.0, 0.0]], [0.0, 0.7 * d, 0.0]),
        alone("gap", [[-d, 0.0, 0.0], [d, 0.0, 0.0]], [0.0, 0.0, 0.0]),
        alone("triangle", triangle, [0.0, 0.0, 0.0]),
        alone("uav_low", [], [0.0, 0.0, 0.0], np.array([0.1 * low, 0.0, 1.01 * low])),
    ]
    if len(team.ugvs) == 2:
        two = np.array([[0.0, 0.0, 0.0], [1.1 * dd, 0.0, 0.0], far])
        found.append(SafeStart("ugv_pair", team, two))
        between = np.array([[d, 0.0, 0.0], [d + dd, 0.0, 0.0], far])
        found.append(SafeStart("squeezed", _among(team, np.zeros((1, 3))), between))
    return [*found, alone("field", field, [0.0, 0.0, 0.0], np.array([0.0, 0.0, max(d, low)]))]


def _among(team: Views, points: Array) -> Views:
    """A team among obstacles (m, 3), m, without a radius."""
    return replace(team, obstacles=points, obstacle_radius=np.zeros(len(points)))


def attack(
    inputs: Inputs,
    scene: SafeStart,
    how: str,
    *,
    edit: Edit = lambda given: given,
    force: float = 1.0,
    pairs: float = 2.0,
) -> Inputs:
    """One disturbed run of the running layer, every robot of the team driven and disturbed; exact motion.

    Args:
        inputs: constants, with the disturbance's bound.
        scene: the start.
        how: 'pinned': velocities below the layer and disturbances both towards what has the least excess; 'idle': the
            disturbance alone; 'switching': both towards a point that changes every 20 periods; 'random'.
        edit: a mutation of the inequalities.
        force: a mutation: size of the disturbance over its bound.
        pairs: disturbances that the bound counts between robots.

    Returns:
        `worst_margin_m` (least distance minus d - W/A), where; `unmet`, the inequalities that the layer's velocity
        missed by more than 1e-9 m/s; `uncovered`, robots and points that went below the bound after such a miss;
        `broken`, those that did so although all their own inequalities had been met.
    """
    rng = np.random.default_rng([SEED, ATTACKS.index(how)])
    team = scene.team
    positions = scene.positions.copy()
    avoidance = running_avoidance(inputs)
    mobility = team.mobility
    robots = np.arange(len(team.robots))
    w = inputs["disturbance_m_s"]
    h = avoidance.period
    added = np.where(team.share < WHOLE, pairs, 1.0) * w
    bound = team.safe - added / avoidance.gain
    met = np.ones(bound.shape, dtype=bool)  # all inequalities of this robot against this point so far
    tally = _Tally()
    target = rng.integers(bound.shape[1], size=len(robots))
    for k in range(STEPS):
        around = Surroundings(team.centres(positions), team.safe, team.share)
        x = positions[:, None] - around.centre
        reach = np.linalg.norm(x, axis=-1)
        if how != "switching":
            target = np.argmin(reach - around.distance, axis=1)
        elif k % 20 == 0:
            target = rng.integers(bound.shape[1], size=len(robots))
        inward = -x[robots, target] / reach[robots, target][:, None]
        wanted, push = inward, inward
        if how == "random":
            wanted = unit(rng, len(robots))
            push = unit(rng, len(robots))
        wanted = wanted * mobility * (0.0 if how == "idle" else 100.0)
        spaces = edit(avoidance.half_spaces(positions, mobility, around))
        velocity = avoidance.apply(limit_speed(wanted, team.max_speed), spaces)
        short = np.where(np.isfinite(spaces.bound), spaces.bound - rates(spaces.normal, velocity), -np.inf)
        met &= short <= TOLERANCE
        moved = velocity + force * w * push * mobility
        others = np.zeros(x.shape)
        others[:, len(team.obstacles) :] = moved[team.others]
        least = nearest(x, moved[:, None] - others, h)
        if tally.add(short, least - bound, _both(met, team.others)):
            i, j = divmod(int(np.argmin(least - bound)), bound.shape[1])
            tally.where = {
                "scene": scene.name, "attack": how, "robot": team.robots[i], "t_s": k * h,
                "distance_m": float(least[i, j]), "bound_m": float(bound[i, j]),
                "safe_distance_m": float(around.distance[i, j]),
                "positions_m": positions.tolist(), "avoided_m": around.centre[i, j].tolist(),
                "velocity_with_disturbance_m_s": moved[i].tolist(),
            }  # fmt: skip
        positions = positions + h * moved
    return tally.to_json()


def _both(met: npt.NDArray[np.bool_], others: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """`met` (n, obstacles + n - 1), but for a pair of robots only where both have met their halves."""
    count = len(met)
    obstacles = met.shape[1] - others.shape[1]
    of_pair = np.ones((count, count), dtype=bool)
    rows = np.arange(count)[:, None]
    of_pair[rows, others] = met[:, obstacles:]
    both = met.copy()
    both[:, obstacles:] &= of_pair[others, rows]
    return both


@dataclass
class _Tally:
    """What a disturbed run is judged by, so far: see `attack`."""

    worst: float = np.inf
    unmet: int = 0
    shortfall: float = 0.0
    broken: int = 0
    uncovered: int = 0
    where: dict[str, Any] = field(default_factory=dict)

    def add(self, short: Array, margin: Array, met: npt.NDArray[np.bool_]) -> bool:
        """One period: shortfalls of the inequalities, m/s, margins of the bounds, m; whether it is the worst so far."""
        self.unmet += int((short > TOLERANCE).sum())
        self.shortfall = max(self.shortfall, float(short.max()))
        below = margin < -TOLERANCE
        self.broken += int((below & met).sum())
        self.uncovered += int((below & ~met).sum())
        least = float(margin.min())
        is_worst = least < self.worst
        self.worst = min(self.worst, least)
        return is_worst

    def to_json(self) -> Inputs:
        """As `attack` returns it."""
        return {
            "worst_margin_m": self.worst, "where": self.where, "unmet": self.unmet,
            "worst_shortfall_m_s": self.shortfall, "broken": self.broken, "uncovered": self.uncovered,
        }  # fmt: skip


def campaign(inputs: Inputs) -> list[Inputs]:
    """Every scene under every attack: one row for each scene."""
    rows = []
    for scene in scenes(inputs):
        runs = [attack(inputs, scene, how) for how in ATTACKS]
        worst = min(runs, key=lambda run: float(run["worst_margin_m"]))
        total = {name: sum(run[name] for run in runs) for name in ("unmet", "broken", "uncovered")}
        shortfall = max(run["worst_shortfall_m_s"] for run in runs)
        row = {"scene": scene.name, "steps": STEPS * len(runs), **worst, **total}
        rows.append({**row, "worst_shortfall_m_s": shortfall})
    return rows
