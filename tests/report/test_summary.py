"""The first screen of a report: each of its sentences follows from what was drawn, and nothing is left out.

`World` is drawn and made into a report. `SAYS` lists the sentences that the screen may have, each with what must then
be true of the world; it knows nothing of the code that writes them. A sentence that is not listed fails.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from string import Formatter
from typing import Any, NamedTuple, get_args, get_type_hints

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground_drake.base.statuses import PASSING, STATUSES, UNDECIDED
from airground_drake.registry import METHODS
from airground_drake.report import summary
from airground_drake.report.outcomes import ProofOutcome
from airground_drake.report.sentences import SENTENCES, Line

Document = dict[str, Any]
TARGETS = {"ugv1": [0.0, 9.0, 0.0], "ugv2": [5.0, 9.0, 0.0], "uav": [0.0, 9.0, 2.0]}
STUCK, D, T = [3.369, 5.102, 0.0], 2.0, 11.35
RUNS, ROBOT = r"(\w+(?:, \w+)*(?: and \w+)?)", r"(?:ugv\d|uav)"
ROBOTS = rf"{ROBOT}(?:(?:, | and ){ROBOT})*"


def names(text: str | None) -> list[str]:
    return re.findall(r"\w+", (text or "").replace(" and ", " "))


class End(NamedTuple):
    """How a robot ended: `home` since t_s, or `stuck`, `stands`, `moves` (with left_s to go)."""

    how: str = "home"
    t_s: float = 20.0
    left_s: float | None = None


class Hit(NamedTuple):
    """A collision of a robot with an obstacle or another robot."""

    t_s: float
    robot: str
    other: str


@dataclass
class Ran:
    """What a scenario says of a run, and what happened in it."""

    method: str = "d"
    printed: bool = False
    there: bool = True
    near: tuple[float, float, float] = (D, T, 3.0)
    """Distance of ugv1 to the rock, m, and when, s; distance to the UAV, m, 1 m needed."""
    ends: dict[str, End] = field(default_factory=dict)
    hits: list[Hit] = field(default_factory=list)
    triggers_s: list[float] = field(default_factory=list)
    unasked: list[str] = field(default_factory=list)
    """UGVs that got no proposal although the UAV was called; for ugv1 a policy may have failed."""
    failed: bool = False
    claims: dict[str, tuple[str, int, bool, float]] = field(default_factory=dict)
    """Verdicts by claim: status, how often tested, as expected, smallest gap between triggers, s."""
    messages: tuple[int, int] = (0, 0)
    """Proposals sent, and answers under a method with answers."""
    wanted: int = 0
    """How many messages the scenario expects at least; 0: it says nothing."""

    @property
    def sent(self) -> tuple[int, int]:
        return {"a": (0, 0), "b": (self.messages[0], 0)}.get(self.method, self.messages)

    def end(self, robot: str) -> End:
        return self.ends.get(robot, End())

    @property
    def first(self) -> dict[str, Hit]:
        """The first collision of each robot."""
        return {body: hit for hit in sorted(self.hits, reverse=True) for body in (hit.robot, hit.other)
                if body in TARGETS}  # fmt: skip

    def arrived(self, robot: str) -> bool:
        end = self.end(robot)
        return end.how == "home" and end.t_s < (self.first[robot].t_s if robot in self.first else inf)

    @property
    def away(self) -> set[str]:
        found = {robot for robot in TARGETS if not self.arrived(robot)}
        return found - {"uav"} if len(found) > 1 and "uav" not in self.first else found

    @property
    def lost(self) -> set[str]:
        """UGVs that the UAV found no way for."""
        return {*self.unasked} - ({"ugv1"} if self.failed else set())

    @property
    def margin_m(self) -> float:
        return min(self.near[0] - D, self.near[2] - 1.0)

    @property
    def short(self) -> int:
        """How many pairs came too near."""
        return (self.near[0] < D) + (self.near[2] < 1.0)

    @property
    def safe(self) -> bool | None:
        status = self.claims["SAFE-TRACE"][0] if "SAFE-TRACE" in self.claims else ""
        if not self.there or not (self.hits or self.short or status in (*PASSING, "refuted")):
            return None
        return not (self.hits or self.short or status == "refuted")

    @property
    def fine(self) -> bool:
        return self.safe is True and not self.away


@dataclass
class World:
    """A report: runs, theorems, and rows of the comparison with the paper (status, of run, distance from it, m)."""

    runs: dict[str, Ran]
    theorems: dict[str, str] = field(default_factory=dict)
    """Verdicts of SAFE-INV, SAFE-GATE and ZENO-PROOF, as far as they were judged."""
    rows: list[tuple[str, str, float]] = field(default_factory=list)
    tolerance_m: float = 0.1
    drifts: dict[str, float] = field(default_factory=dict)
    """What the threshold costs for the drift and the noise of a UGV in a run: how much more risk, c1 being 0.5 1/s."""

    def named(self, text: str | None) -> list[Ran]:
        """The runs that a list names, and which were run."""
        return [self.runs[name] for name in names(text)]

    @property
    def main(self) -> dict[str, Ran]:
        """The runs that the headline is about: in a comparison with the paper not those with its recursion."""
        return {name: ran for name, ran in self.runs.items() if not (ran.printed and self.rows)} or self.runs

    @property
    def of_d(self) -> set[str]:
        """The runs of method (d) as the package composes it."""
        return {name for name, ran in self.runs.items() if ran.method == "d" and not ran.printed}

    def meant(self, text: str, among: Iterable[str]) -> set[str]:
        """The runs that a text means, by name or by method, "(d)", which stands for all of its runs."""
        text, methods = re.sub(r"\((\w)\)", "", text), re.findall(r"\((\w)\)", text)
        found = {name for name in among if self.runs[name].method in methods or re.search(rf"\b{name}\b", text)}
        assert {self.runs[name].method for name in found} >= {*methods}
        return found

    @property
    def fired_s(self) -> list[float]:
        """Times of all triggers, s."""
        return sorted(t_s for ran in self.runs.values() if ran.there for t_s in ran.triggers_s)

    @property
    def unjudged(self) -> bool:
        return any(ran.safe is None for ran in self.main.values())

    @property
    def unproved(self) -> set[str]:
        """Safety theorems that are not proved."""
        return {name for name in ("SAFE-INV", "SAFE-GATE") if self.theorems.get(name) != "proved"}

    def proof(self, name: str) -> str:
        """Whether a run of (d) is proved safe."""
        status, count, *_ = self.runs[name].claims.get("SAFE-HYP", ("", 0)) if self.runs[name].there else ("", 0)
        if self.unproved:
            return "unproved"
        return "refuted" if status == "refuted" else ("tested" if count else "idle") if status in PASSING else "open"

    @property
    def judged(self) -> list[tuple[str, str, str, int, bool]]:
        """All claims: which, on which run, status, how often tested, as expected."""
        found = [(name, "", status, 6, True) for name, status in self.theorems.items()]
        return found + [(name, run, *verdict[:3]) for run, ran in self.runs.items() if ran.there
                        for name, verdict in ran.claims.items()]  # fmt: skip

    @property
    def numbers(self) -> list[dict[str, Any]]:
        """Numbers that are expected, as in report.json."""
        return [{"id": "messages", "run": name, "found": sum(ran.sent), "least": ran.wanted,
                 "as_expected": sum(ran.sent) >= ran.wanted} for name, ran in self.runs.items()
                if ran.there and ran.wanted]  # fmt: skip

    @property
    def differing(self) -> int:
        few = sum(ran.there and sum(ran.sent) < ran.wanted for ran in self.runs.values())
        return few + sum(not fine and status not in UNDECIDED for _, _, status, _, fine in self.judged)


def claim(name: str, run: str = "", status: str = "holds", **more: Any) -> Document:
    known = {"id": name, "run": run, "status": status, "expected": status, "as_expected": True, "exercised": 6}
    place = {"where": {}, "margin": -0.5, "unit": "m", "quantity": "", "exercised_by": "things", "inputs": {}}
    return {**known, **place, "evidence": {}, "counterexample": None, **more}


def late(late_s: float, false: int) -> Document:
    """A finding of THR-QUALITY: one trigger so late, and false alarms."""
    counts = {"served": 1, "early": 0, "false": false, "missed": 0}
    latest = {"late_s": late_s, "error_m": 5.84}
    told = {"counts": counts, "latest": latest, "earliest": None, "ddm": {}, "tolerance_m": 0.1}
    return {"margin": -late_s, "evidence": told}


def choice(rule: str, kind: str, extra: float, runs: Document, drift: float = 6.0) -> Document:
    """THR-CHOICE: what the threshold, 3 m, costs."""
    evidence = {
        "kind": kind, "rule": rule, "threshold_in_force_m": 3.0, "optimal_threshold_m": 2.992, "extra_risk": extra,
        "least_risk": 0.4, "runs": runs,
    }  # fmt: skip
    inputs = {"drift_m_s": drift, "noise_m_sqrt_s": 10.0, "c1_1_s": 0.5, "c2": 1.0}
    return claim("THR-CHOICE", evidence=evidence, inputs=inputs)


def own_numbers(extra: float, noise: float = 0.004, best: float = 0.28, drift: float = 0.56) -> Document:
    """What THR-CHOICE says of a UGV in a run."""
    return {
        "drift_m_s": drift, "noise_m_sqrt_s": noise, "threshold_m": 3.0, "optimum_m": best, "extra_risk": extra,
    }  # fmt: skip


def document(world: World) -> Document:
    """report.json as far as its first screen looks at it."""
    given = []
    for name, run, status, count, fine in world.judged:
        gap_s = world.runs[run].claims[name][3] if run else 0.0
        missed = {"hypothesis": "avoidance", "first": f"first_of_{run}", "margin": -0.5, "t_s": 7.0}
        found = {
            "ZENO-PROOF": {"inputs": {"dwell_s": 0.5}},
            "ZENO-TRACE": {"evidence": {"smallest_gap": {"gap_s": gap_s}}, "counterexample": {"gap_s": gap_s}},
            "SAFE-HYP": {"counterexample": missed},
            "THR-QUALITY": late(gap_s, 2 * (status == "refuted")),
        }  # fmt: skip
        given.append(claim(name, run, status, exercised=count, as_expected=fine, **found.get(name, {})))
    for run, ran in world.runs.items():
        stands = [{"robot": r, "condition": "stands", "margin_m": 0.0} for r in TARGETS if ran.end(r).how == "stuck"]
        given.append(claim("LIVE-GOAL", run, evidence={"conditions": stands}))
    if world.drifts:
        given.append(choice("bayes", "optimal", 0.0, {name: own_numbers(more) for name, more in world.drifts.items()}))
    specs = {name: {"method": ran.method, "composition": "recursion" if ran.printed else "augmented", "set": {}}
             for name, ran in world.runs.items()}  # fmt: skip
    resolved = {
        "runs": specs, "control": {"period_s": 0.05},
        "ugvs": {name: {"target_m": TARGETS[name], "max_speed_m_s": 9.0, "preset": {"speed_m_s": 1.0}}
                 for name in ("ugv1", "ugv2")},
        "uav": {"name": "uav", "target_m": TARGETS["uav"]}, "arrival_tolerance_m": world.tolerance_m,
        "decision": {"min_inter_event_s": 0.5, "trigger": "automaton", "noise_m_sqrt_s": 0.004},
        "gatekeeper": {"route": "mixed_integer", "rule": "hysteresis"},
    }  # fmt: skip
    rows = [
        {"id": f"A{k}", "status": status, "run": run, "robot": "ugv1", "measure": "stall_position",
         "ours": STUCK[:2], "paper": [STUCK[0], STUCK[1] - off]} for k, (status, run, off) in enumerate(world.rows)
    ]  # fmt: skip
    overall = {"status": "as_expected", "why": "", "unpromised": [], "checks": 1, "numbers": world.numbers}
    runs = {name: _run(ran) for name, ran in world.runs.items() if ran.there}
    return {"scenario": {"resolved": resolved}, "runs": runs, "reproduction": rows, "claims": given, "overall": overall,
            "seeds": []}  # fmt: skip


def _run(ran: Ran) -> Document:
    def event(kind: str, t_s: float, robot: str, **more: Any) -> Document:
        return {"kind": kind, "t_s": t_s, "robot": robot, "position_m": STUCK, **more}

    body = {True: "other", False: "obstacle"}
    events = [event("collision", t, r, **{body[o in TARGETS]: o}) for t, r, o in ran.hits]
    events += [event("arrival", ran.end(robot).t_s, robot) for robot in TARGETS if ran.arrived(robot)]
    events += [event("trigger", t_s, "ugv1") for t_s in ran.triggers_s]
    least, when, apart = ran.near
    rock = {"rock": {"value": least, "t_s": when, "safe_distance_m": D}}
    uav = {"uav": {"value": apart, "t_s": 0.0, "safe_distance_m": 1.0}}
    metrics = {
        "min_distance_m": {"ugv1": rock, "uav": {}}, "min_robot_distance_m": {"ugv1": uav, "uav": {}},
        "final_position_m": {r: TARGETS[r] if ran.end(r).how == "home" else STUCK for r in TARGETS},
        "on_the_way": {r: {"stands": ran.end(r).how != "moves", "creeps": False, "left_m": 9.0,
                           "left_s": ran.end(r).left_s}
                       for r in ("ugv1", "ugv2") if not ran.arrived(r) and r not in ran.first},
        "without_proposals": ran.unasked, "lost_at_the_end": [], "gatekeeper": None,
        "messages": None if ran.method == "a" else {
            "proposals": ran.sent[0], "withdrawals": ran.sent[0] // 2, "answers": ran.sent[1],
            "always_on": {"proposals": 240, "answers": 480 * (ran.method in "cd")},
        },
    }  # fmt: skip
    faults = [{"robot": "ugv1", "policy": "mine", "what": "no", "t_s": 1.0}] * ran.failed
    return {"method": ran.method, "zeta_m": 3.0, "events": sorted(events, key=lambda e: e["t_s"]), "metrics": metrics,
            "faults": faults}  # fmt: skip


Says = Callable[..., Any]
SAYS: dict[str, list[tuple[re.Pattern[str], Says]]] = {}
"""By question: the sentences, as patterns, and what each says. A function gets the world, the mark, and the groups."""


def says(question: str, pattern: str) -> Callable[[Says], Says]:
    def add(check: Says) -> Says:
        SAYS.setdefault(question, []).append((re.compile(pattern), check))
        return check

    return add


def follows(world: World, question: str, line: Line) -> bool:
    """Whether a sentence is listed, once, and true."""
    found = [(check, match) for pattern, check in SAYS[question] if (match := pattern.fullmatch(line.text))]
    return len(found) == 1 and bool(found[0][0](world, line.mark, *found[0][1].groups()))


COLLISION, AT = r"(\w+) collides with (\w+) at ([\d.]+) s", r"at \(3\.37, 5\.10(?:, 0\.00)?\) m"
WITHIN, MORE = r"(\w+) comes within ([\d.]+) m of (\w+)", r"(?:; (\d+) more pairs? too close)?( \(expected\))?\."
HOW = r"(stuck|standing still|short of its target|still moving at the end)(?: \(about ([\d.]+) s more\))?"


def is_hit(ran: Ran, robot: str, other: str, time: str) -> bool:
    return any((hit.robot, hit.other, f"{hit.t_s:.2f}") == (robot, other, time) for hit in ran.first.values())


def is_declared(ran: Ran, expected: str | None) -> bool:
    status, _, fine, _ = ran.claims.get("SAFE-TRACE", ("", 0, False, 0.0))
    return bool(expected) == (status == "refuted" and fine)


def is_nearest(ran: Ran, robot: str, value: str, other: str) -> bool:
    apart, due = {"rock": (ran.near[0], D), "uav": (ran.near[2], 1.0)}[other]
    return (robot, ran.margin_m) == ("ugv1", apart - due) and abs(float(value) - apart) < 5e-4


def is_end(ran: Ran, robot: str, how: str, left: str | None) -> bool:
    end = ran.end(robot)
    if robot == "uav":
        return how == ("stuck" if end.how == "stuck" else "short of its target") and not left
    due = {"stuck": "stuck", "stands": "standing still", "moves": "still moving at the end"}[end.how]
    time = end.left_s if end.how == "moves" else None
    return how == due and (None if left is None else float(left)) == time


def is_trouble(ran: Ran, text: str) -> bool:
    """Whether a text says what went wrong in a run, all of it."""
    text, _, lost = text.partition(": the UAV found no way for ")
    told = re.findall(rf"({ROBOTS}) (?:is|are) {HOW}", text)
    ended = [(robot, how, left or None) for those, how, left in told for robot in names(those)]
    away = ran.away - ran.first.keys()
    right = {robot for robot, *_ in ended} == away and all(is_end(ran, *each) for each in ended)
    right = right and {*names(lost)} == {*ran.lost} & away
    if ran.safe is not False:
        return right
    if ran.first:
        return right and {*names(text.partition(" collide")[0])} == {*ran.first}
    if ran.short:
        return right and (near := re.match(WITHIN, text)) is not None and is_nearest(ran, *near.groups())
    return right and text.startswith("SAFE-TRACE is refuted")


@says("headline", r"Nothing was run\.")
def _(world: World, mark: str) -> bool:
    return not world.runs


@says("headline", rf"(?:Not decided: r|R)uns? {RUNS} could not be judged\.")
def _(world: World, mark: str, runs: str) -> bool:
    return {*names(runs)} == {name for name, ran in world.main.items() if ran.safe is None}


@says("headline", r"(With and without help, all|All) arrive safely\.")
def _(world: World, mark: str, who: str) -> bool:
    both = len({ran.method == "a" for ran in world.main.values()}) == 2
    return all(ran.fine for ran in world.main.values()) and both == (who != "All")


@says("headline", r"With help, all arrive safely\.")
def _(world: World, mark: str) -> bool:
    return all(ran.fine == (ran.method != "a") or ran.fine for ran in world.main.values())


@says("headline", r"Without it, (.*)\.")
def _(world: World, mark: str, told: str) -> bool:
    return all(is_trouble(ran, told) and not ran.fine for ran in world.main.values() if ran.method == "a")


@says(
    "headline", r"(Only )?(?:([Mm]ethod \(\w\)|[Rr]un \w+) is safe and brings|(.*) are safe and bring) everyone home\."
)
def _(world: World, mark: str, only: str | None, one: str | None, several: str | None) -> bool:
    fine = {name for name, ran in world.main.items() if ran.fine}
    return bool(fine) and world.meant(one or several or "", world.main) == fine and bool(only) != world.unjudged


@says("headline", r"(No method brings everyone home safely|Not safe)\.")
def _(world: World, mark: str, who: str) -> bool:
    unsafe = any(ran.safe is False for ran in world.main.values())
    due = "No method" if len(world.main) > 1 and not world.unjudged else "Not safe"
    return unsafe and not any(ran.fine for ran in world.main.values()) and who.startswith(due)


@says("headline", r"Safe, but not all arrive(?:: (.*))?\.")
def _(world: World, mark: str, told: str | None) -> bool:
    every = world.main.values()
    return all(ran.safe and ran.away for ran in every) and (not told or all(is_trouble(ran, told) for ran in every))


@says("headline", r"((?:Under \(|In run).*)\.")
def _(world: World, mark: str, clauses: str) -> bool:
    """What went wrong in runs: in all that are unsafe, or else in all where not all arrive."""
    told = dict(re.fullmatch(rf"(.*?), ((?:{ROBOT}|SAFE).*)", clause).groups() for clause in clauses.split("; "))  # type: ignore[union-attr]
    unsafe = {name for name, ran in world.main.items() if ran.safe is False}
    away = {name for name, ran in world.main.items() if ran.safe is not False and ran.there and ran.away}
    meant = {name: text for runs, text in told.items() for name in world.meant(runs, world.main)}
    if not meant:  # good news, but for collisions in runs with the printed recursion
        crashed = {name for name, ran in world.runs.items() if ran.hits and ran.printed}
        return {name for runs in told for name in world.meant(runs, world.runs)} == crashed
    right = all(is_trouble(world.runs[name], text) for name, text in meant.items())
    return right and {*meant} in (unsafe, unsafe | away, {n for n in unsafe | away if world.runs[n].method == "a"})


@says("headline", r"(\d+) checks? (?:is|are) not as declared\.")
def _(world: World, mark: str, count: str) -> bool:
    return int(count) == world.differing


@says("Messages", r"(.*)\. Always-on supervision: 240 proposals( and 480 answers)?\.")
def _(world: World, mark: str, told: str, answers: str | None) -> bool:
    """What each run took that sent anything, and what the scheme takes whose runs answer, too."""
    helped = {name: ran for name, ran in world.runs.items() if ran.there and ran.method != "a"}
    kinds = r"(\d+) proposals?(?:(?:,| and) (\d+) withdrawals?)?(?: and (\d+) answers?)?"
    parts = [re.fullmatch(rf"{RUNS}: {kinds}", part) for part in told.split("; ")]
    found = {name: (int(p[2]), int(p[3] or 0), int(p[4] or 0)) for p in parts if p for name in names(p[1])}
    sent = {name: (ran.sent[0], ran.sent[0] // 2, ran.sent[1]) for name, ran in helped.items() if ran.sent[0]}
    return not mark and found == sent and bool(answers) == any(ran.method in "cd" for ran in helped.values())


@says("Safe?", rf"(\w+): (\w+ collides .*?){MORE}")
def _(world: World, mark: str, run: str, told: str, more: str | None, expected: str | None) -> bool:
    ran, hits = world.runs[run], re.findall(COLLISION, told)
    assert all(re.fullmatch(COLLISION, each) for each in told.split("; "))
    complete = len({*hits}) == len(hits) == len({*ran.first.values()}) and all(is_hit(ran, *hit) for hit in hits)
    return mark == "no" and complete and int(more or 0) == max(0, ran.short - len(hits)) and is_declared(ran, expected)


@says("Safe?", rf"(\w+): {WITHIN} at ([\d.]+) s, required ([\d.]+) m{MORE}")
def _(world: World, mark: str, run: str, robot: str, value: str, other: str, *at: str | None) -> bool:
    ran, (time, due, more, expected) = world.runs[run], at
    right = (float(time or 0), float(due or 0)) == {"rock": (ran.near[1], D), "uav": (0.0, 1.0)}[other]
    right = right and not ran.hits and int(more or 0) == ran.short - 1 and is_declared(ran, expected)
    return mark == "no" and right and is_nearest(ran, robot, value, other)


@says("Safe?", r"(\w+): SAFE-TRACE is refuted( \(expected\))?\.")
def _(world: World, mark: str, run: str, expected: str | None) -> bool:
    ran = world.runs[run]
    return mark == "no" and not (ran.hits or ran.short) and ran.safe is False and is_declared(ran, expected)


@says("Safe?", rf"{RUNS}: not known, (.*)\.")
@says("Arrived?", rf"{RUNS}: not known, (it was not run)\.")
def _(world: World, mark: str, runs: str, why: str) -> bool:
    ran = [world.runs[name] for name in names(runs)]
    return mark == "open" and all(each.safe is None and each.there == (why != "it was not run") for each in ran)


@says("Safe?", rf"{RUNS}: minimum distance ([\d.]+) m \(ugv1 to (\w+)(, at the start)?\), required ([\d.]+) m(; .*)?\.")
def _(
    world: World, mark: str, runs: str, value: str, other: str, start: str | None, due: str, idle: str | None
) -> bool:
    kept = [ran for ran in world.runs.values() if ran.safe]
    least = min(kept, key=lambda ran: ran.margin_m)
    tested = any(ran.claims["SAFE-TRACE"][1] for ran in kept)
    right = [world.runs[name] for name in names(runs)] == kept and bool(start) == (other == "uav")
    right = right and any(is_nearest(ran, "ugv1", value, other) for ran in kept if ran.margin_m == least.margin_m)
    return (
        right
        and float(due) == {"rock": D, "uav": 1.0}[other]
        and (mark, bool(idle)) == ("yes" if tested else "none", not tested)
    )


@says("Safe?", r"(\d+) runs? with recursion \(5\) as printed: (all arrive, but )?(.*)\.")
def _(world: World, mark: str, count: str, home: str | None, told: str) -> bool:
    bad = [ran for ran in world.runs.values() if ran.printed and ran.safe is False and not ran.hits]
    right = int(count) == len(bad) and bool(home) == all(not ran.away for ran in bad)
    near = re.match(WITHIN, told)
    return mark == "no" and right and (not near or any(is_nearest(ran, *near.groups()) for ran in bad))


def proof(status: str, mark: str, pattern: str) -> None:
    """A sentence about the proof: its runs are those of (d) with that status, all of them if it says "(d)"."""

    @says("Safe?", pattern)
    def _(world: World, given: str, runs: str, why: str = "") -> bool:
        of_d = world.of_d
        meant = of_d if runs == "(d)" else {*names(runs)}
        told = {"refuted": "first_of_{}: avoidance missed by 0.5 m", "unproved": ""}.get(status, "")
        return (
            given == ("no" if status == "unproved" and "refuted" in map(world.theorems.get, world.unproved) else mark)
            and meant <= of_d
            and all(world.proof(name) == status and told.format(name) in why for name in meant)
            and (status != "unproved" or {*re.findall(r"(SAFE-\w+):", why)} == world.unproved)
        )


PROOF = re.compile(
    r"(?:Proved:|Proved for|The proof does not apply to|Not (?:proved for|known whether the proof applies to)) "
    r"(\(d\)|[\w, ]+?)(?:,? (?:\(|keep)|, but|: )"
)


proof("tested", "yes", r"Proved: (.*?) keeps? every distance, whatever the UAV asks\.")
proof("idle", "none", r"Proved for (.*), but nothing came near: its conditions hold with nothing to check\.")
proof("refuted", "no", r"The proof does not apply to (.*): its conditions did not hold \((SAFE-HYP: .*)\)\.")
proof("open", "open", r"Not known whether the proof applies to (.*) \((SAFE-HYP: .*)\)\.")
proof("unproved", "open", r"Not proved for (.*) \((.*)\)\.")


@says("Arrived?", rf"{RUNS}: all(?: within ([\d.]+) m of their targets)?, by ([\d.]+) s\.")
def _(world: World, mark: str, runs: str, within: str | None, by: str) -> bool:
    home = {name for name, ran in world.runs.items() if ran.there and not ran.away and not ran.printed}
    last = max(world.runs[name].end(robot).t_s for name in home for robot in TARGETS)
    shown = float(within) if within else 0.1
    return mark == "yes" and {*names(runs)} == home and by == f"{last:.1f}" and shown == world.tolerance_m


@says("Arrived?", rf"(\w+): (\w+) arrives at ([\d.]+) s; {COLLISION}: nothing after that counts\.")
def _(world: World, mark: str, run: str, who: str, since: str, *hit: str) -> bool:
    ran = world.runs[run]
    return (
        mark == "partly"
        and who in hit
        and is_hit(ran, *hit)
        and ran.arrived(who)
        and since == f"{ran.end(who).t_s:.1f}"
    )


@says("Arrived?", rf"{RUNS}: ({ROBOT} (?:is|collides) .*)\.")
def _(world: World, mark: str, runs: str, told: str) -> bool:
    """Each robot that did not arrive, where it is, and how far that is from the paper's place."""
    place = r"at \(3\.37, 5\.10(?:, 0\.00)?\) m(?:, ([\d.]+) m from the paper's)?"
    said = told.split("; ")
    hits = {m[:3]: m[3] for each in said for m in re.findall(rf"{COLLISION}, {place}: nothing after that counts", each)}
    ends = {m[:3]: m[3] for each in said for m in re.findall(rf"({ROBOT}) is {HOW} {place}", each)}
    lost = [found[1] for each in said if (found := re.fullmatch("the UAV found no way for (.*)", each))]
    assert len(hits) + len(ends) + len(lost) == len(said)
    for name in names(runs):
        ran = world.runs[name]
        off = [
            f"{off:.2f}" for status, run, off in world.rows if run == name and status in ("reproduced", "calibrated")
        ]
        right = {robot for robot, *_ in ends} == ran.away - ran.first.keys() and {*lost} == ran.lost & {
            robot for robot, *_ in ends
        }
        right = right and all(is_end(ran, robot, how, left or None) for robot, how, left in ends)
        due = {(h.robot, h.other, f"{h.t_s:.2f}") for robot, h in ran.first.items() if robot in ran.away}
        near = [of for (robot, *_), of in [*ends.items(), *hits.items()] if robot == "ugv1"]
        if not (right and {*hits} == due and (not near or (near[0] or None) == (off[0] if off else None))):
            return False
        if mark != ("no" if ran.method != "a" or ran.hits else "none"):
            return False
    return True


