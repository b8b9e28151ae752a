"""The channel between UAV and UGVs: the UAV sends proposals, each UGV answers with a verdict and a report.

An answer is two numbers per UGV: ACCEPT, REFUSE, DONE or SILENT, and the number of the proposal that it answers. DONE
means that the UGV has executed the motion to its end. The UAV ignores an answer unless it names the proposal in force.
The report lists the obstacles that the UGV sensed when it decided, and the reason for its answer.

Each part of a joint plan is executed as soon as its own UGV accepts it. A refusal makes the UAV withdraw the others.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import World
from airground_drake.model.plants.scripted import Scripted
from airground_drake.uav.policy import Proposal

ACCEPT, SILENT, REFUSE, DONE = 1.0, 0.0, -1.0, 2.0
NOTHING = -1.0  # number of the proposal that a UGV executes if it executes none
# Reason of a UGV that the proposal would bring to rest short of its goal, no nearer than without the proposal.
STALLS: Literal["stalls"] = "stalls"

Point = tuple[float, float, float]  # a place, m, world frame

Outline = tuple[float, ...]  # a convex part of an obstacle, without padding: see `model.geometry.outline`


class Sighting(NamedTuple):
    """A sighting of a moving obstacle: its name, the position of its origin, m, and its velocity, m/s."""

    name: str
    place: Point
    velocity: Point


class Report(NamedTuple):
    """A UGV's report, sent with its answer."""

    number: int = -1  # of the answer; the answers of all UGVs are counted together; -1: no answer
    sensed: tuple[Outline, ...] = ()  # obstacles at rest that the UGV sensed when it decided
    reason: str = ""  # reason of the answer, see `ugv.answer.Reason`; empty before it has decided
    words: str = ""  # the reason as a sentence
    seen: tuple[Sighting, ...] = ()  # obstacles that move and that the UGV sensed when it decided


class Told(NamedTuple):
    """The content of a UGV's answer over a channel."""

    verdict: float = SILENT  # on this proposal
    report: Report = Report()
    newest: int = -1  # the highest number of a proposal that the UGV has read of
    holds: int = -1  # number of the proposal in force; -1: none


Reports = tuple[Report, ...]  # one entry per UGV

Proposals = tuple[Proposal | None, ...]  # one entry per UGV


def sightings(world: World, t: float, positions: Array) -> list[Sighting]:
    """The moving obstacles that exist at time t, s; positions (M, 3), m, of all moving bodies."""
    seen = []
    for body, place in zip(world.moving, positions, strict=True):
        if isinstance(body.plant, Scripted) and world.there(t, [body])[0]:
            velocity = body.plant.script.at(t)[1]
            seen.append(Sighting(body.name, (*place.tolist(),), (*velocity.tolist(),)))
    return seen


def answer_to(proposal: Proposal | None, answers: Sequence[float] | Array, robot: int) -> float:
    """A UGV's answer to this proposal: ACCEPT, REFUSE, DONE, or SILENT if it answers another one; `answers` (2n,)."""
    if proposal is None or answers[2 * robot + 1] != proposal.number:
        return SILENT
    return float(answers[2 * robot])


def accepted_proposals(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
    """The proposals that UGVs execute, one entry per UGV: the proposal in force if the UGV accepts it, else None."""
    return [p if answer_to(p, answers, i) == ACCEPT else None for i, p in enumerate(proposals)]
