"""The audit of the paper: each finding with the paper's formula, ours, and evidence by a run, a proof or a computation.

`of_runs` makes the findings that the runs of a report show. `whole` makes the others, which rest on runs of other
scenarios or on formulas alone: `python -m airground_drake.report audit`.
"""

from collections.abc import Sequence

from airground_drake.report.audit.item import Item
from airground_drake.report.audit.runs import of_runs
from airground_drake.scenario.schema import Scenario
from airground_drake.verify import Verdict

__all__ = ["of_runs", "whole"]


def whole(scenario: Scenario, verdicts: Sequence[Verdict]) -> list[Item]:
    """All findings but those of the scenario's own runs."""
    from airground_drake.report.audit.companions import companion_findings  # imports Drake
    from airground_drake.report.audit.formulas import formula_findings
    from airground_drake.report.audit.thresholds import threshold_findings

    proofs = {verdict.claim.id: verdict for verdict in verdicts if not verdict.run}
    return [*threshold_findings(scenario, proofs), *formula_findings(scenario), *companion_findings()]