@says("Runs", r"(.*)\.")
def _(world: World, mark: str, told: str) -> bool:
    ours = ", half-plane problems of (26) solved to optimality, best plan by (26) kept, our hysteresis"
    due = [f"{name}: {METHODS[ran.method].says}{ours * (ran.method == 'c')}" for name, ran in world.runs.items()
           if not ran.printed]  # fmt: skip
    return told.split("; ") == due


def runs_with(world: World, claim: str, *statuses: str) -> list[str]:
    return [run for name, run, status, *_ in world.judged if name == claim and status in statuses and run]


@says("Zeno-free?", r"(Proved: triggers are at least 0\.5 s apart|Not proved \(ZENO-PROOF: (.*)\))\.")
def _(world: World, mark: str, told: str, status: str | None) -> bool:
    found = world.theorems["ZENO-PROOF"]
    due = {"proved": "yes", "refuted": "no"}.get(found, "open")
    return mark == due and (status or "proved") == found.replace("_", " ")


@says("Zeno-free?", r"(\w+): two triggers ([\d.]+) s apart\.")
def _(world: World, mark: str, run: str, gap: str) -> bool:
    status, *_, gap_s = world.runs[run].claims["ZENO-TRACE"]
    return (mark, status, float(gap)) == ("no", "refuted", gap_s)


