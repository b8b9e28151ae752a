"""Whether the controllers of the built diagram enforce the inequalities of the scenario, and execute what they may.

The diagram of method (d) is built as for a run. Its plants are put where inequalities bind, and what its controllers
are given is hostile (`binding_states.py`). Then each command must meet every inequality of the scenario
(`scenario_pairs.py`), and, where at most one of them binds, must be the velocity closest to what the robot may want:
its own task, or an accepted proposal's. So what is missing or too weak shows as an inequality missed, and what is too
strong, or executed without leave, as another command. Nothing is read from the controllers but their commands.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.common.value import Value

from airground_drake.arrays import ROUNDOFF, Array
from airground_drake.diagram import build_model
from airground_drake.nsbc.avoidance import Composition
from airground_drake.scenarios.load import from_data
from airground_drake.verify.engines.rounding import SEED
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.binding_states import (
    ANSWERS,
    TIME_S,
    Asked,
    State,
    beside,
    hostile,
    states,
)
from airground_drake.verify.model.avoidance.scenario_pairs import Inputs, Views

AGAIN = 60
"""Team positions at most for inequalities that have not bound, as where several robots were beside one obstacle."""
AGAIN_OF_ROBOTS = 2
"""As many for each robot, if that is more, as long as it is two robots' inequality: those must have bound."""
RESTORING_TOLERANCE_M_S = 2e-9
"""By which a recovery from inside a safe distance may be missed, m/s: below 1e-9 the layer takes it for rounding."""
COMMAND_TOLERANCE = 1e-7
"""By which a command may differ from the closest velocity, relative to 1 m/s and more: the projection adds 1e-12 m/s to
every bound; a share, distance or gain that differs by 1e-6 shows."""
WELL_POSED = 0.1
"""Part of a unit normal in which a robot can move, from which on the projection onto it is compared."""


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
    for r in range(max(AGAIN, AGAIN_OF_ROBOTS * len(views.robots))):
        pairs = unbound(views, tally.bound_of)
        if not pairs or (r >= AGAIN and all(other < 0 for _, other in pairs)):
            break
        look(beside(inputs, views, pairs, r, rng))
    return tally.to_json(composition)


def unbound(views: Views, bound_of: npt.NDArray[np.intp]) -> list[tuple[int, int]]:
    """Pairs (robot, robot or -1 - obstacle) whose inequality has not bound yet, no robot or obstacle in two of them."""
    m, n = len(views.obstacles), len(views.robots)
    found: list[tuple[int, int]] = []
    free = np.ones(m + n, dtype=np.bool_)
    for columns in (slice(m, None), slice(m)):  # robots first: they must have bound
        for i in reversed(range(n)):
            points = views.points[i, columns]
            left = points[(bound_of[i, columns] == 0) & free[points] & free[m + i]]
            if len(left):
                last = int(left[-1])
                found.append((i, last - m if last >= m else -1 - last))
                free[[m + i, last]] = False
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
    view, distance, apart, share, normal, bound = views.inequalities(
        state.positions, gain, h, inputs["sensing_range_m"]
    )
    rate = np.einsum("ika,ia->ik", normal, commands)
    speed = np.linalg.norm(commands, axis=1)
    steep = share * max(gain, 1.0 / h)
    allowed = ROUNDOFF * (20.0 * steep * np.maximum(distance, apart) + 40.0 * speed[:, None] + 40.0)
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
    robot, column = np.nonzero(binding & posed[:, None])
    tally.bound_of[robot, view[robot, column]] += 1
    if (seen & safe).any():
        tally.slack = min(tally.slack, float((rate - bound)[seen & safe].min()))
    for i, k in np.argwhere(missed).tolist():
        short = float(bound[i, k] - rate[i, k])
        tally.differ(1.0 + short, "an inequality of the scenario is missed", {
            "avoided": views.name_of(i, view[i, k]),
            "avoided_m": views.centres(state.positions)[i, view[i, k]].tolist(),
            "distance_m": float(distance[i, k]), "safe_distance_m": float(apart[i, k]),
            "share": float(share[i, k]), "bound_m_s": float(bound[i, k]), "rate_m_s": float(rate[i, k]),
            "missed_by_m_s": short, "missed_by_m": short * h, "command_m_s": commands[i].tolist(),
        }, i, state)  # fmt: skip
    for i in np.flatnonzero(off_plane).tolist():
        tally.differ(0.9, "a UGV leaves its plane", {"command_m_s": commands[i].tolist()}, i, state)
    for i in np.flatnonzero(other & ~missed.any(axis=1)).tolist():
        held = np.flatnonzero(binding[i]).tolist()
        tally.differ(0.0, "a command is not the closest velocity that the scenario allows", {
            "command_m_s": commands[i].tolist(), "expected_m_s": expected[i].tolist(),
            "wanted_m_s": asked.wanted[i].tolist(), "proposal": [*asked.how, "none"][i],
            "binding": [
                {"avoided": views.name_of(i, view[i, k]), "distance_m": float(distance[i, k]),
                 "safe_distance_m": float(apart[i, k]), "share": float(share[i, k])} for k in held
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


class _Probe:
    """The built diagram in a context of its own."""

    def __init__(self, inputs: Inputs, views: Views, composition: Composition) -> None:
        diagram = build_model(from_data(inputs["scenario"], "the scenario of the inputs"), "d", composition).diagram
        self._root = diagram.CreateDefaultContext()
        self._root.SetTime(TIME_S)
        world, ugvs, uav = (diagram.GetSubsystemByName(each) for each in ("world", "ugvs", "uav"))
        plants = [world.GetSubsystemByName(f"{robot}_plant") for robot in views.robots]
        self._plants = [(plant, plant.GetMyMutableContextFromRoot(self._root)) for plant in plants]
        self._ugvs, self._uav = ugvs.GetSubsystemByName("ugv_controller"), uav.GetSubsystemByName("uav_controller")

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
        for (_, context), position in zip(self._plants, positions, strict=True):
            context.SetContinuousState(position)
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
        driven = [plant.EvalTimeDerivatives(context).CopyToVector() for plant, context in self._plants]
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
        kinds = self.views.kinds
        of_kind = {str(kind): self.bound_of[kinds == kind] for kind in np.unique(kinds)}
        free = np.argwhere(self.bound_of == 0).tolist()
        return {
            "agrees": self.differences == 0, "composition": composition, "states": self.states,
            "inequalities": self.inequalities, "commands": self.commands, "executed": self.executed,
            "proposals": {name: self.answers[name] for name in ANSWERS},
            "views": {kind: len(counts) for kind, counts in of_kind.items()},
            "least_times_bound": {kind: int(counts.min()) for kind, counts in of_kind.items()},
            "never_bound": [f"{self.views.robots[i]}, {self.views.name_of(i, k)}" for i, k in free[:20]],
            "never_bound_count": len(free), "least_slack_m_s": self.slack,
            "differences": self.differences, "first_difference": self.first,
        }  # fmt: skip
