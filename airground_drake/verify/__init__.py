"""Claims about the model and about runs.

`verify(trace)` judges a run from its trace alone; `verify_model(scenario)` proves, or supports by experiments of
its own, what holds whatever the run. Checkers of traces share no code with the controllers, the simulator or the
optimiser whose work they judge; proofs take their constants from the objects that the simulation runs.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import cast

from airground_drake.scenarios.schema import Scenario
from airground_drake.trace import Trace
from airground_drake.verify.ddm import ThrDdm
from airground_drake.verify.disturbance import SafeDist
from airground_drake.verify.findings import cache_folder, find
from airground_drake.verify.gatekeeping import GateFeas
from airground_drake.verify.invariance import SafeGate, SafeInv, SafeLemma
from airground_drake.verify.optimality import GateOpt, GateSur
from airground_drake.verify.outcome import Comm, GateTime, LiveGoal
from airground_drake.verify.refinement import ZenoRefine
from airground_drake.verify.safety import SafeHyp, SafeTrace
from airground_drake.verify.threshold import ThrOpt, ThrRoot
from airground_drake.verify.triggering import ThrTrig, ZenoTrace
from airground_drake.verify.verdict import PASSING, STATUSES, Claim, Finding, ModelClaim, Status, TraceClaim, Verdict
from airground_drake.verify.zeno import ZenoProof

__all__ = [
    "MODEL_CLAIMS",
    "PASSING",
    "STATUSES",
    "TRACE_CLAIMS",
    "Claim",
    "Finding",
    "ModelClaim",
    "Status",
    "TraceClaim",
    "Verdict",
    "cache_folder",
    "verify",
    "verify_model",
]

MODEL_CLAIMS: tuple[ModelClaim, ...] = (
    SafeLemma(),
    SafeInv(),
    SafeGate(),
    SafeDist(),
    ZenoProof(),
    ZenoRefine(),
    ThrRoot(),
    ThrOpt(),
    ThrDdm(),
)
"""The claims about the model, in the order of the report."""

TRACE_CLAIMS: tuple[TraceClaim, ...] = (
    SafeTrace(),
    SafeHyp(),
    ZenoTrace(),
    ThrTrig(),
    GateOpt(),
    GateSur(),
    GateFeas(),
    GateTime(),
    LiveGoal(),
    Comm(),
)
"""The claims that are decided from one trace, in the order of the report."""


def verify(trace: Trace) -> list[Verdict]:
    """Judge every claim that applies to the run's method.

    Args:
        trace: one run.

    Returns:
        One verdict per applicable claim, with the status that the scenario expects of this run ('holds' unless
        it says otherwise). Anything that keeps a claim from being decided is the status 'error'.
    """
    runs = trace.meta.get("scenario", {}).get("runs", {})
    run = str(trace.meta.get("run"))
    expected = runs.get(run, {}).get("expected", {})
    return [
        Verdict(claim, run, claim.judge(trace), expected.get(claim.id, claim.expected))
        for claim in TRACE_CLAIMS
        if claim.applies(trace)
    ]


def verify_model(scenario: Scenario, *, kept: Path | None = None, only: Collection[str] | None = None) -> list[Verdict]:
    """Judge every claim about the model of a scenario.

    Args:
        scenario: its constants.
        kept: folder of findings that are reused if nothing that they depend on has changed (`cache_folder()`);
            None: everything anew.
        only: identifiers of the claims to judge; default: all.

    Returns:
        One verdict per claim, run '', with the status that the scenario expects ('proved' or 'supported' unless
        it says otherwise).
    """
    claims = [claim for claim in MODEL_CLAIMS if only is None or claim.id in only]
    inputs = [claim.judge_inputs(scenario) for claim in claims]
    findings = find(claims, inputs, folder=kept)
    return [
        Verdict(claim, "", finding, cast("Status", scenario.expected.get(claim.id, claim.expected)), given)
        for claim, given, finding in zip(claims, inputs, findings, strict=True)
    ]
