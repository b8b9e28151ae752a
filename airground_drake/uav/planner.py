"""The UAV's planner, run once per planning period.

It first reads the UGVs' answers: it learns obstacles from their reports, and withdraws proposals that are refused, done
or no longer needed. Then it asks the behaviour database for a proposal to every triggered UGV that needs one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.history import Immutable
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.database import Asked, BehaviourDatabase, Negotiation
from airground_drake.uav.messages import (
    ACCEPT,
    DONE,
    REFUSE,
    SILENT,
    STALLS,
    Outline,
    Proposals,
    Reports,
    Sighting,
    answer_to,
)
from airground_drake.uav.policy import Answered, MovingObstacle, Observation, Proposal, Teammate

BEHIND_S = 1.0  # a motion has left a UGV behind if from its end the UGV is farther than it could go in this time
# A motion that begins more than this before its UGV can read it is planned anew, not repeated, s. A UGV that starts it
# late heads straight for its current point, perhaps through an obstacle that it leads round; within this time the
# motion has not led far.
LATE_S = 0.5
_WORDS: dict[float, Answered] = {ACCEPT: "accepted", REFUSE: "refused"}


class Mover(NamedTuple):
    """An obstacle that moves."""

    name: str  # of the obstacle
    outlines: Array  # of its parts about its origin, (k, W), see `model.geometry.outline`
    known: bool  # whether the UAV sees it; else a UGV last reported it
    script: Motion | None  # its way, if predictions know it


@dataclass(frozen=True)
class PlannerState(Immutable):
    """The UAV's memory between planning periods."""

    talks: tuple[Negotiation, ...]  # negotiations, one per UGV
    learnt: tuple[Outline, ...] = ()  # obstacles at rest from UGVs' reports that are not on the map
    sent: tuple[tuple[int, Proposal], ...] = ()  # all proposals with the index of their UGV, in order of sending
    asked: tuple[Asked, ...] = ()  # policies that were asked, in order
    read: tuple[tuple[int, float], ...] = ()  # answers that were read: their number, and when, s
    withdrawn: tuple[tuple[int, float], ...] = ()  # proposals that were withdrawn: their number, and when, s
    # Obstacles that move, as UGVs last reported them, with the time of the report, s, by name.
    seen: tuple[tuple[Sighting, float], ...] = ()
    memories: tuple[Any, ...] = ()  # `Policy.remembered` of the policies

    @cached_property
    def proposals(self) -> Proposals:
        """The proposals in force, one entry per UGV."""
        return tuple(talk.proposal for talk in self.talks)


class Sender(NamedTuple):
    """A UAV, and the unique numbers of its proposals."""

    uav: str = "uav"  # name of the UAV
    first: int = 0  # its first number
    step: int = 1  # from one of its numbers to the next

    def number(self, count: int) -> int:
        """The number of the proposal after `count` earlier ones of this UAV."""
        return self.first + self.step * count


ONLY = Sender()


class Instant(NamedTuple):
    """The UAV's observations and received messages at a planning instant, for n UGVs."""

    t: float  # time, s
    positions: Array  # of all robots, (r, 3), m
    intervening: Sequence[bool]  # per UGV, whether it is triggered
    answers: Array  # (2n,)
    reports: Reports
    standing: Sequence[bool] = ()  # per UGV, whether it stands, see `halts`; default: no UGV stands
    sightings: Sequence[Sighting] = ()  # obstacles that move
    others: Proposals = ()  # per UGV, the request in force of any UAV; default: there is one UAV


def sent_after(before: PlannerState, after: PlannerState, t: float, sender: Sender) -> PlannerState:
    """Number the new proposals of a planning instant, and record messages sent and withdrawn; `t` in s."""
    # Every new proposal gets the sender, its next number and the time t, even if the planner has set others. So no
    # planner can send another motion under a number that a UGV has already answered.
    sent, talks, withdrawn = list(before.sent), list(after.talks), list(before.withdrawn)
    for i, (old, talk) in enumerate(zip(before.talks, after.talks, strict=True)):
        if talk.proposal is old.proposal:
            continue
        if old.proposal is not None:
            withdrawn.append((old.proposal.number, t))
        if talk.proposal is not None:
            proposal = replace(talk.proposal, number=sender.number(len(sent)), issued=t, sender=sender.uav)
            talks[i] = replace(talk, proposal=proposal)
            sent.append((i, proposal))
    return replace(after, talks=tuple(talks), sent=tuple(sent), withdrawn=tuple(withdrawn))


