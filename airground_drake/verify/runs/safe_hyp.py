"""SAFE-HYP: the hypotheses of the invariance proof along a run, recomputed from its positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.engines.segments import MERGE_S
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_samples import control_samples
from airground_drake.verify.runs.pairs import (
    DISTANCE_TOLERANCE_M,
    near_pairs,
    pairs_of,
    places_of,
    slack_of,
    snapshot,
    speed_limits,
)

VELOCITY_TOLERANCE_M_S = 1e-9
"""A velocity may miss an inequality, a limit or the held command by this much, m/s: distances are divided by the
control period, so rounding errs by 1e-13 m/s; in one period of 25 ms it moves a robot 2.5e-11 m."""
BINDING_M_S = 1e-9
"""An avoidance inequality binds where a command has no more than this to spare, m/s."""


@dataclass(frozen=True)
class _Hypothesis:
    """One hypothesis over K instants or pairs: margins (K,), negative where broken beyond the tolerance `slop`.

    It is about a robot, or whatever `about` says, and in the k-th place about `others[k]`, if there are any.
    """

    name: str
    unit: str
    t: Array
    margin: Array
    slop: float
    about: dict[str, Any]
    others: Sequence[str] = ()

    def broken(self) -> npt.NDArray[np.intp]:
        """Instants at which it does not hold; a margin that is not a number counts."""
        return np.flatnonzero(~(self.margin >= -self.slop))

    def at(self, k: int) -> dict[str, Any]:
        """What is needed to redo the evaluation at instant k by hand."""
        other = {"second": self.others[k]} if self.others else {}
        described = {"hypothesis": self.name, **self.about, **other, "t_s": float(self.t[k])}
        return {**described, "margin": float(self.margin[k]), "unit": self.unit}


class SafeHyp(TraceClaim):
    """SAFE-HYP."""

    id = "SAFE-HYP"
    summary = "Every command of the run met the conditions under which the safety proof (SAFE-INV) holds."
    statement = "At every control sample of the run the hypotheses of the invariance proof (SAFE-INV) held."
    formula = (
        "n.v >= share A (d - D) where D <= d, else n.v >= -share (D - d) / h, for every pair with D <= sensing range "
        "(share 1 obstacle, 1/2 robot; z of n dropped for a UGV), tolerance 1e-9 m/s; D(0) >= d; A h <= 1; "
        "||v|| <= v_max; v_z = 0 for a UGV; range >= d + (closing speed) h; v constant over at most h"
    )
    latex = (
        r"n^\top v \ge \begin{cases} q A (d - D) & D \le d \\ -q (D - d) / h & D > d \end{cases} \quad "
        r"\text{for every pair with } D \le R",
        r"q = 1 \text{ (obstacle)}, \quad q = 1/2 \text{ (robot)}; \quad \text{tolerance } 10^{-9} \text{ m/s}",
        r"D(0) \ge d, \quad A h \le 1, \quad \lVert v \rVert \le v_{\max}, \quad v_z = 0 \text{ (UGV)}, \quad "
        r"R \ge d + c h",
    )
    method = (
        "Runtime monitor: positions at each multiple of the control period and the command of the row after it are put "
        "into the inequalities, written again here in plain numpy. Rows less than 1e-9 s apart count as one instant."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "The command of a row is the velocity applied since the row before (the trace's convention).",
        "Obstacles and robots beyond the sensing range need no inequality: the range covers d + closing speed * h.",
    )
    does_not_establish = (
        "Safety by itself: it supplies the hypotheses, SAFE-INV the implication and SAFE-TRACE the outcome. Broken "
        "hypotheses do not mean that the distance was violated, only that the proof does not cover this run. Nothing "
        "is said about samples that the run did not visit."
    )

    exercised_by = "avoidance inequalities that bound a command at a control sample"

    def check(self, trace: Trace) -> Finding:
        """Evaluate all hypotheses; the first violation in time is the counterexample."""
        monitored = [*_static(trace), *_sampled(trace)]
        broken = [h.at(int(k)) for h in monitored for k in h.broken()[:1]]
        first = min(broken, key=lambda entry: float(entry["t_s"]), default=None)
        worst: dict[tuple[str, str], dict[str, Any]] = {}
        for h in monitored:
            entry = h.at(int(np.argmin(h.margin)))
            key = h.name, str(next(iter(h.about.values()), ""))
            if np.isfinite(entry["margin"]) and entry["margin"] <= worst.get(key, entry)["margin"]:
                worst[key] = entry
        name = first["hypothesis"] if first else "avoidance"
        leading = min((w for w in worst.values() if w["hypothesis"] == name), key=lambda w: w["margin"], default={})
        binding = _binding(trace, monitored)
        in_range = sum(int(np.isfinite(h.margin).sum()) for h in monitored if h.name == "avoidance")
        return Finding(
            "refuted" if first else "holds",
            margin=leading.get("margin"),
            unit=leading.get("unit", ""),
            quantity=f"least slack of the hypothesis {name!r}",
            where={key: leading[key] for key in leading if key not in ("margin", "unit")},
            counterexample=first | snapshot(trace, first.values(), first["t_s"]) if first else None,
            evidence={
                "worst": list(worst.values()),
                "inequalities_in_range": in_range,
                "inequalities_that_bind": binding,
                "tolerance_m_s": VELOCITY_TOLERANCE_M_S,
            },
            exercised=sum(binding.values()),
        )


def _binding(trace: Trace, monitored: list[_Hypothesis]) -> dict[str, int]:
    """How many avoidance inequalities bound a command, by who moved and what it had to avoid."""
    count = {"ugv beside obstacle": 0, "uav beside obstacle": 0}
    count |= {"ugv beside ugv": 0, "ugv beside uav": 0, "uav beside ugv": 0}
    kind = dict.fromkeys(trace.ugvs, "ugv") | {trace.robots[-1]: "uav"}
    for h in monitored:
        if h.name == "avoidance":
            sides = kind[h.about["robot"]], kind.get(h.about["other"], "obstacle")
            count[" beside ".join(sides)] += int((h.margin <= BINDING_M_S).sum())
    return count


def _static(trace: Trace) -> Iterator[_Hypothesis]:
    """Hypotheses on the scenario and the start: gain, sensing range, distances at t = 0."""
    control, places = trace.scenario["control"], places_of(trace)
    stable = np.array([1.0 - control["avoidance_gain_1_s"] * control["period_s"]])
    yield _Hypothesis("gain: A h <= 1", "1", trace.t[:1], stable, 1e-12, {})
    pairs = sorted(pairs_of(trace), key=lambda pair: trace.robots.index(pair.first))
    for robot, own in groupby(pairs, key=lambda pair: pair.first):
        beside = list(own)
        others = [pair.second for pair in beside]
        safe, reach = (np.array([getattr(pair, name) for pair in beside]) for name in ("safe_m", "reach_m"))
        away = places[robot][0] - np.array([np.atleast_2d(places[other])[0] for other in others])
        start, about = np.full(len(beside), trace.t[0]), {"first": robot}
        excess = np.linalg.norm(away, axis=1) - safe
        yield _Hypothesis("safe start", "m", start, excess, DISTANCE_TOLERANCE_M, about, others)
        spare = control["sensing_range_m"] - safe - reach
        yield _Hypothesis("sensing range", "m", start, spare, DISTANCE_TOLERANCE_M, about, others)


def _sampled(trace: Trace) -> Iterator[_Hypothesis]:
    """Hypotheses at the control samples: their spacing, the hold between them, limits and inequalities."""
    control = trace.scenario["control"]
    limits = speed_limits(trace)
    t = trace.t
    samples = control_samples(t, control["period_s"])
    chosen = np.searchsorted(t, t[samples] + MERGE_S)  # the velocity chosen at a sample is the next row's command
    spacing = np.diff(np.append(t[samples], t[-1]))
    yield _Hypothesis("sampling", "s", t[samples], control["period_s"] - spacing, TIME_TOLERANCE_S, {})
    begins = np.flatnonzero(np.diff(t) >= MERGE_S)  # rows at which an interval begins
    sample_of = np.searchsorted(t[samples], t[begins] + MERGE_S) - 1
    for robot in trace.robots:
        command, about = trace.command(robot), {"robot": robot}
        drift = np.linalg.norm(command[begins + 1] - command[chosen][sample_of], axis=1)
        yield _Hypothesis("zero-order hold", "m/s", t[begins], 0.0 - drift, VELOCITY_TOLERANCE_M_S, about)
        spare = limits[robot] - np.linalg.norm(command[1:], axis=1)
        yield _Hypothesis("speed limit", "m/s", t[:-1], spare, VELOCITY_TOLERANCE_M_S, about)
        if robot in trace.ugvs:
            climb = 0.0 - np.abs(command[1:, 2])
            yield _Hypothesis("planar motion", "m/s", t[:-1], climb, VELOCITY_TOLERANCE_M_S, about)
    velocities = {robot: trace.command(robot)[chosen] for robot in trace.robots}
    places = places_of(trace)
    sampled = {name: places[name] if places[name].ndim == 1 else places[name][samples] for name in places}
    for pair in near_pairs(trace):
        for robot, other in ((pair.first, pair.second), (pair.second, pair.first)):
            if robot not in velocities:
                continue
            slack = slack_of(
                sampled[robot] - sampled[other], velocities[robot], pair, control, planar=robot in trace.ugvs
            )
            about = {"robot": robot, "other": other}
            yield _Hypothesis("avoidance", "m/s", t[samples], slack, VELOCITY_TOLERANCE_M_S, about)
