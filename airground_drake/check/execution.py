"""EXEC: every command is that of the control law with what was accepted."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from .files import Json
from .law import PLANE, Inequalities, avoiding, inequalities, least_spare, limited
from .proposals import Proposal, accepted_at
from .rules import SMALL, Array, Disagreement, Flags, Found, agrees, holds
from .run import Run

COMMAND_M_S = 1e-6
"""A command may differ from the law by this: a corner of nearly parallel inequalities enlarges their rounding."""
BINDING_M_S, DOUBT_M_S = 1e-9, 1e-10
"""An inequality binds where the law has the first to spare at most; of one closer to that than the second, rounding
decides."""
WHERE_M_S = 1e-8
"""Recorded and recomputed differences from the law may differ by this."""
SIDES = (-1.0, 1.0)
"""Before and after."""
ON_TOP = ("b", "c")
"""Methods that put an accepted intervention above the avoidance inequalities."""


class Robot(NamedTuple):
    """Commands of a robot and the law's, (S, 3) each, and what is executed by the messages and by the signals, (S,).

    `t_s` are the times of the samples, (S,); `spare_m_s` is what the law has to spare of the avoidance inequality that
    leaves the least, (S,).
    """

    name: str
    t_s: Array
    recorded: Array
    law: Array
    executing: Flags
    said: Flags
    spare_m_s: Array

    @property
    def away_m_s(self) -> Array:
        """By what they differ, (S,)."""
        return np.asarray(np.linalg.norm(self.recorded - self.law, axis=1))

    def tested(self, binding_m_s: float) -> int:
        """Commands for which a proposal is executed, or which an inequality binds."""
        return int((self.executing | (self.spare_m_s <= binding_m_s)).sum())


def execution(run: Run, claim: Json) -> Found:
    """EXEC: commands are the law's to 1e-6 m/s, and what is executed is what was accepted."""
    robots = [_ugv(run, ugv) for ugv in run.ugvs]
    if run.scenario["uav"]["task"] == "formation":
        robots.append(_uav(run))
    margin = COMMAND_M_S - max(float(robot.away_m_s.max()) for robot in robots)
    formation = run.scenario["uav"]["task"] == "formation"
    facts = {
        "samples": len(run.sample_s),
        "robots": {
            r.name: {"executing": int(r.executing.sum()), "largest_difference_m_s": float(r.away_m_s.max())}
            for r in robots
        },
        "not_judged": [] if formation else [f"{run.uav}: task {run.scenario['uav']['task']}"],
        "tolerance_m_s": COMMAND_M_S,
    }
    least, most = (sum(r.tested(BINDING_M_S + side * DOUBT_M_S) for r in robots) for side in (-1.0, 1.0))
    wrong = [(k, r) for r in robots for k in np.flatnonzero(~(r.away_m_s <= COMMAND_M_S) | (r.executing != r.said))[:1]]
    if not wrong:
        return _judging(Found("holds", margin, margin, facts, within=1e-8).counted(least, most), robots, claim)
    if claim["status"] == "holds":
        k, robot = min(wrong, key=lambda one: int(one[0]))
        when = float(run.sample_s[k])
        if robot.executing[k] != robot.said[k]:
            said, due = (("executed" if flag else "not executed") for flag in (robot.said[k], robot.executing[k]))
            raise Disagreement("what is executed is what was accepted", said, due, robot.name, when)
        rule = "the command is the law's"
        raise Disagreement(rule, robot.recorded[k].tolist(), robot.law[k].tolist(), robot.name, when)
    negative = margin if margin < 0.0 else None
    found = Found("refuted", negative, negative, facts, within=1e-8).counted(least, most)
    shown = partial(_first_wrong, wrong, run, claim["counterexample"])
    return _judging(found, robots, claim).judging(shown, *(f"counterexample.{key}" for key in SHOWN))


def _judging(found: Found, robots: list[Robot], claim: Json) -> Found:
    """With the rules about where the margin is attained, and about what is counted besides."""
    found = found.judging(partial(_where, robots, claim["where"]), "where.robot", "where.t_s")
    counts = partial(_counts_of_binding, robots, claim["evidence"]["robots"])
    return found.judging(counts, "evidence.robots.*.binding", "evidence.robots.*.executing_and_binding")


SHOWN = (
    "robot", "t_s", "accepted_by_the_messages", "accepted_by_the_signals", "command_m_s", "law_m_s", "difference_m_s",
)  # fmt: skip
"""What is recorded of a sample at which a command is not the law's."""


def _counts_of_binding(robots: list[Robot], recorded: Json) -> None:
    """How many commands an inequality binds, all and while something is executed; rounding may decide."""
    for robot in robots:
        for key, which in (("binding", np.full(len(robot.law), True)), ("executing_and_binding", robot.executing)):
            spare = robot.spare_m_s[which]
            least, most = (int((spare <= BINDING_M_S + side * DOUBT_M_S).sum()) for side in SIDES)
            count = recorded[robot.name][key]
            possible = type(count) is int and least <= count <= most
            holds(f"commands counted as {key}", possible, count, f"{least} to {most}", about=robot.name)


def _where(robots: list[Robot], recorded: Json) -> None:
    """The command that differs most from the law, or one that differs as much."""
    by_name = {robot.name: robot for robot in robots}
    holds("where the margin is attained", recorded["robot"] in by_name, recorded["robot"], str([*by_name]))
    robot = by_name[recorded["robot"]]
    there = np.abs(robot.t_s - recorded["t_s"]) <= SMALL
    largest = max(float(each.away_m_s.max()) for each in robots)
    attained = there.any() and float(robot.away_m_s[there].max()) >= largest - WHERE_M_S
    holds("where the margin is attained", attained, recorded["t_s"], "a sample of the largest difference",
          about=robot.name, t_s=recorded["t_s"])  # fmt: skip


