"""Findings about avoidance, made once."""

from __future__ import annotations

from typing import Any

import pytest
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
def found(inputs: dict[str, Any]) -> dict[str, Finding]:
    return {claim.id: claim.judge(inputs) for claim in CLAIMS}
