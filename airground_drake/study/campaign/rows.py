"""The dataset of a campaign: a row has the verdict of a claim on a run."""

from typing import Any

from airground_drake.base.statuses import NOT_EXERCISED, outcome

# Columns of the dataset and their types; a number that does not exist is NaN.
#
# `ended` is `judged`, or the reason why not, explained in `what`: `invalid` (no valid scenario), `stopped` (the
# simulation), `died` (its process). Such a row has no claim, and neither has the row of a run without claims. In the
# row of a claim, `what` is the hypothesis that the run broke first, the robot that broke it, and the time. `drawn` is
# strict JSON: values by key. `engine` is the simulator of a run: the compiled loop, Drake, or both with bitwise equal
# results; or the loop without comparison, because a policy exceeded its wall-clock limit. A run of the loop that is
# only `screened` was judged by array judges, all others by the judge of traces. `digest` is the digest of all rows of a
# draw (see `store`).
COLUMNS: dict[str, str] = {
    "index": "int64", "run": "str", "method": "str", "ended": "str", "what": "str", "claim": "str", "status": "str",
    "as_expected": "bool", "margin": "float64", "unit": "str", "exercised": "float64", "ugvs": "int64",
    "triggers": "int64", "first_trigger_s": "float64", "arrived": "int64", "arrival_s": "float64",
    "decisions": "int64", "accepted": "int64", "faults": "int64", "duration_s": "float64",
    "intervened_s": "float64", "wall_s": "float64",
    "engine": "str", "drawn": "str", "digest": "str",
}  # fmt: skip

SCREENED, BATCH, DRAKE, BOTH, CLOCK = "screened", "batch", "drake", "both", "clock"
JUDGED, INVALID, STOPPED, DIED = "judged", "invalid", "stopped", "died"
UNFINISHED = (STOPPED, DIED)  # every claim of such a run is undecided; if the row names no run, every claim of the draw

TIMES = ("first_trigger_s", "arrival_s", "intervened_s", "wall_s")  # columns whose distributions are shown, s

Row = dict[str, Any]


def is_tested(status: str, exercised: float) -> bool:
    """Whether something could have refuted the claim of a row; assumed if it was not counted (NaN)."""
    return outcome(status, exercised) != NOT_EXERCISED


def blank() -> Row:
    kinds: dict[str, Any] = {"int64": 0, "float64": float("nan"), "str": "", "bool": False}
    return {name: kinds[kind] for name, kind in COLUMNS.items()}
