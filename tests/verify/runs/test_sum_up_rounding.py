"""The part of GATE-FEAS about sum-up rounding."""

from __future__ import annotations

import pytest
from builders.edits import DecisionEdit, with_decision
from verify.judging import FEAS, assert_decision_refuted
from verify.runs.cases import fractional_rounding, relaxed_outside, round_otherwise, understate_rounding

from airground_drake.run.trace import Trace

MUTANTS: list[tuple[DecisionEdit, str]] = [
    (round_otherwise, "rounded against the rule"),
    (fractional_rounding, "rounded omega is not binary"),
    (relaxed_outside, "outside [0, 1]"),
    (understate_rounding, "recorded rounding error"),
]


@pytest.mark.parametrize(("edit", "what"), MUTANTS, ids=[f"{what}-{i}" for i, (_, what) in enumerate(MUTANTS)])
def test_a_mutant_is_refuted(relaxed: Trace, edit: DecisionEdit, what: str) -> None:
    assert_decision_refuted(FEAS, with_decision(relaxed, edit), what)
