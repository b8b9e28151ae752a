"""A claim about the model that is a theorem: Coq checked it once, and its hypotheses are checked for each scenario."""

import abc
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Self

from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Evidence, Finding
from airground_drake.verify.proofs import THEOREMS, standing


@dataclass(frozen=True)
class Hypothesis(Evidence):
    """A hypothesis of a theorem with the numbers of a scenario."""

    hypothesis: str  # what the margin is of, in a few words
    says: str  # the hypothesis in words
    margin: float  # how far it is from failing, in `unit`
    unit: str
    holds: bool

    @classmethod
    def of(cls, name: str, says: str, margin: Fraction, unit: str = "", *, strict: bool = False) -> Self:
        """Decide it by its exact margin; if `strict`, a margin of 0 fails."""
        return cls(name, says, float(margin), unit, margin > 0 if strict else margin >= 0)


@dataclass(frozen=True, kw_only=True)
class Proof(Evidence):
    """The evidence of a theorem."""

    proof: str  # whether Coq has checked the theorems, in words
    theorems: dict[str, str]  # what they say, by name
    hypotheses: Sequence[Hypothesis]  # those that were checked
    reason: str | None = None  # why the claim is left open
    applies_to: int | None = None  # how often the runs of a report met the premise, `of` how many times
    of: int | None = None


def grounds(theorems: Sequence[str], hypotheses: Sequence[Hypothesis]) -> dict[str, Any]:
    """The fields of a `Proof`; `reason` says why the theorems prove nothing here, and is None if they do."""
    stands = standing(*theorems)
    broken = next((hypothesis for hypothesis in hypotheses if not hypothesis.holds), None)
    reason = None if stands.checked else f"the theorems are {stands.words}"
    return {
        "proof": stands.words,
        "theorems": {name: THEOREMS[name].statement for name in theorems},
        "hypotheses": hypotheses,
        "reason": reason if broken is None else f"a hypothesis fails: {broken.says}",
    }


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

    def evidence(self, inputs: dict[str, Any], **proof: Any) -> Proof:
        return Proof(**proof)

    def with_runs(self, finding: Finding, seen: Sequence[tuple[int, int]]) -> Finding:
        """Add how often the runs met the premise, of how many times: a theorem that never applies protects nothing."""
        if not seen or not isinstance(finding.evidence, Proof):
            return finding
        met, cases = (sum(column) for column in zip(*seen, strict=True))
        return replace(finding, evidence=replace(finding.evidence, applies_to=met, of=cases))

    def counterexample(self, inputs: dict[str, Any], broken: Hypothesis) -> dict[str, Any] | None:
        """A case that refutes the claim if this hypothesis fails; None: the claim is only left open."""
        return None

    def check(self, inputs: dict[str, Any]) -> Finding:
        hypotheses = self.hypotheses(inputs)
        broken = [hypothesis for hypothesis in hypotheses if not hypothesis.holds]
        named = [hypothesis for hypothesis in hypotheses if hypothesis.hypothesis == self.margin_of]
        shown = broken[0] if broken else min(named, key=lambda hypothesis: hypothesis.margin)
        evidence = self.evidence(inputs, **grounds(self.theorems, hypotheses))
        finding = Finding(
            "proved", shown.margin, shown.unit, evidence=evidence, quantity=shown.hypothesis, exercised=len(hypotheses)
        )
        against = self.counterexample(inputs, shown) if broken else None
        if against is not None:
            return replace(finding, status="refuted", counterexample=against, evidence=replace(evidence, reason=None))
        return finding if evidence.reason is None else replace(finding, status="inconclusive")
