"""Claims as assertions: a failure states the claim, the result, and the requirement."""

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

from airground_drake.base.files import strict
from airground_drake.base.statuses import PASSING
from airground_drake.report.attention import in_words, place_of
from airground_drake.report.model import Claim
from airground_drake.report.sentences import as_text as value_of
from airground_drake.scenario.load import Overrides, load, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim, Verdict
from airground_drake.verify.finding import Finding
from airground_drake.verify.judging import judge, judge_model

_FOUND = {
    "refuted": "is refuted",
    "inconclusive": "is inconclusive: neither established nor refuted",
    "error": "could not be decided",
    "not_run": "was not decided",
}


class ClaimError(AssertionError):
    """Claims that did not come out as asserted.

    Attributes:
        verdicts: of the claims; their `finding.status` is `refuted`, `inconclusive`, `error` or `not_run`.
    """

    def __init__(self, message: str, verdicts: Sequence[Verdict] = ()) -> None:
        super().__init__(message)
        self.verdicts = tuple(verdicts)


class NotExercisedWarning(UserWarning):
    """A claim holds because nothing tested it."""


def assert_holds(trace: Trace, *claims: str | TraceClaim, exercised: bool = False) -> None:
    """Assert that claims about a run hold, whatever its scenario expects.

    Args:
        trace: the run.
        claims: identifiers of the package's or the scenario's claims, or claims as objects; default: every claim about
            runs of this method.
        exercised: whether something must have tested each claim. If False, a claim that nothing tested is a
            `NotExercisedWarning`.

    Raises:
        ClaimError: if a claim does not hold, was not exercised although it must be, or says nothing about runs of this
            method.
        UnknownNameError: if there is no such claim.
        PluginError: if a claim of the scenario cannot be made.
    """
    __tracebackhide__ = True
    named = [claim for claim in claims if isinstance(claim, str)]
    objects = [claim for claim in claims if not isinstance(claim, str)]
    verdicts = judge(trace, named or None) if named or not claims else []
    verdicts += [Verdict.of(claim, trace.run, claim.judge(trace), claim.expected) for claim in objects]
    place = f"run {trace.run} of {trace.scenario.name} (method {trace.meta['method']}, seed {trace.meta['seed']})"
    if silent := sorted(set(named) - {verdict.claim.id for verdict in verdicts}):
        raise ClaimError(f"{', '.join(silent)}: nothing is claimed about {place}")
    _require(verdicts, f"on {place}", exercised=exercised)


def assert_proved(scenario: str | Path | Scenario, *claims: str, set: Overrides = (), kept: Path | None = None) -> None:
    """Assert that claims about the model are proved for a scenario's constants, or supported if they are statistical.

    Args:
        scenario: name of a shipped scenario, path, or object.
        claims: identifiers; default: every claim about the model, which takes a while.
        set: overrides, values by dotted key.
        kept: folder of findings to be reused (`airground_drake.verify.cache_folder()`); None: prove anew.

    Raises:
        ClaimError: if a claim is neither.
        ScenarioError: if the scenario or an override is not valid.
        UnknownNameError: if there is no such claim.
        PluginError: if a claim of the scenario cannot be made.
    """
    __tracebackhide__ = True
    wanted = chosen(scenario, set)
    _require(judge_model(wanted, kept=kept, claims=claims or None), f"for {wanted.name}", exercised=False)


def chosen(scenario: str | Path | Scenario, overrides: Overrides) -> Scenario:
    return validated(scenario, overrides) if isinstance(scenario, Scenario) else load(scenario, overrides)


def _require(verdicts: Iterable[Verdict], place: str, *, exercised: bool) -> None:
    """Raise for failing verdicts; warn about claims that nothing tested."""
    __tracebackhide__ = True
    failed = []
    for verdict in verdicts:
        passed = verdict.status in PASSING
        if not passed or (exercised and not verdict.exercised):
            failed.append(verdict)
        elif verdict.exercised == 0:
            warnings.warn(NotExercisedWarning(message_of(verdict, place).partition("\n")[0]), stacklevel=3)
    if failed:
        raise ClaimError("\n".join(message_of(verdict, place) for verdict in failed), failed)


def message_of(verdict: Verdict, place: str) -> str:
    """A verdict in several lines: claim, result, bodies, time, and evidence."""
    of = verdict.claim
    claim = Claim.model_construct(exercised_by=of.exercised_by, **strict(Finding.to_json(verdict)))
    lines = [f"{of.id} {_found(verdict)}, {place}", f"  claim: {of.statement}", f"  found: {in_words(claim)}"]
    if claim.margin is not None and claim.status not in PASSING:
        margin = value_of(claim.margin, claim.unit)
        lines.append(f"  value: {claim.quantity or 'margin'}: {margin}; at least 0 is needed")
    if seen := place_of(claim):
        lines.append(f"  seen: {value_of(seen, digits=6)}")
    return "\n".join(lines)


def _found(verdict: Verdict) -> str:
    if verdict.status not in PASSING:
        return _FOUND[verdict.status]
    if verdict.exercised is None:
        return f"{verdict.status}, but does not count what tests it"
    what = verdict.claim.exercised_by or "things"
    return f"{verdict.status}, but nothing tested it ({verdict.exercised} {what})"
