"""GATE-MODEL: the gatekeeper's predictions, rolled out again and compared with the run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.beginnings import scene, sensed
from airground_drake.verify.runs.closed_loops import NUDGES_M, Scene, in_batches, move_apart, roll_out, stacked
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.gate_record import DecisionRecord, Deviation, GateClaim, conclude
from airground_drake.verify.runs.instants import samples_of
from airground_drake.verify.runs.outcome_rolls import Foreseen, foreseen, nudged
from airground_drake.verify.runs.proposals import accepted_at, proposal_of, proposals_of

VELOCITY_TOLERANCE_M_S = 1e-6
"""Recorded and recomputed mode velocities may differ by this, m/s: rounding of two algorithms, which the closed loop
damps; a corner of nearly parallel inequalities enlarges it."""
OUTCOME_TOLERANCE = 1e-6
"""Recorded and recomputed outcomes may differ by this, relative, or in m^2 s: they are sums over such velocities."""
LEFT_TOLERANCE_M = 1e-3
"""A recorded way may be outside its bounds by this, m, or by `OUTCOME_TOLERANCE` of it: the recomputed end is not quite
the recorded one."""


@dataclass(frozen=True)
class Predicted:
    """The evidence under method (c); a prediction applies to the run while its answer stands.

    `unstable` counts the decisions whose prediction depends on rounding, so that it cannot be compared.
    """

    decisions: int
    unstable: int
    largest_difference_m_s: float
    answers_that_stood_to_the_horizon: int
    farthest_from_predicted: dict[str, Any]


class GateModel(GateClaim):
    """GATE-MODEL."""

    id = "GATE-MODEL"
    summary = "What the gatekeeper predicted for yes and for no is what the UGV would have done."
    statement = (
        "Every gatekeeper decision rests on the right mode velocities: those of the UGV's closed loop with the "
        "proposal accepted throughout and refused throughout, rolled out again from what the UGV sensed."
    )
    formula = (
        "a_k, b_k = mean velocity over stage k of rho+ = rho + h law(rho; accepted | refused), rho(0) = p(t), others "
        "at their velocities at t; |recorded - recomputed| <= 1e-6 m/s"
    )
    latex = (
        r"\rho^+ = \rho + h \, \text{law}(\rho; \text{accepted or refused}), \quad \rho(0) = p(t)",
        r"a_k, b_k = \text{mean velocity over stage } k, \quad |\text{recorded} - \text{recomputed}| \le "
        r"10^{-6} \text{ m/s}",
    )
    method = (
        "The control law in numpy as for EXEC, from the signals, the scenario and the table of proposals, for all "
        "decisions side by side. The evidence also says how far a UGV was from its prediction while the answer stood; "
        "that never refutes the claim."
    )
    equations = "(23), (25)"
    assumptions = (
        "A UGV predicts with the bodies within sensing range when it decides, which keep their velocities.",
        "A prediction that differs, and that a push of 1e-12 m in every period changes, depends on rounding: it is "
        "counted as unstable and not compared. A robot that heads straight for another one is an example.",
        "In a prediction the rates of preset and proposed motion are those of the motion sampled every control period.",
    )
    does_not_establish = (
        "That the run went as predicted: other robots turn, and bodies out of sight are left out; the largest "
        "difference is reported. For plans that change their mode, (23) adds velocities of two different ways, which "
        "is an approximation: `benchmarks/regret.py` shows what plans cost on the closed loop."
    )

    exercised_by = "decisions that were rolled out again"

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Roll out both choices of every decision; the margin is the tolerance less the largest difference."""
        if trace.meta["method"] not in ON_TOP:
            return judge_outcomes(trace, rows)
        compared = list[Deviation]()
        for row, both in predicted(trace, rows):
            of_row = [
                Deviation(row, f"velocity of mode {name}, m/s", row[f"{name}_m_s"] - found, VELOCITY_TOLERANCE_M_S)
                for name, found in zip(("refuse", "accept"), (velocities(places, row) for places in both), strict=True)
            ]
            if not (any(one.wrong for one in of_row) and _is_unstable(trace, row, both)):
                compared += of_row
        largest, unstable = max((one.off for one in compared), default=0.0), len(rows) - len(compared) // 2
        finding = Finding(
            "holds",
            margin=VELOCITY_TOLERANCE_M_S - largest,
            unit="m/s",
            quantity="tolerance left by which a predicted velocity may differ from the closed loop's",
            evidence=asdict(Predicted(len(rows), unstable, largest, *_realised(trace, rows))),
            exercised=len(rows) - unstable,
        )
        return conclude(finding, compared)


