"""Whether the controllers of the built diagram enforce the inequalities of the scenario, and execute what they may.

The diagram of method (d) is built as for a run. Its plants are put where a robot is beside one that it must avoid, near
enough for the inequality to bind: every robot beside every obstacle and every other robot, inside and outside of the
safe distance. Presets, proposals and the UGVs' velocities that the UAV feeds forward are hostile. Then each command
must meet every inequality of the scenario (`scenario_pairs.py`), and, where at most one of them binds, must be the
velocity closest to what the robot may want: its own task, or an accepted proposal's. So what is missing or too weak
shows as an inequality missed, and what is too strong, or executed without leave, as another command. Nothing is read
from the controllers but their commands; all is written here again in plain numpy.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.common.value import Value

from airground_drake.arrays import ROUNDOFF, Array
from airground_drake.diagram import build_model
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Composition
from airground_drake.nsbc.motion import Motion
from airground_drake.scenarios.load import from_data
from airground_drake.verify.engines.rounding import SEED, unit
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.scenario_pairs import Inputs, Views

STATES = 240
"""Team positions at least; more where there are many pairs."""
CROWDED = 60
"""Team positions besides, in which robots crowd around one obstacle."""
AGAIN = 60
"""Further ones for inequalities that have not bound, as where several robots were beside one obstacle."""
TRIALS = 24
"""Directions from an obstacle that are tried for one that is clear of the others."""
RESTORING_TOLERANCE_M_S = 2e-9
"""By which a recovery from inside a safe distance may be missed, m/s: below 1e-9 the layer takes it for rounding."""
COMMAND_TOLERANCE = 1e-7
"""By which a command may differ from the closest velocity, relative to 1 m/s and more: the projection adds 1e-12 m/s to
every bound; a share, distance or gain that differs by 1e-6 shows."""
WELL_POSED = 0.1
"""Part of a unit normal in which a robot can move, from which on the projection onto it is compared."""
ACCEPT, SILENT, REFUSE = 1.0, 0.0, -1.0
"""Answers, as messages have them."""
ANSWERS = ("none", "accepted", "refused", "silent", "answered_another")
"""What may be the matter with a proposal."""


class State(NamedTuple):
    """Positions of a team, (n + 1, 3), m, and for each robot the point that it is drawn to, (n + 1, 3), m."""

    positions: Array
    drawn_to: Array


class Asked(NamedTuple):
    """What is put on the controllers' ports, and what each robot may want by it.

    Attributes:
        reference: presets, (n, 6): m, m/s.
        proposals: per UGV.
        answers: (n, 2), one of ACCEPT, SILENT, REFUSE and the time of issue that is answered.
        feed_forward: velocity that the UAV is told of every UGV, (3,), m/s.
        wanted: (n + 1, 3), m/s, within speed limits.
        executed: (n,), whether there is an accepted proposal.
        how: per UGV, one of ANSWERS.
    """

    reference: Array
    proposals: tuple[Proposal | None, ...]
    answers: Array
    feed_forward: Array
    wanted: Array
    executed: npt.NDArray[np.bool_]
    how: list[str]


def compare(inputs: Inputs, composition: Composition = "augmented") -> Inputs:
    """Compare the diagram that is built from `inputs['scenario']` with what the inputs' other constants demand.

    Args:
        inputs: constants, and the scenario that the diagram is built from.
        composition: of the UGVs' tasks. Commands are compared with the closest velocity for 'augmented' only.

    Returns:
        Evidence; `agrees` is the verdict, `first_difference` the worst (an inequality missed before all else).
    """
    views = Views.of(inputs["team"])
    rng = np.random.default_rng(SEED)
    probe = _Probe(inputs, views, composition)
    tally = _Tally(views)
    for name, sampled in probe.sampling().items():
        if sampled != (inputs["period_s"], 0.0):
            tally.differ(0.6, f"{name} is sampled otherwise than the scenario says", {
                "period_s": sampled[0], "offset_s": sampled[1], "wanted_period_s": inputs["period_s"],
            })  # fmt: skip

    def look(state: State) -> None:
        asked = hostile(inputs, views, state, rng)
        commands, executed, driven = probe.commands(state.positions, asked)
        tally.states += 1
        tally.executed += int(asked.executed.sum())
        tally.answers.update(asked.how)
        for i in np.flatnonzero(executed != asked.executed).tolist():
            tally.differ(0.5, "a proposal is executed without leave, or not with it", {
                "proposal": asked.how[i], "recorded_as_accepted": bool(executed[i]),
            }, i, state)  # fmt: skip
        for i in np.flatnonzero((driven != commands).any(axis=1)).tolist():
            tally.differ(0.5, "a plant does not move as its robot is commanded", {
                "command_m_s": commands[i].tolist(), "plant_m_s": driven[i].tolist(),
            }, i, state)  # fmt: skip
        _judge(inputs, views, state, asked, commands, composition == "augmented", tally)

    for state in states(inputs, views, rng):
        look(state)
    for r in range(AGAIN):
        if not (pairs := unbound(views, tally.bound_of)):
            break
        look(_beside(inputs, views, pairs, r, rng))
    return tally.to_json(composition)


def unbound(views: Views, bound_of: npt.NDArray[np.intp]) -> list[tuple[int, int]]:
    """Pairs (robot, robot or -1 - obstacle) whose inequality has not bound yet, no robot or obstacle in two of them."""
    m = len(views.obstacles)
    found: list[tuple[int, int]] = []
    taken: set[int] = set()
    for i, k in np.argwhere(bound_of == 0)[::-1].tolist():
        j = -1 - k if k < m else int(views.others[i, k - m])
        if not taken & {i, j}:
            found.append((i, j))
            taken |= {i, j}
    return found


def difference(found: Finding, wired: Sequence[Inputs]) -> Finding:
    """A finding, refuted where the built diagram is not what the scenario says; open where that was not seen.

    Args:
        found: what was found otherwise.
        wired: as `compare` returns it, for each composition.
    """
    if found.status != "proved":
        return found
    for each in wired:
        if each["agrees"]:
            continue
        first = each["first_difference"]
        short = first.get("missed_by_m_s")
        return replace(
            found, status="refuted", counterexample=first, margin=None if short is None else -short, unit="m/s",
            quantity="slack n.v - b of an inequality of the scenario in the built diagram", where={},
        )  # fmt: skip
    for each in wired:
        if not all(each["least_times_bound"][kind] for kind in each["views"] if kind != "obstacle"):
            reason = "two robots' inequality did not bind in any state: the built diagram was not seen to have it"
            return replace(found, status="inconclusive", evidence={**found.evidence, "reason": reason})
    return found


def _judge(
    inputs: Inputs, views: Views, state: State, asked: Asked, commands: Array, closest: bool, tally: _Tally
) -> None:
    """Commands (n + 1, 3), m/s, against every inequality and, where one binds at most, the closest velocity."""
    gain, h = inputs["avoidance_gain_1_s"], inputs["period_s"]
    normal, bound = views.inequalities(state.positions, gain, h, inputs["sensing_range_m"])
    distance = np.linalg.norm(state.positions[:, None] - views.centres(state.positions), axis=-1)
    rate = np.einsum("ika,ia->ik", normal, commands)
    speed = np.linalg.norm(commands, axis=1)
    steep = views.share * max(gain, 1.0 / h)
    allowed = ROUNDOFF * (20.0 * steep * np.maximum(distance, views.safe) + 40.0 * speed[:, None] + 40.0)
    seen = np.isfinite(bound)
    posed, expected, binding = closest_velocity(asked.wanted, normal, bound)
    safe = bound <= 0.0
    judged = seen & (safe | posed[:, None])
    missed = judged & (bound - rate > allowed + np.where(safe, 0.0, RESTORING_TOLERANCE_M_S))
    off_plane = (commands * (1.0 - views.mobility) != 0.0).any(axis=1)
    scale = COMMAND_TOLERANCE * np.maximum(1.0, np.linalg.norm(expected, axis=1))
    other = posed & (np.linalg.norm(commands - expected, axis=1) > scale) & closest
    tally.inequalities += int(judged.sum())
    tally.commands += int(posed.sum())
    tally.bound_of += binding & posed[:, None]
    if (seen & safe).any():
        tally.slack = min(tally.slack, float((rate - bound)[seen & safe].min()))
    for i, k in np.argwhere(missed).tolist():
        short = float(bound[i, k] - rate[i, k])
        tally.differ(1.0 + short, "an inequality of the scenario is missed", {
            "avoided": views.name_of(i, k), "avoided_m": views.centres(state.positions)[i, k].tolist(),
            "distance_m": float(distance[i, k]), "safe_distance_m": float(views.safe[i, k]),
            "share": float(views.share[i, k]), "bound_m_s": float(bound[i, k]), "rate_m_s": float(rate[i, k]),
            "missed_by_m_s": short, "missed_by_m": short * h, "command_m_s": commands[i].tolist(),
        }, i, state)  # fmt: skip
    for i in np.flatnonzero(off_plane).tolist():
        tally.differ(0.9, "a UGV leaves its plane", {"command_m_s": commands[i].tolist()}, i, state)
    for i in np.flatnonzero(other & ~missed.any(axis=1)).tolist():
        held = [int(k) for k in np.flatnonzero(binding[i])]
        tally.differ(0.0, "a command is not the closest velocity that the scenario allows", {
            "command_m_s": commands[i].tolist(), "expected_m_s": expected[i].tolist(),
            "wanted_m_s": asked.wanted[i].tolist(), "proposal": [*asked.how, "none"][i],
            "binding": [
                {"avoided": views.name_of(i, k), "distance_m": float(distance[i, k]),
                 "safe_distance_m": float(views.safe[i, k]), "share": float(views.share[i, k])} for k in held
            ],
        }, i, state)  # fmt: skip


def closest_velocity(
    wanted: Array, normal: Array, bound: Array
) -> tuple[npt.NDArray[np.bool_], Array, npt.NDArray[np.bool_]]:
    """Of each robot the velocity closest to `wanted` (n, 3) with normal . v >= bound, where at most one binds.

    A projection onto one half-space that lies in all others is the projection onto their intersection.

    Returns:
        Whether it is so, (n,); the velocity, (n, 3), m/s; which inequalities it meets with equality, (n, K).
    """
    rate = np.einsum("ika,ia->ik", normal, wanted)
    square = (normal**2).sum(axis=-1)
    size = np.sqrt(square)
    lack = np.where(np.isfinite(bound), (bound - rate) / np.maximum(size, 1e-9), -np.inf)
    k = np.argmax(lack, axis=1)
    rows = np.arange(len(wanted))
    needed = lack[rows, k] > 0.0
    step = np.where(needed, (bound - rate)[rows, k] / np.maximum(square[rows, k], 1e-18), 0.0)
    found: Array = wanted + np.where(np.isfinite(step), step, 0.0)[:, None] * normal[rows, k]
    after = np.einsum("ika,ia->ik", normal, found) - bound
    tight = np.abs(after) <= 1e-9 * np.maximum(1.0, np.linalg.norm(found, axis=1))[:, None]
    one = (after > 1e-6) | (tight & (normal == normal[rows, k][:, None]).all(axis=-1))
    posed = one.all(axis=1) & (~needed | (size[rows, k] >= WELL_POSED))
    return posed, found, tight & needed[:, None]


def states(inputs: Inputs, views: Views, rng: np.random.Generator) -> Iterator[State]:
    """Positions in which every robot is beside everything that it must avoid, then crowded ones.

    In a round every robot has one partner: an obstacle, or another robot away from everything else.
    """
    n, m = len(views.robots), len(views.obstacles)
    rounds: list[list[tuple[int, int]]] = [[(i, -1 - (i + r) % m) for i in range(n)] for r in range(m)]
    rounds += list(_round_robin(n))
    repeated = max(5, -(-STATES // len(rounds)))
    for r in range(repeated):
        for pairs in rounds:
            yield _beside(inputs, views, pairs, r, rng)
    for _ in range(CROWDED):
        yield _crowded(inputs, views, rng)


def _round_robin(count: int) -> Iterator[list[tuple[int, int]]]:
    """Rounds in which every two of `count` meet once (circle method)."""
    members = list(range(count + count % 2))
    for _ in range(len(members) - 1):
        pairs = list(zip(members[: len(members) // 2], reversed(members[len(members) // 2 :]), strict=True))
        yield [(i, j) for i, j in pairs if max(i, j) < count]
        members = [members[0], members[-1], *members[1:-1]]


def _distance(inputs: Inputs, how: int, safe: float, share: float, speed: float, rng: np.random.Generator) -> float:
    """A distance at which an inequality binds at full speed towards: inside, at d, outside, almost too far."""
    free = speed * inputs["period_s"] / share  # farther outside than this nothing binds
    match how % 5:
        case 0:
            return safe * (1.0 - 0.3 * rng.random())
        case 1:
            return safe * (1.0 + 1e-9 * rng.random())
        case 2:
            return safe + 0.5 * free * rng.random()
        case 3:
            return min(safe + free * (0.9 + 0.09 * rng.random()), float(inputs["sensing_range_m"]) * (1.0 - 1e-9))
    return safe + free * rng.random()


def _beside(
    inputs: Inputs, views: Views, pairs: Sequence[tuple[int, int]], how: int, rng: np.random.Generator
) -> State:
    """Every pair (robot, robot or -1 - obstacle) beside each other; robots without a partner far away."""
    n, uav = len(views.robots), len(views.ugvs)
    cell = 4.0 * (inputs["sensing_range_m"] + views.safe.max(initial=1.0))
    corner = np.abs(views.obstacles).max(initial=0.0) + cell
    columns = int(np.ceil(np.sqrt(n)))
    positions = np.array([[corner + cell * (i % columns), corner + cell * (i // columns), 0.0] for i in range(n)])
    drawn_to = positions + unit(rng, n)
    for i, j in pairs:
        if j < 0:
            centre = views.obstacles[-1 - j]
            reach = _distance(inputs, how, views.obstacle_distance, 1.0, views.max_speed[i], rng)
            positions[i] = _clear_of_others(views, centre, reach, i == uav, rng)
            drawn_to[i] = centre
        else:
            i, j = min(i, j), max(i, j)
            safe = views.air_ground_distance if j == uav else views.ugv_distance
            speed = min(views.max_speed[i], views.max_speed[j])
            reach = _distance(inputs, how, safe, 0.5, speed, rng)
            steep = 0.5 * np.pi if rng.random() < 0.1 else rng.uniform(0.0, 1.2)
            positions[j] = positions[i] + reach * _direction(rng.uniform(0.0, 2.0 * np.pi), steep if j == uav else 0.0)
            drawn_to[i], drawn_to[j] = positions[j], positions[i]
    return State(positions, drawn_to)


def _direction(turn: float, rise: float) -> Array:
    return np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])


def _clear_of_others(views: Views, centre: Array, reach: float, flies: bool, rng: np.random.Generator) -> Array:
    """A place at distance `reach` of an obstacle, as far from the others as some random directions allow."""
    found: list[Array] = []
    for _ in range(TRIALS):
        if flies:
            found.append(centre + reach * _direction(rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-1.5, 1.5)))
        else:
            across = np.sqrt(max(reach**2 - centre[2] ** 2, 1e-4))
            place = centre + across * _direction(rng.uniform(0.0, 2.0 * np.pi), 0.0)
            found.append(np.array([place[0], place[1], 0.0]))
    places = np.array(found)
    between = np.linalg.norm(places[:, None] - views.obstacles, axis=-1)
    between[:, np.linalg.norm(views.obstacles - centre, axis=-1) == 0.0] = np.inf
    return places[int(np.argmax(between.min(axis=1)))]


def _crowded(inputs: Inputs, views: Views, rng: np.random.Generator) -> State:
    """Robots at random around one obstacle, or one point, drawn to one of what they avoid."""
    n, m = len(views.robots), len(views.obstacles)
    centre = views.obstacles[rng.integers(m)] if m else np.zeros(3)
    spread = views.safe.max() * np.sqrt(n) * rng.uniform(0.5, 2.0)
    positions = centre + rng.uniform(-spread, spread, (n, 3))
    positions[:-1, 2] = 0.0
    around = views.centres(positions)
    excess = np.linalg.norm(positions[:, None] - around, axis=-1) - views.safe
    nearest = np.where(rng.random(n) < 0.5, np.argmin(excess, axis=1), rng.integers(around.shape[1], size=n))
    return State(positions, around[np.arange(n), nearest])


def hostile(inputs: Inputs, views: Views, state: State, rng: np.random.Generator) -> Asked:
    """Presets, proposals and a feed-forward that drive every robot to what it is drawn to, at up to 10 times its limit.

    What each may want follows by (6), (9)-(10), (12)-(14) and (20): the intervention's directions from an accepted
    proposal, the rest from the robot's own task; never more than the speed limit.
    """
    n, own = len(views.ugvs), state.positions[:-1]
    towards = state.drawn_to - state.positions
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
    towards = towards + rng.choice([0.0, 0.3, 1.0], (n + 1, 1)) * unit(rng, n + 1)
    push = towards * views.max_speed[:, None] * rng.choice([0.5, 1.5, 10.0], (n + 1, 1))
    planar = views.mobility[:-1]

    places = own + rng.choice([0.0, 1.0], (n, 1)) * rng.uniform(-1.0, 1.0, (n, 3))
    rates = push[:-1] - inputs["motion_gain_1_s"] * (places - own)
    task = limited(planar * (rates + inputs["motion_gain_1_s"] * (places - own)), views.max_speed[:-1])
    how = [str(each) for each in rng.choice(ANSWERS, n, p=[0.2, 0.4, 0.15, 0.1, 0.15])]
    executed = np.array([each == "accepted" for each in how])
    proposals: list[Proposal | None] = []
    answers = np.zeros((n, 2))
    wanted = task.copy()
    for i, each in enumerate(how):
        issued = float(rng.integers(1, 100))
        if each == "none":
            proposals.append(None)
            answers[i] = ACCEPT, issued
            continue
        there = own[i] + rng.uniform(-1.0, 1.0, 3)
        # away from its own task's way where it must not be executed, so that the two cannot be confused
        rate = push[i] if each == "accepted" else -push[i]
        rows = np.linalg.qr(rng.normal(size=(3, 3)))[0][: rng.integers(1, 4)] if rng.random() < 0.3 else np.eye(3)
        motion = Motion(np.array([TIME_S - 1.0, TIME_S + 1.0]), np.array([there - rate, there + rate]))
        proposals.append(Proposal(f"hostile_{i}", issued, motion, rows))
        answer = {"accepted": ACCEPT, "refused": REFUSE, "silent": SILENT, "answered_another": ACCEPT}[each]
        answers[i] = answer, issued + (each == "answered_another")
        if each == "accepted":
            at = 0.5 * (motion.positions[0] + motion.positions[1])
            slope = 0.5 * (motion.positions[1] - motion.positions[0])
            intervention = planar[i] * (slope + inputs["intervention_gain_1_s"] * (at - own[i]))
            wanted[i] = planar[i] * (task[i] + rows.T @ rows @ (intervention - task[i]))
    wanted = limited(wanted, views.max_speed[:-1])

    above = own.mean(axis=0) + np.array([0.0, 0.0, inputs["altitude_m"]])
    formation = inputs["formation_gain_1_s"] * (above - state.positions[-1])
    feed_forward = push[-1] - formation
    flown = limited((feed_forward + formation)[None], views.max_speed[-1:])
    return Asked(
        np.hstack([places, rates]), tuple(proposals), answers, feed_forward, np.vstack([wanted, flown]), executed, how
    )  # fmt: skip


TIME_S = 2.0
"""Time in the contexts, s."""


def limited(velocity: Array, most: Array) -> Array:
    """Velocities (n, 3) shortened to at most `most` (n,), m/s."""
    speed = np.linalg.norm(velocity, axis=1)
    found: Array = velocity * np.where(speed > most, most / np.maximum(speed, 1e-300), 1.0)[:, None]
    return found


class _Probe:
    """The built diagram in a context of its own."""

    def __init__(self, inputs: Inputs, views: Views, composition: Composition) -> None:
        diagram = build_model(from_data(inputs["scenario"], "the scenario of the inputs"), "d", composition).diagram
        self._root = diagram.CreateDefaultContext()
        self._root.SetTime(TIME_S)
        self._plants = [diagram.GetSubsystemByName(f"{robot}_plant") for robot in views.robots]
        self._ugvs, self._uav = (diagram.GetSubsystemByName(f"{each}_controller") for each in ("ugv", "uav"))

    def sampling(self) -> dict[str, tuple[float, float]]:
        """Period and offset of each controller's updates, s."""
        found = {}
        for system in (self._ugvs, self._uav):
            timing = system.GetUniquePeriodicDiscreteUpdateAttribute()
            found[system.get_name()] = (timing.period_sec(), timing.offset_sec())
        return found

    def commands(self, positions: Array, asked: Asked) -> tuple[Array, npt.NDArray[np.bool_], Array]:
        """What the team is commanded at positions (n + 1, 3), m.

        Returns:
            Commands, (n + 1, 3), m/s; whether each UGV executes a proposal, (n,); how the plants move, (n + 1, 3), m/s.
        """
        for plant, position in zip(self._plants, positions, strict=True):
            context = plant.GetMyMutableContextFromRoot(self._root)
            context.get_mutable_continuous_state_vector().SetFromVector(position)
        ugvs, uav = (each.GetMyMutableContextFromRoot(self._root) for each in (self._ugvs, self._uav))
        self._ugvs.GetInputPort("reference").FixValue(ugvs, asked.reference.reshape(-1, 2, 3).swapaxes(0, 1).ravel())
        self._ugvs.GetInputPort("proposals").FixValue(ugvs, Value(asked.proposals))
        self._ugvs.GetInputPort("answers").FixValue(ugvs, asked.answers.ravel())
        self._uav.GetInputPort("ugv_command").FixValue(uav, np.tile(asked.feed_forward, len(positions) - 1))
        found = []
        for system, context in ((self._ugvs, ugvs), (self._uav, uav)):
            updated = system.EvalUniquePeriodicDiscreteUpdate(context)
            found.append(updated.value(0).reshape(-1, 3).copy())
            if system is self._ugvs:
                executed = np.asarray(updated.value(1)) > 0.5
            context.get_mutable_discrete_state().SetFrom(updated)
        driven = [p.EvalTimeDerivatives(p.GetMyContextFromRoot(self._root)).CopyToVector() for p in self._plants]
        return np.vstack(found), executed, np.array(driven)


