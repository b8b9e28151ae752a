"""Judging every claim that is registered: on a run, or about the model of a scenario."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import cast

from airground_drake.scenarios.schema import Scenario
from airground_drake.trace import Trace
from airground_drake.verify.cache import find
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Status
from airground_drake.verify.registry import model_claims, run_claims


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
        for claim in run_claims()
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
    claims = [claim for claim in model_claims() if only is None or claim.id in only]
    inputs = [claim.judge_inputs(scenario) for claim in claims]
    findings = find(claims, inputs, folder=kept)
    return [
        Verdict(claim, "", finding, cast("Status", scenario.expected.get(claim.id, claim.expected)), given)
        for claim, given, finding in zip(claims, inputs, findings, strict=True)
    ]
