"""Base classes of claims and verdicts, and checks that any trace must pass before it is judged."""

from __future__ import annotations

import abc
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from math import ceil, isfinite
from numbers import Integral, Real
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError, described
from airground_drake.base.statuses import PASSING, STATUSES, Status, meets, outcome
from airground_drake.model.bodies import motion
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.finding import Chart, Finding

__all__ = ["Claim", "Finding", "ModelClaim", "TraceClaim", "Verdict", "require_motion", "require_whole_run"]

# A row may differ by this from the position that its command leads to, m. Integrating one step in floating point errs
# by 1e-15 m.
MOTION_TOLERANCE_M = 1e-9

# Two instants that differ by less are the same, s: rounding of multiples of a period errs by 1e-14 s.
TIME_TOLERANCE_S = 1e-9

# A claim may hold with a margin that is this much below 0, in its unit: claims allow for rounding.
MARGIN_ROUNDING = 1e-6

OWN = "ugv_controller"  # key in the inputs of a claim about the package's law: the class that replaces the law


def unjudged(kind: str) -> Finding:
    """The finding of a claim about the package's law for a user's controller: `not_run`."""
    why = f"the UGVs are commanded by {kind}: predictions, and proofs about the package's law, are not about it"
    return Finding("not_run", evidence={"reason": why})


class Claim(abc.ABC):
    """The base class of claims, with their texts.

    Attributes (all of the class):
        id: stable identifier.
        subject: a few words for a report's first screen; '' for the identifier.
        summary: one plain sentence for a reader who knows no formula; '' if the statement is plain enough.
        statement: the claim in words, precisely.
        formula: the claim as a formula, in plain text; '' if it is typeset.
        latex: the claim as a formula, typeset, a row each; () if it is in plain text.
        method: how it is decided.
        equations: equation numbers of the paper that it is about.
        assumptions: of the claim.
        does_not_establish: what a reader must not conclude from it.
        expected: the status that a scenario expects by default.
        theorems: names of theorems, such as "Safety.unseen", or theories, such as "Plants", whose hypotheses it checks.
        exercised_by: the counted unit of `exercised`, in words that follow a number; '' without a count.
        margin_decides: whether its margin is a distance from refutation; otherwise it only informs.
        about_the_law: whether it is about the package's control law or its predictions; with a user's controller of the
            UGVs it is then `not_run`, as expected.
    """

    id: str
    statement: str
    method: str
    equations: str
    assumptions: tuple[str, ...]
    does_not_establish: str
    expected: Status
    theorems: tuple[str, ...] = ()
    exercised_by: str = ""
    subject: str = ""
    summary: str = ""
    formula: str = ""
    latex: tuple[str, ...] = ()
    margin_decides: bool = True
    about_the_law: bool = False

    def due(self, own_controller: object) -> str:
        """The default expected status, given the scenario's `ugv_controller`."""
        return self.expected if own_controller is None or not self.about_the_law else "not_run"

    def applies(self, about: Any) -> bool:
        """Whether the claim applies to this trace or scenario; otherwise it is left out."""
        return True

    def may_apply(self, about: Any) -> bool:
        """`applies`; after an exception True, so that judging reports the error."""
        with suppress(Exception, SystemExit):
            return self.applies(about)
        return True

    def decided(self, find: Callable[[], Finding]) -> Finding:
        """The checked result of `find`; after an exception the status `error`."""
        try:
            finding = well_formed(self, find())
            json.dumps(finding.to_json(), allow_nan=False)  # a margin that is not a number must not pass
        except (Exception, SystemExit) as error:
            return Finding("error", evidence={"error": described(error)})
        return finding


