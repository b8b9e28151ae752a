"""Judging registered claims, on a run or about the model of a scenario."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from airground_drake.base.parallel import run_parallel
from airground_drake.base.progress import SILENT, Progress
from airground_drake.scenario.load import own
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.cache import cached_finding
from airground_drake.verify.claim import OWN, ModelClaim, TraceClaim, Verdict
from airground_drake.verify.finding import Finding
from airground_drake.verify.registry import model_claims, run_claims


def verdicts_to_pandas(verdicts: Iterable[Verdict]) -> pd.DataFrame:
    """A row per verdict: claim, run ('' for the model), status, how often tested, margin, unit, quantity, expected."""
    columns = ["run", "status", "exercised", "margin", "unit", "quantity", "expected"]
    rows = [(verdict.claim.id, *(getattr(verdict, name) for name in columns)) for verdict in verdicts]
    return pd.DataFrame(rows, columns=["claim", *columns])


def judge(trace: Trace, claims: Collection[str] | None = None, progress: Progress = SILENT) -> list[Verdict]:
    """Judge the claims that apply to the run's method.

    Args:
        trace: one run.
        claims: identifiers of the claims to judge; default: all.
        progress: is told of each.

    Returns:
        One verdict per applicable claim, with the status that the scenario expects of this run ('holds' unless
        it says otherwise). Anything that keeps a claim from being decided is the status 'error'.

    Raises:
        UnknownNameError: if an identifier is not that of a claim about a run.
        PluginError: if a claim of the scenario cannot be made.
    """
    chosen, trace = _applicable(trace, claims), replace(trace)  # no cached tables: they may have changed
    findings = []
    for claim in chosen:
        with progress.item(f"{claim.id} {trace.meta.get('run')}"):
            findings.append(claim.judge(trace))
    return _verdicts(trace, chosen, findings)


def _applicable(trace: Trace, claims: Collection[str] | None = None) -> list[TraceClaim]:
    added = trace.meta.get("scenario", {}).get("claims")
    return [claim for claim in run_claims(claims, added) if claim.may_apply(trace)]


def _verdicts(trace: Trace, claims: Sequence[TraceClaim], findings: Sequence[Finding]) -> list[Verdict]:
    run = str(trace.meta.get("run"))
    scenario = trace.meta.get("scenario", {})
    expected, own = scenario.get("runs", {}).get(run, {}).get("expected", {}), scenario.get(OWN)
    return [
        Verdict.of(claim, run, finding, expected.get(claim.id, claim.due(own)))
        for claim, finding in zip(claims, findings, strict=True)
    ]


def judge_model(
    scenario: Scenario, *, kept: Path | None = None, claims: Collection[str] | None = None, progress: Progress = SILENT
) -> list[Verdict]:
    """Judge the claims about the model of a scenario.

    Args:
        scenario: its constants.
        kept: folder of findings that are reused if nothing that they depend on has changed (`cache_folder()`);
            None: everything anew.
        claims: identifiers of the claims to judge; default: all.
        progress: is told of each.

    Returns:
        One verdict per claim, run '', with the status that the scenario expects ('proved' or 'supported' unless
        it says otherwise); and one more for each run whose `set` gives the claim other constants.

    Raises:
        UnknownNameError: if an identifier is not that of a claim about the model.
        PluginError: if a claim of the scenario cannot be made.
    """
    cases = _cases(scenario, claims)
    pieces = [partial(cached_finding, case.claim, case.inputs, kept) for case in cases]
    findings = run_parallel(pieces, names=[case.name for case in cases], progress=progress)
    return [case.verdict(scenario, finding) for case, finding in zip(cases, findings, strict=True)]


def judge_all(
    scenario: Scenario,
    traces: Iterable[Trace],
    *,
    kept: Path | None = None,
    claims: Collection[str] | None = None,
    progress: Progress = SILENT,
) -> list[Verdict]:
    """Judge claims on runs of a scenario, and then about its model, including the runs' evidence.

    Like `judge` and `judge_model`, in parallel processes.

    Args:
        scenario: its constants.
        traces: its runs.
        kept: see `judge_model`.
        claims: identifiers of the claims to judge, about runs or the model; default: all.
        progress: is told of each claim about the model and of the claims about each run.

    Raises:
        PluginError: if a claim of the scenario cannot be made.
        AirgroundError: if a process dies.
    """
    cases = [case for case in _cases(scenario) if claims is None or case.claim.id in claims]
    about_model = [*{case.claim.id: case.claim for case in cases}.values()]
    of_runs = [
        (replace(trace), [claim for claim in _applicable(trace) if claims is None or claim.id in claims])
        for trace in traces
    ]  # as in `judge`
    pieces: list[Callable[[], Any]] = [partial(cached_finding, case.claim, case.inputs, kept) for case in cases]
    pieces += [partial(_judged, trace, about_run, about_model) for trace, about_run in of_runs]
    names = [*(case.name for case in cases), *(f"claims about run {trace.run}" for trace, _ in of_runs)]
    progress.stage("judging", len(pieces), "claims about the model or a run")
    done = run_parallel(pieces, names=names, progress=progress)
    judged = done[len(cases) :]
    verdicts = list[Verdict]()
    for (trace, about_run), (findings, _) in zip(of_runs, judged, strict=True):
        verdicts += _verdicts(trace, about_run, findings)
    apart = {(case.claim.id, case.run) for case in cases if case.run}
    for case, finding in zip(cases, done, strict=False):
        seen = [
            shown[case.claim.id]
            for (trace, _), (_, shown) in zip(of_runs, judged, strict=True)
            if case.run == (trace.run if (case.claim.id, trace.run) in apart else "")
        ]
        verdicts.append(case.verdict(scenario, case.claim.judge_runs(finding, seen)))
    return verdicts


class _Case(NamedTuple):
    """A claim about the model, its run ('': all runs), and its constants."""

    claim: ModelClaim
    run: str
    inputs: dict[str, Any]

    @property
    def name(self) -> str:
        return f"{self.claim.id} {self.run}".strip()

    def verdict(self, scenario: Scenario, finding: Finding) -> Verdict:
        expected = scenario.runs[self.run].expected if self.run else scenario.expected
        expectation = expected.get(self.claim.id, self.claim.due(scenario.ugv_controller))
        return Verdict.of(self.claim, self.run, finding, expectation, self.inputs)


def _cases(scenario: Scenario, claims: Collection[str] | None = None) -> list[_Case]:
    """The claims about the model, and again for each run whose `set` gives one of them other constants."""
    chosen = [claim for claim in model_claims(claims, scenario.claims) if claim.may_apply(scenario)]
    cases = [_Case(claim, "", claim.judge_inputs(scenario)) for claim in chosen]
    changed = {name: own(scenario, name) for name, run in scenario.runs.items() if run.set}
    return cases + [
        _Case(case.claim, name, inputs)
        for name, its_own in changed.items()
        for case in cases
        if (inputs := case.claim.judge_inputs(its_own)) != case.inputs
    ]


def _judged(
    trace: Trace, claims: Sequence[TraceClaim], about_model: Collection[ModelClaim]
) -> tuple[list[Finding], dict[str, Any]]:
    """Findings of claims about a run, and its evidence for claims about the model, by identifier."""
    seen = {claim.id: claim.judge_run(trace) for claim in about_model}
    return [claim.judge(trace) for claim in claims], seen
