"""Tampering with how often claims were put to the test."""

from __future__ import annotations

from pathlib import Path

from check.tampering.base import RUN, claim_of, edited_claim, edited_report, edited_scenarios, ignored, refused_by

COUNT = "how often the claim was exercised"


def changed(folder: Path, claim: str, by: int, run: str = RUN) -> None:
    """A count that is larger or smaller."""
    with edited_claim(folder, claim, run) as entry:
        entry["exercised"] += by


@refused_by("ZENO-TRACE", COUNT)
def count_raised_from_none(folder: Path) -> None:
    """As a claim that always says that it was exercised."""
    changed(folder, "ZENO-TRACE", 1)
    with edited_report(folder) as report:
        report["overall"]["counts"]["holds"] += 1
        report["overall"]["counts"]["not_exercised"] -= 1
        report["overall"]["not_exercised"].remove({"id": "ZENO-TRACE", "run": RUN})


@refused_by("ZENO-TRACE", COUNT)
def count_left_out(folder: Path) -> None:
    with edited_claim(folder, "ZENO-TRACE") as claim:
        claim["exercised"] = None


@refused_by("THR-TRIG", COUNT)
def count_is_a_truth_value(folder: Path) -> None:
    with edited_claim(folder, "THR-TRIG") as claim:
        claim["exercised"] = True


@refused_by("THR-TRIG", COUNT)
def transition_not_counted(folder: Path) -> None:
    changed(folder, "THR-TRIG", -1)


@refused_by("SAFE-TRACE", "a period at full speed breaks it")
def distant_pair_called_close(folder: Path) -> None:
    with edited_claim(folder, "SAFE-TRACE") as claim:
        pair = next(entry for entry in claim["evidence"]["pairs"] if not entry["exercised"])
        pair["exercised"] = True


@refused_by("SAFE-HYP", "inequalities that bind")
def contact_of_two_ugvs_invented(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP") as claim:
        claim["evidence"]["inequalities_that_bind"]["ugv beside ugv"] += 3
        claim["exercised"] += 3


@refused_by("SAFE-HYP", "kinds of inequalities")
def kind_of_inequality_renamed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-HYP") as claim:
        binding = claim["evidence"]["inequalities_that_bind"]
        binding["uav beside uav"] = binding.pop("ugv beside ugv")


@refused_by("SAFE-LEMMA", COUNT, run="")
def obligation_counted_twice(folder: Path) -> None:
    changed(folder, "SAFE-LEMMA", 1, "")


@refused_by("report", "verdict over all", run="")
def unexercised_counted_as_passes(folder: Path) -> None:
    with edited_report(folder) as report:
        counts = report["overall"]["counts"]
        counts["holds"] += counts.pop("not_exercised")


@refused_by("report", "verdict over all", run="")
def unexercised_not_listed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["overall"]["not_exercised"] = []


@refused_by("ZENO-TRACE", "as expected")
def exercise_expected_everywhere_and_missed(folder: Path) -> None:
    """The scenario demands that something put the claim to the test; nothing did, and nobody says so."""
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["runs"][RUN]["expected"]["ZENO-TRACE"] = "exercised"
    with edited_claim(folder, "ZENO-TRACE") as claim:
        claim["expected"] = "exercised"


@refused_by("SAFE-TRACE", "expected verdict")
def demand_for_exercise_dropped(folder: Path) -> None:
    with edited_report(folder) as report:
        claim = claim_of(report, "SAFE-TRACE")
        assert claim["expected"] == "exercised"
        claim["expected"] = "holds"


@ignored("texts: what is counted is said in words, and the checker counts what the claim's own text says")
def words_of_what_is_counted_changed(folder: Path) -> None:
    with edited_claim(folder, "ZENO-TRACE") as claim:
        claim["exercised_by"] = "seconds"
