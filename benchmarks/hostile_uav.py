"""A UAV that lies in every part of its messages, to keep UGVs from their own task, or to drive them into something.

It may speak without a trigger, and at every planning instant. A `Tactic` says how it lies; `drawn` draws a tactic, and
`mutated` changes a part of it.
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import BASE, COUNT, EXTENT, GAP, MIDDLE, RADIUS
from airground_drake.uav.database import Negotiation
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, answer_to
from airground_drake.uav.planner import Instant, Planner, PlannerState
from airground_drake.uav.policy import Proposal

CHOICES: dict[str, tuple[Any, ...]] = {
    "mapped": ("true", "moved", "nothing", "phantoms", "on the robot", "ahead", "room", "huge", "no shape"),
    "radii": ("true", "none", "half", "large", "enormous", "no length"),
    "motion": ("hold", "stall", "back and forth", "away", "collide", "shadow", "creep"),
    "party": ("alone", "all"),
    "cause": ("own", "another", "alternating", "nobody", "itself", "the UAV"),
    "lasts_s": (0.3, 2.0, 10.0, 1e4),
    "renew_s": (0.05, 0.1, 0.5, 3.0, 1e4),
    "pause_s": (0.0, 0.05, 0.1, 1.0),
    "forge": (False, True),
    "jitter_m": (0.0, 1e-9, 1e-3),
    "size_m": (0.05, 1.0, 5.0, 100.0),
}
"""What each part of a tactic may be."""
HUGE = 200
"""Obstacles on a huge map."""


@dataclass(frozen=True)
class Tactic:
    """How the UAV lies.

    Attributes:
        mapped: the map that it sends: the true map, every obstacle moved by about a metre, an empty map, random
            phantoms of all shapes, phantoms on top of the UGV, a wall across its way out of its sight, walls all round
            it, very many phantoms, or rows of numbers that are no shape.
        radii: radii on the map: true (0 for phantoms), zero, half, 3 m more, very much more, or not a length.
        motion: the motion that is proposed: stay; go towards the goal and stop short of it; to and fro; far away; into
            the nearest obstacle or robot; always the current position; towards the goal at a crawl.
        party: whether the proposal stands alone, or claims to be part of a joint plan of all.
        cause: the trigger that the proposal claims to answer: the UGV's own (by default or by name), another UGV's,
            both in turn, nobody's, or the UAV's.
        lasts_s: duration of the motion, s.
        renew_s: age at which a standing proposal is replaced, s.
        pause_s: silence after a refusal and before a renewal, s.
        forge: whether a replacement pretends to be the answered proposal (same number and time of issue).
        jitter_m: difference of each proposal from the one before, m.
        size_m: length of the motions, m.
    """

    mapped: str
    radii: str
    motion: str
    party: str
    cause: str
    lasts_s: float
    renew_s: float
    pause_s: float
    forge: bool
    jitter_m: float
    size_m: float


def drawn(random: np.random.Generator) -> Tactic:
    """A tactic, every part at random."""
    return Tactic(**{name: values[random.integers(len(values))] for name, values in CHOICES.items()})


def mutated(tactic: Tactic, random: np.random.Generator) -> Tactic:
    """The same with one part, or two, drawn again."""
    parts = random.choice([f.name for f in fields(Tactic)], int(random.integers(1, 3)), replace=False)
    return replace(tactic, **{name: CHOICES[name][random.integers(len(CHOICES[name]))] for name in parts})


@dataclass(frozen=True, eq=False, kw_only=True)
class LyingPlanner(Planner):
    """Speaks to every UGV as its tactic has it; to be used for one run."""

    tactic: Tactic
    random: np.random.Generator

    def asleep_until(self, *_: Any) -> float:
        """It never sleeps."""
        return -math.inf

    def plan(self, memory: PlannerState, now: Instant) -> PlannerState:
        """Speak, whatever the reports."""
        tactic, talks, t, positions = self.tactic, list(memory.talks), now.t, now.positions
        for i, talk in enumerate(talks):
            before, answer = talk.proposal, answer_to(talk.proposal, now.answers, i)
            if before is not None and before.issued == t:
                continue
            over = before is not None and (answer in (REFUSE, DONE) or t >= talk.retry_at)
            if over and tactic.pause_s > 0.0 and not (tactic.forge and answer == ACCEPT):
                talks[i] = Negotiation(retry_at=t + tactic.pause_s)
            elif over or (before is None and t >= talk.retry_at):
                forged = before if tactic.forge and answer == ACCEPT else None
                talks[i] = Negotiation(self._proposal(i, t, forged, positions), retry_at=t + tactic.renew_s)
            elif before is not None and tactic.motion == "shadow" and tactic.forge:
                talks[i] = replace(talk, proposal=self._proposal(i, t, before, positions))
        return replace(memory, talks=tuple(talks))

    def _proposal(self, i: int, t: float, forged: Proposal | None, positions: Array) -> Proposal:
        """What UGV i is told, under the number and the time of another proposal if one is to be forged."""
        motion, mapped = self._motion(i, t, positions), self._map(i, positions).copy()
        mapped[:, RADIUS] = self._radii(mapped[:, RADIUS])
        number, issued = (-1, t) if forged is None else (forged.number, forged.issued)
        more = {"mapped": mapped, "cause": self._cause(i)}
        more["party"] = self.ugvs if self.tactic.party == "all" else ()
        return Proposal("lying", issued, motion, number=number, **more)

    def _cause(self, i: int) -> str:
        other = self.ugvs[(i + 1) % len(self.ugvs)]
        causes = {
            "own": "",
            "another": other,
            "alternating": other if self.random.random() < 0.5 else "",
            "nobody": "?",
            "itself": self.ugvs[i],
            "the UAV": "uav",
        }
        return causes[self.tactic.cause]

    def _radii(self, true: Array) -> Array:
        """Radii that go with a map whose radii are (m,), m: (m,), m."""
        radii = {
            "true": true,
            "none": 0.0 * true,
            "half": 0.5 * true,
            "large": true + 3.0,
            "enormous": true + 1e6,
            "no length": self.random.choice([np.nan, np.inf, -1.0], len(true)),
        }
        return np.asarray(radii[self.tactic.radii], dtype=np.float64)

    def _motion(self, i: int, t: float, positions: Array) -> Motion:
        """The motion that is proposed to UGV i."""
        here, goal, size, lasts = positions[i], self.targets[i], self.tactic.size_m, self.tactic.lasts_s
        way = goal - here
        ahead = way / max(float(np.linalg.norm(way)), 1e-9)
        aside = np.array([-ahead[1], ahead[0], 0.0])
        middles = self.mapped[:, [MIDDLE, MIDDLE + 1, BASE]]
        around = np.concatenate([middles, np.delete(positions[: len(self.ugvs)], i, axis=0)])
        nearest = around[np.linalg.norm(around - here, axis=1).argmin()] if len(around) else goal
        corners = {
            "hold": [here, here],
            "shadow": [here, here],
            "stall": [here, goal - min(size, float(np.linalg.norm(way))) * ahead],
            "back and forth": [here, *(here + (-1) ** k * size * aside for k in range(20))],
            "away": [here, here - size * ahead],
            "collide": [here, nearest],
            "creep": [here, here + min(0.01 * size, 1.0) * ahead],
        }[self.tactic.motion]
        places = np.array(corners) * [1, 1, 0] + self.random.normal(scale=self.tactic.jitter_m, size=3) * [1, 1, 0]
        return Motion(t + lasts * np.linspace(0.0, 1.0, len(places)), places)

    def _map(self, i: int, positions: Array) -> Array:
        """The map that goes with a proposal to UGV i: outlines, (m, W)."""
        here, goal = positions[i, :2], self.targets[i, :2]
        gap = float(self.mapped[:, GAP].max(initial=1.0))
        middle, right = 0.5 * (here + goal), np.array([8.0, 0.0])
        corners = here + 6.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])

        def walls(*ends: tuple[Array, Array]) -> Array:
            return outline.stacked(outline.prism(each, gap=gap) for each in ends)

        def phantoms(count: int, middle: Array, extent: float) -> Array:
            places = middle + self.random.uniform(-extent, extent, (count, 2))
            return outline.stacked(shape_at(place, gap, self.random) for place in places)

        by = self.random.normal(size=(len(self.mapped), 3)) * [1.0, 1.0, 0.0]
        maps = {
            "true": lambda: self.mapped,
            "moved": lambda: outline.moved(self.mapped, by),
            "nothing": lambda: self.mapped[:0],
            "phantoms": lambda: phantoms(8, np.full(2, 5.0), 10.0),
            "on the robot": lambda: phantoms(4, here, 0.5),
            "ahead": lambda: walls((middle - right, middle + right)),
            "room": lambda: walls(*zip(corners, np.roll(corners, 1, axis=0), strict=True)),
            "huge": lambda: outline.balls(self.random.uniform(-100.0, 100.0, (HUGE, 3)) * [1, 1, 0], gap=gap),
            "no shape": lambda: self._spoilt(phantoms(6, here + 7.0, 3.0)),
        }
        return np.asarray(maps[self.tactic.mapped](), dtype=np.float64)

    def _spoilt(self, rows: Array) -> Array:
        """Rows that are no outlines: a number is not finite, the circle is too small, or corners are missing."""
        for row in rows:
            column, value = [(EXTENT + 1, np.nan), (EXTENT, -1.0), (COUNT, 0.0), (COUNT, len(row))][
                self.random.integers(4)
            ]
            row[column] = value
        return rows


def shape_at(place: Array, gap: float, random: np.random.Generator, size: float = 0.5) -> Array:
    """The outline of a point, wall, box or triangle that extends `size`, m, from its place (2,), m, at most."""
    count = int(random.integers(1, 5))
    if count == 1:
        return np.asarray(outline.balls([*place, 0.0], gap=gap)[0])
    turns = random.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * np.arange(count) / count
    return outline.prism(place + size * np.column_stack([np.cos(turns), np.sin(turns)]), gap=gap)