@dataclass
class _Tally:
    """What was compared, and the worst difference so far."""

    views: Views
    states: int = 0
    commands: int = 0
    inequalities: int = 0
    executed: int = 0
    differences: int = 0
    slack: float = np.inf
    worst: float = -np.inf
    first: dict[str, Any] | None = None
    answers: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        """Count from 0."""
        self.bound_of: npt.NDArray[np.intp] = np.zeros(self.views.safe.shape, dtype=np.intp)

    def differ(
        self, size: float, what: str, more: Inputs, robot: int | None = None, state: State | None = None
    ) -> None:
        """A difference; the largest `size` is kept."""
        self.differences += 1
        if size > self.worst:
            self.worst = size
            named = {} if robot is None else {"robot": self.views.robots[robot]}
            where = {} if state is None else {"positions_m": state.positions.tolist()}
            self.first = {"what": what, **named, **more, **where}

    def to_json(self, composition: str) -> Inputs:
        """As `compare` returns it."""
        rows, columns = len(self.bound_of), self.views.safe.shape[1]
        of_kind: dict[str, list[int]] = {}
        free = []
        for i in range(rows):
            for k in range(columns):
                of_kind.setdefault(self.views.kind_of(i, k), []).append(int(self.bound_of[i, k]))
                if not self.bound_of[i, k]:
                    free.append(f"{self.views.robots[i]}, {self.views.name_of(i, k)}")
        return {
            "agrees": self.differences == 0, "composition": composition, "states": self.states,
            "inequalities": self.inequalities, "commands": self.commands, "executed": self.executed,
            "proposals": {name: self.answers[name] for name in ANSWERS},
            "views": {kind: len(counts) for kind, counts in sorted(of_kind.items())},
            "least_times_bound": {kind: min(counts) for kind, counts in sorted(of_kind.items())},
            "never_bound": free[:20], "never_bound_count": len(free), "least_slack_m_s": self.slack,
            "differences": self.differences, "first_difference": self.first,
        }  # fmt: skip