class ModelClaim(Claim):
    """A claim about the model and its constants, whatever the run: a proof, or an experiment of its own.

    `check` sees nothing but `inputs`. So equal inputs and equal code give equal findings, and the cache can keep them.

    Attributes (all of the class):
        kept: whether the cache keeps its findings, as of an experiment that takes seconds; only of this package's.
    """

    expected: Status = "proved"
    kept = False

    @abc.abstractmethod
    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The constants of a scenario that the claim is about, strict JSON; may be empty."""

    @abc.abstractmethod
    def check(self, inputs: dict[str, Any]) -> Finding:
        """Decide the claim for these constants; an open question is `inconclusive`, never a pass.

        Called through `judge`, which turns an exception into `error`.
        """

    def seen_in(self, trace: Trace) -> Any:
        """Data of a run for `with_runs`; None, or an exception: nothing."""

    def with_runs(self, finding: Finding, seen: Sequence[Any]) -> Finding:
        """The finding on the constants of some runs, with what `seen_in` returned for these runs, if not None."""
        return finding

    def judge_inputs(self, scenario: Scenario) -> dict[str, Any]:
        """`inputs`; an exception, also in `applies`, becomes inputs for which `judge` gives the status `error`."""
        try:
            self.applies(scenario)
            own = scenario.ugv_controller
            return self.inputs(scenario) | ({OWN: own.kind} if own and self.about_the_law else {})
        except (Exception, SystemExit) as error:
            return {"error": described(error)}

    def judge(self, inputs: dict[str, Any]) -> Finding:
        """`check`, with exceptions turned into the status `error`."""
        if set(inputs) == {"error"}:
            return Finding("error", evidence=inputs)
        if OWN in inputs:
            return unjudged(inputs[OWN])
        return self.decided(lambda: self.check(inputs))

    def judge_run(self, trace: Trace) -> Any:
        """`seen_in`; None after an exception, because claims about the run report faulty records."""
        with suppress(Exception, SystemExit):
            return self.seen_in(trace)

    def judge_runs(self, finding: Finding, seen: Sequence[Any]) -> Finding:
        """`with_runs`, from what `judge_run` returned, with exceptions turned into the status `error`."""
        return self.decided(lambda: self.with_runs(finding, [result for result in seen if result is not None]))


class TraceClaim(Claim):
    """A claim about one run, decided from its trace alone."""

    expected: Status = "holds"

    @abc.abstractmethod
    def check(self, trace: Trace) -> Finding:
        """Decide the claim on this trace; missing data is `error` or `not_run`, never a pass.

        Called through `judge`, which turns an exception into `error`.
        """

    def judge(self, trace: Trace) -> Finding:
        """`check`; a malformed trace, an exception (also of `applies`) or a pass on half a run is `error`."""

        def find() -> Finding:
            require_motion(trace)
            self.applies(trace)
            if self.about_the_law and (own := trace.scenario.ugv_controller):
                return unjudged(own.kind)
            finding = self.check(trace)
            if finding.status in PASSING:
                require_whole_run(trace)
            return finding

        return self.decided(find)


@dataclass(frozen=True, repr=False, kw_only=True)
class Verdict(Finding):
    """The finding of a claim on a run or about the model.

    Attributes:
        claim: the claim.
        run: on which run; '' for a claim about the model.
        expected: the status that the scenario expects, `exercised`, or `nothing`.
        inputs: the constants that a claim about the model is about.
    """

    claim: Claim
    run: str
    expected: str
    inputs: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls, claim: Claim, run: str, finding: Finding, expected: str, inputs: dict[str, Any] | None = None
    ) -> Verdict:
        """The verdict of a finding, with the expected status."""
        values = {column.name: getattr(finding, column.name) for column in fields(Finding)}
        return cls(**values, claim=claim, run=run, expected=expected, inputs=inputs or {})

    def __repr__(self) -> str:
        about = f"run {self.run!r}" if self.run else "the model"
        return f"<Verdict: {self.claim.id} on {about}: {outcome(self.status, self.exercised)}>"

    @property
    def as_expected(self) -> bool | None:
        """Whether the status is the expected one, and the claim was exercised where that is expected.

        None if nothing is expected.
        """
        return meets(self.expected, self.status, self.exercised)

    def to_json(self) -> dict[str, Any]:
        """The entry of `claims` in report.json."""
        words = (
            "id", "subject", "summary", "statement", "formula", "method", "equations", "does_not_establish",
            "exercised_by",
        )  # fmt: skip
        return {
            **{name: getattr(self.claim, name) for name in words},
            "assumptions": list(self.claim.assumptions),
            "latex": list(self.claim.latex),
            "run": self.run,
            "expected": self.expected,
            "as_expected": self.as_expected,
            "inputs": self.inputs,
            **super().to_json(),
        }


def well_formed(claim: Claim, finding: Finding) -> Finding:
    """The finding, checked for consistency, with its count as an `int`."""
    if finding.status not in STATUSES:
        raise ValueError(f"{claim.id} found {finding.status!r}; allowed: {', '.join(STATUSES)}")
    margin: Any = finding.margin  # of third-party code, whatever its type
    count: Any = finding.exercised
    if margin is not None and (isinstance(margin, bool) or not isinstance(margin, Real) or not isfinite(margin)):
        raise ValueError(f"{claim.id} found the margin {margin!r}; allowed: a finite number, or None")
    if margin is not None and finding.status in ("holds", "proved") and margin < -MARGIN_ROUNDING:
        raise ValueError(
            f"{claim.id} found {finding.status!r} with the margin {margin!r}; allowed: one from 0, or None"
        )
    if not (finding.figure is None or isinstance(finding.figure, Chart)):
        raise ValueError(f"{claim.id} found the figure {type(finding.figure).__name__}; allowed: a Chart, or None")
    if count is None and claim.exercised_by and finding.status in PASSING:
        raise ValueError(f"{claim.id} passes without a count of {claim.exercised_by}")
    if count is None:
        return finding
    if isinstance(count, bool) or not isinstance(count, Integral) or count < 0:
        raise ValueError(f"{claim.id} was exercised {count!r} times; allowed: a whole number from 0, or None")
    return replace(finding, exercised=int(count))


def require_motion(trace: Trace) -> None:
    """Check that positions follow from the previous ones and the commands, by the robot's plant."""
    scenario, t = trace.scenario, trace.t
    if trace.run not in scenario.runs or scenario.runs[trace.run].method != trace.meta["method"]:
        raise TraceError(f"the scenario declares no run {trace.run!r} of method {trace.meta['method']!r}")
    if trace.ugvs != list(scenario.ugvs) or trace.robots != list(scenario.robots):
        raise TraceError(f"the trace is of the robots {trace.robots}, which are not those of its scenario")
    if len(t) < 2 or (np.diff(t) < 0.0).any():
        raise TraceError("the trace has fewer than two rows, or its time runs backwards")
    for robot in trace.robots:
        if trace.plant(robot).measured:
            require_measured(trace, robot)
            continue
        position = trace.position(robot)
        off = np.abs(position[1:] - position[:-1] - np.diff(t)[:, None] * trace.command(robot)[1:]).max(axis=1)
        k = int(np.argmax(off))
        if off[k] > MOTION_TOLERANCE_M:
            raise TraceError(f"{robot} at t = {t[k + 1]} s is {off[k]:.3g} m from where its command leads to")
        require_body(trace, robot)


