"""Tampering with claims about the model: theorems and experiments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from check.tampering.base import edited_claim, ignored, refused_by

THEOREMS = ("SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "LIVE-WAIT", "THR-ISO")


@refused_by("SAFE-INV", "margin of a hypothesis", run="")
def margin_of_a_hypothesis_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["hypotheses"][0]["margin"] = 0.9


@refused_by("LIVE-WAIT", "whether a hypothesis holds", run="")
def hypothesis_said_to_fail(folder: Path) -> None:
    with edited_claim(folder, "LIVE-WAIT", "") as claim:
        claim["evidence"]["hypotheses"][0]["holds"] = False


@refused_by("SAFE-DIST", "number of hypotheses", run="")
def hypothesis_removed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        del claim["evidence"]["hypotheses"][-1]


@refused_by("SAFE-INV", "number of hypotheses", run="")
def pair_left_out(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        del claim["evidence"]["hypotheses"][-1]
        claim["exercised"] -= 1


@refused_by("ZENO-PROOF", "number of hypotheses", run="")
def hypothesis_invented(folder: Path) -> None:
    with edited_claim(folder, "ZENO-PROOF", "") as claim:
        claim["evidence"]["hypotheses"].append({**claim["evidence"]["hypotheses"][0], "hypothesis": "all is well"})


@refused_by("THR-ISO", "how often the claim was exercised", run="")
def hypotheses_counted_twice(folder: Path) -> None:
    with edited_claim(folder, "THR-ISO", "") as claim:
        claim["exercised"] *= 2


@refused_by("ZENO-PROOF", "evidence", run="")
def more_triggers_admitted(folder: Path) -> None:
    with edited_claim(folder, "ZENO-PROOF", "") as claim:
        claim["evidence"]["most_triggers"] += 1


@refused_by("LIVE-WAIT", "evidence", run="")
def shorter_bound_claimed(folder: Path) -> None:
    with edited_claim(folder, "LIVE-WAIT", "") as claim:
        claim["evidence"]["bound_s"] = 1.0


@refused_by("SAFE-DIST", "evidence", run="")
def bound_of_a_disturbed_run_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["evidence"]["least_distances_m"] = {"obstacle": 1.9, "uav_ugv": 1.9}


@refused_by("SAFE-GATE", "inputs", run="")
def interventions_put_on_top(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["inputs"]["intervention_on_top"] = True


@refused_by("SAFE-INV", "inputs", run="")
def safe_distance_of_a_proof_lowered(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["inputs"]["pairs"][0]["safe_m"] = 0.5


@refused_by("SAFE-DIST", "inputs", run="")
def disturbance_lowered(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["inputs"]["disturbance_m_s"] = 0.01


def margin_raised(claim: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        with edited_claim(folder, claim, "") as entry:
            entry["margin"] += 0.1

    edit.__name__ = f"margin_of_{claim.lower().replace('-', '_')}_raised"
    return edit


for each in (*THEOREMS, "THR-OPT"):
    refused_by(each, "margin", run="")(margin_raised(each))


@refused_by("ZENO-PROOF", "verdict", run="")
def refuted_though_the_dwell_is_in_force(folder: Path) -> None:
    rows = [(0.0, 3.0, "INTERVENING", True), (0.1, 0.0, "SUPERVISING", False), (0.2, 3.0, "INTERVENING", True)]
    run = [dict(zip(("t_s", "x_m", "mode", "trigger"), row, strict=True)) for row in rows]
    with edited_claim(folder, "ZENO-PROOF", "") as claim:
        shown = {"run": run, "gap_s": 0.2, "bound_s": 0.5}
        claim.update(status="refuted", as_expected=False, margin=-0.3, counterexample=shown)


def edit_enclosure(folder: Path, claim: str, name: str, factors: tuple[float, float]) -> None:
    """Multiply the ends of an enclosure, and those of the threshold that belongs to it."""
    with edited_claim(folder, claim, "") as entry:
        for key in (f"{name}u", f"{name}zeta_m"):
            ends = entry["evidence"]["enclosures"][key]
            entry["evidence"]["enclosures"][key] = [end * by for end, by in zip(ends, factors, strict=True)]


@refused_by("THR-ROOT", "(19) changes its sign in the enclosure", run="")
def enclosure_moved(folder: Path) -> None:
    edit_enclosure(folder, "THR-ROOT", "", (1.001, 1.001))


@refused_by("THR-ROOT", "the enclosure is narrow", run="")
def enclosure_widened(folder: Path) -> None:
    edit_enclosure(folder, "THR-ROOT", "", (0.9, 1.1))


@refused_by("THR-OPT", "(19) changes its sign in the enclosure", run="")
def printed_root_moved(folder: Path) -> None:
    edit_enclosure(folder, "THR-OPT", "printed_", (1.001, 1.001))


@refused_by("THR-ROOT", "thresholds of the enclosure", run="")
def threshold_of_the_enclosure_changed(folder: Path) -> None:
    with edited_claim(folder, "THR-ROOT", "") as claim:
        claim["evidence"]["enclosures"]["zeta_m"] = [2.9, 2.9]


@refused_by("THR-ROOT", "the program's threshold is the root", run="")
def computed_threshold_changed(folder: Path) -> None:
    with edited_claim(folder, "THR-ROOT", "") as claim:
        claim["evidence"]["computed_threshold_m"] = 2.9


def edit_comparisons(folder: Path, edit: Any) -> None:
    """Change the comparisons of THR-DDM."""
    with edited_claim(folder, "THR-DDM", "") as claim:
        edit(claim["evidence"]["comparisons"])


@refused_by("THR-DDM", "interval of the error rate", run="")
def counts_of_paths_changed(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows:
            row["wrong_decisions"] += 50
            if row["quantity"] == "error rate":
                row["estimate"] = row["wrong_decisions"] / row["constants"]["paths"]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "number of comparisons", run="")
def experiments_removed_everywhere(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        del rows[2:]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "constants of an experiment", run="")
def experiment_made_easy(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows:
            row["constants"]["drift"] = 1.0

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "interval of the decision time", run="")
def interval_widened(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        rows[0]["interval"] = [0.0, 1.0]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "(18)", run="")
def formula_fitted(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        rows[1]["formula"] = rows[1]["estimate"]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "sum of squares", run="")
def variance_negative(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["periods_sum_of_squares"] = 1

    edit_comparisons(folder, edit)


def edit_comparison(folder: Path, **changes: Any) -> None:
    """Change keys of the first comparison of THR-DDM, in the evidence."""

    def edit(rows: list[Any]) -> None:
        rows[0].update(changes)

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "numbers of a comparison", run="")
def margin_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, margin=99.0)


@refused_by("THR-DDM", "numbers of a comparison", run="")
def score_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, z_score=0.0)


@refused_by("THR-DDM", "quantities", run="")
def unit_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, unit="h")


@refused_by("THR-DDM", "what a comparison consists of", run="")
def praise_put_into_a_comparison(folder: Path) -> None:
    edit_comparison(folder, proved_by_experts=True)


@refused_by("THR-DDM", "constants of an experiment", run="")
def seed_of_an_experiment_changed(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["constants"]["seed"] = 1

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "counts of an experiment are whole numbers", run="")
def half_a_period_counted(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["periods_sum"] += 0.5

    edit_comparisons(folder, edit)


def edit_counts(folder: Path, name: str, edit: Callable[[list[float]], list[float]]) -> None:
    """Change the trigger counts of every path of ZENO-REFINE."""
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        counts = claim["evidence"]["counts"]
        rows = [[float(n) for n in row.split()] for row in counts[name]]
        counts[name] = [" ".join(f"{n:g}" for n in edit(row)) for row in rows]


@refused_by("ZENO-REFINE", "verdict", run="")
def counts_of_triggers_raised(folder: Path) -> None:
    edit_counts(folder, "automaton", lambda row: [1000.0 * n for n in row])


@refused_by("ZENO-REFINE", "margin", run="")
def counts_of_triggers_lowered(folder: Path) -> None:
    edit_counts(folder, "automaton", lambda row: [min(n, 1.0) for n in row])


@refused_by("ZENO-REFINE", "evidence", run="")
def counts_of_the_quiet_series_changed(folder: Path) -> None:
    """No verdict follows from this series, but its mean is in the evidence."""
    edit_counts(folder, "automaton_at_scenario_noise", lambda row: [n + 1.0 for n in row])


@refused_by("ZENO-REFINE", "counts of every path at every step", run="")
def counts_of_a_step_missing(folder: Path) -> None:
    edit_counts(folder, "bare", lambda row: row[1:])


@refused_by("ZENO-REFINE", "counts are whole numbers", run="")
def half_a_trigger_counted(folder: Path) -> None:
    edit_counts(folder, "bare", lambda row: [n + 0.5 for n in row])


@refused_by("ZENO-REFINE", "inputs", run="")
def counts_of_triggers_raised_with_another_dwell(folder: Path) -> None:
    counts_of_triggers_raised(folder)
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["inputs"]["dwell_s"] = 1e-6


@refused_by("ZENO-REFINE", "evidence", run="")
def interval_of_the_exponent_moved(folder: Path) -> None:
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["evidence"]["fit"]["automaton"]["interval"] = [-0.001, 0.001]


@refused_by("ZENO-REFINE", "evidence", run="")
def theory_of_the_bare_count_changed(folder: Path) -> None:
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["evidence"]["expected_bare"][-1] *= 1.1


@ignored("what a theorem says is a text; `airground prove` checks the theorem itself")
def theorem_in_other_words(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["theorems"]["Safety.safe_always"] = "All robots are always safe."
