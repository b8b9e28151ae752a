"""GATE-MODEL: the mode velocities that decisions rest on are those of the UGV's closed loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .decisions import Decision, decisions_of, silent_ugvs
from .files import Json
from .foresight import outcomes
from .law import PLANE, avoiding, inequalities, limited
from .proposals import proposals_of
from .rules import SMALL, Array, Found, close, holds
from .run import Run

VELOCITY_M_S = 1e-6
"""Recorded and recomputed mode velocities may differ by this: a corner of nearly parallel inequalities enlarges their
rounding."""
UNSEEN_M = 1e9
"""As far away is put what a UGV does not sense."""
CHOICES = ("refuse", "accept")


class Loops(NamedTuple):
    """Closed loops of B decisions over S control periods, K points each; see the fields' shapes.

    Attributes:
        start_m: (B, 3).
        preset_m: at the control samples, (B, S + 1, 3).
        asked_m: the proposed motion at them, (B, S + 1, 3).
        projector: J_int^+ J_int, (B, 3, 3).
        points_m: to keep away from, (B, K, 3).
        moving_m_s: velocities of the points, (B, K, 3).
        safe_m: (B, K).
        share: (B, K).
        limit_m_s: (B,).
    """

    start_m: Array
    preset_m: Array
    asked_m: Array
    projector: Array
    points_m: Array
    moving_m_s: Array
    safe_m: Array
    share: Array
    limit_m_s: Array


def gate_model(run: Run, _: Json) -> Found:
    """GATE-MODEL: both choices of every decision rolled out again; what came of them is evidence, and not checked."""
    if silent_ugvs(run):
        return Found("not_run")
    if run.method == "d":
        return outcomes(run) if len(run.decisions) else Found("holds", facts={"decisions": 0}).counted(0)
    decisions = decisions_of(run)
    if not decisions:
        return Found("holds", facts={"decisions": 0}).counted(0)
    loops = Loops(*(np.stack(part) for part in zip(*(_loop(run, each) for each in decisions), strict=True)))
    off = 0.0
    for accepted, choice in enumerate(CHOICES):
        modes = _rolled_out(run, loops, decisions[0].stages, accepted=bool(accepted))
        for k, decision in enumerate(decisions):
            recorded = decision.accept_m_s if accepted else decision.refuse_m_s
            at: Json = {"about": f"decision of {decision.ugv}", "t_s": decision.t_s}
            close(f"velocity of mode {choice}", recorded.ravel(), modes[k].ravel(), within=VELOCITY_M_S, **at)
            off = max(off, float(np.abs(recorded - modes[k]).max()))
    facts = {"decisions": len(decisions), "largest_difference_m_s": off}
    return Found.with_margin("holds", VELOCITY_M_S - off, within=1e-7, **facts).counted(len(decisions))


def _loop(run: Run, decision: Decision) -> tuple[Array, ...]:
    """What a decision predicts from, in the order of `Loops`."""
    control, ugv, t = run.scenario["control"], decision.ugv, decision.t_s
    about: Json = {"about": f"decision of {ugv}", "t_s": t}
    on = [p for p in proposals_of(run) if (p.ugv, p.issued_s) == (ugv, float(decision.row["issued_s"]))]
    holds("a decision is on a proposal that was sent", len(on) == 1, decision.row["issued_s"], "one of them", **about)
    periods = round(run.scenario["gatekeeper"]["horizon_s"] / control["period_s"])
    instants = t + control["period_s"] * np.arange(periods + 1.0)
    here, views = run.place_m(ugv, t), run.views[ugv]
    points = np.array([run.place_m(pair.other, t) for pair in views]).reshape(-1, 3)
    held = min(int(np.searchsorted(run.t_s, t - SMALL)), len(run.t_s) - 1)
    still = np.zeros((len(run.t_s), 3))
    moving = np.array([run.command_m_s.get(pair.other, still)[held] for pair in views]).reshape(-1, 3)
    sensed = (np.linalg.norm(points - here, axis=1) <= control["sensing_range_m"])[:, None]
    return (
        here,
        run.presets[ugv].position_m(instants),
        on[0].place_m(instants),
        on[0].projector,
        np.where(sensed, points, UNSEEN_M),
        np.where(sensed, moving, 0.0),
        np.array([pair.safe_m for pair in views]),
        np.array([pair.share for pair in views]),
        np.array(run.robots[ugv]["max_speed_m_s"]),
    )


def _rolled_out(run: Run, loops: Loops, stages: int, *, accepted: bool) -> Array:
    """Mean velocity of each stage under one choice throughout, (B, N, 3)."""
    control, composition = run.scenario["control"], run.scenario["runs"][run.name]["composition"]
    h, on_top = control["period_s"], run.method == "c"
    here, velocities = loops.start_m, []
    for k in range(loops.preset_m.shape[1] - 1):
        offset = here[:, None] - (loops.points_m + k * h * loops.moving_m_s)
        given = inequalities(offset, loops.safe_m, loops.share, control, PLANE)
        error = loops.preset_m[:, k] - here
        rate = (loops.preset_m[:, k + 1] - loops.preset_m[:, k]) / h
        task = limited(PLANE * (rate + control["motion_gain_1_s"] * error), loops.limit_m_s)
        velocity = avoiding(task, given, composition)
        if accepted:
            below = velocity if on_top else task
            rate = (loops.asked_m[:, k + 1] - loops.asked_m[:, k]) / h
            asked = PLANE * (rate + control["intervention_gain_1_s"] * (loops.asked_m[:, k] - here))
            change = np.einsum("bij,bj->bi", loops.projector, asked - below)
            task = limited(PLANE * (below + change), loops.limit_m_s)
            velocity = task if on_top else avoiding(task, given, composition)
        here = here + h * velocity
        velocities.append(velocity)
    return np.stack(velocities, axis=1).reshape(len(here), stages, -1, 3).mean(axis=2)
