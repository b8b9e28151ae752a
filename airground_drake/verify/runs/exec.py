"""EXEC: what a run commanded is the control law with what was accepted, evaluated again from the trace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.engines.geometry import corner_times, travelled
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_law import (
    Asked,
    Inequalities,
    avoiding,
    commanded,
    inequalities_of,
    limited,
    spare,
    tracking,
)
from airground_drake.verify.runs.instants import chosen_at, samples_of
from airground_drake.verify.runs.pairs import preset_of
from airground_drake.verify.runs.proposals import ProposalRecord, accepted_at

Flags = npt.NDArray[np.bool_]

COMMAND_TOLERANCE_M_S = 1e-6
"""A command may differ from the law by this, m/s. Both are evaluated at the same recorded positions and differ by
rounding (1e-13 m/s). A corner of two nearly parallel inequalities divides that by the sine of their angle, which is at
least 1e-10: the controller treats flatter ones as parallel. In 100 s the tolerance is 0.1 mm."""
BINDING_M_S = 1e-9
"""An inequality binds where the law's command has less to spare, m/s."""


@dataclass(frozen=True)
class Robot:
    """Evidence about a robot, with counts of samples: an accepted proposal was executed, an inequality bound, both."""

    largest_difference_m_s: float
    executing: int
    binding: int
    executing_and_binding: int


@dataclass(frozen=True)
class Commands:
    """The evidence: samples for each robot, what was found by robot, and robots whose law is not known."""

    samples: int
    robots: dict[str, Robot]
    not_judged: list[str]
    tolerance_m_s: float = COMMAND_TOLERANCE_M_S


class Judged(NamedTuple):
    """The law against the commands of one robot at S control samples.

    Attributes:
        robot: name.
        t: (S,), s.
        away: difference of the commands, (S,), m/s.
        law: commands by the law, (S, 3), m/s.
        recorded: recorded commands, (S, 3), m/s.
        executing: whether an accepted proposal is executed, by the messages, (S,).
        said: the same by the signals, (S,).
        binding: whether an inequality binds, (S,).
    """

    robot: str
    t: Array
    away: Array
    law: Array
    recorded: Array
    executing: Flags
    said: Flags
    binding: Flags

    def summary(self) -> Robot:
        """The evidence about this robot."""
        counts = (int(flags.sum()) for flags in (self.executing, self.binding, self.executing & self.binding))
        return Robot(float(self.away.max(initial=0.0)), *counts)

    def first_wrong(self) -> dict[str, Any] | None:
        """The first sample at which a command, or the signal `accepted`, is not what it should be."""
        found = np.flatnonzero(~(self.away <= COMMAND_TOLERANCE_M_S) | (self.executing != self.said))
        if not found.size:
            return None
        k = int(found[0])
        return {
            "robot": self.robot,
            "t_s": float(self.t[k]),
            "accepted_by_the_messages": bool(self.executing[k]),
            "accepted_by_the_signals": bool(self.said[k]),
            "command_m_s": self.recorded[k].tolist(),
            "law_m_s": self.law[k].tolist(),
            "difference_m_s": float(self.away[k]),
        }


