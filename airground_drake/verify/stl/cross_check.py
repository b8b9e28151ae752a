"""Trace claims as Signal Temporal Logic, evaluated by rtamt: a cross-check of our own checkers.

Signals come from `signals.py`. A formula is satisfied if its robustness is >= -tolerance; of true-or-false signals
(+-1) only its sign means anything. `discrete` formulas have no time bounds, `dense` ones have.
`relation` says how a claim and its formulas are tied: `equivalent` (the claim holds if and only if all of these are
satisfied) or `implied` (the formula follows from the claim, which says more).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import version
from typing import Any, Literal

import numpy as np

from airground_drake.trace import Trace
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M
from airground_drake.verify.runs.safe_hyp import VELOCITY_TOLERANCE_M_S
from airground_drake.verify.stl import signals as stl_signals
from airground_drake.verify.stl.signals import NEVER, Samples, Signals

AGREEMENT = 1e-10
"""Two computations of one margin may differ by this, in its unit: some thousand roundings of 1e-14."""


@dataclass(frozen=True)
class StlFormula:
    """A claim, or a part of one, in Signal Temporal Logic.

    Attributes:
        claim: identifier of the trace claim.
        part: what part of it.
        text: the formula in rtamt's syntax, constants in braces.
        signals: how each signal is computed from the trace.
        unit: unit of the robustness; '' if only its sign means anything.
        evaluate_on: the signals of a trace; the least robustness of several sets counts; None if the formula says
            nothing about this run.
        semantics: of rtamt.
        tolerance: in `unit`.
        relation: see the module's docstring.
        compares: what in our finding is the same number: 'margin', or hypotheses of SAFE-HYP; () if nothing is.
    """

    claim: str
    part: str
    text: str
    signals: dict[str, str]
    unit: str
    evaluate_on: Callable[[Trace], Signals | None]
    semantics: Literal["discrete", "dense"] = "discrete"
    tolerance: float = 0.0
    relation: Literal["equivalent", "implied"] = "equivalent"
    compares: tuple[str, ...] = ()


FORMULAS = (
    StlFormula(
        "SAFE-TRACE", "distances", "always (margin_m >= 0)",
        {
            "margin_m": "least of distance - safe distance over all pairs, but for those that keep far apart, at rows "
            "and closest approaches between them"
        },
        "m", stl_signals.clearance, tolerance=DISTANCE_TOLERANCE_M, compares=("margin",),
    ),
    StlFormula(
        "SAFE-HYP", "velocities", "always ((spare_m_s >= 0) and (climb_m_s <= 0) and (drift_m_s <= 0))",
        {
            "spare_m_s": "least of maximum speed - speed over all robots, on each interval between rows",
            "climb_m_s": "largest vertical speed of a UGV",
            "drift_m_s": "largest departure of a velocity from the one chosen at the control sample",
        },
        "m/s", stl_signals.motion, tolerance=VELOCITY_TOLERANCE_M_S, relation="implied",
    ),
    StlFormula(
        "ZENO-TRACE", "dwell", "always ((twice < 0) and ((trigger > 0) -> always[{past!r},{dwell!r}] (trigger < 0)))",
        {
            "trigger": "true for 1e-9 s from each trigger of a UGV, one set of signals per UGV; the pulse and as much "
            "again are skipped, and 2e-9 s at the end of the dwell are left out for the tolerance and the length of "
            "the pulse",
            "twice": "true for 1e-9 s from a trigger less than 3e-9 s after the one before",
        },
        "", stl_signals.triggers, "dense",
    ),
    StlFormula(
        "THR-TRIG", "levels at the rows",
        "always (((after < 0.5) -> (x_m <= {most!r}))"
        " and ((before < 0.5 and after > 0.5) -> (x_m <= {most!r}))"
        " and (((before < 0.5 or before > 1.5) and (after > 0.5 and after < 1.5)) -> (x_m >= {least!r}))"
        " and ((after > 0.5 and after < 1.5) -> (x_m >= {low!r}))"
        " and (((before > 0.5 and before < 1.5) and (after < 0.5 or after > 1.5)) -> (x_m <= {high!r}))"
        " and ((after > 1.5) -> (since_s <= {over!r}))"
        " and ((before > 0.5 and after < 0.5) -> (since_s >= {dwell!r})))",
        {
            "x_m": "||recorded reference - position|| + recorded noise at a row; one set of signals per UGV; of rows "
            "with the same modes those of least and largest x and time",
            "before": "mode up to the row: 0 supervising, 1 intervening, 2 refractory (and before the first row)",
            "after": "mode from the row on",
            "since_s": "time since the last trigger; levels are widened by what x moves in 1e-5 s",
        },
        "m or s", stl_signals.levels, relation="implied",
    ),
    StlFormula(
        "COMM", "only when intervening", "always ((message > 0) -> once[0,{allowance!r}] (intervening > 0))",
        {
            "message": "true for 1e-9 s from each proposal and decision of a UGV; one set of signals per UGV",
            "intervening": "true from each trigger event to the next release event, 1e-9 s wider on both sides",
        },
        "", stl_signals.messages, "dense", relation="implied",
    ),
    StlFormula(
        "COMM", "not more than always-on",
        "always ((proposals <= {most_proposals!r}) and (decisions <= {most_decisions!r}))",
        {"proposals": "number of proposal events so far", "decisions": "number of decisions so far"}, "messages",
        stl_signals.counts, relation="implied",
    ),
    StlFormula(
        "LIVE-GOAL", "ends", "(eventually always (goal_m >= 0)) and (always (rest_m >= 0))",
        {
            "goal_m": "least margin at each row: of a robot to its target, or of a declared stall to its place",
            "rest_m": "1e-3 m - distance from the final place during the last second, of UGVs that stall; else 1e6",
        },
        "m", stl_signals.goal, compares=("margin",),
    ),
)  # fmt: skip
"""The trace claims that can be written in Signal Temporal Logic; GATE-TIME (order statistics of CPU times) cannot."""


def cross_check(trace: Trace, formulas: Sequence[StlFormula] = FORMULAS) -> list[dict[str, Any]]:
    """Evaluate formulas with rtamt on one run; rtamt is imported here and nowhere else.

    Args:
        trace: one run.
        formulas: those that say nothing about the run are left out.

    Returns:
        One entry per formula, strict JSON: `run`, `claim`, `part`, `formula` (constants filled in), `signals`,
        `semantics`, `relation`, `compares`, `unit`, `tolerance`, `robustness` (None if there is none, or if it is
        vacuous) and `verdict`: 'satisfied', 'violated', 'error' (with `reason`), or 'not_run' if rtamt is missing.
    """
    try:
        rtamt, reason = importlib.import_module("rtamt"), ""
    except ImportError as error:  # also one from inside rtamt, whose parser does not import on every Python
        rtamt, reason = None, f"rtamt cannot be imported: {error}"
    checks = []
    for formula in formulas:
        described = ("claim", "part", "signals", "semantics", "relation", "unit", "tolerance")
        check = {"run": trace.run, "formula": formula.text, **{name: getattr(formula, name) for name in described}}
        check |= {"compares": list(formula.compares), "robustness": None, "verdict": "not_run"}
        if rtamt is None:
            checks.append(check | {"reason": reason})
            continue
        try:
            signals = formula.evaluate_on(trace)
            if signals is None:
                continue
            text = formula.text.format(**signals.constants)
            robustness = _robustness(rtamt, text, formula.semantics, signals.sets)
        except Exception as error:  # whatever went wrong, the formula was not decided
            checks.append(check | {"verdict": "error", "reason": f"{type(error).__name__}: {error}"})
            continue
        check |= {"formula": text, "verdict": "satisfied" if robustness >= -formula.tolerance else "violated"}
        checks.append(check | {"robustness": robustness if abs(robustness) < NEVER / 2 else None})
    engine = f"rtamt {version('rtamt')}" if rtamt else "rtamt"
    return [check | {"engine": engine} for check in checks]


def _robustness(rtamt: Any, text: str, semantics: str, sets: Sequence[dict[str, Samples]]) -> float:
    """Least robustness at the first sample over some sets of signals.

    Raises:
        ValueError: if it is not a number, or there are no signals, or some have values that are not finite.
    """
    if not sets or not all(np.isfinite(part).all() for one in sets for samples in one.values() for part in samples):
        raise ValueError("there are no signals, or some have values that are not finite")
    specification = _specification(rtamt, text, semantics, tuple(sets[0]))
    evaluate = _dense if semantics == "dense" else _discrete
    found = [evaluate(specification, signals) for signals in sets]
    if np.isnan(found).any():
        raise ValueError(f"robustness {found}")
    return min(found)


@lru_cache(maxsize=64)
def _specification(rtamt: Any, text: str, semantics: str, signals: tuple[str, ...]) -> Any:
    """A formula as rtamt has parsed it."""
    dense = semantics == "dense"
    specification = rtamt.StlDenseTimeOfflineSpecification() if dense else rtamt.StlDiscreteTimeOfflineSpecification()
    for name in signals:
        specification.declare_var(name, "float")
    specification.spec = text
    specification.parse()
    return specification


def _dense(specification: Any, signals: dict[str, Samples]) -> float:
    """Robustness at the first sample; rtamt takes [time, value] pairs, signal by signal."""
    pairs = [[name, np.column_stack(samples).tolist()] for name, samples in signals.items()]
    return float(specification.evaluate(*pairs)[0][1])


def _discrete(specification: Any, signals: dict[str, Samples]) -> float:
    """Robustness at the first sample; rtamt takes one sequence of times and the values of all signals at them."""
    time = next(iter(signals.values()))[0]
    values = {name: value for name, (_, value) in signals.items()}
    if len(time) == 1:  # rtamt needs two samples; 'always' says the same of one that is repeated
        time = np.append(time, time + 1.0)
        values = {name: np.append(value, value) for name, value in values.items()}
    data = {"time": time.tolist(), **{name: value.tolist() for name, value in values.items()}}
    return float(specification.evaluate(data)[0][1])


def merge(verdicts: Iterable[Verdict], checks: Sequence[dict[str, Any]]) -> list[Verdict]:
    """Attach cross-checks to the findings that they are about.

    Args:
        verdicts: of one or several runs, or about the model.
        checks: of `cross_check`, of the same runs.

    Returns:
        The verdicts in their order. Those with checks have `evidence["stl"]` = {"agrees": bool, or None if nothing
        was compared, "checks": [...]}, each check with `ours`, our number for its robustness. Where the two sides
        disagree by more than `AGREEMENT`, or a formula could not be decided although ours holds, the status is
        `error`, and `evidence` has also `error` and our former finding as `ours`.
    """
    return [
        replace(verdict, finding=_merged(verdict.finding, mine))
        if (mine := [c for c in checks if (c["claim"], c["run"]) == (verdict.claim.id, verdict.run)])
        else verdict
        for verdict in verdicts
    ]


def _merged(finding: Finding, checks: Sequence[dict[str, Any]]) -> Finding:
    compared = finding.status in ("holds", "refuted")
    decided = compared and all(check["verdict"] in ("satisfied", "violated") for check in checks)
    entries = [{**check, "ours": _ours(finding, check["compares"])} for check in checks]
    conflicts = _conflicts(finding, entries) if compared else []
    agrees = False if conflicts else True if decided else None
    evidence = {**finding.evidence, "stl": {"agrees": agrees, "checks": entries}}
    if not conflicts:
        return replace(finding, evidence=evidence)
    ours = {name: getattr(finding, name) for name in ("status", "margin", "unit", "where", "counterexample")}
    return Finding("error", evidence=evidence | {"error": "; ".join(conflicts), "ours": ours})


def _conflicts(finding: Finding, entries: Sequence[dict[str, Any]]) -> list[str]:
    """In which ways the formulas disagree with a finding that holds or is refuted."""
    holds, found = finding.status == "holds", []
    for c in entries:
        said = f"{c['part']}: rtamt finds {c['formula']!r} {c['verdict']}, robustness {c['robustness']} {c['unit']}"
        if c["verdict"] == "error" and holds:
            found.append(f"{c['part']}: {c['reason']}")
        if c["verdict"] == "violated" and holds and not _marginal(c):
            found.append(f"{said}; our checker says it holds, margin {finding.margin} {finding.unit}")
        elif None not in (c["ours"], c["robustness"]) and abs(c["ours"] - c["robustness"]) > AGREEMENT:
            found.append(f"{said}; our number is {c['ours']}")
    deciding = [c for c in entries if c["relation"] == "equivalent"]
    if not holds and deciding and all(c["verdict"] == "satisfied" and not _marginal(c) for c in deciding):
        found.append(f"rtamt finds every formula satisfied; our checker says refuted, margin {finding.margin}")
    return found


def _marginal(check: dict[str, Any]) -> bool:
    """Whether the verdict may follow the rounding of a number; that number is then compared with ours."""
    compared = check["compares"] and check["robustness"] is not None
    return bool(compared and abs(check["robustness"] + check["tolerance"]) <= AGREEMENT)


def _ours(finding: Finding, compares: Sequence[str]) -> float | None:
    if list(compares) == ["margin"]:
        return finding.margin
    margins = [w["margin"] for w in finding.evidence.get("worst", ()) if w["hypothesis"] in compares]
    return min(margins, default=None)
