"""SAFE-OWN: the robots' own effect on the distances of a run in which obstacles may move."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.encounters import own_margins, steps_of
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M, MOST_LISTED, apart_of, pairs_of, snapshot
from airground_drake.verify.runs.passive import beside


class SafeOwn(TraceClaim):
    id = "SAFE-OWN"
    subject = "the robots' own doing"
    summary = "No robot broke a required distance by its own motion, whatever the moving obstacles did."
    statement = (
        "In every control period no robot came closer than min(D, d + V h) to the other body's position at the control"
        " sample. D is the distance at the sample, d the required one, and V the largest expected speed of the other "
        "body (0 for robots and static bodies). Any further loss is due to the other body's motion. For a body off its"
        " steered point, D is the distance of the steered points minus the cost of the plants, or the distance of the "
        "bodies if that is smaller. If the distance was broken, no robot's body came closer than min(D, d) by its own "
        "motion, including earlier commands; here D is the distance of the bodies."
    )
    latex = (
        r"\mathrm{dist}(p_i(t_k + s), C_j(t_k)) \ge \min(D_k, \, d_{ij} + V_j h) - 10^{-9} \text{ m}, \quad "
        r"D_k = \mathrm{dist}(p_i(t_k), C_j(t_k)), \; s \in [0, h]",
        r"\Rightarrow \quad \mathrm{dist}(p_i(t_k + s), C_j(t_k + s)) \ge \min(D_k, \, d_{ij} + V_j h) - "
        r"\int_{t_k}^{t_k + s} \lVert v_j \rVert - 10^{-9} \text{ m}",
    )
    method = (
        "Exact minimum of the distance on every segment between two rows, in closed form as in SAFE-TRACE, from the "
        "other body's position at the previous control sample. It is computed for every robot of every pair that comes"
        " so near that the robot's longest step could matter."
    )
    equations = "(7)-(8), (11); n.v >= 0 beside obstacles that may move"
    assumptions = (
        "Those of SAFE-TRACE. Obstacles move without turning, as recorded.",
        "The theorem promises nothing within the cover of a lag, a delay or a hand point; there only the run is "
        "judged.",
        "V is the declared speed (`max_speed_m_s`), whether it is true or not: SAFE-HYP compares it with the run.",
    )
    does_not_establish = (
        "That a distance was kept (SAFE-TRACE does): a moving obstacle can come arbitrarily close. That a robot gave "
        "way. It says nothing about other runs."
    )

    theorems = ("Passive.own_doing", "Passive.since", "Turning.shortened_obeys", "Plants.unicycle_stands")
    exercised_by = "control periods in which an obstacle that may move was within reach"

    def applies(self, trace: Trace) -> bool:
        """Only for runs with obstacles that may move; otherwise SAFE-TRACE suffices."""
        return any(barrier.expected_speed_m_s > 0.0 for barrier in trace.scenario.barriers.values())

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
            margins = own_margins(trace, pair, robot).least
            k = int(np.argmin(margins))  # the first one that is not a number, if any
            if margins[k] != np.inf:
                yield OwnMargin(robot, pair.other(robot), float(margins[k]), float(trace.t[k + 1]))
