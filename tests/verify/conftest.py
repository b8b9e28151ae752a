"""Findings about the model, made once in a session however many modules look at them."""

from __future__ import annotations

import json
from typing import Any

import pytest
from verify.judging import Judged

from airground_drake.verify.claim import ModelClaim, Mutant
from airground_drake.verify.finding import Finding


@pytest.fixture(scope="session")
def judged() -> Judged:
    """`judged(claim, inputs)`: the finding on a claim or a mutant. Tests that patch something must judge themselves."""
    made: dict[tuple[str, str], Finding] = {}

    def get(claim: ModelClaim | Mutant, inputs: dict[str, Any]) -> Finding:
        mutant = isinstance(claim, Mutant)
        key = f"{claim.claim}: {claim.says}" if mutant else claim.id, json.dumps(inputs, sort_keys=True)
        if key not in made:
            made[key] = claim.check(inputs) if mutant else claim.judge(inputs)
        return made[key]

    return get
