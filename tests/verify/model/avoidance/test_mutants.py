"""Broken variants of avoidance, and broken constants, are refuted."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import pytest
from verify.judging import Judged
from verify.model.avoidance.cases import MUTANTS

from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.avoidance.safe_inv import SafeInv


@pytest.mark.parametrize("name", MUTANTS)
def test_mutant_is_refuted(name: str, judged: Judged) -> None:
    finding = judged(MUTANTS[name])
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample.get("exactly_checked", True)
    json.dumps(asdict(finding), allow_nan=False)


@pytest.mark.parametrize(
    "name",
    [
        *(n for n in MUTANTS if n.startswith("SAFE-INV") and "gain" not in n and "built" not in n),
        "SAFE-GATE: intervention on top",
    ],
)
def test_mutant_comes_too_close_on_the_running_code(name: str, judged: Judged) -> None:
    counterexample = judged(MUTANTS[name]).counterexample
    assert counterexample is not None
    replay = counterexample["replay"]
    least = replay.get("least_distances_m", [replay.get("least_distance_m")])
    assert min(least) < replay["safe_distance_m"] - 0.05


def test_overshoot_on_the_running_code(judged: Judged) -> None:
    counterexample = judged(MUTANTS["SAFE-INV: gain too large, A h = 1.8"]).counterexample
    assert counterexample is not None
    assert counterexample["replay"]["end_m"][0][0] > counterexample["replay"]["safe_distance_m"] + 0.1


@pytest.mark.parametrize("name", [n for n in MUTANTS if n.startswith("SAFE-DIST")])
def test_disturbed_mutant_breaks_the_bound_on_the_running_code(name: str, judged: Judged) -> None:
    counterexample = judged(MUTANTS[name]).counterexample
    assert counterexample is not None
    replay = counterexample["replay"]
    assert replay["worst_margin_m"] < -0.01
    assert replay["broken"] > 0


@pytest.mark.parametrize(
    ("claim", "change"),
    [
        (SafeInv(), lambda i: i | {"sensing_range_m": 2.1}),
        (SafeInv(), lambda i: i | {"avoidance_gain_1_s": 30.0}),
        (SafeDist(), lambda i: i | {"avoidance_gain_1_s": 30.0}),
        (SafeDist(), lambda i: i | {"disturbance_m_s": 4.0}),
        (SafeGate(), lambda i: i | {"method_d": {"intervention_on_top": False, "compositions": ["recursion_listed"]}}),
    ],
    ids=["range", "gain", "gain_disturbed", "disturbance", "recursion"],
)
def test_broken_constants_are_refuted(
    claim: ModelClaim, change: Callable[[dict[str, Any]], dict[str, Any]], inputs: dict[str, Any]
) -> None:
    finding = claim.judge(change(inputs))
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