class Exec(TraceClaim):
    """EXEC."""

    id = "EXEC"
    summary = "Each robot was commanded what its control law says, in every control period."
    statement = (
        "At every control sample of the run each robot got the command of the control law. A UGV follows its own task "
        "(6) and, while a proposal is accepted, the intervention (14), composed with the avoidance inequalities in the "
        "order of the run's method. The UAV follows its formation task (9)-(10) below avoidance (11)."
    )
    formula = (
        "own = lim(rho_rd' + B (rho_rd - rho)); int(v) = lim(v + J^+ J (rho_int' + Lambda (rho_int - rho) - v)); "
        "nothing accepted: v = avoid(own); accepted: v = int(avoid(own)) under (b), (c), v = avoid(int(own)) under "
        "(d); UAV: v = avoid(lim(mean v_j + C (mean rho_j + altitude - rho))); avoid(u) = argmin ||v - u||^2 s.t. "
        "n_k.v >= b_k + 1e-12 m/s (recursion_*: (5) as printed); |recorded - v| <= 1e-6 m/s; accepted = what the "
        "messages say"
    )
    latex = (
        r"u_{\text{own}} = \operatorname{lim}(\dot\rho_{rd} + B (\rho_{rd} - \rho))",
        r"\operatorname{int}(v) = \operatorname{lim}(v + J^+ J (\dot\rho_{int} + \Lambda (\rho_{int} - \rho) "
        r"- v))",
        r"v = \operatorname{avoid}(u_{\text{own}}) \quad \text{where nothing is accepted}",
        r"v = \operatorname{int}(\operatorname{avoid}(u_{\text{own}})) \quad \text{accepted, methods (b) and "
        r"(c)}",
        r"v = \operatorname{avoid}(\operatorname{int}(u_{\text{own}})) \quad \text{accepted, method (d)}",
        r"v_{\text{UAV}} = \operatorname{avoid}(\operatorname{lim}(\bar v + C (\bar\rho + z_{\text{UAV}} - "
        r"\rho)))",
        r"\operatorname{avoid}(u) = \operatorname{argmin}_v \lVert v - u \rVert^2 \text{ subject to } "
        r"n_k^\top v \ge b_k + 10^{-12} \text{ m/s}",
        r"\lVert v_{\text{recorded}} - v \rVert \le 10^{-6} \text{ m/s}",
    )
    method = (
        "The law is evaluated again in plain numpy at each multiple of the control period, at the recorded positions, "
        "from the scenario and the table of proposals. Another algorithm than the controller's finds the closest "
        "velocity (constraints one by one, each reducing the dimension); each inequality has the 1e-12 m/s that the "
        "controller adds. If inequalities contradict each other, the slowest velocity that misses them least counts. "
        "It is shortened until it meets all that standing still meets up to 1e-9 m/s. Proposals, modes, answers and "
        "periods tell what is accepted; the signal `accepted` must agree. At a corner of a preset or proposed motion "
        "either rate counts."
    )
    equations = "(5)-(6), (7)-(8), (9)-(10), (11), (12)-(14), (20)"
    assumptions = (
        "The command of a row is the velocity applied since the row before (the trace's convention); that it is held "
        "between samples is SAFE-HYP.",
        "A proposal stays in force as the planner's rules say: see `verify.runs.proposals.accepted_at`. If it asks a "
        "UGV to make way for another one, it is in force while one of the two is intervened on. The trace's table of "
        "proposals says for whose trigger each was sent; while a UGV is intervened on, that must be its own trigger.",
        "The UAV feeds the UGVs' commands of the sample before forward: controllers of one sample see each other's "
        "last commands.",
    )
    does_not_establish = (
        "That an accepted proposal was useful or safe, or that it was right to accept it (GATE-FEAS, SAFE-TRACE). "
        "Errors of commands below 1e-6 m/s. With a disturbance of the motion the claim is about the commands, not "
        "about where they led. A UAV with another task than 'formation' is not judged; the evidence says so."
    )

    exercised_by = "commands for which an accepted proposal was executed, or which an avoidance inequality bound"

    def check(self, trace: Trace) -> Finding:
        """Compare every command with the law; the margin is the tolerance less the largest difference."""
        samples = samples_of(trace)
        judged = [_judge_ugv(trace, ugv, samples) for ugv in trace.ugvs]
        formation = trace.scenario.uav.task == "formation"
        if formation:
            judged.append(_judge_uav(trace, samples))
        wrong = [entry for one in judged if (entry := one.first_wrong())]
        worst = max(judged, key=lambda one: float(one.away.max(initial=0.0)))
        k = int(np.argmax(worst.away))
        margin = COMMAND_TOLERANCE_M_S - float(worst.away[k])
        return Finding(
            "refuted" if wrong else "holds",
            margin=margin if margin < 0.0 or not wrong else None,
            unit="m/s",
            quantity="tolerance left by which a command may differ from the law's",
            where={"robot": worst.robot, "t_s": float(worst.t[k])},
            counterexample=min(wrong, key=lambda entry: float(entry["t_s"]), default=None),
            evidence=asdict(
                Commands(
                    len(samples),
                    {one.robot: one.summary() for one in judged},
                    [] if formation else [f"{trace.robots[-1]}: task {trace.scenario.uav.task}"],
                )
            ),
            exercised=sum(int((one.executing | one.binding).sum()) for one in judged),
        )


