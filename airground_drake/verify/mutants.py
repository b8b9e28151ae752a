"""Broken variants of what the proofs are about: each must be refuted, or its claim proves nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.cache import find
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding, Status
from airground_drake.verify.model.avoidance import mutants as avoidance
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.threshold import mutants as threshold
from airground_drake.verify.model.threshold.thr_ddm import ThrDdm
from airground_drake.verify.model.threshold.thr_root import ThrRoot
from airground_drake.verify.model.trigger import mutants as trigger
from airground_drake.verify.model.trigger.zeno_proof import ZenoProof
from airground_drake.verify.model.trigger.zeno_refine import ZenoRefine

Check = Callable[[dict[str, Any]], Finding]


class Mutant(ModelClaim):
    """A broken variant as a claim of its own, expected to be refuted."""

    expected: Status = "refuted"
    formula = method = equations = does_not_establish = ""
    assumptions = ()

    def __init__(self, claim: ModelClaim, name: str, check: Check) -> None:
        """A variant of a claim that takes the claim's inputs."""
        self.of = name.partition(":")[0] if name.startswith(("SAFE-", "THR-")) else claim.id
        self.statement = name.removeprefix(f"{self.of}: ")
        self.id = f"{self.of} mutant: {self.statement}"
        self._claim, self._check = claim, check

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """Those of the claim."""
        return self._claim.inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Decide the broken variant."""
        return self._check(inputs)


_TABLES: tuple[tuple[ModelClaim, dict[str, Check]], ...] = (
    (SafeGate(), avoidance.MUTANTS),
    (SafeDist(), avoidance.DISTURBED),
    (ZenoProof(), trigger.MUTANTS),
    (ZenoRefine(), trigger.REFINED),
    (ThrRoot(), threshold.MUTANTS),
    (ThrDdm(), threshold.SIMULATED),
)

MUTANTS: tuple[Mutant, ...] = tuple(
    Mutant(claim, name, check) for claim, table in _TABLES for name, check in table.items()
)


def refute_mutants(scenario: Scenario, *, kept: Path | None = None) -> list[dict[str, Any]]:
    """What became of every mutant: `claim`, `mutant`, `status`, `refuted`, `counterexample`, `evidence` of an error.

    Args:
        scenario: its constants.
        kept: folder of kept findings, see `verify_model`.
    """
    found = find(MUTANTS, [mutant.inputs(scenario) for mutant in MUTANTS], folder=kept)
    return [
        {
            "claim": mutant.of,
            "mutant": mutant.statement,
            "status": finding.status,
            "refuted": finding.status == "refuted" and finding.counterexample is not None,
            "counterexample": finding.counterexample,
            "error": finding.evidence.get("error"),
        }
        for mutant, finding in zip(MUTANTS, found, strict=True)
    ]
