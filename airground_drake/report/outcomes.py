"""What came of the runs of a report, from report.json alone: facts, which `summary` puts into words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import dist
from typing import Any, NamedTuple

from airground_drake.base.statuses import PASSING, UNDECIDED
from airground_drake.registry import METHODS

SLACK_M = 1e-9
"""Distances that fall short of the required one by less are kept, as in SAFE-TRACE."""

Document = Mapping[str, Any]


class Near(NamedTuple):
    """The smallest distance of a pair, of centres."""

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float

    def told(self) -> str:
        """The distance, of whom, and whether it was there from the start."""
        start = ", at the start" if self.t_s == 0.0 else ""
        return f"{distance(self.value_m, self.required_m)} ({self.robot} to {self.other}{start})"


@dataclass
class Course:
    """What came of a run.

    Attributes:
        name: of the run.
        method: its identifier.
        plain: whether priorities are composed as the package does it; False: by a recursion that is only compared.
        near: pairs, those of least margin first.
        safe: whether every pair kept its distance; None: nobody knows.
        why: why nobody knows, or what the claim says where the distances do not.
        tested: whether any pair came near enough to be kept apart.
        collisions: events.
        away: robots that did not end at their targets, and where they did.
        stuck: those of them that stand where the scenario says that they stall.
        last_s: when the last robot arrived, s.
        there: how many UGVs ended at their targets.
    """

    name: str
    method: str
    plain: bool
    near: list[Near] = field(default_factory=list)
    safe: bool | None = None
    why: str = "it was not run"
    tested: bool = False
    collisions: list[Mapping[str, Any]] = field(default_factory=list)
    away: dict[str, Sequence[float]] | None = None
    stuck: set[str] = field(default_factory=set)
    last_s: float = 0.0
    there: int = 0

    @property
    def helped(self) -> bool:
        """Whether the UAV intervenes."""
        return METHODS[self.method].intervenes if self.method in METHODS else True

    @property
    def fine(self) -> bool:
        """Whether every distance was kept and every robot arrived."""
        return self.safe is True and self.away == {}

    @property
    def crashed(self) -> bool:
        """Whether a robot collided."""
        return bool(self.collisions)


def courses(document: Document) -> list[Course]:
    """What came of every run that the scenario names, in its order."""
    resolved = document["scenario"]["resolved"]
    return [
        _course(document, name, run)
        if name in document["runs"]
        else Course(name, str(run["method"]), run["composition"] == "augmented")
        for name, run in resolved["runs"].items()
    ]


def _course(document: Document, name: str, spec: Mapping[str, Any]) -> Course:
    resolved, run = document["scenario"]["resolved"], document["runs"][name]
    metrics, uav = run["metrics"], resolved["uav"]
    pairs: dict[frozenset[str], Near] = {}
    for kind in ("min_distance_m", "min_robot_distance_m"):
        for robot, others in metrics[kind].items():
            for other, found in others.items():
                value, required = found["value"], found["safe_distance_m"]
                pair = Near(value - required, robot, other, value, required, found["t_s"])
                pairs.setdefault(frozenset((robot, other)), pair)
    near = sorted(pairs.values())
    hits = [event for event in run["events"] if event["kind"] == "collision"]
    claim = next((each for each in document["claims"] if (each["id"], each["run"]) == ("SAFE-TRACE", name)), None)
    safe, why = _judged(claim, bool(hits) or bool(near and near[0].margin_m < -SLACK_M))
    targets = {**{ugv: each["target_m"] for ugv, each in resolved["ugvs"].items()}, uav["name"]: uav["target_m"]}
    ends = metrics["final_position_m"]
    off = {
        robot: ends[robot]
        for robot, target in targets.items()
        if robot not in ends or dist(ends[robot], target) > resolved["arrival_tolerance_m"]
    }
    if len(off) > 1:
        off.pop(uav["name"], None)  # it follows the UGVs: where they are not home, neither is it
    goal = next((each for each in document["claims"] if (each["id"], each["run"]) == ("LIVE-GOAL", name)), None)
    conditions = goal["evidence"].get("conditions", []) if goal else []
    stuck = {
        each["robot"] for each in conditions if each.get("condition") == "stands" and each["margin_m"] >= 0.0
    } & off.keys()
    arrivals = [event["t_s"] for event in run["events"] if event["kind"] == "arrival"]
    there = len(resolved["ugvs"].keys() - off.keys())
    tested = claim is not None and claim["exercised"] != 0
    method, plain = str(run["method"]), spec["composition"] == "augmented"
    return Course(name, method, plain, near, safe, why, tested, hits, off, stuck, max(arrivals, default=0.0), there)


def _judged(claim: Mapping[str, Any] | None, short: bool) -> tuple[bool | None, str]:
    """Whether a run was safe, by its distances and by SAFE-TRACE, and what the claim says if that decides."""
    if short:
        return False, ""
    if claim is None:
        return None, "SAFE-TRACE was not checked"
    if claim["status"] == "refuted":
        return False, "SAFE-TRACE is refuted"
    if claim["status"] in UNDECIDED:
        return None, f"SAFE-TRACE: {claim['status'].replace('_', ' ')}"
    return True, ""


def proved_for_d(document: Document, every: Sequence[Course]) -> bool:
    """Whether both safety theorems are proved, and every run of method (d) met their hypotheses and tested them."""
    theorems = statuses(document, ("SAFE-INV", "SAFE-GATE"))
    runs = [course.name for course in every if course.method == "d"]
    met = [c for c in document["claims"] if c["id"] == "SAFE-HYP" and c["run"] in runs]
    return (
        len(theorems) == 2
        and set(theorems) == {"proved"}
        and len(met) == len(runs) > 0
        and all(claim["status"] in PASSING and claim["exercised"] for claim in met)
    )


def statuses(document: Document, names: Sequence[str]) -> list[str]:
    """Statuses of the claims about the model that have these names."""
    return [str(claim["status"]) for claim in document["claims"] if claim["id"] in names and not claim["run"]]


def distance(value_m: float, required_m: float) -> str:
    """A distance, with as many decimals as it takes to tell it from the required one that it falls short of."""
    decimals = 3
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{value_m:.{decimals}f} m"
