"""Hostile inputs to the running code from safe states: to the avoidance layer, and to the UGV controller around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance, Composition, HalfSpaces, Surroundings
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.rounding import loss_of_inequality
from airground_drake.systems.controllers import UavController, UgvController
from airground_drake.verify.engines.rounding import ROUNDOFF, SEED, nearest, rates, unit
from airground_drake.verify.model.avoidance.constants import Inputs, kinds, running_avoidance
from airground_drake.verify.model.avoidance.scenario_pairs import Views


@dataclass(frozen=True)
class States:
    """n robots of `position` and `mobility`, (n, 3), each with K points `around` it (unused ones out of range).

    None is inside its safe distance; `lower` are hostile velocities of the lower priorities, (n, 3), m/s.
    """

    position: Array
    mobility: Array
    around: Surroundings
    lower: Array


def safe_states(inputs: Inputs, count: int) -> States:
    """Deterministic states with 1 to 12 points, many at exactly the safe distance; velocities up to 1e6 m/s."""
    rng, most = np.random.default_rng(SEED), 12
    avoidance = running_avoidance(inputs)
    kind = np.array([(k.safe, k.share) for k in kinds(inputs)])
    safe, share = np.moveaxis(kind[rng.integers(len(kind), size=(count, most))], -1, 0)
    position = rng.uniform(-20.0, 20.0, (count, 3))
    mobility = np.where(rng.random((count, 1)) < 0.5, [1.0, 1.0, 0.0], 1.0)
    away = unit(rng, count * most).reshape(count, most, 3)
    excess = rng.choice([0.0, 0.0, 1e-12, 1.0], (count, most)) * 10.0 ** rng.uniform(-6.0, 0.5, (count, most))
    used = np.arange(most) < rng.integers(1, most + 1, (count, 1))
    reach = np.where(used, safe + excess, 10.0 * avoidance.sensing_range + safe)
    around = Surroundings(position[:, None] - reach[..., None] * away, safe, share)
    grow = 4.0 * ROUNDOFF
    while (inside := avoidance.half_spaces(position, mobility, around).bound > 0.0).any():  # by rounding
        reach, grow = np.where(inside, reach * (1.0 + grow), reach), 2.0 * grow
        around = replace(around, centre=position[:, None] - reach[..., None] * away)
    towards = -np.take_along_axis(away, rng.integers(1, most + 1, (count, 1, 1)) % used.sum(1)[:, None, None], 1)[:, 0]
    between = -(away * used[..., None]).sum(axis=1)
    how = rng.integers(3, size=(count, 1))
    lower = np.where(how == 0, towards, np.where(how == 1, between, unit(rng, count)))
    return States(position, mobility, around, lower * mobility * 10.0 ** rng.uniform(-3.0, 6.0, (count, 1)))


def postcondition(
    inputs: Inputs, count: int, composition: Composition = "augmented", layer: Callable[..., Array] = Avoidance.apply
) -> Inputs:
    """Whether the layer's output meets every inequality, compared as floats, from a sample of safe states.

    Returns:
        Evidence: `met`, the worst slack, m/s, the worst loss of distance to points at rest over what rounding may
        cost (at most 1), the largest gain in speed, and the first state where an inequality was missed.
    """
    states = safe_states(inputs, count)
    avoidance = running_avoidance(inputs, composition)
    spaces = avoidance.half_spaces(states.position, states.mobility, states.around)
    velocity = layer(avoidance, states.lower, spaces)
    rate = rates(spaces.normal, velocity)
    missed = ~(rate >= spaces.bound)
    h, seen = avoidance.period, np.isfinite(spaces.bound)
    x = states.position[:, None] - states.around.centre
    speed = np.linalg.norm(velocity, axis=1)[:, None]
    lost = states.around.distance - nearest(x, velocity[:, None], h)
    reach = np.linalg.norm(x, axis=-1)
    allowed = loss_of_inequality(reach, speed, h) + 8.0 * ROUNDOFF * (reach + speed * h)  # the latter: of `nearest`
    alone = seen & (states.around.share == 1.0)
    faster = speed[:, 0] / np.linalg.norm(states.lower, axis=1).clip(1e-300)
    off_plane = float(np.abs(velocity * (1.0 - states.mobility)).max())
    first = None
    if missed.any():
        i = int(np.argmax(np.where(missed, spaces.bound - rate, 0.0).max(axis=1)))
        k = int(np.argmax(np.where(missed[i], spaces.bound[i] - rate[i], 0.0)))
        first = {
            "position_m": states.position[i].tolist(), "points_m": states.around.centre[i][seen[i]].tolist(),
            "safe_distances_m": states.around.distance[i][seen[i]].tolist(),
            "shares": states.around.share[i][seen[i]].tolist(),
            "lower_m_s": states.lower[i].tolist(), "velocity_m_s": velocity[i].tolist(),
            "missed_by_m_s": float(spaces.bound[i, k] - rate[i, k]), "distance_before_m": float(reach[i, k]),
            "safe_distance_m": float(states.around.distance[i, k]),
            "least_distance_in_the_next_period_m": float(nearest(x[i, k], velocity[i], h)),
        }  # fmt: skip
    return {
        "met": not missed.any() and off_plane == 0.0, "composition": composition, "states": count,
        "inequalities": int(seen.sum()), "missed": int(missed.sum()),
        "worst_slack_m_s": float((rate - spaces.bound)[seen].min()),
        "worst_loss_over_rounding": float((lost / allowed)[alone].max(initial=0.0)),
        "largest_gain_in_speed": float(faster.max()), "first_missed": first,
    }  # fmt: skip


def non_finite(inputs: Inputs) -> dict[str, str]:
    """What the layer makes of a velocity that is not finite, beside an active inequality: for the record."""
    avoidance, kind = running_avoidance(inputs), kinds(inputs)[0]
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), kind.safe), np.ones((1, 1)))
    spaces = avoidance.half_spaces(np.array([[kind.safe, 0.0, 0.0]]), np.ones((1, 3)), around)
    answers = {}
    for name, value in (("nan", np.nan), ("infinity", -np.inf), ("1e300", -1e300)):
        velocity = avoidance.apply(np.array([[value, 0.0, 0.0]]), spaces)
        finite = bool(np.isfinite(velocity).all())
        met = finite and bool((rates(spaces.normal, velocity) >= spaces.bound).all())
        answers[name] = "finite, inequality met" if met else "finite, inequality missed" if finite else "passed through"
    return answers


def hostile_team(inputs: Inputs, count: int, composition: Composition, on_top: bool) -> Inputs:
    """Let the running UGV controller execute hostile accepted interventions from random safe states of the team.

    Every UGV (three at most) is asked to go far beyond the obstacle or robot that it is nearest to; a quarter of them
    has not accepted that, and has a preset there instead. The UAV is asked to fly through the UGVs.

    Returns:
        Evidence: number of missed inequalities (compared as floats), and for the worst a replay.
    """
    rng = np.random.default_rng(SEED)
    team = Views.of(inputs["team"], ugvs=3)
    if not len(team.obstacles):
        team = replace(team, obstacles=np.zeros((1, 3)), obstacle_radius=np.zeros(1))
    n, avoidance = len(team.ugvs), running_avoidance(inputs, composition)
    mobility = team.mobility[:n]
    law = UgvLaw(avoidance, inputs["motion_gain_1_s"], inputs["intervention_gain_1_s"], on_top)
    controller = UgvController(_team(team), law)

    def command(positions: Array, wanted: Array, asked: npt.NDArray[np.bool_]) -> tuple[Array, HalfSpaces]:
        accepted: list[Proposal | None] = [
            Proposal("hostile", 0.0, Motion(np.array([0.0, 1.0]), np.array([here, there]))) if agreed else None
            for here, there, agreed in zip(positions[:n], wanted, asked, strict=True)
        ]
        spaces = avoidance.half_spaces(positions[:n], mobility, _around(team, positions, slice(0, n)))
        return controller.velocity(1.0, positions, wanted, np.zeros((n, 3)), accepted), spaces

    flier = _Flier(team, running_avoidance(inputs))
    missed = 0
    worst = 0.0
    worst_flown = 0.0
    state = None
    for _ in range(count):
        positions = _safe_team(team, rng)
        around = _around(team, positions, slice(0, n))
        x = positions[:n, None] - around.centre
        k = np.argmin(np.linalg.norm(x, axis=-1) - around.distance, axis=1)
        wanted = positions[:n] - 100.0 * x[np.arange(n), k] * mobility
        asked = rng.random(n) < 0.75
        velocity, spaces = command(positions, wanted, asked)
        short = spaces.bound - rates(spaces.normal, velocity)
        flown = flier.short(positions)
        missed += int((flown > 0.0).sum())
        worst_flown = max(worst_flown, float(flown.max()))
        missed += int((short > 0.0).sum()) + int((velocity[:, 2] != 0.0).sum())
        if short.max() > worst:
            worst = float(short.max())
            state = (positions, wanted, asked, divmod(int(np.argmax(short)), short.shape[1]))
    found: Inputs = {"states": count, "ugvs": n, "missed": missed, "worst_missed_by_m_s": max(worst, worst_flown)}
    if state is None:
        return found
    positions, wanted, asked, (i, k) = state
    around = _around(team, positions, slice(0, n))
    described = {
        "positions_m": positions.tolist(),
        "robot": team.ugvs[i],
        "avoided_m": around.centre[i, k].tolist(),
        "intervention_towards_m": wanted[i].tolist(),
    }
    approach = _Approach(i, around.centre[i, k], float(around.distance[i, k]), avoidance.period)
    replay = approach.replay(positions, lambda at: command(at, wanted, asked)[0][i])
    return found | {"first_missed": described, "replay": replay}


@dataclass(frozen=True)
class _Approach:
    """A robot on its way to a point at rest that it should avoid: which robot, where the point is, d m, h s."""

    robot: int
    centre: Array
    safe: float
    period: float

    def replay(self, start: Array, velocity: Callable[[Array], Array]) -> Inputs:
        """Let that robot alone move, until it is clearly too close or for 200 periods: the distances, m."""
        positions = start.copy()
        begin = float(np.linalg.norm(positions[self.robot] - self.centre))
        least = np.inf
        steps = 0
        while least >= self.safe - 0.1 and steps < 200:
            chosen = velocity(positions)
            least = min(least, float(nearest(positions[self.robot] - self.centre, chosen, self.period)))
            positions[self.robot] += self.period * chosen
            steps += 1
        return {
            "distance_before_m": begin,
            "safe_distance_m": self.safe,
            "steps": steps,
            "least_distance_m": least,
        }


class _Flier:
    """The running UAV controller, asked for a place below the UGVs."""

    def __init__(self, team: Views, avoidance: Avoidance) -> None:
        self._avoidance = avoidance
        self._team = team
        self._system = UavController(_team(team), avoidance, gain=1.0 / avoidance.period, altitude=-100.0)
        self._context = self._system.CreateDefaultContext()

    def short(self, positions: Array) -> Array:
        """By what the UAV's command misses its inequalities, (1, K), m/s, from the positions of a team, (n + 1, 3)."""
        self._system.GetInputPort("team_position").FixValue(self._context, positions.ravel())
        self._system.GetInputPort("ugv_command").FixValue(self._context, np.zeros(3 * (len(positions) - 1)))
        updates = self._system.EvalUniquePeriodicDiscreteUpdate(self._context)
        velocity = updates.value(0).reshape(1, 3)
        around = _around(self._team, positions, slice(len(positions) - 1, None))
        spaces = self._avoidance.half_spaces(positions[-1:], np.ones((1, 3)), around)
        found: Array = spaces.bound - rates(spaces.normal, velocity)
        return found


