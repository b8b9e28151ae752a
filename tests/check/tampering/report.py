"""Tampering with report.json and the scenario."""

from __future__ import annotations

import shutil
from pathlib import Path

from check.tampering.base import (
    RUN,
    UGV,
    claim_of,
    edited_claim,
    edited_entries,
    edited_report,
    edited_scenarios,
    ignored,
    refused_by,
    trace,
)

GATED = ("GATE-FEAS", "GATE-MODEL", "LIVE-PROG")


@refused_by("SAFE-TRACE", "as expected", run="b")
def verdict_flipped(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE", "b") as claim:
        claim["status"] = "holds"


@refused_by("SAFE-TRACE", "verdict", run="b")
def refutation_hidden_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"]["b"]["expected"] = {}
    with edited_report(folder) as report:
        for claim in ("SAFE-TRACE", "SAFE-HYP"):
            claim_of(report, claim, "b").update(status="holds", expected="holds", counterexample=None)
        counts = report["overall"]["counts"]
        counts["holds"] += counts.pop("refuted")


@refused_by("SAFE-TRACE", "verdict", run="b")
def refutation_left_undecided_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"]["b"]["expected"]["SAFE-TRACE"] = "inconclusive"
    with edited_report(folder) as report:
        claim = claim_of(report, "SAFE-TRACE", "b")
        claim.update(status="inconclusive", expected="inconclusive", counterexample=None)
        counts = report["overall"]["counts"]
        counts.update(refuted=counts["refuted"] - 1, inconclusive=1)


@refused_by("SAFE-TRACE", "as expected")
def refuted_though_it_holds(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim.update(status="refuted", counterexample={"t_s": 1.0})


@refused_by("GATE-FEAS", "verdict")
def refuted_by_no_rule(folder: Path) -> None:
    """A claim is called refuted, and expected to be; no rule of it is broken."""
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"][RUN]["expected"]["GATE-FEAS"] = "refuted"
    with edited_claim(folder, "GATE-FEAS") as claim:
        claim.update(status="refuted", expected="refuted", counterexample={"t_s": 1.0}, margin=None)


@refused_by("LIVE-GOAL", "margin")
def margin_changed(folder: Path) -> None:
    with edited_claim(folder, "LIVE-GOAL") as claim:
        claim["margin"] = 0.09


@refused_by("SAFE-TRACE", "margin")
def margin_removed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim["margin"] = None


@refused_by("SAFE-HYP", "margin", run="b")
def margin_of_the_broken_hypothesis_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        claim["margin"] = -8.0


@refused_by("SAFE-HYP", "hypothesis broken first", run="b")
def broken_hypothesis_renamed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        claim["where"]["hypothesis"] = "speed limit"


@refused_by("ZENO-TRACE", "margin")
def time_between_triggers_invented(folder: Path) -> None:
    with edited_claim(folder, "ZENO-TRACE") as claim:
        claim.update(margin=0.5, unit="s")


@refused_by("THR-TRIG", "margin")
def margin_of_the_trigger_changed(folder: Path) -> None:
    with edited_claim(folder, "THR-TRIG") as claim:
        claim["margin"] = 5e-6


@refused_by("GATE-FEAS", "margin")
def margin_above_the_tolerance(folder: Path) -> None:
    with edited_claim(folder, "GATE-FEAS") as claim:
        claim["margin"] = 1.5


@refused_by("GATE-OPT", "margin", run="c")
def margin_of_the_gap_changed(folder: Path) -> None:
    with edited_claim(folder, "GATE-OPT", "c") as claim:
        claim["margin"] = 0.049


@refused_by("SAFE-TRACE", "least distance")
def distance_in_the_evidence_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim["evidence"]["pairs"][3]["min_distance_m"] += 0.1


@refused_by("SAFE-TRACE", "distance at the recorded time")
def time_of_a_minimum_moved(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim["evidence"]["pairs"][3]["t_s"] += 1.0


@refused_by("SAFE-TRACE", "pair of least margin", run="b")
def crash_blamed_on_another_obstacle(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE", "b") as claim:
        claim["where"]["second"] = "obstacle_1"


@refused_by("SAFE-TRACE", "pairs")
def pair_removed_from_the_evidence(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        del claim["evidence"]["pairs"][0]


@refused_by("SAFE-HYP", "evidence")
def inequalities_invented(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP") as claim:
        claim["evidence"]["inequalities_in_range"] += 1000


@refused_by("SAFE-HYP", "promised distance", run="b")
def more_distance_promised(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        claim["evidence"]["pairs"][0]["guarantee_m"] = claim["evidence"]["guarantee_m"] = 2.0


@refused_by("SAFE-HYP", "what is missed", run="b")
def shortfall_hidden(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        claim["evidence"]["pairs"][0]["e_m"] = claim["evidence"]["e_m"] = 0.0


@refused_by("SAFE-HYP", "a pair that misses something is listed", run="b")
def pair_that_misses_something_left_out(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        del claim["evidence"]["pairs"][0]


@refused_by("COMM", "evidence")
def messages_in_the_evidence_changed(folder: Path) -> None:
    with edited_claim(folder, "COMM") as claim:
        claim["evidence"]["spent"]["proposal"] = 1


@refused_by("LIVE-GOAL", "evidence")
def condition_at_the_end_removed(folder: Path) -> None:
    with edited_claim(folder, "LIVE-GOAL") as claim:
        del claim["evidence"]["conditions"][0]


@refused_by("metrics", "decision times")
def median_time_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"][RUN]["metrics"]["gatekeeper"]["time_s"]["p50"] = 1e-4


@refused_by("metrics", "decisions that took a period or longer")
def late_decision_invented(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"][RUN]["metrics"]["gatekeeper"]["late"] = 1


@refused_by("THR-TRIG", "a counterexample comes with a refutation")
def counterexample_invented(folder: Path) -> None:
    with edited_claim(folder, "THR-TRIG") as claim:
        claim["counterexample"] = {"t_s": 1.0}


@refused_by("SAFE-HYP", "a counterexample comes with a refutation", run="b")
def counterexample_removed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP", "b") as claim:
        claim["counterexample"] = None


@refused_by("report", "the method is known", run="")
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


@refused_by("report", "claims that there are", run="")
def claim_removed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["claims"].remove(claim_of(report, "SAFE-HYP", "b"))


@refused_by("report", "claims that there are", run="")
def proof_removed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["claims"].remove(claim_of(report, "SAFE-INV", ""))


@refused_by("report", "claims that there are", run="")
def claim_twice(folder: Path) -> None:
    with edited_report(folder) as report:
        report["claims"].append(claim_of(report, "COMM"))


@refused_by("SAFE-ALL", "expected verdict")
def claim_unknown(folder: Path) -> None:
    with edited_report(folder) as report:
        report["claims"].append({**claim_of(report, "COMM"), "id": "SAFE-ALL"})


@refused_by("report", "claims that there are", run="")
def run_removed(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["runs"]["b"]
        report["claims"] = [claim for claim in report["claims"] if claim["run"] != "b"]


@refused_by("report", "claims that there are", run="")
def run_removed_everywhere_but_in_the_scenario(folder: Path) -> None:
    run_removed(folder)
    shutil.rmtree(trace(folder, "b"))


@refused_by("SAFE-TRACE", "expected verdict", run="b")
def expectation_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE", "b") as claim:
        claim["expected"] = "holds"


@refused_by("SAFE-TRACE", "as expected", run="b")
def expectation_flag_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE", "b") as claim:
        claim["as_expected"] = False


@refused_by("report", "verdict over all", run="")
def overall_status_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["status"] = "inconclusive"


@refused_by("report", "verdict over all", run="")
def exit_code_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["exit_code"] = 4


@refused_by("report", "verdict over all", run="")
def counts_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["counts"]["holds"] = 99


@refused_by("report", "verdict over all", run="")
def number_of_checks_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["checks"] += 1


@refused_by("report", "verdict over all", run="")
def difference_invented(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["differs"] = [{"id": "COMM", "run": "d", "status": "refuted", "expected": "holds"}]


@refused_by("report", "choice", run="")
def calibrated_value_misquoted(folder: Path) -> None:
    with edited_report(folder) as report:
        report["choices"][0]["ours"] = 1.0


@refused_by("report", "number of choices", run="")
def calibrated_value_concealed(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["choices"][0]


@refused_by("report", "name of the scenario", run="")
def scenario_renamed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["scenario"]["name"] = "case_a"


@refused_by("trace", "scenario of the trace")
def safe_distance_changed_in_the_report(folder: Path) -> None:
    with edited_report(folder) as report:
        report["scenario"]["resolved"]["safe_distance"]["obstacle_m"] = 1.0


@refused_by("SAFE-TRACE", "margin of a pair")
def safe_distance_changed_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["safe_distance"]["obstacle_m"] = 1.5


@refused_by("trace", "scenario of the trace")
def obstacle_made_larger_in_the_report(folder: Path) -> None:
    with edited_report(folder) as report:
        report["scenario"]["resolved"]["obstacles"]["obstacle_1"]["radius_m"] = 0.3


@refused_by("SAFE-TRACE", "margin of a pair")
def obstacle_made_larger_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["obstacles"]["obstacle_1"]["radius_m"] = 0.01


@refused_by("metrics", "safe distance")
def robot_made_larger_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["ugvs"]["ugv1"]["radius_m"] = 0.01


@refused_by("SAFE-INV", "inputs", run="")
def gain_changed_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["control"]["avoidance_gain_1_s"] = 5.0


@refused_by("SAFE-INV", "margin of a hypothesis", run="")
def gain_changed_everywhere_and_in_the_inputs(folder: Path) -> None:
    gain_changed_everywhere(folder)
    with edited_report(folder) as report:
        for claim in ("SAFE-INV", "SAFE-GATE", "SAFE-DIST"):
            claim_of(report, claim, "")["inputs"]["avoidance_gain_1_s"] = 5.0


@refused_by("THR-ROOT", "(19) changes its sign in the enclosure", run="")
def drift_changed_everywhere_and_in_the_inputs(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["decision"]["threshold"]["drift_m_s"] = 5.0
    with edited_report(folder) as report:
        for claim in ("THR-ROOT", "THR-OPT", "THR-DDM"):
            claim_of(report, claim, "")["inputs"]["drift_m_s"] = 5.0


@refused_by("SAFE-TRACE", "pairs")
def obstacle_removed_everywhere(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            del scenario["obstacles"]["sudden"]


@refused_by("LIVE-GOAL", "verdict")
def stall_declared_where_none_was(folder: Path) -> None:
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"][RUN]["stalls_m"] = {UGV: [3.3, 13.0, 0.0]}


@ignored("texts: no verdict follows from what a claim says of itself, and the checker does not hold a copy of it")
def statement_of_a_claim_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        claim["statement"] = "Every robot kept every distance, always and everywhere."


@ignored("the reproduction of the paper's numbers takes measures of its own, which no claim is about")
def reproduction_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["reproduction"][0].update(status="not_reproduced", ours=0.0)


@refused_by("SAFE-TRACE", "things in the counterexample", run="b")
def snapshot_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE", "b") as claim:
        claim["counterexample"]["positions_m"] = {}