@says("Zeno-free?", r"Seen: (\d+) gaps? between triggers; the smallest is ([\d.]+) s\.")
def _(world: World, mark: str, count: str, least: str) -> bool:
    seen = [world.runs[run].claims["ZENO-TRACE"] for run in runs_with(world, "ZENO-TRACE", *PASSING)]
    tested = [each for each in seen if each[1]]
    return mark == "" and (int(count), float(least)) == (sum(e[1] for e in tested), min(e[3] for e in tested))


@says("Zeno-free?", r"These runs cannot show it: (no UGV triggers twice|nothing triggered)\. Scenario dwell does\.")
def _(world: World, mark: str, why: str) -> bool:
    tested = any(world.runs[run].claims["ZENO-TRACE"][1] for run in runs_with(world, "ZENO-TRACE", *PASSING))
    return (
        not tested and not runs_with(world, "ZENO-TRACE", "refuted") and bool(world.fired_s) == why.startswith("no UGV")
    )


@says("Threshold?", r"(\w+): a trigger is missed, spurious or at the wrong time \(THR-TRIG\)\.")
def _(world: World, mark: str, run: str) -> bool:
    return mark == "no" and run in runs_with(world, "THR-TRIG", "refuted")


@says("Threshold?", rf"{RUNS}: not known whether triggers are missed \(THR-TRIG\)\.")
def _(world: World, mark: str, runs: str) -> bool:
    return mark == "open" and names(runs) == runs_with(world, "THR-TRIG", *UNDECIDED)