def _first_wrong(wrong: list[tuple[np.intp, Robot]], run: Run, recorded: Json) -> None:
    """The counterexample is the first sample at which a command, or what is executed, is not the law's."""
    first = min(k for k, _ in wrong)
    names = [robot.name for k, robot in wrong if k == first]
    when = float(run.sample_s[first])
    holds("robot of the counterexample", recorded["robot"] in names, recorded["robot"], str(names), t_s=when)
    robot = next(robot for k, robot in wrong if k == first and robot.name == recorded["robot"])
    due = {
        "t_s": when,
        "accepted_by_the_messages": bool(robot.executing[first]),
        "accepted_by_the_signals": bool(robot.said[first]),
        "command_m_s": robot.recorded[first].tolist(),
        "law_m_s": robot.law[first].tolist(),
        "difference_m_s": float(robot.away_m_s[first]),
    }
    agrees("counterexample", recorded, due, within=1e-8, about=robot.name, t_s=when)


def around(run: Run, robot: str) -> Inequalities:
    """The avoidance inequalities of a robot at the control samples."""
    views = run.near_views[robot]
    here = run.position_m[robot][run.sample_row]
    offsets = [here - run.position_m[pair.other][run.sample_row] for pair in views]
    return inequalities(
        np.stack(offsets, axis=1) if offsets else np.empty((len(here), 0, 3)),
        np.array([pair.safe_m for pair in views]),
        np.array([pair.share for pair in views]),
        run.scenario["control"],
        np.ones(3) if robot == run.uav else PLANE,
    )


def _ugv(run: Run, ugv: str) -> Robot:
    """(6), (14) and (20); of the rates on both sides of corners those count that come closer."""
    accepted = accepted_at(run, ugv)
    recorded = run.command_m_s[ugv][run.chosen_row]
    law, away = np.zeros_like(recorded), np.full(len(recorded), np.inf)
    for tried in _laws(run, ugv, accepted):
        off = np.linalg.norm(recorded - tried, axis=1)
        closer = ~(off >= away)
        law[closer], away[closer] = tried[closer], off[closer]
    executing = np.array([proposal is not None for proposal in accepted])
    spare = least_spare(law, around(run, ugv))
    return Robot(ugv, run.sample_s, recorded, law, executing, _said(run, ugv, executing), spare)


def _said(run: Run, ugv: str, executing: Flags) -> Flags:
    """What the signal says of each sample: otherwise than the messages if any row does up to the next one."""
    executed, ends = run.executed(ugv), np.append(run.chosen_row[1:], len(run.t_s))
    parts = [executed[begin:end] for begin, end in zip(run.chosen_row, ends, strict=True)]
    return np.array([not due if (part != due).any() else due for part, due in zip(parts, executing, strict=True)])


def _laws(run: Run, ugv: str, accepted: list[Proposal | None]) -> Iterator[Array]:
    """Commands of a UGV, (S, 3), with rates before and after each sample: of its preset, and of what it accepted."""
    control, limit = run.scenario["control"], run.robots[ugv]["max_speed_m_s"]
    composition = run.scenario["runs"][run.name]["composition"]
    given, here, t = around(run, ugv), run.position_m[ugv][run.sample_row], run.sample_s
    preset = run.presets[ugv]
    away = control["motion_gain_1_s"] * (preset.position_m(t) - here)
    rows = np.array([proposal is not None for proposal in accepted])
    with_it = [(proposal, when) for proposal, when in zip(accepted, t, strict=True) if proposal is not None]
    for own_side in SIDES:
        own = limited(PLANE * (preset.rate_m_s(t + own_side * SMALL) + away), limit)
        law = avoiding(own, given, composition)
        if not with_it:
            yield law
            continue
        place = np.stack([proposal.place_m(np.array([when]))[0] for proposal, when in with_it])
        projector = np.stack([proposal.projector for proposal, _ in with_it])
        below = (law if run.method in ON_TOP else own)[rows]
        for asked_side in SIDES:
            rate = np.stack([proposal.rate_m_s(float(when), asked_side) for proposal, when in with_it])
            asked = PLANE * (rate + control["intervention_gain_1_s"] * (place - here[rows]))
            task = limited(PLANE * (below + np.einsum("bij,bj->bi", projector, asked - below)), limit)
            tried = law.copy()
            tried[rows] = task if run.method in ON_TOP else avoiding(task, given.rows(rows), composition)
            yield tried


def _uav(run: Run) -> Robot:
    """(9)-(11): over the centroid of the UGVs, whose commands of the sample before are fed forward."""
    uav, row = run.scenario["uav"], run.sample_row
    over = np.mean([run.position_m[ugv][row] for ugv in run.ugvs], axis=0) + np.array([0.0, 0.0, uav["altitude_m"]])
    fed = np.mean([run.command_m_s[ugv][row] for ugv in run.ugvs], axis=0)
    fed[0] = 0.0  # nothing was commanded before the first sample
    wish = fed + run.scenario["control"]["formation_gain_1_s"] * (over - run.position_m[run.uav][row])
    given = around(run, run.uav)
    law = avoiding(limited(wish, uav["max_speed_m_s"]), given, "augmented")
    never = np.zeros(len(law), dtype=bool)
    recorded = run.command_m_s[run.uav][run.chosen_row]
    return Robot(run.uav, run.sample_s, recorded, law, never, never, least_spare(law, given))
