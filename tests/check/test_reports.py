"""Reports as written agree everywhere, whatever the scenario."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from airground_drake import check
from airground_drake.report.__main__ import main as write


def test_an_untouched_report_agrees_everywhere(report: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main([str(report)]) == 0
    *lines, summary = capsys.readouterr().out.splitlines()
    claims = json.loads((report / "report.json").read_text())["claims"]
    assert {(claim["id"], claim["run"] or "-") for claim in claims} <= {tuple(line.split()[:2]) for line in lines}
    assert all(" agrees: " in line for line in lines)
    assert summary == f"{len(lines)} checks: {len(lines)} agrees, 0 DISAGREES, 0 cannot be re-established"


GATED = ("runs={c: {method: c}, d: {method: d}}", "reproduction=[]")
"""The runs that have a gatekeeper: the others are those of the report above."""


@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        (["gatekeeper.switching_margin=0", "gatekeeper.min_dwell_s=0.3", *GATED], {"reversed", "dwell", "not_cheaper"}),
        (["ugvs.ugv1.preset.speed_m_s=0.2", "ugvs.ugv2.preset.speed_m_s=0.2"], set()),  # nothing triggers
        (["gatekeeper.period_s=30", *GATED], set()),  # a proposal, and the run ends before a decision is due
        (["decision.trigger=bare", "duration_s=11.01"], {"not_cheaper"}),  # ZENO-PROOF is refuted by a run
    ],
)
def test_reports_of_changed_scenarios_agree(
    changes: list[str], reasons: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [word for change in changes for word in ("--set", change)]
    assert write(["case_b", "-o", str(tmp_path / "r"), "--format", "json", "-q", *settings]) in (0, 1)
    assert capsys.readouterr() == ("", "")
    found = set(pd.read_parquet(tmp_path / "r/trace/c/decisions.parquet")["reason"])
    assert reasons <= found if reasons else not found
    assert check.main([str(tmp_path / "r")]) == 0, capsys.readouterr().out
