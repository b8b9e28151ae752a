"""SAFE-DIST: the distance that remains when velocities are disturbed (coq/Budget.v, Gate.v).

Every robot moves with v + e(t), ||e(t)|| <= w, instead of v; W is what the disturbances of a pair add up to: w beside
an obstacle, 2 w between robots. Other symbols are those of `safe_inv.py`.
"""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import inf
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.safe_inv import stable
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim
from airground_drake.verify.pair_kinds import PairKind, constants, kinds_of
from airground_drake.verify.runs.passive import beside


class SafeDist(TheoremClaim):
    id = "SAFE-DIST"
    summary = "Bounded velocity errors cost a bounded distance, unless two robots stand because they miss messages."
    statement = (
        "Let velocities be disturbed by at most w, and A h <= 1. A pair that meets its inequality at every sample "
        "keeps d - w/A (obstacle) or d - 2 w/A (two disturbed robots). After N consecutive periods inside d the "
        "distance is at least d - (1 - (1 - A h)^N) W/A if it was d before, W = w or 2 w. If turning or wheel limits "
        "shorten a command by the factor s, the gain is s A: the above holds with s A for A, where s is the least "
        "factor of the run. If one of two UGVs stands because it misses a message, the above holds with A/2 for A. In "
        "a period in which both stand, the distance does not recover, and can fall by 2 w h more. With several points, "
        "each with D >= d - W/A, all inequalities can be met at once if there is a unit vector g with n.g >= m > 0 for "
        "every point with D < d + h W/m; then all these bounds are kept together. All this is about robots and static "
        "obstacles, but not about two UGVs that act on old positions of each other, whose losses add up. Beside an "
        "obstacle that may move at a speed V, the passive inequality does not recover a distance: w costs w h in each "
        "period. With a retreat n.v >= w it costs w h once, and with n.v >= w + V nothing is lost."
    )
    latex = (
        r"A h \le 1, \; \lVert e \rVert \le w, \; D(0) \ge d - \frac{W}{A} \; \Rightarrow \; D(t) \ge d - "
        r"\frac{W}{A} \text{ for all } t",
        r"W = w \text{ (obstacle)}, \quad W = 2 w \text{ (two disturbed robots)}",
    )
    method = (
        "Theorems in Coq: a pair whose radial speed falls short by at most W keeps d - W/A. The hypotheses are checked "
        "here in exact arithmetic. Tests drive the running layer through disturbed runs."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "The disturbance may change at any time, but is bounded by w in every direction (for a UGV: in its plane).",
        "A static obstacle consists of convex sets, each counted as one point in the statement. Inside a safe distance"
        " v = 0 is not feasible, and the inequalities of several points can contradict each other; the layer then "
        "takes the least violation. So only one inequality may be violated at a time, or there must be a common "
        "direction g as in the statement. A UGV straight under the UAV has no such direction; there its disturbance "
        "does not matter, and the UAV's half suffices (`Gate.overhead`).",
        "w is 10 % of the largest speed limit, but at most A/4 times the smallest safe distance (A/8 if a UGV may "
        "stand because it misses a message), so that at least half of that distance is left. It is our choice, not a "
        "property of a robot.",
        "Positions are measured exactly and without delay.",
        "While a pair is out of sensing range, its robots command at most their speed limits, and w is added. Within a"
        " safe distance of another body, the layer itself may command more.",
    )
    does_not_establish = (
        "That the disturbance of a real robot stays below w. Any distance from an obstacle that may move: the report "
        "counts the periods in which a robot too near to one retreated fast enough. Any distance if inequalities "
        "contradict each other: a disturbed robot can push another one into an obstacle, up to contact. Bounds on how "
        "long a robot stays inside the safe distance, or on its speed there."
    )

    theorems = (
        "Budget.budget_always",
        "Budget.one_stands",
        "Turning.shortened_gain",
        "Gate.deficit_closed_form",
        "Gate.common_direction",
        "Gate.overhead",
        "Passive.restored",
        "Passive.loss_is_real",
    )
    margin_of = "distance from centre to core that is left, d - W/A"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        given = constants(scenario)
        least = float(min(pair.safe_m for pair in kinds_of(given)))
        fastest = max(robot.max_speed_m_s for robot in scenario.robots.values())
        stands = any(scenario.seen(ugv)["may_stand"] for ugv in scenario.ugvs)
        gain = given["avoidance_gain_1_s"] / (2.0 if stands else 1.0)
        disturbance = {"disturbance_m_s": min(0.1 * fastest, gain * least / 4.0)}
        return {**given, **disturbance, **({"ugvs_may_stand": True} if stands else {})}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        gain, h = decimal(inputs["avoidance_gain_1_s"]), decimal(inputs["period_s"])
        stability = [
            *stable(gain, h),
            Hypothesis.of("A", "the gain A is above 0: it restores a distance", gain, "1/s", strict=True),
        ]
        if gain <= 0:
            return stability
        left = [
            Hypothesis.of(self.margin_of, f"{pair.kind}: d - W/A is above 0", left_m(inputs, pair), "m", strict=True)
            for pair in kinds_of(inputs)
        ]
        ranges = [
            Hypothesis.of(
                "sensing range less d - W/A + (c + W) h",
                f"{pair.kind}: two bodies out of sensing range cannot come nearer than d - W/A within a control period",
                decimal(inputs["sensing_range_m"])
                - left_m(inputs, pair)
                - (pair.closing_m_s + disturbance_m_s(inputs, pair)) * h,
                "m",
            )
            for pair in kinds_of(inputs)
        ]
        return stability + left + ranges

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        if not inputs["avoidance_gain_1_s"] > 0.0:
            return {}
        least = dict[str, float]()
        for pair in kinds_of(inputs):
            least[pair.kind] = min(float(left_m(inputs, pair)), least.get(pair.kind, inf))
        return {"least_distances_m": least}

    def seen_in(self, trace: Trace) -> tuple[int, int, int]:
        """Numbers of periods too near to an obstacle that may move, with a retreat at w, and with one at w + V."""
        w = self.inputs(trace.scenario)["disturbance_m_s"]
        passive = once = kept = 0
        for periods in beside(trace):
            away_m_s = periods.away_m_s[periods.passive]
            passive += len(away_m_s)
            once += int((away_m_s >= w).sum())
            kept += int((away_m_s >= w + periods.pair.speed_m_s).sum())
        return passive, once, kept

    def with_runs(self, finding: Finding, seen: Sequence[tuple[int, ...]]) -> Finding:
        passive, once, kept = (sum(column) for column in zip(*seen, (0, 0, 0), strict=True))
        if not passive or "proof" not in finding.evidence:
            return finding
        # too near to an obstacle that may move: a retreat at w or more with `w_h_once`, at w + V or more with `kept`
        periods = {"passive_periods": passive, "passive_periods_w_h_once": once, "passive_periods_kept": kept}
        return replace(finding, evidence=finding.evidence | periods)


def disturbance_m_s(inputs: dict[str, Any], pair: PairKind) -> Fraction:
    """W: what the disturbances of a pair add up to, m/s."""
    return (1 if pair.kind == "obstacle" else 2) * decimal(inputs["disturbance_m_s"])


def left_m(inputs: dict[str, Any], pair: PairKind) -> Fraction:
    """d - W/A, m; with A/2 between UGVs if one may stand because it misses a message."""
    halved = 2 if pair.kind == "ugv_ugv" and inputs.get("ugvs_may_stand") else 1
    return pair.safe_m - halved * disturbance_m_s(inputs, pair) / decimal(inputs["avoidance_gain_1_s"])