@says("Threshold?", r"Never fired: the threshold is 3 m\.")
def _(world: World, mark: str) -> bool:
    return mark == "none" and not world.fired_s


@says("Threshold?", r"Fired exactly when the decision variable reached 3 m, "
                    r"(?:(\d+) times(?: in (\d+) runs)?, first )?at ([\d.]+) s\.")  # fmt: skip
def _(world: World, mark: str, count: str | None, runs: str | None, first: str) -> bool:
    fired, sure = world.fired_s, not runs_with(world, "THR-TRIG", "refuted", *UNDECIDED)
    there = sum(ran.there and bool(ran.triggers_s) for ran in world.runs.values())
    numbers = (int(count or len(fired)), int(runs or there)) == (len(fired), there)
    return (
        mark == "yes" and sure and bool(runs_with(world, "THR-TRIG", *PASSING)) and float(first) == fired[0] and numbers
    )


def compared(world: World) -> dict[str, tuple[str, int, bool, float]]:
    """THR-QUALITY by run, where there was something to compare."""
    found = {name: world.runs[name].claims["THR-QUALITY"] for name in runs_with(world, "THR-QUALITY", *STATUSES)}
    return {name: each for name, each in found.items() if each[0] not in UNDECIDED and each[1]}


@says("Threshold?", rf"{RUNS}: not compared with the task error without noise \(THR-QUALITY\)\.")
def _(world: World, mark: str, runs: str) -> bool:
    return mark == "open" and names(runs) == runs_with(world, "THR-QUALITY", *UNDECIDED)


