"""The metrics of a run in report.json."""

from __future__ import annotations

from collections import Counter

import numpy as np

from .files import Json
from .rules import SMALL, agrees, at_most, close, holds, same
from .run import Run
from .safety import least_distance_m
from .scenario import Pair

MOST_OBSTACLES = 20
"""Whose distances from a robot are in the metrics at most: those of least margin."""


def check_metrics(run: Run, metrics: Json) -> str:
    """Apply the rules about metrics.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
    """
    for robot in run.robots:
        views = {pair.other: pair for pair in run.views[robot]}
        obstacles = {other for other, pair in views.items() if pair.share == 1.0}
        recorded = metrics["min_distance_m"][robot]
        same("obstacles in the metrics", sorted({*recorded} - obstacles), [], about=robot)
        same("obstacles in the metrics", len(recorded), min(len(obstacles), MOST_OBSTACLES), about=robot)
        for other in recorded:
            _least_distance(run, views[other], recorded[other])
        largest = max((margin_m(run, views[other]) for other in recorded), default=np.inf)
        for other in obstacles - {*recorded}:
            _is_no_nearer(run, views[other], largest, "an obstacle that is not in the metrics is farther")
        nearest = metrics["min_robot_distance_m"][robot]
        same("robots in the metrics", len(nearest), min(len(views) - len(obstacles), 1), about=robot)
        for other, entry in nearest.items():
            _least_distance(run, views[other], entry)
            for mate in {*views} - obstacles:
                _is_no_nearer(run, views[mate], margin_m(run, views[other]), "robot of least margin")
    _ends_and_counts(run, metrics)
    if len(run.decisions):
        _gatekeeper(run, metrics["gatekeeper"])
    return "distances, ends, counts of events and of decisions"


def _least_distance(run: Run, pair: Pair, recorded: Json) -> None:
    about, when = f"{pair.robot}, {pair.other}", recorded["t_s"]
    there = np.linalg.norm(run.place_m(pair.robot, when) - run.place_m(pair.other, when))
    close("least distance", recorded["value"], least_distance_m(run, pair), within=SMALL, about=about, t_s=when)
    close("distance at the recorded time", there, recorded["value"], within=SMALL, about=about, t_s=when)
    same("safe distance", recorded["safe_distance_m"], pair.safe_m, about=about)


def margin_m(run: Run, pair: Pair) -> float:
    """What a pair keeps apart beyond its safe distance."""
    return least_distance_m(run, pair) - pair.safe_m


def _is_no_nearer(run: Run, pair: Pair, than_m: float, rule: str) -> None:
    if run.apart_m[pair.robot, pair.other] - pair.safe_m < than_m:
        at_most(rule, than_m, margin_m(run, pair), within=SMALL, about=f"{pair.robot}, {pair.other}")


def _ends_and_counts(run: Run, metrics: Json) -> None:
    for robot in run.robots:
        end = run.position_m[robot][-1]
        counts = dict(Counter(event["kind"] for event in run.events if event["robot"] == robot))
        close("final position", metrics["final_position_m"][robot], end, within=SMALL, about=robot)
        same("counts of events", metrics["event_counts"][robot], counts, about=robot)
    close("duration", metrics["duration_s"], run.t_s[-1] - run.t_s[0], within=SMALL)
    agrees("wall-clock time", metrics["wall_s"], run.wall_s, within=0.0)
    factor = metrics["duration_s"] / run.wall_s if run.wall_s else None
    agrees("simulated seconds per second", metrics["realtime_factor"], factor, within=SMALL)


def _gatekeeper(run: Run, recorded: Json) -> None:
    same("number of decisions", recorded["calls"], len(run.decisions))
    same("counts of answers", recorded["decisions"], dict(Counter(map(str, run.decisions["decision"]))))
    same("counts of refusals", recorded["refusals"], _refusals(run))
    known = run.decisions["gap"][run.decisions["gap"] >= 0.0]
    agrees("largest recorded gap", recorded["max_gap"], float(known.max()) if len(known) else None, within=SMALL)
    times = np.array(run.decision_times_s, dtype=np.float64)
    period = float(run.scenario["gatekeeper"]["period_s"])
    same("gatekeeper's period", recorded["period_s"], period)
    if len(times):
        same("one time for each decision", len(times), len(run.decisions))
        holds("times are not negative", times >= 0.0, times, "0 or more")
        levels = {"p50": 0.5, "p99": 0.99, "max": 1.0}
        quantiles = {name: float(np.quantile(times, at, method="higher")) for name, at in levels.items()}
        agrees("decision times", recorded["time_s"], quantiles, within=SMALL)
        same("decisions that took a period or longer", recorded["late"], int((times >= period).sum()))
    _closest_call(run, recorded["closest_call"])


def _refusals(run: Run) -> dict[str, dict[str, int]]:
    """Proposals refused at their first answer, by robot and reason."""
    answered: set[tuple[str, float]] = set()
    counts: dict[str, Counter[str]] = {}
    for robot, issued_s, decision, reason in run.decisions[["robot", "issued_s", "decision", "reason"]].to_numpy():
        if (robot, issued_s) not in answered and decision == "refuse":
            counts.setdefault(str(robot), Counter())[str(reason)] += 1
        answered.add((robot, issued_s))
    return {robot: dict(reasons) for robot, reasons in counts.items()}


def _closest_call(run: Run, recorded: Json | None) -> None:
    """The decision at which accepting and refusing throughout differ least, relative to the smaller cost."""
    costs = run.decisions[["accept_throughout", "refuse_throughout"]].to_numpy(dtype=np.float64)
    known = np.flatnonzero((costs >= 0.0).all(axis=1))
    if not len(known):
        same("closest call", recorded, None)
        return
    apart = np.abs(np.diff(costs[known], axis=1)[:, 0]) / np.maximum(costs[known].min(axis=1), 1e-12)
    row = run.decisions.iloc[known[int(np.argmin(apart))]]
    named = {name: str(row[name]) for name in ("robot", "policy", "decision")}
    valued = {name: float(row[name]) for name in ("t_s", "accept_throughout", "refuse_throughout")}
    expected = {"relative_cost_margin": float(apart.min()), **named, **valued}
    agrees("closest call", recorded, expected, within=SMALL)
