"""How often claims were put to the test is counted again, for every claim on every run, and compared."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from check.tampering.base import attempt, edited_report, read_json
from check.tampering.counts import COUNT

from airground_drake.check import claims as checker
from airground_drake.statuses import EXPECTATIONS, STATUSES, meets, outcome


@pytest.mark.parametrize("by", [1, -1])
def test_every_count_that_is_too_large_or_too_small_is_refused(report: Path, by: int) -> None:
    def edit(folder: Path) -> None:
        with edited_report(folder) as document:
            for claim in document["claims"]:
                claim["exercised"] += by
                claim["as_expected"] = meets(claim["expected"], claim["status"], claim["exercised"])

    refused = {(entry["claim"], entry["run"]) for entry in attempt(report, edit).refused if entry["rule"] == COUNT}
    claims = {(claim["id"], claim["run"]) for claim in read_json(report / "report.json")["claims"]}
    assert refused == claims
    assert len(claims) > 35


@pytest.mark.parametrize("count", [None, 0, 1, 17])
def test_expectations_and_outcomes_mean_the_same_to_the_checker(count: int | None) -> None:
    for status, one, other in product(STATUSES, EXPECTATIONS, EXPECTATIONS):
        claim = {"status": status, "exercised": count}
        for expected in (one, f"{one} or {other}"):
            assert checker.meets(expected, claim) == meets(expected, status, count), (expected, claim)
        assert checker.outcome_of(claim) == outcome(status, count)