@dataclass(frozen=True, eq=False)
class Planner:
    """The UAV's planner. It plans on the UAV's own map, which may miss obstacles."""

    # The policies are asked for each triggered UGV. They may also propose that other UGVs make way for it; such a joint
    # plan stays in force as long as one of its UGVs is triggered. A refusal withdraws the proposal and all other parts
    # of its joint plan; after a rest the next policy is asked. UGVs report the obstacles that they sense with every
    # answer, and the UAV adds these to its map. See docs/design.md.

    ugvs: tuple[str, ...]  # names of the UGVs
    database: BehaviourDatabase  # policies, in the order in which they are tried
    period: float  # planning period, s; a proposal can act one period after it is made
    presets: tuple[Motion, ...]  # preset trajectories of the UGVs
    targets: Array  # targets of the UGVs, (n, 3), m
    mapped: Array  # outlines of the obstacles on the UAV's map, (m, W), see `model.geometry.outline`
    robot_distance: float  # d between UGVs, m
    max_speed: Array  # speed limits of the UGVs, (n,), m/s
    radius: Array | float = 0.0  # radii of the UGVs' bodies, (n,), m, or one for all
    mapped_from: Array | float = 0.0  # when each of `mapped` appears, (m,), s, or one time for all
    mapped_until: Array | float = np.inf  # when each disappears, in the same order
    movers: tuple[Mover, ...] = ()  # obstacles that move
    coasting: float = 3.0  # time for which an obstacle that moves is predicted to keep its velocity; then it stands, s
    # Per UGV, whether its plant may fall behind a motion within its speed limit; default: none does.
    trails: tuple[bool, ...] = ()
    sender: Sender = ONLY  # the UAV
    lead: float = 0.0  # time that a proposal is under way, s
    retry: float = np.inf  # a proposal is repeated after this long without an answer, s
    charge: tuple[bool, ...] = ()  # per UGV, whether the UAV is in charge of it; default: of all
    lost_at: float = np.inf  # from this time on the UAV neither sends nor hears anything, s

    @property
    def radii(self) -> Array:
        """Radii of the UGVs' bodies, (n,), m."""
        return np.broadcast_to(self.radius, len(self.ugvs))

    @cached_property
    def _rows(self) -> dict[Outline, list[int]]:
        """Rows of each outline on the map."""
        indices: dict[Outline, list[int]] = {}
        for k, row in enumerate(self.mapped):
            indices.setdefault(outline.as_tuple(row), []).append(k)
        return indices

    def start(self) -> PlannerState:
        return PlannerState((Negotiation(),) * len(self.ugvs))

    def asleep_until(
        self,
        memory: PlannerState,
        intervening: Sequence[bool],
        answers: Sequence[float] | Array | None = None,
        reports: Reports = (),
    ) -> float:
        """Time until which planning changes nothing with the same inputs, s; -inf: it may at once."""
        # Without a proposal in force no answer is read. Then a negotiation changes only when its rest is over, or when
        # neither its UGV nor its cause is triggered any more. A proposal stays without an answer, or after an
        # acceptance that was read. Answers over a channel are not given: what is read there need not be the newest.
        # Without policies no policy is asked, and nothing else is recorded.
        if not self.database.policies:
            return math.inf
        called = {name for name, own in zip(self.ugvs, self._own(intervening), strict=True) if own}
        newest = max((number for number, _ in memory.read[-len(self.ugvs) :]), default=-1)
        until = math.inf
        for i, (name, talk) in enumerate(zip(self.ugvs, memory.talks, strict=True)):
            proposal = talk.proposal
            if proposal is not None:
                if answers is None:
                    return -math.inf
                answer = answer_to(proposal, answers, i)
                if answer in (REFUSE, DONE) or (answer == ACCEPT and (reports[i].number > newest or reports[i].seen)):
                    return -math.inf
                until = min(until, proposal.motion.end)
            party = proposal.party if proposal else ()
            if talk != Negotiation() and called.isdisjoint((name, talk.cause, *party)):
                return -math.inf
            if proposal is None and name in called:
                until = min(until, talk.retry_at)
        return until

    def _own(self, intervening: Sequence[bool]) -> list[bool]:
        """Which UGVs need an intervention of this UAV: its own triggered ones."""
        return [a and b for a, b in zip(intervening, self.charge or (True,) * len(self.ugvs), strict=True)]

    def lost(self, memory: PlannerState, t: float) -> PlannerState:
        """The memory of a lost UAV at time t, s: proposals end with their motions."""
        over = [talk.proposal is not None and t >= talk.proposal.motion.end for talk in memory.talks]
        talks = [Negotiation() if gone else talk for gone, talk in zip(over, memory.talks, strict=True)]
        return replace(memory, talks=tuple(talks)) if any(over) else memory

    def plan(self, memory: PlannerState, now: Instant) -> PlannerState:
        """The memory after one planning period."""
        answers = [answer_to(talk.proposal, now.answers, i) for i, talk in enumerate(memory.talks)]
        heard = [report for report, answer in zip(now.reports, answers, strict=True) if answer != SILENT]
        unknown = {row for report in heard for row in report.sensed} - set(memory.learnt)
        newest = max((number for number, _ in memory.read[-len(self.ugvs) :]), default=-1)
        fresh: tuple[Outline, ...] = ()
        if unknown:  # what was on the map may have disappeared since an old report
            there, rows = self._there(now.t), self._rows
            new = {row for report in heard if report.number > newest for row in report.sensed}
            unmapped = [r for r in unknown if r not in rows or (r in new and not any(there[k] for k in rows[r]))]
            fresh = tuple(sorted(unmapped, key=_place))
        talks = self._after_answers(memory.talks, now, answers, learnt=bool(fresh))
        latest = {sighting.name: (sighting, when) for sighting, when in memory.seen} | {
            sighting.name: (sighting, now.t) for report in heard for sighting in report.seen
        }
        memory = replace(
            memory,
            talks=tuple(talks),
            learnt=memory.learnt + fresh,
            read=(*memory.read, *((report.number, now.t) for report in heard if report.number > newest)),
            seen=tuple(latest.values()),
        )
        own = self._own(now.intervening)
        return self._asked(memory, now, own) if any(talk.is_due(now.t) for talk in compress(talks, own)) else memory

    def _asked(self, memory: PlannerState, now: Instant, own: Sequence[bool]) -> PlannerState:
        """The memory after asking the policies for all its own UGVs that need a proposal."""
        t, mapped = now.t, self.mapped[self._there(now.t)]
        obstacles = outline.joined(mapped, outline.stacked(memory.learnt)) if memory.learnt else mapped
        latest = {sighting.name: (sighting, when) for sighting, when in memory.seen}
        moving = self._moving(t, {sighting.name: sighting for sighting in now.sightings}, latest)
        talks, asked, memories = list(memory.talks), list(memory.asked), dict(enumerate(memory.memories))
        for i, robot in enumerate(self.ugvs):
            if not (own[i] and talks[i].is_due(t)):
                continue
            seen = Observation(
                t=t,
                start=t + self.period + self.lead,
                robot=robot,
                position=now.positions[i],
                target=self.targets[i],
                preset=self.presets[i],
                obstacles=obstacles,
                mapped=mapped,
                others=np.delete(now.positions, i, axis=0),
                refusals=talks[i].refusals,
                team=self._team(now, talks),
                robot_distance=self.robot_distance,
                radius=float(self.radii[i]),
                moving=moving,
            )
            changed, policies = self.database.plan(talks[i], seen, memories)
            asked += policies
            talks = [changed.get(name, talk) for name, talk in zip(self.ugvs, talks, strict=True)]
        remembered = tuple(map(memories.get, range(len(self.database.policies))))
        return replace(memory, talks=tuple(talks), asked=tuple(asked), memories=remembered)

    def _there(self, t: float) -> Flags:
        """Which outlines on the map exist at time t, s, (m,)."""
        there = np.less_equal(self.mapped_from, t + SAME_S) & np.less(t + SAME_S, self.mapped_until)
        return np.broadcast_to(there, len(self.mapped))

    def _moving(
        self, t: float, now: Mapping[str, Sighting], latest: Mapping[str, tuple[Sighting, float]]
    ) -> tuple[MovingObstacle, ...]:
        """The moving obstacles, as the UAV sees them at time t, s, or as UGVs last reported them."""
        bodies = []
        for mover in self.movers:
            sighting, when = (now.get(mover.name), t) if mover.known else latest.get(mover.name, (None, t))
            if sighting is None:
                continue
            place, velocity = np.array(sighting.place), np.array(sighting.velocity)
            coasts = Motion(np.array([when, when + self.coasting]), np.array([place, place + self.coasting * velocity]))
            bodies.append(MovingObstacle(mover.name, mover.outlines, place, velocity, mover.script or coasts))
        return tuple(bodies)

    def _after_answers(
        self, talks: Sequence[Negotiation], now: Instant, answers: Sequence[float], *, learnt: bool
    ) -> list[Negotiation]:
        # A proposal is withdrawn if any part of its plan is refused, if its motion is over, or if neither its UGV, nor
        # its cause, nor any party of its joint plan is triggered any more. So a UGV whose part leads it past its preset
        # trajectory goes on: the others' ways were planned with it. Those that did not refuse are asked again at once.
        # If a UGV that may fall behind would have stalled, or was left behind, its motion was too fast.
        t, called = now.t, set(compress(self.ugvs, now.intervening))
        refused = {talk.proposal.joint for talk, a in zip(talks, answers, strict=True) if talk.proposal and a == REFUSE}
        after = []
        for i, (name, talk, answer) in enumerate(zip(self.ugvs, talks, answers, strict=True)):
            proposal, trails = talk.proposal, bool(self.trails and self.trails[i])
            party_refused = proposal is not None and bool(proposal.party) and proposal.joint in refused
            party = proposal.party if proposal else ()
            if called.isdisjoint((name, talk.cause, *party)):
                talk = Negotiation()
            elif answer == REFUSE:
                talk = self.database.after_refusal(
                    talk, t, learnt=learnt, too_fast=trails and now.reports[i].reason == STALLS
                )
            elif proposal is not None and (party_refused or answer == DONE or t >= proposal.motion.end):
                left_m = np.linalg.norm(now.positions[i] - proposal.motion.positions[-1])
                behind = trails and t >= proposal.motion.end and bool(left_m > BEHIND_S * self.max_speed[i])
                talk = replace(talk, proposal=None, too_fast=talk.too_fast + behind)
            elif answer == SILENT and proposal is not None and self._is_late(proposal, name, t, now.positions[i]):
                talk = replace(talk, proposal=None)
            after.append(talk)
        return after

    def _is_late(self, proposal: Proposal, ugv: str, t: float, place: Array) -> bool:
        """Whether a copy of an unanswered proposal would arrive too late; `place` of its UGV in m."""
        # A copy may leave up to the next planning instant. A part of a joint plan is never late: the other UGVs have
        # theirs. A UGV that is nearer to where the motion is than to where it began has read the proposal, and its
        # answer is late or lost.
        began, motion, leaves = float(proposal.motion.times[0]), proposal.motion, t + self.period
        if proposal.party or proposal.cause not in ("", ugv) or leaves < proposal.issued + self.retry - SAME_S:
            return False
        first, now = motion.sample(np.array([began, t]))
        nearer = np.linalg.norm(place - first) < np.linalg.norm(place - now)
        return bool(nearer) and leaves + self.lead > began + LATE_S + SAME_S

    def _team(self, now: Instant, talks: Sequence[Negotiation]) -> tuple[Teammate, ...]:
        """All UGVs as the UAV sees them."""
        charge = self.charge or (True,) * len(self.ugvs)
        asked = [talk.proposal if charge[i] else now.others[i] for i, talk in enumerate(talks)]
        return tuple(
            Teammate(
                name=name,
                position=now.positions[i],
                target=self.targets[i],
                preset=self.presets[i],
                max_speed=float(self.max_speed[i]),
                triggered=bool(now.intervening[i]),
                standing=now.standing[i] if now.standing else False,
                proposal=asked[i],
                answered=_WORDS.get(answer_to(asked[i], now.answers, i), "silent"),
                refusals=talks[i].refusals,
                too_fast=talks[i].too_fast,
                resting=talks[i].refused_lately(now.t),
                radius=float(self.radii[i]),
                in_charge=charge[i],
            )
            for i, name in enumerate(self.ugvs)
        )


def _place(given: Outline) -> Outline:
    """Sorts outlines by place, then by radius."""
    middle = given[outline.MIDDLE : outline.EXTENT]
    return (*middle, given[outline.BASE], given[outline.RADIUS], *given)