@says("Threshold?", rf"Against the task error without noise(?: \({RUNS}\))?: up to ([\d.]+) s late \(at 5\.84 m\), "
                    r"(no false alarm|2 of 3 false alarms), none missed\.")  # fmt: skip
def _(world: World, mark: str, runs: str | None, late_s: str, false: str) -> bool:
    meant = [compared(world)[name] for name in names(runs) or compared(world)]
    return all((each[0] == "refuted", each[3]) == (mark == "no", float(late_s)) for each in meant) and (
        mark == ("yes" if false == "no false alarm" else "no")
    )


@says("Threshold?", rf"{RUNS}: no worse\.")
def _(world: World, mark: str, runs: str) -> bool:
    late_s = {name: each[3] for name, each in compared(world).items()}
    return max(late_s[name] for name in names(runs)) <= min(late_s[name] for name in {*late_s} - {*names(runs)})


@says("Threshold?", r"3 m is the Bayes optimum for the assumed drift 6 m/s and noise 10 m/√s\.")
def _(world: World, mark: str) -> bool:
    return mark == "yes" and bool(world.drifts)


@says("Threshold?", r"For the drift and noise of ugv1 in run (\w+), (?:no threshold is better|"
                    r"0\.28 m is best; 3 m costs as much as a delay of ([\d.]+) s)\.")  # fmt: skip
def _(world: World, mark: str, run: str, delay_s: str | None) -> bool:
    """The run for whose numbers the threshold costs most."""
    most = max(world.drifts.values())
    costs = world.drifts[f"{run} ugv1"] == most and float(delay_s or 0.0) == most / 0.5
    return costs and mark == ("partly" if most else "yes")


@says("Paper?", r"(\d+) of (\d+) results match(.*)\.")
def _(world: World, mark: str, matched: str, of: str, rest: str) -> bool:
    found = [status for status, *_ in world.rows]
    plain, tuned, bad = (found.count(each) for each in ("reproduced", "calibrated", "not_reproduced"))
    due = "yes" if plain == len(found) else "partly" if plain + tuned else "no"
    counts = {"without tuning": plain, "after calibration": tuned}
    told = {says: int(count) for count, says in re.findall(r"(\d+) (without tuning|after calibration)", rest)}
    named = {f"A{k}" for k, status in enumerate(found) if status == "not_reproduced"}
    right = told == {says: count for says, count in counts.items() if count} and {*re.findall(r"A\d", rest)} == named
    return right and (mark, int(matched), int(of)) == (due, plain + tuned, len(found)) and bad == len(named)


@says("beware", r"real vehicles are safe: the model is first-order, its sensing perfect")
def _(world: World, mark: str) -> bool:
    return True


@says("beware", r"(.*) (?:is|are) also safe elsewhere: that was only seen in these runs")
def _(world: World, mark: str, who: str) -> bool:
    proved = {name for name in world.of_d if world.proof(name) in ("tested", "idle")}
    return world.meant(who, world.main) == {name for name, ran in world.main.items() if ran.safe} - proved


@says(
    "beware",
    r"(all|those that arrive here) also arrive from other starts or with other seeds: arrival is seen, not proved",
)
def _(world: World, mark: str, who: str) -> bool:
    home = [ran.there and not ran.away for ran in world.runs.values()]
    return any(home) and all(home) == (who == "all")


@says("beware", r"the UAV helps: it was never called")
def _(world: World, mark: str) -> bool:
    return not world.fired_s


@says("beware", r"what could not be judged is fine")
def _(world: World, mark: str) -> bool:
    return any(ran.safe is None for ran in world.runs.values())


HOME = st.builds(End, st.just("home"), st.sampled_from([5.0, 20.0, 23.6]), st.none())
ELSEWHERE = st.builds(
    End, st.sampled_from(["stuck", "stands", "moves"]), st.just(0.0), st.none() | st.sampled_from([0.5, 30.0, 120.0])
)
HIT_S, WHOM = st.sampled_from([2.0, 11.4, 22.0]), st.sampled_from(["rock", "ugv2", "uav"])
HITS = st.lists(
    st.builds(Hit, HIT_S, st.sampled_from(["ugv1", "ugv2"]), WHOM), max_size=3,
    unique_by=(lambda hit: hit.t_s, lambda hit: (hit.robot, hit.other)),
).map(lambda hits: [hit for hit in hits if hit.robot != hit.other])  # fmt: skip
CLAIMS = st.sampled_from(["SAFE-TRACE", "SAFE-HYP", "SAFE-HYP", "ZENO-TRACE", "THR-TRIG", "THR-QUALITY"])
VERDICTS = st.tuples(st.sampled_from([*STATUSES, "holds", "holds", "holds"]), st.sampled_from([0, 6, 6]),
                     st.sampled_from([True, True, True, False]), st.sampled_from([0.11, 0.61, 2.5]))  # fmt: skip
