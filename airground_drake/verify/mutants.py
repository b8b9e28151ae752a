"""Judging the broken variants that are registered: each must be refuted, or its claim proves nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from airground_drake.progress import SILENT, Watch
from airground_drake.scenarios.schema import Scenario
from airground_drake.statuses import Status
from airground_drake.verify.cache import find
from airground_drake.verify.claim import ModelClaim, Mutant
from airground_drake.verify.finding import Finding
from airground_drake.verify.registry import model_claims, mutants


class MutantClaim(ModelClaim):
    """A broken variant as a claim of its own, expected to be refuted, so that its finding is kept like any other."""

    expected: Status = "refuted"
    formula = ""
    method = ""
    equations = ""
    assumptions = ()
    does_not_establish = ""

    def __init__(self, mutant: Mutant) -> None:
        """The claim that a mutant is."""
        self.mutant = mutant
        self.statement = mutant.says
        self.id = f"{mutant.claim} mutant: {mutant.says}"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """Those of the claim that must refute it."""
        (claim,) = model_claims([self.mutant.claim])
        return claim.inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Decide the broken variant."""
        return self.mutant.check(inputs)

    def takes(self, inputs: dict[str, Any], finding: Finding) -> bool:
        """A refutation: there is nothing to prove again."""
        return finding.status == "refuted" and finding.counterexample is not None


def refute_mutants(scenario: Scenario, *, kept: Path | None = None, watch: Watch = SILENT) -> list[dict[str, Any]]:
    """What became of every mutant: `claim`, `mutant`, `status`, `refuted`, `counterexample`, `error`, `from_cache`.

    Args:
        scenario: its constants.
        kept: folder of kept findings, see `verify_model`.
        watch: is told how many there are, and of each.
    """
    broken = [MutantClaim(mutant) for mutant in mutants()]
    watch.stage("broken variants of proofs", len(broken), "proofs")
    found = find(broken, [claim.inputs(scenario) for claim in broken], folder=kept, watch=watch)
    return [
        {
            "claim": claim.mutant.claim,
            "mutant": claim.mutant.says,
            "status": finding.status,
            "refuted": finding.status == "refuted" and finding.counterexample is not None,
            "counterexample": finding.counterexample,
            "error": finding.evidence.get("error"),
            "from_cache": finding.from_cache,
        }
        for claim, finding in zip(broken, found, strict=True)
    ]
