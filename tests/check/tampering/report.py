"""Tampering with report.json and the scenario."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from check.tampering.base import (
    RUN,
    UGV,
    claim_of,
    edited_claim,
    edited_entries,
    edited_report,
    edited_scenarios,
    named,
    set_everywhere,
    tampering,
    trace,
)

GATED = ("GATE-FEAS", "GATE-MODEL", "LIVE-PROG")


@tampering()
def refutation_hidden_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"]["b"]["expected"] = {}
    with edited_report(folder) as report:
        for claim in ("SAFE-TRACE", "SAFE-HYP"):
            claim_of(report, claim, "b").update(status="holds", expected="holds", counterexample=None)
        counts = report["overall"]["counts"]
        counts["holds"] += counts.pop("refuted")


@tampering()
def refutation_left_undecided_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"]["b"]["expected"]["SAFE-TRACE"] = "inconclusive"
    with edited_report(folder) as report:
        claim = claim_of(report, "SAFE-TRACE", "b")
        claim.update(status="inconclusive", expected="inconclusive", counterexample=None)
        counts = report["overall"]["counts"]
        counts.update(refuted=counts["refuted"] - 1, inconclusive=1)


@tampering()
def refuted_by_no_rule(folder: Path) -> None:
    """A claim is called refuted, and expected to be; no rule of it is broken."""
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"][RUN]["expected"]["GATE-FEAS"] = "refuted"
    with edited_claim(folder, "GATE-FEAS") as claim:
        claim.update(status="refuted", expected="refuted", counterexample={"t_s": 1.0}, margin=None)


@tampering()
def method_unknown(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"][RUN]["method"] = "D"
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["method"] = "D"
    with edited_report(folder) as report:
        report["claims"] = [c for c in report["claims"] if c["run"] != RUN or c["id"] not in GATED]
        report["overall"]["counts"]["holds"] -= len(GATED)


@tampering()
def run_removed_everywhere_but_in_the_scenario(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["runs"]["b"]
        report["claims"] = [claim for claim in report["claims"] if claim["run"] != "b"]
    shutil.rmtree(trace(folder, "b"))


EVERYWHERE: dict[str, tuple[Any, ...]] = {
    "safe_distance_changed_everywhere": ("safe_distance", "obstacle_m", 1.5),
    "obstacle_made_larger_everywhere": ("obstacles", "obstacle_1", "radius_m", 0.01),
    "obstacle_moved_everywhere": ("obstacles", "sudden", "position_m", [9.0, 9.0, 0.0]),
    "robot_made_larger_everywhere": ("ugvs", "ugv1", "radius_m", 0.01),
    "gain_changed_everywhere": ("control", "avoidance_gain_1_s", 5.0),
    "drift_changed_everywhere": ("decision", "threshold", "drift_m_s", 5.0),
    "stall_declared_where_none_was": ("runs", RUN, "stalls_m", {UGV: [3.3, 13.0, 0.0]}),
}
"""Values of the scenario that are changed in all its places, and nothing else."""
for _name, (*_path, _value) in EVERYWHERE.items():
    tampering()(named(_name, set_everywhere(*_path, value=_value)))
