"""Every tampering is refused, by the claim and the rule that it breaks."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from check.tampering import IGNORED, NO_REPORT, TAMPERINGS, attempt
from check.tampering.base import copy


@pytest.mark.parametrize("name", TAMPERINGS)
def test_a_tampered_report_is_refused_by_the_rule_that_it_breaks(report: Path, name: str) -> None:
    outcome = attempt(report, TAMPERINGS[name].edit, mended=TAMPERINGS[name].mended)
    found = [(entry["claim"], entry["run"], entry["rule"]) for entry in outcome.refused]
    assert outcome.is_by(TAMPERINGS[name]), (outcome.code, found, outcome.error)
    assert all(entry["rule"] and entry["text"] for entry in outcome.refused)


@pytest.mark.parametrize("name", IGNORED)
def test_what_is_not_noticed_is_listed_with_its_reason(report: Path, name: str) -> None:
    edit, why = IGNORED[name]
    outcome = attempt(report, edit)
    assert outcome.code == 0, outcome.refused
    assert len(why.split()) > 5


def test_there_are_many_tamperings_with_every_claim() -> None:
    assert len(TAMPERINGS) >= 250
    by_claim = Counter(tampering.claim for tampering in TAMPERINGS.values())
    assert {"trace", "events", "metrics", "report", NO_REPORT, "THR-DDM", "ZENO-REFINE"} <= set(by_claim)


def test_a_copy_that_was_tampered_with_is_mended(report: Path, tmp_path: Path) -> None:
    folder = copy(report, tmp_path)
    TAMPERINGS["position_changed"].edit(folder)
    TAMPERINGS["trace_folder_added"].edit(folder)
    TAMPERINGS["timings_missing"].edit(folder)
    copy(report, folder)
    kept = {path.relative_to(folder): path for path in folder.rglob("*")}
    assert set(kept) == {path.relative_to(report) for path in report.rglob("*")}
    assert all(path.is_dir() or path.samefile(report / name) for name, path in kept.items())
