"""A UAV that lies in every part of its messages, to keep UGVs from their own task, or to drive them into something.

It may speak without a trigger, and at every planning instant. A `Tactic` says how it lies; `drawn` draws a tactic, and
`mutated` changes a part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.geometry.motion import Motion
from airground_drake.geometry.outline import BASE, GAP, MIDDLE, RADIUS, balls
from airground_drake.intervention.database import Negotiation
from airground_drake.intervention.messages import ACCEPT, DONE, REFUSE, Reports, answer_to
from airground_drake.intervention.planner import Planner, PlannerState
from airground_drake.intervention.policy import Proposal

CHOICES: dict[str, tuple[Any, ...]] = {
    "mapped": ("true", "moved", "nothing", "phantoms", "on the robot", "ahead", "huge"),
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
            phantoms, phantoms on top of the UGV, a wall across its way out of its sight, or very many phantoms.
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

    def idle(self, memory: PlannerState, intervening: Sequence[bool]) -> bool:
        """Never idle."""
        return False

    def plan(
        self,
        memory: PlannerState,
        t: float,
        positions: Array,
        intervening: Sequence[bool],
        answers: Array,
        reports: Reports,
        standing: Sequence[bool] = (),
    ) -> PlannerState:
        """Speak, whatever the answers and reports."""
        return self._speak(memory, t, positions, answers)

    def _speak(self, memory: PlannerState, t: float, positions: Array, answers: Array) -> PlannerState:
        tactic, talks = self.tactic, list(memory.talks)
        for i, talk in enumerate(talks):
            before, answer = talk.proposal, answer_to(talk.proposal, answers, i)
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
        motion, places = self._motion(i, t, positions), self._map(i, positions)
        mapped = balls(places, self._radii(places), float(self.mapped[:, GAP].max(initial=1.0)))
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

    def _radii(self, mapped: Array) -> Array:
        """Radii that go with a map, (m,), m."""
        true = np.zeros(len(mapped))
        if self.tactic.mapped in ("true", "moved"):
            true = true + self.mapped[:, RADIUS]
        radii = {
            "true": true,
            "none": 0.0 * true,
            "half": 0.5 * true,
            "large": true + 3.0,
            "enormous": true + 1e6,
            "no length": self.random.choice([np.nan, np.inf, -1.0], len(mapped)),
        }
        return np.asarray(radii[self.tactic.radii], dtype=np.float64)

    def _motion(self, i: int, t: float, positions: Array) -> Motion:
        """The motion that is proposed to UGV i."""
        here, goal, size, lasts = positions[i], self.targets[i], self.tactic.size_m, self.tactic.lasts_s
        way = goal - here
        ahead = way / max(float(np.linalg.norm(way)), 1e-9)
        aside = np.array([-ahead[1], ahead[0], 0.0])
        around = np.concatenate([self.mapped, np.delete(positions[:-1], i, axis=0)])
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
        """The map that goes with a proposal to UGV i, (m, 3), m."""
        here, goal, flat = positions[i], self.targets[i], np.array([1.0, 1.0, 0.0])
        steps = np.linspace(-1.0, 1.0, 9)[:, None]
        across = 0.5 * (here + goal) + 8.0 * steps * np.array([1.0, 0.0, 0.0])
        middles = self.mapped[:, [MIDDLE, MIDDLE + 1, BASE]]
        maps = {
            "true": middles,
            "moved": middles + self.random.normal(size=middles.shape) * flat,
            "nothing": np.empty((0, 3)),
            "phantoms": self.random.uniform(-5.0, 15.0, (8, 3)) * flat,
            "on the robot": here + self.random.normal(scale=0.5, size=(4, 3)) * flat,
            "ahead": across * flat,
            "huge": self.random.uniform(-100.0, 100.0, (HUGE, 3)) * flat,
        }
        return np.asarray(maps[self.tactic.mapped], dtype=np.float64)