def judge_outcomes(trace: Trace, rows: Sequence[DecisionRecord]) -> Finding:
    """Method (d): the outcome of either choice, rolled out again for every first decision about a proposal."""
    proposals_of(trace)  # raises if a decision is on a proposal that was never sent
    compared, unstable = list[Deviation](), 0
    looked = [row for row in rows if row.given["accept_stalls"] >= 0.0]
    for row in looked:
        both = foreseen(trace)[row.t_s, row.number]
        of_row = [*_outcome_deviations(trace, row, both)]
        if any(one.wrong for one in of_row) and _has_unstable_outcome(trace, row, both):
            unstable += 1
        else:
            compared += of_row
    costs = (one for one in compared if "recomputed" in one.more)
    finding = Finding(
        "holds",
        margin=1.0 - max((one.off / one.allowed for one in costs), default=0.0),
        unit="of the tolerance",
        quantity="part left of the tolerance of a recorded outcome",
        evidence={"decisions": len(rows), "outcomes": 2 * len(looked), "unstable": unstable},
        exercised=len(looked) - unstable,
    )
    return conclude(finding, compared)


def _outcome_deviations(trace: Trace, row: DecisionRecord, both: tuple[Foreseen, Foreseen]) -> Iterator[Deviation]:
    """The recorded outcomes of refusing and of accepting, compared with those rolled out again."""
    for choice, found in zip(("refuse", "accept"), both, strict=True):
        cost, left = (float(row.given[f"{choice}_{name}"]) for name in ("outcome_m2_s", "left_m"))
        due = _cost_m2_s(trace, row, found, left)
        yield Deviation(row, f"{choice}: stalls", row.given[f"{choice}_stalls"] - float(found.stalls), 0.0)
        allowed = OUTCOME_TOLERANCE * max(1.0, due)
        yield Deviation(row, f"{choice}: outcome, m^2 s", cost - due, allowed, recomputed=due, recorded=cost)
        short = max(0.0, found.least_left_m - left, left - found.most_left_m)
        within = max(LEFT_TOLERANCE_M, OUTCOME_TOLERANCE * left)
        yield Deviation(row, f"{choice}: way left, m", short, within, recorded=left)


def _cost_m2_s(trace: Trace, row: DecisionRecord, found: Foreseen, left_m: float) -> float:
    """Cost of an outcome, with the recorded way left."""
    ahead = left_m**3 / (3.0 * trace.scenario.ugvs[row.robot].preset.speed_m_s)
    return ahead if found.stalls else found.integral_m2_s + ahead


def _has_unstable_outcome(trace: Trace, row: DecisionRecord, both: tuple[Foreseen, Foreseen]) -> bool:
    """Whether a push of `NUDGES_M` in every period changes an outcome by more than its tolerance."""
    return any(
        move_apart([one.places_m for one in pushed])
        or any(one.stalls != found.stalls for one in pushed)
        or max(abs(one.integral_m2_s - found.integral_m2_s) for one in pushed)
        > OUTCOME_TOLERANCE * max(1.0, found.integral_m2_s)
        for pushed, found in zip(zip(*nudged(trace, row.t_s, row.number), strict=True), both, strict=True)
    )


