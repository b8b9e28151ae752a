"""From obligations to a finding: exact certificates, two solvers, and that the hypotheses are not contradictory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from airground_drake.statuses import Status
from airground_drake.verify.engines.obligation import Obligation
from airground_drake.verify.engines.smt import Result, solve
from airground_drake.verify.finding import Finding

LIMIT_S = 20.0


@dataclass(frozen=True)
class Proof:
    """What came of one obligation.

    Attributes:
        obligation: what was to be shown.
        certified: the certificate's identity holds, expanded exactly.
        z3: on the negated goal.
        cvc5: on the negated goal.
        premises: z3 on the hypotheses alone: 'unsat' would make the implication vacuous.
    """

    obligation: Obligation
    certified: bool
    z3: Result
    cvc5: Result
    premises: Result

    @property
    def status(self) -> Status:
        """'proved' needs the certificate, z3, and hypotheses that can be met; cvc5 must not disagree."""
        if self.z3.answer == "sat":
            return "error" if self.certified or self.cvc5.answer == "unsat" else "refuted"
        if self.cvc5.answer == "sat" or self.premises.answer == "unsat":
            return "error"
        sure = self.certified and self.z3.answer == "unsat" and self.premises.answer == "sat"
        return "proved" if sure else "inconclusive"

    def counterexample(self) -> dict[str, Any] | None:
        """z3's model as numbers, if it is rational and evaluated exactly to break the implication."""
        model = self.z3.model
        if self.z3.answer != "sat":
            return None
        found: dict[str, Any] = {"obligation": self.obligation.name, "says": self.obligation.says, "point": model}
        if all(not value.endswith("?") for value in model.values()):
            point = {name: Fraction(model.get(name, "0")) for name in self.obligation.variables}
            found["exactly_checked"] = not self.obligation.holds_at(point)
        return found

    def to_json(self) -> dict[str, Any]:
        """Evidence: the obligation in words and what each way found."""
        return {
            "name": self.obligation.name,
            "says": self.obligation.says,
            "status": self.status,
            "certificate": "expands exactly" if self.certified else "no identity",
            "z3": self.z3.answer,
            "cvc5": self.cvc5.answer,
            "hypotheses": {"sat": "can be met", "unsat": "contradictory"}.get(self.premises.answer, "open"),
            **({"detail": detail} if (detail := self.z3.detail or self.cvc5.detail) else {}),
        }


def discharge(obligations: Sequence[Obligation], limit_s: float = LIMIT_S) -> list[Proof]:
    """Try every obligation in all ways; limit_s per solver call, s."""
    scripts = [each.smt2() for each in obligations]
    premises = [each.smt2(goal=False) for each in obligations]
    z3 = solve([*scripts, *premises], "z3", limit_s)
    cvc5 = solve(scripts, "cvc5", limit_s)
    count = len(obligations)
    certified = [each.certified() for each in obligations]
    return [Proof(*of) for of in zip(obligations, certified, z3[:count], cvc5, z3[count:], strict=True)]


def finding(proofs: Sequence[Proof], **evidence: Any) -> Finding:
    """The finding over all obligations of a claim; the worst status counts."""
    order: tuple[Status, ...] = ("error", "refuted", "inconclusive", "proved")
    status: Status = min((proof.status for proof in proofs), key=order.index, default=order[0])
    broken = next((found for proof in proofs if (found := proof.counterexample())), None)
    return Finding(
        status,
        counterexample=broken if status == "refuted" else None,
        evidence={**evidence, "obligations": [proof.to_json() for proof in proofs]},
        exercised=len(proofs),
    )


def proved_again(found: Finding, obligations: Sequence[Obligation]) -> bool:
    """Whether each certificate expands."""
    return found.status == "proved" and all(each.certified() for each in obligations)
