"""Independent facts about the runs of a report, from report.json alone."""

from collections import Counter
from collections.abc import Iterator
from functools import cached_property
from math import dist
from typing import NamedTuple

from airground_drake.base.registry import AS_TOLD, METHODS
from airground_drake.base.statuses import PASSING
from airground_drake.report import rules
from airground_drake.report.model import Approach, Claim, OnTheWay, Report
from airground_drake.report.sentences import named
from airground_drake.sim.collisions import first_collisions

# Stands for a claim that was not judged.
UNJUDGED = Claim(id="", run="", status="not_run", as_expected=None, exercised=None, evidence={}, inputs={})


class Breach(NamedTuple):
    """A pair that collided or came too near: its names, when and how near, and the cause, '' if not known."""

    first: str
    second: str
    line: str
    doing: str = ""


class RunFacts:
    """Facts about a run of the scenario."""

    def __init__(self, report: Report, name: str) -> None:
        self.name = name
        self.run = report.runs[name]
        self._scenario = report.scenario.resolved
        self._spec, self._metrics = self._scenario.runs[name], self.run.metrics
        about = sorted((claim for claim in report.claims if claim.run in ("", name)), key=lambda claim: claim.run)
        self._claims = {claim.id: claim for claim in about}
        method = METHODS.get(self._spec.method)
        self.is_helped = method is None or method.intervenes  # by the UAV; a method that is not ours may be
        self._obeys = method is not None and method.intervenes and not method.gated
        self.ugvs, self.uavs = [*self._scenario.ugvs], [*self._scenario.aerial]
        # Obstacles that may move.
        self.movers = [name for name, obstacle in self._scenario.obstacles.items() if obstacle.expected_speed_m_s]
        unique = {frozenset((near.first, near.second)): near for near in reversed([*self.run.pairs()])}
        # The least distance of each pair, those of least margin first.
        self.near = sorted(unique.values(), key=lambda near: (near.margin_m, near.first, near.second))
        # The first collision of each robot that collided, an event. What these robots do later does not count.
        self.hits = first_collisions(event.model_dump() for event in self.run.events if event.kind == "collision")
        self.collided = bool(self.hits)
        self.arrived_s = {event.robot: event.t_s for event in reversed(self.run.events) if event.kind == "arrival"}
        self.triggers = sum(event.kind == "trigger" for event in self.run.events)  # how often the UAV was called

    def claim(self, name: str) -> Claim:
        return self._claims.get(name, UNJUDGED)

    # Safe?

    @property
    def is_broken(self) -> bool:
        return any(near.is_short for near in self.near) or self.claim(rules.DISTANCES).status == "refuted"

    @property
    def is_proved(self) -> bool:
        """Whether theorems guarantee the distances from static bodies and between robots, and their conditions held."""
        robots = self._scenario.robots.values()
        links = self._scenario.ugv_links
        known = not (self._scenario.position_error_m or self._scenario.asynchronous or (links and links.loss))
        as_told = known and all(plant.kind == AS_TOLD for robot in robots for plant in robot.plant)
        needed = (*rules.PROOFS, *[rules.PROOF_OF_PLANTS][: not as_told])
        met = self.claim(rules.CONDITIONS).status in PASSING and self._spec.composition == "augmented"
        return self._spec.method == "d" and met and all(self.claim(name).status == "proved" for name in needed)

    @cached_property
    def breaches(self) -> list[Breach]:
        """Collisions by time, otherwise pairs that came too near, by margin; those caused by robots first."""
        # Empty where the claim alone says that a distance was not kept.
        events = {id(hit): hit for hit in self.hits.values()}.values()
        breaches = [
            Breach(
                hit["robot"], other, f"{hit['robot']}\N{EN DASH}{named(other, hit.get('at_m'))} at {hit['t_s']:.2f} s"
            )
            for hit in events
            if (other := hit.get("other") or hit["obstacle"])
        ]
        breaches = breaches or [Breach(near.first, near.second, near.line) for near in self.near if near.is_short]
        met = {frozenset((encounter["first"], encounter["second"])): encounter["doing"]
               for encounter in self.claim(rules.DISTANCES).evidence.get("encounters", ())}  # fmt: skip
        breaches = [breach._replace(doing=met.get(frozenset(breach[:2]), "")) for breach in breaches]
        return sorted(breaches, key=lambda breach: breach.doing not in rules.OURS)

    @property
    def others_too_close(self) -> int:
        """Number of pairs that came too near without colliding, before one of them collided."""
        if not self.hits:
            return max(0, len(self.breaches) - 1)
        among = {frozenset(breach[:2]) for breach in self.breaches}
        ends = {robot: hit["t_s"] for robot, hit in self.hits.items()}
        return sum(
            near.is_short and {near.first, near.second} not in among
            and near.t_s < min(ends.get(body, near.t_s + 1.0) for body in (near.first, near.second))
            for near in self.near
        )  # fmt: skip

    @property
    def whose(self) -> str:
        """The cause of the breaches, in words; '' if it is not known for all of them."""
        doings = [breach.doing for breach in self.breaches]
        ours = [doing for doing in doings if doing in rules.OURS]
        if not doings or "" in doings:
            return ""
        if not ours:
            return "" if self.claim(rules.OWN_DOING).status == "refuted" else "not caused by the robots"
        if len(ours) < len(doings):
            return f"{len(ours)} of {len(doings)} caused by the robots"
        if "robot" in ours:
            return "caused by the robots"
        return f"caused {'partly ' if 'both' in ours else ''}by earlier commands of the robots"

    @property
    def contradicts_its_proof(self) -> bool:
        """Whether a distance was broken although a theorem guarantees it and its conditions held."""
        # Beside moving obstacles a robot only guarantees not to come too near by its new commands.
        kept = [breach for breach in self.breaches if breach.second not in self.movers or breach.doing == "robot"]
        return self.is_proved and (bool(kept) or not self.breaches)

    @property
    def faster(self) -> list[str]:
        beside = self.claim(rules.CONDITIONS).evidence.get("beside_moving", ())
        return sorted({mover["second"] for mover in beside if mover["too_fast_s"] is not None})

    @property
    def unmapped(self) -> list[str]:
        """Obstacles missing from the UAV's map that a robot came too close to while obeying the UAV."""
        off_the_map = {name for name, obstacle in self._scenario.obstacles.items() if not obstacle.known_to_uav}
        met = dict.fromkeys(breach.second for breach in self.breaches if self._obeys)
        return [name for name in met if name in off_the_map]

    def approaches(self) -> list[Approach]:
        """The nearest approach after the start, and that of a moving obstacle; otherwise the least distance."""
        return self._metrics.came_near or self.near[:1]

    # Arrived?

    @cached_property
    def home(self) -> set[str]:
        """Robots that ended at their targets, or arrived before they collided."""
        ends, within = self._metrics.final_position_m, self._scenario.arrival_tolerance_m
        arrived = {name for name, robot in self._scenario.robots.items() if dist(ends[name], robot.target_m) <= within}
        before = {robot for robot, hit in self.hits.items() if self.arrived_s.get(robot, hit["t_s"]) < hit["t_s"]}
        return (arrived - self.hits.keys()) | before

    @property
    def lost_s(self) -> dict[str, float]:
        until = self._scenario.duration_s
        return {name: uav.lost_at_s for name, uav in self._scenario.aerial.items() if 0.0 < uav.lost_at_s < until}

    @property
    def ends_too_early(self) -> bool:
        """Whether all UGVs that did not arrive were coming nearer to their targets when the run ended."""
        return all(self.way(ugv).left_s is not None for ugv in self.ugvs if ugv not in self.home)

    @property
    def there(self) -> int:
        return len(self.home & {*self.ugvs})

    def way(self, robot: str) -> OnTheWay:
        """The progress of a UGV that neither arrived nor collided."""
        return self._metrics.on_the_way.get(robot, OnTheWay())

    def holders(self, robot: str) -> list[str]:
        """The bodies that hold a UGV at the end of the run, with the place of the map."""
        ends = (stall for stall in self._metrics.stalls if stall.robot == robot)
        last = [stall for stall in ends if stall.until_s >= self._metrics.duration_s]
        at_m = self.way(robot).at_m
        return [named(name, at_m if name == "map" else None) for stall in last for name in stall.held_by]

    def refused_all(self, robot: str) -> bool:
        """Whether a UGV got proposals and refused every one."""
        return {fate for who, fate in self._fates() if who == robot} == {"refused"}

    def ending(self, robot: str) -> str:
        """The end of a UGV that did not arrive: its state and, if known, the cause."""
        if hit := self.hits.get(robot):
            bodies = (hit["robot"], hit.get("other") or named(hit["obstacle"], hit.get("at_m")))
            return f"collided with {next(body for body in bodies if body != robot)}"
        way = self.way(robot)
        state = "stopped" if way.stands else "hardly moving" if way.creeps else "still driving"
        known = {"by": way.kept_away and way.kept_away["by"], "left_s": way.left_s and float(f"{way.left_s:.2g}"),
                 "held_by": " and ".join(self.holders(robot)[:2])}  # fmt: skip
        causes = (words.format(**known) for applies, words in rules.CAUSES if applies(self, robot))
        return ", ".join([state, *list(causes)[:1]])

    # UAV proposals

    def _fates(self) -> Iterator[tuple[str, str]]:
        """The UGV of each proposal, and the class of its outcome."""
        for sent in self._metrics.interventions:
            accepted = sent.accepted_s is not None
            fate = rules.CLASSES.get((accepted, sent.ended.how), rules.OPEN[accepted])
            yield sent.robot, rules.OBEYED.get(fate, fate) if self._obeys else fate

    @property
    def fates(self) -> Counter[str]:
        return Counter(fate for _, fate in self._fates())

    @property
    def refusals(self) -> Counter[str]:
        ends = (sent.ended for sent in self._metrics.interventions if sent.accepted_s is None)
        return Counter(end.reason for end in ends if end.how == "refused")
