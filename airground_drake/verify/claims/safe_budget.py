"""SAFE-BUDGET: bodies off their steered points keep their distances if the steered points keep the law's."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.model.plants.budget import AT_REST, kept_distance, least_gain, of_views
from airground_drake.model.plants.plant import Plant
from airground_drake.scenario.budget import alike, budget, takes_room
from airground_drake.scenario.plants import made
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claims.safe_inv import stable
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim

OLD = "distance promised to UGVs that act on old positions"
ROUNDED_M = 1e-12  # largest deficit of a distance of the law through rounding, m
BASIC = ("Budget.at_samples", "Budget.budget_always")
# Those about a robot beside an obstacle that may move; a plant adds its own.
OF_STANDING = ("Budget.one_stands", "Budget.smaller_gain", "Mixed.entry_keeps")
OF_ERRORS = ("Budget.measured_start", *OF_STANDING)
OF_VIEWS = ("Budget.own_views",)
OF_OLD = ("Async.towards_old", "Async.old_positions")
BESIDE_MOVING = ("Passive.own_doing", "Passive.kept")


class SafeBudget(TheoremClaim):
    id = "SAFE-BUDGET"
    subject = "distance budget"
    summary = "The law allows for turning, lags, delays and position errors, so that bodies keep the safe distance."
    statement = (
        "Let the points that the law steers keep the law's distance d_law at the samples, and let the bodies start at "
        "the safe distance d. Then the bodies keep d at all times. This covers robots that turn, lag, receive commands"
        " late or have the user's own plant; robots that act on measured positions with bounded errors; and UGVs that "
        "stand still if they miss another UGV's message. With measured positions, each pair meets its inequality as "
        "measured, or both stand. UGVs that act on old positions of each other, of any age, keep d if each avoids all "
        "points that the other can reach before it decides again. When an obstacle appears, a body with a lag or delay"
        " must be clear of it, and so must its path under commands already given (SAFE-HYP). SAFE-OWN applies beside "
        "an obstacle that may move. For each kind of pair d_law is at least the distance that the theorems require."
    )
    latex = (
        r"d_{\mathrm{law}} \ge b + \sum_{i} (c_i + f_i + w_i / A), \quad b = d + V |\delta_i - \delta_j| \text{ or } "
        r"\sum_i |\tau_i - \tau| V_i + \sqrt{(d + V |\delta_i - \delta_j|)^2 + (\tau V_{\mathrm{rel}})^2}",
        r"c = l, \quad f = \tfrac{1}{8} |\omega| \lVert v \rVert h^2 \text{ (unicycle, chord steering)}; \quad c, w "
        r"\text{ as declared (the user's own)}",
        r"b + c = \sqrt{d^2 + l^2} \text{ beside a set at rest (never backwards)}",
        r"e \text{ (errors of measured positions)}: \; d_{\mathrm{law}} \ge e + \sqrt{m^2 + e^2} + \sum_i w_i / A', "
        r"\quad m = b + \sum_i (c_i + f_i), \quad e (1 - A' h) \le A' h \sqrt{m^2 + e^2}, \quad A' = A / 2 "
        r"\text{ (two robots)}",
        r"n^\top u \ge -(D - d - \rho)/h \text{ where } D \ge d + \rho, \text{ else } D \, n^\top u \ge \rho "
        r"\lVert u \rVert, \quad \rho = V (\text{age} + h) \text{ (old positions)}",
    )
    method = (
        "Theorems in Coq about each kind of plant. Their hypotheses on the numbers of the scenario are checked here; "
        "the distance that bodies keep is computed from the law's distance, and may be less than the safe distance by "
        "1e-12 m. SAFE-HYP checks the hypotheses about a run. `airground check` computes the law's distances again."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "The scenario's plants describe the robots exactly: no slip, no error of heading, time constant or delay. "
        "Drift and cover of the user's own plants stay within the declared values (SAFE-HYP measures both in the run).",
        "Commands stay within the speed limits (SAFE-HYP checks the run).",
        "Errors of measured positions stay within their bound (SAFE-HYP checks the run).",
        "UGVs that act on old positions of each other are discs that follow commands exactly (others are refused), and"
        " start d apart; the positions were exact when sent, and both have the period h (SAFE-HYP checks each step).",
        "A delay comes before a lag. Between a robot with either and a unicycle, both costs are added.",
    )
    does_not_establish = (
        "That the steered points keep the law's distance (SAFE-INV does), or that commands were not shortened: a "
        "shortened command recovers a distance with a smaller gain."
    )
    theorems: tuple[str, ...] = (*BASIC, *OF_ERRORS, *OF_VIEWS, *OF_OLD, *BESIDE_MOVING, "Plants", "Turning", "Mixed")
    margin_of = "distance in the law less what the plants take"

    def applies(self, scenario: Scenario) -> bool:
        """Only for robots off their steered or measured points, or that may miss positions."""
        lacking = any(scenario.seen(ugv)["may_stand"] for ugv in scenario.ugvs)
        return takes_room(scenario) or lacking or (scenario.asynchronous and len(scenario.ugvs) > 1)

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        control, robots = scenario.control, scenario.robots
        return {
            "avoidance_gain_1_s": control.avoidance_gain_1_s,
            "period_s": control.period_s,
            "robots": {
                name: {"plant": [asdict(keys) for keys in robot.plant], "max_speed_m_s": robot.max_speed_m_s}
                for name, robot in robots.items()
            },
            **({"position_error_m": scenario.position_error_m} if scenario.position_error_m else {}),
            **({"may_stand": stands} if (stands := [n for n in robots if scenario.seen(n)["may_stand"]]) else {}),
            **({"own_views": True} if scenario.own_views else {}),
            **({"old_positions": self._old(scenario)} if scenario.asynchronous else {}),
            "pairs": [
                {
                    "first": pair.first, "second": pair.second, "kind": pair.kind, "law_m": pair.law_m,
                    "safe_m": pair.promised_m + pair.radii_m,
                }
                for pair in (group[0] for group in alike(budget(scenario))) if pair.terms or stands
            ],
        }  # fmt: skip

    def _old(self, scenario: Scenario) -> list[dict[str, Any]]:
        """For each kind of UGV pairs: promised distance, and least uncertainty of the other position, m."""
        groups = (group[0] for group in alike(budget(scenario)) if group[0].kind == "ugv")
        return [
            {
                "first": pair.first, "second": pair.second, "safe_m": pair.promised_m + pair.radii_m,
                "unsure_m": pair.unsure_m,
            } for pair in groups
        ]  # fmt: skip

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Check the hypotheses of the theorems about the scenario's plants."""
        moving = any(pair["kind"] == "moving" for pair in inputs["pairs"])
        plants = [plant for plant, _ in _plants(inputs).values()]
        named = [*BASIC, *(name for plant in plants for name in plant.theorems)]
        if moving:
            named += [*BESIDE_MOVING, *(name for plant in plants for name in plant.passive_theorems)]
        named += OF_ERRORS if "position_error_m" in inputs else OF_STANDING if "may_stand" in inputs else ()
        named += OF_VIEWS if "own_views" in inputs else ()
        named = [*(named if inputs["pairs"] else ()), *(OF_OLD if "old_positions" in inputs else ())]
        claim = SafeBudget()
        claim.theorems = (*dict.fromkeys(named),)
        claim.margin_of = self.margin_of if inputs["pairs"] else OLD
        return TheoremClaim.check(claim, inputs)

    def hypotheses(self, inputs: dict[str, Any]) -> Sequence[Hypothesis]:
        gain, h = decimal(inputs["avoidance_gain_1_s"]), decimal(inputs["period_s"])
        needs = [
            Hypothesis.of(need.symbol, f"{name}: {need.says}", need.margin, need.unit, strict=need.strict)
            for name, (plant, speed) in _plants(inputs).items()
            for need in plant.needs(speed)
        ]
        old = [
            Hypothesis.of(
                OLD,
                f"{pair['first']}, {pair['second']}: {pair['safe_m']:.6g} m are promised to UGVs that reckon with "
                f"{pair['unsure_m']:.6g} m of the other's way, or more",
                decimal(pair["safe_m"]), "m", strict=True,
            )
            for pair in inputs.get("old_positions", ())
        ]  # fmt: skip
        return [*stable(gain, h), *needs, *old, *self._pairs(inputs)]

    def _pairs(self, inputs: dict[str, Any]) -> Iterator[Hypothesis]:
        error_m = inputs.get("position_error_m", 0.0)
        share = float(decimal(inputs["avoidance_gain_1_s"]) * decimal(inputs["period_s"]))
        stands, own_views = inputs.get("may_stand", ()), "own_views" in inputs
        bounds = {
            name: plant.bounds(speed)._replace(error_m=error_m, may_stand=name in stands, own_views=own_views)
            for name, (plant, speed) in _plants(inputs).items()
        }
        for pair in inputs["pairs"]:
            both = (bounds[pair["first"]], bounds.get(pair["second"], AT_REST))
            passive = pair["kind"] == "moving"
            points = pair["law_m"] - float(of_views(pair["safe_m"], *both, gain=inputs["avoidance_gain_1_s"]))
            kept = kept_distance(points, *both, gain=inputs["avoidance_gain_1_s"], passive=passive)
            says = (
                f"{pair['first']}, {pair['second']}: {pair['law_m']:.6g} m in the law keep {kept:.6g} m, at least "
                f"the {pair['safe_m']:.6g} m promised"
            )
            margin = max(kept, 0.0) - pair["safe_m"]
            holds = margin * pair["safe_m"] >= -ROUNDED_M * pair["law_m"]  # rounding in the law
            yield Hypothesis(self.margin_of, says, margin, "m", holds)
            if error_m and not passive:
                least = least_gain(pair["safe_m"], *both)
                says = f"{pair['first']}, {pair['second']}: A h = {share:.6g} bears the errors, at least {least:.6g}"
                yield Hypothesis("A h less what errors ask for", says, share - least, "1", share >= least)


def _plants(inputs: dict[str, Any]) -> dict[str, tuple[Plant, float]]:
    """The plant and the speed limit, m/s, of each robot among the inputs."""
    return {
        name: (made(given["plant"], inputs["period_s"]), given["max_speed_m_s"])
        for name, given in inputs["robots"].items()
    }
