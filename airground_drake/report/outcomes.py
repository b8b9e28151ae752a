"""What came of the runs of a report, from report.json alone: facts, which `answers` and `summary` put into words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import dist
from typing import Any, NamedTuple

from airground_drake.base.statuses import PASSING
from airground_drake.registry import METHODS

SLACK_M = 1e-9
"""A distance counts as kept if it falls short of the required one by less, as in SAFE-TRACE."""

Document = Mapping[str, Any]


class Near(NamedTuple):
    """The smallest distance of a pair, of centres; `appeared`: at the instant at which the other one appeared."""

    margin_m: float
    robot: str
    other: str
    value_m: float
    required_m: float
    t_s: float
    appeared: bool = False

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


@dataclass
class Course:
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
        collisions: events.
        away: robots that did not end at their targets, and where they did; None: not known.
        stuck: robots among them that stand where the scenario declares a stall.
        last_s: when the last robot arrived, s.
        there: how many UGVs ended at their targets.
    """

    name: str
    method: str
    plain: bool
    near: list[Near] = field(default_factory=list)
    safe: bool | None = None
    why: str = "it was not run"
    declared_unsafe: bool = False
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


def courses(document: Document) -> list[Course]:
    """What came of every run that the scenario names, in its order."""
    found = []
    for name, spec in document["scenario"]["resolved"]["runs"].items():
        course = Course(name, str(spec["method"]), spec["composition"] == "augmented")
        if name in document["runs"]:
            _judge(course, document)
            _locate(course, document)
        found.append(course)
    return found


def _judge(course: Course, document: Document) -> None:
    """Whether the run was safe, by its distances and by SAFE-TRACE."""
    run = document["runs"][course.name]
    unique = {frozenset((pair.robot, pair.other)): pair for pair in reversed([*pairs(run)])}
    course.near = sorted(unique.values())
    course.collisions = [event for event in run["events"] if event["kind"] == "collision"]
    unchecked: Mapping[str, Any] = {"status": "", "exercised": 0, "as_expected": False}
    claim = next(iter(claims(document, "SAFE-TRACE", run=course.name)), unchecked)
    status = claim["status"]
    course.tested = claim["exercised"] != 0
    course.declared_unsafe = status == "refuted" and claim["as_expected"]
    if course.collisions or (course.near and course.near[0].is_short):
        course.safe, course.why = False, ""
    elif status == "refuted":
        course.safe, course.why = False, "SAFE-TRACE is refuted"
    elif status in PASSING:
        course.safe, course.why = True, ""
    else:
        course.why = f"SAFE-TRACE: {status.replace('_', ' ')}" if status else "SAFE-TRACE was not checked"


def _locate(course: Course, document: Document) -> None:
    """Who arrived in the run, and where the others are."""
    resolved, run = document["scenario"]["resolved"], document["runs"][course.name]
    uav, ends = resolved["uav"], run["metrics"]["final_position_m"]
    targets = {name: ugv["target_m"] for name, ugv in resolved["ugvs"].items()} | {uav["name"]: uav["target_m"]}
    course.away = {
        robot: ends[robot]
        for robot, target in targets.items()
        if robot not in ends or dist(ends[robot], target) > resolved["arrival_tolerance_m"]
    }
    if len(course.away) > 1:
        course.away.pop(uav["name"], None)  # it follows the UGVs: it is not home before they are
    for goal in claims(document, "LIVE-GOAL", run=course.name):
        stands = (each for each in goal["evidence"].get("conditions", []) if each.get("condition") == "stands")
        course.stuck = {each["robot"] for each in stands if each["margin_m"] >= 0.0} & course.away.keys()
    course.there = len(resolved["ugvs"].keys() - course.away.keys())
    course.last_s = max((event["t_s"] for event in run["events"] if event["kind"] == "arrival"), default=0.0)


def pairs(run: Mapping[str, Any]) -> Iterator[Near]:
    """The smallest distances of a run, an entry of report.json; two robots may be there twice."""
    for kind in ("min_distance_m", "min_robot_distance_m"):
        for robot, others in run["metrics"][kind].items():
            for other, found in others.items():
                value, required = found["value"], found["safe_distance_m"]
                appeared = bool(found.get("appeared"))
                yield Near(value - required, robot, other, value, required, found["t_s"], appeared)


def claims(document: Document, *names: str, run: str | None = None) -> list[Mapping[str, Any]]:
    """The claims with these names; `run`: only those about this run, '' for the model."""
    return [claim for claim in document["claims"] if claim["id"] in names and run in (None, claim["run"])]


def proved_for_d(document: Document, every: Sequence[Course]) -> bool:
    """Whether both safety theorems are proved, and every run of method (d) met their hypotheses and tested them."""
    runs = [course.name for course in every if course.method == "d"]
    met = [claim for claim in claims(document, "SAFE-HYP") if claim["run"] in runs]
    return (
        [claim["status"] for claim in claims(document, "SAFE-INV", "SAFE-GATE", run="")] == ["proved", "proved"]
        and len(met) == len(runs) > 0
        and all(claim["status"] in PASSING and claim["exercised"] for claim in met)
    )


def triggers(document: Document) -> list[Mapping[str, Any]]:
    """Events of the kind `trigger`, of all runs."""
    return [event for run in document["runs"].values() for event in run["events"] if event["kind"] == "trigger"]


def distance(value_m: float, required_m: float) -> str:
    """A distance in words; if it falls short, with enough decimals to show a smaller number than the required one."""
    decimals = 3
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{value_m:.{decimals}f} m"
