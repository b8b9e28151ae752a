"""SAFE-INV: a robot that starts at a safe distance and obeys the avoidance inequalities keeps it (coq/Safety.v).

Symbols: D is the distance of a pair, d its safe distance, n the unit vector away from the nearest point of the other
body (inside a polygon, the normal of the nearest edge), p a position, v a velocity, both relative between two robots, A
the gain, h the control period, q the share of an inequality, c the closing speed and R the sensing range.
"""

from fractions import Fraction
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.safe_hyp import guarantees
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim
from airground_drake.verify.pair_kinds import SHARES, constants, kinds_of


class SafeInv(TheoremClaim):
    id = "SAFE-INV"
    subject = "proof of distances"
    summary = "A robot that obeys the avoidance inequalities and starts at a safe distance keeps it."
    statement = (
        "Let any number of robots and static obstacles start at their safe distances. At every sample let each pair in"
        " sensing range meet its avoidance inequalities, and let velocities be held until the next sample. Then all "
        "pairs keep their safe distances at all times. Inside a safe distance the deficit never grows, and shrinks by "
        "the factor 1 - A h per period. Two robots take half of an inequality each; a UGV under a UAV has no vertical "
        "velocity. Pairs beyond the sensing range need no inequality. An obstacle consists of one or more convex sets "
        "(points, walls, polygons or prisms), each with its own inequality. The proof uses one lemma: along a straight"
        " line, the distance from a convex set is at least its initial value plus time times its initial rate of "
        "change."
    )
    latex: tuple[str, ...] = (
        r"\mathrm{dist}(p + s v) \ge D + s \, n^\top v, \quad D = \mathrm{dist}(p), \quad s \ge 0",
        r"D \ge d, \; n^\top v \ge -q (D - d) / h \; \Rightarrow \; \mathrm{dist}(p + s v) \ge d \quad "
        r"\text{for all } s \in [0, h]",
        r"D \le d, \; n^\top v \ge q A (d - D) \; \Rightarrow \; \mathrm{dist}(p + s v) \ge D, \; d - "
        r"\mathrm{dist}(p + h v) \le (1 - A h) (d - D)",
        r"D > R, \; R \ge d + c h \; \Rightarrow \; \mathrm{dist}(p + s v) \ge d",
        r"q = 1 \text{ in sum over the pair}",
    )
    method = (
        "Theorems in Coq, for all positions, times and numbers of bodies. The hypotheses about the scenario are "
        "checked here in exact arithmetic, including safe distances above 0. SAFE-HYP checks the hypotheses about a "
        "run."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions: tuple[str, ...] = (
        "Positions are integrals of the commands, which are held between samples; all robots are sampled at the same "
        "instants.",
        "Obstacles are static: pairs with an obstacle that may move are not covered (see SAFE-OWN), and neither are "
        "two UGVs that act on old positions of each other (see SAFE-BUDGET). Robots obey their speed limits, so that "
        "pairs out of range stay apart for a period. D is the distance of a robot's centre from the other's centre "
        "or, signed, from an obstacle's convex core. All radii are part of d.",
        "A UGV's velocity has no z component.",
    )
    does_not_establish = (
        "That the inequalities hold in a run, with rounding and in the built controllers (SAFE-HYP), or under "
        "disturbance (SAFE-DIST). Inside two safe distances at once there may be no velocity that meets both "
        "inequalities. Whether the program computes these inequalities is checked by tests and SAFE-HYP."
    )

    theorems: tuple[str, ...] = (
        "Safety.lemma",
        "Safety.lemma_in_the_plane",
        "Convex.leads_away",
        "Convex.ball",
        "Convex.nearest_point",
        "Convex.nearest_edge",
        "Safety.safe_always",
        "Safety.recovers",
        "Safety.obstacle",
        "Safety.unseen",
        "Safety.standing",
        "Safety.capped",
    )
    margin_of = "sensing range less d + c h"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return constants(scenario)

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        gain, h = decimal(inputs["avoidance_gain_1_s"]), decimal(inputs["period_s"])
        reach = decimal(inputs["sensing_range_m"])
        pairs = kinds_of(inputs)
        shares = [
            Hypothesis.of(
                "share that is missing to 1",
                f"{kind}: the shares of both bodies add up to 1",
                -abs(sum(SHARES[kind], Fraction(-1))),
            )
            for kind in dict.fromkeys(pair.kind for pair in pairs)
        ]
        apart = [
            Hypothesis.of("safe distance", f"{pair.kind}: the safe distance is above 0", pair.safe_m, "m", strict=True)
            for pair in pairs
        ]
        ranges = [
            Hypothesis.of(
                self.margin_of,
                f"{pair.kind}: the sensing range {float(reach):g} m is at least d + c h = {float(pair.safe_m):g} m "
                f"between centre and core + {float(pair.closing_m_s):g} m/s * {float(h):g} s",
                reach - pair.safe_m - pair.closing_m_s * h,
                "m",
            )
            for pair in pairs
        ]
        return [*stable(gain, h), *shares, *apart, *ranges]

    def seen_in(self, trace: Trace) -> tuple[int, int]:
        """The pairs that met every inequality, and those within reach of each other."""
        margins_m = [promised.margin_m for promised in guarantees(trace)]
        return margins_m.count(0.0), len(margins_m)


def stable(gain: Fraction, h: Fraction) -> list[Hypothesis]:
    """A h is between 0 and 1."""
    return [
        Hypothesis.of("1 - A h", f"A h = {float(gain * h):g} is at most 1", 1 - gain * h),
        Hypothesis.of("A", "the gain A is not negative", gain, "1/s"),
        Hypothesis.of("h", "the control period h is above 0", h, "s", strict=True),
    ]
