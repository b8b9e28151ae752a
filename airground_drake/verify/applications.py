"""What the runs of a report add to claims about the model.

They count how often they met the premises of theorems: a theorem that never applies protects nothing. For THR-CHOICE
they measure the real drift and noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airground_drake.sim.trace import Trace
from airground_drake.verify.claims import thr_choice
from airground_drake.verify.claims.safe_dist import LeastDistances, SafeDist
from airground_drake.verify.claims.safe_hyp import guarantees
from airground_drake.verify.claims.thr_quality import drift_of
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.theorem import Proof
from airground_drake.verify.runs.acceptances import Acceptance, acceptances
from airground_drake.verify.runs.passive import beside
from airground_drake.verify.runs.triggers import task_error

Count = tuple[int, int]  # how often a premise was met, and how many times it could have been


class Retreats(NamedTuple):
    """Periods in which a robot was too near to an obstacle that may move; of them, retreating at w, and at w + V."""

    passive: int = 0
    w_h_once: int = 0
    kept: int = 0


def safe_pairs(trace: Trace) -> Count:
    """Count the pairs within reach of each other, and those of them that met every inequality."""
    kept = guarantees(trace)
    return sum(one.margin_m == 0.0 for one in kept), len(kept)


def below_avoidance(trace: Trace) -> Count:
    """Count the executed interventions, and those of them under method (d)."""
    count = sum(len({*trace.sampled(f"{ugv}.executing").tolist()} - {-1.0}) for ugv in trace.ugvs)
    return (count if trace.meta["method"] == "d" else 0), count


def without_news(trace: Trace) -> Count:
    """Count the acceptances under method (d), and those during which no obstacle was new and none in range may move."""
    found = [(ugv, one) for ugv, of_ugv in acceptances(trace).items() for one in of_ugv]
    return sum(not one.news_s and not _beside_a_mover(trace, ugv, one) for ugv, one in found), len(found)


def _beside_a_mover(trace: Trace, ugv: str, one: Acceptance) -> bool:
    """Whether an obstacle that may move is within sensing range of a UGV while it executes a proposal."""
    reach = trace.scenario.control.sensing_range_m
    periods = [each for each in beside(trace) if each.pair.first == ugv]
    return any(
        bool((near := each.apart_m <= reach).any())
        and bool(((trace.t[each.row[near]] >= one.t_s) & (trace.t[each.row[near]] <= one.end_s)).any())
        for each in periods
    )


def retreats(trace: Trace) -> Retreats:
    """How fast robots retreated from obstacles that may move while they were too near; none where records are wrong."""
    try:
        return _retreats(trace)
    except (Exception, SystemExit):  # as in `judge`
        return Retreats()


def _retreats(trace: Trace) -> Retreats:
    found = [each for each in beside(trace) if each.passive.any()]
    away = [np.einsum("ka,ka->k", each.normal, each.velocity)[each.passive] for each in found]
    w = SafeDist().inputs(trace.scenario)["disturbance_m_s"]
    counted = [(len(v), int((v >= w).sum()), int((v >= w + each.pair.speed_m_s).sum()))
               for each, v in zip(found, away, strict=True)]  # fmt: skip
    return Retreats(*(sum(column) for column in zip(*counted, strict=True))) if counted else Retreats()


# How a run counts the cases of a theorem, by claim about the model.
COUNTED: dict[str, Callable[[Trace], Count]] = {
    "SAFE-INV": safe_pairs,
    "SAFE-GATE": below_avoidance,
    "LIVE-GATE": without_news,
    "LIVE-WAIT": below_avoidance,
}


def counts(trace: Trace) -> dict[str, Count]:
    """The counts of a run, by claim; a claim is left out if records are missing or wrong, which other claims report."""
    found = {}
    for claim, count in COUNTED.items():
        try:
            found[claim] = count(trace)
        except (Exception, SystemExit):  # as in `judge`
            continue
    return found


def with_counts(claim: str, finding: Finding, of_runs: Iterable[dict[str, Count]]) -> Finding:
    """The finding on a theorem, with how often the runs met its premise."""
    counted = [found[claim] for found in of_runs if claim in found]
    if not counted or not isinstance(finding.evidence, Proof):
        return finding
    met, cases = (sum(column) for column in zip(*counted, strict=True))
    return replace(finding, evidence=replace(finding.evidence, applies_to=met, of=cases))


def measured(trace: Trace) -> dict[str, thr_choice.Measured]:
    """What THR-CHOICE shows of a run, by `run UGV`; {} where records are missing or wrong, as in `counts`."""
    # A UGV whose task error did not grow to the threshold is left out.
    found, decision = {}, trace.scenario.decision
    try:
        zeta = float(trace.meta["zeta_m"])
        for ugv in trace.ugvs:
            drift = drift_of(task_error(trace, ugv), zeta)
            if drift is not None and drift > 0.0:
                of_ugv = thr_choice.measured(zeta, drift, decision.noise_m_sqrt_s, decision.threshold)
                found[f"{trace.run} {ugv}"] = of_ugv
    except (Exception, SystemExit):
        return {}
    return found


def with_runs(finding: Finding, of_runs: Iterable[dict[str, thr_choice.Measured]]) -> Finding:
    """The finding on THR-CHOICE with what was measured in the runs; other findings as they are."""
    if not isinstance(finding.evidence, thr_choice.ThresholdChoice):
        return finding
    runs = {name: row for each in of_runs for name, row in each.items()}
    return replace(finding, evidence=replace(finding.evidence, runs=runs))


def with_retreats(finding: Finding, of_runs: Iterable[Retreats]) -> Finding:
    """The finding on SAFE-DIST with the periods in which robots were too near to obstacles that may move; if any."""
    passive, once, kept = (sum(column) for column in zip(*of_runs, Retreats(), strict=True))
    if not passive or not isinstance(finding.evidence, LeastDistances):
        return finding
    evidence = replace(
        finding.evidence, passive_periods=passive, passive_periods_w_h_once=once, passive_periods_kept=kept
    )
    return replace(finding, evidence=evidence)