FINE: tuple[str, int, bool, float] = ("holds", 6, True, 0.61)
DISTANCES = st.tuples(
    st.sampled_from([0.5, 1.97664, D, D, 8.0]), st.sampled_from([T, 25.0]), st.sampled_from([0.4, 3.0, 3.0, 3.0])
)
JUDGED = st.dictionaries(CLAIMS, VERDICTS)
RANS = st.builds(
    Ran,
    st.sampled_from("abcddd"),
    st.sampled_from([False] * 4 + [True]),
    st.sampled_from([True] * 5 + [False]),
    DISTANCES,
    st.dictionaries(st.sampled_from([*TARGETS]), HOME | HOME | ELSEWHERE),
    st.just([]) | st.just([]) | HITS,
    st.lists(st.sampled_from([14.479, 16.0]), max_size=1),
    st.lists(st.sampled_from(["ugv1", "ugv2"]), max_size=1),
    st.booleans(),
    JUDGED | JUDGED.map(lambda given: {"SAFE-TRACE": FINE, "SAFE-HYP": FINE} | given),
    st.sampled_from([(0, 0), (1, 0), (1, 1), (6, 41)]),
    st.sampled_from([0, 0, 0, 2]),
)
THEOREM = st.sampled_from(["proved", "proved", "proved", "proved", "refuted", "inconclusive"])
THEOREMS = ("SAFE-INV", "SAFE-GATE", "ZENO-PROOF")
ROWS = st.tuples(
    st.sampled_from(["reproduced", "calibrated", "not_reproduced"]),
    st.sampled_from("klmn"),
    st.sampled_from([0.0, 0.07]),
)
WORLDS = st.builds(
    World,
    st.dictionaries(st.sampled_from("klmn"), RANS, max_size=4),
    st.fixed_dictionaries({}, optional=dict.fromkeys(THEOREMS, THEOREM)) | st.just(dict.fromkeys(THEOREMS, "proved")),
    st.lists(ROWS, max_size=3),
    st.sampled_from([0.1, 0.1, 3.0]),
    st.dictionaries(st.sampled_from(["k ugv1", "l ugv1", "m ugv1"]), st.sampled_from([0.0, 0.05, 2.0])),
)


def told(world: World, question: str, lines: Iterable[Line]) -> list[Line]:
    """The lines of a question; each line follows from the world."""
    found = list(lines)
    for line in found:
        assert follows(world, question, line), (question, line)
    return found


@settings(max_examples=400)
@given(WORLDS)
def test_each_sentence_follows_from_what_happened_and_from_nothing_else(world: World) -> None:
    found = document(world)
    screen = summary.first_screen(found)
    runs, of_d = world.runs, world.of_d
    unsafe = {name for name, ran in runs.items() if ran.safe is False}

    assert screen.headline.mark == due_mark(world)
    sentences = re.split(r"(?<=\.) ", screen.headline.text)
    told(world, "headline", (Line(screen.headline.mark, each) for each in sentences))
    assert any(each.endswith("not as declared.") for each in sentences) == (world.differing > 0)
    told(world, "beware", (Line("", each) for each in screen.beware))
    assert any(line.startswith("what could") for line in screen.beware) == any(r.safe is None for r in runs.values())

    answers = {each.question: told(world, each.question, each.lines) for each in screen.answers}
    assert bool(screen.rows) == (len(runs) > 1 and not world.rows) == ("Safe?" not in answers and len(runs) > 1)
    said = {question: [(line.mark, line.text) for line in lines] for question, lines in answers.items()}
    if not screen.rows:
        safe = [
            (mark, {*names(text.partition(":")[0])})
            for mark, text in said.get("Safe?", [])
            if "proof" not in text.lower()
        ]
        crashed = {name for name in unsafe if not runs[name].printed or runs[name].hits}
        assert crashed <= {name for mark, those in safe if mark == "no" for name in those}
        proofs = [of[1] for _, text in said.get("Safe?", []) if (of := PROOF.match(text))]
        assert sorted(name for those in proofs for name in (of_d if those == "(d)" else names(those))) == sorted(of_d)
        where = {name for _, text in said.get("Arrived?", []) for name in names(text.partition(":")[0])}
        assert where >= {name for name, ran in runs.items() if not ran.printed or ran.away}
    for row in screen.rows:
        ran = runs[row.run]
        tested = ran.safe and ran.claims["SAFE-TRACE"][1] > 0
        due = "open" if ran.safe is None else "no" if not ran.safe else "yes" if tested else "none"
        assert (row.safe.mark, row.arrived.mark) == (due, "open" if not ran.there else "no" if ran.away else "yes")
        proved = row.run in of_d and world.proof(row.run) in ("tested", "idle")
        assert ("recursion (5) as printed" in row.method) == ran.printed
        assert not ran.safe or (", proved" in row.safe.text) == proved
        count = len({"ugv1", "ugv2"} - ran.away)
        assert not ran.there or row.arrived.text.startswith(f"{count} of 2")
        assert not ran.there or ("no way" in row.interventions) == bool(ran.lost)
    assert screen.within == ("3 m" if world.tolerance_m == 3.0 else "")
    assert ("Messages" in said) == any(ran.there and ran.sent[0] for ran in runs.values())
    assert [mark for mark, _ in said.get("Paper?", [])] == ([] if not world.rows else [said["Paper?"][0][0]])
    for claim, question in (("ZENO-TRACE", "Zeno-free?"), ("THR-TRIG", "Threshold?")):
        bad = runs_with(world, claim, "refuted")
        assert bad == [
            text.partition(":")[0] for mark, text in said.get(question, []) if mark == "no" and ":" in text[:3]
        ]
    printed = " ".join(summary.text(found).split())
    assert all(text in printed for lines in said.values() for _, text in lines)


def due_mark(world: World) -> str:
    """The mark of the headline."""
    main = world.main.values()
    helped = [ran for ran in main if ran.method != "a"] or main
    if not main or (any(ran.safe is None for ran in main) and not any(ran.safe is False for ran in main)):
        return "open"
    if not any(ran.fine for ran in main):
        return "no"
    crashed = any(ran.hits for ran in world.runs.values() if ran.there)
    return "partly" if crashed or world.differing or not all(ran.fine for ran in helped) else "yes"


HIT, STANDS = Ran("b", near=(0.0, 25.0, 3.0), hits=[Hit(11.4, "ugv1", "rock")]), {"ugv1": End("stands", 0.0)}
MOVES, FINE_RUN = {"ugv1": End("moves", 0.0, 30.0)}, Ran("d", claims={"SAFE-TRACE": FINE, "SAFE-HYP": FINE})
STANDING = {way: Ran(way, ends=STANDS, unasked=["ugv1"] * (way == "d"), claims=FINE_RUN.claims) for way in "ad"}