def require_measured(trace: Trace, robot: str) -> None:
    """Check the recorded drift and cover of a user's plant against the recorded positions, and its start."""
    t = trace.t
    samples = trace.sample_rows
    place = trace.position(robot)
    body = trace.body(robot)
    for name, row, end in zip(range(len(samples)), samples, [*samples[1:], len(t) - 1], strict=True):
        lasting, way = t[end] - t[row], place[end] - place[row]
        drift = np.linalg.norm(way / lasting - trace.chosen(robot)[name])
        share = (t[row : end + 1] - t[row]) / lasting
        cover = np.linalg.norm(body[row : end + 1] - place[row] - share[:, None] * way, axis=1).max()
        for key, due, within in (
            ("drift_m_s", drift, MOTION_TOLERANCE_M / lasting),
            ("cover_m", cover, MOTION_TOLERANCE_M),
        ):
            recorded = trace.sampled(f"{robot}.{key}")[name]
            if abs(recorded - due) > within:
                what = f"its positions have {due:.9g} in the period from t = {t[row]} s"
                raise TraceError(f"{key} of {robot} is recorded as {recorded:.9g}, but {what}")
    _begins(trace, robot)


def require_body(trace: Trace, robot: str) -> None:
    """Check that the recorded body of a robot follows from the steered point and the commands, by the robot's plant."""
    plant, t = trace.plant(robot), trace.t
    if not plant.signals:
        return
    off = np.abs(trace.signals(robot) - followed(trace, robot))
    row, column = np.unravel_index(int(np.argmax(off)), off.shape)
    if not off[row, column] <= MOTION_TOLERANCE_M:
        what = f"{plant.signals[column]} of {robot} at t = {t[row]} s is {off[row, column]:.3g}"
        raise TraceError(f"{what} from where its plant has it")
    _begins(trace, robot)


def followed(trace: Trace, robot: str) -> Array:
    """The signals of a body that follows the recorded commands from rest, (T, k)."""
    samples, period = {*trace.sample_rows.tolist()}, trace.scenario.control.period_s
    return motion.followed(trace.plant(robot), trace.t, trace.position(robot), trace.command(robot), samples, period)


def _begins(trace: Trace, robot: str) -> None:
    """Raise a TraceError if a body does not begin at the scenario's start."""
    begins, start = trace.body(robot)[0], trace.scenario.robots[robot].start_m
    if np.abs(begins - start).max() > MOTION_TOLERANCE_M:
        raise TraceError(f"the body of {robot} begins at {begins.tolist()} m, not at {start}")


def require_whole_run(trace: Trace) -> None:
    """Check that the rows cover the run, t = 0 to its duration, with no control period left out."""
    t = trace.t
    duration = trace.scenario.duration_s
    period = trace.scenario.control.period_s
    if abs(t[0]) > TIME_TOLERANCE_S or abs(t[-1] - duration) > TIME_TOLERANCE_S:
        raise TraceError(f"the trace covers {t[0]} to {t[-1]} s of a run from 0 to {duration} s")
    gap = np.diff(t)
    if gap.max() > period + TIME_TOLERANCE_S:
        raise TraceError(f"the trace has no row in the {gap.max()} s before t = {t[1:][np.argmax(gap)]} s")
    sampled = trace.t[trace.sample_rows]
    instants = period * np.arange(ceil((t[-1] - TIME_TOLERANCE_S) / period))
    if len(sampled) != len(instants) or (np.abs(sampled - instants) > TIME_TOLERANCE_S).any():
        raise TraceError(f"the trace has {len(sampled)} control samples, not one every {period} s: {len(instants)}")