def _is_unstable(trace: Trace, row: DecisionRecord, both: tuple[Array, Array]) -> bool:
    """Whether a push of `NUDGES_M` in every period changes a velocity of a mode by more than its tolerance."""
    for choice, places in enumerate(both):
        loops = stacked([scene_of(trace, row, np.full(row.stages, float(choice)))] * len(NUDGES_M))
        pushed = np.array([loops.here, *roll_out(trace, loops, NUDGES_M)]).swapaxes(0, 1)
        off = [np.abs(velocities(one, row) - velocities(places, row)).max() for one in pushed]
        if max(off) > VELOCITY_TOLERANCE_M_S or move_apart([*pushed]):
            return True
    return False


def predicted(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[tuple[DecisionRecord, tuple[Array, Array]]]:
    """Each decision with the places that refusing and accepting throughout lead to, (S + 1, 3) each, m."""
    begun = ((row, [scene_of(trace, row, np.full(row.stages, choice)) for choice in (0.0, 1.0)]) for row in rows)
    for batch in in_batches(begun, lambda each: each[1]):
        loops = stacked([one for _, scenes in batch for one in scenes])
        ways = np.array([loops.here, *roll_out(trace, loops)]).swapaxes(0, 1)
        for k, (row, _) in enumerate(batch):
            yield row, (ways[2 * k], ways[2 * k + 1])


def scene_of(trace: Trace, row: DecisionRecord, plan: Array) -> Scene:
    """The closed loop of a decision under a plan (N,) of 0 (refused) and 1 (accepted): others move on as they do."""
    control_s, horizon_s = trace.scenario.control.period_s, trace.scenario.gatekeeper.horizon_s
    each = round(horizon_s / row.stages / control_s)
    after = control_s * np.arange(each * row.stages + 1.0)
    on = proposal_of(trace, row.number)
    there = sensed(trace, on.ugv, row.t_s, after)
    points = np.stack([one.places for one in there], axis=1) if there else np.empty((len(after), 0, 3))
    safe, share = (np.array([getattr(one.pair, name) for one in there]) for name in ("safe_m", "share"))
    loop = scene(trace, on, row.t_s, after, 0, points, safe, share)
    return loop._replace(executed=np.repeat(plan == 1.0, each))


def velocities(places: Array, row: DecisionRecord) -> Array:
    """Mean velocities over the stages of a decision, (N, 3), m/s, from places at the control samples, (S + 1, 3), m."""
    return np.diff(places[:: (len(places) - 1) // row.stages], axis=0) / row.dt


def _realised(trace: Trace, rows: Sequence[DecisionRecord]) -> tuple[int, dict[str, Any]]:
    """How many answers stood to the horizon, and where a UGV was farthest from its prediction while one stood."""
    t, accepted = trace.t[samples_of(trace)], {ugv: accepted_at(trace, ugv) for ugv in trace.ugvs}
    farthest: dict[str, Any] = {}
    stood = 0
    for row in rows:
        yes = row.given["decision"] == "accept"
        due, first = row.number if yes else None, int(np.searchsorted(t, row.t_s - TIME_TOLERANCE_S))
        numbers = (None if one is None else one.number for one in accepted[row.robot][first:])
        other = next((float(t[first + k]) for k, found in enumerate(numbers) if found != due), np.inf)
        until = min(float(trace.t[-1]), other) + TIME_TOLERANCE_S
        ends = row.t_s + row.dt * np.arange(1.0, row.stages + 1.0)
        stood += bool(ends[-1] <= until)
        ends = ends[ends <= until]
        went = interpolate(trace.t, trace.position(row.robot), ends)
        away = np.linalg.norm(went - row.constant[int(yes)][: len(ends)], axis=1)
        if away.max(initial=0.0) >= farthest.get("away_m", 0.0) and len(ends):
            k = int(np.argmax(away))
            farthest = {"robot": row.robot, "t_s": row.t_s, "decision": str(row.given["decision"])}
            farthest |= {"away_m": float(away[k]), "after_s": float(ends[k] - row.t_s)}
    return stood, farthest
