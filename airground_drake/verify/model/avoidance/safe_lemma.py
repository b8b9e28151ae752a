"""SAFE-LEMMA: the distance on a straight line is at least its linear part.

The obligations and the Gram matrix are in `lemma.py`. Certificate files: `obligations.json` and `<obligation>.smt2` as
`engines/obligation.py` describes them, and `gram.json`, see `lemma.py`.
"""

from __future__ import annotations

from dataclasses import replace

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.prover import discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.constants import Inputs
from airground_drake.verify.model.avoidance.lemma import gram_certificate, lemma
from airground_drake.verify.model.avoidance.obligations import LIMIT_S


class SafeLemma(ModelClaim):
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
    method = (
        "Lagrange's identity ||x||^2 ||v||^2 - (x.v)^2 = sum over i < j of (x_i v_j - x_j v_i)^2, expanded exactly, "
        "and as a rational Gram matrix with exact LDL; the step from squares to norms by polynomial certificates for "
        "both signs of the right-hand side. z3 and cvc5 on the negations."
    )
    equations = "none of the paper's; it turns (7)-(8), (11) into statements about one number, the distance"
    assumptions = ("Real arithmetic; x is not 0 (a robot is not at the point that it avoids).",)
    does_not_establish = "Anything about velocities that change within the period, or about rounding (see SAFE-INV)."

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> Inputs:
        """None: it is about no constants."""
        return {}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and build the Gram matrix."""
        gram = gram_certificate()
        found = finding(discharge(lemma(), LIMIT_S), gram_matrix="expands exactly, positive semidefinite by exact LDL")
        return replace(found, certificates=found.certificates | {"gram.json": gram})

    def takes(self, inputs: Inputs, finding: Finding) -> bool:
        """The obligations once more, by expansion, and the Gram matrix."""
        return proved_again(finding, lemma()) and finding.certificates["gram.json"] == gram_certificate()
