"""A claim about the model that is a theorem: Coq checked it once, and its hypotheses are checked for each scenario."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from airground_drake.proofs import THEOREMS, standing
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding


@dataclass(frozen=True)
class Hypothesis:
    """What a theorem takes, with the numbers of a scenario.

    Attributes:
        name: what the margin is of, in a few words.
        says: the hypothesis in words.
        margin: how far it is from failing, in `unit`; exact where the numbers are decimals.
        unit: of the margin.
        strict: whether a margin of 0 fails.
    """

    name: str
    says: str
    margin: Fraction
    unit: str = ""
    strict: bool = False

    @property
    def holds(self) -> bool:
        """Whether the scenario meets it."""
        return self.margin > 0 if self.strict else self.margin >= 0

    def to_json(self) -> dict[str, Any]:
        """For the evidence."""
        return {
            "hypothesis": self.name,
            "says": self.says,
            "margin": float(self.margin),
            "unit": self.unit,
            "holds": self.holds,
        }


class TheoremClaim(ModelClaim):
    """A theorem and its hypotheses.

    It is proved if Coq has checked the theories that are installed and every hypothesis holds. A hypothesis that fails
    leaves the claim open, unless `counterexample` shows that what it says is false.

    Attributes (all of the class):
        theorems: names in `airground_drake.proofs.THEOREMS`.
        margin_of: name of the hypothesis whose margin is the claim's.
    """

    theorems: tuple[str, ...]
    margin_of: str
    exercised_by = "hypotheses that were checked"

    @abc.abstractmethod
    def hypotheses(self, inputs: dict[str, Any]) -> Sequence[Hypothesis]:
        """What the theorems take, for these constants."""

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        """What follows from the theorems for these constants, strict JSON."""
        return {}

    def counterexample(self, inputs: dict[str, Any], broken: Hypothesis) -> dict[str, Any] | None:
        """What shows that the claim is false where this hypothesis fails; None: it is only left open."""
        return None

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Check the hypotheses, and whether Coq has checked the theorems as they stand here."""
        found = self.hypotheses(inputs)
        shown = next((each for each in found if not each.holds), None) or _named(found, self.margin_of)
        stands = standing(*self.theorems)
        evidence = {
            "proof": stands.words,
            "theorems": {name: THEOREMS[name].statement for name in self.theorems},
            "hypotheses": [each.to_json() for each in found],
            **self.numbers(inputs),
        }
        finding = Finding(
            "proved",
            margin=float(shown.margin),
            unit=shown.unit,
            quantity=shown.name,
            evidence=evidence,
            exercised=len(found),
        )
        if not shown.holds:
            return self._failed(inputs, shown, finding)
        return finding if stands.checked else _open(finding, f"the theorems are {stands.words}")

    def _failed(self, inputs: dict[str, Any], broken: Hypothesis, finding: Finding) -> Finding:
        against = self.counterexample(inputs, broken)
        if against is None:
            return _open(finding, f"a hypothesis fails: {broken.says}")
        return replace(finding, status="refuted", counterexample=against)


def _named(found: Sequence[Hypothesis], name: str) -> Hypothesis:
    """The hypothesis of this name with the least margin."""
    return min((each for each in found if each.name == name), key=lambda each: each.margin)


def _open(finding: Finding, reason: str) -> Finding:
    return replace(finding, status="inconclusive", evidence={**finding.evidence, "reason": reason})
