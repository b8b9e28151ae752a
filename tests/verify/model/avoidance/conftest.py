"""Findings about avoidance, made once."""

from __future__ import annotations

from typing import Any

import pytest
from verify.judging import Judged
from verify.model.avoidance.cases import CLAIMS

from airground_drake.scenarios.load import load
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate


@pytest.fixture(scope="session")
def inputs() -> dict[str, Any]:
    """Inputs that contain those of every claim here."""
    scenario = load("case_a")[0]
    return SafeDist().inputs(scenario) | SafeGate().inputs(scenario)


@pytest.fixture(scope="session")
def found(judged: Judged) -> dict[str, Finding]:
    """Findings on case A."""
    scenario = load("case_a")[0]
    return {claim.id: judged(claim, claim.inputs(scenario)) for claim in CLAIMS}