@pytest.mark.parametrize(
    ("runs", "says"),
    [
        ({"b": HIT, "d": FINE_RUN}, "Only method (d) is safe and brings everyone home. Under (b), ugv1 collides."),
        ({"c": FINE_RUN, "d": Ran("d", ends=MOVES, claims=FINE_RUN.claims)},
         "Only run c is safe and brings everyone home. In run d, ugv1 is still moving at the end (about 30 s more)."),
        (STANDING, "Safe, but not all arrive. Under (a), ugv1 is standing still; "
                   "under (d), ugv1 is standing still: the UAV found no way for ugv1."),
    ],
)  # fmt: skip
def test_a_headline_in_full(runs: dict[str, Ran], says: str) -> None:
    assert summary.headline(document(World(runs))).text == says


def test_a_collision_has_the_time_of_the_event_and_nothing_after_it_counts() -> None:
    answers = summary.first_screen(document(World({"b": HIT}))).answers
    assert [line.text for answer in answers[:2] for line in answer.lines] == [
        "b: ugv1 collides with rock at 11.40 s.",
        "b: ugv1 collides with rock at 11.40 s, at (3.37, 5.10) m: nothing after that counts.",
    ]


@pytest.mark.parametrize(("run", "told"), [("b", ", which the UAV did not know,"), ("a", ""), ("c", ""), ("d", "")])
def test_a_collision_with_what_the_uav_never_hears_of_says_so(run: str, told: str) -> None:
    """Under (a) it asks for nothing, under (c) and (d) answers tell it what UGVs sense."""
    given = document(World({run: replace(HIT, method=run)}))
    given["scenario"]["resolved"]["obstacles"] = {"rock": {"known_to_uav": False}}
    (line,) = summary.first_screen(given).answers[0].lines[:1]
    assert line.text == f"{run}: ugv1 collides with rock{told} at 11.40 s."


AGAINST = "Against the task error without noise"
BEST = "the Bayes optimum 2.992 m for the assumed drift 6 m/s and noise 10 m/√s."
OFTEN_WRONG: Document = {
    "drift_m_s": 0.56, "noise_m_sqrt_s": 10.0, "error_rate": 5 / 7, "error_rate_of_18": 0.4916, "decision_time_s": 8.3,
    "decision_time_of_17_s": 0.09, "decision_time_without_noise_s": 5.35,
}  # fmt: skip
FIRED = "Fired exactly when the decision variable reached 3 m, at 14.479 s."


def test_early_false_and_missed_triggers_are_told_beside_the_theory_of_the_ddm() -> None:
    found = document(World({"a": Ran("a", triggers_s=[14.479], claims={"THR-TRIG": FINE})}))
    counts = {"served": 2, "early": 0, "false": 8, "missed": 1}
    evidence = {"counts": counts, "latest": None, "earliest": {"late_s": -0.2, "error_m": 2.5}, "tolerance_m": 0.1}
    found["claims"].append(claim("THR-QUALITY", "a", "refuted", evidence=evidence | {"ddm": {"ugv1": OFTEN_WRONG}}))
    assert lines(found, "Threshold?") == [
        ("yes", FIRED),
        ("no", f"{AGAINST}: up to 0.20 s early (at 2.50 m), 8 of 10 false alarms, 1 missed."),
        ("", "Decisions about ugv1 in run a: 71 % wrong, 8.3 s in the mean. "
             "By (17)-(18), for its 0.56 m/s and 10 m/√s: 49 % wrong, 0.09 s."),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rule", "kind", "extra", "drift", "told"),
    [
        ("fixed", "declared", 3e-7, 6.0, ("yes", f"3 m, set by hand (rule fixed), costs no more than {BEST}")),
        ("printed", "declared", 0.02, 6.0,
         ("partly", f"3 m, by (19) as printed (rule printed), costs 5 % more risk than {BEST}")),
        ("printed", "declared", 1.0, 6.0,
         ("partly", f"3 m, by (19) as printed (rule printed), costs 3.5 times the risk of {BEST}")),
        ("bayes", "optimal", 0.0, 6.0,
         ("yes", "3 m is the Bayes optimum for the assumed drift 6 m/s and noise 10 m/√s.")),
        ("bayes", "optimal", 0.0, 11.0, ("none", "3 m is the Bayes optimum for the assumed drift 11 m/s and noise "
                                                 "10 m/√s; within the speed limits no task error grows faster than "
                                                 "10 m/s.")),
    ],
)  # fmt: skip
def test_which_rule_gave_the_threshold_and_what_it_costs_for_the_assumed_numbers(
    rule: str, kind: str, extra: float, drift: float, told: tuple[str, str]
) -> None:
    found = document(World({"a": Ran("a")}))
    found["claims"].append(choice(rule, kind, extra, {}, drift))
    assert lines(found, "Threshold?")[-1] == told


@pytest.mark.parametrize(
    ("noise", "best", "extra", "mark", "told"),
    [
        (0.004, 0.00016, 2.68, "partly", "0.00016 m is best; 3 m costs as much as a delay of 5.4 s."),
        (0.0, 0.0, 2.68, "partly", "the lower, the better; 3 m costs as much as a delay of 5.4 s."),
        (10.0, 2.99, 1e-4, "yes", "no threshold is better."),
    ],
)
def test_what_the_threshold_costs_for_the_numbers_of_the_run(
    noise: float, best: float, extra: float, mark: str, told: str
) -> None:
    """The drift and the noise are both the run's."""
    found = document(World({"a": Ran("a")}))
    rows = {"a ugv1": own_numbers(extra, noise, best), "b ugv1": own_numbers(0.0, noise, best, drift=0.9)}
    found["claims"].append(choice("fixed", "declared", 0.0, rows))
    given, said = lines(found, "Threshold?")[-1]
    assert given == mark
    assert said == f"For the drift and noise of ugv1 in run a, {told}"


def test_without_a_trigger_the_largest_decision_variable_is_told() -> None:
    found = document(World({"a": Ran("a"), "d": Ran()}))
    for run, largest in (("a", 1.234), ("d", 0.5)):
        evidence = {"ugvs": [{"largest_decision_variable_m": 0.1}, {"largest_decision_variable_m": largest}]}
        found["claims"].append(claim("THR-TRIG", run, "holds", evidence=evidence))
    told = ("none", "Never fired at decision variables up to 1.23 m: the threshold is 3 m.")
    assert lines(found, "Threshold?")[0] == told


@pytest.mark.parametrize(("dwell_s", "mark"), [(0.5, "yes"), (0.05, "yes"), (0.049, "partly"), (1e-6, "partly")])
def test_a_dwell_below_the_control_period_is_no_protection(dwell_s: float, mark: str) -> None:
    found = document(World({"d": Ran()}, {"ZENO-PROOF": "proved"}))
    next(each for each in found["claims"] if each["id"] == "ZENO-PROOF")["inputs"] = {"dwell_s": dwell_s}
    (first, *_) = lines(found, "Zeno-free?")
    assert first[0] == mark
    assert ("No practical protection: that is shorter than the control period, 0.05 s" in first[1]) == (mark != "yes")


def test_the_dwell_of_each_run_is_told() -> None:
    """The scenario's trigger is proved; one run has a bare threshold, and another run its own dwell time."""
    found = document(World({"a": Ran("a"), "bare": Ran("a"), "short": Ran("a")}, {"ZENO-PROOF": "proved"}))
    found["claims"].append(claim("ZENO-PROOF", "bare", "refuted", inputs={"dwell_s": 0.0}))
    found["claims"].append(claim("ZENO-PROOF", "short", "proved", inputs={"dwell_s": 0.06}))
    assert lines(found, "Zeno-free?")[:3] == [
        ("yes", "Proved (a): triggers are at least 0.5 s apart."),
        ("no", "Not proved (bare), as the trigger is the bare threshold (ZENO-PROOF: refuted)."),
        ("yes", "Proved (short): triggers are at least 0.06 s apart."),
    ]


