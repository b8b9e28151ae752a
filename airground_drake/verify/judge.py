"""Judging every claim that is registered: on a run, or about the model of a scenario."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from airground_drake.progress import SILENT, Watch
from airground_drake.scenarios.schema import Scenario
from airground_drake.trace import Trace
from airground_drake.verify.cache import find
from airground_drake.verify.claim import Verdict
from airground_drake.verify.registry import model_claims, run_claims


def verify(trace: Trace, claims: Collection[str] | None = None, watch: Watch = SILENT) -> list[Verdict]:
    """Judge the claims that apply to the run's method.

    Args:
        trace: one run.
        claims: identifiers of the claims to judge; default: all.
        watch: is told of each.

    Returns:
        One verdict per applicable claim, with the status that the scenario expects of this run ('holds' unless
        it says otherwise). Anything that keeps a claim from being decided is the status 'error'.

    Raises:
        UnknownNameError: if an identifier is not that of a claim about a run.
        PluginError: if a claim of the scenario cannot be made.
    """
    scenario, run = trace.meta.get("scenario", {}), str(trace.meta.get("run"))
    expected = scenario.get("runs", {}).get(run, {}).get("expected", {})
    verdicts = []
    for claim in run_claims(claims, scenario.get("claims")):
        with watch.item(f"{claim.id} {run}"):
            if claim.applies(trace):
                verdicts.append(Verdict(claim, run, claim.judge(trace), expected.get(claim.id, claim.expected)))
    return verdicts


def verify_model(
    scenario: Scenario, *, kept: Path | None = None, claims: Collection[str] | None = None, watch: Watch = SILENT
) -> list[Verdict]:
    """Judge the claims about the model of a scenario.

    Args:
        scenario: its constants.
        kept: folder of findings that are reused if nothing that they depend on has changed (`cache_folder()`);
            None: everything anew.
        claims: identifiers of the claims to judge; default: all.
        watch: is told of each.

    Returns:
        One verdict per claim, run '', with the status that the scenario expects ('proved' or 'supported' unless
        it says otherwise).

    Raises:
        UnknownNameError: if an identifier is not that of a claim about the model.
        PluginError: if a claim of the scenario cannot be made.
    """
    chosen = model_claims(claims, scenario.claims)
    inputs = [claim.judge_inputs(scenario) for claim in chosen]
    findings = find(chosen, inputs, folder=kept, watch=watch)
    return [
        Verdict(claim, "", finding, scenario.expected.get(claim.id, claim.expected), given)
        for claim, given, finding in zip(chosen, inputs, findings, strict=True)
    ]
