"""SAFE-OWN: what the robots themselves did to the distances of a run in which obstacles may move."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.encounters import own_margins, steps_of
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M, apart_of, pairs_of, snapshot
from airground_drake.verify.runs.passive import beside

MOST_LISTED = 300  # pairs that the evidence lists at most: those of least margin


class SafeOwn(TraceClaim):
    id = "SAFE-OWN"
    subject = "the robots' own doing"
    summary = "No robot itself brought a distance below the required one, whatever the obstacles that move did."
    statement = (
        "In every control period, with the other body held where it was at the control sample, no robot came nearer "
        "to it than min(D, d + V h). D is the distance at the sample, d the required one, and V the largest speed at "
        "which the other body is expected to move (0 for robots and bodies at rest). Any further loss is the other "
        "body's motion. Where a body is not where the law steers it, D is the distance of the steered points less "
        "what the plants take, or the distance of the bodies if that is smaller already. Where the distance was "
        "broken, no robot's body came nearer than min(D, d) by its own motion, including commands under way; there D "
        "is the distance of the bodies."
    )
    latex = (
        r"\mathrm{dist}(p_i(t_k + s), C_j(t_k)) \ge \min(D_k, \, d_{ij} + V_j h) - 10^{-9} \text{ m}, \quad "
        r"D_k = \mathrm{dist}(p_i(t_k), C_j(t_k)), \; s \in [0, h]",
        r"\Rightarrow \quad \mathrm{dist}(p_i(t_k + s), C_j(t_k + s)) \ge \min(D_k, \, d_{ij} + V_j h) - "
        r"\int_{t_k}^{t_k + s} \lVert v_j \rVert - 10^{-9} \text{ m}",
    )
    method = (
        "Exact minimum of the distance on every segment between two rows, in closed form as in SAFE-TRACE, from the "
        "other body as it was at the control sample before. It is asked of every robot of every pair that comes so "
        "near that its longest step could matter."
    )
    equations = "(7)-(8), (11); n.v >= 0 beside obstacles that may move"
    assumptions = (
        "Those of SAFE-TRACE. Obstacles move without turning, as recorded.",
        "The theorem promises nothing of what a lag, a delay or a hand point covers: there the run decides alone.",
        "V is the declared speed (`max_speed_m_s`), whether it is true or not: SAFE-HYP compares it with the run.",
    )
    does_not_establish = (
        "That a distance was kept (SAFE-TRACE does): an obstacle that moves can come as near as it likes. That a robot "
        "got out of its way. It says nothing about any other run."
    )

    theorems = ("Passive.own_doing", "Passive.since", "Turning.shortened_obeys", "Plants.unicycle_stands")
    exercised_by = "control periods in which an obstacle that may move was within reach"

    def applies(self, trace: Trace) -> bool:
        """Only a run with obstacles that may move; else SAFE-TRACE says the same."""
        try:
            return any(barrier.expected_speed_m_s > 0.0 for barrier in trace.scenario.barriers.values())
        except TraceError:
            return True  # `judge` says what is wrong

    def check(self, trace: Trace) -> Finding:
        margins = sorted(_margins(trace), key=lambda own: own.margin_m)
        worst = margins[0] if margins else None
        own = worst is not None and not worst.margin_m >= -DISTANCE_TOLERANCE_M
        within_reach = [periods.apart_m < periods.keeps_m + periods.pair.reach_m for periods in beside(trace)]
        return Finding(
            "refuted" if own else "holds",
            margin=worst.margin_m if worst else None,
            unit="m" if worst else "",
            quantity="least distance from the other body held, less min(D, d + V h)" if worst else "",
            where=worst._asdict() if worst else {},
            counterexample=worst._asdict() | snapshot(trace, worst[:2], worst.t_s) if worst and own else None,
            evidence={
                "robots_beside_others": [own._asdict() for own in margins[:MOST_LISTED]],
                "tolerance_m": DISTANCE_TOLERANCE_M,
            },
            exercised=sum(int(near.sum()) for near in within_reach),
        )


class OwnMargin(NamedTuple):
    """The least margin of a robot beside another body, m, and when the segment ends on which it is, s."""

    first: str
    second: str
    margin_m: float
    t_s: float


def _margins(trace: Trace) -> Iterator[OwnMargin]:
    period, apart = trace.scenario.control.period_s, apart_of(trace)
    longest = {name: float(steps_of(trace, name).max()) for name in trace.robots}
    for pair, least in zip(pairs_of(trace), apart.tolist(), strict=True):
        for robot in (name for name in (pair.first, pair.second) if name in trace.robots):
            if least > max(pair.keeps_m(period) - pair.cover_m, pair.safe_m) + longest[robot]:
                continue
            other = pair.second if robot == pair.first else pair.first
            margins = own_margins(trace, pair, robot).least
            k = int(np.argmin(margins))  # the first one that is not a number, if there is any
            if margins[k] != np.inf:
                yield OwnMargin(robot, other, float(margins[k]), float(trace.t[k + 1]))
