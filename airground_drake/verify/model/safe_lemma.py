"""SAFE-LEMMA: the distance on a straight line is at least its linear part (proofs/Safety.v)."""

from __future__ import annotations

from typing import Any

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.model.pair_kinds import constants, kinds_of
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim


class SafeLemma(TheoremClaim):
    """SAFE-LEMMA."""

    id = "SAFE-LEMMA"
    summary = "On a straight line the distance from a point never falls faster than it does at the start."
    statement = (
        "On a straight line the distance from a point is at least its value at the start plus the time times its rate "
        "of change at the start: ||x + s v|| >= ||x|| + s (x.v)/||x|| for x other than 0 and s >= 0, in space and in "
        "the plane."
    )
    formula = "||x + s v|| >= ||x|| + s (x.v)/||x||, x != 0, s >= 0"
    latex = (
        r"\lVert x + s v \rVert \ge \lVert x \rVert + s \frac{x^\top v}{\lVert x \rVert}, \quad x \ne 0, "
        r"\quad s \ge 0",
    )
    method = "A theorem in Coq. That x is not 0 follows from safe distances above 0."
    equations = "none of the paper's; it turns (7)-(8), (11) into statements about one number, the distance"
    assumptions = ("Real arithmetic. A robot is not at the point that it avoids.",)
    does_not_establish = "Anything about velocities that change within a period, or about rounding (see SAFE-HYP)."

    theorems = ("Safety.lemma", "Safety.lemma_in_the_plane")
    margin_of = "least safe distance of centres"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The safe distances of the scenario's pairs, m."""
        return {"pairs": constants(scenario)["pairs"]}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        """Safe distances are positive, so that no pair is at one point."""
        return [
            Hypothesis.of(self.margin_of, f"{each.kind}: the safe distance is above 0", each.safe_m, "m", strict=True)
            for each in kinds_of(inputs)
        ]
