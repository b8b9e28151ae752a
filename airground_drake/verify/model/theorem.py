"""Claims that are theorems: checked once by Coq; their hypotheses are checked for each scenario."""

import abc
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Self

from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.proofs import THEOREMS, standing


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis of a theorem with the numbers of a scenario."""

    hypothesis: str  # the quantity with the margin, in a few words
    says: str  # the hypothesis in words
    margin: float  # margin of the hypothesis, in `unit`
    unit: str
    holds: bool

    @classmethod
    def of(cls, name: str, says: str, margin: Fraction, unit: str = "", *, strict: bool = False) -> Self:
        """Decide it by its exact margin; if `strict`, a margin of 0 fails."""
        return cls(name, says, float(margin), unit, margin > 0 if strict else margin >= 0)


def grounds(theorems: Sequence[str], hypotheses: Sequence[Hypothesis]) -> dict[str, Any]:
    """The evidence of theorems; `reason` says why they prove nothing here, and is left out if they do."""
    stands = standing(*theorems)
    broken = next((hypothesis for hypothesis in hypotheses if not hypothesis.holds), None)
    evidence = {
        "proof": stands.words,
        "theorems": {name: THEOREMS[name].statement for name in theorems},
        "hypotheses": hypotheses,
    }
    if broken is not None:
        return evidence | {"reason": f"a hypothesis fails: {broken.says}"}
    return evidence if stands.checked else evidence | {"reason": f"the theorems are {stands.words}"}


class TheoremClaim(ModelClaim):
    """A theorem and its hypotheses.

    It is proved if Coq has checked the installed theories and every hypothesis holds. A hypothesis that fails leaves
    the claim open, unless `counterexample` shows that the claim is false.
    """

    margin_of: str  # name of the hypothesis whose margin is the claim's
    exercised_by = "hypotheses that were checked"

    @abc.abstractmethod
    def hypotheses(self, inputs: dict[str, Any]) -> Sequence[Hypothesis]:
        """The hypotheses of the theorems, for these constants."""

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        """Further entries of the evidence."""
        return {}

    def with_runs(self, finding: Finding, seen: Sequence[tuple[int, int]]) -> Finding:
        """Add how often the runs met the premise: a theorem that never applies protects nothing."""
        if not seen or "proof" not in finding.evidence:
            return finding
        met, cases = (sum(column) for column in zip(*seen, strict=True))
        return replace(finding, evidence=finding.evidence | {"applies_to": met, "of": cases})

    def cited(self, inputs: dict[str, Any]) -> tuple[str, ...]:
        """Those of `theorems` that say something about these constants."""
        return self.theorems

    def counterexample(self, inputs: dict[str, Any], broken: Hypothesis) -> dict[str, Any] | None:
        """A case that refutes the claim if this hypothesis fails; None: the claim is only left open."""
        return None

    def check(self, inputs: dict[str, Any]) -> Finding:
        hypotheses = self.hypotheses(inputs)
        broken = [hypothesis for hypothesis in hypotheses if not hypothesis.holds]
        named = [hypothesis for hypothesis in hypotheses if hypothesis.hypothesis == self.margin_of]
        shown = broken[0] if broken else min(named, key=lambda hypothesis: hypothesis.margin)
        evidence = grounds(self.cited(inputs), hypotheses) | self.numbers(inputs)
        finding = Finding(
            "proved", shown.margin, shown.unit, evidence=evidence, quantity=shown.hypothesis, exercised=len(hypotheses)
        )
        against = self.counterexample(inputs, shown) if broken else None
        if against is not None:
            evidence.pop("reason")
            return replace(finding, status="refuted", counterexample=against)
        return replace(finding, status="inconclusive") if "reason" in evidence else finding
