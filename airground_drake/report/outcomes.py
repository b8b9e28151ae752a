"""What came of the runs of a report, from report.json alone: facts, which `answers` and `summary` put into words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import dist
from typing import Any, Literal, NamedTuple

from airground_drake.base.statuses import PASSING
from airground_drake.registry import METHODS
from airground_drake.run.collisions import first_collisions

SLACK_M = 1e-9
"""A distance counts as kept if it falls short of the required one by less, as in SAFE-TRACE."""

THEOREMS, CONDITIONS = ("SAFE-INV", "SAFE-GATE"), "SAFE-HYP"
"""The claims that prove the safety of method (d), and the one that a run met their conditions."""
DECLARED = "declared speed"
"""The hypothesis of SAFE-HYP that is about obstacles that move alone."""


Document = Mapping[str, Any]


class Near(NamedTuple):
    """The smallest distance of a pair: the gap between the surfaces, below 0 if they overlap.

    `appeared`: at the instant at which the other one appeared. `moves`: the other one may move, and no theorem keeps
    its distance.
    """

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float
    appeared: bool = False
    moves: bool = False

    @property
    def is_short(self) -> bool:
        """Whether the distance was not kept."""
        return self.margin_m < -SLACK_M

    def __str__(self) -> str:
        """The distance, without the pair."""
        return distance(self.value_m, self.required_m)

    def told(self) -> str:
        """The distance, of whom, and whether it was there from the start."""
        return f"{self} ({self.robot} to {self.other}{', at the start' * (self.t_s == 0.0)})"


class ProofOutcome(NamedTuple):
    """Whether the safety of a run of method (d) is proved.

    Attributes:
        status: `tested` or `idle` if it is proved: the conditions held, and something came near, or nothing did;
            `refuted` or `undecided` by the conditions; `unproved` if the theorems are.
        lacking: the claims that are not as they should be, by identifier; None for one that was not judged.
    """

    status: Literal["tested", "idle", "refuted", "undecided", "unproved"]
    lacking: Mapping[str, Mapping[str, Any] | None] = {}

    @property
    def holds(self) -> bool:
        """Whether the run was proved safe."""
        return self.status in ("tested", "idle")


@dataclass
class RunOutcome:
    """What came of a run.

    Attributes:
        name: of the run.
        method: its identifier.
        plain: whether priorities are composed as the package does it; False: by a recursion that is only compared.
        near: pairs, those of least margin first.
        safe: whether every pair kept its distance; None: not known.
        why: why that is not known, or what SAFE-TRACE says if the distances alone do not decide.
        declared_unsafe: whether the scenario declares that the run is not safe, and it is not.
        tested: whether any pair came near enough to be kept apart.
        proof: of its safety under method (d); None under other methods.
        hits: robots that collided, and the event of the first collision of each. What they do later does not count.
        arrived_s: robots that arrived, and when, s.
        away: robots that did not arrive, and where they ended; None: not known.
        stuck: robots among them that stand where the scenario declares a stall.
        on_the_way: UGVs among them that did not collide, and how far they had come (`metrics.on_the_way`).
        no_way: UGVs that the UAV was called for and found no way for.
        there: how many UGVs arrived.
        encounters: obstacles that move and came too near to a robot, those of SAFE-OWN, by time.
        own_doing: whether a robot brought a distance below the required one itself; None: not known, or nothing moves.
        faster: obstacles that moved faster than declared, by name: their entries in SAFE-HYP.
        else_met: whether all other hypotheses of SAFE-HYP held, so that all other distances are proved.
        movers: obstacles that may move.
        walls: obstacles that are walls.
    """

    name: str
    method: str
    plain: bool
    near: list[Near] = field(default_factory=list)
    safe: bool | None = None
    why: str = "it was not run"
    declared_unsafe: bool = False
    tested: bool = False
    proof: ProofOutcome | None = None
    hits: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    arrived_s: dict[str, float] = field(default_factory=dict)
    away: dict[str, Sequence[float]] | None = None
    stuck: set[str] = field(default_factory=set)
    on_the_way: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    no_way: list[str] = field(default_factory=list)
    there: int = 0
    encounters: list[Mapping[str, Any]] = field(default_factory=list)
    own_doing: bool | None = None
    faster: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    else_met: bool = False
    movers: list[str] = field(default_factory=list)
    walls: list[str] = field(default_factory=list)

    @property
    def blameless(self) -> bool:
        """Whether obstacles that move came too near by their own motion, and everything else was kept."""
        if self.safe is not False or self.own_doing is not False or not self.encounters:
            return False
        hits = {hit.get("other") or hit["obstacle"] for hit in self.hits.values()}
        return hits <= {*self.movers} and all(near.moves for near in self.near if near.is_short)

    @property
    def helped(self) -> bool:
        """Whether the UAV intervenes."""
        return METHODS[self.method].intervenes if self.method in METHODS else True

    @property
    def fine(self) -> bool:
        """Whether every distance was kept and every robot arrived."""
        return self.safe is True and self.away == {}


def courses(document: Document) -> list[RunOutcome]:
    """What came of every run that the scenario names, in its order."""
    found = []
    for name, spec in document["scenario"]["resolved"]["runs"].items():
        course = RunOutcome(name, str(spec["method"]), spec["composition"] == "augmented")
        if name in document["runs"]:
            _judge(course, document)
            _beside_movers(course, document)
            _locate(course, document)
        course.proof = _proof(document, course) if course.method == "d" else None
        found.append(course)
    return found


def _judge(course: RunOutcome, document: Document) -> None:
    """Whether the run was safe, by its distances and by SAFE-TRACE."""
    run = document["runs"][course.name]
    unique = {frozenset((pair.robot, pair.other)): pair for pair in reversed([*pairs(run)])}
    course.near = sorted(unique.values())
    course.hits = first_collisions(run["events"])
    unchecked: Mapping[str, Any] = {"status": "", "exercised": 0, "as_expected": False}
    claim = next(iter(claims(document, "SAFE-TRACE", run=course.name)), unchecked)
    status = claim["status"]
    course.tested = claim["exercised"] != 0
    course.declared_unsafe = status == "refuted" and claim["as_expected"] is True
    if course.hits or (course.near and course.near[0].is_short):
        course.safe, course.why = False, ""
    elif status == "refuted":
        course.safe, course.why = False, "SAFE-TRACE is refuted"
    elif status in PASSING:
        course.safe, course.why = True, ""
    else:
        course.why = f"SAFE-TRACE: {status.replace('_', ' ')}" if status else "SAFE-TRACE was not checked"


def _beside_movers(course: RunOutcome, document: Document) -> None:
    """What came of the run beside obstacles that may move."""
    proved = any(claim["status"] == "proved" for claim in claims(document, THEOREMS[0]))
    barriers = document["scenario"]["resolved"].get("obstacles", {})
    course.movers = [name for name, each in barriers.items() if each.get("moves") or each.get("max_speed_m_s")]
    course.walls = [name for name, each in barriers.items() if each.get("segment_m")]
    for claim in claims(document, "SAFE-OWN", run=course.name):
        if claim["status"] in (*PASSING, "refuted"):
            course.own_doing = claim["status"] == "refuted"
            course.encounters = claim["evidence"].get("came_too_near_themselves", [])
    for claim in claims(document, CONDITIONS, run=course.name):
        rows = claim["evidence"].get("beside_moving", [])
        course.faster = {each["second"]: each for each in rows if each["too_fast_s"] is not None}
        against = claim["counterexample"] or {}
        only_speed = against.get("hypothesis") == DECLARED and not against.get("also_broken")
        course.else_met = proved and (claim["status"] in PASSING or only_speed)


def _locate(course: RunOutcome, document: Document) -> None:
    """Who arrived in the run, and where the others are."""
    resolved, run = document["scenario"]["resolved"], document["runs"][course.name]
    uav, ends = resolved["uav"], run["metrics"]["final_position_m"]
    targets = {name: ugv["target_m"] for name, ugv in resolved["ugvs"].items()} | {uav["name"]: uav["target_m"]}
    course.arrived_s = {event["robot"]: event["t_s"] for event in run["events"] if event["kind"] == "arrival"}
    home = {robot for robot, at in targets.items() if dist(ends[robot], at) <= resolved["arrival_tolerance_m"]}
    home = (home - course.hits.keys()) | (course.arrived_s.keys() & course.hits.keys())
    course.away = {robot: ends[robot] for robot in targets if robot not in home}
    if len(course.away) > 1 and uav["name"] not in course.hits:
        course.away.pop(uav["name"], None)  # it follows the UGVs: it is not home before they are
    for goal in claims(document, "LIVE-GOAL", run=course.name):
        stands = (each for each in goal["evidence"].get("conditions", []) if each.get("condition") == "stands")
        course.stuck = {each["robot"] for each in stands if each["margin_m"] >= 0.0} & course.away.keys()
    course.there = len(resolved["ugvs"].keys() - course.away.keys())
    course.on_the_way, course.no_way = run["metrics"]["on_the_way"], no_way(run)


def no_way(run: Mapping[str, Any]) -> list[str]:
    """UGVs that the UAV was called for and found no way for in a run: it sent nothing, and no policy failed."""
    failed = {fault["robot"] for fault in run["faults"]}
    return [ugv for ugv in run["metrics"]["without_proposals"] if ugv not in failed]


def _proof(document: Document, course: RunOutcome) -> ProofOutcome:
    """Whether a run of method (d) was proved safe; theorems may have been judged for this run alone.

    That an obstacle moved faster than declared leaves the proofs for all other pairs as they are.
    """
    run = course.name

    def judged(name: str) -> Mapping[str, Any] | None:
        return next(iter([*claims(document, name, run=run), *claims(document, name, run="")]), None)

    theorems = {name: judged(name) for name in THEOREMS}
    if unproved := {name: claim for name, claim in theorems.items() if claim is None or claim["status"] != "proved"}:
        return ProofOutcome("unproved", unproved)
    conditions = judged(CONDITIONS)
    if conditions is None or not (conditions["status"] in PASSING or (course.faster and course.else_met)):
        refuted = conditions is not None and conditions["status"] == "refuted"
        return ProofOutcome("refuted" if refuted else "undecided", {CONDITIONS: conditions})
    return ProofOutcome("tested" if conditions["exercised"] else "idle")


def pairs(run: Mapping[str, Any]) -> Iterator[Near]:
    """The smallest distances of a run, an entry of report.json; two robots may be there twice."""
    for kind in ("min_distance_m", "min_robot_distance_m"):
        for robot, others in run["metrics"][kind].items():
            for other, found in others.items():
                value, required = found["value"], found["safe_distance_m"]
                appeared = bool(found.get("appeared"))
                moves = bool(found.get("moves"))
                yield Near(value - required, robot, other, value, required, found["t_s"], appeared, moves)


def claims(document: Document, *names: str, run: str | None = None) -> list[Mapping[str, Any]]:
    """The claims with these names; `run`: only those about this run, '' for the model."""
    return [claim for claim in document["claims"] if claim["id"] in names and run in (None, claim["run"])]


def tolerance(document: Document) -> str:
    """The arrival tolerance of the scenario with its unit, '' if it is the default."""
    from airground_drake.scenarios.schema import Scenario  # pydantic would delay `index --help`

    value = document["scenario"]["resolved"]["arrival_tolerance_m"]
    default = next(each.default for each in fields(Scenario) if each.name == "arrival_tolerance_m")
    return "" if value == default else f"{value:g} m"


def triggers(document: Document) -> list[Mapping[str, Any]]:
    """Events of the kind `trigger`, of all runs."""
    return [event for run in document["runs"].values() for event in run["events"] if event["kind"] == "trigger"]


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    told = metres(value_m, required_m)
    return f"{told} (overlap)" if told.startswith("-") else told


def metres(value_m: float, required_m: float) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    decimals = 3
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
