"""How near accepted interventions of a run stay to their prediction: where the premise of LIVE-GATE was met.

Let e be the difference between run and prediction at a control sample, and w what they differ by in everything else
than the pull towards the motion that was asked for: in what avoidance and the speed limit change of the command (other
robots that are elsewhere than predicted are in it), in the rate of the motion at its corners, in disturbances. Then

    e' = (1 - Lambda h) e + h w,    so ||e|| <= b with b' = (1 - Lambda h) b + h ||w||, b = ||e|| at the start.

The bound b weighs what happens with how long ago it was: contact that was predicted, or is short, costs little.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.beginnings import known_discs
from airground_drake.verify.runs.control_samples import control_samples
from airground_drake.verify.runs.outcome_rolls import foreseen
from airground_drake.verify.runs.proposals import accepted_at, proposals_of

METHOD = "d"
"""Only this method predicts where an accepted intervention leads."""
SAME_M = 1e-9
"""Obstacles closer to each other than this are one, m."""


class Followed(NamedTuple):
    """An accepted intervention, from its acceptance until it is given back, withdrawn, over, or the run ends.

    Attributes:
        ugv: which UGV.
        t_s: when it was accepted.
        bound_m: largest bound b of the difference between run and prediction.
        away_m: largest difference.
        whole: whether it leaves no direction of the plane to the UGV's own task.
        new: obstacles that were sensed meanwhile and not known at the acceptance.
        met: whether the premise of LIVE-GATE was met: `whole`, nothing `new`, and the bound within `lag_m`.
    """

    ugv: str
    t_s: float
    bound_m: float
    away_m: float
    whole: bool
    new: list[str]
    met: bool


def followed(trace: Trace) -> list[Followed]:
    """All accepted interventions of a run under method (d), by time; of another method none.

    Raises:
        TraceError: if a decision is on a proposal that was not sent.
    """
    if trace.meta["method"] != METHOD:
        return []
    table = trace.decisions
    first = table[(table["decision"] == "accept") & (table["accept_stalls"] >= 0.0)]
    return [_followed(trace, row) for row in first.to_dict("records")]


def _followed(trace: Trace, given: dict[Any, Any]) -> Followed:
    ugv, t_s, issued_s = str(given["robot"]), float(given["t_s"]), float(given["issued_s"])
    control, obstacles = trace.scenario["control"], trace.scenario["obstacles"]
    sent = proposals_of(trace)
    predicted = foreseen(trace, given, sent)[1].places_m
    on = next(one for one in sent if (one.ugv, one.issued_s) == (ugv, issued_s))
    samples = control_samples(trace.t, control["period_s"])
    begin = int(np.searchsorted(trace.t[samples], t_s - TIME_TOLERANCE_S))
    executed = [one is on for one in accepted_at(trace, ugv)[begin:]]
    lasts = executed.index(False) if False in executed else len(executed)
    rows = np.append(samples, len(trace.t) - 1)[begin : begin + lasts + 1]
    places = trace.position(ugv)[rows]
    there = predicted[np.minimum(np.arange(len(rows)), len(predicted) - 1)]
    contraction = 1.0 - control["intervention_gain_1_s"] * control["period_s"]
    centres = np.array([each["position_m"] for each in obstacles.values()], dtype=np.float64).reshape(-1, 3)
    known, _ = known_discs(trace, ugv, t_s, on)
    sensed = (np.linalg.norm(places[:, None] - centres, axis=2) <= control["sensing_range_m"]).any(axis=0)
    strange = (np.linalg.norm(centres[:, None] - known, axis=2) > SAME_M).all(axis=1)
    new = [name for name, is_new in zip(obstacles, (sensed & strange).tolist(), strict=True) if is_new]
    bound, whole = float(bounds(places - there, contraction).max()), np.allclose(on.chosen[:2, :2], np.eye(2))
    away = float(np.linalg.norm(places - there, axis=1).max())
    met = whole and not new and bound <= trace.scenario["gatekeeper"]["lag_m"]
    return Followed(ugv, t_s, bound, away, whole, new, met)


def bounds(differences: Array, contraction: float) -> Array:
    """The bound b of each of K differences (K, 3), m, that contract by a factor: (K,), m."""
    found = np.linalg.norm(differences, axis=1)
    pushes = np.linalg.norm(differences[1:] - contraction * differences[:-1], axis=1)  # h ||w||
    for k, push in enumerate(pushes.tolist()):
        found[k + 1] = contraction * found[k] + push
    return found
