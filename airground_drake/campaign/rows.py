"""The dataset of a campaign: a row is what a claim says of a run."""

from __future__ import annotations

from typing import Any

from airground_drake.base.statuses import NOT_EXERCISED, outcome

COLUMNS: dict[str, str] = {
    "index": "int64", "run": "str", "method": "str", "ended": "str", "what": "str", "claim": "str", "status": "str",
    "as_expected": "bool", "margin": "float64", "unit": "str", "exercised": "float64", "ugvs": "int64",
    "triggers": "int64", "first_trigger_s": "float64", "arrived": "int64", "arrival_s": "float64",
    "decisions": "int64", "accepted": "int64", "faults": "int64", "duration_s": "float64",
    "intervened_s": "float64", "wall_s": "float64",
    "drawn": "str", "digest": "str",
}  # fmt: skip
"""Columns of the dataset and their types: a row is what a claim says of a run; NaN where there is no such number.

`ended` is `judged`, or what kept a draw from it, explained in `what`: `invalid` (no valid scenario), `stopped` (the
simulation), `died` (its process); such a row has no claim, nor has that of a run that no claim is about. `drawn` is
strict JSON: values by key; `digest` is of all rows of a draw (see `store`)."""

JUDGED, INVALID, STOPPED, DIED = "judged", "invalid", "stopped", "died"
UNFINISHED = (STOPPED, DIED)
"""Every claim of such a run is undecided; of all runs of a draw where a row names none."""

TIMES = ("first_trigger_s", "arrival_s", "intervened_s", "wall_s")
"""Columns whose distributions are shown, s."""

Row = dict[str, Any]


def is_tested(status: str, exercised: float) -> bool:
    """Whether something could have refuted the claim of a row; assumed where it was not counted (NaN)."""
    return outcome(status, exercised) != NOT_EXERCISED


def blank() -> Row:
    """A row with empty values."""
    kinds: dict[str, Any] = {"int64": 0, "float64": float("nan"), "str": "", "bool": False}
    return {name: kinds[kind] for name, kind in COLUMNS.items()}
