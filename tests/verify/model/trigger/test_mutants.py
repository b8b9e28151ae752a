"""Broken triggers are refuted."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from verify.judging import Judged
from verify.model.trigger.cases import KINDS, ZENO, simulate, trigger_times

from airground_drake.decision.trigger import Trigger
from airground_drake.systems.decision import EventTrigger
from airground_drake.verify.engines.prover import discharge
from airground_drake.verify.model.trigger import induction, mutants, relation

PROOFS = {mutant.says: mutant for mutant in mutants.MUTANTS if mutant.claim == "ZENO-PROOF"}
EXPERIMENTS = {mutant.says: mutant for mutant in mutants.MUTANTS if mutant.claim == "ZENO-REFINE"}


@pytest.mark.parametrize("name", PROOFS)
def test_mutants_are_refuted_by_a_run(name: str) -> None:
    """The run breaks the mutant and not the trigger itself; where the simulator can show it, it does."""
    finding = PROOFS[name].check(ZENO)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    run = finding.counterexample["run"]
    t, x = [row["t_s"] for row in run], [row["x_m"] for row in run]
    mutant = KINDS[name](3.0, 2.0, 0.3) if name in KINDS else Trigger.bare(3.0)
    for trigger, broken in ((mutant, True), (Trigger(3.0, 2.0, 0.3), False)):
        times = [row["t_s"] for row in relation.replay(trigger, list(zip(t, x, strict=True))) if row["trigger"]]
        assert (min((b - a for a, b in pairwise(times)), default=math.inf) < 0.3) == broken
    if name in ("no dwell", "no refractory mode", "no hysteresis, no dwell"):
        source = TrajectorySource(PiecewisePolynomial.FirstOrderHold([*t, t[-1] + 1.0], [[*x, x[-1]]]))
        status = simulate(EventTrigger(1, mutant), source, t[-1] + 0.5, 1.0 / 256.0)
        before, after = trigger_times(status, 0)[-2:]
        assert after - before < 0.3


@pytest.mark.parametrize("name", KINDS)
def test_mutants_have_no_symbolic_proof_either(name: str) -> None:
    broken = relation.read_off(lambda path: KINDS[name](*map(path.symbol, ("zeta", "release", "dwell"))))
    failing = [each for each in induction.obligations(broken) if not each.certified()]
    assert failing
    assert "refuted" in {proof.status for proof in discharge(failing)}


def test_experiments_that_must_fail(judged: Judged) -> None:
    found = {name: judged(mutant) for name, mutant in EXPERIMENTS.items()}
    assert {finding.status for finding in found.values()} == {"refuted"}
    whats: list[Any] = [finding.counterexample["what"] for finding in found.values() if finding.counterexample]
    assert ["automaton" in whats[0], "bare" in whats[1]] == [True, True]