def test_only_thresholds_that_were_reached_are_said_to_be() -> None:
    found = document(World({"a": Ran("a", triggers_s=[5.0], claims={"THR-TRIG": FINE}), "never": Ran("a")}))
    found["runs"]["never"]["zeta_m"] = 50.0
    assert lines(found, "Threshold?")[0] == ("yes", "Fired exactly when the decision variable reached 3 m, at 5.000 s.")


def test_what_was_allowed_is_told_where_it_differs() -> None:
    found = document(World({"a": Ran("a"), "bare": Ran("a")}))
    for run, status, allowed_m in (("a", "refuted", 0.05), ("bare", "holds", 0.15)):
        evidence = late(0.1, 0)["evidence"] | {"tolerance_m": allowed_m}
        found["claims"].append(claim("THR-QUALITY", run, status, margin=allowed_m - 0.1, evidence=evidence))
    assert [text.partition(": ")[0] for _, text in lines(found, "Threshold?") if text.startswith(AGAINST)] == [
        f"{AGAINST} (a, 0.05 m off allowed)", f"{AGAINST} (bare, 0.15 m off allowed)",
    ]  # fmt: skip


def test_a_proposal_that_is_given_up_counts_once() -> None:
    found = document(World({"c": Ran("c"), "d": Ran("d")}))
    kinds = ["proposal", "accept", "refuse", "proposal", "refuse", "accept", "proposal"]
    found["runs"]["c"]["events"] = [{"kind": kind, "t_s": 15.0, "robot": "ugv1"} for kind in kinds]
    (row, _) = summary.first_screen(found).rows
    assert row.interventions == "1 accepted, 1 accepted and given up later"


def test_what_became_of_proposals() -> None:
    found = document(World({"b": Ran("b"), "c": Ran("c"), "d": Ran("d")}))
    for run, kinds in {
        "b": ["proposal"],
        "c": ["proposal", "refuse", "proposal", "refuse"],
        "d": ["proposal", "accept"],
    }.items():
        found["runs"][run]["events"] = [{"kind": kind, "t_s": 15.0, "robot": "ugv1"} for kind in kinds]
    found["runs"]["c"]["metrics"]["gatekeeper"] = {"refusals": {"ugv1": {"waits": 2, "no_plan": 1}}}
    rows = summary.first_screen(found).rows
    assert [row.interventions for row in rows] == ["1 obeyed", "2 refused: waiting looked cheaper", "1 accepted"]


def test_what_is_not_as_declared_says_so() -> None:
    for status, mark in (("not_as_expected", "no"), ("inconclusive", "open")):
        found = {"overall": {"status": status, "why": "1 check differs.", "unpromised": []}, "claims": []}
        assert summary.as_declared(found) == (mark, "1 check differs.")


def lines(found: Document, question: str) -> list[Line]:
    """What the first screen answers."""
    return [line for each in summary.first_screen(found).answers if each.question == question for line in each.lines]


def test_a_run_is_described_by_how_it_decides() -> None:
    """The paper's gatekeeper to the letter is told apart from ours, whichever of the two a scenario has by default."""
    literal = {"gatekeeper.route": "nonlinear", "gatekeeper.rule": "first_stage"}
    found = document(World({"a": Ran("a"), "c": Ran("c"), "c_literal": Ran("c")}, rows=[("reproduced", "a", 0.0)]))
    found["scenario"]["resolved"]["runs"]["c_literal"]["set"] = {**literal, "decision.leak_1_s": 0.1}
    how = "(27) by multiple shooting, sum-up rounding (28)-(29), first stage applied"
    assert lines(found, "Runs") == [Line(
        "", "a: no intervention; c: MPC gatekeeper, (21)-(26), half-plane problems of (26) solved to optimality, best "
        f"plan by (26) kept, our hysteresis; c_literal: (c) with {how}, decision.leak_1_s 0.1.",
    )]  # fmt: skip
    found["scenario"]["resolved"]["gatekeeper"] = {key.partition(".")[2]: value for key, value in literal.items()}
    assert f"c: MPC gatekeeper, (21)-(26), {how};" in lines(found, "Runs")[0].text


def of_seeds(name: str, *of: tuple[float, bool]) -> list[Document]:
    """Outcomes of a run with the seeds from 1 on: how near ugv1 came to the rock, m, and whether all are home."""
    pair = {"first": "ugv1", "second": "rock", "safe_distance_m": D, "t_s": 9.0}
    return [
        {"run": name, "seed": k, "kept": near_m >= D, "home": home, "min_distance_m": near_m, **pair}
        for k, (near_m, home) in enumerate(of, start=1)
    ]


def test_several_seeds_are_counted_beside_what_is_promised() -> None:
    rows = [
        *of_seeds("b", (D, True), (1.5, True), (-0.25, False)), *of_seeds("c", *[(0.5, False)] * 3),
        *of_seeds("a", (D, True), (D, False), (3.0, True)), *of_seeds("d", *[(D, True)] * 3),
    ]  # fmt: skip
    found = document(World({name: Ran(name) for name in "abcd"}))
    assert not lines(found, "Seeds?")
    found["claims"].append(claim("SAFE-TRACE", "b", expected="nothing", as_expected=None))
    found["seeds"] = rows
    assert lines(found, "Seeds?") == [
        ("partly", "b: 1 of 3 seeds keep every distance, 2 bring all home; worst: -0.250 m (overlap) (ugv1 to rock, "
         "seed 3), required 2 m; no distance is promised."),
        ("no", "c: 0 of 3 seeds keep every distance, 0 bring all home; worst: 0.500 m (ugv1 to rock, seed 1), "
         "required 2 m."),
        ("partly", "a: 3 of 3 seeds keep every distance, 2 bring all home."),
        ("yes", "d: all 3 seeds keep every distance and bring all home."),
    ]  # fmt: skip
    found["scenario"]["resolved"]["decision"]["noise_m_sqrt_s"] = 0.0
    assert "the seed changes nothing" in lines(found, "Seeds?")[-1].text


def test_what_is_not_promised_is_neither_a_failure_nor_as_declared() -> None:
    found = document(World({"b": Ran("b", near=(0.5, T, 3.0))}))
    found["claims"].append(claim("SAFE-TRACE", "b", "refuted", expected="nothing", as_expected=None))
    found["overall"] = {
        "status": "as_expected", "why": "", "unpromised": [{"id": "SAFE-TRACE", "run": "b"}], "checks": 0,
        "numbers": [],
    }  # fmt: skip
    assert "(expected)" not in lines(found, "Safe?")[0].text
    assert "not as declared" not in summary.headline(found).text
    assert summary.as_declared(found).text == "0 checks as declared. For 1 more claim nothing is promised."


def test_every_sentence_of_the_table_is_said_and_gets_the_values_that_it_names() -> None:
    """Also those of branches that no drawn report reaches: by the calls in the code."""
    said = set[str]()
    for path in Path(summary.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("say", "clause"):
                named = {each.value for each in ast.walk(node.args[0]) if isinstance(each, ast.Constant)} & {*SENTENCES}
                given = {keyword.arg for keyword in node.keywords}
                for name in named if len(node.args) == 1 else ():  # else a claim gives the other values
                    fields = [field for _, field, *_ in Formatter().parse(SENTENCES[name]) if field]
                    assert {re.split(r"\W", field)[0] for field in fields} <= given, name
            elif isinstance(node, ast.Constant) and path.name != "sentences.py":
                said.add(str(node.value))
    assert {*SENTENCES} <= said | {*get_args(get_type_hints(ProofOutcome)["status"])}
