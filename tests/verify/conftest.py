"""Findings about the model, made once in a session however many modules and workers look at them."""

from __future__ import annotations

import json
from typing import Any

import pytest
from verify.judging import Judged

from airground_drake.verify.cache import cache_folder, find
from airground_drake.verify.claim import ModelClaim, Mutant
from airground_drake.verify.finding import Finding
from airground_drake.verify.mutants import MutantClaim


@pytest.fixture(scope="session")
def judged() -> Judged:
    """`judged(claim, inputs)`: the finding on a claim or a mutant. Tests that patch something must judge themselves."""
    made: dict[tuple[str, str], Finding] = {}

    def get(claim: ModelClaim | Mutant, inputs: dict[str, Any]) -> Finding:
        asked = MutantClaim(claim) if isinstance(claim, Mutant) else claim
        key = asked.id, json.dumps(inputs, sort_keys=True)
        if key not in made:
            (made[key],) = find([asked], [inputs], folder=cache_folder())
        return made[key]

    return get
