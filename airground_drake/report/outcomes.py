"""What came of the runs of a report, from report.json alone: facts, which the first screen puts into words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from math import dist
from typing import Any, Literal, NamedTuple

from airground_drake.base.statuses import PASSING
from airground_drake.registry import METHODS
from airground_drake.run.collisions import first_collisions

SLACK_M = 1e-9
"""A distance counts as kept if it falls short of the required one by less, as in SAFE-TRACE."""

THEOREMS, BUDGET, CONDITIONS = ("SAFE-INV", "SAFE-GATE"), "SAFE-BUDGET", "SAFE-HYP"
"""The claims that prove the safety of method (d). BUDGET joins them if bodies are not at the steered points. CONDITIONS
checks that a run met their conditions."""
DECLARED = "declared speed"
"""The hypothesis of SAFE-HYP that is about obstacles that move alone."""

UNJUDGED: Mapping[str, Any] = {
    "status": "", "exercised": 0, "as_expected": None, "evidence": {}, "counterexample": None,
}  # fmt: skip
"""What is known of a claim that was not judged."""
NOT_RUN: Mapping[str, Any] = {
    "events": [], "faults": [],
    "metrics": {
        "min_distance_m": {}, "min_robot_distance_m": {}, "on_the_way": {}, "without_proposals": [],
        "lost_at_the_end": [],
    },
}  # fmt: skip
"""What is known of a run that was not run."""

Document = Mapping[str, Any]


class Near(NamedTuple):
    """The smallest distance of a pair: the gap between the surfaces, below 0 if they overlap.

    `appeared`: at the instant at which the other one appeared. `moves`: the other one may move, and no theorem keeps
    its distance. `at_m`: the place of the map that was nearest, m, if the other one is the map.
    """

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float
    appeared: bool = False
    moves: bool = False
    at_m: Sequence[float] | None = None

    @property
    def whom(self) -> str:
        """The other one in words."""
        return named(self.other, self.at_m)

    @property
    def is_short(self) -> bool:
        """Whether the distance was not kept."""
        return self.margin_m < -SLACK_M

    def __str__(self) -> str:
        """The distance, without the pair."""
        return distance(self.value_m, self.required_m)

    @property
    def compared(self) -> str:
        """The distance beside the required one."""
        return f"{self} {'<' if self.is_short else '≥'} {self.required_m:g} m"

    @property
    def pair(self) -> str:
        """The distance, between whom, and whether it was there from the start."""
        return f"{self} ({self.between})"

    @property
    def between(self) -> str:
        """The pair, and whether its smallest distance was there from the start."""
        return f"{self.robot} to {self.whom}{', at the start' * (self.t_s == 0.0)}"


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


class RunOutcome:
    """What came of a run that the scenario names.

    Attributes:
        name: of the run.
        method: its identifier.
        plain: whether priorities are composed as the package does it; False: by a recursion that is only compared.
        movers: obstacles that may move.
        walls: obstacles that are walls.
        unknown: obstacles that the UAV never hears of: not on its map, in a run whose UGVs send no answers.
        near: pairs, those of least margin first.
        safe: whether every pair kept its distance; None: not known.
        why: why that is not known, or what SAFE-TRACE says if the distances alone do not decide.
        declared_unsafe: whether the scenario declares that the run is not safe, and it is not.
        tested: whether any pair came near enough to be kept apart.
        encounters: obstacles that move and came too near to a robot, those of SAFE-OWN, by time.
        own_doing: whether a robot brought a distance below the required one itself; None: not known, or nothing moves.
        faster: obstacles that moved faster than declared, by name: their entries in SAFE-HYP.
        else_met: whether all other hypotheses of SAFE-HYP held, so that all other distances are proved.
        hits: robots that collided, and the event of the first collision of each. What they do later does not count.
        arrived_s: robots that arrived, and when, s.
        away: robots that did not arrive, and where they ended; None: not known.
        there: how many UGVs arrived.
        stuck: robots among those away that stand where the scenario declares a stall.
        on_the_way: UGVs among them that did not collide, and how far they had come (`metrics.on_the_way`).
        no_way: UGVs that the UAV was called for and found no way for.
        proof: of its safety under method (d); None under other methods, and of a run that is not plain.
    """

    def __init__(self, document: Document, name: str) -> None:
        """The outcome of the run with this name."""
        resolved, run = document["scenario"]["resolved"], document["runs"].get(name, NOT_RUN)
        spec, obstacles = resolved["runs"][name], resolved.get("obstacles", {})
        judged = [*claims(document, run=""), *([] if run is NOT_RUN else claims(document, run=name))]
        found = {each["id"]: each for each in judged}
        self.name, self.method, self.plain = name, str(spec["method"]), spec["composition"] == "augmented"
        self.movers = [each for each, of in obstacles.items() if of.get("moves") or of.get("max_speed_m_s")]
        self.walls = [each for each, of in obstacles.items() if of.get("segment_m")]
        silent = self.helped and self.method in METHODS and not METHODS[self.method].gated
        self.unknown = [each for each, of in obstacles.items() if silent and not of.get("known_to_uav", True)]

        unique = {frozenset((pair.robot, pair.other)): pair for pair in reversed([*pairs(run)])}
        self.near = sorted(unique.values())
        self.hits = first_collisions(run["events"])
        kept = found.get("SAFE-TRACE", UNJUDGED)
        is_short = bool(self.hits) or any(near.is_short for near in self.near)
        self.safe = False if is_short or kept["status"] == "refuted" else True if kept["status"] in PASSING else None
        self.why = "" if is_short or self.safe else _why(kept["status"], is_run=run is not NOT_RUN)
        self.declared_unsafe = kept["status"] == "refuted" and kept["as_expected"] is True
        self.tested = kept["exercised"] != 0

        own, conditions = found.get("SAFE-OWN", UNJUDGED), found.get(CONDITIONS, UNJUDGED)
        is_judged = own["status"] in (*PASSING, "refuted")
        self.own_doing = own["status"] == "refuted" if is_judged else None
        self.encounters: list[Mapping[str, Any]] = []
        if is_judged:
            self.encounters = own["evidence"].get("came_too_near_themselves", [])
        rows = conditions["evidence"].get("beside_moving", [])
        self.faster = {each["second"]: each for each in rows if each["too_fast_s"] is not None}
        against = conditions["counterexample"] or {}
        only_speed = against.get("hypothesis") == DECLARED and not against.get("also_broken")
        proved = any(claim["status"] == "proved" for claim in claims(document, THEOREMS[0]))
        self.else_met = proved and (conditions["status"] in PASSING or only_speed)
        self.proof = self._proof(found, resolved) if self.method == "d" and self.plain else None

        self.arrived_s = {event["robot"]: event["t_s"] for event in run["events"] if event["kind"] == "arrival"}
        self.away = None if run is NOT_RUN else self._away(resolved, run["metrics"]["final_position_m"])
        self.there = len(resolved["ugvs"].keys() - self.away.keys()) if self.away is not None else 0
        ends = found.get("LIVE-GOAL", UNJUDGED)["evidence"].get("conditions", [])
        stands = (each for each in ends if each.get("condition") == "stands" and each["margin_m"] >= 0.0)
        self.stuck = {each["robot"] for each in stands} & (self.away or {}).keys()
        self.on_the_way: Mapping[str, Mapping[str, Any]] = run["metrics"]["on_the_way"]
        self.no_way = no_way(run)

    def _proof(self, found: Mapping[str, Mapping[str, Any]], resolved: Mapping[str, Any]) -> ProofOutcome:
        """Whether the run was proved safe; theorems may have been judged for this run alone.

        That an obstacle moved faster than declared leaves the proofs for all other pairs as they are.
        """
        plants = [plant for robot in (*resolved["ugvs"].values(), resolved["uav"]) for plant in robot.get("plant", ())]
        theorems = (*THEOREMS, *((BUDGET,) * any(plant["kind"] != "first_order" for plant in plants)))
        unproved = {name: found.get(name) for name in theorems if found.get(name, UNJUDGED)["status"] != "proved"}
        if unproved:
            return ProofOutcome("unproved", unproved)
        conditions = found.get(CONDITIONS, UNJUDGED)
        if conditions["status"] in PASSING or (self.faster and self.else_met):
            return ProofOutcome("tested" if conditions["exercised"] else "idle")
        status: Literal["refuted", "undecided"] = "refuted" if conditions["status"] == "refuted" else "undecided"
        return ProofOutcome(status, {CONDITIONS: found.get(CONDITIONS)})

    def _away(self, resolved: Mapping[str, Any], ends: Mapping[str, Sequence[float]]) -> dict[str, Sequence[float]]:
        uav = resolved["uav"]
        targets = {name: ugv["target_m"] for name, ugv in resolved["ugvs"].items()} | {uav["name"]: uav["target_m"]}
        home = {robot for robot, at in targets.items() if dist(ends[robot], at) <= resolved["arrival_tolerance_m"]}
        home = (home - self.hits.keys()) | (self.arrived_s.keys() & self.hits.keys())
        away = {robot: ends[robot] for robot in targets if robot not in home}
        if len(away) > 1 and uav["name"] not in self.hits:
            away.pop(uav["name"], None)  # it follows the UGVs: it is not home before they are
        return away

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


def _why(status: str, *, is_run: bool) -> str:
    """Why it is not known whether a run was safe, or why it was not."""
    if status == "refuted":
        return "SAFE-TRACE is refuted"
    told = f"SAFE-TRACE: {status.replace('_', ' ')}" if status else "SAFE-TRACE was not checked"
    return told if is_run else "it was not run"


def courses(document: Document) -> list[RunOutcome]:
    """What came of every run that the scenario names, in its order."""
    return [RunOutcome(document, name) for name in document["scenario"]["resolved"]["runs"]]


def no_way(run: Mapping[str, Any]) -> list[str]:
    """UGVs that the UAV was called for and found no way for in a run, ever or at the end, though no policy failed."""
    failed = {fault["robot"] for fault in run["faults"]}
    lost = [*run["metrics"]["without_proposals"], *run["metrics"]["lost_at_the_end"]]
    return [ugv for ugv in dict.fromkeys(lost) if ugv not in failed]


def pairs(run: Mapping[str, Any]) -> Iterator[Near]:
    """The smallest distances of a run, an entry of report.json; two robots may be there twice."""
    for kind in ("min_distance_m", "min_robot_distance_m"):
        for robot, others in run["metrics"][kind].items():
            for other, found in others.items():
                value, required = found["value"], found["safe_distance_m"]
                flags = bool(found.get("appeared")), bool(found.get("moves"))
                yield Near(value - required, robot, other, value, required, found["t_s"], *flags, found.get("at_m"))


def claims(document: Document, *names: str, run: str | None = None) -> list[Mapping[str, Any]]:
    """The claims with these names, all if none is given; `run`: only those about this run, '' for the model."""
    return [each for each in document["claims"] if each["id"] in (names or [each["id"]]) and run in (None, each["run"])]


def tolerance(document: Document) -> str:
    """The arrival tolerance of the scenario with its unit, '' if it is the default."""
    from airground_drake.scenarios.schema import Scenario  # pydantic would delay `index --help`

    value = document["scenario"]["resolved"]["arrival_tolerance_m"]
    default = next(each.default for each in fields(Scenario) if each.name == "arrival_tolerance_m")
    return "" if value == default else f"{value:g} m"


def triggers(document: Document) -> list[Mapping[str, Any]]:
    """Events of the kind `trigger`, of all runs."""
    return [event for run in document["runs"].values() for event in run["events"] if event["kind"] == "trigger"]


def named(body: str, at_m: Sequence[float] | None = None) -> str:
    """The name of a body in words; of the map, which is everywhere, with the place that is meant, m."""
    return f"the map at ({', '.join(f'{each + 0.0:.2f}' for each in at_m)})" if at_m else body


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    told = metres(value_m, required_m)
    return f"{told} (overlap)" if told.startswith("-") else told


def metres(value_m: float, required_m: float, decimals: int = 3) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
