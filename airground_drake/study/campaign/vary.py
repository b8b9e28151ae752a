"""What one imperfection costs: distances in the law, and arrivals, by the value of a key."""

from collections.abc import Collection, Sequence
from typing import Any

import pandas as pd

from airground_drake.base.errors import ScenarioError
from airground_drake.report import rules
from airground_drake.scenario.budget import budget
from airground_drake.scenario.load import validated
from airground_drake.scenario.schema import Scenario
from airground_drake.study.campaign.rows import JUDGED
from airground_drake.study.campaign.sweep import sweep

# What is told of a kind of pair: the distance promised between the surfaces, and what the law keeps for it.
PROMISED, LAW = "promised_m", "law_m"
# Values of a key that is given without any, by its unit; the last entry is for shares.
VALUES = {"_s": (0.0, 0.1, 0.3, 1.0), "_m": (0.0, 0.02, 0.05, 0.1), "": (0.0, 0.1, 0.5)}

MEANING = "metres, by kind of pair: the distance promised between surfaces -> the distance that the law keeps"


def usual_values(key: str) -> tuple[float, ...]:
    """Values to try where none are given: of a time, a length, or a share."""
    return next(values for unit, values in VALUES.items() if key.endswith(unit))


def vary(
    scenario: Scenario, key: str, values: Sequence[Any], runs: Collection[str] = (), jobs: int = 1
) -> pd.DataFrame:
    """The runs of a scenario for each value of a key, beside what its distances cost.

    Args:
        scenario: from a file or made in Python.
        key: dotted, such as `ugvs.ugv1.plant.time_constant_s`.
        values: to be tried. One that the scenario cannot have gives rows whose `ended` is `invalid`.
        runs: names of runs; default: all of the scenario.
        jobs: number of processes.

    Returns:
        The rows of `sweep` with the claim about distances; and for each kind of pair KIND (`ugv`, `air_ground`,
        `obstacle`, `moving`) the columns `KIND promised_m` and `KIND law_m`, of the pair to which the most is added.

    Raises:
        ScenarioError: if the key does not exist.
        UnknownNameError: if a run does not exist.
    """
    rows = sweep(scenario, {key: values}, runs, [rules.DISTANCES], jobs)
    return rows.merge(pd.DataFrame({"index": k} | _costs(scenario, key, value) for k, value in enumerate(values)))


def _costs(scenario: Scenario, key: str, value: object) -> dict[str, float]:
    """By kind of pair, the distance promised and the one in the law; nothing for a value that is refused."""
    try:
        pairs = budget(validated(scenario, {key: value}))
    except ScenarioError:
        return {}
    dearest = {pair.kind: pair for pair in sorted(pairs, key=lambda pair: pair.gap_m - pair.promised_m)}
    return {
        f"{kind} {name}": metres
        for kind, pair in dearest.items()
        for name, metres in ((PROMISED, pair.promised_m), (LAW, pair.gap_m))
    }


def as_text(rows: pd.DataFrame, key: str) -> str:
    """A line for each value and run; below, what its columns mean, and the reasons of what was not judged."""
    judged = rows["ended"] == JUDGED
    shown = rows[[key, "run", "ended"]].copy()
    for law in rows.columns[rows.columns.str.endswith(LAW)]:
        kind = law.removesuffix(LAW)
        promised = rows[f"{kind}{PROMISED}"].map("{:.3f}".format)
        shown[f"{kind}m"] = (promised + rows[law].map(" -> {:.3f}".format)).where(rows[law].notna(), "-")
    shown["arrived"] = (rows["arrived"].map(str) + " of " + rows["ugvs"].map(str)).where(judged, "-")
    shown["last at, s"] = rows["arrival_s"].round(2)
    shown[rules.DISTANCES] = rows[rules.DISTANCES].fillna("-") if rules.DISTANCES in rows else "-"
    return "\n".join([shown.to_string(index=False, na_rep="-"), "", MEANING, *dict.fromkeys(rows["what"][~judged])])
