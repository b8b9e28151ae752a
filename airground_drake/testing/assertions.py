"""Claims as assertions: what fails says, in words, what was claimed, what was found, and what was needed."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

from airground_drake.base.statuses import PASSING
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import Overrides
from airground_drake.scenarios.schema import Scenario
from airground_drake.testing.scenario import chosen
from airground_drake.testing.words import told
from airground_drake.verify.claim import TraceClaim, Verdict
from airground_drake.verify.judge import verify, verify_model


class ClaimError(AssertionError):
    """Claims that did not come out as asserted.

    Attributes:
        verdicts: of the claims; `finding.status` says whether they were refuted, could not be decided
            (`inconclusive`), or something kept them from being decided (`error`, `not_run`).
    """

    def __init__(self, message: str, verdicts: Sequence[Verdict] = ()) -> None:
        """What is said, and about what."""
        super().__init__(message)
        self.verdicts = tuple(verdicts)


class NotExercisedWarning(UserWarning):
    """A claim that holds because nothing put it to the test."""


def assert_holds(trace: Trace, *claims: str | TraceClaim, exercised: bool = False) -> None:
    """Assert that claims about a run hold, without regard to what its scenario expects.

    Args:
        trace: the run.
        claims: identifiers (of the package's claims, or of those that the scenario adds), or claims as objects, which
            need no name in the scenario; none: every claim that says anything about the run.
        exercised: whether each must have been put to the test, too. If not, one that holds because there was nothing
            to check is a `NotExercisedWarning`.

    Raises:
        ClaimError: if one does not hold, was not exercised although that is asked for, or says nothing about a run of
            this method.
        UnknownNameError: if there is no such claim.
        PluginError: if a claim of the scenario cannot be made.
    """
    __tracebackhide__ = True
    named = [claim for claim in claims if isinstance(claim, str)]
    objects = [claim for claim in claims if not isinstance(claim, str)]
    verdicts = verify(trace, named or None) if named or not claims else []
    verdicts += [Verdict(claim, trace.run, claim.judge(trace), claim.expected) for claim in objects]
    place = f"run {trace.run} of {trace.scenario.name} (method {trace.meta['method']}, seed {trace.meta['seed']})"
    if silent := sorted(set(named) - {verdict.claim.id for verdict in verdicts}):
        raise ClaimError(f"{', '.join(silent)}: nothing is claimed about {place}")
    _require(verdicts, f"on {place}", exercised=exercised)


def assert_proved(
    scenario: str | Path | Scenario,
    *claims: str,
    set: Overrides = (),
    kept: Path | None = None,
) -> None:
    """Assert that claims about the model are proved for a scenario's constants, or supported if they are statistical.

    Args:
        scenario: name of a shipped one, path, or made in Python.
        claims: identifiers; none: every claim about the model, which takes a while.
        set: overrides, values by dotted key.
        kept: folder of findings that are reused (`airground_drake.verify.cache_folder()`); None: proved anew.

    Raises:
        ClaimError: if one is not.
        ScenarioError: if the scenario or an override is not valid.
        UnknownNameError: if there is no such claim.
        PluginError: if a claim of the scenario cannot be made.
    """
    __tracebackhide__ = True
    wanted = chosen(scenario, set)
    _require(verify_model(wanted, kept=kept, claims=claims or None), f"for {wanted.name}", exercised=False)


def _require(verdicts: Iterable[Verdict], place: str, *, exercised: bool) -> None:
    """Raise for failing verdicts; warn about claims that nothing tested."""
    __tracebackhide__ = True
    failed = []
    for verdict in verdicts:
        passed = verdict.finding.status in PASSING
        if not passed or (exercised and not verdict.finding.exercised):
            failed.append(verdict)
        elif verdict.finding.exercised == 0:
            warnings.warn(NotExercisedWarning(told(verdict, place).partition("\n")[0]), stacklevel=3)
    if failed:
        raise ClaimError("\n".join(told(verdict, place) for verdict in failed), failed)