def _judge_ugv(trace: Trace, ugv: str, samples: npt.NDArray[np.intp]) -> Judged:
    """A UGV's commands against the law, with whatever it has accepted."""
    scenario, control, t = trace.scenario, trace.scenario.control, trace.t[samples]
    spec, chosen = scenario.ugvs[ugv], chosen_at(trace, samples)
    position, recorded = trace.position(ugv)[samples], trace.command(ugv)[chosen]
    given, limit = inequalities_of(trace, ugv, samples), np.full(len(samples), spec.max_speed_m_s)
    accepted = accepted_at(trace, ugv)
    waypoints, speed = preset_of(trace, ugv)
    preset = travelled(waypoints, speed, t)
    own_rates = _preset_rates(waypoints, speed, t)
    asked = _asked(accepted, t)
    executing = np.array([sent is not None for sent in accepted], dtype=bool)
    rows = np.flatnonzero(executing)
    away, law = np.full(len(t), np.inf), np.zeros((len(t), 3))
    # samples at a corner of a motion are evaluated with the rates on both sides of it, and the closer one counts
    for own_rate, wish in product(own_rates, asked):
        own = tracking(position, preset, own_rate, control.motion_gain_1_s, limit)
        ours = commanded(trace, position, own, given, rows, wish, limit)
        off = np.linalg.norm(recorded - ours, axis=1)
        closer = ~(off >= away)
        away[closer], law[closer] = off[closer], ours[closer]
    said = _said(trace.executing(ugv) >= 0, chosen, executing)
    return Judged(ugv, t, away, law, recorded, executing, said, _binding(given, law))


def _said(accepted: Flags, chosen: npt.NDArray[np.intp], executing: Flags) -> Flags:
    """The signal at S control samples, (S,): it contradicts the messages if any row up to the next sample does."""
    held = np.searchsorted(chosen, np.arange(chosen[0], len(accepted)), side="right") - 1
    said = executing.copy()
    wrong = held[accepted[chosen[0] :] != executing[held]]
    said[wrong] = ~executing[wrong]
    return said


def _preset_rates(waypoints: Array, speed: float, t: Array) -> list[Array]:
    """Velocity of the preset trajectory, (S, 3), m/s, before and after each instant; they differ at corners only."""
    times = corner_times(waypoints, speed)
    legs = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    slopes = np.concatenate([speed * legs / np.where(lengths > 0.0, lengths, 1.0), np.zeros((1, 3))])
    if not len(times):
        slopes = np.zeros((1, 3))
    return [slopes[np.searchsorted(times, t + shift)] for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)]


def _asked(accepted: Sequence[ProposalRecord | None], t: Array) -> list[Asked]:
    """What the E executed proposals ask for, once with the rates before each instant and once with those after it."""
    executed = [(sent, now) for sent, now in zip(accepted, t.tolist(), strict=True) if sent is not None]
    wanted = np.array([sent.place(now) for sent, now in executed]).reshape(-1, 3)
    chosen = np.array([sent.chosen for sent, _ in executed]).reshape(-1, 3, 3)
    rates = [sent.rates(now) for sent, now in executed]
    return [Asked(wanted, np.array([both[side] for both in rates]).reshape(-1, 3), chosen) for side in (0, -1)]


def _judge_uav(trace: Trace, samples: npt.NDArray[np.intp]) -> Judged:
    """The UAV's commands against (9)-(11)."""
    uav, control, chosen = trace.scenario.uav, trace.scenario.control, chosen_at(trace, samples)
    name = uav.name
    position, recorded = trace.position(name)[samples], trace.command(name)[chosen]
    centroid = np.mean([trace.position(ugv)[samples] for ugv in trace.ugvs], axis=0)
    fed = np.mean([trace.command(ugv)[samples] for ugv in trace.ugvs], axis=0)
    fed[trace.t[samples] <= TIME_TOLERANCE_S] = 0.0  # nothing was commanded before the first sample
    over = centroid + np.array([0.0, 0.0, uav.altitude_m])
    below = limited(fed + control.formation_gain_1_s * (over - position), uav.max_speed_m_s)
    given = inequalities_of(trace, name, samples)
    law = avoiding(below, given, "augmented", planar=False)
    away = np.linalg.norm(recorded - law, axis=1)
    none = np.zeros(len(samples), dtype=bool)
    return Judged(name, trace.t[samples], away, law, recorded, none, none, _binding(given, law))


def _binding(given: Inequalities, velocity: Array) -> Flags:
    return np.asarray((spare(given, velocity) <= BINDING_M_S).any(axis=1))