def _team(views: Views) -> Team:
    """The same as the controllers take it."""
    return Team(**{each.name: getattr(views, each.name) for each in fields(Views)})


def _around(team: Views, positions: Array, rows: slice) -> Surroundings:
    """What the robots in `rows` must keep away from, by the scenario."""
    return Surroundings(team.centres(positions)[rows], team.safe[rows], team.share[rows])


def _safe_team(team: Views, rng: np.random.Generator) -> Array:
    """A random safe state of a team, (n + 1, 3), m: UGVs close to obstacles, the UAV above one of them."""
    n, m = len(team.ugvs), len(team.obstacles)
    spread = 3.0
    placed: list[Array] = []
    while len(placed) <= n:
        i, spread = len(placed), spread * 1.001  # so that there will be room
        if i < n:
            k = int(rng.integers(m))
            centre = team.obstacles[k]
            reach = team.apart(i, -1 - k) * (1.0 + rng.choice([1e-9, 0.1, spread]) * rng.random())
            angle = rng.uniform(0.0, 2.0 * np.pi)
            trial = np.array([centre[0] + reach * np.cos(angle), centre[1] + reach * np.sin(angle), 0.0])
        else:
            trial = placed[0] + np.array([*rng.uniform(-1.0, 1.0, 2), team.apart(n, 0) + rng.random()])
            trial[2] += rng.choice([0.0, spread / 3.0]) * team.obstacle_distance
        apart = np.linalg.norm(trial - np.vstack([team.obstacles, *placed]), axis=1)
        if (apart >= team.safe[i, : m + i]).all():
            placed.append(trial)
        elif i == n and rng.random() < 0.05:
            placed.clear()
    return np.array(placed)
