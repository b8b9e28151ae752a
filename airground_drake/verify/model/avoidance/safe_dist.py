"""SAFE-DIST: what is left of the safe distance when velocities are disturbed.

Symbols are those of `safe_inv.py`; besides, every robot moves with v + e(t), ||e(t)|| <= w, instead of v, and W is
what the disturbances of a pair add up to: w beside an obstacle, 2 w between robots. In a period the disturbance
displaces by q, ||q|| <= s W, so that D(s) >= D + s r + n.q >= D + s (r - W). From this, with A h <= 1:

    outside, D >= d:            D(s) >= d - h W,
    inside, deficit c = d - D:  c after the period <= (1 - A h) c + h W, and c <= W/A stays so during the period.

Hence c <= (1 - (1 - A h)^N) W/A after N periods inside in a row: h W after one, W/A in the limit, never more. The
obligations are in `disturbed_obligations.py`, the disturbed runs in `disturbed_runs.py`; certificates are
`obligations.json` and `<obligation>.smt2`, as `engines/obligation.py` describes them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.obligation import Obligation
from airground_drake.verify.engines.prover import discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.conformance import conformance
from airground_drake.verify.model.avoidance.constants import Inputs, constants, kinds
from airground_drake.verify.model.avoidance.disturbed_obligations import disturbed, disturbed_with_scenario, pushed
from airground_drake.verify.model.avoidance.disturbed_runs import TOLERANCE, campaign
from airground_drake.verify.model.avoidance.obligations import LIMIT_S

QUANTITY = "least distance above d - W/A in the disturbed runs whose inequalities were all met"


class SafeDist(ModelClaim):
    """SAFE-DIST."""

    id = "SAFE-DIST"
    summary = "Where velocities are disturbed a little, distances fall short of the safe one by a little at most."
    statement = (
        "If velocities are disturbed by at most w and A h <= 1, no distance falls below d - w/A (obstacle) or "
        "d - 2 w/A (two disturbed robots), as long as its own inequality is met at every sample. Starting at D >= d it "
        "is d - h W after one period and d - (1 - (1 - A h)^N) W/A after N periods inside in a row, W = w or 2 w. "
        "With several points, each with D >= d - W/A, all inequalities can be met at once if there is a unit vector g "
        "with n.g >= m > 0 for every point with D < d + h W/m; then all these bounds are kept together."
    )
    formula = "A h <= 1, ||e|| <= w, D(0) >= d - W/A, inequality met at each sample => D(t) >= d - W/A for all t"
    latex = (
        r"A h \le 1, \; \lVert e \rVert \le w, \; D(0) \ge d - \frac{W}{A} \; \Rightarrow \; D(t) \ge d - "
        r"\frac{W}{A} \text{ for all } t",
        r"W = w \text{ (obstacle)}, \quad W = 2 w \text{ (two disturbed robots)}",
    )
    method = (
        "Polynomial certificates in D, r, s, A, h, d, W, and again with the scenario's numbers; z3 and cvc5 on the "
        "negations. Besides, disturbed runs of the running layer from safe starts in several geometries, pinned, "
        "switching and random: a distance below the bound with all its inequalities met refutes the claim."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "SAFE-LEMMA; the disturbance may change at any time, but is bounded by w in every direction (for a UGV: in its "
        "plane).",
        "Inside a safe distance v = 0 is not feasible, and the inequalities of several points can contradict each "
        "other; the layer then takes the least violation. So: one violated inequality at a time, or a common direction "
        "g as in the statement. The evidence counts where a run did not meet this (`unmet`); a UGV straight under the "
        "UAV never can, but there its disturbance does not count either, and the UAV's half does (`overhead_bound`).",
        "w is 10 % of the largest speed limit, but at most A/4 times the smallest safe distance, so that at least half "
        "of it is left. It is a choice, not a property of a robot.",
        "Positions are measured exactly and without delay. The inequalities are the scenario's: that the built diagram "
        "has them is for SAFE-INV to compare.",
        "While two of them are out of sensing range, robots ask for no more than their speed limits, to which w comes "
        "on top. The layer itself may ask for more within a safe distance of something else.",
    )
    does_not_establish = (
        "That the disturbance of a real robot stays below w; nor anything where inequalities contradict each other: a "
        "disturbed robot can press another, whose half of the pair's inequality has no room, into an obstacle (scene "
        "`squeezed` of the evidence, as far as contact). It does not bound how long a robot stays inside the safe "
        "distance, nor how fast it recovers: the layer's velocities there are not limited."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> Inputs:
        """The constants of SAFE-INV, and the bound on the disturbance, m/s."""
        given = constants(scenario)
        least = min(kind.safe for kind in kinds(given))
        tenth = 0.1 * max(given["team"]["max_speed"])
        return given | {"disturbance_m_s": min(tenth, given["avoidance_gain_1_s"] * least / 4.0)}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, run the attacks; margin: the worst of runs whose inequalities were all met, m."""
        if not inputs["disturbance_m_s"] > 0.0:
            return Finding("inconclusive", evidence={"reason": "without a gain A > 0 nothing restores a distance"})
        compared, rows = conformance(inputs), campaign(inputs)
        bounds = {
            kind.name: kind.safe - pushed(inputs, kind.share) / inputs["avoidance_gain_1_s"] for kind in kinds(inputs)
        }
        found = finding(
            discharge(obligations(inputs), LIMIT_S),
            disturbance_m_s=inputs["disturbance_m_s"], least_distances_m=bounds, runs=rows, conformance=compared,
        )  # fmt: skip
        covered = [row for row in rows if not row["unmet"]]
        if not covered:
            reason = "no disturbed run met the inequalities, so that none says anything"
            return replace(found, status="inconclusive", evidence={**found.evidence, "reason": reason})
        worst = min(covered, key=lambda row: float(row["worst_margin_m"]))
        where: dict[str, Any] = {name: worst["where"][name] for name in ("scene", "attack", "robot", "t_s")}
        found = replace(found, margin=worst["worst_margin_m"], unit="m", quantity=QUANTITY, where=where)
        if found.status == "proved" and any(row["broken"] for row in rows):
            return replace(found, status="refuted", counterexample=next(row for row in rows if row["broken"]))
        if found.status == "proved" and worst["worst_margin_m"] < -TOLERANCE:
            return replace(found, status="refuted", counterexample=worst)
        if found.status == "proved" and not compared["agrees"]:
            return replace(found, status="refuted", counterexample=compared["first_difference"] or compared)
        return found

    def takes(self, inputs: Inputs, finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, obligations(inputs))


def obligations(inputs: Inputs) -> list[Obligation]:
    """What is to be proved."""
    return [*disturbed(), *disturbed_with_scenario(inputs)]
