"""Findings about the model, made once in a session however many modules and workers look at them."""

import json
from typing import Any

import pytest
from verify.judging import Judged

from airground_drake.scenario.load import load
from airground_drake.verify.cache import cache_folder, cached_finding
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding


@pytest.fixture(scope="session")
def judged() -> Judged:
    """`judged(claim, inputs)`: the finding on a claim, on case A by default, which its report has, too.

    Tests that patch something must judge themselves.
    """
    case_a = load("case_a")
    made: dict[tuple[str, str], Finding] = {}

    def get(claim: ModelClaim, inputs: dict[str, Any] | None = None) -> Finding:
        given = claim.inputs(case_a) if inputs is None else inputs
        key = claim.id, json.dumps(given, sort_keys=True)
        if key not in made:
            made[key] = cached_finding(claim, given, cache_folder())
        return made[key]

    return get
