"""SAFE-BUDGET: bodies that are not where the law steers them keep their distances if the steered points keep theirs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.budget import alike, budget, takes_room
from airground_drake.scenario.schema import Plant, Scenario
from airground_drake.verify.claims.safe_inv import stable
from airground_drake.verify.engines.bodies import Room, law_m, room_of
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim

ROUNDED_M = Fraction(1, 10**12)  # two ways to add up a budget differ by no more than this, m
BASIC = ("Budget.at_samples", "Budget.budget_always")
OWN = "own"  # stands for all users' plants among the kinds
FORWARDS = "unicycle that never drives backwards"  # one more theorem about such a unicycle
# The theorems about each kind of plant.
BY_KIND = {
    "unicycle": ("Plants.chord", "Turning.chord_turns", "Turning.shortened_chord", "Turning.shortened"),
    "lag": ("Plants.lag", "Plants.lag_speed", "Plants.lag_pair", "Plants.lag_needs"),
    "delay": ("Plants.delay",),
    FORWARDS: ("Plants.forwards",),
    OWN: ("Mixed.drifting", "Mixed.entry_keeps"),
}
# Those about a robot beside an obstacle that may move, and the covers that count there.
BESIDE_MOVING = ("Passive.own_doing", "Passive.kept", "Mixed.unicycle_chord", "Mixed.lagging", "Mixed.delayed")


class SafeBudget(TheoremClaim):
    """SAFE-BUDGET."""

    id = "SAFE-BUDGET"
    subject = "distance for lag and delay"
    summary = (
        "The law keeps the safe distance plus what turning, lags and delays cost, so bodies keep the safe distance."
    )
    statement = (
        "Where the points that the law steers keep the law's distance d_law at the samples, the bodies of robots that "
        "turn, lag, get their commands late or have a plant of the user's own keep the safe distance d at all times, "
        "from a start at which they have it. Beside an obstacle that appears later, that is where a body that lags or "
        "gets its commands late, and its way under commands already given, are clear (SAFE-HYP). "
        "Beside an obstacle that may move, the bodies keep in the same way what SAFE-OWN states. For each kind of pair "
        "d_law is at least what the theorems ask for."
    )
    latex = (
        r"d_{\mathrm{law}} \ge b + \sum_{i} (c_i + f_i + w_i / A), \quad b = d + V |\delta_i - \delta_j| \text{ or } "
        r"\sum_i |\tau_i - \tau| V_i + \sqrt{(d + V |\delta_i - \delta_j|)^2 + (\tau V_{\mathrm{rel}})^2}",
        r"c = l, \quad f = \tfrac{1}{8} |\omega| \lVert v \rVert h^2 \text{ (unicycle, chord steering)}; \quad c, w "
        r"\text{ as declared (the user's own)}",
        r"b + c = \sqrt{d^2 + l^2} \text{ beside a set at rest (never backwards)}",
    )
    method = (
        "Theorems in Coq about each kind of plant. Their hypotheses on the numbers of the scenario are checked here; "
        "the distances of the law are computed again by separate code, and must agree to 1e-12 m. SAFE-HYP checks what "
        "a run has to meet."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "The plants of the scenario are those of the robots: no slip, no error of a heading, time constant or delay. "
        "The user's own plants drift and cover no more than they declare (SAFE-HYP measures both in the run).",
        "Commands stay within the speed limits (SAFE-HYP checks the run).",
        "A delay comes before a lag. Between a robot with either and a unicycle, what both cost is added up.",
    )
    does_not_establish = (
        "That the steered points keep the law's distance (SAFE-INV does), or that a command was met in full: a "
        "shortened command recovers a distance at a smaller gain."
    )
    theorems: tuple[str, ...] = ()
    margin_of = "distance in the law less what the plants take"

    def applies(self, scenario: Scenario) -> bool:
        """Only a scenario with robots that are not where the law steers them."""
        return takes_room(scenario)

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """Gain and period; the kinds of plants and what they take; the distances of each kind of pair."""
        control, robots = scenario.control, scenario.robots
        turning = [
            {
                "robot": name, "hand_point_m": plant.hand_point_m, "speed_m_s": robot.max_speed_m_s,
                "turn_rad_s": _limit(plant.max_turn_rad_s, plant.wheel_base_m, plant.max_wheel_speed_m_s),
            }
            for name, robot in robots.items() for plant in robot.plant if plant.kind == "unicycle"
        ]  # fmt: skip
        return {
            "avoidance_gain_1_s": control.avoidance_gain_1_s,
            "period_s": control.period_s,
            "kinds": sorted({kind for robot in robots.values() for plant in robot.plant for kind in _kinds(plant)}),
            "unicycles": turning,
            "pairs": [
                {
                    "first": one.first, "second": one.second, "kind": one.kind, "law_m": one.law_m,
                    "safe_m": one.promised_m + one.radii_m,
                    "rooms": [
                        list(room_of(robots[name], control)) for name in (one.first, one.second) if name in robots
                    ],
                }
                for one in (group[0] for group in alike(budget(scenario))) if one.terms
            ],
        }  # fmt: skip

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Check the hypotheses; the theorems are those about the kinds of plants that the scenario has."""
        moving = any(pair["kind"] == "moving" for pair in inputs["pairs"])
        claim = SafeBudget()
        claim.theorems = (
            *BASIC,
            *(name for kind in inputs["kinds"] for name in BY_KIND[kind]),
            *(BESIDE_MOVING * moving),
        )
        return TheoremClaim.check(claim, inputs)

    def hypotheses(self, inputs: dict[str, Any]) -> Sequence[Hypothesis]:
        """A h at most 1; hand points ahead, turns of less than half a circle; distances in the law."""
        gain, h = decimal(inputs["avoidance_gain_1_s"]), decimal(inputs["period_s"])
        return [*stable(gain, h), *self._unicycles(inputs, h), *self._pairs(inputs)]

    def _unicycles(self, inputs: dict[str, Any], h: Fraction) -> Iterator[Hypothesis]:
        for each in inputs["unicycles"]:
            hand, name = decimal(each["hand_point_m"]), each["robot"]
            yield Hypothesis.of("l", f"{name}: the hand point is ahead of the axle", hand, "m", strict=True)
            fast = 2 * hand - decimal(each["speed_m_s"]) * h
            turn = each["turn_rad_s"]
            half = Fraction(314159265358979, 10**14) - decimal(turn) * h if turn is not None else Fraction(-1)
            says = f"{name}: V h is at most 2 l, or omega_max h is below pi"
            yield Hypothesis.of("turn in a period", says, max(fast, half), strict=fast < 0)

    def _pairs(self, inputs: dict[str, Any]) -> Iterator[Hypothesis]:
        for pair in inputs["pairs"]:
            first, *second = (Room(*room) for room in pair["rooms"])
            passive = pair["kind"] == "moving"
            needed = law_m(pair["safe_m"], first, second[0] if second else None, passive=passive)
            says = (
                f"{pair['first']}, {pair['second']}: {pair['law_m']:.6g} m in the law are at least the "
                f"{needed:.6g} m that keep {pair['safe_m']:.6g} m"
            )
            margin = Fraction(pair["law_m"]) - Fraction(needed)
            yield Hypothesis(self.margin_of, says, float(margin), "m", margin >= -ROUNDED_M)


def _kinds(plant: Plant) -> list[str]:
    """The keys in `BY_KIND` of a plant."""
    if plant.is_own:
        return [OWN]
    return [*([plant.kind] if plant.kind in BY_KIND else []), *([] if plant.backwards else [FORWARDS])]


def _limit(turn_rad_s: float, base_m: float, wheel_m_s: float) -> float | None:
    """Turning limit by the limits of turns and of wheels, rad/s; None without one."""
    limits = [turn_rad_s or math.inf, 2.0 * wheel_m_s / base_m if base_m else math.inf]
    return min(limits) if min(limits) < math.inf else None
